//! Another frame as it would look from this one.

use nalgebra::Matrix3;

use super::lab_image::{LabImage, Region};
use super::plate::UNKNOWN;
use super::warp_row::{Lines, Row, SPAN, STEPS, Window};
use crate::mask::Mask;
use crate::numeric::{InstructionSet, Kernel};

/// How far outside the other picture a point may lie, pixels: a camera at rest sees its border.
const SLACK_PX: f32 = 0.01;

/// Pixels about those a region looks at that are needed: the one after the last and what is read with it.
const MARGIN_PX: f32 = 4.0;

/// Depth of a pixel, about one, below which the perspective of a camera is no more than a fluke.
const LEAST_DEPTH: f64 = 1e-3;

/// A picture ready to be looked at from other frames.
pub(super) struct Source<'a> {
    image: &'a LabImage,
    /// 255 where the animal may be.
    animal: Vec<u8>,
}

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

    pub(super) fn width(&self) -> usize {
        self.image.width()
    }

    pub(super) fn planes(&self) -> [&[u8]; 4] {
        let [l, a, b] = self.image.planes();
        [l, a, b, &self.animal]
    }
}

/// A picture laid over a region of this frame by the camera's motion.
pub(super) struct Warped {
    pub(super) image: LabImage,
    /// [`UNKNOWN`] where the other picture has nothing, else 0.
    pub(super) outside: Vec<u8>,
    /// [`UNKNOWN`] where it has nothing or may have the animal, else 0.
    pub(super) not_background: Vec<u8>,
    /// What of the other picture is looked at.
    window: Window,
}

impl Warped {
    /// Nothing yet, over a region.
    pub(super) fn blank(region: Region) -> Self {
        let plane = || vec![0; region.pixels()];
        let image =
            LabImage::from_planes(region.width(), region.height(), [plane(), plane(), plane()]);
        Self { image, outside: plane(), not_background: plane(), window: Window::default() }
    }

    /// `other` is at least two pixels wide and high.
    pub(super) fn of(other: &Source, to_other: &Matrix3<f64>, region: Region) -> Self {
        let mut warped = Self::blank(region);
        warped.lay(other, to_other, region);
        warped
    }

    /// Puts another picture in the place of the one before, over a region of the same size.
    pub(super) fn lay(&mut self, other: &Source, to_other: &Matrix3<f64>, region: Region) {
        if *to_other == Matrix3::identity() {
            self.lay_at_rest(other, region);
        } else {
            InstructionSet::best().run(Warping { to: self, other, to_other, region });
        }
    }

    #[inline(always)]
    fn lay_moved(&mut self, other: &Source, to_other: &Matrix3<f64>, region: Region) {
        let w = region.width();
        let way = Way::new(to_other, other, region);
        self.window.show(other, way.seen(region));
        let other = &self.window;
        let spans = w.div_ceil(SPAN);
        let mut row = Row::new(spans);
        let mut lines = Lines::new(spans);
        for y in region.top..region.bottom {
            let first = |at: usize| ((region.left + at * SPAN) as f32, y as f32);
            lines.set(|at| way.place(first(at).0, y as f32));
            for at in 0..spans {
                row.outside[at] = way.look(other, first(at), &lines, at, &mut row);
            }
            let here = (y - region.top) * w..(y - region.top + 1) * w;
            let [l, a, b] = self.image.planes_mut().each_mut().map(|p| &mut p[here.clone()]);
            let hidden = &mut self.not_background[here.clone()];
            let outside = &mut self.outside[here];
            row.interpolate([l, a, b, &mut *hidden]);
            outside.copy_from_slice(&row.outside.as_flattened()[..w]);
            // Of the animal's share all bits become that of 128.
            for (hidden, outside) in hidden.iter_mut().zip(outside) {
                *hidden = (*hidden >> 7).wrapping_neg() | *outside;
            }
        }
    }

    /// From a camera that did not move: every pixel is its own.
    fn lay_at_rest(&mut self, other: &Source, region: Region) {
        let [l, a, b] = self.image.planes_mut();
        for (to, from) in [l, a, b, &mut self.not_background].into_iter().zip(other.planes()) {
            let rows = from.chunks_exact(other.width()).take(region.bottom).skip(region.top);
            for (to, from) in to.chunks_exact_mut(region.width()).zip(rows) {
                to.copy_from_slice(&from[region.left..region.right]);
            }
        }
        self.outside.fill(0);
    }
}

/// A picture to be laid over a region.
struct Warping<'a> {
    to: &'a mut Warped,
    other: &'a Source<'a>,
    to_other: &'a Matrix3<f64>,
    region: Region,
}

