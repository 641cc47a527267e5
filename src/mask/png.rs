//! Masks as PNG: written with one bit a pixel, read however a paint program saved them.

use std::io::{Cursor, Write as _};
use std::path::Path;

use ::image::{ImageReader, Limits};
use flate2::Compression;
use flate2::write::ZlibEncoder;

use super::Mask;
use super::png_rows::filtered;
use crate::error::{Error, Result};

/// A mask larger than this on a side is a mistake; decoding it could exhaust the memory.
const MAX_SIDE_PX: u32 = 16_384;

impl Mask {
    /// The mask as a 1-bit grey PNG, white where set. The same mask always gives the same bytes.
    ///
    /// # Errors
    /// [`Error::PngEncoding`] for a mask without pixels, which PNG cannot hold.
    pub fn to_png(&self) -> Result<Vec<u8>> {
        let mut bytes = Vec::new();
        self.encode(&mut bytes).map_err(|e| Error::PngEncoding {
            width: self.width(),
            height: self.height(),
            source: Box::new(e),
        })?;
        Ok(bytes)
    }

    fn encode(&self, bytes: &mut Vec<u8>) -> std::result::Result<(), ::png::EncodingError> {
        let mut encoder = ::png::Encoder::new(bytes, self.width() as u32, self.height() as u32);
        encoder.set_color(::png::ColorType::Grayscale);
        encoder.set_depth(::png::BitDepth::One);
        let mut writer = encoder.write_header()?;
        let mut packed = ZlibEncoder::new(Vec::new(), Compression::default());
        packed.write_all(&filtered(&self.png_rows(), self.width().div_ceil(8)))?;
        writer.write_chunk(::png::chunk::IDAT, &packed.finish()?)?;
        writer.finish()
    }

    /// The rows as PNG has them, each of whole bytes.
    fn png_rows(&self) -> Vec<u8> {
        let row_bytes = self.width().div_ceil(8);
        let mut data = vec![0; row_bytes * self.height()];
        for (y, to) in data.chunks_exact_mut(row_bytes.max(1)).enumerate() {
            for (to, word) in to.chunks_mut(8).zip(self.row(y)) {
                // PNG wants the leftmost pixel in the highest bit.
                to.copy_from_slice(&word.reverse_bits().to_be_bytes()[..to.len()]);
            }
        }
        data
    }

    /// Reads a mask from any image file: set where it is bright (luminance of one half or more) and
    /// not transparent (alpha of one half or more).
    ///
    /// # Errors
    /// [`Error::Picture`] naming `path` when the bytes are no picture, or one of over 16 384 pixels
    /// on a side.
    pub fn from_image_bytes(path: &Path, bytes: &[u8]) -> Result<Self> {
        if let Some(mask) = Self::from_png(bytes) {
            return Ok(mask);
        }
        Self::from_any_image(path, bytes)
    }

    /// The mask in a file such as [`to_png`](Self::to_png) writes; `None` for every other.
    fn from_png(bytes: &[u8]) -> Option<Self> {
        let mut decoder = ::png::Decoder::new(Cursor::new(bytes));
        decoder.set_transformations(::png::Transformations::IDENTITY);
        let mut reader = decoder.read_info().ok()?;
        let info = reader.info();
        let (width, height) = (info.width, info.height);
        let plain = info.color_type == ::png::ColorType::Grayscale
            && info.bit_depth == ::png::BitDepth::One
            && info.trns.is_none()
            && !info.interlaced
            && width.max(height) <= MAX_SIDE_PX;
        if !plain {
            return None;
        }
        let mut data = vec![0; reader.output_buffer_size()?];
        let frame = reader.next_frame(&mut data).ok()?;
        reader.finish().ok()?;
        let mut mask = Self::new(width as usize, height as usize);
        for (y, row) in data.chunks_exact(frame.line_size).enumerate().take(height as usize) {
            for (at, eight) in row.chunks(8).enumerate() {
                let mut word = [0; 8];
                word[..eight.len()].copy_from_slice(eight);
                mask.set_word(y, at, u64::from_be_bytes(word).reverse_bits());
            }
        }
        Some(mask)
    }

