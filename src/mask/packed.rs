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

    /// Whether no pixel is set.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.words.iter().all(|&w| w == 0)
    }

    /// From one boolean a pixel, row by row; `None` when there are not `width * height`.
    #[must_use]
    pub fn from_bools(width: usize, height: usize, pixels: &[bool]) -> Option<Self> {
        (pixels.len() == width.checked_mul(height)?)
            .then(|| Self::from_fn(width, height, |x, y| pixels[y * width + x]))
    }

    /// Pixels set in both masks.
    ///
    /// # Panics
    /// When the sizes differ.
    #[must_use]
    pub fn common_area(&self, other: &Self) -> usize {
        self.assert_same_size(other);
        self.words.iter().zip(&other.words).map(|(a, b)| (a & b).count_ones() as usize).sum()
    }

    /// The union.
    ///
    /// # Panics
    /// When the sizes differ.
    #[must_use]
    pub fn or(&self, other: &Self) -> Self {
        self.combined(other, |a, b| a | b)
    }

    /// The intersection.
    ///
    /// # Panics
    /// When the sizes differ.
    #[must_use]
    pub fn and(&self, other: &Self) -> Self {
        self.combined(other, |a, b| a & b)
    }

    /// What is set here and not in `other`.
    ///
    /// # Panics
    /// When the sizes differ.
    #[must_use]
    pub fn and_not(&self, other: &Self) -> Self {
        self.combined(other, |a, b| a & !b)
    }

    /// The complement within the picture.
    #[must_use]
    pub fn not(&self) -> Self {
        let mut result = self.clone();
        for y in 0..self.height {
            for (at, word) in result.row_mut(y).iter_mut().enumerate() {
                *word = !*word & self.valid_bits(at);
            }
        }
        result
    }

    /// Shared area over united area (Jaccard), 0…1; 1 when both masks are empty.
    ///
    /// # Panics
    /// When the sizes differ.
    #[must_use]
    pub fn jaccard(&self, other: &Self) -> f64 {
        let common = self.common_area(other);
        let united = self.area() + other.area() - common;
        if united == 0 { 1.0 } else { common as f64 / united as f64 }
    }

    /// The smallest rectangle that holds all set pixels; `None` of an empty mask.
    #[must_use]
    pub fn bounds(&self) -> Option<Bounds> {
        let filled = |y: &usize| self.row(*y).iter().any(|&w| w != 0);
        let top = (0..self.height).find(filled)?;
        let bottom = (0..self.height).rev().find(filled)?;
        let mut columns = vec![0_u64; self.words_per_row];
        for y in top..=bottom {
            for (column, word) in columns.iter_mut().zip(self.row(y)) {
                *column |= word;
            }
        }
        let first = columns.iter().position(|&w| w != 0)?;
        let last = columns.iter().rposition(|&w| w != 0)?;
        Some(Bounds {
            left: 64 * first + columns[first].trailing_zeros() as usize,
            top,
            right: 64 * last + 63 - columns[last].leading_zeros() as usize,
            bottom,
        })
    }

    /// The centre of mass in pixels, a pixel's own centre being at its whole coordinates; `None`
    /// of an empty mask. Sums are exact integers.
    #[must_use]
    pub fn centre_of_mass(&self) -> Option<(f64, f64)> {
        self.centre_of_mass_from((0, 0))
    }

    /// The same in a picture in which this mask's first pixel has the given column and row.
    pub(super) fn centre_of_mass_from(&self, corner: (usize, usize)) -> Option<(f64, f64)> {
        let (mut area, mut sum_x, mut sum_y) = (0_u64, 0_u64, 0_u64);
        for y in 0..self.height {
            let mut in_row = 0;
            for (at, &word) in self.row(y).iter().enumerate().filter(|(_, w)| **w != 0) {
                let bits = u64::from(word.count_ones());
                in_row += bits;
                let in_word = if word == u64::MAX { 63 * 64 / 2 } else { bit_index_sum(word) };
                sum_x += 64 * at as u64 * bits + in_word;
            }
            area += in_row;
            sum_y += y as u64 * in_row;
        }
        (sum_x, sum_y) = (sum_x + corner.0 as u64 * area, sum_y + corner.1 as u64 * area);
        (area > 0).then(|| (sum_x as f64 / area as f64, sum_y as f64 / area as f64))
    }

    /// Sets the pixels of a row, from the left, to as many values as there are.
    pub(crate) fn set_row(&mut self, y: usize, values: impl Iterator<Item = bool>) {
        let width = self.width;
        let mut values = values.take(width);
        for word in self.row_mut(y) {
            let mut bits = 0;
            for (at, set) in values.by_ref().take(64).enumerate() {
                bits |= u64::from(set) << at;
            }
            *word = bits;
        }
    }

    /// Sets the 64 pixels of word `at` of row `y`; bits past the width are dropped.
    pub(crate) fn set_word(&mut self, y: usize, at: usize, bits: u64) {
        let valid = self.valid_bits(at);
        self.row_mut(y)[at] = bits & valid;
    }

    /// The words of row `y`.
    pub(super) fn row(&self, y: usize) -> &[u64] {
        &self.words[y * self.words_per_row..(y + 1) * self.words_per_row]
    }

    /// The words of row `y`, to write; bits past the width must stay zero.
    pub(super) fn row_mut(&mut self, y: usize) -> &mut [u64] {
        &mut self.words[y * self.words_per_row..(y + 1) * self.words_per_row]
    }

    /// The bits of a row's word that lie within the width.
    pub(super) fn valid_bits(&self, word: usize) -> u64 {
        let used = self.width - (64 * word).min(self.width);
        if used >= 64 { u64::MAX } else { (1 << used) - 1 }
    }

    fn assert_same_size(&self, other: &Self) {
        assert!(self.width == other.width && self.height == other.height, "masks of one size");
    }

    fn combined(&self, other: &Self, combine: impl Fn(u64, u64) -> u64) -> Self {
        self.assert_same_size(other);
        let words = self.words.iter().zip(&other.words).map(|(&a, &b)| combine(a, b)).collect();
        Self { words, ..*self }
    }
}

