//! Leading eigenpairs of a symmetric matrix.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::eigen_krylov::leading_by_krylov;

/// Order of a matrix from which few pairs are sought by iteration. At 1000 the decomposition takes
/// half a second and the iteration a fraction of that; below this order either takes milliseconds.
const ITERATE_FROM: usize = 160;

/// Eigenvalues in falling order with their unit eigenvectors.
///
/// The sign of an eigenvector is free; here its entry of largest magnitude is positive (the
/// first such entry when several are within 1e-9 of it), so that results do not depend on the
/// solver.
#[derive(Clone, Debug, PartialEq)]
pub struct EigenPairs {
    /// Eigenvalues, falling.
    pub values: Vec<f64>,
    /// One unit vector an eigenvalue.
    pub vectors: Vec<DVector<f64>>,
}

/// The `count` largest eigenvalues of a symmetric matrix (all when it has fewer). A few of a large
/// matrix are found by iteration, to a residual at the level of rounding; otherwise, and when that
/// does not converge, by a full decomposition (Householder tridiagonalisation and implicit QR).
///
/// # Panics
/// When the matrix is not square.
#[must_use]
pub fn leading_eigenpairs(symmetric: &DMatrix<f64>, count: usize) -> EigenPairs {
    assert!(symmetric.is_square(), "an eigenproblem needs a square matrix");
    if symmetric.is_empty() {
        return EigenPairs { values: Vec::new(), vectors: Vec::new() };
    }
    if symmetric.nrows() >= ITERATE_FROM
        && let Some(pairs) = leading_by_krylov(symmetric, count)
    {
        let (values, vectors) = pairs.into_iter().unzip();
        return EigenPairs { values, vectors: Vec::into_iter(vectors).map(with_sign).collect() };
    }
    by_decomposition(symmetric, count)
}

fn by_decomposition(symmetric: &DMatrix<f64>, count: usize) -> EigenPairs {
    let full = SymmetricEigen::new(symmetric.clone());
    let mut order: Vec<usize> = (0..full.eigenvalues.len()).collect();
    // Stable: equal eigenvalues stay in the solver's order.
    order.sort_by(|&a, &b| full.eigenvalues[b].total_cmp(&full.eigenvalues[a]));
    order.truncate(count);
    EigenPairs {
        values: order.iter().map(|&i| full.eigenvalues[i]).collect(),
        vectors: order
            .iter()
            .map(|&i| with_sign(full.eigenvectors.column(i).into_owned()))
            .collect(),
    }
}

fn with_sign(vector: DVector<f64>) -> DVector<f64> {
    let largest = vector.amax();
    let leads = vector.iter().find(|v| v.abs() >= largest * (1.0 - 1e-9));
    if leads.is_some_and(|v| *v < 0.0) { -vector } else { vector }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_matrix_with_known_eigenvalues() {
        // The second-difference matrix of size n: λ_k = 2 − 2 cos(kπ/(n+1)).
        let n = 9;
        let matrix = DMatrix::from_fn(n, n, |i, j| match i.abs_diff(j) {
            0 => 2.0,
            1 => -1.0,
            _ => 0.0,
        });
        let pairs = leading_eigenpairs(&matrix, 3);
        for (k, value) in pairs.values.iter().enumerate() {
            let angle = (n - k) as f64 * std::f64::consts::PI / (n + 1) as f64;
            assert!((value - (2.0 - 2.0 * angle.cos())).abs() < 1e-12);
        }
    }

    #[test]
    fn iteration_and_decomposition_agree_to_rounding() {
        // Both sides of the order from which pairs are iterated, on a kernel matrix of a noisy ring.
        for n in [ITERATE_FROM - 1, ITERATE_FROM, 400] {
            let matrix = DMatrix::from_fn(n, n, |i, j| {
                let angle = (i as f64 - j as f64) / 12.15;
                (-(angle.sin() / 0.4).powi(2)).exp() + 0.01 * ((i * j) as f64).sin().powi(2)
            });
            let (pairs, full) = (leading_eigenpairs(&matrix, 5), by_decomposition(&matrix, 5));
            for k in 0..5 {
                assert!((pairs.values[k] - full.values[k]).abs() < 1e-11 * full.values[0]);
                assert!(pairs.vectors[k].dot(&full.vectors[k]).abs() > 1.0 - 1e-9, "{n} {k}");
            }
        }
    }

    proptest! {
        #[test]
        fn pairs_solve_the_eigenproblem(entries in prop::collection::vec(-1.0..1.0_f64, 36)) {
            let a = DMatrix::from_row_slice(6, 6, &entries);
            let symmetric = &a * a.transpose();
            let pairs = leading_eigenpairs(&symmetric, 4);
            for (value, vector) in pairs.values.iter().zip(&pairs.vectors) {
                prop_assert!((&symmetric * vector - vector * *value).norm() < 1e-10);
                prop_assert!((vector.norm() - 1.0).abs() < 1e-12);
                prop_assert!(vector[vector.iamax()] > 0.0);
            }
            prop_assert!(pairs.values.windows(2).all(|w| w[0] >= w[1]));
        }
    }
}
