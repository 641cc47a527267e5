//! A row of points between the pixels of another picture: gathered span by span, then interpolated all
//! together.

use super::lab_image::Region;
use super::warp::Source;

/// Steps a pixel is divided into for interpolation, each way, as a power of two: the product of two
/// weights and a byte fits 16 bits, so that vectors of these do.
const STEP_BITS: u32 = 4;
pub(super) const STEPS: u16 = 1 << STEP_BITS;

/// Bits of the fraction of a coordinate.
const FRACTION_BITS: u32 = 12;

/// Half a step, which makes the weights those of the nearest one.
const HALF_STEP: i32 = 1 << (FRACTION_BITS - STEP_BITS - 1);

/// Pixels of a row whose places are interpolated between those of the first and the one after the
/// last: within a span of eight a camera's perspective bends them by some thousandths of a pixel.
pub(super) const SPAN: usize = 8;

/// Columns that eight pixels look at, one of which may be one further right than its neighbours say.
const COLUMNS: usize = SPAN + 2;

/// Two numbers of two bytes each for a pixel: L* and a*, b* and the animal, the first in the lower byte. All four are
/// gathered and chosen from as one, as vectors.
const LANES: usize = 2;

/// A number for each lane of a span.
type Lanes = [u16; LANES * SPAN];

/// A part of another picture, its four planes in one.
#[derive(Default)]
pub(super) struct Window {
    region: Region,
    pixels: Vec<u16>,
}

impl Window {
    /// Shows another part of a picture, or of another one, in the place of the one before.
    #[inline(always)]
    pub(super) fn show(&mut self, other: &Source, region: Region) {
        self.region = region;
        let pixels = &mut self.pixels;
        // Of what it held before nothing stays: the rows are all there is.
        pixels.resize(LANES * region.pixels(), 0);
        let rows = pixels.chunks_exact_mut((LANES * region.width()).max(1));
        for (y, row) in (region.top..region.bottom).zip(rows) {
            let at = y * other.width();
            let part = at + region.left..at + region.right;
            let [l, a, b, animal] = other.planes().map(|plane| &plane[part.clone()]);
            let colours = l.iter().zip(a).zip(b.iter().zip(animal));
            for (to, ((l, a), (b, animal))) in row.as_chunks_mut().0.iter_mut().zip(colours) {
                *to = [u16::from_le_bytes([*l, *a]), u16::from_le_bytes([*b, *animal])];
            }
        }
    }

    /// Where the pixel at column `x` and row `y` of the picture is, which lies inside.
    #[inline(always)]
    pub(super) fn index(&self, x: usize, y: usize) -> usize {
        (y - self.region.top) * self.region.width() + x - self.region.left
    }

    /// Whether there are three rows of [`COLUMNS`] pixels from a pixel on.
    #[inline(always)]
    fn has_rows(&self, corner: usize) -> bool {
        LANES * (corner + 2 * self.region.width() + COLUMNS) <= self.pixels.len()
    }

    /// The lanes of some pixels side by side, from `at` on; nothing where there are fewer.
    #[inline(always)]
    fn side_by_side<const N: usize>(&self, at: usize) -> &[u16; N] {
        self.pixels.get(LANES * at..).and_then(|pixels| pixels.first_chunk()).unwrap_or(&[0; N])
    }
}

/// Eight of some pixels, without the first ones.
#[inline(always)]
fn eight<const N: usize>(pixels: &[u16; N], without: usize) -> Lanes {
    pixels[LANES * without..].first_chunk().copied().unwrap_or_default()
}

/// What the points of a row lie between, span by span; the last span may reach beyond the region. All
/// of a row is gathered first and interpolated then, which makes vectors of the latter.
pub(super) struct Row {
    /// Steps of the way from left to right and from top to bottom, of each lane.
    weights: [Vec<Lanes>; 2],
    /// The pixels above left, above right, below left and below right.
    corners: [Vec<Lanes>; 4],
    /// What is interpolated between them.
    between: Vec<Lanes>,
    /// 255 for points beside the other picture, else 0.
    pub(super) outside: Vec<[u8; SPAN]>,
}

