//! Pictures as most video is stored: a byte of luma a pixel and two of chroma for four pixels.
//!
//! Kept so, a picture takes half the memory and need not be converted before its colours are
//! looked up. What its red, green and blue are is defined here and nowhere else: the same on every
//! machine, whatever the decoding program would make of it.

use std::borrow::Cow;

use super::Picture;

/// Binary digits behind the point of the conversion's coefficients. Rounding them moves a channel by
/// less than .0005 of a level.
const FRACTION_BITS: u32 = 20;

/// The matrix that luma and chroma were formed by: the weights of red and blue in luma
/// (Rec. ITU-T H.273, table 4).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum YuvMatrix {
    /// Rec. ITU-R BT.601, standard definition; taken where a file does not say.
    Bt601,
    /// Rec. ITU-R BT.709, high definition.
    Bt709,
    /// Rec. ITU-R BT.2020 with non-constant luminance.
    Bt2020,
}

impl YuvMatrix {
    /// Weights of red and of blue in luma.
    fn weights(self) -> (f64, f64) {
        match self {
            Self::Bt601 => (0.299, 0.114),
            Self::Bt709 => (0.2126, 0.0722),
            Self::Bt2020 => (0.2627, 0.0593),
        }
    }
}

/// Conversion of one stored colour to red, green and blue of 8 bits (H.273, equations 41 to 46
/// solved for them), with luma 16 to 235 and chroma 16 to 240 about 128:
///
/// R = y + 2 (1 − Kr) v, B = y + 2 (1 − Kb) u, G = (y − Kr R − Kb B) / (1 − Kr − Kb),
///
/// y = (Y − 16) / 219, u = (U − 128) / 224, v = (V − 128) / 224, each rounded to the nearest of 255
/// levels and clamped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct YuvConversion {
    /// Levels of a channel for a step of luma, and of chroma in red (V), green (U, V) and blue (U).
    luma: i32,
    red_v: i32,
    green_u: i32,
    green_v: i32,
    blue_u: i32,
}

impl YuvConversion {
    /// The conversion by a matrix.
    #[must_use]
    pub fn new(matrix: YuvMatrix) -> Self {
        let (red, blue) = matrix.weights();
        let green = 1.0 - red - blue;
        let chroma = 2.0 * 255.0 / 224.0;
        let fixed = |v: f64| (v * f64::from(1 << FRACTION_BITS)).round() as i32;
        Self {
            luma: fixed(255.0 / 219.0),
            red_v: fixed(chroma * (1.0 - red)),
            green_u: fixed(-chroma * (1.0 - blue) * blue / green),
            green_v: fixed(-chroma * (1.0 - red) * red / green),
            blue_u: fixed(chroma * (1.0 - blue)),
        }
    }

    /// Red, green and blue of one stored colour.
    #[must_use]
    #[inline(always)]
    pub fn rgb(&self, y: u8, u: u8, v: u8) -> [u8; 3] {
        let half = 1 << (FRACTION_BITS - 1);
        let grey = self.luma * (i32::from(y) - 16) + half;
        let (u, v) = (i32::from(u) - 128, i32::from(v) - 128);
        let level = |fixed: i32| (fixed >> FRACTION_BITS).clamp(0, 255) as u8;
        [
            level(grey + self.red_v * v),
            level(grey + self.green_u * u + self.green_v * v),
            level(grey + self.blue_u * u),
        ]
    }
}

/// One frame of footage in 4:2:0: `width` × `height` bytes of luma, rows from top to bottom, then
/// `height / 2` rows that each hold `width / 2` bytes of U and as many of V. Both sides are even.
/// The four pixels of a block of 2 × 2 share its chroma.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct YuvPicture {
    width: usize,
    height: usize,
    bytes: Vec<u8>,
    matrix: YuvMatrix,
}