impl Kernel for Warping<'_> {
    type Result = ();

    #[inline(always)]
    fn run(self) {
        self.to.lay_moved(self.other, self.to_other, self.region);
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

    /// The part of the other picture in which the pixels of a region lie, and those about them.
    fn seen(&self, region: Region) -> Region {
        let ends = (self.last.0 as usize + 1, self.last.1 as usize + 1);
        let all = Region { left: 0, top: 0, right: ends.0, bottom: ends.1 };
        if !self.in_front {
            return all;
        }
        // What lies in front of a camera keeps its corners about it.
        let (left, right) = (region.left as f32, (region.right + SPAN) as f32);
        let (top, bottom) = (region.top as f32, region.bottom as f32);
        let corners = [(left, top), (right, top), (left, bottom), (right, bottom)];
        let places = corners.map(|(x, y)| self.place(x, y));
        let part = |along: fn((f32, f32)) -> f32, end: usize| {
            let least = places.map(along).into_iter().fold(f32::INFINITY, f32::min);
            let most = places.map(along).into_iter().fold(f32::NEG_INFINITY, f32::max);
            // Casts are held to what there is. Two pixels at least, between which an edge's points lie.
            let from = ((least - MARGIN_PX) as usize).min(end - 2);
            (from, ((most + MARGIN_PX) as usize).clamp(from + 2, end))
        };
        let (left, right) = part(|p| p.0, ends.0);
        let (top, bottom) = part(|p| p.1, ends.1);
        Region { left, top, right, bottom }
    }

    #[inline(always)]
    fn place(&self, x: f32, y: f32) -> (f32, f32) {
        let m = &self.m;
        let depth = 1.0 / (m[6] * x + m[7] * y + m[8]);
        ((m[0] * x + m[1] * y + m[2]) * depth, (m[3] * x + m[4] * y + m[5]) * depth)
    }

    /// Gathers what the pixels from (`x`, `y`) to the right look at, along the line of span `at` of a row.
    /// [`UNKNOWN`] for those that look at nothing, else 0.
    #[inline(always)]
    fn look(
        &self,
        other: &Window,
        (x, y): (f32, f32),
        lines: &Lines,
        at: usize,
        row: &mut Row,
    ) -> [u8; SPAN] {
        let ends = lines.ends(at);
        // Comparisons with NaN are false. A pole between the ends would part them widely.
        let well_inside = |&(sx, sy): &(f32, f32)| {
            sx >= 0.0 && sy >= 0.0 && sx < self.last.0 - 0.5 && sy < self.last.1 - 0.5
        };
        if ends.iter().all(well_inside) && (ends[1].0 - ends[0].0).abs() < 4.0 * SPAN as f32 {
            row.gather(at, other, &lines.line(at));
            return [0; SPAN];
        }
        row.clear(at);
        if self.in_front && self.beyond(ends) {
            return [UNKNOWN; SPAN];
        }
        std::array::from_fn(|i| {
            let inside = self.look_at(other, (x + i as f32, y), (at, i), row);
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
    fn look_at(
        &self,
        other: &Window,
        (x, y): (f32, f32),
        point: (usize, usize),
        row: &mut Row,
    ) -> bool {
        let (sx, sy) = self.place(x, y);
        let (last_x, last_y) = self.last;
        // Written so that a NaN lies outside.
        let inside =
            sx > -SLACK_PX && sy > -SLACK_PX && sx < last_x + SLACK_PX && sy < last_y + SLACK_PX;
        if inside {
            let (sx, sy) = (sx.clamp(0.0, last_x), sy.clamp(0.0, last_y));
            let x0 = (sx as usize).min(last_x as usize - 1);
            let y0 = (sy as usize).min(last_y as usize - 1);
            let weight = |s: f32, low: usize| ((s - low as f32) * f32::from(STEPS) + 0.5) as u16;
            let weights = [weight(sx, x0), weight(sy, y0)];
            row.gather_one(point, other, other.index(x0, y0), weights);
        }
        inside
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
        /// Spans that lie beside the other picture as a whole, against each of their pixels; and what a region looks at,
        /// against all there is.
        #[test]
        fn what_is_beside_the_other_picture_looks_at_nothing(
            values in proptest::collection::vec(proptest::num::u8::ANY, 48 * 36),
            shift in (-30.0_f64..54.0, -30.0_f64..42.0),
            tilt in (-0.04_f64..0.04, -0.04_f64..0.04),
            (turn, zoom) in (-3.2_f64..3.2, -1.5_f64..1.5),
            slight in proptest::bool::ANY,
        ) {
            let picture = picture(48, 36, &values);
            let other = Source::of(&picture, &Mask::new(48, 36));
            let (turn, zoom) = if slight { (0.1, 1.0) } else { (turn, zoom.exp()) };
            let (across, along) = (zoom * turn.sin(), zoom * turn.cos());
            let m = Matrix3::new(
                along, across, shift.0,
                -across, along, shift.1,
                tilt.0, tilt.1, 1.0,
            );
            let region = Region { left: 0, top: 0, right: 24, bottom: 20 };
            let warped = Warped::of(&other, &m, region);
            let mut way = Way::new(&m, &other, region);
            way.in_front = false;
            let mut window = Window::default();
            window.show(&other, way.seen(region));
            for y in 0..20 {
                for x in [0, SPAN, 2 * SPAN] {
                    let (mut row, mut lines) = (Row::new(1), Lines::new(1));
                    lines.set(|end| way.place((x + end * SPAN) as f32, y as f32));
                    let none = way.look(&window, (x as f32, y as f32), &lines, 0, &mut row);
                    let mut seen = [[0; SPAN]; 4];
                    row.interpolate(seen.each_mut().map(|plane| &mut plane[..]));
                    let at = y * 24 + x;
                    prop_assert_eq!(&warped.outside[at..at + SPAN], &none);
                    for (plane, seen) in warped.image.planes().iter().zip(seen) {
                        prop_assert_eq!(&plane[at..at + SPAN], &seen);
                    }
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
