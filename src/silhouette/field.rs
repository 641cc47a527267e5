//! The contrast-sensitive random field: neighbouring pixels prefer one label, less so across an
//! edge of the picture (Boykov and Jolly 2001). Its optimum is found exactly, by a minimum cut.

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
    let [l, a, b] = image.planes();
    let colours: Vec<[u8; 3]> = (l.iter().zip(a).zip(b)).map(|((l, a), b)| [*l, *a, *b]).collect();
    let mut problem = cut.problem(w, h);
    for y in 0..h {
        for (x, _) in known[y * w..(y + 1) * w].iter().enumerate().filter(|k| *k.1 == Known::Free) {
            let at = y * w + x;
            let mut preference = (odds[at] * SCALE) as i32;
            let mut capacities = [0; 4];
            let colour = colours[at];
            // East, south-east, south and south-west, which this pixel has the pair's cost of, and
            // the four on the other side, which count only when they are decided already.
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
                let strength = costs[fall.index(colour, colours[near])];
                match known[near] {
                    Known::Free => capacities[side] = strength,
                    Known::Animal => preference += strength,
                    Known::Background => preference -= strength,
                }
            }
            problem.add_pixel(x, y, preference, capacities);
        }
    }
    let solved = problem.solve();
    let animal: Vec<bool> = (solved.foreground.iter().zip(known))
        .map(|(cut, known)| *cut || *known == Known::Animal)
        .collect();
    Mask::from_bools(w, h, &animal).unwrap_or_else(|| Mask::new(w, h))
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
    fn index(&self, a: [u8; 3], b: [u8; 3]) -> usize {
        (((u64::from(squared(a, b)) * self.per_square) >> 32) as usize).min(FALL_STEPS)
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
