//! Interpolation weights by Gaussian radial basis functions, equations 6 to 15 of the paper.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use serde::{Deserialize, Serialize};

use crate::numeric::{Coefficients, DEFAULT_ALPHA, distance_sq, extreme_eigenvalues, gaussian};
use crate::{Error, Result};

/// Condition of H + ridge·I above which its solution has no correct digit left worth having.
const SINGULAR: f64 = 1e12;

/// Sum of weights below which normalising would only blow up noise: so far from all keys the
/// nearest one takes over.
const LEAST_SUM: f64 = 1e-3;

/// How weights are computed from distances.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct KernelSettings {
    /// alpha of h(r) = exp(−alpha·r²), above 0. Default: ln 2, one half at distance 1.
    pub alpha: f64,
    /// λ ≥ 0 in (H + λI): above 0 the weights vary less between keys, but no longer give exactly a
    /// key's pose at its frame. Default: 0.
    pub ridge: f64,
    /// Whether weights are clamped to [0, 1]. Default: no, as in the paper.
    pub clamp: bool,
    /// Whether weights are divided by their sum, after the clamp. Where the sum is below 0.001, far
    /// from all keys, the nearest key gets weight 1. Default: no, as in the paper.
    pub normalise: bool,
}

impl Default for KernelSettings {
    fn default() -> Self {
        Self { alpha: DEFAULT_ALPHA, ridge: 0.0, clamp: false, normalise: false }
    }
}

impl KernelSettings {
    fn validate(&self) -> Result<()> {
        let refuse = |name, value, allowed| Err(Error::KernelSetting { name, value, allowed });
        if !(self.alpha.is_finite() && self.alpha > 0.0) {
            return refuse("alpha", self.alpha, "a positive number");
        }
        if !(self.ridge.is_finite() && self.ridge >= 0.0) {
            return refuse("ridge", self.ridge, "zero or a positive number");
        }
        Ok(())
    }
}

/// The weights of m interpolation points as a function of a point: w(p) = h(p)·(H + λI)⁻¹.
///
/// The paper's h(p)(HᵀH)⁻¹Hᵀ (equation 13) is the same for λ = 0, since H is square and
/// invertible; solving with H keeps twice the digits. The weights need neither lie in [0, 1] nor
/// sum to one; both hold nearly where p is among the points.
#[derive(Clone, Debug)]
pub struct Rbf {
    points: Vec<Vec<f64>>,
    factor: Cholesky<f64, Dyn>,
    settings: KernelSettings,
}

impl Rbf {
    /// The interpolation between the points of `keys`, frames of `coefficients`.
    ///
    /// # Errors
    /// Settings out of range; a key out of range; coefficients not finite; [`Error::NoKeys`];
    /// [`Error::CoincidingKeys`] with the two nearest keys when H + λI is singular to working
    /// precision (condition above 1e12).
    pub fn new(
        coefficients: &Coefficients,
        keys: &[usize],
        settings: &KernelSettings,
    ) -> Result<Self> {
        settings.validate()?;
        coefficients.check_finite()?;
        let frames = coefficients.frames();
        if let Some(&frame) = keys.iter().find(|&&k| k >= frames) {
            return Err(Error::KeyFrameOutOfRange { frame, frames });
        }
        if keys.is_empty() {
            return Err(Error::NoKeys);
        }
        let points: Vec<Vec<f64>> = keys.iter().map(|&k| coefficients.point(k).to_vec()).collect();
        let m = points.len();
        let mut h = DMatrix::from_fn(m, m, |i, j| gaussian(&points[i], &points[j], settings.alpha));
        for i in 0..m {
            h[(i, i)] += settings.ridge;
        }
        let (low, high) = extreme_eigenvalues(&mut h.as_slice().to_vec(), m);
        let factor = if low * SINGULAR > high { h.cholesky() } else { None };
        match factor {
            Some(factor) => Ok(Self { points, factor, settings: settings.clone() }),
            None => {
                let (first, second) = nearest_two(keys, &points);
                Err(Error::CoincidingKeys { first, second })
            }
        }
    }

    /// The weight of each key at a point, in the order of the keys.
    #[must_use]
    pub fn weights_at(&self, p: &[f64]) -> Vec<f64> {
        let h = DVector::from_iterator(
            self.points.len(),
            self.points.iter().map(|q| gaussian(p, q, self.settings.alpha)),
        );
        let mut w: Vec<f64> = self.factor.solve(&h).iter().copied().collect();
        if self.settings.clamp {
            w.iter_mut().for_each(|x| *x = x.clamp(0.0, 1.0));
        }
        if self.settings.normalise {
            self.normalise(p, &mut w);
        }
        w
    }

