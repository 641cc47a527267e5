//! Where the animal is expected: about where the draft has it.

use super::lab_image::Region;
use crate::mask::Mask;
use crate::numeric::grid_distances_sq;

/// Distance of every pixel from the nearest set pixel, pixels; very far for an empty mask.
pub(super) fn distances(mask: &Mask) -> Vec<f32> {
    let whole = Region { left: 0, top: 0, right: mask.width(), bottom: mask.height() };
    from_nearest(mask, whole, true)
}

/// Distances of the pixels of a region from the nearest pixel of it that is set or clear.
fn from_nearest(mask: &Mask, region: Region, set: bool) -> Vec<f32> {
    let mut there = Vec::with_capacity(region.pixels());
    for y in region.top..region.bottom {
        let row = &mask.words()[y * mask.words_per_row()..(y + 1) * mask.words_per_row()];
        let columns = region.left..region.right;
        there.extend(columns.map(|x| (row[x / 64] >> (x % 64) & 1 == 1) == set));
    }
    let squares = grid_distances_sq(&there, region.width(), region.height());
    squares.into_iter().map(root).collect()
}

/// The root of a squared distance. A number of 31 bits is the faster to convert; the only larger
/// one says that there is no nearest pixel.
#[inline]
fn root(square: u32) -> f32 {
    let square = if square > i32::MAX as u32 { u32::MAX as f32 } else { square as i32 as f32 };
    square.sqrt()
}

/// Distance of each pixel of a region from the silhouette, pixels; inside it, less than zero, from
/// the background. Only what has to be is looked at: the region with the silhouette's bounds, for
/// the nearest pixel of the silhouette, and the bounds, widened by a pixel, for that of the
/// background.
pub(super) fn signed_distances(mask: &Mask, region: Region) -> Vec<f32> {
    let held = mask.bounds().map(|b| Region {
        left: b.left.saturating_sub(1),
        top: b.top.saturating_sub(1),
        right: (b.right + 2).min(mask.width()),
        bottom: (b.bottom + 2).min(mask.height()),
    });
    let both = held.map_or(region, |held| Region {
        left: held.left.min(region.left),
        top: held.top.min(region.top),
        right: held.right.max(region.right),
        bottom: held.bottom.max(region.bottom),
    });
    let mut signed = from_nearest(mask, both, true);
    if let Some(held) = held {
        let within = from_nearest(mask, held, false);
        for (y, within) in (held.top..).zip(within.chunks_exact(held.width())) {
            let first = (y - both.top) * both.width() + held.left - both.left;
            for (signed, within) in signed[first..].iter_mut().zip(within) {
                *signed -= within;
            }
        }
    }
    if both == region {
        return signed;
    }
    let rows = region.top - both.top..region.bottom - both.top;
    let columns = region.left - both.left..region.right - both.left;
    rows.flat_map(|y| &signed[y * both.width()..][columns.clone()]).copied().collect()
}

/// Logarithm of the prior odds at every pixel of a region: up to +1 inside the draft, down to −3 a
/// body's length outside it. The unit of length is the root of the area, so that nothing depends on
/// how large the animal shows.
pub(super) fn location_odds(draft: &Mask, region: Region) -> Vec<f32> {
    let length = (draft.area() as f32).sqrt().max(1.0);
    let mut odds = signed_distances(draft, region);
    for odds in &mut odds {
        *odds = if *odds > 0.0 {
            -(3.0 * *odds / length).min(3.0)
        } else {
            (20.0 * -*odds / length).min(1.0)
        };
    }
    odds
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// Against both distances over the whole picture.
        #[test]
        fn a_part_of_the_picture_has_the_distances_of_the_whole(
            (w, h, pixels) in (1_usize..16, 1_usize..12).prop_flat_map(|(w, h)| {
                let pixels = proptest::collection::vec(proptest::bool::weighted(0.2), w * h);
                let all = Just(vec![true; w * h]);
                (Just(w), Just(h), prop_oneof![8 => pixels, 1 => all])
            }),
            corners in (0.0..1.0_f64, 0.0..1.0_f64, 0.0..1.0_f64, 0.0..1.0_f64),
        ) {
            let mask = Mask::from_bools(w, h, &pixels).unwrap();
            let span = |a: f64, b: f64, size: usize| {
                let at = |share: f64| (share * size as f64) as usize;
                (at(a.min(b)), (at(a.max(b)) + 1).min(size))
            };
            let (left, right) = span(corners.0, corners.1, w);
            let (top, bottom) = span(corners.2, corners.3, h);
            let region = Region { left, top, right, bottom };
            let (outside, inside) = (distances(&mask), distances(&mask.not()));
            let found = signed_distances(&mask, region);
            prop_assert_eq!(found.len(), region.pixels());
            for (at, found) in found.into_iter().enumerate() {
                let there = (top + at / region.width()) * w + left + at % region.width();
                prop_assert_eq!(found, outside[there] - inside[there]);
            }
        }
    }
}
