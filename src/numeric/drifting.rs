//! A motion that repeats while it slowly becomes another, predicted from some of its moments.

use nalgebra::{DMatrix, DVector, Dyn, LU};

/// Added to every known value's own variance: two at the same phase and drift need not agree.
const LEAST_RIDGE: f64 = 1e-5;

/// Best linear unbiased prediction (universal kriging) of a quantity f(φ, d) = m + c(φ) + b·d from known
/// values, where m is unknown, c a random periodic function of unit variance and b a random slope of unit
/// variance. Weights sum to one.
///
/// The harmonics of c fall as h⁻⁴ in power: without drift the prediction is the periodic cubic spline, and the
/// covariance has the closed form of the fourth Bernoulli polynomial, Σ h⁻⁴ cos 2πhx / Σ h⁻⁴ = 1 − 30 x²(1 − x)²
/// with x = φ − φ' within 0 to 1 (Wahba, *Spline Models for Observational Data*, 1990, section 2.1); d d' is added.
/// The weights w of the known values solve K w + μ 1 = k, 1ᵀ w = 1, and the expected square error is k₀ − kᵀw − μ
/// (Cressie, *Statistics for Spatial Data*, 1993, section 3.4).
#[derive(Clone, Debug)]
pub struct DriftingCycle {
    known: Vec<(f64, f64)>,
    system: LU<f64, Dyn, Dyn>,
}

impl DriftingCycle {
    /// From the places of known values, phase in cycles and drift; `ridge` is the variance of what each is
    /// off by, as a share of the cycle's. `None` without values.
    #[must_use]
    pub fn new(known: &[(f64, f64)], ridge: f64) -> Option<Self> {
        let n = known.len();
        let system = DMatrix::from_fn(n + 1, n + 1, |i, j| match (known.get(i), known.get(j)) {
            (Some(a), Some(b)) => {
                covariance(*a, *b) + if i == j { LEAST_RIDGE.max(ridge) } else { 0.0 }
            }
            (None, None) => 0.0,
            _ => 1.0,
        });
        let system = system.lu();
        (n > 0 && system.is_invertible()).then(|| Self { known: known.to_vec(), system })
    }

    /// The weights of the known values at a place.
    #[must_use]
    pub fn weights(&self, phase_cycles: f64, drift: f64) -> Vec<f64> {
        let (_, solution) = self.solved((phase_cycles, drift));
        solution.iter().take(self.known.len()).copied().collect()
    }

    /// The expected square error there, as a share of the cycle's variance.
    #[must_use]
    pub fn error_sq(&self, phase_cycles: f64, drift: f64) -> f64 {
        let place = (phase_cycles, drift);
        let (right, solution) = self.solved(place);
        (covariance(place, place) - right.dot(&solution)).max(0.0)
    }

    fn solved(&self, place: (f64, f64)) -> (DVector<f64>, DVector<f64>) {
        let n = self.known.len();
        let right = DVector::from_fn(n + 1, |i, _| {
            self.known.get(i).map_or(1.0, |known| covariance(*known, place))
        });
        let solution = self.system.solve(&right).unwrap_or_else(|| DVector::zeros(n + 1));
        (right, solution)
    }
}

fn covariance(a: (f64, f64), b: (f64, f64)) -> f64 {
    let x = (a.0 - b.0).rem_euclid(1.0);
    1.0 - 30.0 * (x * (1.0 - x)).powi(2) + a.1 * b.1
}

#[cfg(test)]
mod tests {
    use super::*;

    fn known() -> Vec<(f64, f64)> {
        (0..7).map(|k| (0.43 * f64::from(k), 0.5 * f64::from(k) - 1.4)).collect()
    }

    #[test]
    fn the_covariance_is_that_of_its_harmonics() {
        let sum = |x: f64| -> f64 {
            let power = |h: u32| f64::from(h).powi(-4);
            (1..400).map(|h| power(h) * (std::f64::consts::TAU * f64::from(h) * x).cos()).sum()
        };
        for x in [0.0, 0.13, 0.5, 0.9, 1.3] {
            assert!((covariance((x, 0.0), (0.0, 0.0)) - sum(x) / sum(0.0)).abs() < 1e-7);
        }
    }

    #[test]
    fn without_drift_it_is_the_periodic_cubic_spline() {
        let phases = [0.02, 0.2, 0.37, 0.61, 0.8];
        let known = phases.map(|p| (p, 0.0));
        // The ridge is far below what is compared.
        let spline = crate::numeric::PeriodicCubic::new(&phases).unwrap();
        let cycle = DriftingCycle::new(&known, 0.0).unwrap();
        for k in 0..50 {
            let phase = f64::from(k) / 50.0;
            for (a, b) in cycle.weights(phase, 0.0).iter().zip(spline.weights(phase)) {
                assert!((a - b).abs() < 0.02, "{phase}: {a} {b}");
            }
        }
    }

    #[test]
    fn a_straight_drift_is_followed_and_weights_sum_to_one() {
        let known = known();
        let cycle = DriftingCycle::new(&known, 0.0).unwrap();
        for (phase, drift) in [(0.1, -1.0), (0.77, 0.3), (2.4, 1.9)] {
            let weights = cycle.weights(phase, drift);
            assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-9);
            // A motion that only drifts is known but for the ridge.
            let found: f64 = weights.iter().zip(&known).map(|(w, k)| w * (3.0 + 2.0 * k.1)).sum();
            assert!((found - 3.0 - 2.0 * drift).abs() < 0.25, "{found} {drift}");
        }
    }

    #[test]
    fn a_known_place_has_its_own_value_unless_values_are_doubted() {
        let known = known();
        let cycle = DriftingCycle::new(&known, 0.0).unwrap();
        let doubted = DriftingCycle::new(&known, 0.3).unwrap();
        for (k, place) in known.iter().enumerate() {
            assert!((cycle.weights(place.0, place.1)[k] - 1.0).abs() < 1e-3);
            assert!(cycle.error_sq(place.0, place.1) < 1e-4);
            assert!(doubted.weights(place.0, place.1)[k] < 0.95);
        }
        assert!(DriftingCycle::new(&[], 0.0).is_none());
    }

    /// The expected square error is that of any weights with sum one in the model, at its least: compared with
    /// weights changed at random.
    #[test]
    fn no_other_weights_are_expected_to_do_better() {
        let known = known();
        let cycle = DriftingCycle::new(&known, 0.1).unwrap();
        let place = (1.13, 0.2);
        let expected = |weights: &[f64]| -> f64 {
            let mut error = covariance(place, place);
            for (a, w) in known.iter().zip(weights) {
                error += 0.1 * w * w - 2.0 * w * covariance(*a, place);
                error +=
                    known.iter().zip(weights).map(|(b, v)| w * v * covariance(*a, *b)).sum::<f64>();
            }
            error
        };
        let best = cycle.weights(place.0, place.1);
        assert!((expected(&best) - cycle.error_sq(place.0, place.1)).abs() < 1e-9);
        for k in 1..known.len() {
            for step in [-0.1, 0.01, 0.2] {
                let mut other = best.clone();
                other[k] += step;
                other[k - 1] -= step;
                assert!(expected(&other) > expected(&best));
            }
        }
    }
}