/// A rectangle of pixels, all four sides included.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bounds {
    /// Leftmost column.
    pub left: usize,
    /// Topmost row.
    pub top: usize,
    /// Rightmost column.
    pub right: usize,
    /// Lowest row.
    pub bottom: usize,
}

impl Bounds {
    /// Columns.
    #[must_use]
    pub fn width(&self) -> usize {
        self.right - self.left + 1
    }

    /// Rows.
    #[must_use]
    pub fn height(&self) -> usize {
        self.bottom - self.top + 1
    }
}

/// Sum of the indices of a word's set bits, by their binary digits: digit k of an index is set in
/// the positions of pattern k.
fn bit_index_sum(word: u64) -> u64 {
    const DIGITS: [u64; 6] = [
        0xAAAA_AAAA_AAAA_AAAA,
        0xCCCC_CCCC_CCCC_CCCC,
        0xF0F0_F0F0_F0F0_F0F0,
        0xFF00_FF00_FF00_FF00,
        0xFFFF_0000_FFFF_0000,
        0xFFFF_FFFF_0000_0000,
    ];
    DIGITS.iter().enumerate().map(|(k, d)| u64::from((word & d).count_ones()) << k).sum()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn masks() -> impl Strategy<Value = (usize, usize, Vec<bool>, Vec<bool>)> {
        (1_usize..140, 1_usize..8).prop_flat_map(|(w, h)| {
            let pixels = || prop::collection::vec(any::<bool>(), w * h);
            (Just(w), Just(h), pixels(), pixels())
        })
    }

    proptest! {
        #[test]
        fn set_operations_equal_those_of_booleans((w, h, a, b) in masks()) {
            let (ma, mb) = (Mask::from_bools(w, h, &a).unwrap(), Mask::from_bools(w, h, &b).unwrap());
            let slow = |f: fn(bool, bool) -> bool| {
                let pixels: Vec<bool> = a.iter().zip(&b).map(|(&x, &y)| f(x, y)).collect();
                Mask::from_bools(w, h, &pixels).unwrap()
            };
            prop_assert_eq!(ma.or(&mb), slow(|x, y| x | y));
            prop_assert_eq!(ma.and(&mb), slow(|x, y| x & y));
            prop_assert_eq!(ma.and_not(&mb), slow(|x, y| x & !y));
            prop_assert_eq!(ma.not(), slow(|x, _| !x));
            prop_assert_eq!(ma.common_area(&mb), slow(|x, y| x & y).area());
            prop_assert_eq!(ma.area(), a.iter().filter(|&&p| p).count());
        }

        #[test]
        fn moments_and_bounds_equal_the_slow_ones((w, h, a, _) in masks()) {
            let mask = Mask::from_bools(w, h, &a).unwrap();
            let set: Vec<(usize, usize)> =
                (0..w * h).filter(|&p| a[p]).map(|p| (p % w, p / w)).collect();
            if set.is_empty() {
                prop_assert!(mask.bounds().is_none() && mask.centre_of_mass().is_none());
            } else {
                let n = set.len() as f64;
                let x = set.iter().map(|p| p.0).sum::<usize>() as f64 / n;
                let y = set.iter().map(|p| p.1).sum::<usize>() as f64 / n;
                prop_assert_eq!(mask.centre_of_mass(), Some((x, y)));
                let bounds = mask.bounds().unwrap();
                prop_assert_eq!(bounds.left, set.iter().map(|p| p.0).min().unwrap());
                prop_assert_eq!(bounds.right, set.iter().map(|p| p.0).max().unwrap());
                prop_assert_eq!(bounds.top, set.iter().map(|p| p.1).min().unwrap());
                prop_assert_eq!(bounds.bottom, set.iter().map(|p| p.1).max().unwrap());
            }
        }
    }
}
