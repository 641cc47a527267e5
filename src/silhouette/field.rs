//! The contrast-sensitive random field: neighbouring pixels prefer one label, less so across an
//! edge of the picture (Boykov and Jolly 2001). Its optimum is found exactly, by a minimum cut.

use std::ops::Range;

use super::lab_image::LabImage;
use crate::mask::Mask;
use crate::numeric::GridCut;

/// Integer costs a natural unit of log odds.
const SCALE: f32 = 1000.0;

/// Strength of the field: what it costs to part two neighbours of the same colour, nats.
const SMOOTHNESS: f32 = 2.0;

/// The share of that which stays at the strongest edge: outlines are short even then.
const BASE: f32 = 0.1;

/// The share of its strength that a diagonal pair has.
const DIAGONAL: f32 = std::f32::consts::FRAC_1_SQRT_2;

/// Steps of the table of exp(−x), and the x it ends at.
const FALL_STEPS: usize = 512;
const FALL_END: f32 = 8.0;

/// What is known of a pixel before the cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Known {
    /// To be decided.
    Free,
    /// The animal.
    Animal,
    /// Background.
    Background,
}

/// The labelling of least cost: `odds` is each pixel's logarithm of the odds to be the animal.
pub(super) fn least_cost(
    image: &LabImage,
    fall: &Fall,
    odds: &[f32],
    known: &[Known],
    cut: &mut GridCut,
) -> Mask {
    let (w, h) = (image.width(), image.height());
    let mut problem = cut.problem(w, h);
    let mut row = Row::new(w);
    for y in 0..h {
        let of_row = &known[y * w..(y + 1) * w];
        let is_free = |known: &Known| *known == Known::Free;
        let Some(first) = of_row.iter().position(is_free) else { continue };
        let last = of_row.iter().rposition(is_free).unwrap_or(first);
        row.look(image, known, y, first..last + 1);
        for x in (first..=last).filter(|x| is_free(&of_row[*x])) {
            let mut preference = (odds[y * w + x] * SCALE) as i32;
            let capacities = if row.decided[x] {
                let (more, capacities) = beside_decided(image, fall, known, (x, y));
                preference += more;
                capacities
            } else {
                let costs = [&fall.straight, &fall.diagonal, &fall.straight, &fall.diagonal];
                std::array::from_fn(|side| costs[side][fall.index(row.squares[side][x])])
            };
            problem.add_pixel(x, y, preference, capacities);
        }
    }
    let solved = problem.solve();
    let animal: Vec<bool> = (solved.foreground.iter().zip(known))
        .map(|(cut, known)| *cut || *known == Known::Animal)
        .collect();
    Mask::from_bools(w, h, &animal).unwrap_or_else(|| Mask::new(w, h))
}

/// What the capacities of pixels beside which something is decided already are, and what that adds
/// to their preference.
fn beside_decided(
    image: &LabImage,
    fall: &Fall,
    known: &[Known],
    (x, y): (usize, usize),
) -> (i32, [i32; 4]) {
    let (w, h) = (image.width(), image.height());
    let at = y * w + x;
    let (mut preference, mut capacities) = (0, [0; 4]);
    // East, south-east, south and south-west, which this pixel has the pair's cost of, and the four
    // on the other side, which count only when they are decided.
    let (left, right, below) = (x > 0, x + 1 < w, y + 1 < h);
    let neighbours = [
        (right, at + 1, &fall.straight),
        (right && below, at + w + 1, &fall.diagonal),
        (below, at + w, &fall.straight),
        (left && below, at + w - 1, &fall.diagonal),
        (left, at.wrapping_sub(1), &fall.straight),
        (left && y > 0, at.wrapping_sub(w + 1), &fall.diagonal),
        (y > 0, at.wrapping_sub(w), &fall.straight),
        (right && y > 0, (at + 1).wrapping_sub(w), &fall.diagonal),
    ];
    for (side, (there, near, costs)) in neighbours.into_iter().enumerate() {
        if !there || (side >= 4 && known[near] == Known::Free) {
            continue;
        }
        let strength = costs[fall.index(squared(image.at(at), image.at(near)))];
        match known[near] {
            Known::Free => capacities[side] = strength,
            Known::Animal => preference += strength,
            Known::Background => preference -= strength,
        }
    }
    (preference, capacities)
}

