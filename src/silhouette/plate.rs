//! The background plate: what a pixel shows when the animal is not there.
//!
//! A camera that follows the animal, or one that stands still while it passes, sees every piece of
//! background before or after the animal covers it. The frames some way before and after are laid
//! over a frame by the camera's motion, without the pixels the animal is thought to cover in them;
//! a background pixel then finds its own colour in most of them, an animal's pixel in few.

use nalgebra::Matrix3;

use super::lab_image::{LabImage, Region};
use super::likeness::{Box3, compare};
use super::warp::{Source, Warped};
use crate::numeric::{InstructionSet, Kernel, whole_part};

/// Frames before and after that a frame is compared with, for footage at [`REFERENCE_FPS`]. Near
/// ones are aligned best, far ones have the animal elsewhere.
pub(super) const OFFSETS: [usize; 6] = [5, 8, 12, 16, 24, 32];

/// Half of them, for a first look.
pub(super) const FEW_OFFSETS: [usize; 3] = [5, 12, 24];

/// The frame rate that [`OFFSETS`] are meant for.
pub(super) const REFERENCE_FPS: f64 = 24.0;

/// Of the distances to the valid frames the one at this rank is taken, as a share of their number:
/// low, since some frames still show another animal, its shadow or a wave there, but not the
/// lowest, since one chance likeness proves nothing.
const RANK: usize = 3;

/// Distances kept a pixel: enough for the rank among all offsets on both sides.
const KEPT: usize = 2 * OFFSETS.len() / RANK + 1;

/// Pixels that are ranked at a time: with all their ranks they stay in the nearest cache.
const RANKED: usize = 1024;

/// No frame shows the background there.
pub(super) const UNKNOWN: u8 = 255;

/// How far each pixel of a region of a frame is from the background's colour there.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct PlateDistances {
    pub(super) region: Region,
    /// Half units of L*a*b* distance up to 254 from what shows the background; [`UNKNOWN`] where no
    /// frame does.
    shown: Vec<u8>,
    /// The background's mean colour, L*a*b* bytes, where it is shown; empty where it was not asked
    /// for.
    colours: Vec<[u8; 3]>,
    /// Distances from all that is there, the animal's pixels too; [`UNKNOWN`] where nothing is. Only
    /// corrected frames can teach what they mean; empty where they were not asked for.
    any: Vec<u8>,
}

/// What is asked of a plate beside the distances from the background.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Asked {
    /// Nothing.
    Nothing,
    /// The colour of what is behind the animal.
    Colours,
    /// That, and the distances from all that is there.
    All,
}

impl PlateDistances {
    /// Of nothing: what is not known of a draft that was only remembered.
    pub(super) fn nowhere() -> Self {
        let region = Region { left: 0, top: 0, right: 0, bottom: 0 };
        Self { region, shown: Vec::new(), colours: Vec::new(), any: Vec::new() }
    }

    /// Distance from the background at a pixel of the frame; [`UNKNOWN`] outside the region.
    #[inline]
    pub(super) fn shown(&self, x: usize, y: usize) -> u8 {
        self.index(x, y).map_or(UNKNOWN, |at| self.shown[at])
    }

    /// Distance from whatever the other frames have there, background or animal.
    #[inline]
    pub(super) fn any(&self, x: usize, y: usize) -> u8 {
        self.index(x, y).and_then(|at| self.any.get(at).copied()).unwrap_or(UNKNOWN)
    }

    /// The background's colour at a pixel, L*a*b* bytes; `None` where no frame shows it.
    #[inline]
    pub(super) fn colour(&self, x: usize, y: usize) -> Option<[u8; 3]> {
        let at = self.index(x, y)?;
        let colour = self.colours.get(at)?;
        (self.shown[at] != UNKNOWN).then_some(*colour)
    }

    #[inline]
    fn index(&self, x: usize, y: usize) -> Option<usize> {
        let r = self.region;
        let inside = x >= r.left && x < r.right && y >= r.top && y < r.bottom;
        inside.then(|| (y - r.top) * r.width() + x - r.left)
    }
}

/// The other frames that frame `t` of `frames` is compared with, so far before and after at [`REFERENCE_FPS`].
pub(super) fn compared_frames(t: usize, frames: usize, fps: f64, offsets: &[usize]) -> Vec<usize> {
    let stretch = (fps / REFERENCE_FPS).max(1.0);
    let offset = |o: usize| (o as f64 * stretch).round() as usize;
    let before = offsets.iter().rev().filter_map(|&o| t.checked_sub(offset(o)));
    let after = offsets.iter().map(|&o| t + offset(o)).filter(|&s| s < frames);
    before.chain(after).collect()
}

