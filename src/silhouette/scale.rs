//! Values of a small grid at the pixels of a larger one that shows the same picture.

use std::ops::Range;

use super::lab_image::Region;
use crate::mask::Mask;

/// How two grids of the same picture lie over one another.
pub(super) struct Scale {
    small: (usize, usize),
    /// For each column and row of the larger grid the lower of two of the small one, and the share
    /// of the upper.
    columns: Vec<(usize, f32)>,
    rows: Vec<(usize, f32)>,
}

impl Scale {
    pub(super) fn new(large: (usize, usize), small: (usize, usize)) -> Self {
        let axis = |large: usize, small: usize| {
            (0..large)
                .map(|x| {
                    let at = (x as f32 + 0.5) * small as f32 / large as f32 - 0.5;
                    let at = at.clamp(0.0, (small - 1) as f32);
                    let low = (at as usize).min(small.saturating_sub(2));
                    (low, at - low as f32)
                })
                .collect()
        };
        Self { small, columns: axis(large.0, small.0), rows: axis(large.1, small.1) }
    }

    /// Width and height of the larger grid.
    pub(super) fn size(&self) -> (usize, usize) {
        (self.columns.len(), self.rows.len())
    }

    /// For each column of the small grid the columns of the larger one that lie between it and the next.
    pub(super) fn columns_from(&self) -> Vec<Range<usize>> {
        from_each(&self.columns, self.small.0)
    }

    /// The same of rows.
    pub(super) fn rows_from(&self) -> Vec<Range<usize>> {
        from_each(&self.rows, self.small.1)
    }

    /// The value at one pixel of the larger grid, of a mask's 1 and 0 on the small one.
    pub(super) fn value_at(&self, (x, y): (usize, usize), mask: &Mask) -> f32 {
        let ((x, along), (y, across)) = (self.columns[x], self.rows[y]);
        let next = ((x + 1).min(self.small.0 - 1), (y + 1).min(self.small.1 - 1));
        let value = |x, y| f32::from(u8::from(mask.get(x, y)));
        let row = |y| value(x, y) * (1.0 - along) + value(next.0, y) * along;
        row(y) * (1.0 - across) + row(next.1) * across
    }

    /// The part of the small grid that a region of the larger one takes its values from.
    pub(super) fn part(&self, region: Region) -> Region {
        let span = |axis: &[(usize, f32)], small: usize| match (axis.first(), axis.last()) {
            (Some(first), Some(last)) => (first.0, (last.0 + 2).min(small)),
            _ => (0, 0),
        };
        let (left, right) = span(&self.columns[region.left..region.right], self.small.0);
        let (top, bottom) = span(&self.rows[region.top..region.bottom], self.small.1);
        Region { left, top, right, bottom }
    }

    /// The values at the pixels of a region of the larger grid, row by row, bilinear between the
    /// pixels' centres: from those of its [`part`](Self::part) of the small one.
    pub(super) fn sampled(&self, values: &[f32], region: Region) -> Vec<f32> {
        let part = self.part(region);
        let w = part.width();
        let across = |row: usize| -> Vec<f32> {
            let row = &values[(row - part.top) * w..(row - part.top + 1) * w];
            let between = |&(x, share): &(usize, f32)| {
                let x = x - part.left;
                row[x] * (1.0 - share) + row[(x + 1).min(w - 1)] * share
            };
            self.columns[region.left..region.right].iter().map(between).collect()
        };
        let mut all = Vec::with_capacity(region.pixels());
        // Two rows of the small grid serve several of the larger one.
        let mut upper: (usize, Vec<f32>) = (usize::MAX, Vec::new());
        let mut lower = upper.clone();
        for &(y, share) in &self.rows[region.top..region.bottom] {
            let below = (y + 1).min(self.small.1 - 1);
            if upper.0 != y {
                std::mem::swap(&mut upper, &mut lower);
                if upper.0 != y {
                    upper = (y, across(y));
                }
            }
            if lower.0 != below {
                lower = (below, across(below));
            }
            let rows = upper.1.iter().zip(&lower.1);
            all.extend(rows.map(|(upper, lower)| upper * (1.0 - share) + lower * share));
        }
        all
    }
}

/// Which places of an axis of the larger grid follow each of the small one's, before the next.
fn from_each(axis: &[(usize, f32)], small: usize) -> Vec<Range<usize>> {
    let first = |low: usize| axis.partition_point(|at| at.0 < low);
    (0..small).map(|low| first(low)..first(low + 1)).collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// Against each pixel by itself, from the whole of the small grid.
        #[test]
        fn a_region_is_sampled_as_its_pixels_are(
            (w, h) in (1_usize..9, 1_usize..9),
            (more_w, more_h) in (0_usize..14, 0_usize..14),
            corners in (0.0..1.0_f64, 0.0..1.0_f64, 0.0..1.0_f64, 0.0..1.0_f64),
            seed in 1_u32..1000,
        ) {
            let large = (w + more_w, h + more_h);
            let span = |a: f64, b: f64, size: usize| {
                let at = |share: f64| (share * size as f64) as usize;
                (at(a.min(b)), (at(a.max(b)) + 1).min(size))
            };
            let (left, right) = span(corners.0, corners.1, large.0);
            let (top, bottom) = span(corners.2, corners.3, large.1);
            let region = Region { left, top, right, bottom };
            let value = |x: usize, y: usize| ((x * 31 + y * 17) as u32 * seed % 97) as f32 - 40.0;
            let scale = Scale::new(large, (w, h));
            let part = scale.part(region);
            let values: Vec<f32> = (part.top..part.bottom)
                .flat_map(|y| (part.left..part.right).map(move |x| value(x, y)))
                .collect();
            let found = scale.sampled(&values, region);
            prop_assert_eq!(found.len(), region.pixels());
            let place = |at: usize, large: usize, small: usize| {
                let at = (at as f32 + 0.5) * small as f32 / large as f32 - 0.5;
                let at = at.clamp(0.0, (small - 1) as f32);
                let low = (at as usize).min(small.saturating_sub(2));
                (low, (low + 1).min(small - 1), at - low as f32)
            };
            for (at, found) in found.into_iter().enumerate() {
                let (x0, x1, fx) = place(left + at % region.width(), large.0, w);
                let (y0, y1, fy) = place(top + at / region.width(), large.1, h);
                let row = |y| value(x0, y) * (1.0 - fx) + value(x1, y) * fx;
                prop_assert_eq!(found, row(y0) * (1.0 - fy) + row(y1) * fy);
            }
        }
    }
}
