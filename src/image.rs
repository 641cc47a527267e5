//! Pixels of one frame of footage, display-referred, 8 bits a channel.
//!
//! # How other pixel formats become 8 bits
//!
//! | stored as | becomes |
//! |---|---|
//! | 8 bit | itself |
//! | 16 bit | the nearest 8-bit value, `round(v · 255 / 65535)` |
//! | half, float | scene-linear light, clamped to [0, 1], then the sRGB curve (IEC 61966-2-1), rounded; NaN is 0 |
//! | grey | three equal channels |
//! | integer with alpha | straight alpha, laid over black in the stored values |
//! | float with alpha | premultiplied alpha (the convention of OpenEXR), so it lies over black already |
//!
//! Colour profiles in the file are not applied.

mod yuv;

use ::image::DynamicImage;
use rayon::prelude::*;

pub use yuv::{Frame, YuvConversion, YuvMatrix, YuvPicture};

use crate::error::{Error, Result};

/// One frame of footage: `width` × `height` pixels, rows from top to bottom, pixels from left to
/// right, three bytes a pixel in the order red, green, blue, display-referred (sRGB) values.
///
/// The invariant `rgb.len() == 3 * width * height` holds by construction.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    width: usize,
    height: usize,
    rgb: Vec<u8>,
}

impl Picture {
    /// A picture from its bytes; `None` when `rgb` has not `3 * width * height` of them.
    #[must_use]
    pub fn from_rgb(width: usize, height: usize, rgb: Vec<u8>) -> Option<Self> {
        let expected = width.checked_mul(height)?.checked_mul(3)?;
        (rgb.len() == expected).then_some(Self { width, height, rgb })
    }

    /// A grey picture from one byte a pixel; `None` when there are not `width * height`.
    #[must_use]
    pub fn from_grey(width: usize, height: usize, grey: &[u8]) -> Option<Self> {
        Self::from_rgb(width, height, grey.iter().flat_map(|&g| [g, g, g]).collect())
    }

    /// A picture from any decoded image, by the table at the head of this module.
    #[must_use]
    pub fn from_dynamic(image: &DynamicImage) -> Self {
        let rgb = match image {
            DynamicImage::ImageRgb32F(buffer) => encode_linear::<3>(buffer.as_raw()),
            DynamicImage::ImageRgba32F(buffer) => encode_linear::<4>(buffer.as_raw()),
            DynamicImage::ImageLuma16(_) | DynamicImage::ImageRgb16(_) => {
                image.to_rgb16().as_raw().iter().map(|&v| narrow(u64::from(v), 1)).collect()
            }
            DynamicImage::ImageLumaA16(_) | DynamicImage::ImageRgba16(_) => {
                over_black_16(image.to_rgba16().as_raw())
            }
            DynamicImage::ImageLumaA8(_) | DynamicImage::ImageRgba8(_) => {
                over_black_8(image.to_rgba8().as_raw())
            }
            _ => image.to_rgb8().into_raw(),
        };
        Self { width: image.width() as usize, height: image.height() as usize, rgb }
    }

    /// The picture as a PNG file, 8-bit RGB.
    ///
    /// # Errors
    /// [`Error::PngEncoding`] when the picture has no pixels or a side beyond what PNG can say.
    pub fn to_png_bytes(&self) -> Result<Vec<u8>> {
        use ::image::ImageEncoder as _;
        let (width, height) = (self.width, self.height);
        let failed = |source: Box<dyn std::error::Error + Send + Sync>| Error::PngEncoding {
            width,
            height,
            source,
        };
        let wide = u32::try_from(width).map_err(|e| failed(e.into()))?;
        let high = u32::try_from(height).map_err(|e| failed(e.into()))?;
        let mut bytes = Vec::new();
        ::image::codecs::png::PngEncoder::new(&mut bytes)
            .write_image(&self.rgb, wide, high, ::image::ExtendedColorType::Rgb8)
            .map_err(|e| failed(e.into()))?;
        Ok(bytes)
    }

    /// Width, pixels.
    #[must_use]
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height, pixels.
    #[must_use]
    pub fn height(&self) -> usize {
        self.height
    }

    /// All bytes, row by row, red green blue.
    #[must_use]
    pub fn rgb(&self) -> &[u8] {
        &self.rgb
    }

    /// The colour at column `x`, row `y` (0 at the top left).
    ///
    /// # Panics
    /// When `x` or `y` lies outside the picture.
    #[must_use]
    pub fn pixel(&self, x: usize, y: usize) -> [u8; 3] {
        assert!(x < self.width && y < self.height, "pixel outside the picture");
        let at = 3 * (y * self.width + x);
        [self.rgb[at], self.rgb[at + 1], self.rgb[at + 2]]
    }
}

/// A rectangle of pixels, `x` to the right and `y` down from the top left corner of the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Rectangle {
    /// Left column.
    pub x: usize,
    /// Top row.
    pub y: usize,
    /// Columns, at least 1.
    pub width: usize,
    /// Rows, at least 1.
    pub height: usize,
}