impl Row {
    pub(super) fn new(spans: usize) -> Self {
        let lanes = || vec![Lanes::default(); spans];
        Self {
            weights: [lanes(), lanes()],
            corners: [lanes(), lanes(), lanes(), lanes()],
            between: lanes(),
            outside: vec![[0; SPAN]; spans],
        }
    }

    /// Interpolates the four planes, of which the first pixels are wanted. Differences may be less than zero; in the
    /// sum, modulo 2¹⁶, all is paid back.
    #[inline(always)]
    pub(super) fn interpolate(&mut self, to: [&mut [u8]; 4]) {
        let along = |from: u16, to: u16, f: u16| {
            (from << STEP_BITS).wrapping_add(to.wrapping_sub(from).wrapping_mul(f))
        };
        let between = |[above, below]: [[u16; 2]; 2], fx: u16, fy: u16| {
            let (left, right) = (along(above[0], below[0], fy), along(above[1], below[1], fy));
            // Half of 256: rounded.
            along(left, right, fx).wrapping_add(128) >> (2 * STEP_BITS)
        };
        let [above_left, above_right, below_left, below_right] =
            self.corners.each_ref().map(|corner| corner.as_flattened().iter());
        let [fx, fy] = self.weights.each_ref().map(|weights| weights.as_flattened().iter());
        let corners = above_left.zip(above_right).zip(below_left.zip(below_right));
        let all = self.between.as_flattened_mut().iter_mut().zip(corners.zip(fx.zip(fy)));
        for (to, (((al, ar), (bl, br)), (fx, fy))) in all {
            let low = between([[al & 255, ar & 255], [bl & 255, br & 255]], *fx, *fy);
            let high = between([[al >> 8, ar >> 8], [bl >> 8, br >> 8]], *fx, *fy);
            *to = low | high << 8;
        }
        let [l, a, b, animal] = to.map(|plane| plane.iter_mut());
        let pixels = self.between.as_flattened().as_chunks::<LANES>().0;
        for ((pixel, (l, a)), (b, animal)) in pixels.iter().zip(l.zip(a)).zip(b.zip(animal)) {
            [*l, *a] = pixel[0].to_le_bytes();
            [*b, *animal] = pixel[1].to_le_bytes();
        }
    }

    /// Gathers the points of span `at` that lies inside.
    #[inline(always)]
    pub(super) fn gather(&mut self, at: usize, other: &Window, line: &Line) {
        let (from, to) = (line.pixel(0), line.pixel(SPAN as i32 - 1));
        // Beside steps of exactly one along a row, no pixel is off by more than the last is:
        // coordinates rise or fall all the way.
        let off = (to.0 - from.0 - (SPAN as i32 - 1), to.1 - from.1);
        // From the first pixel of all, which the last one may be left of or above of; at the
        // window's left side it may be missing.
        let least = (from.0 + off.0.min(0), from.1 + off.1.min(0));
        let there = least.0 >= other.region.left as i32 && least.1 >= other.region.top as i32;
        let nearly = off.0.abs() <= 1 && off.1.abs() <= 1 && there;
        let corner = if there { other.index(least.0 as usize, least.1 as usize) } else { 0 };
        if off == (0, 0) && there {
            self.gather_row(at, other, corner);
        } else if nearly && other.has_rows(corner) {
            self.gather_rows(at, other, corner, line.further(off, least));
        } else {
            self.gather_one_by_one(at, other, line);
            return;
        }
        for (to, weights) in self.weights.iter_mut().zip(line.weights()) {
            to[at] = weights;
        }
    }

    /// Eight pixels side by side.
    #[inline(always)]
    fn gather_row(&mut self, at: usize, other: &Window, corner: usize) {
        for (y, corners) in self.corners.as_chunks_mut::<2>().0.iter_mut().enumerate() {
            let row: &[u16; LANES * (SPAN + 1)] =
                other.side_by_side(corner + y * other.region.width());
            corners[0][at] = eight(row, 0);
            corners[1][at] = eight(row, 1);
        }
    }