/// Compares a region of a frame with `others`: each a picture that knows where the animal may be in
/// it, and the matrix that takes coordinates of this frame to its own.
pub(super) fn plate_distances<'a, 'b: 'a>(
    frame: &LabImage,
    region: Region,
    others: impl Iterator<Item = (&'a Source<'b>, Matrix3<f64>)>,
    asked: Asked,
) -> PlateDistances {
    let pixels = region.pixels();
    // Between fewer pixels than two by two nothing can be interpolated.
    if pixels == 0 || frame.width().min(frame.height()) < 2 {
        let shown = vec![UNKNOWN; pixels];
        return PlateDistances { region, shown, colours: Vec::new(), any: Vec::new() };
    }
    let frame = frame.cropped(region);
    let own = Box3::of(&frame);
    let mut shown = Smallest::new(pixels);
    let mut mean = (asked >= Asked::Colours).then(|| MeanColour::new(pixels));
    let mut any = (asked >= Asked::All).then(|| Smallest::new(pixels));
    let mut distances = vec![0_u8; pixels];
    let instructions = InstructionSet::best();
    let mut warped = Warped::blank(region);
    for (other, to_other) in others {
        warped.lay(other, &to_other, region);
        compare(&frame, &own, &warped.image, &mut distances);
        let (distances, flags) = (&distances, &warped.not_background);
        instructions.run(Ranking { to: &mut shown, distances, flags });
        if let Some(any) = &mut any {
            instructions.run(Ranking { to: any, distances, flags: &warped.outside });
        }
        if let Some(mean) = &mut mean {
            instructions.run(Summing { to: mean, warped: &warped });
        }
    }
    PlateDistances {
        region,
        shown: shown.ranked(),
        colours: mean.map_or_else(Vec::new, |mean| instructions.run(Means(&mean))),
        any: any.map_or_else(Vec::new, |any| any.ranked()),
    }
}

/// Another picture to be added to the mean colours.
struct Summing<'a> {
    to: &'a mut MeanColour,
    warped: &'a Warped,
}

impl Kernel for Summing<'_> {
    type Result = ();

    #[inline(always)]
    fn run(self) {
        self.to.add(self.warped);
    }
}

/// Distances from another picture to be ranked, of which flags are [`UNKNOWN`] where they do not count.
struct Ranking<'a> {
    to: &'a mut Smallest,
    distances: &'a [u8],
    flags: &'a [u8],
}

impl Kernel for Ranking<'_> {
    type Result = ();

    #[inline(always)]
    fn run(self) {
        self.to.add(self.distances, self.flags);
    }
}

/// Sums of the background's colour at each pixel, and their number.
struct MeanColour {
    sums: [Vec<u16>; 3],
    seen: Vec<u16>,
}

impl MeanColour {
    fn new(pixels: usize) -> Self {
        Self { sums: std::array::from_fn(|_| vec![0; pixels]), seen: vec![0; pixels] }
    }

    #[inline(always)]
    fn add(&mut self, warped: &Warped) {
        let hidden = &warped.not_background;
        for (sums, plane) in self.sums.iter_mut().zip(warped.image.planes()) {
            for ((sum, value), hidden) in sums.iter_mut().zip(plane).zip(hidden) {
                *sum += u16::from(value & !hidden);
            }
        }
        for (seen, hidden) in self.seen.iter_mut().zip(hidden) {
            *seen += u16::from(!hidden & 1);
        }
    }

    #[inline(always)]
    fn colours(&self) -> Vec<[u8; 3]> {
        let [l, a, b] = self.sums.each_ref().map(|sums| sums.iter());
        let mut colours = vec![[0; 3]; self.seen.len()];
        for (colour, (((l, a), b), seen)) in colours.iter_mut().zip(l.zip(a).zip(b).zip(&self.seen))
        {
            // Sums of so few bytes are no nearer to a multiple from below than floats can tell.
            let seen = f32::from((*seen).max(1));
            let mean = |sum: &u16| whole_part(f32::from(*sum) / seen) as u8;
            *colour = [mean(l), mean(a), mean(b)];
        }
        colours
    }
}

/// Mean colours to be worked out.
struct Means<'a>(&'a MeanColour);

impl Kernel for Means<'_> {
    type Result = Vec<[u8; 3]>;

    #[inline(always)]
    fn run(self) -> Self::Result {
        self.0.colours()
    }
}

/// The smallest few values seen at each pixel, in order, and how many there were.
struct Smallest {
    ranks: [Vec<u8>; KEPT],
    seen: Vec<u8>,
}

impl Smallest {
    fn new(pixels: usize) -> Self {
        Self { ranks: std::array::from_fn(|_| vec![UNKNOWN; pixels]), seen: vec![0; pixels] }
    }

