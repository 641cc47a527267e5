//! Another frame as it would look from this one.

use nalgebra::Matrix3;

use super::lab_image::{LabImage, Region};
use super::plate::UNKNOWN;
use crate::mask::Mask;

/// Steps a pixel is divided into for interpolation, each way, as a power of two: the product of two
/// weights and a byte fits 16 bits, so that vectors of these do.
const STEP_BITS: u32 = 4;
const STEPS: i32 = 1 << STEP_BITS;

/// Bits of the fraction of a coordinate.
const FRACTION_BITS: u32 = 12;

/// Half a step, which makes the weights those of the nearest one.
const HALF_STEP: i32 = 1 << (FRACTION_BITS - STEP_BITS - 1);

/// Pixels of a row whose places are interpolated between those of the first and the one after the
/// last: within a span of eight a camera's perspective bends them by some thousandths of a pixel.
const SPAN: usize = 8;

/// How far outside the other picture a point may lie, pixels: a camera at rest sees its border.
const SLACK_PX: f32 = 0.01;

/// Depth of a pixel, about one, below which the perspective of a camera is no more than a fluke.
const LEAST_DEPTH: f64 = 1e-3;

/// A picture ready to be looked at from other frames.
pub(super) struct Source<'a> {
    image: &'a LabImage,
    /// 255 where the animal may be.
    animal: Vec<u8>,
}

/// What a span looks at: L*, a*, b* and 255 where the animal may be.
type Seen = [[u8; SPAN]; 4];

impl<'a> Source<'a> {
    pub(super) fn of(image: &'a LabImage, animal: &Mask) -> Self {
        let (width, height) = (image.width(), image.height());
        let mut there = Vec::with_capacity(width * height);
        for y in 0..height {
            let words = &animal.words()[y * animal.words_per_row()..];
            there.extend((0..width).map(|x| (words[x / 64] >> (x % 64) & 1) as u8 * 255));
        }
        Self { image, animal: there }
    }

    fn width(&self) -> usize {
        self.image.width()
    }

    /// Whether there are three rows of [`COLUMNS`] bytes from a pixel on.
    #[inline]
    fn has_rows(&self, corner: usize) -> bool {
        corner + 2 * self.width() + COLUMNS <= self.animal.len()
    }

    fn planes(&self) -> [&[u8]; 4] {
        let [l, a, b] = self.image.planes();
        [l, a, b, &self.animal]
    }
}

/// The value between four pixels, by weights of its way from left to right and from top to bottom.
/// Differences may be less than zero; in the sum, modulo 2¹⁶, all is paid back.
#[expect(clippy::inline_always, reason = "the innermost loop, which is made vectors of")]
#[inline(always)]
fn between(top: [u8; 2], bottom: [u8; 2], fx: u16, fy: u16) -> u8 {
    let along = |from: u16, to: u16, f: u16| {
        (from << STEP_BITS).wrapping_add(to.wrapping_sub(from).wrapping_mul(f))
    };
    let [left, right] = std::array::from_fn(|x| along(top[x].into(), bottom[x].into(), fy));
    // Half of 256: rounded.
    (along(left, right, fx).wrapping_add(128) >> (2 * STEP_BITS)) as u8
}

/// A picture laid over a region of this frame by the camera's motion.
pub(super) struct Warped {
    pub(super) image: LabImage,
    /// [`UNKNOWN`] where the other picture has nothing, else 0.
    pub(super) outside: Vec<u8>,
    /// [`UNKNOWN`] where it has nothing or may have the animal, else 0.
    pub(super) not_background: Vec<u8>,
}