    /// Eight pixels that lie side by side but for a column and a row that some are further than
    /// others: `further`, all bits set for one that is, none for one that is not, along and across. A camera that
    /// turns or comes closer leaves most spans like this.
    #[inline(always)]
    fn gather_rows(
        &mut self,
        at: usize,
        other: &Window,
        corner: usize,
        [along, across]: [Lanes; 2],
    ) {
        let w = other.region.width();
        let either = |here: &Lanes, there: &Lanes, mask: &Lanes| -> Lanes {
            std::array::from_fn(|i| here[i] & !mask[i] | there[i] & mask[i])
        };
        // Left and right neighbours of all eight in three rows, of which each needs two.
        // (The `map` of an array is not compiled into a kernel.)
        let sides = |at: usize| {
            let row: &[u16; LANES * COLUMNS] = other.side_by_side(at);
            let (a, b, c) = (eight(row, 0), eight(row, 1), eight(row, 2));
            [either(&a, &b, &along), either(&b, &c, &along)]
        };
        let (above, middle, below) = (sides(corner), sides(corner + w), sides(corner + 2 * w));
        for x in 0..2 {
            self.corners[x][at] = either(&above[x], &middle[x], &across);
            self.corners[2 + x][at] = either(&middle[x], &below[x], &across);
        }
    }

    /// Eight pixels, wherever they are.
    #[cold]
    fn gather_one_by_one(&mut self, at: usize, other: &Window, line: &Line) {
        for i in 0..SPAN {
            let (x, y) = line.pixel(i as i32);
            let weights = line.weights().map(|weights| weights[LANES * i]);
            self.gather_one((at, i), other, other.index(x as usize, y as usize), weights);
        }
    }

    /// Point `i` of span `at`, between the pixel `corner` and those right of and below it.
    pub(super) fn gather_one(
        &mut self,
        (at, i): (usize, usize),
        other: &Window,
        corner: usize,
        weights: [u16; 2],
    ) {
        let lanes = LANES * i..LANES * (i + 1);
        let below = corner + other.region.width();
        for (to, from) in self.corners.iter_mut().zip([corner, corner + 1, below, below + 1]) {
            to[at][lanes.clone()].copy_from_slice(&other.pixels[LANES * from..LANES * (from + 1)]);
        }
        for (to, weight) in self.weights.iter_mut().zip(weights) {
            to[at][lanes.clone()].fill(weight);
        }
    }

    /// Nothing at the points of span `at`, until one of them is gathered.
    pub(super) fn clear(&mut self, at: usize) {
        self.corners.iter_mut().for_each(|corner| corner[at] = Lanes::default());
    }
}

/// The ends of a row's spans in the other picture, and the lines between them: made for all spans together,
/// which makes vectors of it.
pub(super) struct Lines {
    /// Columns, and rows.
    places: [Vec<f32>; 2],
    starts: [Vec<i32>; 2],
    steps: [Vec<i32>; 2],
}

impl Lines {
    pub(super) fn new(spans: usize) -> Self {
        Self {
            places: std::array::from_fn(|_| vec![0.0; spans + 1]),
            starts: std::array::from_fn(|_| vec![0; spans]),
            steps: std::array::from_fn(|_| vec![0; spans]),
        }
    }

    /// Takes the places of the first pixel of each span, and of the one after the last.
    #[inline(always)]
    pub(super) fn set(&mut self, place: impl Fn(usize) -> (f32, f32)) {
        let [x, y] = &mut self.places;
        for (at, (x, y)) in x.iter_mut().zip(y).enumerate() {
            (*x, *y) = place(at);
        }
        let fixed = |s: f32| (s * (1 << FRACTION_BITS) as f32) as i32;
        let lines = self.starts.iter_mut().zip(&mut self.steps);
        for (places, (starts, steps)) in self.places.iter().zip(lines) {
            let ends = places.iter().zip(&places[1..]);
            for ((start, step), (from, to)) in starts.iter_mut().zip(steps).zip(ends) {
                // What lies far outside is not looked at.
                *start = fixed(*from).wrapping_add(HALF_STEP);
                *step = fixed((to - from) / SPAN as f32);
            }
        }
    }

