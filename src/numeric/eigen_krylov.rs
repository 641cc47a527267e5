//! Leading eigenpairs of a large symmetric matrix by a block Krylov method.
//!
//! The block Lanczos method with full reorthogonalisation (Golub and Van Loan, *Matrix
//! Computations*, §10.3.6): an orthonormal basis of the space of X, A·X, A²·X, … grows by a block
//! at a time, and the eigenpairs of A restricted to that space (Rayleigh and Ritz) approach the
//! outermost of A. A pair (θ, v) is believed when |A·v − θ·v| is at the level of rounding.

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// Vectors a block: one vector register of eight numbers, or several smaller ones. Eigenvalues of
/// higher multiplicity than this are left to the full decomposition.
const BLOCK: usize = 8;

/// Blocks after which the iteration gives up: on a spectrum so flat that a basis of 192 vectors does
/// not resolve it, a full decomposition is the safer way.
const MOST_BLOCKS: usize = 24;

/// Blocks before the first look at the pairs.
const FIRST_LOOK: usize = 4;

/// Residual, as a share of the largest eigenvalue, of a pair that is believed: a hundred times the
/// rounding error of a product with a matrix of order 1000.
const RESIDUAL: f64 = 1e-13;

/// What is left of a vector after taking off its part in the basis, as a share of the largest
/// eigenvalue, below which it is rounding and adds no direction.
const NEW_DIRECTION: f64 = 1e-12;

/// Seed of the starting block.
const SEED: u64 = 0x4b72_796c_6f76;

/// The `count` largest eigenvalues with unit eigenvectors, in falling order; `None` when the
/// iteration does not converge, or when the matrix is too small for it to pay.
///
/// The matrix is read by columns only and sums are taken in a fixed order, so the result does not
/// depend on threads or instructions.
pub(super) fn leading_by_krylov(
    symmetric: &DMatrix<f64>,
    count: usize,
) -> Option<Vec<(f64, DVector<f64>)>> {
    let n = symmetric.nrows();
    // A basis of half of all directions is as dear as a decomposition.
    let blocks = MOST_BLOCKS.min(n / (2 * BLOCK));
    if count > BLOCK * blocks / 2 {
        return None;
    }
    let mut space = Space { basis: Vec::new(), images: Vec::new(), scale: 0.0 };
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    let start = (0..BLOCK).map(|_| (0..n).map(|_| rng.random_range(-1.0..1.0)).collect()).collect();
    let mut block: Vec<Vec<f64>> = space.new_directions(start, 0.0);
    for step in 1..=blocks {
        let images = products(symmetric, &block);
        space.grow(block, images.clone());
        block = space.new_directions(images, NEW_DIRECTION * space.scale);
        let closed = block.is_empty();
        if closed || (step >= FIRST_LOOK && step % 2 == 0) || step == blocks {
            let pairs = space.ritz_pairs(count);
            let converged = pairs.as_ref().is_some_and(|p| p.len() == count);
            if converged || closed {
                return pairs.filter(|p| p.len() == count);
            }
        }
    }
    None
}

/// An orthonormal basis and its products with the matrix.
struct Space {
    basis: Vec<Vec<f64>>,
    images: Vec<Vec<f64>>,
    /// The largest norm of an image: at most the largest eigenvalue, and soon close to it.
    scale: f64,
}

impl Space {
    fn grow(&mut self, block: Vec<Vec<f64>>, images: Vec<Vec<f64>>) {
        let norm = |image: &Vec<f64>| dot(image, image).sqrt();
        self.scale = images.iter().map(norm).fold(self.scale, f64::max);
        self.basis.extend(block);
        self.images.extend(images);
    }

    /// The parts of `vectors` at right angles to the basis and to each other, as unit vectors;
    /// those no longer than `least` are left out. Projecting twice is enough to reach rounding
    /// (Giraud, Langou and Rozložník, 2005).
    fn new_directions(&self, mut vectors: Vec<Vec<f64>>, least: f64) -> Vec<Vec<f64>> {
        vectors.par_iter_mut().for_each(|vector| {
            for _ in 0..2 {
                self.basis.iter().for_each(|direction| project_out(vector, direction));
            }
        });
        let mut kept: Vec<Vec<f64>> = Vec::new();
        for mut vector in vectors {
            kept.iter().for_each(|direction| project_out(&mut vector, direction));
            let norm = dot(&vector, &vector).sqrt();
            if norm <= least {
                continue;
            }
            vector.iter_mut().for_each(|x| *x /= norm);
            // What rounding left along the basis has grown with the division.
            self.basis.iter().chain(&kept).for_each(|d| project_out(&mut vector, d));
            let norm = dot(&vector, &vector).sqrt();
            vector.iter_mut().for_each(|x| *x /= norm);
            kept.push(vector);
        }
        kept
    }