/// What is worked out for a row at once, without branches.
struct Row {
    /// Squared differences of colour of each pixel from those east, south-east, south and south-west
    /// of it, as far as they are in the picture.
    squares: [Vec<u32>; 4],
    /// Whether any of the nine pixels about one is decided or outside the picture.
    decided: Vec<bool>,
    column: Vec<bool>,
}

impl Row {
    fn new(w: usize) -> Self {
        let squares = std::array::from_fn(|_| vec![0; w]);
        Self { squares, decided: vec![true; w], column: vec![true; w] }
    }

    /// Looks at the pixels `span` of row `y`.
    fn look(&mut self, image: &LabImage, known: &[Known], y: usize, span: Range<usize>) {
        let (w, h) = (image.width(), image.height());
        self.decided[span.clone()].fill(true);
        let inner = span.start.max(1)..span.end.min(w - 1);
        if y == 0 || y + 1 == h || inner.is_empty() {
            return;
        }
        let around = inner.start - 1..inner.end + 1;
        let part = |y: usize| &known[y * w..(y + 1) * w][around.clone()];
        let rows = part(y - 1).iter().zip(part(y)).zip(part(y + 1));
        for (column, ((a, b), c)) in self.column[around.clone()].iter_mut().zip(rows) {
            *column = (*a != Known::Free) | (*b != Known::Free) | (*c != Known::Free);
        }
        let column = &self.column[around];
        let columns = column.iter().zip(&column[1..]).zip(&column[2..]);
        for (decided, ((a, b), c)) in self.decided[inner.clone()].iter_mut().zip(columns) {
            *decided = *a | *b | *c;
        }
        let here = y * w + inner.start..y * w + inner.end;
        for (squares, ahead) in self.squares.iter_mut().zip([1, w + 1, w, w - 1]) {
            let [l, a, b] = image.planes().each_ref().map(|plane| {
                let there = &plane[here.start + ahead..here.end + ahead];
                plane[here.clone()].iter().zip(there)
            });
            for (square, ((l, a), b)) in squares[inner.clone()].iter_mut().zip(l.zip(a).zip(b)) {
                let d = |(a, b): (&u8, &u8)| {
                    let d = u16::from(a.abs_diff(*b));
                    u32::from(d * d)
                };
                *square = d(l) + 4 * (d(a) + d(b));
            }
        }
    }
}

/// The cost of parting two neighbours by their difference of colour d:
/// λ (b + (1 − b) exp(−d² / 2⟨d²⟩)), with the mean over all neighbours of the picture.
pub(super) struct Fall {
    /// By steps of d² / 2⟨d²⟩, integer costs.
    straight: Vec<i32>,
    diagonal: Vec<i32>,
    /// Table steps a squared half unit of L*a*b* distance, in units of 2⁻³².
    per_square: u64,
}

impl Fall {
    pub(super) fn of(image: &LabImage) -> Self {
        let (w, h) = (image.width(), image.height());
        let (columns, rows) = (w.saturating_sub(1), h.saturating_sub(1));
        let mut sum = 0_u64;
        for (plane, weight) in image.planes().iter().zip([1, 4, 4]) {
            for y in 0..rows {
                let row = &plane[y * w..(y + 1) * w];
                let below = &plane[(y + 1) * w..(y + 2) * w];
                let squares = differences(&row[..columns], &row[1..])
                    + differences(&row[..columns], &below[..columns]);
                sum += weight * squares;
            }
        }
        let pairs = 2 * columns * rows;
        let mean = (sum as f32 / pairs.max(1) as f32).max(1.0);
        let step = FALL_END / FALL_STEPS as f32;
        let costs = |length: f32| {
            let cost = |at: usize| {
                let strength = SMOOTHNESS * (BASE + (1.0 - BASE) * (-(at as f32) * step).exp());
                (strength * length * SCALE) as i32
            };
            (0..=FALL_STEPS).map(cost).collect()
        };
        let per_square = 1.0 / (2.0 * f64::from(mean) * f64::from(step));
        Self {
            straight: costs(1.0),
            diagonal: costs(DIAGONAL),
            per_square: (per_square * (1_u64 << 32) as f64) as u64,
        }
    }

    #[inline]
    fn index(&self, squared: u32) -> usize {
        (((u64::from(squared) * self.per_square) >> 32) as usize).min(FALL_STEPS)
    }
}

/// Sum of the squared differences of two rows, in parts whose sums fit 32 bits.
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

