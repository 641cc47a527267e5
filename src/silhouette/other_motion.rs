//! The motion of what the camera's motion does not explain: of the places of a draft, some lie where
//! the camera's motion brings them, and most of the others where one displacement does.

use std::ops::Range;

use super::lab_image::LabImage;
use crate::mask::{Mask, Run};
use crate::numeric::{InstructionSet, Kernel};

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
#[inline(always)]
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
    for run in &places.runs {
        let Inside { columns, there } = Inside::of(*run, from, shift);
        differences.resize(differences.len() + columns.start - run.start, MOST);
        let here = run.y * from.width() + columns.start..run.y * from.width() + columns.end;
        let pairs = |c: usize| {
            let other = &to.planes()[c][there..there + here.len()];
            from.planes()[c][here.clone()].iter().zip(other)
        };
        differences
            .extend(pairs(0).zip(pairs(1)).zip(pairs(2)).map(|((l, a), b)| difference(l, a, b)));
        differences.resize(differences.len() + run.end - columns.end, MOST);
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
    InstructionSet::best().run(Search { from, to, places, explained, shifts })
}

/// Displacements to be searched for the best.
struct Search<'a, I> {
    from: &'a LabImage,
    to: &'a LabImage,
    places: &'a Places,
    explained: &'a [u16],
    shifts: I,
}

impl<I: Iterator<Item = (i64, i64)>> Kernel for Search<'_, I> {
    type Result = Option<(i64, i64)>;

    #[inline(always)]
    fn run(self) -> Self::Result {
        let Self { from, to, places, explained, shifts } = self;
        let mut best: Option<(u32, (i64, i64))> = None;
        for shift in shifts {
            let least = best.map_or(u32::MAX, |(least, _)| least);
            if let Some(sum) = lesser_sum((from, to), places, explained, shift, least) {
                best = Some((sum, shift));
            }
        }
        best.map(|(_, shift)| shift)
    }
}

/// The sum, over the places, of the lesser of what is left by a displacement and by what was explained; `None`
/// from `least` on.
#[inline(always)]
fn lesser_sum(
    (from, to): (&LabImage, &LabImage),
    places: &Places,
    mut explained: &[u16],
    shift: (i64, i64),
    least: u32,
) -> Option<u32> {
    let width = from.width();
    let mut sum = 0;
    for run in &places.runs {
        let (of_run, others) = explained.split_at(run.end - run.start);
        explained = others;
        let inside = Inside::of(*run, from, shift);
        let (before, rest) = of_run.split_at(inside.columns.start - run.start);
        let (within, after) = rest.split_at(inside.columns.len());
        for explained in [before, after] {
            sum += explained.iter().map(|e| u32::from(MOST.min(*e))).sum::<u32>();
        }
        let here = run.y * width + inside.columns.start..run.y * width + inside.columns.end;
        let there = inside.there..inside.there + here.len();
        let [l, a, b] = from.planes().each_ref().map(|plane| plane[here.clone()].iter());
        let [other_l, other_a, other_b] =
            to.planes().each_ref().map(|plane| plane[there.clone()].iter());
        let pairs = l.zip(other_l).zip(a.zip(other_a)).zip(b.zip(other_b)).zip(within);
        let lesser = pairs.map(|(((l, a), b), explained)| difference(l, a, b).min(*explained));
        sum += lesser.map(u32::from).sum::<u32>();
        if sum >= least {
            return None;
        }
    }
    (sum < least).then_some(sum)
}

/// What of a run lies inside the other picture when it is displaced.
struct Inside {
    /// Columns of the run, perhaps none.
    columns: Range<usize>,
    /// The pixel of the other picture that the first of them comes to.
    there: usize,
}

impl Inside {
    #[inline(always)]
    fn of(run: Run, picture: &LabImage, shift: (i64, i64)) -> Self {
        let (w, h) = (picture.width() as i64, picture.height() as i64);
        let there = run.y as i64 + shift.1;
        let (left, right) = (run.start as i64, run.end as i64);
        let inside = |x: i64| x.max(-shift.0).min(w - shift.0).clamp(left, right);
        let (first, last) = (inside(left), inside(right));
        if there < 0 || there >= h || first >= last {
            return Self { columns: run.start..run.start, there: 0 };
        }
        let columns = first as usize..last as usize;
        Self { columns, there: (there * w + first + shift.0) as usize }
    }
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

        /// Against the sums over all places, displacement by displacement, many of which lie in part outside.
        #[test]
        fn the_best_displacement_is_the_first_of_the_least_sum(
            (w, h, from, to, pixels) in (1_usize..12, 1_usize..7).prop_flat_map(|(w, h)| {
                let pixels = proptest::collection::vec(proptest::bool::ANY, w * h);
                (Just(w), Just(h), picture(w, h), picture(w, h), pixels)
            }),
            explained in proptest::collection::vec(0_u16..=MOST, 84),
        ) {
            let places = Places::of(&Mask::from_bools(w, h, &pixels).unwrap());
            let explained = &explained[..places.count()];
            let mut differences = Vec::new();
            let mut sum = |shift| -> u32 {
                shifted(&from, &to, &places, shift, &mut differences);
                differences.iter().zip(explained).map(|(a, b)| u32::from(*a.min(b))).sum()
            };
            let wanted = around((1, 0), 5, 3).min_by_key(|shift| sum(*shift));
            let found = best_shift((&from, &to), &places, explained, around((1, 0), 5, 3));
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