impl Warped {
    /// `other` is at least two pixels wide and high.
    pub(super) fn of(other: &Source, to_other: &Matrix3<f64>, region: Region) -> Self {
        if *to_other == Matrix3::identity() {
            return Self::seen_at_rest(other, region);
        }
        let (w, pixels) = (region.width(), region.pixels());
        let way = Way::new(to_other, other, region);
        // L*, a*, b*, what is outside and what is no background: whole planes, and a row of each in
        // whole spans, of which the last may reach beyond the region.
        let mut planes: [Vec<u8>; 5] = std::array::from_fn(|_| Vec::with_capacity(pixels));
        let spans = w.div_ceil(SPAN);
        let mut rows: [Vec<[u8; SPAN]>; 5] = std::array::from_fn(|_| vec![[0; SPAN]; spans]);
        let mut places = vec![(0.0, 0.0); spans + 1];
        for y in region.top..region.bottom {
            way.places(region.left as f32, y as f32, &mut places);
            for (at, ends) in places.array_windows().enumerate() {
                let mut seen = [[0; SPAN]; 4];
                let first = ((region.left + at * SPAN) as f32, y as f32);
                let none = way.look(other, first, *ends, &mut seen);
                let [l, a, b, there] = seen;
                // All bits are that of 128.
                let animal = there.map(|there| (there >> 7).wrapping_neg());
                let hidden = std::array::from_fn(|i| animal[i] | none[i]);
                for (row, span) in rows.iter_mut().zip([l, a, b, none, hidden]) {
                    row[at] = span;
                }
            }
            for (plane, row) in planes.iter_mut().zip(&rows) {
                plane.extend_from_slice(&row.as_flattened()[..w]);
            }
        }
        let [l, a, b, outside, not_background] = planes;
        let image = LabImage::from_planes(w, region.height(), [l, a, b]);
        Self { image, outside, not_background }
    }

    /// From a camera that did not move: every pixel is its own.
    fn seen_at_rest(other: &Source, region: Region) -> Self {
        let mut not_background = Vec::with_capacity(region.pixels());
        for row in other.animal.chunks_exact(other.width()).take(region.bottom).skip(region.top) {
            not_background.extend_from_slice(&row[region.left..region.right]);
        }
        let image = other.image.cropped(region);
        Self { image, outside: vec![0; region.pixels()], not_background }
    }
}

/// The way from pixels of this frame to those of another.
struct Way {
    m: [f32; 9],
    /// The last column and row of the other picture.
    last: (f32, f32),
    /// Whether the whole region lies in front of the other camera, which keeps what is between two
    /// pixels between their places.
    in_front: bool,
}

impl Way {
    fn new(to_other: &Matrix3<f64>, other: &Source, region: Region) -> Self {
        let depth = |x: usize, y: usize| {
            to_other[(2, 0)] * x as f64 + to_other[(2, 1)] * y as f64 + to_other[(2, 2)]
        };
        // A plane over the region is least at one of its corners; spans reach beyond its right side.
        let (left, right) = (region.left, region.right + SPAN);
        let corners = [(left, region.top), (right, region.top), (left, region.bottom)];
        let corners = corners.into_iter().chain([(right, region.bottom)]);
        Self {
            m: std::array::from_fn(|i| to_other[(i / 3, i % 3)] as f32),
            last: ((other.width() - 1) as f32, (other.image.height() - 1) as f32),
            in_front: corners.into_iter().all(|(x, y)| depth(x, y) > LEAST_DEPTH),
        }
    }

    #[inline]
    fn place(&self, x: f32, y: f32) -> (f32, f32) {
        let m = &self.m;
        let depth = 1.0 / (m[6] * x + m[7] * y + m[8]);
        ((m[0] * x + m[1] * y + m[2]) * depth, (m[3] * x + m[4] * y + m[5]) * depth)
    }

    /// The places of every eighth pixel of a row, from (`left`, `y`) on.
    fn places(&self, left: f32, y: f32, places: &mut [(f32, f32)]) {
        for (at, place) in places.iter_mut().enumerate() {
            *place = self.place(left + (at * SPAN) as f32, y);
        }
    }

