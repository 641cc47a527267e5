//! Principal component analysis of binary images (seed 003, section 2.3, equations 1 to 5).
//!
//! Every mask is one observation of width × height pixels. The covariance matrix of the pixels is
//! never made: with the masks as rows of I, the n × n Gram matrix I·Iᵗ has the same non-zero
//! eigenvalues, and its entries are exact integers from packed bits. Centring the images
//! (equation 2) is double-centring of the Gram matrix.

mod bands;
mod changes;
mod eigen_images;
mod gram;

use nalgebra::DMatrix;
use rayon::prelude::*;

pub use crate::numeric::InstructionSet;
pub use bands::MaskBands;
pub use changes::Changes;
pub use eigen_images::{EigenImages, GreyImage};

use crate::error::{Error, Result};
use crate::mask::Mask;
use crate::numeric::{Coefficients, leading_eigenpairs, standardized};

/// An eigenvalue below this share of the total variance is rounding, not a component: its
/// direction would be arbitrary.
const RANK_TOLERANCE: f64 = 1e-12;

/// Columns of a Gram matrix that are worked on at once, at most.
const BLOCK_COLUMNS: usize = 256;

/// The principal components of a clip's masks.
#[derive(Clone, Debug, PartialEq)]
pub struct ImagePca {
    /// Eigenvalues of (1/n)·IᵗI (equation 3), pixels², falling; as many as there are components.
    pub eigenvalues: Vec<f64>,
    /// The trace of the covariance matrix: the variance of all components together, pixels².
    pub total_variance: f64,
    /// Projections p(t) of equation 5, frames × components, pixels.
    pub projections: Coefficients,
    /// The projections scaled to unit standard deviation (population), as the Gaussian of
    /// equation 15 with alpha = ln 2 assumes.
    pub scores: Coefficients,
}

impl ImagePca {
    /// Analyses `masks`, all of one size, keeping at most `components` components (fewer when the
    /// masks span fewer dimensions).
    ///
    /// # Errors
    /// As [`Changes::of`]; [`Error::MasksConstant`] when all masks are the same.
    pub fn fit(masks: &[&Mask], components: usize) -> Result<Self> {
        Self::of(&Changes::of(masks)?, components)
    }

    /// The same of masks already packed, so that they can be used again for the images.
    ///
    /// # Errors
    /// [`Error::MasksConstant`] when all masks are the same.
    pub fn of(changes: &Changes, components: usize) -> Result<Self> {
        Self::of_gram(&CentredGram::of(changes), components)
    }

    /// The same of a Gram matrix that may have lost its slow changes.
    ///
    /// # Errors
    /// [`Error::MasksConstant`] when nothing varies.
    pub fn of_gram(gram: &CentredGram, components: usize) -> Result<Self> {
        let centred = &gram.matrix;
        let n = centred.nrows();
        let total = gram.variance();
        if total <= 0.0 {
            return Err(Error::MasksConstant { frames: n });
        }
        let mut pairs = leading_eigenpairs(centred, components.max(1));
        let kept = pairs.values.iter().take_while(|&&v| v > RANK_TOLERANCE * total).count();
        pairs.values.truncate(kept);
        // The left singular vectors of I times the singular values are the projections of
        // equation 5: (i(t) − ī)·E = √λ u(t) with λ the Gram matrix' eigenvalue.
        let columns: Vec<Vec<f64>> = pairs
            .values
            .iter()
            .zip(&pairs.vectors)
            .map(|(value, vector)| vector.iter().map(|u| u * value.sqrt()).collect())
            .collect();
        let unit: Vec<Vec<f64>> = columns.iter().map(|c| standardized(c)).collect();
        let coefficients = |c: &[Vec<f64>]| {
            Coefficients::from_columns(c).ok_or(Error::MasksConstant { frames: n })
        };
        Ok(Self {
            eigenvalues: pairs.values.iter().map(|v| v / n as f64).collect(),
            total_variance: total / n as f64,
            projections: coefficients(&columns)?,
            scores: coefficients(&unit)?,
        })
    }

    /// The first `components` components (all of them when there are fewer).
    #[must_use]
    pub fn leading(&self, components: usize) -> Self {
        Self {
            eigenvalues: self.eigenvalues.iter().copied().take(components).collect(),
            total_variance: self.total_variance,
            projections: self.projections.leading(components),
            scores: self.scores.leading(components),
        }
    }

