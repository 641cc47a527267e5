//! The background plate: what a pixel shows when the animal is not there.
//!
//! A camera that follows the animal, or one that stands still while it passes, sees every piece of
//! background before or after the animal covers it. The frames some way before and after are laid
//! over a frame by the camera's motion, without the pixels the animal is thought to cover in them;
//! a background pixel then finds its own colour in most of them, an animal's pixel in few.

use nalgebra::Matrix3;

use super::lab_image::LabImage;

/// Frames before and after that a frame is compared with, for footage at [`REFERENCE_FPS`]. Near
/// ones are aligned best, far ones have the animal elsewhere.
const OFFSETS: [usize; 6] = [5, 8, 12, 16, 24, 32];

/// The frame rate that [`OFFSETS`] are meant for.
const REFERENCE_FPS: f64 = 24.0;

/// Of the distances to the valid frames the one at this rank is taken, as a share of their number:
/// low, since some frames still show another animal, its shadow or a wave there, but not the
/// lowest, since one chance likeness proves nothing.
const RANK: usize = 3;

/// Distances kept a pixel: enough for the rank among all offsets on both sides.
const KEPT: usize = 2 * OFFSETS.len() / RANK + 1;

/// No frame shows the background there.
pub(super) const UNKNOWN: u8 = 255;

/// Rectangle of pixels: columns `left..right` of rows `top..bottom`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Region {
    pub(super) left: usize,
    pub(super) top: usize,
    pub(super) right: usize,
    pub(super) bottom: usize,
}

impl Region {
    pub(super) fn width(self) -> usize {
        self.right - self.left
    }

    pub(super) fn height(self) -> usize {
        self.bottom - self.top
    }

    pub(super) fn pixels(self) -> usize {
        self.width() * self.height()
    }
}

/// How far each pixel of a region of a frame is from the background's colour there.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct PlateDistances {
    pub(super) region: Region,
    /// Half units of L*a*b* distance up to 254 from what shows the background; [`UNKNOWN`] where no
    /// frame does.
    shown: Vec<u8>,
    /// The same from all that is there, the animal's pixels too; [`UNKNOWN`] where nothing is.
    any: Vec<u8>,
    /// The background's mean colour, L*a*b* bytes, where it is shown.
    colours: Vec<[u8; 3]>,
}

impl PlateDistances {
    /// Distance from the background at a pixel of the frame; [`UNKNOWN`] outside the region.
    #[inline]
    pub(super) fn shown(&self, x: usize, y: usize) -> u8 {
        self.index(x, y).map_or(UNKNOWN, |at| self.shown[at])
    }

    /// Distance from whatever the other frames have there, background or animal.
    #[inline]
    pub(super) fn any(&self, x: usize, y: usize) -> u8 {
        self.index(x, y).map_or(UNKNOWN, |at| self.any[at])
    }

    /// The background's colour at a pixel, L*a*b* bytes; `None` where no frame shows it.
    #[inline]
    pub(super) fn colour(&self, x: usize, y: usize) -> Option<[u8; 3]> {
        let at = self.index(x, y)?;
        (self.shown[at] != UNKNOWN).then(|| self.colours[at])
    }

    #[inline]
    fn index(&self, x: usize, y: usize) -> Option<usize> {
        let r = self.region;
        let inside = x >= r.left && x < r.right && y >= r.top && y < r.bottom;
        inside.then(|| (y - r.top) * r.width() + x - r.left)
    }
}

/// The other frames that frame `t` of `frames` is compared with.
pub(super) fn compared_frames(t: usize, frames: usize, fps: f64) -> Vec<usize> {
    let stretch = (fps / REFERENCE_FPS).max(1.0);
    let offset = |o: usize| (o as f64 * stretch).round() as usize;
    let before = OFFSETS.iter().rev().filter_map(|&o| t.checked_sub(offset(o)));
    let after = OFFSETS.iter().map(|&o| t + offset(o)).filter(|&s| s < frames);
    before.chain(after).collect()
}

