//! What it costs to part neighbouring pixels: less across an edge of the picture (Boykov and Jolly 2001).

use std::ops::Range;

use super::lab_image::LabImage;
use crate::numeric::{InstructionSet, Kernel};

/// Integer costs a natural unit of log odds.
pub(super) const SCALE: f32 = 1000.0;

/// Strength of the field: what it costs to part two neighbours of the same colour, nats.
const SMOOTHNESS: f32 = 2.0;

/// The share of that which stays at the strongest edge: outlines are short even then.
const BASE: f32 = 0.1;

/// The share of its strength that a diagonal pair has.
const DIAGONAL: f32 = std::f32::consts::FRAC_1_SQRT_2;

/// Steps of the table of exp(−x), and the x it ends at.
const FALL_STEPS: usize = 512;
const FALL_END: f32 = 8.0;

/// The cost of parting two neighbours by their difference of colour d:
/// λ (b + (1 − b) exp(−d² / 2⟨d²⟩)), with the mean over all neighbours of the picture.
pub(super) struct Fall {
    /// By steps of d² / 2⟨d²⟩, integer costs, of straight and of diagonal pairs.
    costs: [[u16; FALL_STEPS + 1]; 2],
    /// Table steps a squared half unit of L*a*b* distance, in units of 2⁻³².
    per_square: u64,
}

impl Fall {
    pub(super) fn of(image: &LabImage) -> Self {
        let (w, h) = (image.width(), image.height());
        let pairs = 2 * w.saturating_sub(1) * h.saturating_sub(1);
        let sum = InstructionSet::best().run(Differences(image));
        let mean = (sum as f32 / pairs.max(1) as f32).max(1.0);
        let step = FALL_END / FALL_STEPS as f32;
        let costs = [1.0, DIAGONAL].map(|length: f32| {
            std::array::from_fn(|at| {
                let strength = SMOOTHNESS * (BASE + (1.0 - BASE) * (-(at as f32) * step).exp());
                (strength * length * SCALE) as u16
            })
        });
        let per_square = 1.0 / (2.0 * f64::from(mean) * f64::from(step));
        Self { costs, per_square: (per_square * (1_u64 << 32) as f64) as u64 }
    }

    #[inline(always)]
    fn index(&self, squared: u32) -> usize {
        (((u64::from(squared) * self.per_square) >> 32) as usize).min(FALL_STEPS)
    }
}

/// The costs of the pairs of a picture, each at the first of its pixels.
///
/// Pixels are counted row by row after [`margin`](Self::margin) places that stand for nothing, and followed
/// by as many, so that all eight neighbours of every pixel are places. A pixel at a side has the end of
/// another row for a neighbour; to be parted from that costs nothing.
pub(super) struct PairCosts {
    width: usize,
    height: usize,
    /// Towards the pixels east, south-east, south and south-west.
    towards: [Vec<u16>; 4],
}

impl PairCosts {
    /// The costs of all pairs of which a pixel lies in `spans`, the columns that are asked for of each row.
    pub(super) fn of(image: &LabImage, fall: &Fall, spans: &[Range<usize>]) -> Self {
        let (width, height) = (image.width(), image.height());
        let places = width * height + 2 * (width + 1);
        let mut costs = Self { width, height, towards: std::array::from_fn(|_| vec![0; places]) };
        InstructionSet::best().run(Looking { image, fall, spans, costs: &mut costs });
        costs
    }

    /// Places before the first pixel.
    pub(super) fn margin(&self) -> usize {
        self.width + 1
    }

    /// All places.
    pub(super) fn places(&self) -> usize {
        self.width * self.height + 2 * self.margin()
    }

    /// How far a pixel's place is from those of the four that follow it: east, south-east, south, south-west.
    pub(super) fn ahead(&self) -> [usize; 4] {
        let w = self.width;
        // In a picture of one column, where there is no south-west, it is the pixel itself.
        [1, w + 1, w, w - 1]
    }

    /// The costs towards the four.
    pub(super) fn towards(&self) -> [&[u16]; 4] {
        self.towards.each_ref().map(Vec::as_slice)
    }

    #[inline(always)]
    fn look(&mut self, image: &LabImage, fall: &Fall, spans: &[Range<usize>]) {
        let (w, h) = (self.width, self.height);
        let mut squares = vec![0_u32; w];
        for y in 0..h {
            let here = &spans[y];
            let below = spans.get(y + 1).unwrap_or(&(0..0));
            let asked = match (here.is_empty(), below.is_empty()) {
                (true, true) => continue,
                (true, false) => below.clone(),
                (false, true) => here.clone(),
                (false, false) => here.start.min(below.start)..here.end.max(below.end),
            };
            let asked = asked.start.saturating_sub(1)..(asked.end + 1).min(w);
            for (side, ahead) in self.ahead().into_iter().enumerate() {
                let has_row = side == 0 || y + 1 < h;
                let first = asked.start.max(usize::from(side == 3));
                let end = if side < 2 { asked.end.min(w - 1) } else { asked.end };
                if !has_row || first >= end {
                    continue;
                }
                let row = y * w + first..y * w + end;
                let squares = &mut squares[..row.len()];
                let [l, a, b] = image.planes().each_ref().map(|plane| {
                    let there = &plane[row.start + ahead..row.end + ahead];
                    plane[row.clone()].iter().zip(there)
                });
                for (square, ((l, a), b)) in squares.iter_mut().zip(l.zip(a).zip(b)) {
                    let d = |(a, b): (&u8, &u8)| {
                        let d = u16::from(a.abs_diff(*b));
                        u32::from(d * d)
                    };
                    *square = d(l) + 4 * (d(a) + d(b));
                }
                let table = &fall.costs[side % 2];
                let margin = w + 1;
                let costs = &mut self.towards[side][margin + row.start..margin + row.end];
                for (cost, square) in costs.iter_mut().zip(squares) {
                    *cost = table[fall.index(*square)];
                }
            }
        }
    }
}