/// The sRGB opto-electronic curve (IEC 61966-2-1) from linear light to a code value 0 ..= 255.
/// Values outside [0, 1] are clamped, NaN is 0.
fn srgb_code(linear: f32) -> u8 {
    let x = if linear.is_nan() { 0.0 } else { linear.clamp(0.0, 1.0) };
    let encoded = if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 };
    (255.0 * encoded).round() as u8
}

/// Linear pixels of `CHANNELS` floats (red, green, blue first) to sRGB bytes.
fn encode_linear<const CHANNELS: usize>(values: &[f32]) -> Vec<u8> {
    /// Pixels a task takes at once: large enough that the tasks' overhead vanishes.
    const BLOCK: usize = 4096;
    let pixels = values.len() / CHANNELS;
    let mut rgb = vec![0; 3 * pixels];
    rgb.par_chunks_mut(3 * BLOCK).zip(values.par_chunks(CHANNELS * BLOCK)).for_each(
        |(out, block)| {
            for (to, from) in out.chunks_exact_mut(3).zip(block.chunks_exact(CHANNELS)) {
                to.copy_from_slice(&[srgb_code(from[0]), srgb_code(from[1]), srgb_code(from[2])]);
            }
        },
    );
    rgb
}

/// The nearest 8-bit value to `value / scale` of 16 bits.
fn narrow(value: u64, scale: u64) -> u8 {
    let whole = 65_535 * scale;
    ((value * 255 + whole / 2) / whole) as u8
}

fn over_black_16(rgba: &[u16]) -> Vec<u8> {
    rgba.chunks_exact(4)
        .flat_map(|p| {
            let alpha = u64::from(p[3]);
            [p[0], p[1], p[2]].map(|v| narrow(u64::from(v) * alpha, 65_535))
        })
        .collect()
}

fn over_black_8(rgba: &[u8]) -> Vec<u8> {
    rgba.chunks_exact(4)
        .flat_map(|p| {
            let alpha = u16::from(p[3]);
            [p[0], p[1], p[2]].map(|v| ((u16::from(v) * alpha + 127) / 255) as u8)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use ::image::{ImageBuffer, Luma, LumaA, Rgb, Rgba};
    use proptest::prelude::*;

    use super::*;

    fn one<P: ::image::Pixel>(pixel: P) -> ImageBuffer<P, Vec<P::Subpixel>> {
        ImageBuffer::from_pixel(1, 1, pixel)
    }

    #[test]
    fn float_takes_the_srgb_curve() {
        // Code values of the curve, from the standard's formula worked by hand in double precision.
        for (linear, code) in [
            (0.0_f32, 0),
            (1.0, 255),
            (0.5, 188),
            (0.18, 118),
            (0.001, 3),
            (-4.0, 0),
            (9.0, 255),
            (f32::NAN, 0),
            (f32::INFINITY, 255),
        ] {
            let picture = Picture::from_dynamic(&one(Rgb([linear; 3])).into());
            assert_eq!(picture.pixel(0, 0), [code; 3], "linear {linear}");
        }
    }

    #[test]
    fn premultiplied_float_ignores_alpha_and_straight_integers_do_not() {
        let float = Picture::from_dynamic(&one(Rgba([1.0_f32, 0.5, 0.0, 0.25])).into());
        assert_eq!(float.pixel(0, 0), [255, 188, 0]);
        let byte = Picture::from_dynamic(&one(Rgba([255_u8, 100, 0, 51])).into());
        assert_eq!(byte.pixel(0, 0), [51, 20, 0]);
        let word = Picture::from_dynamic(&one(LumaA([65_535_u16, 32_768])).into());
        assert_eq!(word.pixel(0, 0), [128; 3]);
    }

    #[test]
    fn a_png_reads_back_the_same() {
        let picture = Picture::from_rgb(5, 3, (0..45).map(|v| v * 5).collect()).unwrap();
        let back = ::image::load_from_memory(&picture.to_png_bytes().unwrap()).unwrap();
        assert_eq!(Picture::from_dynamic(&back), picture);
    }

    #[test]
    fn a_picture_without_pixels_is_no_png() {
        let picture = Picture::from_rgb(0, 0, Vec::new()).unwrap();
        assert!(matches!(picture.to_png_bytes(), Err(Error::PngEncoding { width: 0, .. })));
    }

    proptest! {
        #[test]
        fn sixteen_bits_round_to_the_nearest(value: u16) {
            let picture = Picture::from_dynamic(&one(Luma([value])).into());
            let expected = (f64::from(value) * 255.0 / 65_535.0).round() as u8;
            prop_assert_eq!(picture.pixel(0, 0), [expected; 3]);
        }

        #[test]
        fn alpha_lies_over_black(value: u8, alpha: u8) {
            let picture = Picture::from_dynamic(&one(LumaA([value, alpha])).into());
            let expected = (f64::from(value) * f64::from(alpha) / 255.0).round() as u8;
            prop_assert_eq!(picture.pixel(0, 0), [expected; 3]);
        }
    }
}