    /// What the pixels from (`x`, `y`) to the right look at, the first of them and the one after the
    /// last at `ends`; [`UNKNOWN`] for those that look at nothing, which leave `seen` as it is, else 0.
    #[inline]
    fn look(
        &self,
        other: &Source,
        (x, y): (f32, f32),
        ends: [(f32, f32); 2],
        seen: &mut Seen,
    ) -> [u8; SPAN] {
        // Comparisons with NaN are false. A pole between the ends would part them widely.
        let well_inside = |&(sx, sy): &(f32, f32)| {
            sx >= 0.0 && sy >= 0.0 && sx < self.last.0 - 0.5 && sy < self.last.1 - 0.5
        };
        if ends.iter().all(well_inside) && (ends[1].0 - ends[0].0).abs() < 4.0 * SPAN as f32 {
            look_along(other, ends, seen);
            return [0; SPAN];
        }
        if self.in_front && self.beyond(ends) {
            return [UNKNOWN; SPAN];
        }
        std::array::from_fn(|i| {
            let inside = self.look_at(other, x + i as f32, y, i, seen);
            if inside { 0 } else { UNKNOWN }
        })
    }

    /// Whether both ends lie to one side of the other picture, clearly enough that all between them
    /// do.
    fn beyond(&self, ends: [(f32, f32); 2]) -> bool {
        let both = |is: &dyn Fn((f32, f32)) -> bool| is(ends[0]) && is(ends[1]);
        both(&|(sx, _)| sx < -1.0)
            || both(&|(_, sy)| sy < -1.0)
            || both(&|(sx, _)| sx > self.last.0 + 1.0)
            || both(&|(_, sy)| sy > self.last.1 + 1.0)
    }

    /// One point, which may lie outside; says whether it does not.
    #[cold]
    fn look_at(&self, other: &Source, x: f32, y: f32, i: usize, seen: &mut Seen) -> bool {
        let (sx, sy) = self.place(x, y);
        let (last_x, last_y) = self.last;
        // Written so that a NaN lies outside.
        let inside =
            sx > -SLACK_PX && sy > -SLACK_PX && sx < last_x + SLACK_PX && sy < last_y + SLACK_PX;
        if inside {
            let (sx, sy) = (sx.clamp(0.0, last_x), sy.clamp(0.0, last_y));
            let width = other.width();
            let x0 = (sx as usize).min(width - 2);
            let y0 = (sy as usize).min(other.image.height() - 2);
            let weight = |s: f32, low: usize| ((s - low as f32) * STEPS as f32 + 0.5) as u16;
            look_between(other, y0 * width + x0, (weight(sx, x0), weight(sy, y0)), i, seen);
        }
        inside
    }
}

/// The points of a span that lies inside.
#[inline]
fn look_along(other: &Source, ends: [(f32, f32); 2], seen: &mut Seen) {
    let line = Line::between(ends);
    let (from, to) = (line.pixel(0), line.pixel(SPAN as i32 - 1));
    // Beside steps of exactly one along a row, no pixel is off by more than the last is: coordinates
    // rise or fall all the way.
    let off = (to.0 - from.0 - (SPAN as i32 - 1), to.1 - from.1);
    let corner = |(x, y): (i32, i32)| y as usize * other.width() + x as usize;
    let lanes = |of: fn(&Line, i32) -> u16| std::array::from_fn(|i| of(&line, i as i32));
    let weights: Weights = [lanes(Line::weight_x), lanes(Line::weight_y)];
    if off == (0, 0) {
        look_along_row(other, corner(from), &weights, seen);
        return;
    }
    // From the first pixel of all, which the last one may be left of or above of; at the picture's
    // left side it may be missing.
    let least = (from.0 + off.0.min(0), from.1 + off.1.min(0));
    if off.0.abs() <= 1 && off.1.abs() <= 1 && least.0 >= 0 && other.has_rows(corner(least)) {
        let further = std::array::from_fn(|i| {
            let (x, y) = line.pixel(i as i32);
            [x - least.0 - i as i32, y - least.1].map(|by| (by as u8).wrapping_neg())
        });
        look_along_rows(other, corner(least), &further, &weights, seen);
        return;
    }
    look_pixel_by_pixel(other, &line, seen);
}

