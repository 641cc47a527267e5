//! Another frame as it would look from this one.

use nalgebra::Matrix3;

use super::lab_image::{LabImage, Region};
use super::plate::UNKNOWN;
use crate::mask::Mask;

/// Steps a pixel is divided into for interpolation, each way, as a power of two: the product of two
/// weights and a byte fits 16 bits, so that four of them are weighted by one multiplication.
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

/// Both lowest bytes of each half, which are two of a packed pixel's four channels.
const EVEN: u64 = 0x00ff_00ff_00ff_00ff;

/// A picture ready to be looked at from other frames: L*, a*, b* and 255 where the animal may be,
/// lowest byte first.
pub(super) struct Source {
    width: usize,
    height: usize,
    pixels: Vec<u32>,
}

impl Source {
    pub(super) fn of(image: &LabImage, animal: &Mask) -> Self {
        let (width, height) = (image.width(), image.height());
        let mut pixels = Vec::with_capacity(width * height);
        for y in 0..height {
            let row = y * width..(y + 1) * width;
            let [l, a, b] = image.planes().each_ref().map(|plane| &plane[row.clone()]);
            let words = &animal.words()[y * animal.words_per_row()..];
            for (x, ((l, a), b)) in l.iter().zip(a).zip(b).enumerate() {
                let there = (words[x / 64] >> (x % 64) & 1) as u8 * 255;
                pixels.push(u32::from_le_bytes([*l, *a, *b, there]));
            }
        }
        Self { width, height, pixels }
    }

    /// The four channels, 16 bits each, between the pixel `corner` and those right of and below it.
    #[expect(clippy::inline_always, reason = "the innermost loop, which the caller unrolls")]
    #[inline(always)]
    fn between(&self, corner: usize, fx: u32, fy: u32) -> u64 {
        let here = &self.pixels[corner..corner + self.width + 2];
        let spread = |p: u32| (u64::from(p) | u64::from(p) << 24) & EVEN;
        // Differences may borrow from the channel above; in the sum all is paid back.
        let along = |from: u64, to: u64, f: u32| {
            (from << STEP_BITS).wrapping_add(to.wrapping_sub(from).wrapping_mul(u64::from(f)))
        };
        let upper = along(spread(here[0]), spread(here[1]), fx);
        let lower = along(spread(here[self.width]), spread(here[self.width + 1]), fx);
        let sum = along(upper, lower, fy);
        // Half of 256 in each channel: rounded.
        sum.wrapping_add(0x0080_0080_0080_0080) >> (2 * STEP_BITS) & EVEN
    }
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
        let (w, pixels) = (region.width(), region.pixels());
        let [mut l, mut a, mut b, mut outside, mut not_background] =
            std::array::from_fn(|_| vec![0_u8; pixels]);
        if *to_other == Matrix3::identity() {
            return Self::seen_at_rest(other, region);
        }
        let way = Way::new(to_other, other);
        for y in region.top..region.bottom {
            let row = (y - region.top) * w;
            for first in (0..w).step_by(SPAN) {
                let span = row + first..row + (first + SPAN).min(w);
                let mut values = [0_u64; SPAN];
                let (x, y) = ((region.left + first) as f32, y as f32);
                let inside = way.look(other, x, y, &mut values);
                let colours = (l[span.clone()].iter_mut())
                    .zip(&mut a[span.clone()])
                    .zip(&mut b[span.clone()]);
                for (((l, a), b), value) in colours.zip(&values) {
                    // The channels come in the order that `spread` leaves them in.
                    (*l, *b, *a) = (*value as u8, (value >> 16) as u8, (value >> 32) as u8);
                }
                let hidden = &mut not_background[span.clone()];
                for (hidden, value) in hidden.iter_mut().zip(&values) {
                    // All bits are that of 128.
                    *hidden = ((value >> 55) as u8 & 1).wrapping_neg();
                }
                if let Some(inside) = inside {
                    let outside = outside[span].iter_mut().zip(hidden);
                    for ((outside, hidden), inside) in outside.zip(inside) {
                        *outside = if inside { 0 } else { UNKNOWN };
                        *hidden |= *outside;
                    }
                }
            }
        }
        let image = LabImage::from_planes(w, region.height(), [l, a, b]);
        Self { image, outside, not_background }
    }
}

