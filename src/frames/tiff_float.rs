//! TIFF variants the image library does not take: grey floats, half floats, double floats.

use std::io::Cursor;

use ::image::{DynamicImage, Rgb32FImage, Rgba32FImage};
use tiff::ColorType;
use tiff::decoder::{Decoder, DecodingResult, Limits};

type Failure = Box<dyn std::error::Error + Send + Sync>;

/// Width and height the first picture of the file declares, pixels.
pub(super) fn size(bytes: &[u8]) -> Result<(usize, usize), Failure> {
    let (width, height) = Decoder::new(Cursor::new(bytes))?.dimensions()?;
    Ok((usize::try_from(width)?, usize::try_from(height)?))
}

/// Decodes the first picture of a floating-point TIFF; fails on integer samples, which the image
/// library reads.
pub(super) fn decode(bytes: &[u8]) -> Result<DynamicImage, Failure> {
    // The caller has checked the size of the picture; the library's own limit is lower than ours.
    let mut decoder = Decoder::new(Cursor::new(bytes))?.with_limits(Limits::unlimited());
    let (width, height) = decoder.dimensions()?;
    let channels = match decoder.colortype()? {
        ColorType::Gray(_) => 1,
        ColorType::GrayA(_) => 2,
        ColorType::RGB(_) => 3,
        ColorType::RGBA(_) => 4,
        other => return Err(format!("TIFF colour type {other:?}").into()),
    };
    let samples: Vec<f32> = match decoder.read_image()? {
        DecodingResult::F16(values) => values.into_iter().map(|v| v.to_f32()).collect(),
        DecodingResult::F32(values) => values,
        DecodingResult::F64(values) => values.into_iter().map(|v| v as f32).collect(),
        _ => return Err("TIFF samples are neither 8 nor 16 bits nor floating point".into()),
    };
    let image = match channels {
        1 | 3 => {
            let rgb = spread(&samples, channels, |p| {
                if channels == 1 { [p[0]; 3] } else { [p[0], p[1], p[2]] }
            });
            Rgb32FImage::from_raw(width, height, rgb).map(DynamicImage::from)
        }
        _ => {
            let rgba = spread(&samples, channels, |p| {
                if channels == 2 { [p[0], p[0], p[0], p[1]] } else { [p[0], p[1], p[2], p[3]] }
            });
            Rgba32FImage::from_raw(width, height, rgba).map(DynamicImage::from)
        }
    };
    image.ok_or_else(|| "the file holds fewer samples than its size says".into())
}

fn spread<const N: usize>(
    samples: &[f32],
    channels: usize,
    pixel: impl Fn(&[f32]) -> [f32; N],
) -> Vec<f32> {
    samples.chunks_exact(channels).flat_map(pixel).collect()
}

#[cfg(test)]
mod tests {
    use tiff::encoder::{TiffEncoder, colortype::Gray32Float, colortype::Gray64Float};

    use super::*;

    #[test]
    fn grey_floats_read_back() {
        let mut single = Cursor::new(Vec::new());
        TiffEncoder::new(&mut single)
            .unwrap()
            .write_image::<Gray32Float>(3, 1, &[0.0, 0.5, 2.0])
            .unwrap();
        let mut double = Cursor::new(Vec::new());
        TiffEncoder::new(&mut double)
            .unwrap()
            .write_image::<Gray64Float>(3, 1, &[0.0, 0.5, 2.0])
            .unwrap();
        for bytes in [single.into_inner(), double.into_inner()] {
            assert_eq!(size(&bytes).unwrap(), (3, 1));
            let image = decode(&bytes).unwrap().into_rgb32f();
            let expected = [0.0, 0.0, 0.0, 0.5, 0.5, 0.5, 2.0, 2.0, 2.0];
            assert_eq!(image.into_raw(), expected);
        }
    }
}
