//! Dilation, erosion, opening, closing by a disc, and hole filling, on whole words.
//!
//! The disc of radius r holds the offsets with dx² + dy² ≤ r²; radius 0 is the pixel itself,
//! radius 1 the plus of five pixels. Outside the picture there is nothing to dilate from and
//! nothing that erodes, so opening never adds a pixel and closing never removes one.

use std::ops::Range;

use super::{Connectivity, Mask, components};
use crate::numeric::{InstructionSet, Kernel};

impl Mask {
    /// Every pixel within `radius_px` of a set one.
    #[must_use]
    pub fn dilated(&self, radius_px: usize) -> Self {
        self.spread(radius_px, false)
    }

    /// Every pixel whose whole disc is set.
    #[must_use]
    pub fn eroded(&self, radius_px: usize) -> Self {
        self.and_not(&self.spread(radius_px, true))
    }

    /// Every pixel within `radius_px` of a set one, or of one that is not; the latter only where it
    /// may make a difference to pixels that are set.
    fn spread(&self, radius_px: usize, of_unset: bool) -> Self {
        let mut result = Self::new(self.width(), self.height());
        let Some(b) = self.bounds() else { return result };
        // Further from the set pixels than the disc reaches nothing changes. What is left out beyond
        // that would reach the first and the last word only, which are unset to begin with.
        let reach = radius_px.div_ceil(64);
        let columns = (b.left / 64).saturating_sub(reach)
            ..(b.right / 64 + 1 + reach).min(self.words_per_row());
        let margin = if of_unset { radius_px } else { 0 };
        let rows = b.top.saturating_sub(margin)..(b.bottom + 1 + margin).min(self.height());
        let flip = if of_unset { u64::MAX } else { 0 };
        let to = &mut result;
        InstructionSet::best().run(Spread { of: self, flip, columns, rows, radius_px, to });
        // What was widened beyond the right border.
        if let Some(last) = self.words_per_row().checked_sub(1) {
            let valid = self.valid_bits(last);
            (0..self.height()).for_each(|y| result.row_mut(y)[last] &= valid);
        }
        result
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
        let Some(b) = self.bounds() else { return self.clone() };
        // Holes lie within the bounds; whatever reaches the pixel about them is no hole, and
        // neither is what reaches the picture's border where the bounds do.
        let (left, top) = (b.left.saturating_sub(1), b.top.saturating_sub(1));
        let right = (b.right + 1).min(self.width() - 1);
        let bottom = (b.bottom + 1).min(self.height() - 1);
        let (width, height) = (right + 1 - left, bottom + 1 - top);
        let background = self.window(left as i64, top as i64, width, height).not();
        let mut holes = Self::new(width, height);
        for hole in components(&background, Connectivity::Four) {
            let b = hole.bounds;
            let inside = b.left > 0 && b.top > 0 && b.right + 1 < width && b.bottom + 1 < height;
            if inside && hole.area_px <= largest_px {
                hole.draw(&mut holes);
            }
        }
        if holes.is_empty() {
            return self.clone();
        }
        self.or(&holes.window(-(left as i64), -(top as i64), self.width(), self.height()))
    }
}

/// Rows that are worked on together: few enough to stay in the nearest cache.
const TOGETHER: usize = 16;

/// Pixels to be spread over the discs about them.
struct Spread<'a> {
    of: &'a Mask,
    flip: u64,
    /// Words and rows outside of which nothing is set.
    columns: Range<usize>,
    rows: Range<usize>,
    radius_px: usize,
    to: &'a mut Mask,
}

impl Kernel for Spread<'_> {
    type Result = ();

    /// A row of the result is what the disc's rows reach about the rows above and below, each as far as the
    /// disc is wide there. It is made from the middle outwards: what the inner rows hold is widened by as
    /// much as the disc narrows, the next two are added, and so on. Some rows are made together, as one long
    /// row with gaps that no bit gets across, of which the compiler makes vectors.
    #[inline(always)]
    fn run(self) {
        let Self { of, flip, columns, rows, radius_px, to } = self;
        let n = columns.len();
        let stride = n + 2 * radius_px / 64 + 1;
        // Rows from two radii above the first to as far below the last: those that can be reached, and
        // those that these look at.
        let reached = rows.len() + 2 * radius_px;
        let height = reached.next_multiple_of(TOGETHER) + 2 * radius_px;
        let mut words = vec![0; height * stride];
        let mut is_set = vec![false; height];
        for (at, y) in (2 * radius_px..).zip(rows.clone()) {
            let row = &mut words[at * stride..][..n];
            for (to, word) in row.iter_mut().zip(&of.row(y)[columns.clone()]) {
                *to = word ^ flip;
            }
            if let Some(last) = row.last_mut() {
                *last &= of.valid_bits(columns.end - 1);
            }
            is_set[at] = row.iter().any(|word| *word != 0);
        }
        let mut wide = WideRows::new(TOGETHER * stride);
        for first in (0..reached).step_by(TOGETHER) {
            if !is_set[first..first + TOGETHER + 2 * radius_px].contains(&true) {
                continue;
            }
            // The middle row of the first one is `radius_px` further down.
            let row = |at: usize| &words[at * stride..];
            wide.set(row(first + radius_px));
            let mut half_width = radius_px;
            for dy in 1..=radius_px {
                let narrower = disc_half_width(radius_px, dy);
                wide.widen(half_width - narrower);
                wide.add(row(first + radius_px - dy), row(first + radius_px + dy));
                half_width = narrower;
            }
            for (at, words) in (first..).zip(wide.words().chunks_exact(stride)) {
                let y = (rows.start + at).checked_sub(radius_px);
                if let Some(y) = y.filter(|y| *y < to.height()) {
                    to.row_mut(y)[columns.clone()].copy_from_slice(&words[..n]);
                }
            }
        }
    }
}

