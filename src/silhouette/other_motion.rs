//! The motion of what the camera's motion does not explain: of the places of a draft, some lie where
//! the camera's motion brings them, and most of the others where one displacement does.

use super::lab_image::LabImage;
use crate::mask::{Mask, Run};

/// Differences are counted up to this, half units of L*a*b* summed over the channels: larger ones say
/// no more.
pub(super) const MOST: u16 = 60;

/// Sizes at which a frame is looked at: a half, a quarter and an eighth of the sketch's.
pub(super) const LEVELS: usize = 3;

/// A frame at [`LEVELS`] sizes, the largest first: each pixel is the mean of four of the one before,
/// which evens out noise and half a pixel of misalignment.
pub(super) struct Reduced {
    pub(super) levels: [LabImage; LEVELS],
}

impl Reduced {
    pub(super) fn of(frame: &LabImage) -> Self {
        let half = frame.halved();
        let quarter = half.halved();
        let eighth = quarter.halved();
        Self { levels: [half, quarter, eighth] }
    }
}

/// The pixels of a mask, row by row.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Places {
    pub(super) runs: Vec<Run>,
}

impl Places {
    pub(super) fn of(mask: &Mask) -> Self {
        Self { runs: mask.runs() }
    }

    pub(super) fn count(&self) -> usize {
        self.runs.iter().map(|run| run.end - run.start).sum()
    }
}

/// The difference of two pixels, of which each channel is a pair of bytes, up to [`MOST`]. Bytes of L* are
/// half units, those of a* and b* whole ones.
#[inline]
pub(super) fn difference(l: (&u8, &u8), a: (&u8, &u8), b: (&u8, &u8)) -> u16 {
    let apart = |(a, b): (&u8, &u8)| u16::from(a.abs_diff(*b));
    (apart(l) + 2 * (apart(a) + apart(b))).min(MOST)
}

/// Differences at each of some places of `from` from what lies `shift` away from it in `to`, up to
/// [`MOST`]; that where `to` has nothing.
pub(super) fn shifted(
    from: &LabImage,
    to: &LabImage,
    places: &Places,
    shift: (i64, i64),
    differences: &mut Vec<u16>,
) {
    differences.clear();
    let (w, h) = (from.width() as i64, from.height() as i64);
    for &Run { y, start: left, end: right } in &places.runs {
        let there = y as i64 + shift.1;
        let inside =
            |x: usize| (x as i64).max(-shift.0).min(w - shift.0).clamp(left as i64, right as i64);
        let (first, last) = (inside(left) as usize, inside(right) as usize);
        if there < 0 || there >= h || first >= last {
            differences.resize(differences.len() + right - left, MOST);
            continue;
        }
        differences.resize(differences.len() + first - left, MOST);
        let here = y * from.width() + first..y * from.width() + last;
        let start = (there * w + first as i64 + shift.0) as usize;
        let pairs = |c: usize| {
            let other = &to.planes()[c][start..start + here.len()];
            from.planes()[c][here.clone()].iter().zip(other)
        };
        differences
            .extend(pairs(0).zip(pairs(1)).zip(pairs(2)).map(|((l, a), b)| difference(l, a, b)));
        differences.resize(differences.len() + right - last, MOST);
    }
}

/// Of some displacements the one that explains most of what is not explained already: the first of
/// those with the least sum, over the places, of the lesser of the two differences.
pub(super) fn best_shift(
    (from, to): (&LabImage, &LabImage),
    places: &Places,
    explained: &[u16],
    shifts: impl Iterator<Item = (i64, i64)>,
) -> Option<(i64, i64)> {
    let mut differences = Vec::with_capacity(explained.len());
    let mut best: Option<(u32, (i64, i64))> = None;
    for shift in shifts {
        shifted(from, to, places, shift, &mut differences);
        let lesser = differences.iter().zip(explained).map(|(a, b)| u32::from(*a.min(b)));
        let sum = lesser.sum();
        if best.is_none_or(|(least, _)| sum < least) {
            best = Some((sum, shift));
        }
    }
    best.map(|(_, shift)| shift)
}