/// Compares a region of a frame with `others`: each a picture, one byte a pixel that is not 0 where
/// the animal may be in it, and the matrix that takes coordinates of this frame to its own.
pub(super) fn plate_distances<'a>(
    frame: &LabImage,
    region: Region,
    others: impl Iterator<Item = (&'a LabImage, &'a [u8], Matrix3<f64>)>,
) -> PlateDistances {
    // Between fewer pixels than two by two nothing can be interpolated.
    if region.pixels() == 0 || frame.width().min(frame.height()) < 2 {
        let nothing = vec![UNKNOWN; region.pixels()];
        return PlateDistances {
            region,
            shown: nothing.clone(),
            any: nothing,
            colours: vec![[0; 3]; region.pixels()],
        };
    }
    let frame = cut_out(frame, region);
    let own = Box3::of(&frame);
    let pixels = region.pixels();
    let (mut shown, mut any) = (Smallest::new(pixels), Smallest::new(pixels));
    let mut distances = vec![0_u8; pixels];
    // Three channels and their number.
    let mut sums = vec![[0_u16; 4]; pixels];
    for (other, animal, to_other) in others {
        let (warped, there) = warped(other, animal, &to_other, region);
        compare(&frame, &own, &warped, &Box3::of(&warped), &mut distances);
        for (at, sum) in sums.iter_mut().enumerate() {
            if there[at] == Shows::Background {
                let colour = warped.at(at);
                *sum = std::array::from_fn(|c| match c {
                    3 => sum[3] + 1,
                    _ => sum[c] + u16::from(colour[c]),
                });
            }
        }
        let mut hidden = distances.clone();
        for ((d, h), there) in distances.iter_mut().zip(&mut hidden).zip(&there) {
            *h |= if *there == Shows::Background { 0 } else { UNKNOWN };
            *d |= if *there == Shows::Nothing { UNKNOWN } else { 0 };
        }
        shown.add(&mut hidden);
        any.add(&mut distances);
    }
    let colours =
        sums.iter().map(|sum| std::array::from_fn(|c| (sum[c] / sum[3].max(1)) as u8)).collect();
    PlateDistances { region, shown: shown.ranked(), any: any.ranked(), colours }
}

/// What another frame has at a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Shows {
    /// The pixel lies outside the other picture.
    Nothing,
    Animal,
    Background,
}

/// The pixels of a region.
fn cut_out(frame: &LabImage, region: Region) -> LabImage {
    let planes = std::array::from_fn(|c| {
        (region.top..region.bottom)
            .flat_map(|y| {
                let row = y * frame.width();
                frame.planes()[c][row + region.left..row + region.right].iter().copied()
            })
            .collect()
    });
    LabImage::from_planes(region.width(), region.height(), planes)
}

/// The least and the greatest value of each plane in the 3 × 3 pixels about each pixel: what half a
/// pixel of misalignment may turn a colour into.
struct Box3 {
    low: [Vec<u8>; 3],
    high: [Vec<u8>; 3],
}

impl Box3 {
    fn of(image: &LabImage) -> Self {
        let (w, h) = (image.width(), image.height());
        let each = |pick: fn(u8, u8) -> u8| -> [Vec<u8>; 3] {
            std::array::from_fn(|c| filtered(&image.planes()[c], w, h, pick))
        };
        Self { low: each(u8::min), high: each(u8::max) }
    }
}

/// `pick` over the 3 × 3 neighbourhood, by columns and then by rows.
fn filtered(plane: &[u8], w: usize, h: usize, pick: fn(u8, u8) -> u8) -> Vec<u8> {
    // Generic over a function pointer would not be inlined in the loops.
    if pick(0, 1) == 0 {
        filtered_by(plane, w, h, u8::min)
    } else {
        filtered_by(plane, w, h, u8::max)
    }
}

fn filtered_by(plane: &[u8], w: usize, h: usize, pick: impl Fn(u8, u8) -> u8) -> Vec<u8> {
    let mut across = plane.to_vec();
    for (row, out) in plane.chunks_exact(w).zip(across.chunks_exact_mut(w)) {
        for (o, (a, b)) in out[1..].iter_mut().zip(row[..w - 1].iter().zip(&row[1..])) {
            *o = pick(*a, *b);
        }
        for (o, b) in out[..w - 1].iter_mut().zip(&row[1..]) {
            *o = pick(*o, *b);
        }
    }
    let mut result = across.clone();
    for y in 0..h {
        let out = &mut result[y * w..(y + 1) * w];
        for near in [y.checked_sub(1), Some(y + 1).filter(|&n| n < h)].into_iter().flatten() {
            for (o, v) in out.iter_mut().zip(&across[near * w..(near + 1) * w]) {
                *o = pick(*o, *v);
            }
        }
    }
    result
}

