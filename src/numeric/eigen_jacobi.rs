//! Extreme eigenvalues of small symmetric matrices by Jacobi rotations.

/// Sweeps after which the iteration gives up; convergence is quadratic and takes 5 to 10.
const MAX_SWEEPS: usize = 60;

/// Smallest and largest eigenvalue of a symmetric matrix of order `n`, row-major; `a` is
/// overwritten.
///
/// Cyclic Jacobi (Golub and Van Loan, *Matrix Computations*, §8.5), made for orders up to some
/// thirty. The absolute error is a few units of rounding of the largest eigenvalue, so the
/// condition number κ = largest / smallest carries a relative error of about κ · 1e-15.
///
/// # Panics
/// When `a` has not `n · n` entries or `n` is zero.
#[must_use]
pub fn extreme_eigenvalues(a: &mut [f64], n: usize) -> (f64, f64) {
    assert!(n > 0 && a.len() == n * n, "a square matrix");
    let scale: f64 = a.iter().map(|x| x * x).sum();
    for _ in 0..MAX_SWEEPS {
        let off: f64 = (0..n)
            .flat_map(|i| (0..i).map(move |j| (i, j)))
            .map(|(i, j)| a[i * n + j].powi(2))
            .sum();
        if off <= scale * 1e-33 {
            break;
        }
        for p in 0..n {
            for q in p + 1..n {
                rotate(a, n, p, q);
            }
        }
    }
    (0..n)
        .map(|i| a[i * n + i])
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), x| (lo.min(x), hi.max(x)))
}

/// One rotation in the plane (p, q) that makes a_pq zero.
fn rotate(a: &mut [f64], n: usize, p: usize, q: usize) {
    let apq = a[p * n + q];
    if apq == 0.0 {
        return;
    }
    let (app, aqq) = (a[p * n + p], a[q * n + q]);
    let theta = (aqq - app) / (2.0 * apq);
    let t = theta.signum() / (theta.abs() + theta.hypot(1.0));
    let c = 1.0 / t.hypot(1.0);
    let s = t * c;
    for k in 0..n {
        let (akp, akq) = (a[k * n + p], a[k * n + q]);
        a[k * n + p] = c * akp - s * akq;
        a[k * n + q] = s * akp + c * akq;
    }
    for k in 0..n {
        let (apk, aqk) = (a[p * n + k], a[q * n + k]);
        a[p * n + k] = c * apk - s * aqk;
        a[q * n + k] = s * apk + c * aqk;
    }
    a[p * n + p] = app - t * apq;
    a[q * n + q] = aqq + t * apq;
    a[p * n + q] = 0.0;
    a[q * n + p] = 0.0;
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_two_by_two_has_its_textbook_eigenvalues() {
        let (lo, hi) = extreme_eigenvalues(&mut [1.0, 0.25, 0.25, 1.0], 2);
        assert!((lo - 0.75).abs() < 1e-15 && (hi - 1.25).abs() < 1e-15);
    }

    proptest! {
        #[test]
        fn agrees_with_nalgebra(n in 1_usize..12, raw in prop::collection::vec(-1.0..1.0_f64, 144)) {
            let b = DMatrix::from_fn(n, n, |i, j| raw[i * 12 + j]);
            let a = &b + b.transpose();
            let expected = a.symmetric_eigenvalues();
            let (lo, hi) = extreme_eigenvalues(&mut a.as_slice().to_vec(), n);
            prop_assert!((lo - expected.min()).abs() < 1e-12);
            prop_assert!((hi - expected.max()).abs() < 1e-12);
        }
    }
}