impl YuvPicture {
    /// A picture from its bytes; `None` when a side is odd or there are not `width * height * 3 / 2`.
    #[must_use]
    pub fn new(width: usize, height: usize, matrix: YuvMatrix, bytes: Vec<u8>) -> Option<Self> {
        let pixels = width.checked_mul(height)?;
        let fits = width.is_multiple_of(2)
            && height.is_multiple_of(2)
            && bytes.len() == pixels.checked_add(pixels / 2)?;
        fits.then_some(Self { width, height, bytes, matrix })
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

    /// The matrix its colours were formed by.
    #[must_use]
    pub fn matrix(&self) -> YuvMatrix {
        self.matrix
    }

    /// Luma of row `y`, one byte a pixel.
    ///
    /// # Panics
    /// When there is no such row.
    #[must_use]
    pub fn luma_row(&self, y: usize) -> &[u8] {
        assert!(y < self.height, "row outside the picture");
        &self.bytes[y * self.width..(y + 1) * self.width]
    }

    /// U and V of rows `2 * pair` and `2 * pair + 1`, a byte each for two columns.
    ///
    /// # Panics
    /// When there are no such rows.
    #[must_use]
    pub fn chroma_rows(&self, pair: usize) -> (&[u8], &[u8]) {
        assert!(pair < self.height / 2, "row outside the picture");
        let from = (self.height + pair) * self.width;
        self.bytes[from..from + self.width].split_at(self.width / 2)
    }

    /// All of luma, row by row.
    #[must_use]
    pub fn luma(&self) -> &[u8] {
        &self.bytes[..self.width * self.height]
    }

    /// All of chroma: `height / 2` rows of `width` bytes, U in their left half, V in the right.
    #[must_use]
    pub fn chroma(&self) -> &[u8] {
        &self.bytes[self.width * self.height..]
    }

    /// How its colours become red, green and blue.
    #[must_use]
    pub fn conversion(&self) -> YuvConversion {
        YuvConversion::new(self.matrix)
    }

    /// Every pixel converted.
    #[must_use]
    pub fn to_rgb(&self) -> Picture {
        let conversion = self.conversion();
        let mut rgb = Vec::with_capacity(3 * self.width * self.height);
        for y in 0..self.height {
            let (us, vs) = self.chroma_rows(y / 2);
            for ((pair, &u), &v) in self.luma_row(y).chunks_exact(2).zip(us).zip(vs) {
                rgb.extend(conversion.rgb(pair[0], u, v));
                rgb.extend(conversion.rgb(pair[1], u, v));
            }
        }
        Picture { width: self.width, height: self.height, rgb }
    }

    /// The memory of the picture, to read another into.
    #[must_use]
    pub fn into_bytes(self) -> Vec<u8> {
        self.bytes
    }
}

/// A frame in whichever form its source holds it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Frame {
    /// Red, green and blue.
    Rgb(Picture),
    /// Luma and chroma.
    Yuv(YuvPicture),
}

impl Frame {
    /// Width, pixels.
    #[must_use]
    pub fn width(&self) -> usize {
        match self {
            Self::Rgb(picture) => picture.width(),
            Self::Yuv(picture) => picture.width(),
        }
    }

    /// Height, pixels.
    #[must_use]
    pub fn height(&self) -> usize {
        match self {
            Self::Rgb(picture) => picture.height(),
            Self::Yuv(picture) => picture.height(),
        }
    }