/// Places along a span, evenly spaced, coordinates in fixed point.
struct Line {
    start: (i32, i32),
    step: (i32, i32),
}

impl Line {
    /// From the place of the first pixel to that of the one after the last.
    #[inline]
    fn between(ends: [(f32, f32); 2]) -> Self {
        let fixed = |s: f32| (s * (1 << FRACTION_BITS) as f32) as i32;
        let step = |from: f32, to: f32| fixed((to - from) / SPAN as f32);
        Self {
            start: (fixed(ends[0].0) + HALF_STEP, fixed(ends[0].1) + HALF_STEP),
            step: (step(ends[0].0, ends[1].0), step(ends[0].1, ends[1].1)),
        }
    }

    /// The pixel left of and above place `i`.
    #[inline]
    fn pixel(&self, i: i32) -> (i32, i32) {
        let whole = |start: i32, step: i32| (start + i * step) >> FRACTION_BITS;
        (whole(self.start.0, self.step.0), whole(self.start.1, self.step.1))
    }

    #[inline]
    fn weight_x(&self, i: i32) -> u16 {
        weight(self.start.0 + i * self.step.0)
    }

    #[inline]
    fn weight_y(&self, i: i32) -> u16 {
        weight(self.start.1 + i * self.step.1)
    }
}

/// Steps of a coordinate from the pixel it lies behind.
#[inline]
fn weight(s: i32) -> u16 {
    (s >> (FRACTION_BITS - STEP_BITS) & (STEPS - 1)) as u16
}

/// Weights of eight pixels, along and across.
type Weights = [[u16; SPAN]; 2];

/// Eight neighbouring pixels at once.
#[inline]
fn look_along_row(other: &Source, corner: usize, [fx, fy]: &Weights, seen: &mut Seen) {
    for (seen, plane) in seen.iter_mut().zip(other.planes()) {
        let top: &[u8; SPAN + 1] = plane[corner..].first_chunk().unwrap_or(&[0; SPAN + 1]);
        let bottom: &[u8; SPAN + 1] =
            plane[corner + other.width()..].first_chunk().unwrap_or(&[0; SPAN + 1]);
        for i in 0..SPAN {
            seen[i] = between([top[i], top[i + 1]], [bottom[i], bottom[i + 1]], fx[i], fy[i]);
        }
    }
}

/// Columns that eight pixels look at, one of which may be one further right than its neighbours say.
const COLUMNS: usize = SPAN + 2;

/// Eight pixels that lie side by side but for a column and a row that some are further than others:
/// `further`, 255 for one that is, 0 for one that is not, along and across. A camera that turns or
/// comes closer leaves most spans like this.
#[inline]
fn look_along_rows(
    other: &Source,
    corner: usize,
    further: &[[u8; 2]; SPAN],
    [fx, fy]: &Weights,
    seen: &mut Seen,
) {
    for (seen, plane) in seen.iter_mut().zip(other.planes()) {
        let rows: [&[u8; COLUMNS]; 3] = std::array::from_fn(|y| {
            plane[corner + y * other.width()..].first_chunk().unwrap_or(&[0; COLUMNS])
        });
        // Chosen by bits instead of by an index, so that vectors of these do.
        let either = |here: u8, there: u8, mask: u8| here & !mask | there & mask;
        for i in 0..SPAN {
            let [along, across] = further[i];
            let [above, middle, below] = rows.map(|row| {
                [either(row[i], row[i + 1], along), either(row[i + 1], row[i + 2], along)]
            });
            let top = [either(above[0], middle[0], across), either(above[1], middle[1], across)];
            let bottom = [either(middle[0], below[0], across), either(middle[1], below[1], across)];
            seen[i] = between(top, bottom, fx[i], fy[i]);
        }
    }
}

