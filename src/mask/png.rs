//! Masks as PNG: written with one bit a pixel, read however a paint program saved them.

use std::io::Cursor;
use std::path::Path;

use ::image::{ImageReader, Limits};

use super::Mask;
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
        let mut data = Vec::with_capacity(self.width().div_ceil(8) * self.height());
        for y in 0..self.height() {
            // PNG wants the leftmost pixel in the highest bit.
            let row = self.row(y).iter().flat_map(|w| w.to_le_bytes()).map(u8::reverse_bits);
            data.extend(row.take(self.width().div_ceil(8)));
        }
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&data)?;
        writer.finish()
    }

    /// Reads a mask from any image file: set where it is bright (luminance of one half or more) and
    /// not transparent (alpha of one half or more).
    ///
    /// # Errors
    /// [`Error::Picture`] naming `path` when the bytes are no picture, or one of over 16 384 pixels
    /// on a side.
    pub fn from_image_bytes(path: &Path, bytes: &[u8]) -> Result<Self> {
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

    proptest! {
        #[test]
        fn a_mask_survives_its_file(w in 1_usize..140, h in 1_usize..9, seed in any::<u64>()) {
            let mask = Mask::from_fn(w, h, |x, y| (seed >> ((x * 3 + y * 11) % 64)) & 1 == 1);
            let bytes = mask.to_png().unwrap();
            prop_assert_eq!(Mask::from_image_bytes(Path::new("m.png"), &bytes).unwrap(), mask);
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
