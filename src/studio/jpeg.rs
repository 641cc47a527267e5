//! Frames as JPEG: quality 90, colour at full resolution.

use std::num::NonZeroU32;

use fast_image_resize::images::{Image, ImageRef};
use fast_image_resize::{FilterType, PixelType, ResizeAlg, ResizeOptions, Resizer};
use image::ExtendedColorType;
use image::codecs::jpeg::JpegEncoder;

use super::refusal::{Refusal, Result};
use crate::image::Picture;

const QUALITY: u8 = 90;

/// A frame as JPEG.
pub(super) fn encoded(picture: &Picture) -> Result<Vec<u8>> {
    rgb_encoded(picture.rgb(), picture.width() as u32, picture.height() as u32)
}

/// A JPEG made narrower, its proportions kept.
pub(super) fn narrowed(jpeg: &[u8], width: NonZeroU32) -> Result<Vec<u8>> {
    let full = image::load_from_memory_with_format(jpeg, image::ImageFormat::Jpeg);
    let full = full.map_err(|_| Refusal::defect())?.into_rgb8();
    let (from_width, from_height) = full.dimensions();
    let width = width.get().min(from_width);
    let share = f64::from(width) / f64::from(from_width);
    let height = ((f64::from(from_height) * share).round() as u32).max(1);
    let from = ImageRef::new(from_width, from_height, full.as_raw(), PixelType::U8x3)
        .map_err(|_| Refusal::defect())?;
    let mut to = Image::new(width, height, PixelType::U8x3);
    let options = ResizeOptions::new().resize_alg(ResizeAlg::Convolution(FilterType::Bilinear));
    Resizer::new().resize(&from, &mut to, &options).map_err(|_| Refusal::defect())?;
    rgb_encoded(to.buffer(), width, height)
}

fn rgb_encoded(rgb: &[u8], width: u32, height: u32) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    JpegEncoder::new_with_quality(&mut bytes, QUALITY)
        .encode(rgb, width, height, ExtendedColorType::Rgb8)
        .map_err(|_| Refusal::unusable("a frame of this size cannot be shown"))?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_keeps_its_colours_and_is_made_narrower() {
        let rgb: Vec<u8> =
            (0..64 * 32).flat_map(|i| [if i % 64 < 32 { 200 } else { 20 }, 90, 40]).collect();
        let picture = Picture::from_rgb(64, 32, rgb).unwrap();
        let full = encoded(&picture).unwrap();
        let half = narrowed(&full, NonZeroU32::new(32).unwrap()).unwrap();
        for (bytes, size) in [(full, (64, 32)), (half, (32, 16))] {
            let back = image::load_from_memory(&bytes).unwrap().into_rgb8();
            assert_eq!(back.dimensions(), size);
            let [left, right] = [4, size.0 - 4].map(|x| back.get_pixel(x, size.1 / 2).0);
            for (channel, expected) in [(left, [200, 90, 40]), (right, [20, 90, 40])] {
                for (a, b) in channel.into_iter().zip(expected) {
                    assert!(i32::from(a).abs_diff(b) < 8, "{channel:?}");
                }
            }
        }
    }
}
