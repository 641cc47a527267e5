//! Cutting a window out of a mask, and resampling it at another scale.

use super::Mask;

impl Mask {
    /// The window of `width` × `height` pixels whose top left corner is at column `left`, row
    /// `top` of this mask, either of which may be negative; what lies outside is not set. Rows are
    /// moved as whole words.
    #[must_use]
    pub fn window(&self, left: i64, top: i64, width: usize, height: usize) -> Self {
        let mut result = Self::new(width, height);
        for y in 0..height {
            let source = top + y as i64;
            if source < 0 || source >= self.height() as i64 {
                continue;
            }
            let row = self.row(source as usize);
            for at in 0..result.words_per_row() {
                let bits = bits_from(row, left + 64 * at as i64);
                let valid = result.valid_bits(at);
                result.row_mut(y)[at] = bits & valid;
            }
        }
        result
    }

    /// The mask at half the size: set where at least two of four pixels are. An odd last row or column
    /// is left out.
    pub(crate) fn halved(&self) -> Self {
        let mut result = Self::new((self.width() / 2).max(1), (self.height() / 2).max(1));
        let nothing = vec![0; self.words_per_row()];
        for y in 0..result.height() {
            let row = |y: usize| if y < self.height() { self.row(y) } else { &nothing };
            let half = |at: usize| {
                let words =
                    [row(2 * y), row(2 * y + 1)].map(|row| row.get(at).copied().unwrap_or(0));
                even_bits(two_of_four(words))
            };
            for at in 0..result.words_per_row() {
                let bits = half(2 * at) | half(2 * at + 1) << 32;
                result.set_word(y, at, bits);
            }
        }
        result
    }

    /// The mask at `scale` times its size about the point (`x`, `y`), which stays where it is, in a
    /// picture of the same size: each pixel takes the value of the nearest source pixel.
    ///
    /// # Panics
    /// Unless `scale` is finite and positive.
    #[must_use]
    pub fn scaled_about(&self, x: f64, y: f64, scale: f64) -> Self {
        assert!(scale.is_finite() && scale > 0.0, "a positive scale");
        let source =
            |target: usize, centre: f64| (centre + (target as f64 - centre) / scale).round();
        let columns: Vec<f64> = (0..self.width()).map(|column| source(column, x)).collect();
        Self::from_fn(self.width(), self.height(), |column, row| {
            let (sx, sy) = (columns[column], source(row, y));
            sx >= 0.0
                && sy >= 0.0
                && sx < self.width() as f64
                && sy < self.height() as f64
                && self.get(sx as usize, sy as usize)
        })
    }
}

/// At each even bit, whether two or more are set of it and the next, in both rows.
fn two_of_four([upper, lower]: [u64; 2]) -> u64 {
    let both = upper & (upper >> 1) | lower & (lower >> 1);
    both | (upper | upper >> 1) & (lower | lower >> 1)
}

/// The even bits of a word, in its lower half.
fn even_bits(word: u64) -> u64 {
    let mut bits = word & 0x5555_5555_5555_5555;
    bits = (bits | bits >> 1) & 0x3333_3333_3333_3333;
    bits = (bits | bits >> 2) & 0x0F0F_0F0F_0F0F_0F0F;
    bits = (bits | bits >> 4) & 0x00FF_00FF_00FF_00FF;
    bits = (bits | bits >> 8) & 0x0000_FFFF_0000_FFFF;
    (bits | bits >> 16) & 0x0000_0000_FFFF_FFFF
}

/// 64 bits of a row from bit `start`, which may lie outside on either side.
fn bits_from(row: &[u64], start: i64) -> u64 {
    let word = start.div_euclid(64);
    let shift = start.rem_euclid(64) as u32;
    let at =
        |index: i64| usize::try_from(index).ok().and_then(|i| row.get(i)).copied().unwrap_or(0);
    if shift == 0 { at(word) } else { at(word) >> shift | at(word + 1) << (64 - shift) }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn a_window_equals_the_pixels_it_shows(
            w in 1_usize..150, h in 1_usize..6, left in -80_i64..160, top in -4_i64..8,
            ww in 1_usize..140, wh in 1_usize..8, seed in any::<u64>()
        ) {
            let mask = Mask::from_fn(w, h, |x, y| (seed >> ((x * 7 + y * 13) % 64)) & 1 == 1);
            let window = mask.window(left, top, ww, wh);
            let slow = Mask::from_fn(ww, wh, |x, y| {
                let (sx, sy) = (left + x as i64, top + y as i64);
                sx >= 0 && sy >= 0 && sx < w as i64 && sy < h as i64 && mask.get(sx as usize, sy as usize)
            });
            prop_assert_eq!(window, slow);
        }

        #[test]
        fn half_the_size_has_what_most_of_four_have(
            w in 1_usize..300, h in 1_usize..7, seed in any::<u64>()
        ) {
            let mask = Mask::from_fn(w, h, |x, y| (seed >> ((x * 7 + y * 13) % 64)) & 1 == 1);
            let set = |x: usize, y: usize| x < w && y < h && mask.get(x, y);
            let slow = Mask::from_fn((w / 2).max(1), (h / 2).max(1), |x, y| {
                let four = [(0, 0), (1, 0), (0, 1), (1, 1)];
                four.iter().filter(|(dx, dy)| set(2 * x + dx, 2 * y + dy)).count() >= 2
            });
            prop_assert_eq!(mask.halved(), slow);
        }
    }

    #[test]
    fn scaling_keeps_the_point_and_multiplies_the_area() {
        let mask = Mask::from_fn(200, 160, |x, y| (x as f64 - 90.0).hypot(y as f64 - 80.0) < 30.0);
        assert_eq!(mask.scaled_about(90.0, 80.0, 1.0), mask);
        let double = mask.scaled_about(90.0, 80.0, 2.0);
        let ratio = double.area() as f64 / mask.area() as f64;
        assert!((ratio - 4.0).abs() < 0.1, "{ratio}");
        let (x, y) = double.centre_of_mass().unwrap();
        assert!((x - 90.0).abs() < 0.6 && (y - 80.0).abs() < 0.6);
    }
}
