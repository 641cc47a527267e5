//! The likeliest path through noisy measurements, of a speed that wanders about a mean: penalised least squares, the
//! wandering chosen by its own evidence.

/// A path through `measured` values and its standard deviations.
#[derive(Clone, Debug, PartialEq)]
pub struct SmoothPath {
    /// The path.
    pub values: Vec<f64>,
    /// Standard deviation of each value, given the measurements' precision.
    pub deviations: Vec<f64>,
}

/// What is believed of a path's speed before anything is measured: it departs from a mean, of which nothing is known, by a
/// stationary first-order autoregression,
///
/// d(t + 1) = ρ d(t) + e(t), ρ = exp(−1/memory), var d = deviation², var e = (1 − ρ²) deviation².
///
/// So where nothing is measured (before the first value and after the last, above all) the speed returns to its mean, and
/// does not go on for ever as it was last seen, right or wrong.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpeedPrior {
    /// Standard deviation of the speed about its mean, a step.
    pub deviation: f64,
    /// Steps in which a departure from the mean fades to 1/e.
    pub memory_steps: f64,
}

impl SpeedPrior {
    /// The one whose speed changes from step to step with inverse variance `stiffness`, beside what it forgets.
    #[must_use]
    pub fn of_stiffness(stiffness: f64, memory_steps: f64) -> Self {
        let unscaled = Self { deviation: 1.0, memory_steps };
        Self { deviation: (stiffness * unscaled.fresh()).powf(-0.5), ..unscaled }
    }

    fn persistence(self) -> f64 {
        (-1.0 / self.memory_steps).exp()
    }

    /// Share of the speed's variance that each step brings anew, 1 − ρ².
    fn fresh(self) -> f64 {
        -(-2.0 / self.memory_steps).exp_m1()
    }

    /// ln det of the inverse covariance of all speeds about their mean: the first has 1/deviation², each change of the
    /// others 1/var e.
    fn log_determinant(self, speeds: usize) -> f64 {
        -2.0 * speeds as f64 * self.deviation.ln()
            - speeds.saturating_sub(1) as f64 * self.fresh().ln()
    }
}

/// L D Lᵀ of a symmetric matrix with two off-diagonals.
struct Pentadiagonal {
    diagonal: Vec<f64>,
    first: Vec<f64>,
    second: Vec<f64>,
}