    /// Share of the total variance of each component, 0…1, falling.
    #[must_use]
    pub fn variance_shares(&self) -> Vec<f64> {
        self.eigenvalues.iter().map(|v| v / self.total_variance).collect()
    }

    /// The mean image and the images of all components. `changes` are those of the masks that were
    /// analysed.
    ///
    /// # Panics
    /// When there is not the same number of masks.
    #[must_use]
    pub fn images(&self, changes: &Changes) -> EigenImages {
        assert_eq!(changes.frames(), self.scores.frames(), "the masks that were analysed");
        let components = 0..self.scores.components();
        let scores: Vec<Vec<f64>> = components.map(|c| self.scores.column(c)).collect();
        eigen_images::eigen_images(changes, &scores)
    }

    /// The same of masks that are packed a band at a time.
    ///
    /// # Panics
    /// When there is not the same number of masks.
    #[must_use]
    pub fn images_of_bands(&self, bands: &MaskBands) -> EigenImages {
        EigenImages::stacked(bands.packed().map(|band| self.images(&band)))
    }
}

/// The inner products of the masks about their mean, frames × frames, pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct CentredGram {
    matrix: DMatrix<f64>,
}

impl CentredGram {
    /// Of packed masks.
    #[must_use]
    pub fn of(changes: &Changes) -> Self {
        let n = changes.frames();
        Self { matrix: double_centred(&changes.gram(InstructionSet::best()), n) }
    }

    /// Of masks that are packed a band at a time.
    #[must_use]
    pub fn of_bands(bands: &MaskBands) -> Self {
        Self { matrix: double_centred(&bands.gram(), bands.frames()) }
    }

    /// The variance of all pixels together, times the number of frames, pixels².
    #[must_use]
    pub fn variance(&self) -> f64 {
        self.matrix.trace()
    }

    /// With the part of every pixel's course over the frames that `basis` spans taken out: with Q
    /// the orthonormal basis, one vector of an entry a frame each, K becomes (1 − QQᵗ)K(1 − QQᵗ).
    /// What is left is the Gram matrix of the masks less their slow changes.
    #[must_use]
    pub fn without(&self, basis: &[Vec<f64>]) -> Self {
        let n = self.matrix.nrows();
        let q = DMatrix::from_fn(n, basis.len(), |row, j| basis[j][row]);
        let (q_transposed, along) = (q.transpose(), &self.matrix * &q);
        // Some columns at a time: of a long clip, no more than the result is as large as the matrix.
        let mut columns = vec![0.0; n * n];
        // Blocks of about one size: a last one of a few columns would be summed in another order.
        let size = n.div_ceil(n.div_ceil(BLOCK_COLUMNS).max(1)).max(1);
        columns.par_chunks_mut((size * n).max(1)).enumerate().for_each(|(block, out)| {
            let (first, count) = (block * size, out.len() / n);
            let mut half = &along * q_transposed.columns(first, count);
            half.zip_apply(&self.matrix.columns(first, count), |less, entry| *less = entry - *less);
            let less = &q * (&q_transposed * &half);
            for ((out, half), less) in out.iter_mut().zip(&half).zip(&less) {
                *out = half - less;
            }
        });
        let mut matrix = DMatrix::from_vec(n, n, columns);
        // Rounding leaves the two halves different in the last bit; the eigen solvers want one.
        for column in 0..n {
            for row in 0..column {
                matrix[(column, row)] = matrix[(row, column)];
            }
        }
        Self { matrix }
    }
}

/// K − row means − column means + grand mean. Row sums are exact integers, so equal rows give
/// exactly equal entries.
fn double_centred(gram: &[u32], n: usize) -> DMatrix<f64> {
    let count = n as f64;
    let sum = |row: &[u32]| row.iter().map(|&k| u64::from(k)).sum::<u64>();
    let row_mean: Vec<f64> = gram.par_chunks(n).map(|row| sum(row) as f64 / count).collect();
    let grand_mean = sum(gram) as f64 / (count * count);
    let mut centred = vec![0.0; n * n];
    let columns = centred.par_chunks_mut(n).zip(gram.par_chunks(n)).enumerate();
    columns.for_each(|(j, (column, gram))| {
        for (i, (entry, &k)) in column.iter_mut().zip(gram).enumerate() {
            *entry = f64::from(k) - row_mean[i] - row_mean[j] + grand_mean;
        }
    });
    DMatrix::from_vec(n, n, centred)
}

#[cfg(test)]
mod tests;