impl Warped {
    /// From a camera that did not move: every pixel is its own.
    fn seen_at_rest(other: &Source, region: Region) -> Self {
        let [mut l, mut a, mut b, mut not_background] =
            std::array::from_fn(|_| Vec::with_capacity(region.pixels()));
        for y in region.top..region.bottom {
            let row = &other.pixels[y * other.width..(y + 1) * other.width];
            let row = &row[region.left..region.right];
            let planes = [&mut l, &mut a, &mut b, &mut not_background];
            for (plane, shift) in planes.into_iter().zip([0, 8, 16, 24]) {
                plane.extend(row.iter().map(|pixel| (pixel >> shift) as u8));
            }
        }
        let image = LabImage::from_planes(region.width(), region.height(), [l, a, b]);
        Self { image, outside: vec![0; region.pixels()], not_background }
    }
}

/// The way from pixels of this frame to those of another.
struct Way {
    m: [f32; 9],
    /// The last column and row of the other picture.
    last: (f32, f32),
}

impl Way {
    fn new(to_other: &Matrix3<f64>, other: &Source) -> Self {
        Self {
            m: std::array::from_fn(|i| to_other[(i / 3, i % 3)] as f32),
            last: ((other.width - 1) as f32, (other.height - 1) as f32),
        }
    }

    #[inline]
    fn place(&self, x: f32, y: f32) -> (f32, f32) {
        let m = &self.m;
        let depth = 1.0 / (m[6] * x + m[7] * y + m[8]);
        ((m[0] * x + m[1] * y + m[2]) * depth, (m[3] * x + m[4] * y + m[5]) * depth)
    }

    /// What the pixels from (`x`, `y`) to the right look at, and whether there is anything; `None`
    /// where there is for all of them.
    fn look(
        &self,
        other: &Source,
        x: f32,
        y: f32,
        values: &mut [u64; SPAN],
    ) -> Option<[bool; SPAN]> {
        let ends = [self.place(x, y), self.place(x + SPAN as f32, y)];
        // Comparisons with NaN are false. A pole between the ends would part them widely.
        let well_inside = |&(sx, sy): &(f32, f32)| {
            sx >= 0.0 && sy >= 0.0 && sx < self.last.0 - 0.5 && sy < self.last.1 - 0.5
        };
        if ends.iter().all(well_inside) && (ends[1].0 - ends[0].0).abs() < 4.0 * SPAN as f32 {
            self.look_along(other, ends, values);
            return None;
        }
        Some(std::array::from_fn(|i| {
            let value = self.look_at(other, x + i as f32, y);
            values[i] = value.unwrap_or(0);
            value.is_some()
        }))
    }

    /// The points of a span that lies inside.
    #[inline]
    fn look_along(&self, other: &Source, ends: [(f32, f32); 2], values: &mut [u64; SPAN]) {
        let fixed = |s: f32| (s * (1 << FRACTION_BITS) as f32) as i32;
        let step = |from: f32, to: f32| fixed((to - from) / SPAN as f32);
        let (dx, dy) = (step(ends[0].0, ends[1].0), step(ends[0].1, ends[1].1));
        let (mut sx, mut sy) = (fixed(ends[0].0) + HALF_STEP, fixed(ends[0].1) + HALF_STEP);
        let weight = |s: i32| (s >> (FRACTION_BITS - STEP_BITS) & (STEPS - 1)) as u32;
        for value in values {
            let corner =
                (sy >> FRACTION_BITS) as usize * other.width + (sx >> FRACTION_BITS) as usize;
            *value = other.between(corner, weight(sx), weight(sy));
            sx += dx;
            sy += dy;
        }
    }

    /// One point, which may lie outside.
    #[cold]
    fn look_at(&self, other: &Source, x: f32, y: f32) -> Option<u64> {
        let (sx, sy) = self.place(x, y);
        let (last_x, last_y) = self.last;
        // Written so that a NaN lies outside.
        let inside =
            sx > -SLACK_PX && sy > -SLACK_PX && sx < last_x + SLACK_PX && sy < last_y + SLACK_PX;
        if !inside {
            return None;
        }
        let (sx, sy) = (sx.clamp(0.0, last_x), sy.clamp(0.0, last_y));
        let (x0, y0) = ((sx as usize).min(other.width - 2), (sy as usize).min(other.height - 2));
        let weight = |s: f32, low: usize| ((s - low as f32) * STEPS as f32 + 0.5) as u32;
        Some(other.between(y0 * other.width + x0, weight(sx, x0), weight(sy, y0)))
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
        let other = Source::of(&picture(12, 9, &values), &animal);
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
