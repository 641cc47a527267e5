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
        let [mut l, mut a, mut b, mut outside, mut not_background] =
            std::array::from_fn(|_| vec![0_u8; pixels]);
        let way = Way::new(to_other, other);
        for y in region.top..region.bottom {
            let row = (y - region.top) * w;
            for first in (0..w).step_by(SPAN) {
                let count = SPAN.min(w - first);
                let span = row + first..row + first + count;
                let mut seen = [[0; SPAN]; 4];
                let (x, y) = ((region.left + first) as f32, y as f32);
                let inside = way.look(other, x, y, &mut seen);
                l[span.clone()].copy_from_slice(&seen[0][..count]);
                a[span.clone()].copy_from_slice(&seen[1][..count]);
                b[span.clone()].copy_from_slice(&seen[2][..count]);
                // All bits are that of 128.
                let mut hidden = seen[3].map(|there| (there >> 7).wrapping_neg());
                if let Some(inside) = inside {
                    let none = inside.map(|inside| if inside { 0 } else { UNKNOWN });
                    hidden = std::array::from_fn(|i| hidden[i] | none[i]);
                    outside[span.clone()].copy_from_slice(&none[..count]);
                }
                not_background[span].copy_from_slice(&hidden[..count]);
            }
        }
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
}

impl Way {
    fn new(to_other: &Matrix3<f64>, other: &Source) -> Self {
        Self {
            m: std::array::from_fn(|i| to_other[(i / 3, i % 3)] as f32),
            last: ((other.width() - 1) as f32, (other.image.height() - 1) as f32),
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
    #[inline]
    fn look(&self, other: &Source, x: f32, y: f32, seen: &mut Seen) -> Option<[bool; SPAN]> {
        let ends = [self.place(x, y), self.place(x + SPAN as f32, y)];
        // Comparisons with NaN are false. A pole between the ends would part them widely.
        let well_inside = |&(sx, sy): &(f32, f32)| {
            sx >= 0.0 && sy >= 0.0 && sx < self.last.0 - 0.5 && sy < self.last.1 - 0.5
        };
        if ends.iter().all(well_inside) && (ends[1].0 - ends[0].0).abs() < 4.0 * SPAN as f32 {
            look_along(other, ends, seen);
            return None;
        }
        Some(std::array::from_fn(|i| self.look_at(other, x + i as f32, y, i, seen)))
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
    let fixed = |s: f32| (s * (1 << FRACTION_BITS) as f32) as i32;
    let step = |from: f32, to: f32| fixed((to - from) / SPAN as f32);
    let (dx, dy) = (step(ends[0].0, ends[1].0), step(ends[0].1, ends[1].1));
    let (sx, sy) = (fixed(ends[0].0) + HALF_STEP, fixed(ends[0].1) + HALF_STEP);
    let place = |x: i32, y: i32| {
        (y >> FRACTION_BITS) as usize * other.width() + (x >> FRACTION_BITS) as usize
    };
    let weight = |s: i32| (s >> (FRACTION_BITS - STEP_BITS) & (STEPS - 1)) as u16;
    // Along a row of the other picture, pixel by pixel, when neither fraction leaves its pixel
    // beside steps of exactly one.
    let last = SPAN as i32 - 1;
    let whole = 1 << FRACTION_BITS;
    let stays = |s: i32, by: i32| (0..whole).contains(&((s & (whole - 1)) + last * by));
    if stays(sx, dx - whole) && stays(sy, dy) {
        let fx = std::array::from_fn(|i| weight(sx + i as i32 * dx));
        let fy = std::array::from_fn(|i| weight(sy + i as i32 * dy));
        look_along_row(other, place(sx, sy), (&fx, &fy), seen);
        return;
    }
    for i in 0..SPAN {
        let (x, y) = (sx + i as i32 * dx, sy + i as i32 * dy);
        look_between(other, place(x, y), (weight(x), weight(y)), i, seen);
    }
}

/// Eight neighbouring pixels at once.
#[inline]
fn look_along_row(
    other: &Source,
    corner: usize,
    (fx, fy): (&[u16; SPAN], &[u16; SPAN]),
    seen: &mut Seen,
) {
    for (seen, plane) in seen.iter_mut().zip(other.planes()) {
        let top: &[u8; SPAN + 1] = plane[corner..].first_chunk().unwrap_or(&[0; SPAN + 1]);
        let bottom: &[u8; SPAN + 1] =
            plane[corner + other.width()..].first_chunk().unwrap_or(&[0; SPAN + 1]);
        for i in 0..SPAN {
            seen[i] = between([top[i], top[i + 1]], [bottom[i], bottom[i + 1]], fx[i], fy[i]);
        }
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
