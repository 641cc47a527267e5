//! Periodic functions of one phase: the cubic spline through unevenly spaced knots as weights of
//! the knots' values, and Fourier series of several components.

use std::f64::consts::TAU;

use nalgebra::{Cholesky, DMatrix, DVector};

/// The periodic cubic spline (period one) through values at given phases, as weights of those
/// values: twice continuously differentiable, its second derivatives solve the cyclic tridiagonal
/// system of the textbooks.
#[derive(Clone, Debug, PartialEq)]
pub struct PeriodicCubic {
    /// Phases of the knots in ascending order, each in [0, 1).
    knots: Vec<f64>,
    /// Place of each ascending knot in the caller's order.
    order: Vec<usize>,
    /// Second derivatives at the knots as weights of the values.
    second: DMatrix<f64>,
}

/// Knots nearer than this share of the period count as this far apart.
const LEAST_GAP: f64 = 1e-9;

impl PeriodicCubic {
    /// Through knots at `phases_cycles`, in any order; `None` without knots.
    #[must_use]
    pub fn new(phases_cycles: &[f64]) -> Option<Self> {
        let n = phases_cycles.len();
        let mut order: Vec<usize> = (0..n).collect();
        let place = |k: usize| phases_cycles[k].rem_euclid(1.0);
        order.sort_by(|&a, &b| place(a).total_cmp(&place(b)).then(a.cmp(&b)));
        let knots: Vec<f64> = order.iter().map(|&k| place(k)).collect();
        let mut left = DMatrix::<f64>::zeros(n, n);
        let mut right = DMatrix::<f64>::zeros(n, n);
        for i in 0..n {
            let (before, after) = ((i + n - 1) % n, (i + 1) % n);
            let (h0, h1) = (gap(&knots, before), gap(&knots, i));
            left[(i, before)] += h0;
            left[(i, i)] += 2.0 * (h0 + h1);
            left[(i, after)] += h1;
            right[(i, before)] += 6.0 / h0;
            right[(i, i)] -= 6.0 / h0 + 6.0 / h1;
            right[(i, after)] += 6.0 / h1;
        }
        let second = if n > 1 { left.lu().solve(&right)? } else { right * 0.0 };
        (n > 0).then_some(Self { knots, order, second })
    }

    /// Weights of the values at `phase_cycles`, in the order in which the knots were given. They
    /// sum to one.
    #[must_use]
    pub fn weights(&self, phase_cycles: f64) -> Vec<f64> {
        let n = self.knots.len();
        let p = phase_cycles.rem_euclid(1.0);
        let i = self.knots.iter().rposition(|&k| k <= p).unwrap_or(n - 1);
        let after = (i + 1) % n;
        let h = gap(&self.knots, i);
        let b = ((p - self.knots[i]).rem_euclid(1.0) / h).min(1.0);
        let a = 1.0 - b;
        let (ca, cb) = ((a.powi(3) - a) * h * h / 6.0, (b.powi(3) - b) * h * h / 6.0);
        let mut weights = vec![0.0; n];
        for (k, &own) in self.order.iter().enumerate() {
            weights[own] = ca * self.second[(i, k)] + cb * self.second[(after, k)];
        }
        weights[self.order[i]] += a;
        weights[self.order[after]] += b;
        weights
    }
}

fn gap(knots: &[f64], i: usize) -> f64 {
    let n = knots.len();
    let wrap = f64::from(u8::from(i + 1 == n));
    (knots[(i + 1) % n] - knots[i] + wrap).max(LEAST_GAP)
}

/// A Fourier series of `components` values over one phase: a mean and the cosine and sine of each
/// harmonic.
#[derive(Clone, Debug, PartialEq)]
pub struct Harmonics {
    components: usize,
    /// Rows: 1, cos 1, sin 1, cos 2, …; one column a component.
    coefficients: DMatrix<f64>,
}

impl Harmonics {
    /// The weighted least-squares fit of `order` harmonics to rows of values (frames ×
    /// `components`, row-major) at `phases_cycles`. `None` when the weighted frames do not
    /// determine the series.
    #[must_use]
    pub fn fit(
        phases_cycles: &[f64],
        values: &[f64],
        components: usize,
        weights: &[f64],
        order: usize,
    ) -> Option<Self> {
        let terms = 1 + 2 * order;
        let mut normal = DMatrix::<f64>::zeros(terms, terms);
        let mut right = DMatrix::<f64>::zeros(terms, components);
        let mut basis = vec![0.0; terms];
        for ((&phase, &weight), row) in
            phases_cycles.iter().zip(weights).zip(values.chunks_exact(components))
        {
            if weight <= 0.0 {
                continue;
            }
            fill_basis(&mut basis, phase);
            for i in 0..terms {
                let scaled = weight * basis[i];
                for j in 0..=i {
                    normal[(i, j)] += scaled * basis[j];
                }
                for (c, value) in row.iter().enumerate() {
                    right[(i, c)] += scaled * value;
                }
            }
        }
        let total: f64 = weights.iter().sum();
        for i in 0..terms {
            // Far below the data's own weight: it only keeps a factor from failing on rounding.
            normal[(i, i)] += 1e-9 * total;
        }
        let coefficients = Cholesky::new(normal)?.solve(&right);
        coefficients.iter().all(|c| c.is_finite()).then_some(Self { components, coefficients })
    }