impl Pentadiagonal {
    /// Factors `precision` on the diagonal plus the inverse covariance of a path whose mean speed is nought.
    fn factor(precision: &[f64], prior: SpeedPrior) -> Self {
        let n = precision.len();
        let mut diagonal = precision.to_vec();
        let mut first = vec![0.0; n];
        let mut second = vec![0.0; n];
        let rho = prior.persistence();
        let start = prior.deviation.powi(-2);
        let stiffness = start / prior.fresh();
        if n >= 2 {
            diagonal[0] += start;
            diagonal[1] += start;
            first[1] -= start;
        }
        // e(k) is (ρ, −(1 + ρ), 1) times the path from k on; first[i] is the entry (i, i − 1).
        for k in 0..n.saturating_sub(2) {
            diagonal[k] += stiffness * rho * rho;
            diagonal[k + 1] += stiffness * (1.0 + rho).powi(2);
            diagonal[k + 2] += stiffness;
            first[k + 1] -= stiffness * rho * (1.0 + rho);
            first[k + 2] -= stiffness * (1.0 + rho);
            second[k + 2] += stiffness * rho;
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

/// A path solved for: its departure from a line of the best mean speed.
struct Solved {
    factor: Pentadiagonal,
    /// The path.
    values: Vec<f64>,
    /// Sensitivity of the path to the mean speed.
    lever: Vec<f64>,
    /// Inverse variance of the mean speed.
    mean_precision: f64,
    /// What the measurements are missed by, and what the path costs, twice the negative logarithm.
    misfit: f64,
}

impl Solved {
    fn new(measured: &[f64], precision: &[f64], prior: SpeedPrior) -> Self {
        let n = measured.len();
        let factor = Pentadiagonal::factor(precision, prior);
        // About the middle of what was measured: the numbers stay small.
        let total: f64 = precision.iter().sum::<f64>().max(f64::MIN_POSITIVE);
        let centre = precision.iter().enumerate().map(|(t, p)| p * t as f64).sum::<f64>() / total;
        let ramp: Vec<f64> = (0..n).map(|t| t as f64 - centre).collect();
        let through = |values: &[f64]| -> Vec<f64> {
            factor.solve(&values.iter().zip(precision).map(|(v, p)| v * p).collect::<Vec<_>>())
        };
        let left = |values: &[f64]| -> Vec<f64> {
            values.iter().zip(through(values)).map(|(v, x)| v - x).collect()
        };
        let product = |a: &[f64], b: &[f64]| -> f64 {
            a.iter().zip(b).zip(precision).map(|((a, b), p)| a * b * p).sum()
        };
        // A straight line costs nothing; taking one out first keeps digits.
        let mean = product(measured, &vec![1.0; n]) / total;
        let slope = product(measured, &ramp) / product(&ramp, &ramp).max(f64::MIN_POSITIVE);
        let line = |t: usize| mean + slope * ramp[t];
        let rest: Vec<f64> = measured.iter().enumerate().map(|(t, m)| m - line(t)).collect();
        let lever = left(&ramp);
        let mean_precision = product(&ramp, &lever).max(f64::MIN_POSITIVE);
        let speed = product(&rest, &lever) / mean_precision;
        let off: Vec<f64> = rest.iter().zip(&ramp).map(|(m, r)| m - speed * r).collect();
        let misfit = product(&off, &left(&off));
        let values = through(&off)
            .into_iter()
            .enumerate()
            .map(|(t, x)| line(t) + speed * ramp[t] + x)
            .collect();
        Self { factor, values, lever, mean_precision, misfit }
    }
}

/// The path that best explains `measured` with the given `precision` (inverse variances, 0 where
/// nothing was measured) when its speed is as `prior` says.
#[must_use]
pub fn smooth_path(measured: &[f64], precision: &[f64], prior: SpeedPrior) -> SmoothPath {
    let solved = Solved::new(measured, precision, prior);
    let deviations = (solved.factor.inverse_diagonal().into_iter().zip(&solved.lever))
        .map(|(own, lever)| (own + lever * lever / solved.mean_precision).max(0.0).sqrt())
        .collect();
    SmoothPath { values: solved.values, deviations }
}

/// Logarithm of the probability of the measurements under `prior`, but for what does not depend on it (the path and its
/// mean speed integrated out).
fn evidence(measured: &[f64], precision: &[f64], prior: SpeedPrior) -> f64 {
    let solved = Solved::new(measured, precision, prior);
    let speeds = measured.len().saturating_sub(1);
    0.5 * (prior.log_determinant(speeds)
        - solved.factor.log_determinant()
        - solved.mean_precision.ln()
        - solved.misfit)
}

/// Of `priors` the one under which the measurements are the most probable; `None` with fewer than three measured values.
#[must_use]
pub fn likeliest_prior(
    measured: &[f64],
    precision: &[f64],
    priors: &[SpeedPrior],
) -> Option<SpeedPrior> {
    if precision.iter().filter(|p| **p > 0.0).count() < 3 {
        return None;
    }
    let weighed = priors.iter().map(|&prior| (prior, evidence(measured, precision, prior)));
    weighed.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(prior, _)| prior)
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::*;

    /// Inverse covariance of a path whose mean speed is nought, from the covariance of its speeds.
    fn dense_prior(n: usize, prior: SpeedPrior) -> DMatrix<f64> {
        let covariance = DMatrix::from_fn(n - 1, n - 1, |i, j| {
            prior.deviation.powi(2) * (-(i.abs_diff(j) as f64) / prior.memory_steps).exp()
        });
        let mut speeds = DMatrix::zeros(n - 1, n);
        for k in 0..n - 1 {
            speeds[(k, k)] = -1.0;
            speeds[(k, k + 1)] = 1.0;
        }
        speeds.transpose() * covariance.try_inverse().unwrap() * speeds
    }

    const PRECISION: [f64; 8] = [1.0, 0.0, 3.0, 0.5, 2.0, 0.0, 0.0, 1.0];
    const MEASURED: [f64; 8] = [0.3, 9.0, -1.0, 2.0, 0.1, 5.0, 4.0, 1.0];
    const PRIOR: SpeedPrior = SpeedPrior { deviation: 0.8, memory_steps: 2.5 };

    /// The dense problem in the path and, last, its mean speed.
    fn dense() -> (DMatrix<f64>, DVector<f64>) {
        let n = MEASURED.len();
        let prior = dense_prior(n, PRIOR);
        let ramp = DVector::from_fn(n, |t, _| t as f64);
        let mut matrix = DMatrix::zeros(n + 1, n + 1);
        let across = -&prior * &ramp;
        matrix.view_mut((0, 0), (n, n)).copy_from(&prior);
        matrix.view_mut((0, n), (n, 1)).copy_from(&across);
        matrix.view_mut((n, 0), (1, n)).copy_from(&across.transpose());
        matrix[(n, n)] = (ramp.transpose() * &prior * &ramp)[(0, 0)];
        for t in 0..n {
            matrix[(t, t)] += PRECISION[t];
        }
        let right =
            DVector::from_fn(n + 1, |t, _| if t < n { PRECISION[t] * MEASURED[t] } else { 0.0 });
        (matrix, right)
    }

    #[test]
    fn it_is_the_dense_solution() {
        let (matrix, right) = dense();
        let inverse = matrix.try_inverse().unwrap();
        let expected = &inverse * right;
        let found = smooth_path(&MEASURED, &PRECISION, PRIOR);
        for i in 0..MEASURED.len() {
            assert!((found.values[i] - expected[i]).abs() < 1e-10);
            assert!((found.deviations[i].powi(2) - inverse[(i, i)]).abs() < 1e-10);
        }
    }

    #[test]
    fn the_evidence_is_that_of_the_dense_gaussian() {
        // ln N(m; 0, C) of the measured values, C their covariance with a mean speed and a start of (nearly) any size. What
        // two priors differ by does not depend on that size.
        let seen: Vec<usize> = (0..MEASURED.len()).filter(|t| PRECISION[*t] > 0.0).collect();
        let dense = |prior: SpeedPrior| {
            let at = |i: usize, j: usize| {
                let (s, t) = (seen[i], seen[j]);
                let own = (0..s).flat_map(|a| (0..t).map(move |b| a.abs_diff(b) as f64));
                let wander: f64 = own.map(|lag| (-lag / prior.memory_steps).exp()).sum();
                let noise = if i == j { 1.0 / PRECISION[s] } else { 0.0 };
                1e5 * (1.0 + s as f64 * t as f64) + prior.deviation.powi(2) * wander + noise
            };
            let covariance = DMatrix::from_fn(seen.len(), seen.len(), at);
            let values = DVector::from_fn(seen.len(), |i, _| MEASURED[seen[i]]);
            let factor = covariance.cholesky().unwrap();
            -0.5 * (values.dot(&factor.solve(&values)) + factor.determinant().ln())
        };
        let other = SpeedPrior { deviation: 0.1, memory_steps: 9.0 };
        let found = evidence(&MEASURED, &PRECISION, PRIOR) - evidence(&MEASURED, &PRECISION, other);
        assert!((found - (dense(PRIOR) - dense(other))).abs() < 1e-3, "{found}");
    }

    #[test]
    fn the_evidence_tells_a_steady_speed_from_one_that_wanders() {
        let mut state = 7_u64;
        let mut noise = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (state >> 33) as f64 / f64::from(1_u32 << 31) - 0.5
        };
        let grid: Vec<SpeedPrior> = [1e-4, 1e-3, 1e-2, 1e-1]
            .into_iter()
            .flat_map(|deviation| {
                [3.0, 30.0].map(|memory_steps| SpeedPrior { deviation, memory_steps })
            })
            .collect();
        let precision = vec![1200.0; 400];
        let straight: Vec<f64> = (0..400).map(|t| 0.1 * f64::from(t) + 0.1 * noise()).collect();
        let found = likeliest_prior(&straight, &precision, &grid).unwrap();
        assert!(found.deviation < 1e-3, "{found:?}");
        for memory_steps in [3.0_f64, 30.0] {
            let keep = (-1.0 / memory_steps).exp();
            let fresh = 0.1 * (12.0 * (1.0 - keep * keep)).sqrt();
            let (mut off, mut value) = (0.0, 0.0);
            let wandering: Vec<f64> = (0..400)
                .map(|_| {
                    off = keep * off + fresh * noise();
                    value += 0.1 + off;
                    value + 0.1 * noise()
                })
                .collect();
            let found = likeliest_prior(&wandering, &precision, &grid);
            assert_eq!(found, Some(SpeedPrior { deviation: 0.1, memory_steps }));
        }
    }

    #[test]
    fn beyond_what_is_measured_the_speed_returns_to_its_mean() {
        // The last ten measured values go at twice the speed.
        let measured: Vec<f64> =
            (0..100).map(|t| f64::from(t) + f64::from((t - 50).clamp(0, 10))).collect();
        let mut precision = vec![1e4; 100];
        precision[60..].fill(0.0);
        let prior = SpeedPrior { deviation: 0.5, memory_steps: 5.0 };
        let path = smooth_path(&measured, &precision, prior).values;
        let speed = |t: usize| path[t + 1] - path[t];
        assert!((speed(55) - 2.0).abs() < 0.05, "{}", speed(55));
        assert!((speed(98) - 1.2).abs() < 0.1, "{}", speed(98));
    }
}