    /// The leading eigenpairs of the matrix restricted to the space, as many of the first `count`
    /// as have a residual at the level of rounding; `None` when the space is smaller than that.
    fn ritz_pairs(&self, count: usize) -> Option<Vec<(f64, DVector<f64>)>> {
        let size = self.basis.len();
        if size < count {
            return None;
        }
        let lower: Vec<f64> = (0..size * size)
            .into_par_iter()
            .map(|at| {
                let (i, j) = (at % size, at / size);
                if i >= j { dot(&self.basis[i], &self.images[j]) } else { 0.0 }
            })
            .collect();
        let restricted = DMatrix::from_fn(size, size, |i, j| lower[i.min(j) * size + i.max(j)]);
        let eigen = SymmetricEigen::new(restricted);
        let mut order: Vec<usize> = (0..size).collect();
        order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
        let largest = order.first().map_or(0.0, |&i| eigen.eigenvalues[i].abs());
        let pair = |&i: &usize| {
            let value = eigen.eigenvalues[i];
            let weights = eigen.eigenvectors.column(i);
            let vector = combination(&self.basis, weights.as_slice());
            let image = combination(&self.images, weights.as_slice());
            let residual = (image - &vector * value).norm();
            (residual <= RESIDUAL * largest).then_some((value, vector))
        };
        Some(order[..count].par_iter().map(pair).while_some().collect())
    }
}

fn combination(vectors: &[Vec<f64>], weights: &[f64]) -> DVector<f64> {
    let mut sum = vec![0.0; vectors.first().map_or(0, Vec::len)];
    for (vector, weight) in vectors.iter().zip(weights) {
        for (sum, x) in sum.iter_mut().zip(vector) {
            *sum += weight * x;
        }
    }
    DVector::from_vec(sum)
}

fn project_out(vector: &mut [f64], direction: &[f64]) {
    let along = dot(vector, direction);
    for (x, d) in vector.iter_mut().zip(direction) {
        *x -= along * d;
    }
}

/// The inner product, summed in eight interleaved parts.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let (a, a_rest) = a.as_chunks::<BLOCK>();
    let (b, b_rest) = b.as_chunks::<BLOCK>();
    let mut parts = [0.0; BLOCK];
    for (a, b) in a.iter().zip(b) {
        for ((part, a), b) in parts.iter_mut().zip(a).zip(b) {
            *part += a * b;
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    parts.iter().sum::<f64>() + rest
}

/// The products of the matrix with up to [`BLOCK`] vectors, one pass over the matrix for all.
fn products(symmetric: &DMatrix<f64>, block: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let n = symmetric.nrows();
    let lanes = |i: usize| std::array::from_fn(|v| block.get(v).map_or(0.0, |vector| vector[i]));
    let interleaved: Vec<[f64; BLOCK]> = (0..n).map(lanes).collect();
    let rows: Vec<[f64; BLOCK]> = symmetric
        .as_slice()
        .par_chunks(n)
        .map(|column| {
            let mut sums = [0.0; BLOCK];
            for (entry, lanes) in column.iter().zip(&interleaved) {
                for (sum, x) in sums.iter_mut().zip(lanes) {
                    *sum += entry * x;
                }
            }
            sums
        })
        .collect();
    (0..block.len()).map(|v| rows.iter().map(|row| row[v]).collect()).collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// A matrix with given eigenvalues: a product of reflections applied to a diagonal.
    fn with_spectrum(values: &[f64], seed: u64) -> DMatrix<f64> {
        let n = values.len();
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut a = DMatrix::from_diagonal(&DVector::from_column_slice(values));
        for _ in 0..4 {
            let v = DVector::from_fn(n, |_, _| rng.random_range(-1.0..1.0_f64)).normalize();
            let reflect = |a: &DMatrix<f64>| a - 2.0 * &v * (v.transpose() * a);
            a = reflect(&reflect(&a).transpose());
        }
        (&a + a.transpose()) / 2.0
    }

    fn check(values: &[f64], seed: u64, count: usize) -> Option<()> {
        let a = with_spectrum(values, seed);
        let pairs = leading_by_krylov(&a, count)?;
        let mut sorted = values.to_vec();
        sorted.sort_by(|x, y| y.total_cmp(x));
        assert_eq!(pairs.len(), count);
        for (k, (value, vector)) in pairs.iter().enumerate() {
            assert!((value - sorted[k]).abs() < 1e-11 * sorted[0], "{k}: {value} {}", sorted[k]);
            assert!((&a * vector - vector * *value).norm() < 1e-11 * sorted[0]);
            for (other, (_, earlier)) in pairs[..k].iter().enumerate() {
                assert!(vector.dot(earlier).abs() < 1e-11, "{k} and {other}");
            }
        }
        Some(())
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(12))]

        #[test]
        fn planted_eigenvalues_are_found(n in 150_usize..260, seed in any::<u64>()) {
            let values: Vec<f64> = (0..n).map(|k| 100.0 * 0.8_f64.powi(k as i32)).collect();
            prop_assert!(check(&values, seed, 5).is_some());
        }
    }

    #[test]
    fn equal_and_missing_eigenvalues_are_found() {
        // An exactly periodic clip has few directions, and eigenvalues come in pairs.
        let mut values = vec![0.0; 200];
        values[..6].copy_from_slice(&[9.0, 9.0, 4.0, 4.0, 4.0, 1.0]);
        assert!(check(&values, 3, 5).is_some());
        assert!(check(&values, 4, 8).is_some());
    }

    #[test]
    fn a_flat_spectrum_and_a_small_matrix_are_left_to_the_decomposition() {
        let flat: Vec<f64> = (0..600).map(|k| 1.0 + 1e-4 * f64::from(k) / 600.0).collect();
        assert!(leading_by_krylov(&with_spectrum(&flat, 5), 5).is_none());
        assert!(leading_by_krylov(&with_spectrum(&[3.0, 2.0, 1.0], 5), 2).is_none());
    }
}
