//! The Cholesky factor of a shifted kernel matrix, and whether one more frame can join.

use crate::numeric::KernelMatrix;

use super::MAX_KEYS;

/// L with L·Lᵗ = K_S − σI for some frames S, on the stack.
pub(super) struct Factor<'a> {
    frames: &'a [usize],
    shift: f64,
    /// Lower triangle, rows of [`MAX_KEYS`] entries.
    lower: [f64; MAX_KEYS * MAX_KEYS],
}

impl<'a> Factor<'a> {
    /// `None` when K_S − `shift`·I is not positive definite.
    pub(super) fn of(kernel: &KernelMatrix, frames: &'a [usize], shift: f64) -> Option<Self> {
        let mut l = [0.0; MAX_KEYS * MAX_KEYS];
        for (i, &f) in frames.iter().enumerate() {
            let row = kernel.row(f);
            for (j, &g) in frames[..=i].iter().enumerate() {
                let mut sum = row[g] - if i == j { shift } else { 0.0 };
                for c in 0..j {
                    sum -= l[i * MAX_KEYS + c] * l[j * MAX_KEYS + c];
                }
                l[i * MAX_KEYS + j] = if i == j {
                    if sum <= 0.0 {
                        return None;
                    }
                    sum.sqrt()
                } else {
                    sum / l[j * MAX_KEYS + j]
                };
            }
        }
        Some(Self { frames, shift, lower: l })
    }

    /// For one more frame with the kernel's row `row`: the solution y of L·y = its column, and its
    /// entry of the Schur complement. The frame can join only when that is positive.
    pub(super) fn joined_by(&self, row: &[f64]) -> ([f64; MAX_KEYS], f64) {
        let mut y = [0.0; MAX_KEYS];
        let mut left = 1.0 - self.shift;
        for (i, &s) in self.frames.iter().enumerate() {
            let l = &self.lower[i * MAX_KEYS..i * MAX_KEYS + i + 1];
            let sum = row[s] - l.iter().zip(&y[..i]).map(|(l, y)| l * y).sum::<f64>();
            y[i] = sum / l[i];
            left -= y[i] * y[i];
        }
        (y, left)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;
    use proptest::prelude::*;

    use super::*;
    use crate::numeric::{Coefficients, DEFAULT_ALPHA};

    proptest! {
        #[test]
        fn a_frame_joins_exactly_when_the_larger_matrix_is_positive_definite(
            points in prop::collection::vec(-2.0..2.0_f64, 14),
            shift in 0.0..0.6_f64,
        ) {
            let coefficients = Coefficients::from_rows(7, 2, points).unwrap();
            let kernel = KernelMatrix::of(&coefficients, DEFAULT_ALPHA);
            let smallest = |frames: &[usize]| {
                let k = DMatrix::from_row_slice(frames.len(), frames.len(), &kernel.submatrix(frames));
                k.symmetric_eigenvalues().min()
            };
            let (some, all) = ([5, 1, 4, 0], [5, 1, 4, 0, 2]);
            prop_assume!((smallest(&some) - shift).abs() > 1e-9 && (smallest(&all) - shift).abs() > 1e-9);
            let factor = Factor::of(&kernel, &some, shift);
            prop_assert_eq!(factor.is_some(), smallest(&some) > shift);
            if let Some(factor) = factor {
                prop_assert_eq!(factor.joined_by(kernel.row(2)).1 > 0.0, smallest(&all) > shift);
            }
        }
    }
}