    /// Takes in one distance a pixel, but where it is flagged by [`UNKNOWN`].
    #[inline(always)]
    fn add(&mut self, distances: &[u8], flags: &[u8]) {
        let mut carried = [0; RANKED];
        let blocks = distances.chunks(RANKED).zip(flags.chunks(RANKED));
        for (at, (distances, flags)) in blocks.enumerate() {
            let here = at * RANKED..at * RANKED + distances.len();
            let carried = &mut carried[..distances.len()];
            let values = distances.iter().zip(flags);
            for ((carried, seen), (distance, flag)) in
                carried.iter_mut().zip(&mut self.seen[here.clone()]).zip(values)
            {
                *carried = distance | flag;
                *seen += u8::from(*carried != UNKNOWN);
            }
            for rank in &mut self.ranks {
                for (kept, carried) in rank[here.clone()].iter_mut().zip(carried.iter_mut()) {
                    let (a, b) = (*kept, *carried);
                    *kept = a.min(b);
                    *carried = a.max(b);
                }
            }
        }
    }

    fn ranked(&self) -> Vec<u8> {
        let rank = |n: u8| (usize::from(n) / RANK).min(KEPT - 1);
        self.seen.iter().enumerate().map(|(at, &n)| self.ranks[rank(n)][at]).collect()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::mask::Mask;

    fn grey(width: usize, height: usize, values: &[u8]) -> LabImage {
        let flat = vec![128; width * height];
        LabImage::from_planes(width, height, [values.to_vec(), flat.clone(), flat])
    }

    fn whole(width: usize, height: usize) -> Region {
        Region { left: 0, top: 0, right: width, bottom: height }
    }

    #[test]
    fn pictures_without_room_for_interpolation_say_nothing() {
        for (w, h) in [(1, 1), (1, 9), (9, 1)] {
            let frame = grey(w, h, &vec![7; w * h]);
            let other = Source::of(&frame, &Mask::new(w, h));
            let others = [(&other, Matrix3::identity())].into_iter();
            let plate = plate_distances(&frame, whole(w, h), others, Asked::All);
            assert!((0..w * h).all(|at| plate.shown(at % w, at / w) == UNKNOWN));
        }
        let nothing = Region { left: 0, top: 0, right: 0, bottom: 0 };
        let plate = plate_distances(&grey(9, 9, &[0; 81]), nothing, std::iter::empty(), Asked::All);
        assert_eq!(plate.shown(3, 3), UNKNOWN);
    }

    #[test]
    fn the_animal_stands_out_from_a_moving_background_and_where_it_was_is_not_asked() {
        // A ramp that moves by three pixels a frame; in the frame asked about, a square of another
        // grey; the other frames have it elsewhere and say so.
        let (w, h) = (40, 30);
        let ramp = |shift: usize| -> Vec<u8> {
            (0..w * h).map(|at| (((at % w) + shift) * 3 % 251) as u8).collect()
        };
        let mut own = ramp(0);
        let square = |at: usize| (10..16).contains(&(at % w)) && (10..16).contains(&(at / w));
        (0..w * h).filter(|&at| square(at)).for_each(|at| own[at] = 200);
        let ramps: Vec<LabImage> = (1..4).map(|k| grey(w, h, &ramp(3 * k))).collect();
        let others: Vec<(Source, Matrix3<f64>)> = (1_u8..4)
            .zip(&ramps)
            .map(|(k, ramp)| {
                let there = Mask::from_fn(w, h, |x, y| x > 30 && y > 20);
                let to_other =
                    Matrix3::new(1.0, 0.0, -3.0 * f64::from(k), 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
                (Source::of(ramp, &there), to_other)
            })
            .collect();
        let frame = grey(w, h, &own);
        let plate =
            plate_distances(&frame, whole(w, h), others.iter().map(|(o, m)| (o, *m)), Asked::All);
        assert!(plate.shown(13, 13) > 60, "{}", plate.shown(13, 13));
        assert!(plate.shown(20, 5) <= 1, "{}", plate.shown(20, 5));
        assert_eq!(plate.shown(0, 5), UNKNOWN, "no frame shows the left border");
    }

    /// Of all sums there can be.
    #[test]
    fn mean_colours_are_whole_parts() {
        for seen in 0..=2 * OFFSETS.len() as u16 {
            let sums: Vec<u16> = (0..=255 * seen).collect();
            let seen_each = vec![seen; sums.len()];
            let mean =
                MeanColour { sums: [sums.clone(), sums.clone(), sums.clone()], seen: seen_each };
            for (sum, colour) in sums.iter().zip(InstructionSet::best().run(Means(&mean))) {
                assert_eq!(colour, [(sum / seen.max(1)) as u8; 3]);
            }
        }
    }

    proptest! {
        /// The kept values against sorting all of them.
        #[test]
        fn the_rank_is_that_of_the_sorted_values(
            seen in proptest::collection::vec(proptest::collection::vec(0_u8..255, 4), 1..13),
        ) {
            let mut smallest = Smallest::new(4);
            for values in &seen {
                smallest.add(values, &[0; 4]);
            }
            let ranked = smallest.ranked();
            for at in 0..4 {
                let mut column: Vec<u8> = seen.iter().map(|v| v[at]).collect();
                column.sort_unstable();
                prop_assert_eq!(ranked[at], column[seen.len() / RANK]);
            }
        }
    }
}