    fn normalise(&self, p: &[f64], w: &mut [f64]) {
        let sum: f64 = w.iter().sum();
        if sum >= LEAST_SUM {
            w.iter_mut().for_each(|x| *x /= sum);
            return;
        }
        let nearest = (0..w.len())
            .min_by(|&i, &j| {
                distance_sq(p, &self.points[i]).total_cmp(&distance_sq(p, &self.points[j]))
            })
            .unwrap_or(0);
        w.fill(0.0);
        w[nearest] = 1.0;
    }
}

/// The two frames whose points are nearest to each other, ascending.
fn nearest_two(keys: &[usize], points: &[Vec<f64>]) -> (usize, usize) {
    let pairs = (0..keys.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
    pairs
        .min_by(|a, b| {
            let d = |(i, j): (usize, usize)| distance_sq(&points[i], &points[j]);
            d(*a).total_cmp(&d(*b))
        })
        .map_or((keys[0], keys[0]), |(i, j)| (keys[i].min(keys[j]), keys[i].max(keys[j])))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn points(values: &[f64]) -> Coefficients {
        Coefficients::from_rows(values.len() / 2, 2, values.to_vec()).unwrap()
    }

    fn square() -> Coefficients {
        points(&[-1.0, -1.0, 1.0, -1.0, 1.0, 1.0, -1.0, 1.0])
    }

    proptest! {
        #[test]
        fn equals_the_papers_pseudo_inverse(
            raw in prop::collection::vec(-0.3..0.3_f64, 8), p in prop::collection::vec(-2.0..2.0_f64, 2)
        ) {
            let corners = square();
            let moved: Vec<f64> =
                (0..8).map(|i| corners.point(i / 2)[i % 2] + raw[i]).collect();
            let c = points(&moved);
            let rbf = Rbf::new(&c, &[0, 1, 2, 3], &KernelSettings::default()).unwrap();
            let h = DMatrix::from_fn(4, 4, |i, j| gaussian(c.point(i), c.point(j), DEFAULT_ALPHA));
            let hp = DMatrix::from_fn(1, 4, |_, j| gaussian(&p, c.point(j), DEFAULT_ALPHA));
            let expected = hp * (h.transpose() * &h).try_inverse().unwrap() * h.transpose();
            for (a, b) in rbf.weights_at(&p).iter().zip(expected.iter()) {
                prop_assert!((a - b).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn a_key_gets_its_own_pose_and_a_ridge_blurs_it() {
        let c = square();
        let exact = Rbf::new(&c, &[0, 1, 2, 3], &KernelSettings::default()).unwrap();
        let w = exact.weights_at(c.point(2));
        assert!((w[2] - 1.0).abs() < 1e-12 && w[0].abs() < 1e-12);
        let ridge = KernelSettings { ridge: 0.1, ..KernelSettings::default() };
        let w = Rbf::new(&c, &[0, 1, 2, 3], &ridge).unwrap().weights_at(c.point(2));
        assert!(w[2] < 0.95 && w[1] > 0.0);
    }

    #[test]
    fn clamped_and_normalised_weights_are_shares() {
        let settings = KernelSettings { clamp: true, normalise: true, ..KernelSettings::default() };
        let rbf = Rbf::new(&square(), &[0, 1, 2, 3], &settings).unwrap();
        for p in [[0.3, -2.5], [0.0, 0.0], [40.0, 39.0]] {
            let w = rbf.weights_at(&p);
            assert!((w.iter().sum::<f64>() - 1.0).abs() < 1e-12);
            assert!(w.iter().all(|x| (0.0..=1.0).contains(x)));
        }
        assert_eq!(rbf.weights_at(&[40.0, 39.0]), vec![0.0, 0.0, 1.0, 0.0]);
    }

    #[test]
    fn coinciding_keys_are_named_and_a_ridge_helps() {
        let c = points(&[0.0, 0.0, 1.0, 0.0, 0.0, 2.0, 1.0, 0.0]);
        let error = Rbf::new(&c, &[0, 1, 2, 3], &KernelSettings::default()).unwrap_err();
        assert!(matches!(error, Error::CoincidingKeys { first: 1, second: 3 }));
        let ridge = KernelSettings { ridge: 1e-3, ..KernelSettings::default() };
        assert!(Rbf::new(&c, &[0, 1, 2, 3], &ridge).is_ok());
    }

    #[test]
    fn settings_are_checked() {
        for bad in [
            KernelSettings { alpha: 0.0, ..KernelSettings::default() },
            KernelSettings { alpha: f64::NAN, ..KernelSettings::default() },
            KernelSettings { ridge: -1.0, ..KernelSettings::default() },
        ] {
            let error = Rbf::new(&square(), &[0, 1], &bad).unwrap_err();
            assert!(matches!(error, Error::KernelSetting { .. }));
        }
    }
}