/// Distance of each pixel from the other picture's box and of the other picture's pixel from this
/// one's box, whichever is larger: a colour counts as found only when each explains the other.
fn compare(frame: &LabImage, own: &Box3, other: &LabImage, there: &Box3, distances: &mut [u8]) {
    let n = distances.len();
    let mut sums = vec![(0_i32, 0_i32); n];
    for c in 0..3 {
        // To half units: bytes of L* are, those of a* and b* are whole ones.
        let unit = if c == 0 { 1 } else { 2 };
        let slices = [
            &frame.planes()[c],
            &other.planes()[c],
            &own.low[c],
            &own.high[c],
            &there.low[c],
            &there.high[c],
        ]
        .map(|v| &v[..n]);
        let [i, j, low, high, low_there, high_there] = slices;
        for (at, sum) in sums.iter_mut().enumerate() {
            let v = |s: &[u8]| i32::from(s[at]);
            let here = (v(low_there) - v(i)).max(v(i) - v(high_there)).max(0) * unit;
            let back = (v(low) - v(j)).max(v(j) - v(high)).max(0) * unit;
            sum.0 += here * here;
            sum.1 += back * back;
        }
    }
    for (distance, sum) in distances.iter_mut().zip(&sums) {
        *distance = ((sum.0.max(sum.1) as f32).sqrt() as u8).min(UNKNOWN - 1);
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

    /// Takes in one value a pixel, [`UNKNOWN`] for none; `carried` is used up.
    fn add(&mut self, carried: &mut [u8]) {
        for (seen, value) in self.seen.iter_mut().zip(&*carried) {
            *seen += u8::from(*value != UNKNOWN);
        }
        for rank in &mut self.ranks {
            for (kept, carried) in rank.iter_mut().zip(carried.iter_mut()) {
                let (a, b) = (*kept, *carried);
                *kept = a.min(b);
                *carried = a.max(b);
            }
        }
    }

    fn ranked(&self) -> Vec<u8> {
        let rank = |n: u8| (usize::from(n) / RANK).min(KEPT - 1);
        self.seen.iter().enumerate().map(|(at, &n)| self.ranks[rank(n)][at]).collect()
    }
}

/// `other` as seen from a region of this frame, and what it has at each pixel.
fn warped(
    other: &LabImage,
    animal: &[u8],
    to_other: &Matrix3<f64>,
    region: Region,
) -> (LabImage, Vec<Shows>) {
    let (w, h) = (region.width(), region.height());
    let mut planes = [vec![0_u8; w * h], vec![0_u8; w * h], vec![0_u8; w * h]];
    let mut there = vec![Shows::Nothing; w * h];
    let (ow, oh) = (other.width(), other.height());
    let m: [f32; 9] = std::array::from_fn(|i| to_other[(i / 3, i % 3)] as f32);
    let source = other.planes();
    for y in 0..h {
        let yf = (y + region.top) as f32;
        let row = [m[1] * yf + m[2], m[4] * yf + m[5], m[7] * yf + m[8]];
        for x in 0..w {
            let xf = (x + region.left) as f32;
            let depth = 1.0 / (m[6] * xf + row[2]);
            let (sx, sy) = ((m[0] * xf + row[0]) * depth, (m[3] * xf + row[1]) * depth);
            // Written so that a NaN lies outside; the slack lets a camera at rest see its border.
            let inside = sx > -0.01
                && sy > -0.01
                && sx < (ow - 1) as f32 + 0.01
                && sy < (oh - 1) as f32 + 0.01;
            if !inside {
                continue;
            }
            let (sx, sy) = (sx.clamp(0.0, (ow - 1) as f32), sy.clamp(0.0, (oh - 1) as f32));
            let (x0, y0) = ((sx as usize).min(ow - 2), (sy as usize).min(oh - 2));
            let nearest = (sy + 0.5) as usize * ow + (sx + 0.5) as usize;
            let at = y * w + x;
            there[at] = if animal[nearest] == 0 { Shows::Background } else { Shows::Animal };
            // Bilinear, with weights of 1/64 each way: 12 bits in all.
            let fx = ((sx - x0 as f32) * 64.0 + 0.5) as u32;
            let fy = ((sy - y0 as f32) * 64.0 + 0.5) as u32;
            let weights = [(64 - fx) * (64 - fy), fx * (64 - fy), (64 - fx) * fy, fx * fy];
            let corner = y0 * ow + x0;
            for (plane, out) in source.iter().zip(&mut planes) {
                let (upper, lower) =
                    (&plane[corner..corner + 2], &plane[corner + ow..corner + ow + 2]);
                let sum = u32::from(upper[0]) * weights[0]
                    + u32::from(upper[1]) * weights[1]
                    + u32::from(lower[0]) * weights[2]
                    + u32::from(lower[1]) * weights[3];
                out[at] = ((sum + 2048) >> 12) as u8;
            }
        }
    }
    (LabImage::from_planes(w, h, planes), there)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

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
            let there = vec![0; w * h];
            let others = [(&frame, there.as_slice(), Matrix3::identity())].into_iter();
            let plate = plate_distances(&frame, whole(w, h), others);
            assert!((0..w * h).all(|at| plate.shown(at % w, at / w) == UNKNOWN));
        }
        let nothing = Region { left: 0, top: 0, right: 0, bottom: 0 };
        let plate = plate_distances(&grey(9, 9, &[0; 81]), nothing, std::iter::empty());
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
        let others: Vec<(LabImage, Vec<u8>, Matrix3<f64>)> = (1..4)
            .map(|k| {
                let there: Vec<u8> =
                    (0..w * h).map(|at| u8::from(at % w > 30 && at / w > 20)).collect();
                let to_other =
                    Matrix3::new(1.0, 0.0, -3.0 * f64::from(k), 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
                (grey(w, h, &ramp(3 * k as usize)), there, to_other)
            })
            .collect();
        let frame = grey(w, h, &own);
        let plate = plate_distances(
            &frame,
            whole(w, h),
            others.iter().map(|(image, there, m)| (image, there.as_slice(), *m)),
        );
        assert!(plate.shown(13, 13) > 60, "{}", plate.shown(13, 13));
        assert!(plate.shown(20, 5) <= 1, "{}", plate.shown(20, 5));
        assert_eq!(plate.shown(0, 5), UNKNOWN, "no frame shows the left border");
    }

    proptest! {
        /// The kept values against sorting all of them.
        #[test]
        fn the_rank_is_that_of_the_sorted_values(
            seen in proptest::collection::vec(proptest::collection::vec(0_u8..255, 4), 1..13),
        ) {
            let mut smallest = Smallest::new(4);
            for values in &seen {
                smallest.add(&mut values.clone());
            }
            let ranked = smallest.ranked();
            for at in 0..4 {
                let mut column: Vec<u8> = seen.iter().map(|v| v[at]).collect();
                column.sort_unstable();
                prop_assert_eq!(ranked[at], column[seen.len() / RANK]);
            }
        }

        /// The box filter against looking at the nine pixels.
        #[test]
        fn the_box_is_that_of_the_nine_pixels(
            (w, h, plane) in (1_usize..9, 1_usize..9)
                .prop_flat_map(|(w, h)| (Just(w), Just(h), proptest::collection::vec(0_u8..255, w * h))),
        ) {
            let high = filtered(&plane, w, h, u8::max);
            let low = filtered(&plane, w, h, u8::min);
            for at in 0..w * h {
                let near = |other: &usize| (other % w).abs_diff(at % w) < 2 && (other / w).abs_diff(at / w) < 2;
                let nine: Vec<u8> = (0..w * h).filter(near).map(|at| plane[at]).collect();
                prop_assert_eq!(Some(&high[at]), nine.iter().max());
                prop_assert_eq!(Some(&low[at]), nine.iter().min());
            }
        }
    }
}