    fn from_any_image(path: &Path, bytes: &[u8]) -> Result<Self> {
        let fail = |what: String| Error::Picture { path: path.to_owned(), frame: None, what };
        let mut reader = ImageReader::new(Cursor::new(bytes))
            .with_guessed_format()
            .map_err(|e| fail(e.to_string()))?;
        let mut limits = Limits::default();
        limits.max_image_width = Some(MAX_SIDE_PX);
        limits.max_image_height = Some(MAX_SIDE_PX);
        reader.limits(limits);
        let picture = reader.decode().map_err(|e| fail(e.to_string()))?.into_luma_alpha16();
        let (width, height) = picture.dimensions();
        Ok(Self::from_fn(width as usize, height as usize, |x, y| {
            let [grey, alpha] = picture.get_pixel(x as u32, y as u32).0;
            grey >= 0x8000 && alpha >= 0x8000
        }))
    }
}

#[cfg(test)]
mod tests {
    use ::image::{DynamicImage, ImageFormat, Rgba, RgbaImage};
    use proptest::prelude::*;

    use super::*;

    /// The file as the PNG library writes it by itself.
    fn plain_png(mask: &Mask) -> Vec<u8> {
        let mut bytes = Vec::new();
        let (width, height) = (mask.width() as u32, mask.height() as u32);
        let mut encoder = ::png::Encoder::new(&mut bytes, width, height);
        encoder.set_color(::png::ColorType::Grayscale);
        encoder.set_depth(::png::BitDepth::One);
        let mut writer = encoder.write_header().unwrap();
        writer.write_image_data(&mask.png_rows()).unwrap();
        writer.finish().unwrap();
        bytes
    }

    proptest! {
        #[test]
        fn the_bytes_are_those_of_the_library(
            w in 1_usize..700, h in 1_usize..60, share in 1_u64..60, seed in any::<u64>()
        ) {
            // Runs of rows that repeat, discs and noise: all filters are chosen somewhere.
            let mask = Mask::from_fn(w, h, |x, y| {
                let mut z = seed ^ (((x / 3) * 977 + (y / 2) * 7919) as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15);
                z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
                let disc = (x as f64 - w as f64 / 2.0).hypot(y as f64 - 20.0) < 15.0;
                disc != ((z >> 40) % 64 < share && x * 2 > w)
            });
            prop_assert_eq!(mask.to_png().unwrap(), plain_png(&mask));
        }

        #[test]
        fn a_mask_survives_its_file(w in 1_usize..140, h in 1_usize..9, seed in any::<u64>()) {
            let mask = Mask::from_fn(w, h, |x, y| (seed >> ((x * 3 + y * 11) % 64)) & 1 == 1);
            let bytes = mask.to_png().unwrap();
            prop_assert_eq!(Mask::from_png(&bytes), Some(mask.clone()));
            prop_assert_eq!(Mask::from_any_image(Path::new("m.png"), &bytes).unwrap(), mask);
        }
    }

    #[test]
    fn a_repainted_mask_with_colour_and_alpha_is_read() {
        let painted = RgbaImage::from_fn(3, 1, |x, _| match x {
            0 => Rgba([255, 240, 255, 255]),
            1 => Rgba([255, 255, 255, 0]),
            _ => Rgba([40, 0, 0, 255]),
        });
        let mut bytes = Cursor::new(Vec::new());
        DynamicImage::ImageRgba8(painted).write_to(&mut bytes, ImageFormat::Png).unwrap();
        let mask = Mask::from_image_bytes(Path::new("m.png"), bytes.get_ref()).unwrap();
        assert_eq!([mask.get(0, 0), mask.get(1, 0), mask.get(2, 0)], [true, false, false]);
    }

    #[test]
    fn what_is_no_picture_is_refused_by_name() {
        let error =
            Mask::from_image_bytes(Path::new("masks/000003.png"), b"not a png").unwrap_err();
        assert!(matches!(error, Error::Picture { .. }));
        assert!(error.to_string().contains("000003.png"), "{error}");
    }
}