/// A row of words between two without bits, which stand for what lies outside.
struct WideRows {
    words: Vec<u64>,
    before: Vec<u64>,
}

impl WideRows {
    fn new(words: usize) -> Self {
        Self { words: vec![0; words + 2], before: vec![0; words + 2] }
    }

    #[inline(always)]
    fn words(&self) -> &[u64] {
        &self.words[1..self.words.len() - 1]
    }

    /// Takes over as many words as there are.
    #[inline(always)]
    fn set(&mut self, words: &[u64]) {
        let end = self.words.len() - 1;
        self.words[1..end].copy_from_slice(&words[..end - 1]);
    }

    #[inline(always)]
    fn add(&mut self, a: &[u64], b: &[u64]) {
        let end = self.words.len() - 1;
        for (to, (a, b)) in self.words[1..end].iter_mut().zip(a.iter().zip(b)) {
            *to |= a | b;
        }
    }

    /// Every bit within `by` of one there is. Bits beyond the last pixel stay: they come from pixels as near.
    #[inline(always)]
    fn widen(&mut self, by: usize) {
        let mut widened = 0;
        while widened < by {
            // Runs are twice as wide and one by now, and may be moved that far without a gap.
            let step = (by - widened).min(2 * widened + 1).min(63);
            std::mem::swap(&mut self.words, &mut self.before);
            let (up, down) = (step as u32, 64 - step as u32);
            let end = self.words.len() - 1;
            let beside = self.before[..end - 1].iter().zip(&self.before[2..]);
            let middle = beside.zip(&self.before[1..end]);
            for (to, ((l, r), m)) in self.words[1..end].iter_mut().zip(middle) {
                *to = m | m << up | l >> down | m >> up | r << down;
            }
            widened += step;
        }
    }
}

/// Half-width of the disc's row `dy` from its middle.
fn disc_half_width(radius_px: usize, dy: usize) -> usize {
    (radius_px * radius_px - dy * dy).isqrt()
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

    /// Holes by their definition: what a flood from the picture's border does not reach.
    fn slow_holes_filled(mask: &Mask, largest: usize) -> Mask {
        let (w, h) = (mask.width(), mask.height());
        let mut result = mask.clone();
        let mut seen = vec![false; w * h];
        for start in 0..w * h {
            let (mut hole, mut inside, mut next) = (Vec::new(), true, vec![start]);
            while let Some(at) = next.pop() {
                let (x, y) = (at % w, at / w);
                if seen[at] || mask.get(x, y) {
                    continue;
                }
                seen[at] = true;
                hole.push((x, y));
                inside &= x > 0 && y > 0 && x + 1 < w && y + 1 < h;
                next.extend([at.saturating_sub(w), (at + w).min(w * h - 1)]);
                next.extend((x > 0).then(|| at - 1).into_iter().chain((x + 1 < w).then(|| at + 1)));
            }
            if inside && hole.len() <= largest {
                hole.into_iter().for_each(|(x, y)| result.set(x, y, true));
            }
        }
        result
    }

    proptest! {
        #[test]
        fn holes_are_what_no_flood_reaches(mask in arbitrary_mask(), largest in 0_usize..30) {
            prop_assert_eq!(mask.holes_filled(largest), slow_holes_filled(&mask, largest));
        }

        #[test]
        fn erosion_equals_its_definition(mask in arbitrary_mask(), radius in 0_usize..7) {
            prop_assert_eq!(mask.eroded(radius), slow_dilated(&mask.not(), radius).not());
        }

        #[test]
        fn wide_discs_reach_across_words(mask in arbitrary_mask(), radius in 60_usize..140) {
            let single = mask.and(&Mask::from_fn(mask.width(), mask.height(), |x, y| {
                (x * 31 + y * 17) % 97 == 0
            }));
            prop_assert_eq!(single.dilated(radius), slow_dilated(&single, radius));
        }

        #[test]
        fn dilation_equals_its_definition(mask in arbitrary_mask(), radius in 0_usize..7) {
            prop_assert_eq!(mask.dilated(radius), slow_dilated(&mask, radius));
        }

        /// Some blobs in an empty picture, so that parts of it are passed over.
        #[test]
        fn what_is_far_from_the_blobs_is_as_by_definition(
            blobs in proptest::collection::vec((0_usize..300, 0_usize..60, 1_usize..40), 0..4),
            radius in 0_usize..9,
        ) {
            let mask = Mask::from_fn(300, 60, |x, y| {
                blobs.iter().any(|(a, b, side)| x.abs_diff(*a) * 2 < *side && y.abs_diff(*b) * 2 < *side)
            });
            prop_assert_eq!(mask.dilated(radius), slow_dilated(&mask, radius));
            prop_assert_eq!(mask.eroded(radius), slow_dilated(&mask.not(), radius).not());
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