/// Eight pixels, wherever they are.
#[cold]
fn look_pixel_by_pixel(other: &Source, line: &Line, seen: &mut Seen) {
    for i in 0..SPAN {
        let at = i as i32;
        let (x, y) = line.pixel(at);
        let corner = y as usize * other.width() + x as usize;
        look_between(other, corner, (line.weight_x(at), line.weight_y(at)), i, seen);
    }
}

/// One point between the pixel `corner` and those right of and below it.
#[inline]
fn look_between(other: &Source, corner: usize, (fx, fy): (u16, u16), i: usize, seen: &mut Seen) {
    for (seen, plane) in seen.iter_mut().zip(other.planes()) {
        let here = &plane[corner..corner + other.width() + 2];
        let (top, bottom) = ([here[0], here[1]], [here[other.width()], here[other.width() + 1]]);
        seen[i] = between(top, bottom, fx, fy);
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// A picture whose three planes differ.
    fn picture(w: usize, h: usize, values: &[u8]) -> LabImage {
        let plane = |c: usize| values.iter().map(|v| v.wrapping_mul(2 * c as u8 + 1)).collect();
        LabImage::from_planes(w, h, [plane(0), plane(1), plane(2)])
    }

    #[test]
    fn a_camera_at_rest_is_no_special_case_to_see() {
        let values: Vec<u8> = (0..12 * 9).map(|at| (at * 37 % 256) as u8).collect();
        let animal = Mask::from_fn(12, 9, |x, y| (x * y) % 3 == 1);
        let picture = picture(12, 9, &values);
        let other = Source::of(&picture, &animal);
        // A motion too small to be seen, but no identity.
        let mut nearly = Matrix3::identity();
        nearly[(0, 1)] = 1e-30;
        for region in [
            Region { left: 0, top: 0, right: 12, bottom: 9 },
            Region { left: 1, top: 2, right: 10, bottom: 8 },
        ] {
            let rest = Warped::of(&other, &Matrix3::identity(), region);
            let moved = Warped::of(&other, &nearly, region);
            assert_eq!(rest.image, moved.image);
            assert_eq!(rest.outside, moved.outside);
            assert_eq!(rest.not_background, moved.not_background);
        }
    }

    proptest! {
        /// Eight pixels at once against one after the other, for cameras that moved little and much.
        #[test]
        fn spans_are_what_their_pixels_are_one_by_one(
            values in proptest::collection::vec(proptest::num::u8::ANY, 24 * 9),
            start in (0.0_f32..12.0, 0.0_f32..7.4),
            step in (0.8_f32..1.2, -0.15_f32..0.15),
            far in proptest::bool::ANY,
        ) {
            let picture = picture(24, 9, &values);
            let animal = Mask::from_fn(24, 9, |x, y| (x * y) % 3 == 1);
            let other = Source::of(&picture, &animal);
            let along = if far { 2.0 - step.0 } else { step.0 };
            let end = |start: f32, step: f32, last: f32| {
                (start + SPAN as f32 * step).clamp(0.0, last - 0.51)
            };
            let ends = [start, (end(start.0, along, 23.0), end(start.1, step.1, 8.0))];
            let [mut found, mut wanted] = [[[0; SPAN]; 4]; 2];
            look_along(&other, ends, &mut found);
            look_pixel_by_pixel(&other, &Line::between(ends), &mut wanted);
            prop_assert_eq!(found, wanted);
        }

        /// Spans that lie beside the other picture as a whole, against each of their pixels.
        #[test]
        fn what_is_beside_the_other_picture_looks_at_nothing(
            values in proptest::collection::vec(proptest::num::u8::ANY, 12 * 9),
            shift in (-30.0_f64..30.0, -30.0_f64..30.0),
            tilt in (-0.04_f64..0.04, -0.04_f64..0.04),
        ) {
            let picture = picture(12, 9, &values);
            let other = Source::of(&picture, &Mask::new(12, 9));
            let m = Matrix3::new(1.0, 0.1, shift.0, -0.1, 1.0, shift.1, tilt.0, tilt.1, 1.0);
            let region = Region { left: 0, top: 0, right: 24, bottom: 20 };
            let warped = Warped::of(&other, &m, region);
            let mut way = Way::new(&m, &other, region);
            way.in_front = false;
            for y in 0..20 {
                let ends = |x: usize| [x, x + SPAN].map(|x| way.place(x as f32, y as f32));
                for x in [0, SPAN, 2 * SPAN] {
                    let mut seen = [[0; SPAN]; 4];
                    let none = way.look(&other, (x as f32, y as f32), ends(x), &mut seen);
                    let at = y * 24 + x;
                    prop_assert_eq!(&warped.outside[at..at + SPAN], &none);
                    prop_assert_eq!(&warped.image.planes()[1][at..at + SPAN], &seen[1]);
                }
            }
        }

        /// Against bilinear interpolation in double precision, to the step of the weights.
        #[test]
        fn values_are_those_between_the_four_pixels_about_each_point(
            values in proptest::collection::vec(proptest::num::u8::ANY, 12 * 9),
            animal in proptest::collection::vec(proptest::bool::ANY, 12 * 9),
            shift in (-5.0_f64..5.0, -4.0_f64..4.0),
            turn in -0.2_f64..0.2,
            tilt in -0.004_f64..0.004,
        ) {
            let other = picture(12, 9, &values);
            let m = Matrix3::new(
                turn.cos(), -turn.sin(), shift.0,
                turn.sin(), turn.cos(), shift.1,
                tilt, 0.0, 1.0,
            );
            let region = Region { left: 2, top: 1, right: 11, bottom: 8 };
            let animal = Mask::from_bools(12, 9, &animal).unwrap();
            let warped = Warped::of(&Source::of(&other, &animal), &m, region);
            for at in 0..region.pixels() {
                let (x, y) = (at % region.width() + 2, at / region.width() + 1);
                let p = m * nalgebra::Vector3::new(x as f64, y as f64, 1.0);
                let (sx, sy) = (p.x / p.z, p.y / p.z);
                if sx < -0.02 || sy < -0.02 || sx > 11.02 || sy > 8.02 {
                    prop_assert_eq!((warped.outside[at], warped.not_background[at]), (255, 255));
                    continue;
                }
                if sx < 0.0 || sy < 0.0 || sx > 11.0 || sy > 8.0 {
                    continue;
                }
                prop_assert_eq!(warped.outside[at], 0);
                // Between pixels of both kinds it is the weights that decide.
                let near = |s: f64| (s - s.round()).abs() < 0.2;
                if near(sx) && near(sy) {
                    let nearest = sy.round() as usize * 12 + sx.round() as usize;
                    prop_assert_eq!(warped.not_background[at] == 0, !animal.get(nearest % 12, nearest / 12));
                }
                for c in 0..3 {
                    let plane = &other.planes()[c];
                    let value = |x: usize, y: usize| f64::from(plane[y.min(8) * 12 + x.min(11)]);
                    let (x0, y0, fx, fy) = (sx as usize, sy as usize, sx.fract(), sy.fract());
                    let wanted = (value(x0, y0) * (1.0 - fx) + value(x0 + 1, y0) * fx) * (1.0 - fy)
                        + (value(x0, y0 + 1) * (1.0 - fx) + value(x0 + 1, y0 + 1) * fx) * fy;
                    let found = f64::from(warped.image.planes()[c][at]);
                    // Half a step either way and a tenth of a pixel for the bend, 255 steep, and the
                    // last rounding.
                    let off = 255.0 * (1.0 / 16.0 + 0.2) + 0.6;
                    prop_assert!((found - wanted).abs() <= off, "{} {}", found, wanted);
                }
            }
        }
    }
}
