//! A row of points between the pixels of another picture: gathered span by span, then interpolated all
//! together.

use super::warp::Source;

/// Steps a pixel is divided into for interpolation, each way, as a power of two: the product of two
/// weights and a byte fits 16 bits, so that vectors of these do.
const STEP_BITS: u32 = 4;
pub(super) const STEPS: i32 = 1 << STEP_BITS;

/// Bits of the fraction of a coordinate.
const FRACTION_BITS: u32 = 12;

/// Half a step, which makes the weights those of the nearest one.
const HALF_STEP: i32 = 1 << (FRACTION_BITS - STEP_BITS - 1);

/// Pixels of a row whose places are interpolated between those of the first and the one after the
/// last: within a span of eight a camera's perspective bends them by some thousandths of a pixel.
pub(super) const SPAN: usize = 8;

/// Columns that eight pixels look at, one of which may be one further right than its neighbours say.
pub(super) const COLUMNS: usize = SPAN + 2;

/// Eight pixels of a plane, the first in the lowest byte.
type Bytes = u64;

/// The eight bytes from `at` on; nothing beyond the plane's end.
#[inline(always)]
fn eight(plane: &[u8], at: usize) -> Bytes {
    let bytes = plane.get(at..at + SPAN).and_then(|bytes| bytes.first_chunk());
    bytes.map_or(0, |bytes| Bytes::from_le_bytes(*bytes))
}

/// What the points of a row lie between, span by span; the last span may reach beyond the region. All
/// of a row is gathered first and interpolated then, which makes vectors of the latter.
pub(super) struct Row {
    /// Steps of the way from left to right and from top to bottom.
    weights: [Vec<[u16; SPAN]>; 2],
    /// Of L*, a*, b* and the animal the pixels above left, above right, below left and below right.
    corners: [[Vec<[u8; SPAN]>; 4]; 4],
    /// 255 for points beside the other picture, else 0.
    pub(super) outside: Vec<[u8; SPAN]>,
}

impl Row {
    pub(super) fn new(spans: usize) -> Self {
        let bytes = || vec![[0; SPAN]; spans];
        Self {
            weights: std::array::from_fn(|_| vec![[0; SPAN]; spans]),
            corners: std::array::from_fn(|_| std::array::from_fn(|_| bytes())),
            outside: bytes(),
        }
    }

    /// Interpolates plane `which`. Differences may be less than zero; in the sum, modulo 2¹⁶, all is
    /// paid back.
    #[inline(always)]
    pub(super) fn interpolate(&self, which: usize, to: &mut [u8]) {
        let along = |from: u16, to: u16, f: u16| {
            (from << STEP_BITS).wrapping_add(to.wrapping_sub(from).wrapping_mul(f))
        };
        let [above_left, above_right, below_left, below_right] =
            self.corners[which].each_ref().map(|corner| corner.as_flattened().iter());
        let [fx, fy] = self.weights.each_ref().map(|weights| weights.as_flattened().iter());
        let left = above_left.zip(below_left).map(|(a, b)| (u16::from(*a), u16::from(*b)));
        let right = above_right.zip(below_right).map(|(a, b)| (u16::from(*a), u16::from(*b)));
        for (to, ((left, right), (fx, fy))) in to.iter_mut().zip(left.zip(right).zip(fx.zip(fy))) {
            let (left, right) = (along(left.0, left.1, *fy), along(right.0, right.1, *fy));
            // Half of 256: rounded.
            *to = (along(left, right, *fx).wrapping_add(128) >> (2 * STEP_BITS)) as u8;
        }
    }

    /// Gathers the points of span `at` that lies inside.
    #[inline(always)]
    pub(super) fn gather(&mut self, at: usize, other: &Source, line: &Line) {
        let (from, to) = (line.pixel(0), line.pixel(SPAN as i32 - 1));
        // Beside steps of exactly one along a row, no pixel is off by more than the last is:
        // coordinates rise or fall all the way.
        let off = (to.0 - from.0 - (SPAN as i32 - 1), to.1 - from.1);
        // From the first pixel of all, which the last one may be left of or above of; at the
        // picture's left side it may be missing.
        let least = (from.0 + off.0.min(0), from.1 + off.1.min(0));
        let corner = least.1 as usize * other.width() + least.0.max(0) as usize;
        let nearly = off.0.abs() <= 1 && off.1.abs() <= 1 && least.0 >= 0;
        if off == (0, 0) {
            self.gather_row(at, other, corner);
        } else if nearly && other.has_rows(corner) {
            self.gather_rows(at, other, corner, line.further(off, least));
        } else {
            self.gather_one_by_one(at, other, line);
            return;
        }
        let [along, across] = &mut self.weights;
        for i in 0..SPAN {
            along[at][i] = line.weight_x(i as i32);
            across[at][i] = line.weight_y(i as i32);
        }
    }

    /// Eight pixels side by side.
    #[inline(always)]
    fn gather_row(&mut self, at: usize, other: &Source, corner: usize) {
        let below = corner + other.width();
        for (corners, plane) in self.corners.iter_mut().zip(other.planes()) {
            for (to, from) in corners.iter_mut().zip([corner, corner + 1, below, below + 1]) {
                to[at] = eight(plane, from).to_le_bytes();
            }
        }
    }