/// Squared distance in half units of L*a*b*.
#[inline]
fn squared(a: [u8; 3], b: [u8; 3]) -> u32 {
    let d = |c: usize, unit: i32| {
        let d = (i32::from(a[c]) - i32::from(b[c])) * unit;
        (d * d) as u32
    };
    d(0, 1) + d(1, 2) + d(2, 2)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    type Problem = (LabImage, Vec<f32>, Vec<Known>);

    /// A picture of up to twelve pixels with odds, some of them decided.
    fn problem() -> impl Strategy<Value = Problem> {
        (1_usize..5, 1_usize..4).prop_flat_map(|(w, h)| {
            let plane = || proptest::collection::vec(100_u8..140, w * h);
            let planes = (plane(), plane(), plane());
            let odds = proptest::collection::vec(-4.0..4.0_f32, w * h);
            let known = prop_oneof![
                4 => Just(Known::Free), 1 => Just(Known::Animal), 1 => Just(Known::Background),
            ];
            (planes, odds, proptest::collection::vec(known, w * h)).prop_map(
                move |((l, a, b), odds, known)| {
                    (LabImage::from_planes(w, h, [l, a, b]), odds, known)
                },
            )
        })
    }

    /// Squared L*a*b* distance of two pixels, half units.
    fn distance_sq(image: &LabImage, a: usize, b: usize) -> f64 {
        let (a, b) = (image.at(a).map(f64::from), image.at(b).map(f64::from));
        (a[0] - b[0]).powi(2) + 4.0 * (a[1] - b[1]).powi(2) + 4.0 * (a[2] - b[2]).powi(2)
    }

    /// All pairs of neighbours with what it costs to part them, by the formula.
    fn pairs(image: &LabImage) -> Vec<(usize, usize, f64)> {
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

    /// What a labelling costs: the odds it goes against, and the pairs it parts.
    fn cost(labels: &dyn Fn(usize) -> bool, odds: &[f32], pairs: &[(usize, usize, f64)]) -> f64 {
        let against = |at: usize| {
            let odds = f64::from(odds[at]);
            if labels(at) { (-odds).max(0.0) } else { odds.max(0.0) }
        };
        let parted: f64 =
            pairs.iter().filter(|(a, b, _)| labels(*a) != labels(*b)).map(|p| p.2).sum();
        (0..odds.len()).map(against).sum::<f64>() + parted
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        /// Against all labellings that agree with what is known, by the textbook's cost.
        #[test]
        fn no_labelling_costs_less((image, odds, known) in problem()) {
            let (w, n) = (image.width(), odds.len());
            let found = least_cost(&image, &Fall::of(&image), &odds, &known, &mut GridCut::new());
            let pairs = pairs(&image);
            for (at, known) in known.iter().enumerate() {
                let set = found.get(at % w, at / w);
                prop_assert!(*known == Known::Free || set == (*known == Known::Animal));
            }
            let agrees = |labels: u32| {
                known.iter().enumerate().all(|(at, known)| match known {
                    Known::Free => true,
                    Known::Animal => labels >> at & 1 == 1,
                    Known::Background => labels >> at & 1 == 0,
                })
            };
            let least = (0..1_u32 << n)
                .filter(|labels| agrees(*labels))
                .map(|labels| cost(&|at| labels >> at & 1 == 1, &odds, &pairs))
                .fold(f64::INFINITY, f64::min);
            let own = cost(&|at| found.get(at % w, at / w), &odds, &pairs);
            // A step of the exponential's table is 1/64, of the integer costs a thousandth.
            let slack = pairs.iter().map(|p| p.2 / 64.0 + 0.001).sum::<f64>() + 0.001 * n as f64;
            prop_assert!(own <= least + slack, "{own} {least}");
        }

        /// What it costs to part two pixels, by the formula.
        #[test]
        fn pairs_cost_what_the_formula_says((image, _, _) in problem()) {
            let fall = Fall::of(&image);
            let w = image.width();
            for (a, b, wanted) in pairs(&image) {
                let straight = a % w == b % w || a / w == b / w;
                let costs = if straight { &fall.straight } else { &fall.diagonal };
                let found = f64::from(costs[fall.index(squared(image.at(a), image.at(b)))]) / 1000.0;
                prop_assert!((found - wanted).abs() <= wanted / 64.0 + 0.001, "{found} {wanted}");
            }
        }
    }
}
