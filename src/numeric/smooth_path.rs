//! The smoothest path through noisy measurements: penalised least squares on second differences,
//! with the stiffness chosen by its own evidence.

/// A path through `measured` values and its standard deviations.
#[derive(Clone, Debug, PartialEq)]
pub struct SmoothPath {
    /// The path.
    pub values: Vec<f64>,
    /// Standard deviation of each value, given the measurements' precision.
    pub deviations: Vec<f64>,
    /// The stiffness: inverse variance of a second difference.
    pub stiffness: f64,
}

/// L D Lᵀ of a symmetric matrix with two off-diagonals.
struct Pentadiagonal {
    diagonal: Vec<f64>,
    first: Vec<f64>,
    second: Vec<f64>,
}

impl Pentadiagonal {
    /// Factors `precision` on the diagonal plus stiffness · D₂ᵀD₂, D₂ the second differences.
    fn factor(precision: &[f64], stiffness: f64) -> Self {
        let n = precision.len();
        let mut diagonal = precision.to_vec();
        let mut first = vec![0.0; n];
        let mut second = vec![0.0; n];
        // Row k of D₂ is (1, −2, 1) from column k on; first[i] is the entry (i, i − 1).
        for k in 0..n.saturating_sub(2) {
            diagonal[k] += stiffness;
            diagonal[k + 1] += 4.0 * stiffness;
            diagonal[k + 2] += stiffness;
            first[k + 1] -= 2.0 * stiffness;
            first[k + 2] -= 2.0 * stiffness;
            second[k + 2] += stiffness;
        }
        for i in 0..n {
            if i >= 2 {
                second[i] /= diagonal[i - 2];
                first[i] -= second[i] * diagonal[i - 2] * first[i - 1];
            }
            if i >= 1 {
                first[i] /= diagonal[i - 1];
                diagonal[i] -= first[i] * first[i] * diagonal[i - 1];
            }
            if i >= 2 {
                diagonal[i] -= second[i] * second[i] * diagonal[i - 2];
            }
            diagonal[i] = diagonal[i].max(f64::MIN_POSITIVE);
        }
        Self { diagonal, first, second }
    }

    fn solve(&self, right: &[f64]) -> Vec<f64> {
        let n = right.len();
        let mut x = right.to_vec();
        for i in 0..n {
            if i >= 1 {
                x[i] -= self.first[i] * x[i - 1];
            }
            if i >= 2 {
                x[i] -= self.second[i] * x[i - 2];
            }
        }
        for i in (0..n).rev() {
            x[i] /= self.diagonal[i];
            if i + 1 < n {
                x[i] -= self.first[i + 1] * x[i + 1];
            }
            if i + 2 < n {
                x[i] -= self.second[i + 2] * x[i + 2];
            }
        }
        x
    }

    fn log_determinant(&self) -> f64 {
        self.diagonal.iter().map(|d| d.ln()).sum()
    }

    /// The diagonal of the inverse, from the bottom up (Takahashi's recursion, which needs the
    /// entries of the inverse within the band only).
    fn inverse_diagonal(&self) -> Vec<f64> {
        let n = self.diagonal.len();
        let mut own = vec![0.0; n];
        let mut next = vec![0.0; n];
        let mut over = vec![0.0; n];
        for i in (0..n).rev() {
            let a = self.first.get(i + 1).copied().unwrap_or(0.0);
            let b = self.second.get(i + 2).copied().unwrap_or(0.0);
            let at = |v: &[f64], k: usize| v.get(k).copied().unwrap_or(0.0);
            next[i] = -a * at(&own, i + 1) - b * at(&next, i + 1);
            over[i] = -a * at(&next, i + 1) - b * at(&own, i + 2);
            own[i] = 1.0 / self.diagonal[i] - a * next[i] - b * over[i];
        }
        own
    }
}