    /// Eight pixels that lie side by side but for a column and a row that some are further than
    /// others: `further`, 255 for one that is, 0 for one that is not, along and across. A camera that
    /// turns or comes closer leaves most spans like this.
    #[inline(always)]
    fn gather_rows(
        &mut self,
        at: usize,
        other: &Source,
        corner: usize,
        [along, across]: [Bytes; 2],
    ) {
        let w = other.width();
        let either = |here: Bytes, there: Bytes, mask: Bytes| here & !mask | there & mask;
        for (corners, plane) in self.corners.iter_mut().zip(other.planes()) {
            // Left and right neighbours of all eight in three rows, of which each needs two.
            let [above, middle, below] = [0, 1, 2].map(|y| {
                let [a, b, c] = [0, 1, 2].map(|x| eight(plane, corner + y * w + x));
                [either(a, b, along), either(b, c, along)]
            });
            for x in 0..2 {
                corners[x][at] = either(above[x], middle[x], across).to_le_bytes();
                corners[2 + x][at] = either(middle[x], below[x], across).to_le_bytes();
            }
        }
    }

    /// Eight pixels, wherever they are.
    #[cold]
    fn gather_one_by_one(&mut self, at: usize, other: &Source, line: &Line) {
        for i in 0..SPAN {
            let (x, y) = line.pixel(i as i32);
            let corner = y as usize * other.width() + x as usize;
            let weights = [line.weight_x(i as i32), line.weight_y(i as i32)];
            self.gather_one((at, i), other, corner, weights);
        }
    }

    /// Point `i` of span `at`, between the pixel `corner` and those right of and below it.
    pub(super) fn gather_one(
        &mut self,
        (at, i): (usize, usize),
        other: &Source,
        corner: usize,
        weights: [u16; 2],
    ) {
        let below = corner + other.width();
        for (corners, plane) in self.corners.iter_mut().zip(other.planes()) {
            for (to, from) in corners.iter_mut().zip([corner, corner + 1, below, below + 1]) {
                to[at][i] = plane[from];
            }
        }
        for (to, weight) in self.weights.iter_mut().zip(weights) {
            to[at][i] = weight;
        }
    }

    /// Nothing at the points of span `at`, until one of them is gathered.
    pub(super) fn clear(&mut self, at: usize) {
        self.corners.as_flattened_mut().iter_mut().for_each(|corner| corner[at] = [0; SPAN]);
    }
}

/// Places along a span, evenly spaced, coordinates in fixed point.
pub(super) struct Line {
    start: (i32, i32),
    step: (i32, i32),
}

impl Line {
    /// From the place of the first pixel to that of the one after the last.
    #[inline(always)]
    pub(super) fn between(ends: [(f32, f32); 2]) -> Self {
        let fixed = |s: f32| (s * (1 << FRACTION_BITS) as f32) as i32;
        let step = |from: f32, to: f32| fixed((to - from) / SPAN as f32);
        Self {
            start: (fixed(ends[0].0) + HALF_STEP, fixed(ends[0].1) + HALF_STEP),
            step: (step(ends[0].0, ends[1].0), step(ends[0].1, ends[1].1)),
        }
    }

    /// The pixel left of and above place `i`.
    #[inline(always)]
    fn pixel(&self, i: i32) -> (i32, i32) {
        let whole = |start: i32, step: i32| (start + i * step) >> FRACTION_BITS;
        (whole(self.start.0, self.step.0), whole(self.start.1, self.step.1))
    }

    /// Which places look at a column and at a row further than the `least`, in the bytes of each, when
    /// the last place is `off` by one or none.
    #[inline(always)]
    fn further(&self, off: (i32, i32), least: (i32, i32)) -> [Bytes; 2] {
        let mut bytes = [[0; SPAN]; 2];
        let [along, across] = &mut bytes;
        for i in 0..SPAN {
            let (x, y) = self.pixel(i as i32);
            along[i] = ((x - i as i32 - least.0) as u8).wrapping_neg();
            across[i] = ((y - least.1) as u8).wrapping_neg();
        }
        let [along, across] = bytes.map(Bytes::from_le_bytes);
        [if off.0 == 0 { 0 } else { along }, if off.1 == 0 { 0 } else { across }]
    }

    #[inline(always)]
    fn weight_x(&self, i: i32) -> u16 {
        weight(self.start.0 + i * self.step.0)
    }

    #[inline(always)]
    fn weight_y(&self, i: i32) -> u16 {
        weight(self.start.1 + i * self.step.1)
    }
}

/// Steps of a coordinate from the pixel it lies behind.
#[inline(always)]
fn weight(s: i32) -> u16 {
    (s >> (FRACTION_BITS - STEP_BITS) & (STEPS - 1)) as u16
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::lab_image::LabImage;
    use super::*;
    use crate::mask::Mask;

    proptest! {
        /// Eight pixels at once against one after the other, for cameras that moved little and much.
        #[test]
        fn spans_are_what_their_pixels_are_one_by_one(
            values in proptest::collection::vec(proptest::num::u8::ANY, 24 * 9),
            start in (0.0_f32..12.0, 0.0_f32..7.4),
            step in (0.8_f32..1.2, -0.15_f32..0.15),
            far in proptest::bool::ANY,
        ) {
            let plane = |c: u8| values.iter().map(|v| v.wrapping_mul(2 * c + 1)).collect();
            let picture = LabImage::from_planes(24, 9, [plane(0), plane(1), plane(2)]);
            let animal = Mask::from_fn(24, 9, |x, y| (x * y) % 3 == 1);
            let other = Source::of(&picture, &animal);
            let along = if far { 2.0 - step.0 } else { step.0 };
            let end = |start: f32, step: f32, last: f32| {
                (start + SPAN as f32 * step).clamp(0.0, last - 0.51)
            };
            let ends = [start, (end(start.0, along, 23.0), end(start.1, step.1, 8.0))];
            let line = Line::between(ends);
            let mut row = Row::new(2);
            row.gather(0, &other, &line);
            row.gather_one_by_one(1, &other, &line);
            for which in 0..4 {
                let mut found = [0; 2 * SPAN];
                row.interpolate(which, &mut found);
                prop_assert_eq!(&found[..SPAN], &found[SPAN..]);
            }
        }
    }
}