/// All displacements at most `along` and `across` from one.
pub(super) fn around(
    middle: (i64, i64),
    along: i64,
    across: i64,
) -> impl Iterator<Item = (i64, i64)> {
    let columns = middle.0 - along..=middle.0 + along;
    (middle.1 - across..=middle.1 + across)
        .flat_map(move |dy| columns.clone().map(move |dx| (dx, dy)))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn picture(w: usize, h: usize) -> impl Strategy<Value = LabImage> {
        let plane = move || proptest::collection::vec(100_u8..150, w * h);
        (plane(), plane(), plane())
            .prop_map(move |(l, a, b)| LabImage::from_planes(w, h, [l, a, b]))
    }

    proptest! {
        #[test]
        fn places_are_the_pixels_of_the_mask_in_order(
            (w, h, pixels) in (1_usize..80, 1_usize..6).prop_flat_map(|(w, h)| {
                (Just(w), Just(h), proptest::collection::vec(proptest::bool::ANY, w * h))
            }),
        ) {
            let places = Places::of(&Mask::from_bools(w, h, &pixels).unwrap());
            let found: Vec<usize> =
                places.runs.iter().flat_map(|r| (r.start..r.end).map(move |x| r.y * w + x)).collect();
            let wanted: Vec<usize> = (0..w * h).filter(|at| pixels[*at]).collect();
            prop_assert_eq!(places.count(), wanted.len());
            prop_assert_eq!(found, wanted);
        }

        /// Against the definition, pixel by pixel.
        #[test]
        fn shifted_differences_are_those_of_the_definition(
            (w, h, from, to, pixels) in (1_usize..12, 1_usize..7).prop_flat_map(|(w, h)| {
                let pixels = proptest::collection::vec(proptest::bool::ANY, w * h);
                (Just(w), Just(h), picture(w, h), picture(w, h), pixels)
            }),
            shift in (-14_i64..14, -8_i64..8),
        ) {
            let places = Places::of(&Mask::from_bools(w, h, &pixels).unwrap());
            let mut found = vec![7; 3];
            shifted(&from, &to, &places, shift, &mut found);
            let wanted: Vec<u16> = (0..w * h)
                .filter(|at| pixels[*at])
                .map(|at| {
                    let (x, y) = ((at % w) as i64 + shift.0, (at / w) as i64 + shift.1);
                    if x < 0 || y < 0 || x >= w as i64 || y >= h as i64 {
                        return MOST;
                    }
                    let (a, b) = (from.at(at), to.at(y as usize * w + x as usize));
                    let d = |c: usize| u16::from(a[c].abs_diff(b[c]));
                    (d(0) + 2 * d(1) + 2 * d(2)).min(MOST)
                })
                .collect();
            prop_assert_eq!(found, wanted);
        }

        /// A planted displacement of a part of the places, the rest being explained already.
        #[test]
        fn what_is_not_explained_yet_decides(
            picture in picture(40, 30), by in (-5_i64..=5, -3_i64..=3),
        ) {
            let (w, h) = (40, 30);
            let moved = |plane: &Vec<u8>| -> Vec<u8> {
                (0..w * h)
                    .map(|at: usize| {
                        let (x, y) = ((at % w) as i64 - by.0, (at / w) as i64 - by.1);
                        plane[(y.rem_euclid(h as i64) * w as i64 + x.rem_euclid(w as i64)) as usize]
                    })
                    .collect()
            };
            let to = LabImage::from_planes(w, h, picture.planes().each_ref().map(moved));
            let mask = Mask::from_fn(w, h, |x, y| (8..32).contains(&x) && (6..24).contains(&y));
            let places = Places::of(&mask);
            // Two thirds are explained already.
            let explained: Vec<u16> =
                (0..places.count()).map(|at| if at % 3 == 0 { MOST } else { 0 }).collect();
            let found = best_shift((&picture, &to), &places, &explained, around((0, 0), 6, 4));
            prop_assert_eq!(found, Some(by));
        }
    }
}