/// A picture whose pairs are to be looked at.
struct Looking<'a> {
    image: &'a LabImage,
    fall: &'a Fall,
    spans: &'a [Range<usize>],
    costs: &'a mut PairCosts,
}

impl Kernel for Looking<'_> {
    type Result = ();

    #[inline(always)]
    fn run(self) {
        self.costs.look(self.image, self.fall, self.spans);
    }
}

/// Sum over all pixels but those of the last column and row of the squared distances from the pixels right
/// of and below them, half units of L*a*b*.
struct Differences<'a>(&'a LabImage);

impl Kernel for Differences<'_> {
    type Result = u64;

    #[inline(always)]
    fn run(self) -> u64 {
        let (w, h) = (self.0.width(), self.0.height());
        let (columns, rows) = (w.saturating_sub(1), h.saturating_sub(1));
        let mut sum = 0;
        for (plane, weight) in self.0.planes().iter().zip([1, 4, 4]) {
            for y in 0..rows {
                let row = &plane[y * w..(y + 1) * w];
                let below = &plane[(y + 1) * w..(y + 2) * w];
                let squares = differences(&row[..columns], &row[1..])
                    + differences(&row[..columns], &below[..columns]);
                sum += weight * squares;
            }
        }
        sum
    }
}

/// Sum of the squared differences of two rows, in parts whose sums fit 32 bits.
#[inline(always)]
fn differences(a: &[u8], b: &[u8]) -> u64 {
    let part = |(a, b): (&[u8], &[u8])| {
        let square = |(a, b): (&u8, &u8)| {
            let d = u16::from(a.abs_diff(*b));
            u32::from(d * d)
        };
        u64::from(a.iter().zip(b).map(square).sum::<u32>())
    };
    a.chunks(4096).zip(b.chunks(4096)).map(part).sum()
}

#[cfg(test)]
pub(super) mod tests {
    use proptest::prelude::*;

    use super::*;

    /// A picture of less than so many columns and rows.
    pub(in super::super) fn picture(w: usize, h: usize) -> impl Strategy<Value = LabImage> {
        (1..w, 1..h).prop_flat_map(|(w, h)| {
            let plane = move || proptest::collection::vec(100_u8..140, w * h);
            (plane(), plane(), plane())
                .prop_map(move |(l, a, b)| LabImage::from_planes(w, h, [l, a, b]))
        })
    }

    /// Squared L*a*b* distance of two pixels, half units.
    fn distance_sq(image: &LabImage, a: usize, b: usize) -> f64 {
        let (a, b) = (image.at(a).map(f64::from), image.at(b).map(f64::from));
        (a[0] - b[0]).powi(2) + 4.0 * (a[1] - b[1]).powi(2) + 4.0 * (a[2] - b[2]).powi(2)
    }

    /// All pairs of neighbours with what it costs to part them, by the formula.
    pub(in super::super) fn pairs(image: &LabImage) -> Vec<(usize, usize, f64)> {
        let (w, h) = (image.width(), image.height());
        let (mut sum, mut count) = (0.0, 0.0_f64);
        for y in 1..h {
            for x in 1..w {
                let at = (y - 1) * w + x - 1;
                sum += distance_sq(image, at, at + 1) + distance_sq(image, at, at + w);
                count += 2.0;
            }
        }
        let mean = (sum / count.max(1.0)).max(1.0);
        let mut pairs = Vec::new();
        for a in 0..w * h {
            for b in a + 1..w * h {
                let (dx, dy) = ((a % w).abs_diff(b % w), (a / w).abs_diff(b / w));
                if dx <= 1 && dy <= 1 {
                    let length = (dx as f64).hypot(dy as f64);
                    let fall = (-distance_sq(image, a, b) / (2.0 * mean)).exp();
                    pairs.push((a, b, 2.0 * (0.1 + 0.9 * fall) / length));
                }
            }
        }
        pairs
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        /// What it costs to part two pixels, by the formula, and nothing to part others.
        #[test]
        fn pairs_cost_what_the_formula_says(image in picture(5, 4)) {
            let (w, h) = (image.width(), image.height());
            let costs = PairCosts::of(&image, &Fall::of(&image), &vec![0..w; h]);
            let mut left: Vec<Vec<u16>> = costs.towards().map(<[u16]>::to_vec).into();
            for (a, b, wanted) in pairs(&image) {
                let side = match (b / w - a / w, b % w == a % w, b % w > a % w) {
                    (0, ..) => 0,
                    (_, true, _) => 2,
                    (_, _, right) => if right { 1 } else { 3 },
                };
                prop_assert_eq!(costs.ahead()[side], b - a);
                let found = f64::from(std::mem::take(&mut left[side][costs.margin() + a])) / 1000.0;
                prop_assert!((found - wanted).abs() <= wanted / 64.0 + 0.001, "{found} {wanted}");
            }
            prop_assert!(left.iter().flatten().all(|cost| *cost == 0));
        }
    }
}
