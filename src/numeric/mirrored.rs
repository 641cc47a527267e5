//! A motion whose left does what its right does half a cycle later, predicted from some of its moments: each
//! known moment says, seen in a mirror, what the moment half a cycle later is like.

use std::f64::consts::{PI, TAU};

use nalgebra::{DMatrix, DVector, Dyn, LU};

/// Added to every known value's own variance: two moments at the same phase need not agree.
const LEAST_RIDGE: f64 = 1e-7;

/// What left and right do differently, as a share of the motion's variance: this times h³ of harmonic h, at
/// most half, when the mirror says nothing. Animals keep their steps alike and their details not: on the walks of
/// five rigs .02 of the first harmonic to nothing that is alike from the fourth on. Between .005 and .02 the errors
/// change by less than a tenth, with powers of h from 2 to 3 too.
const UNLIKE_SHARE: f64 = 0.01;

/// Harmonics that left and right have in common, from the above.
const ALIKE_HARMONICS: usize = 3;

/// With fewer keys than this a lasting difference of left and right cannot be told from a swing.
const LASTING_FROM: usize = 3;

/// Variance of that difference then, as a share of the motion's.
const LASTING_SHARE: f64 = 0.02;

/// Best linear unbiased prediction (universal kriging) of f(φ) = s(φ) + a(φ) from moments known both as they are and in
/// the mirror, M f(φ) = s(φ + ½) − a(φ + ½): s is what left and right have in common, M s(φ) = s(φ + ½), and a
/// what they have not.
///
/// The harmonics of f fall as h⁻⁴ in power, so that without the mirror the prediction is the periodic cubic spline, with
/// covariance k(x) = 1 − 30 x²(1 − x)², x = φ − φ' within 0 to 1 (see [`DriftingCycle`](super::DriftingCycle)); a
/// has the share ρ(h) = min(½, .01 h³) of harmonic h. Two moments of the same kind covary as k, one as it is and one
/// in the mirror as Σ (1 − 2ρ(h)) P(h) cos 2πhx with P(h) = h⁻⁴ · 90/π⁴.
///
/// The means of f and of M f are unknown each by itself, so a head that is always held to one side stays there: weights
/// of moments as they are sum to one, of those in the mirror to zero. One or two keys do not tell such a
/// difference from the swing of a leg: there all weights sum to one together.
#[derive(Clone, Debug)]
pub struct MirroredCycle {
    phases: Vec<f64>,
    system: LU<f64, Dyn, Dyn>,
}

impl MirroredCycle {
    /// From the phases of the known moments, cycles, each known as it is and in the mirror. `None` without any.
    #[must_use]
    pub fn new(phases_cycles: &[f64]) -> Option<Self> {
        let m = phases_cycles.len();
        let size = 2 * m + means(m);
        let system = DMatrix::from_fn(size, size, |i, j| match (i < 2 * m, j < 2 * m) {
            (true, true) => {
                let (a, b) = (moment(phases_cycles, i), moment(phases_cycles, j));
                covariance(a, b, m) + if i == j { LEAST_RIDGE } else { 0.0 }
            }
            (true, false) => of_mean(i, j - 2 * m, m),
            (false, true) => of_mean(j, i - 2 * m, m),
            (false, false) => 0.0,
        });
        let system = system.lu();
        (m > 0 && system.is_invertible()).then(|| Self { phases: phases_cycles.to_vec(), system })
    }

    /// Weights of the known moments at a phase: of all as they are, in the order given, then of all in the mirror.
    #[must_use]
    pub fn weights(&self, phase_cycles: f64) -> Vec<f64> {
        let (_, solution) = self.solved(phase_cycles);
        solution.iter().take(2 * self.phases.len()).copied().collect()
    }

    /// The expected square error there, as a share of the motion's variance.
    #[must_use]
    pub fn error_sq(&self, phase_cycles: f64) -> f64 {
        let (right, solution) = self.solved(phase_cycles);
        let place = (phase_cycles, false);
        (covariance(place, place, self.phases.len()) - right.dot(&solution)).max(0.0)
    }

