//! Pictures sent by the page: looked at by their header before anything is decoded.

use std::io::Cursor;
use std::path::Path;

use axum::http::StatusCode;
use image::codecs::png::PngEncoder;
use image::{DynamicImage, ExtendedColorType, ImageEncoder as _, ImageFormat, ImageReader, Limits};

use super::refusal::{Refusal, Result};
use crate::mask::Mask;

/// Most pixels of a picture, whatever its footage.
pub(super) const MOST_PIXELS: u64 = 64 << 20;

/// A decoder may take as much as the widest pixels of the largest picture.
const MOST_DECODER_BYTES: u64 = 16 * MOST_PIXELS;

const SIGNATURE: &[u8; 8] = b"\x89PNG\r\n\x1a\n";

/// Width and height that a PNG's header declares.
pub(super) fn declared_size(png: &[u8]) -> Result<(u32, u32)> {
    let Some(rest) = png.strip_prefix(SIGNATURE) else {
        return Err(Refusal::new(StatusCode::UNSUPPORTED_MEDIA_TYPE, "this is not a PNG"));
    };
    let broken = || Refusal::malformed("the PNG ends within its header");
    let (length, rest) = rest.split_first_chunk::<4>().ok_or_else(broken)?;
    let (kind, rest) = rest.split_first_chunk::<4>().ok_or_else(broken)?;
    let (width, rest) = rest.split_first_chunk::<4>().ok_or_else(broken)?;
    let (height, rest) = rest.split_first_chunk::<4>().ok_or_else(broken)?;
    if u32::from_be_bytes(*length) != 13 || kind != b"IHDR" {
        return Err(Refusal::malformed("the PNG does not begin with its header"));
    }
    let depth = rest.first().copied().ok_or_else(broken)?;
    if ![1, 2, 4, 8, 16].contains(&depth) {
        return Err(Refusal::malformed("the PNG has an impossible bit depth"));
    }
    Ok((u32::from_be_bytes(*width), u32::from_be_bytes(*height)))
}

/// Passes a PNG of a size, by its header.
fn check_size(png: &[u8], expected: (usize, usize)) -> Result<()> {
    let (width, height) = declared_size(png)?;
    if u64::from(width) * u64::from(height) > MOST_PIXELS {
        return Err(Refusal::too_large(format!(
            "a picture of {width} × {height} pixels is too large"
        )));
    }
    if (width as usize, height as usize) != expected {
        return Err(Refusal::unusable(format!(
            "the picture has {width} × {height} pixels, the footage {} × {}",
            expected.0, expected.1
        )));
    }
    Ok(())
}

fn decoded(png: &[u8], expected: (usize, usize)) -> Result<DynamicImage> {
    check_size(png, expected)?;
    let mut reader = ImageReader::with_format(Cursor::new(png), ImageFormat::Png);
    let mut limits = Limits::default();
    limits.max_image_width = u32::try_from(expected.0).ok();
    limits.max_image_height = u32::try_from(expected.1).ok();
    limits.max_alloc = Some(MOST_DECODER_BYTES);
    reader.limits(limits);
    reader.decode().map_err(|e| Refusal::malformed(format!("the PNG cannot be decoded: {e}")))
}

/// A mask as the pipeline stores it.
pub(super) fn mask(png: &[u8], expected: (usize, usize)) -> Result<Vec<u8>> {
    check_size(png, expected)?;
    let mask = Mask::from_image_bytes(Path::new("the picture"), png)
        .map_err(|e| Refusal::malformed(e.to_string()))?;
    Ok(mask.to_png()?)
}

/// Strokes: white, black or nothing. A picture without any transparency (a sketch) stays one.
pub(super) fn strokes(png: &[u8], expected: (usize, usize)) -> Result<Vec<u8>> {
    let rgba = decoded(png, expected)?.into_rgba8();
    let opaque = rgba.pixels().all(|p| p.0[3] == u8::MAX);
    let white = |[r, g, b, _]: [u8; 4]| {
        2126 * u32::from(r) + 7152 * u32::from(g) + 722 * u32::from(b) >= 1_275_000
    };
    let mut bytes = Vec::new();
    let encoder = PngEncoder::new(&mut bytes);
    let (width, height) = rgba.dimensions();
    let written = if opaque {
        let grey: Vec<u8> = rgba.pixels().map(|p| if white(p.0) { 255 } else { 0 }).collect();
        encoder.write_image(&grey, width, height, ExtendedColorType::L8)
    } else {
        let plain: Vec<u8> = rgba
            .pixels()
            .flat_map(|p| match (p.0[3] >= 128, white(p.0)) {
                (false, _) => [0, 0, 0, 0],
                (true, true) => [255, 255, 255, 255],
                (true, false) => [0, 0, 0, 255],
            })
            .collect();
        encoder.write_image(&plain, width, height, ExtendedColorType::Rgba8)
    };
    written.map_err(|_| Refusal::defect())?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use image::{Rgba, RgbaImage};

    use super::*;

    fn png(picture: &RgbaImage) -> Vec<u8> {
        let mut bytes = Cursor::new(Vec::new());
        picture.write_to(&mut bytes, ImageFormat::Png).unwrap();
        bytes.into_inner()
    }

    #[test]
    fn strokes_become_white_black_or_nothing() {
        let soft = RgbaImage::from_fn(4, 1, |x, _| match x {
            0 => Rgba([200, 210, 220, 255]),
            1 => Rgba([90, 20, 10, 130]),
            2 => Rgba([255, 255, 255, 100]),
            _ => Rgba([0, 0, 0, 0]),
        });
        let stored = strokes(&png(&soft), (4, 1)).unwrap();
        let back = image::load_from_memory(&stored).unwrap().into_rgba8();
        let pixels: Vec<_> = back.pixels().map(|p| p.0).collect();
        assert_eq!(pixels, [[255; 4], [0, 0, 0, 255], [0; 4], [0; 4]]);
        let sketch = RgbaImage::from_fn(2, 1, |x, _| Rgba([(x * 255) as u8, 255, 255, 255]));
        let stored = strokes(&png(&sketch), (2, 1)).unwrap();
        assert!(!image::load_from_memory(&stored).unwrap().color().has_alpha());
    }

    #[test]
    fn a_picture_is_refused_by_its_header() {
        let status = |bytes: &[u8]| mask(bytes, (4, 1)).unwrap_err().status;
        let good = png(&RgbaImage::new(4, 1));
        assert!(mask(&good, (4, 1)).is_ok());
        assert_eq!(status(b"GIF89a"), StatusCode::UNSUPPORTED_MEDIA_TYPE);
        for cut in 8..good.len() - 12 {
            assert_eq!(status(&good[..cut]), StatusCode::BAD_REQUEST, "{cut}");
        }
        assert_eq!(status(&png(&RgbaImage::new(1, 4))), StatusCode::UNPROCESSABLE_ENTITY);
        let mut bomb = good;
        bomb[16..20].copy_from_slice(&60_000_u32.to_be_bytes());
        bomb[20..24].copy_from_slice(&60_000_u32.to_be_bytes());
        assert_eq!(status(&bomb), StatusCode::PAYLOAD_TOO_LARGE);
    }
}
