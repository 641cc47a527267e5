//! A mask at a larger size.

use super::scale::Scale;
use crate::mask::{Mask, Run};

/// The mask at a larger size, its outline smooth: where the values 1 inside and 0 outside, bilinear between
/// the pixels' centres, are one half or more. Between four pixels that are alike, as nearly all are, there
/// is nothing to interpolate.
pub(super) fn enlarged(mask: &Mask, size: (usize, usize)) -> Mask {
    let (w, h) = (mask.width(), mask.height());
    if (w, h) == size {
        return mask.clone();
    }
    let scale = Scale::new(size, (w, h));
    let (columns, rows) = (scale.columns_from(), scale.rows_from());
    // No pixel lies between the last column or row and the next, unless there is but one.
    let (right, below) = (i64::from(w > 1), i64::from(h > 1));
    let corners = [(right, 0), (0, below), (right, below)];
    let corners = corners.map(|(left, top)| mask.window(left, top, w, h));
    let all = corners.iter().fold(mask.clone(), |all, corner| all.and(corner));
    let any = corners.iter().fold(mask.clone(), |any, corner| any.or(corner));
    let mut result = Mask::new(size.0, size.1);
    let part =
        |run: &Run| (rows[run.y].clone(), columns[run.start].start..columns[run.end - 1].end);
    for run in all.runs() {
        let (rows, columns) = part(&run);
        for y in rows {
            result.fill(Run { y, start: columns.start, end: columns.end });
        }
    }
    for run in any.and_not(&all).runs() {
        let (rows, columns) = part(&run);
        for y in rows {
            for x in columns.clone().filter(|x| scale.value_at((*x, y), mask) >= 0.5) {
                result.set(x, y, true);
            }
        }
    }
    result
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::lab_image::Region;
    use super::*;

    proptest! {
        /// Against interpolating every pixel.
        #[test]
        fn it_is_what_is_one_half_or_more_of_each_pixel_interpolated(
            (w, h) in (1_usize..90, 1_usize..12),
            (more_w, more_h) in (0_usize..150, 0_usize..20),
            (seed, coarse) in (any::<u64>(), 1_usize..9),
        ) {
            let mask = Mask::from_fn(w, h, |x, y| {
                let z = seed ^ ((x / coarse * 977 + y / coarse * 7919) as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15);
                (z ^ (z >> 29)).wrapping_mul(0xBF58_476D_1CE4_E5B9) >> 63 == 1
            });
            let size = (w + more_w, h + more_h);
            let values: Vec<f32> =
                (0..w * h).map(|at| f32::from(u8::from(mask.get(at % w, at / w)))).collect();
            let whole = Region { left: 0, top: 0, right: size.0, bottom: size.1 };
            let sampled = Scale::new(size, (w, h)).sampled(&values, whole);
            let wanted = Mask::from_fn(size.0, size.1, |x, y| sampled[y * size.0 + x] >= 0.5);
            prop_assert_eq!(enlarged(&mask, size), wanted);
        }
    }
}
