//! PNG bytes and their text form.

use ::image::codecs::png::{CompressionType, FilterType, PngEncoder};
use ::image::{ExtendedColorType, ImageEncoder};

use crate::error::{Error, Result};
use crate::image::Picture;

/// A picture as the bytes of a PNG file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Png(Vec<u8>);

impl Png {
    /// Encodes a picture, 8 bits a channel, without time or other changing fields.
    ///
    /// # Errors
    /// [`Error::Drawing`] when the picture is empty or too large for PNG.
    pub fn encode(picture: &Picture) -> Result<Self> {
        let mut bytes = Vec::new();
        let size = |side: usize| u32::try_from(side).unwrap_or(u32::MAX);
        PngEncoder::new_with_quality(&mut bytes, CompressionType::Default, FilterType::Adaptive)
            .write_image(
                picture.rgb(),
                size(picture.width()),
                size(picture.height()),
                ExtendedColorType::Rgb8,
            )
            .map_err(|e| Error::Drawing { what: "a PNG".to_owned(), reason: e.to_string() })?;
        Ok(Self(bytes))
    }

    /// Takes the bytes of a PNG file as they are, for a page that shows a stored sheet.
    #[must_use]
    pub fn from_bytes(bytes: Vec<u8>) -> Self {
        Self(bytes)
    }

    /// The bytes of the file.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        &self.0
    }

    /// The bytes of the file, without a copy.
    #[must_use]
    pub fn into_bytes(self) -> Vec<u8> {
        self.0
    }

    /// A `data:` address that holds the whole file.
    #[must_use]
    pub fn data_uri(&self) -> String {
        format!("data:image/png;base64,{}", base64(&self.0))
    }
}

impl serde::Serialize for Png {
    fn serialize<S: serde::Serializer>(&self, to: S) -> std::result::Result<S::Ok, S::Error> {
        to.serialize_str(&self.data_uri())
    }
}

/// Base64 of RFC 4648 §4, with padding.
pub(super) fn base64(bytes: &[u8]) -> String {
    const ALPHABET: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for group in bytes.chunks(3) {
        let byte = |i: usize| u32::from(group.get(i).copied().unwrap_or(0));
        let word = byte(0) << 16 | byte(1) << 8 | byte(2);
        for i in 0..4 {
            let sign = ALPHABET[(word >> (18 - 6 * i) & 63) as usize];
            text.push(if i <= group.len() { char::from(sign) } else { '=' });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_gives_the_vectors_of_rfc_4648() {
        let vectors = [
            ("", ""),
            ("f", "Zg=="),
            ("fo", "Zm8="),
            ("foo", "Zm9v"),
            ("foob", "Zm9vYg=="),
            ("fooba", "Zm9vYmE="),
            ("foobar", "Zm9vYmFy"),
        ];
        for (plain, coded) in vectors {
            assert_eq!(base64(plain.as_bytes()), coded);
        }
        assert_eq!(base64(&[0xfb, 0xff, 0xfe]), "+//+");
    }

    #[test]
    fn a_picture_comes_back_from_its_png() {
        let rgb: Vec<u8> = (0..5 * 3 * 3).map(|i| (i * 5) as u8).collect();
        let picture = Picture::from_rgb(5, 3, rgb.clone()).unwrap();
        let png = Png::encode(&picture).unwrap();
        let read = ::image::load_from_memory(png.bytes()).unwrap().to_rgb8();
        assert_eq!(read.dimensions(), (5, 3));
        assert_eq!(read.into_raw(), rgb);
        assert!(png.data_uri().starts_with("data:image/png;base64,iVBORw0KGgo"));
    }

    #[test]
    fn an_empty_picture_is_refused() {
        let picture = Picture::from_rgb(0, 0, Vec::new()).unwrap();
        assert!(matches!(Png::encode(&picture), Err(Error::Drawing { .. })));
    }
}
