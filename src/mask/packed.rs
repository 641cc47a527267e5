//! The bit-packed mask itself.

/// A binary image, one bit a pixel. Each row starts at a new 64-bit word; pixel `x` of a row is
/// bit `x % 64` (least significant first) of the row's word `x / 64`. The bits of a row past
/// `width` are always zero, so whole words can be counted and compared.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mask {
    width: usize,
    height: usize,
    words_per_row: usize,
    words: Vec<u64>,
}

impl Mask {
    /// An empty mask (no pixel set) of `width` × `height` pixels.
    #[must_use]
    pub fn new(width: usize, height: usize) -> Self {
        let words_per_row = width.div_ceil(64);
        Self { width, height, words_per_row, words: vec![0; words_per_row * height] }
    }

    /// Sets each pixel by a function of its column and row.
    #[must_use]
    pub fn from_fn(width: usize, height: usize, mut set: impl FnMut(usize, usize) -> bool) -> Self {
        let mut mask = Self::new(width, height);
        for y in 0..height {
            for x in 0..width {
                if set(x, y) {
                    mask.words[y * mask.words_per_row + x / 64] |= 1 << (x % 64);
                }
            }
        }
        mask
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

    /// Words a row.
    #[must_use]
    pub fn words_per_row(&self) -> usize {
        self.words_per_row
    }

    /// All words, row by row.
    #[must_use]
    pub fn words(&self) -> &[u64] {
        &self.words
    }

    /// Whether the pixel at column `x`, row `y` is set.
    ///
    /// # Panics
    /// When `x` or `y` lies outside the mask.
    #[must_use]
    pub fn get(&self, x: usize, y: usize) -> bool {
        assert!(x < self.width && y < self.height, "pixel outside the mask");
        self.words[y * self.words_per_row + x / 64] >> (x % 64) & 1 == 1
    }

    /// Sets or clears the pixel at column `x`, row `y`.
    ///
    /// # Panics
    /// When `x` or `y` lies outside the mask.
    pub fn set(&mut self, x: usize, y: usize, value: bool) {
        assert!(x < self.width && y < self.height, "pixel outside the mask");
        let bit = 1_u64 << (x % 64);
        let word = &mut self.words[y * self.words_per_row + x / 64];
        *word = if value { *word | bit } else { *word & !bit };
    }

    /// Number of pixels set.
    #[must_use]
    pub fn area(&self) -> usize {
        self.words.iter().map(|w| w.count_ones() as usize).sum()
    }
}
