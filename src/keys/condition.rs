//! The condition number of one set of frames, exactly and as a cheap refusal.

use crate::numeric::{KernelMatrix, extreme_eigenvalues};

use super::MAX_KEYS;

/// Taken off every shift σ before a factorisation with it is allowed to refuse a set: well above
/// the backward error of a Cholesky factorisation of order [`MAX_KEYS`] (about 1e-13), so that
/// rounding never refuses a set that reaches σ.
pub(super) const SHIFT_SLACK: f64 = 1e-12;

/// Condition numbers above this are rounding noise (the smallest eigenvalue is below 1e-12 of the
/// largest): the set is singular to working precision.
pub(super) const SINGULAR: f64 = 1e12;

/// Two conditions that differ by less than this share count as equal.
pub(super) fn tie_tolerance(condition: f64) -> f64 {
    // The eigenvalues carry a relative error of about condition · 1e-15.
    (1e-14 * condition).max(1e-9)
}

/// cond(H) of a set of frames; infinite when H is singular to working precision.
///
/// The rows are put in ascending order of frame first, so the value does not depend on the order
/// in which a search found them.
pub(super) fn condition(kernel: &KernelMatrix, set: &[usize]) -> f64 {
    let mut sorted = set.to_vec();
    sorted.sort_unstable();
    let (low, high) = extreme_eigenvalues(&mut kernel.submatrix(&sorted), sorted.len());
    if low * SINGULAR < high { f64::INFINITY } else { high / low }
}

/// cond(H) of a set if it is at most `limit`, else `None`; mostly without an eigenvalue.
///
/// A Rayleigh quotient ρ bounds the largest eigenvalue from below, so cond ≤ limit needs
/// K − (ρ/limit) I positive definite, which one Cholesky factorisation tells.
pub(super) fn condition_within(kernel: &KernelMatrix, set: &[usize], limit: f64) -> Option<f64> {
    let m = set.len();
    let mut a = [0.0; MAX_KEYS * MAX_KEYS];
    for (i, &f) in set.iter().enumerate() {
        let row = kernel.row(f);
        for (j, &g) in set.iter().enumerate() {
            a[i * m + j] = row[g];
        }
    }
    let a = &mut a[..m * m];
    let shift = rayleigh(a, m) / limit - SHIFT_SLACK;
    if shift > 0.0 && !stays_positive(a, m, shift) {
        return None;
    }
    let exact = condition(kernel, set);
    (exact <= limit).then_some(exact)
}

/// A lower bound of the largest eigenvalue of a matrix of positive entries: the Rayleigh quotient
/// after two power steps from the vector of ones.
pub(super) fn rayleigh(a: &[f64], m: usize) -> f64 {
    let apply = |x: &[f64; MAX_KEYS]| {
        let mut y = [0.0; MAX_KEYS];
        for i in 0..m {
            y[i] = a[i * m..(i + 1) * m].iter().zip(x).map(|(p, q)| p * q).sum();
        }
        y
    };
    let x = apply(&apply(&[1.0; MAX_KEYS]));
    let y = apply(&x);
    let dot = |p: &[f64; MAX_KEYS]| p[..m].iter().zip(&x[..m]).map(|(p, q)| p * q).sum::<f64>();
    dot(&y) / dot(&x)
}

/// Whether A − shift·I has a Cholesky factor; `a` is overwritten.
fn stays_positive(a: &mut [f64], m: usize, shift: f64) -> bool {
    for j in 0..m {
        let mut pivot = a[j * m + j] - shift;
        for k in 0..j {
            pivot -= a[j * m + k] * a[j * m + k];
        }
        if pivot <= 0.0 {
            return false;
        }
        let root = pivot.sqrt();
        a[j * m + j] = root;
        for i in j + 1..m {
            let mut sum = a[i * m + j];
            for k in 0..j {
                sum -= a[i * m + k] * a[j * m + k];
            }
            a[i * m + j] = sum / root;
        }
    }
    true
}