    fn solved(&self, phase_cycles: f64) -> (DVector<f64>, DVector<f64>) {
        let m = self.phases.len();
        let right = DVector::from_fn(2 * m + means(m), |i, _| {
            if i < 2 * m {
                covariance(moment(&self.phases, i), (phase_cycles, false), m)
            } else {
                // The place is one of moments as they are.
                f64::from(u8::from(i == 2 * m))
            }
        });
        let solution = self.system.solve(&right).unwrap_or_else(|| DVector::zeros(right.len()));
        (right, solution)
    }
}

/// Number of unknown means with `m` keys.
fn means(m: usize) -> usize {
    if m < LASTING_FROM { 1 } else { 2 }
}

/// Whether moment `i` of 2m has unknown mean `which`, 0 or 1.
fn of_mean(i: usize, which: usize, m: usize) -> f64 {
    f64::from(u8::from(means(m) == 1 || (i >= m) == (which == 1)))
}

/// Phase of moment `i` of 2m, and whether it is in the mirror.
fn moment(phases: &[f64], i: usize) -> (f64, bool) {
    let m = phases.len();
    if i < m { (phases[i], false) } else { (phases[i - m] + 0.5, true) }
}

fn covariance(a: (f64, bool), b: (f64, bool), m: usize) -> f64 {
    let x = (a.0 - b.0).rem_euclid(1.0);
    let lasting = if means(m) == 1 { LASTING_SHARE } else { 0.0 };
    if a.1 == b.1 { 1.0 - 30.0 * (x * (1.0 - x)).powi(2) + lasting } else { alike(x) - lasting }
}

