//! Pictures and data as they stand in a page that needs no other file.

use ::image::codecs::jpeg::JpegEncoder;
use ::image::{ExtendedColorType, ImageEncoder, RgbImage};
use serde::Serialize;

use super::Png;
use super::png::base64;
use crate::error::{Error, Result};

/// Quality of photographs, of 100: at the sizes of a page no block is seen.
const JPEG_QUALITY: u8 = 78;
/// Quality of sheets, which have letters on them.
const SHEET_QUALITY: u8 = 90;
/// A sheet of more bytes is photographs mostly, which JPEG holds in a fifth of the room.
const LARGE_SHEET: usize = 300_000;

/// A picture as a `data:` address, which only this module can make.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Embedded(String);

impl Embedded {
    /// The bytes of a JPEG file.
    #[must_use]
    pub fn jpeg(bytes: &[u8]) -> Self {
        Self(format!("data:image/jpeg;base64,{}", base64(bytes)))
    }

    /// A stored sheet: as it is while it is small, else as JPEG.
    #[must_use]
    pub fn sheet(png: &Png) -> Self {
        if png.bytes().len() > LARGE_SHEET
            && let Ok(picture) = ::image::load_from_memory(png.bytes())
            && let Ok(jpeg) = jpeg(&picture.into_rgb8(), SHEET_QUALITY)
        {
            return Self::jpeg(&jpeg);
        }
        Self(png.data_uri())
    }

    /// Bytes of the page it takes.
    #[must_use]
    pub fn size(&self) -> usize {
        self.0.len()
    }
}

/// A photograph as a JPEG file.
pub(super) fn photograph(pixels: &RgbImage) -> Result<Vec<u8>> {
    jpeg(pixels, JPEG_QUALITY)
}

fn jpeg(pixels: &RgbImage, quality: u8) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    JpegEncoder::new_with_quality(&mut bytes, quality)
        .write_image(pixels, pixels.width(), pixels.height(), ExtendedColorType::Rgb8)
        .map_err(|e| Error::Drawing { what: "a JPEG".to_owned(), reason: e.to_string() })?;
    Ok(bytes)
}

/// A JSON document that can stand in a `<script>` element: no `<`, `>` or `&`, so that nothing in it
/// ends the element or begins another, whatever it was made from.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct ScriptJson(String);

impl ScriptJson {
    /// The JSON form of a value.
    ///
    /// # Errors
    /// [`Error::Drawing`] when it has none.
    pub fn of<T: Serialize>(value: &T) -> Result<Self> {
        let text = serde_json::to_string(value).map_err(|e| Error::Drawing {
            what: "the data of the player".to_owned(),
            reason: e.to_string(),
        })?;
        // Outside of strings JSON has none of these signs.
        Ok(Self(text.replace('<', "\\u003c").replace('>', "\\u003e").replace('&', "\\u0026")))
    }

    /// The text.
    #[must_use]
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Picture;

    #[test]
    fn no_string_ends_the_script_and_each_comes_back() {
        let evil = "</script><!--<script>&amp; \" \\ \u{2028}";
        let json = ScriptJson::of(&[evil]).unwrap();
        assert!(!json.as_str().contains(['<', '>', '&']));
        let back: Vec<String> = serde_json::from_str(json.as_str()).unwrap();
        assert_eq!(back, [evil]);
    }

    #[test]
    fn a_large_sheet_becomes_a_jpeg_of_the_same_size() {
        let small = Png::encode(&Picture::from_rgb(4, 4, vec![9; 48]).unwrap()).unwrap();
        assert_eq!(Embedded::sheet(&small).0, small.data_uri());
        let mut state = 7_u32;
        let noise: Vec<u8> = (0..3 * 400 * 300)
            .map(|_| {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                (state >> 24) as u8
            })
            .collect();
        let png = Png::encode(&Picture::from_rgb(400, 300, noise).unwrap()).unwrap();
        let embedded = Embedded::sheet(&png);
        assert!(embedded.0.starts_with("data:image/jpeg;base64,/9j/"));
        assert!(embedded.size() < png.data_uri().len());
    }
}