    /// The frame in red, green and blue; only what is stored otherwise is converted.
    #[must_use]
    pub fn rgb(&self) -> Cow<'_, Picture> {
        match self {
            Self::Rgb(picture) => Cow::Borrowed(picture),
            Self::Yuv(picture) => Cow::Owned(picture.to_rgb()),
        }
    }

    /// The same, of a frame that is not needed any longer.
    #[must_use]
    pub fn into_rgb(self) -> Picture {
        match self {
            Self::Rgb(picture) => picture,
            Self::Yuv(picture) => picture.to_rgb(),
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// The standard's own direction, in real numbers: red, green and blue (0 to 1) to the code
    /// values Y, U, V before rounding.
    fn coded(matrix: YuvMatrix, rgb: [f64; 3]) -> [f64; 3] {
        let (red, blue) = matrix.weights();
        let y = red * rgb[0] + (1.0 - red - blue) * rgb[1] + blue * rgb[2];
        let u = (rgb[2] - y) / (2.0 * (1.0 - blue));
        let v = (rgb[0] - y) / (2.0 * (1.0 - red));
        [219.0 * y + 16.0, 224.0 * u + 128.0, 224.0 * v + 128.0]
    }

    const MATRICES: [YuvMatrix; 3] = [YuvMatrix::Bt601, YuvMatrix::Bt709, YuvMatrix::Bt2020];

    proptest! {
        #[test]
        fn a_colour_comes_back_from_its_code_values(rgb: [u8; 3], which in 0_usize..3) {
            let matrix = MATRICES[which];
            let code = coded(matrix, rgb.map(|c| f64::from(c) / 255.0)).map(|c| c.round() as u8);
            let back = YuvConversion::new(matrix).rgb(code[0], code[1], code[2]);
            for (was, is) in rgb.into_iter().zip(back) {
                // Half a step of luma and of chroma is lost by storing.
                prop_assert!(was.abs_diff(is) <= 2, "{rgb:?} {back:?}");
            }
        }

        #[test]
        fn rounding_is_that_of_real_numbers(y: u8, u: u8, v: u8, which in 0_usize..3) {
            let matrix = MATRICES[which];
            let (red, blue) = matrix.weights();
            let grey = (f64::from(y) - 16.0) / 219.0;
            let r = grey + 2.0 * (1.0 - red) * (f64::from(v) - 128.0) / 224.0;
            let b = grey + 2.0 * (1.0 - blue) * (f64::from(u) - 128.0) / 224.0;
            let g = (grey - red * r - blue * b) / (1.0 - red - blue);
            for (exact, found) in [r, g, b].into_iter().zip(YuvConversion::new(matrix).rgb(y, u, v)) {
                prop_assert!(((255.0 * exact).clamp(0.0, 255.0) - f64::from(found)).abs() < 0.5005);
            }
        }
    }

    #[test]
    fn black_white_and_the_primaries_of_high_definition() {
        // Code values of the 100 % colour bars of Rec. ITU-R BT.709.
        let conversion = YuvConversion::new(YuvMatrix::Bt709);
        for (code, rgb) in [
            ([16, 128, 128], [0, 0, 0]),
            ([235, 128, 128], [255, 255, 255]),
            ([63, 102, 240], [255, 0, 0]),
            ([173, 42, 26], [0, 255, 0]),
            ([32, 240, 118], [0, 0, 255]),
        ] {
            let found = conversion.rgb(code[0], code[1], code[2]);
            assert!(found.iter().zip(rgb).all(|(a, b)| a.abs_diff(b) <= 1), "{found:?} {rgb:?}");
        }
    }

    #[test]
    fn rows_lie_where_they_are_said_to() {
        let bytes: Vec<u8> = (0..24).collect();
        let picture = YuvPicture::new(4, 4, YuvMatrix::Bt601, bytes.clone()).unwrap();
        assert_eq!(picture.luma_row(3), [12, 13, 14, 15]);
        assert_eq!(picture.chroma_rows(1), (&[20, 21][..], &[22, 23][..]));
        let conversion = YuvConversion::new(YuvMatrix::Bt601);
        assert_eq!(picture.to_rgb().pixel(3, 2), conversion.rgb(11, 21, 23));
        assert_eq!(YuvPicture::new(3, 4, YuvMatrix::Bt601, vec![0; 18]), None);
        assert_eq!(YuvPicture::new(4, 4, YuvMatrix::Bt601, vec![0; 23]), None);
    }
}