/// Covariance of what left and right have in common less that of what they have not.
fn alike(x: f64) -> f64 {
    (1..=ALIKE_HARMONICS)
        .map(|h| {
            let h = h as f64;
            let unlike = (UNLIKE_SHARE * h.powi(3)).min(0.5);
            let power = h.powi(-4) * 90.0 / PI.powi(4);
            (1.0 - 2.0 * unlike) * power * (TAU * h * x).cos()
        })
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::PeriodicCubic;

    /// A motion of two sides: the other side does the same half a cycle later.
    fn sides(phase: f64) -> [f64; 2] {
        let one = |p: f64| (TAU * p).sin() + 0.4 * (2.0 * TAU * p + 0.7).cos();
        [one(phase), one(phase + 0.5)]
    }

    /// Prediction of the first side from its moments and, in the mirror, the second's.
    fn error(phases: &[f64]) -> f64 {
        let cycle = MirroredCycle::new(phases).unwrap();
        let known: Vec<f64> = (phases.iter().map(|p| sides(*p)[0]))
            .chain(phases.iter().map(|p| sides(*p)[1]))
            .collect();
        let sum: f64 = (0..100)
            .map(|k| {
                let phase = f64::from(k) / 100.0;
                let found: f64 = cycle.weights(phase).iter().zip(&known).map(|(w, v)| w * v).sum();
                (found - sides(phase)[0]).powi(2)
            })
            .sum();
        (sum / 100.0).sqrt()
    }

    fn plain_error(phases: &[f64]) -> f64 {
        let spline = PeriodicCubic::new(phases).unwrap();
        let sum: f64 = (0..100)
            .map(|k| {
                let phase = f64::from(k) / 100.0;
                let found: f64 =
                    spline.weights(phase).iter().zip(phases).map(|(w, p)| w * sides(*p)[0]).sum();
                (found - sides(phase)[0]).powi(2)
            })
            .sum();
        (sum / 100.0).sqrt()
    }

    #[test]
    fn three_moments_and_their_mirror_images_do_nearly_what_six_do() {
        let three = [0.03, 0.03 + 1.0 / 3.0, 0.03 + 2.0 / 3.0];
        let six: Vec<f64> = (0..6).map(|k| 0.03 + f64::from(k) / 6.0).collect();
        let (mirrored, plain, double) = (error(&three), plain_error(&three), plain_error(&six));
        assert!(mirrored < 0.35 * plain, "{mirrored} {plain}");
        assert!(mirrored < 3.0 * double, "{mirrored} {double}");
        // Two moments a quarter apart and their images are four.
        assert!(error(&[0.1, 0.35]) < 0.5 * plain_error(&[0.1, 0.6]));
    }

    #[test]
    fn a_known_moment_is_kept_and_weights_sum_to_one() {
        for phases in [vec![0.1, 0.35], vec![0.0, 0.3, 0.7], vec![0.9, 0.1, 0.6, 0.3, 0.45]] {
            let m = phases.len();
            let cycle = MirroredCycle::new(&phases).unwrap();
            for (k, &phase) in phases.iter().enumerate() {
                let weights = cycle.weights(phase);
                assert!((weights[k] - 1.0).abs() < 1e-3, "{weights:?}");
                assert!(cycle.error_sq(phase) < 1e-5);
            }
            for step in 0..20 {
                let weights = cycle.weights(f64::from(step) / 20.0);
                assert_eq!(weights.len(), 2 * m);
                let sum = |part: &[f64]| part.iter().sum::<f64>();
                assert!((sum(&weights) - 1.0).abs() < 1e-9);
                if m > 2 {
                    assert!(sum(&weights[m..]).abs() < 1e-9);
                }
            }
        }
        assert!(MirroredCycle::new(&[]).is_none());
    }

    /// What is always held to one side stays there: the mirror, which shows it on the other, is not believed.
    #[test]
    fn a_lasting_difference_of_the_sides_is_kept() {
        let cycle = MirroredCycle::new(&[0.0, 0.3, 0.7]).unwrap();
        for step in 0..20 {
            let weights = cycle.weights(f64::from(step) / 20.0);
            let found: f64 = weights
                .iter()
                .enumerate()
                .map(|(i, w)| if i < 3 { 30.0 * w } else { -30.0 * w })
                .sum();
            assert!((found - 30.0).abs() < 1e-6, "{found}");
        }
    }

    #[test]
    fn where_images_fall_on_moments_it_is_the_spline() {
        let phases: Vec<f64> = (0..6).map(|k| f64::from(k) / 6.0).collect();
        let spline = PeriodicCubic::new(&phases).unwrap();
        let cycle = MirroredCycle::new(&phases).unwrap();
        let values: Vec<f64> = phases.iter().map(|p| sides(*p)[0]).collect();
        let images: Vec<f64> = phases.iter().map(|p| sides(*p)[1]).collect();
        for step in 0..60 {
            let phase = f64::from(step) / 60.0;
            let plain: f64 = spline.weights(phase).iter().zip(&values).map(|(w, v)| w * v).sum();
            let found: f64 = cycle
                .weights(phase)
                .iter()
                .zip(values.iter().chain(&images))
                .map(|(w, v)| w * v)
                .sum();
            assert!((found - plain).abs() < 0.04, "{phase}: {found} {plain}");
        }
    }

    /// The closed form of the covariance against the sum of its harmonics, and the least error against other weights.
    #[test]
    fn no_other_weights_are_expected_to_do_better() {
        let phases = [0.0, 0.21, 0.55, 0.83];
        let cycle = MirroredCycle::new(&phases).unwrap();
        let place = (0.4, false);
        let expected = |w: &[f64]| -> f64 {
            let mut error = covariance(place, place, 4);
            for i in 0..8 {
                let a = moment(&phases, i);
                error += LEAST_RIDGE * w[i] * w[i] - 2.0 * w[i] * covariance(a, place, 4);
                error +=
                    (0..8).map(|j| w[i] * w[j] * covariance(a, moment(&phases, j), 4)).sum::<f64>();
            }
            error
        };
        let best = cycle.weights(place.0);
        assert!((expected(&best) - cycle.error_sq(place.0)).abs() < 1e-9);
        for (one, two) in [(0, 1), (2, 3), (4, 6), (5, 7)] {
            for step in [-0.1, 0.01, 0.2] {
                let mut other = best.clone();
                other[one] += step;
                other[two] -= step;
                assert!(expected(&other) > expected(&best));
            }
        }
        let all: f64 = (1..400).map(|h| f64::from(h).powi(-4)).sum::<f64>() * 90.0 / PI.powi(4);
        assert!((all - 1.0).abs() < 1e-6 && alike(0.0) < 1.0 && alike(0.5) < 0.0);
    }
}