/// The path that best explains `measured` with the given `precision` (inverse variances, 0 where
/// nothing was measured) when second differences are Gaussian with inverse variance `stiffness`.
#[must_use]
pub fn smooth_path(measured: &[f64], precision: &[f64], stiffness: f64) -> SmoothPath {
    let factor = Pentadiagonal::factor(precision, stiffness);
    let right: Vec<f64> = measured.iter().zip(precision).map(|(m, p)| m * p).collect();
    let deviations = factor.inverse_diagonal().into_iter().map(|v| v.max(0.0).sqrt()).collect();
    SmoothPath { values: factor.solve(&right), deviations, stiffness }
}

/// Of `stiffnesses` the one under which the measurements are the most probable (the marginal
/// likelihood, the path integrated out); `None` with fewer than three measured values.
#[must_use]
pub fn likeliest_stiffness(
    measured: &[f64],
    precision: &[f64],
    stiffnesses: &[f64],
) -> Option<f64> {
    let n = measured.len();
    if precision.iter().filter(|p| **p > 0.0).count() < 3 {
        return None;
    }
    // A straight line costs nothing under any stiffness; taking one out keeps digits.
    let rate = (measured[n - 1] - measured[0]) / (n - 1) as f64;
    let rest: Vec<f64> =
        measured.iter().enumerate().map(|(t, m)| m - measured[0] - rate * t as f64).collect();
    let evidence = |stiffness: f64| {
        let factor = Pentadiagonal::factor(precision, stiffness);
        let right: Vec<f64> = rest.iter().zip(precision).map(|(m, p)| m * p).collect();
        let path = factor.solve(&right);
        let misfit: f64 =
            right.iter().zip(rest.iter().zip(&path)).map(|(r, (m, x))| r * (m - x)).sum();
        0.5 * ((n - 2) as f64 * stiffness.ln() - factor.log_determinant() - misfit)
    };
    stiffnesses.iter().copied().max_by(|&a, &b| evidence(a).total_cmp(&evidence(b)))
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::*;

    fn dense(precision: &[f64], stiffness: f64) -> DMatrix<f64> {
        let n = precision.len();
        let mut d = DMatrix::zeros(n - 2, n);
        for k in 0..n - 2 {
            d[(k, k)] = 1.0;
            d[(k, k + 1)] = -2.0;
            d[(k, k + 2)] = 1.0;
        }
        DMatrix::from_diagonal(&DVector::from_column_slice(precision))
            + stiffness * d.transpose() * d
    }

    #[test]
    fn it_is_the_dense_solution() {
        let precision = [1.0, 0.0, 3.0, 0.5, 2.0, 0.0, 0.0, 1.0];
        let measured = [0.3, 9.0, -1.0, 2.0, 0.1, 5.0, 4.0, 1.0];
        let matrix = dense(&precision, 0.7);
        let right = DVector::from_fn(8, |i, _| precision[i] * measured[i]);
        let inverse = matrix.clone().try_inverse().unwrap();
        let expected = &inverse * right;
        let found = smooth_path(&measured, &precision, 0.7);
        for i in 0..8 {
            assert!((found.values[i] - expected[i]).abs() < 1e-10);
            assert!((found.deviations[i].powi(2) - inverse[(i, i)]).abs() < 1e-10);
        }
        let log_determinant = Pentadiagonal::factor(&precision, 0.7).log_determinant();
        assert!((log_determinant - matrix.determinant().ln()).abs() < 1e-10);
    }

    #[test]
    fn the_evidence_tells_a_stiff_path_from_a_loose_one() {
        let mut state = 7_u64;
        let mut noise = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (state >> 33) as f64 / f64::from(1_u32 << 31) - 0.5
        };
        let grid = [1.0, 1e2, 1e4, 1e6];
        let straight: Vec<f64> = (0..200).map(|t| 0.1 * f64::from(t) + noise()).collect();
        let precision = vec![12.0; 200];
        assert_eq!(likeliest_stiffness(&straight, &precision, &grid), Some(1e6));
        let (mut rate, mut value) = (0.0, 0.0);
        let loose: Vec<f64> = (0..200)
            .map(|_| {
                rate += 3.0 * noise();
                value += rate;
                value + noise()
            })
            .collect();
        assert_eq!(likeliest_stiffness(&loose, &precision, &grid), Some(1.0));
    }
}
