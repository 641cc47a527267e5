//! Dilation, erosion, opening, closing by a disc, and hole filling, on whole words.
//!
//! The disc of radius r holds the offsets with dx² + dy² ≤ r²; radius 0 is the pixel itself,
//! radius 1 the plus of five pixels. Outside the picture there is nothing to dilate from and
//! nothing that erodes, so opening never adds a pixel and closing never removes one.

use super::{Connectivity, Mask, components};

impl Mask {
    /// Every pixel within `radius_px` of a set one.
    #[must_use]
    pub fn dilated(&self, radius_px: usize) -> Self {
        let mut result = self.clone();
        let mut done = 0;
        let mut widened = self.clone();
        // From the top of the disc to its middle the half-width only grows.
        for dy in (0..=radius_px).rev() {
            let half_width = disc_half_width(radius_px, dy);
            if done < half_width {
                widened = widened.widened(half_width - done);
                done = half_width;
            }
            for y in 0..self.height() {
                for target in [y.checked_sub(dy), Some(y + dy).filter(|&t| t < self.height())] {
                    let Some(target) = target else { continue };
                    for (word, add) in result.row_mut(target).iter_mut().zip(widened.row(y)) {
                        *word |= add;
                    }
                }
            }
        }
        result
    }

    /// Every pixel whose whole disc is set.
    #[must_use]
    pub fn eroded(&self, radius_px: usize) -> Self {
        self.not().dilated(radius_px).not()
    }

    /// Erosion, then dilation: specks and spikes thinner than the disc go.
    #[must_use]
    pub fn opened(&self, radius_px: usize) -> Self {
        if radius_px == 0 { self.clone() } else { self.eroded(radius_px).dilated(radius_px) }
    }

    /// Dilation, then erosion: gaps and bays narrower than the disc are bridged.
    #[must_use]
    pub fn closed(&self, radius_px: usize) -> Self {
        if radius_px == 0 { self.clone() } else { self.dilated(radius_px).eroded(radius_px) }
    }

    /// Fills every hole of at most `largest_px` pixels: background that no 4-connected way leads out
    /// of to the picture's border.
    #[must_use]
    pub fn holes_filled(&self, largest_px: usize) -> Self {
        let mut result = self.clone();
        for hole in components(&self.not(), Connectivity::Four) {
            let b = hole.bounds;
            let inside = b.left > 0
                && b.top > 0
                && b.right + 1 < self.width()
                && b.bottom + 1 < self.height();
            if inside && hole.area_px <= largest_px {
                hole.draw(&mut result);
            }
        }
        result
    }

    /// Every pixel within `by` columns of a set one in its own row, by doubling shifts.
    fn widened(&self, by: usize) -> Self {
        let mut result = self.clone();
        let mut reach = 0;
        while reach < by {
            let step = (by - reach).min(reach.max(1));
            let before = result.clone();
            for y in 0..self.height() {
                let source = before.row(y);
                for at in 0..source.len() {
                    let moved = shifted_up(source, at, step) | shifted_down(source, at, step);
                    let valid = self.valid_bits(at);
                    result.row_mut(y)[at] |= moved & valid;
                }
            }
            reach += step;
        }
        result
    }
}

/// Half-width of the disc's row `dy` from its middle.
fn disc_half_width(radius_px: usize, dy: usize) -> usize {
    (radius_px * radius_px - dy * dy).isqrt()
}

/// Word `at` of the row moved by `by` columns to the right.
fn shifted_up(row: &[u64], at: usize, by: usize) -> u64 {
    let (words, bits) = (by / 64, by % 64);
    let word = |back: usize| at.checked_sub(back).map_or(0, |i| row[i]);
    if bits == 0 { word(words) } else { word(words) << bits | word(words + 1) >> (64 - bits) }
}

/// Word `at` of the row moved by `by` columns to the left.
fn shifted_down(row: &[u64], at: usize, by: usize) -> u64 {
    let (words, bits) = (by / 64, by % 64);
    let word = |ahead: usize| row.get(at + ahead).copied().unwrap_or(0);
    if bits == 0 { word(words) } else { word(words) >> bits | word(words + 1) << (64 - bits) }
}

#[cfg(test)]
mod tests {
    use image::{GrayImage, Luma};
    use proptest::prelude::*;

    use super::*;

    fn slow_dilated(mask: &Mask, radius: usize) -> Mask {
        let r = radius as i64;
        Mask::from_fn(mask.width(), mask.height(), |x, y| {
            (-r..=r).any(|dy| {
                (-r..=r).any(|dx| {
                    let (sx, sy) = (x as i64 + dx, y as i64 + dy);
                    dx * dx + dy * dy <= r * r
                        && sx >= 0
                        && sy >= 0
                        && sx < mask.width() as i64
                        && sy < mask.height() as i64
                        && mask.get(sx as usize, sy as usize)
                })
            })
        })
    }

    fn arbitrary_mask() -> impl Strategy<Value = Mask> {
        (1_usize..150, 1_usize..24, 1_u32..20, any::<u64>()).prop_map(|(w, h, density, seed)| {
            Mask::from_fn(w, h, |x, y| {
                let mut z =
                    seed ^ ((x * 977 + y * 7919) as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15);
                z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
                ((z >> 40) % 20) < u64::from(density)
            })
        })
    }

    proptest! {
        #[test]
        fn dilation_equals_its_definition(mask in arbitrary_mask(), radius in 0_usize..7) {
            prop_assert_eq!(mask.dilated(radius), slow_dilated(&mask, radius));
        }

        #[test]
        fn opening_only_removes_and_closing_only_adds(mask in arbitrary_mask(), radius in 0_usize..5) {
            prop_assert_eq!(mask.opened(radius).and_not(&mask).area(), 0);
            prop_assert_eq!(mask.and_not(&mask.closed(radius)).area(), 0);
            prop_assert_eq!(mask.opened(radius).opened(radius), mask.opened(radius));
        }

        #[test]
        fn a_square_dilation_by_another_library_holds_the_disc(mask in arbitrary_mask()) {
            let grey = GrayImage::from_fn(mask.width() as u32, mask.height() as u32, |x, y| {
                Luma([if mask.get(x as usize, y as usize) { 255 } else { 0 }])
            });
            let plus = imageproc::morphology::dilate(&grey, imageproc::distance_transform::Norm::L1, 1);
            let theirs = Mask::from_fn(mask.width(), mask.height(), |x, y| {
                plus.get_pixel(x as u32, y as u32).0[0] > 0
            });
            prop_assert_eq!(mask.dilated(1), theirs);
        }
    }

    #[test]
    fn a_ring_is_filled_and_a_bay_is_not() {
        let ring = Mask::from_fn(20, 20, |x, y| {
            let d = (x as f64 - 10.0).hypot(y as f64 - 10.0);
            (4.0..7.0).contains(&d)
        });
        let disc = Mask::from_fn(20, 20, |x, y| (x as f64 - 10.0).hypot(y as f64 - 10.0) < 7.0);
        assert_eq!(ring.holes_filled(usize::MAX), disc);
        assert_eq!(ring.holes_filled(3), ring);
        let bay = Mask::from_fn(20, 20, |x, y| ring.get(x, y) && !(x > 10 && y == 10));
        assert_eq!(bay.holes_filled(usize::MAX), bay);
    }
}