    /// The places of the first pixel of a span and of the one after its last.
    #[inline(always)]
    pub(super) fn ends(&self, at: usize) -> [(f32, f32); 2] {
        let [x, y] = &self.places;
        [(x[at], y[at]), (x[at + 1], y[at + 1])]
    }

    #[inline(always)]
    pub(super) fn line(&self, at: usize) -> Line {
        let [start, step] = [&self.starts, &self.steps].map(|[x, y]| (x[at], y[at]));
        Line { start, step }
    }
}

/// Places along a span, evenly spaced, coordinates in fixed point.
pub(super) struct Line {
    start: (i32, i32),
    step: (i32, i32),
}

impl Line {
    /// The pixel left of and above place `i`.
    #[inline(always)]
    fn pixel(&self, i: i32) -> (i32, i32) {
        let whole = |start: i32, step: i32| (start + i * step) >> FRACTION_BITS;
        (whole(self.start.0, self.step.0), whole(self.start.1, self.step.1))
    }

    /// Which places look at a column and at a row further than the `least`, in all bits of their lanes, when
    /// the last place is `off` by one or none.
    #[inline(always)]
    fn further(&self, off: (i32, i32), least: (i32, i32)) -> [Lanes; 2] {
        let (mut along, mut across) = (Lanes::default(), Lanes::default());
        for i in 0..LANES * SPAN {
            let (x, y) = self.pixel((i / LANES) as i32);
            along[i] = ((x - (i / LANES) as i32 - least.0) as u16).wrapping_neg();
            across[i] = ((y - least.1) as u16).wrapping_neg();
        }
        [
            if off.0 == 0 { Lanes::default() } else { along },
            if off.1 == 0 { Lanes::default() } else { across },
        ]
    }

    /// Steps of the way from the pixel left of and above each place, along and across, of each lane. They are made
    /// by themselves and stored as a whole: stored one by one into rows that could overlap they are no vectors.
    #[inline(always)]
    fn weights(&self) -> [Lanes; 2] {
        let mut weights = [Lanes::default(); 2];
        for (weights, (start, step)) in
            weights.iter_mut().zip([(self.start.0, self.step.0), (self.start.1, self.step.1)])
        {
            // Of a coordinate the lowest bits count, which no carry from higher ones reaches.
            let (start, step) = (start as u16, step as u16);
            for (i, weight) in weights.iter_mut().enumerate() {
                let place = start.wrapping_add(step.wrapping_mul((i / LANES) as u16));
                *weight = place >> (FRACTION_BITS - STEP_BITS) & (STEPS - 1);
            }
        }
        weights
    }
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
            let all = Region { left: 0, top: 0, right: 24, bottom: 9 };
            let mut other = Window::default();
            other.show(&Source::of(&picture, &animal), all);
            let along = if far { 2.0 - step.0 } else { step.0 };
            let end = |start: f32, step: f32, last: f32| {
                (start + SPAN as f32 * step).clamp(0.0, last - 0.51)
            };
            let ends = [start, (end(start.0, along, 23.0), end(start.1, step.1, 8.0))];
            let mut lines = Lines::new(1);
            lines.set(|at| ends[at]);
            let line = lines.line(0);
            let mut row = Row::new(2);
            row.gather(0, &other, &line);
            row.gather_one_by_one(1, &other, &line);
            let mut found = [[0; 2 * SPAN]; 4];
            row.interpolate(found.each_mut().map(|plane| &mut plane[..]));
            for plane in found {
                prop_assert_eq!(&plane[..SPAN], &plane[SPAN..]);
            }
        }
    }
}
