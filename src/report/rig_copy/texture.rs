//! Textures at the size a small viewer needs.

use std::io::Cursor;

use ::image::imageops::FilterType;
use ::image::{DynamicImage, ImageFormat, ImageReader, Limits};

use crate::report::embedded::photograph;
use crate::rig::File;

/// Longest side of a texture in the page: the viewer is about as wide.
const LONGEST_SIDE_PX: u32 = 512;
/// What decoding a texture may take: a picture of 8192 × 8192 with opacity.
const MOST_BYTES: u64 = 1 << 28;

/// A texture, made small; `None` when it cannot be read.
pub(in crate::report) fn picture(file: &File, image: usize) -> Option<DynamicImage> {
    let bytes = file.image(image).ok()?;
    let mut reader = ImageReader::new(Cursor::new(&bytes)).with_guessed_format().ok()?;
    let mut limits = Limits::default();
    limits.max_alloc = Some(MOST_BYTES);
    reader.limits(limits);
    let texture = reader.decode().ok()?;
    if texture.width().max(texture.height()) > LONGEST_SIDE_PX {
        return Some(texture.resize(LONGEST_SIDE_PX, LONGEST_SIDE_PX, FilterType::Triangle));
    }
    Some(texture)
}

/// A texture as a JPEG, or as a PNG where it has opacity, with its media type; `None` when it cannot be
/// read.
pub(super) fn reduced(file: &File, image: usize) -> Option<(Vec<u8>, &'static str)> {
    let texture = picture(file, image)?;
    let clear =
        |t: &DynamicImage| t.color().has_alpha() && t.to_rgba8().pixels().any(|p| p[3] < 255);
    if clear(&texture) {
        let mut png = Vec::new();
        let pixels = texture.into_rgba8();
        pixels.write_to(&mut Cursor::new(&mut png), ImageFormat::Png).ok()?;
        return Some((png, "image/png"));
    }
    Some((photograph(&texture.into_rgb8()).ok()?, "image/jpeg"))
}