    /// From the mean (one value a component) and, for each harmonic, the cosines and the sines of
    /// all components. `None` when lengths differ.
    #[must_use]
    pub fn from_parts(mean: &[f64], harmonics: &[(Vec<f64>, Vec<f64>)]) -> Option<Self> {
        let components = mean.len();
        let rows = std::iter::once(mean)
            .chain(harmonics.iter().flat_map(|(c, s)| [c.as_slice(), s.as_slice()]));
        let values: Vec<f64> = rows.clone().flatten().copied().collect();
        if rows.clone().any(|r| r.len() != components) {
            return None;
        }
        let coefficients = DMatrix::from_row_slice(1 + 2 * harmonics.len(), components, &values);
        Some(Self { components, coefficients })
    }

    /// Number of harmonics.
    #[must_use]
    pub fn order(&self) -> usize {
        (self.coefficients.nrows() - 1) / 2
    }

    /// Number of components.
    #[must_use]
    pub fn components(&self) -> usize {
        self.components
    }

    /// Cosine and sine of harmonic `harmonic` (from 1) in component `component`.
    ///
    /// # Panics
    /// When there is no such harmonic or component.
    #[must_use]
    pub fn of(&self, harmonic: usize, component: usize) -> (f64, f64) {
        let row = 2 * harmonic - 1;
        (self.coefficients[(row, component)], self.coefficients[(row + 1, component)])
    }

    /// Mean square over the cycle of harmonic `harmonic` (from 1), summed over the components.
    ///
    /// # Panics
    /// When there is no such harmonic.
    #[must_use]
    pub fn power(&self, harmonic: usize) -> f64 {
        (0..self.components)
            .map(|c| {
                let (cos, sin) = self.of(harmonic, c);
                (cos * cos + sin * sin) / 2.0
            })
            .sum()
    }

    /// Multiplies harmonic `harmonic` (from 1) of all components by `factor`.
    ///
    /// # Panics
    /// When there is no such harmonic.
    pub fn scale(&mut self, harmonic: usize, factor: f64) {
        for row in [2 * harmonic - 1, 2 * harmonic] {
            self.coefficients.row_mut(row).scale_mut(factor);
        }
    }

    /// The mean of each component over the cycle.
    #[must_use]
    pub fn mean(&self) -> DVector<f64> {
        self.coefficients.row(0).transpose()
    }

    /// Values of all components and their derivatives by the phase (per cycle).
    #[must_use]
    pub fn at(&self, phase_cycles: f64) -> (DVector<f64>, DVector<f64>) {
        let mut basis = vec![0.0; self.coefficients.nrows()];
        fill_basis(&mut basis, phase_cycles);
        let mut slope = vec![0.0; basis.len()];
        for h in 1..=self.order() {
            let rate = TAU * h as f64;
            slope[2 * h - 1] = -rate * basis[2 * h];
            slope[2 * h] = rate * basis[2 * h - 1];
        }
        let transposed = self.coefficients.transpose();
        (&transposed * DVector::from_vec(basis), transposed * DVector::from_vec(slope))
    }
}

fn fill_basis(basis: &mut [f64], phase_cycles: f64) {
    basis[0] = 1.0;
    for (at, pair) in basis[1..].chunks_exact_mut(2).enumerate() {
        let (sin, cos) = (TAU * (at + 1) as f64 * phase_cycles.rem_euclid(1.0)).sin_cos();
        pair[0] = cos;
        pair[1] = sin;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_spline_goes_through_its_knots_and_keeps_constants() {
        let knots = [0.52, 0.05, 1.3, -0.2];
        let spline = PeriodicCubic::new(&knots).unwrap();
        for (k, &knot) in knots.iter().enumerate() {
            let w = spline.weights(knot);
            assert!((w[k] - 1.0).abs() < 1e-12);
        }
        for step in 0..50 {
            let w = spline.weights(f64::from(step) / 50.0);
            assert!((w.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        }
        assert!(PeriodicCubic::new(&[]).is_none());
        assert_eq!(PeriodicCubic::new(&[0.3]).unwrap().weights(0.9), [1.0]);
    }

    #[test]
    fn the_spline_is_smooth_across_knots_and_the_seam() {
        let spline = PeriodicCubic::new(&[0.0, 0.2, 0.55, 0.7]).unwrap();
        let values = [1.0, -2.0, 0.5, 3.0];
        let f = |p: f64| -> f64 { spline.weights(p).iter().zip(values).map(|(w, v)| w * v).sum() };
        let h = 1e-4;
        let second = |p: f64| (f(p + h) - 2.0 * f(p) + f(p - h)) / (h * h);
        for knot in [0.0, 0.2, 0.55, 0.7] {
            let (before, after) = (second(knot - 2.0 * h), second(knot + 2.0 * h));
            assert!((before - after).abs() < 1.0, "{before} {after}");
        }
    }

    #[test]
    fn a_planted_series_is_found_with_its_slope() {
        let phases: Vec<f64> = (0..60).map(|t| f64::from(t) * 0.0731).collect();
        let truth = |p: f64| 0.3 + (TAU * p).cos() - 0.4 * (2.0 * TAU * p).sin();
        let values: Vec<f64> = phases.iter().map(|&p| truth(p)).collect();
        let found = Harmonics::fit(&phases, &values, 1, &[1.0; 60], 3).unwrap();
        for p in [0.1, 0.77] {
            let (value, slope) = found.at(p);
            assert!((value[0] - truth(p)).abs() < 1e-6);
            let numeric = (truth(p + 1e-6) - truth(p - 1e-6)) / 2e-6;
            assert!((slope[0] - numeric).abs() < 1e-5);
        }
        assert!((found.power(1) - 0.5).abs() < 1e-6 && (found.power(2) - 0.08).abs() < 1e-6);
    }
}
