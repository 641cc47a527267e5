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
    odds: &[f32],
    known: &[Known],
    cut: &mut GridCut,
) -> Mask {
    let (w, h) = (image.width(), image.height());
    let fall = Fall::of(image);
    let mut problem = cut.problem(w, h);
    // East, south-east, south, south-west.
    let neighbours: [(i64, i64); 4] = [(1, 0), (1, 1), (0, 1), (-1, 1)];
    let diagonal = std::f32::consts::FRAC_1_SQRT_2;
    for y in 0..h {
        for x in 0..w {
            let at = y * w + x;
            if known[at] != Known::Free {
                continue;
            }
            let mut preference = (odds[at] * SCALE) as i32;
            let mut capacities = [0; 4];
            let colour = image.at(at);
            let strength = |dx: i64, dy: i64| -> Option<(usize, i32)> {
                let (nx, ny) = (x as i64 + dx, y as i64 + dy);
                if nx < 0 || ny < 0 || nx >= w as i64 || ny >= h as i64 {
                    return None;
                }
                let near = ny as usize * w + nx as usize;
                let length = if dx != 0 && dy != 0 { diagonal } else { 1.0 };
                Some((near, (fall.between(colour, image.at(near)) * length * SCALE) as i32))
            };
            for (capacity, (dx, dy)) in capacities.iter_mut().zip(neighbours) {
                let Some((near, strength)) = strength(dx, dy) else { continue };
                match known[near] {
                    Known::Free => *capacity = strength,
                    Known::Animal => preference += strength,
                    Known::Background => preference -= strength,
                }
            }
            // The four before this one say what they are when they are decided already.
            for (dx, dy) in neighbours {
                let Some((near, strength)) = strength(-dx, -dy) else { continue };
                match known[near] {
                    Known::Free => {}
                    Known::Animal => preference += strength,
                    Known::Background => preference -= strength,
                }
            }
            problem.add_pixel(x, y, preference, capacities);
        }
    }
    let solved = problem.solve();
    Mask::from_fn(w, h, |x, y| {
        let at = y * w + x;
        solved.foreground[at] || known[at] == Known::Animal
    })
}

/// The cost of parting two neighbours by their difference of colour d:
/// λ (b + (1 − b) exp(−d² / 2⟨d²⟩)), with the mean over all neighbours of the picture.
struct Fall {
    table: Vec<f32>,
    /// Table steps a squared half unit of L*a*b* distance.
    per_square: f32,
}

impl Fall {
    fn of(image: &LabImage) -> Self {
        let (w, h) = (image.width(), image.height());
        let mut sum = 0_u64;
        let mut pairs = 0_u64;
        for y in 0..h.saturating_sub(1) {
            for x in 0..w.saturating_sub(1) {
                let at = y * w + x;
                let here = image.at(at);
                sum += u64::from(squared(here, image.at(at + 1)))
                    + u64::from(squared(here, image.at(at + w)));
                pairs += 2;
            }
        }
        let mean = (sum as f32 / pairs.max(1) as f32).max(1.0);
        let step = FALL_END / FALL_STEPS as f32;
        let table = (0..=FALL_STEPS)
            .map(|at| SMOOTHNESS * (BASE + (1.0 - BASE) * (-(at as f32) * step).exp()))
            .collect();
        Self { table, per_square: 1.0 / (2.0 * mean * step) }
    }

    #[inline]
    fn between(&self, a: [u8; 3], b: [u8; 3]) -> f32 {
        let at = (squared(a, b) as f32 * self.per_square) as usize;
        self.table[at.min(FALL_STEPS)]
    }
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
