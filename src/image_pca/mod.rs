//! Principal component analysis of binary images (seed 003, section 2.3, equations 1 to 5).
//!
//! Every mask is one observation of width × height pixels. The covariance matrix of the pixels is
//! never made: with the masks as rows of I, the n × n Gram matrix I·Iᵗ has the same non-zero
//! eigenvalues, and its entries come from popcounts. Centring the images (equation 2) is
//! double-centring of the Gram matrix.

mod eigen_image;
mod gram;

use nalgebra::DMatrix;

pub use eigen_image::GreyImage;

use crate::error::{Error, Result};
use crate::mask::Mask;
use crate::numeric::{Coefficients, leading_eigenpairs, standardized};

/// An eigenvalue below this share of the total variance is rounding, not a component: its
/// direction would be arbitrary.
const RANK_TOLERANCE: f64 = 1e-12;

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
    /// [`Error::TooFewMasks`] with fewer than two masks, [`Error::MaskSize`] when sizes differ,
    /// [`Error::MasksEmpty`] when no mask has a pixel, [`Error::MasksConstant`] when all masks
    /// are the same.
    pub fn fit(masks: &[&Mask], components: usize) -> Result<Self> {
        check(masks)?;
        let n = masks.len();
        let centred = double_centred(&gram::gram(masks), n);
        let total = centred.trace();
        if total <= 0.0 {
            return Err(Error::MasksConstant { frames: n });
        }
        let mut pairs = leading_eigenpairs(&centred, components.max(1));
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

    /// The mean image ī + `deviations` · √λ along one component (seed, figure 7), in shares of
    /// coverage; values may leave 0…1. `masks` are those of [`ImagePca::fit`], in the same order.
    ///
    /// # Panics
    /// When there is no such component, or not the same number of masks.
    #[must_use]
    pub fn eigen_image(&self, masks: &[&Mask], component: usize, deviations: f64) -> GreyImage {
        let n = masks.len();
        assert_eq!(n, self.scores.frames(), "the masks that were analysed");
        // With unit scores s(t), the component image is E = Σ s(t)(i(t) − ī) / (n √λ), so the step
        // of k deviations along it is k √λ E = k/n Σ s(t) i(t), for the scores have mean zero.
        let weights: Vec<f64> = (0..n)
            .map(|t| (1.0 + deviations * self.scores.point(t)[component]) / n as f64)
            .collect();
        eigen_image::weighted_sum(masks, &weights)
    }

    /// The mean image ī, in shares of coverage, 0…1.
    ///
    /// # Panics
    /// Never with the masks of [`ImagePca::fit`].
    #[must_use]
    pub fn mean_image(&self, masks: &[&Mask]) -> GreyImage {
        let share = 1.0 / masks.len().max(1) as f64;
        eigen_image::weighted_sum(masks, &vec![share; masks.len()])
    }
}

fn check(masks: &[&Mask]) -> Result<()> {
    let Some(first) = masks.first() else {
        return Err(Error::TooFewMasks { frames: 0 });
    };
    if masks.len() < 2 {
        return Err(Error::TooFewMasks { frames: masks.len() });
    }
    let size = (first.width(), first.height());
    for (frame, mask) in masks.iter().enumerate() {
        if (mask.width(), mask.height()) != size {
            let found = (mask.width(), mask.height());
            return Err(Error::MaskSize { frame, found, expected: size });
        }
    }
    if masks.iter().all(|m| m.words().iter().all(|&w| w == 0)) {
        return Err(Error::MasksEmpty { frames: masks.len() });
    }
    Ok(())
}

/// K − row means − column means + grand mean. Row sums are exact integers, so equal rows give
/// exactly equal entries.
fn double_centred(gram: &[u64], n: usize) -> DMatrix<f64> {
    let count = n as f64;
    let row_mean: Vec<f64> =
        gram.chunks(n).map(|row| row.iter().sum::<u64>() as f64 / count).collect();
    let grand_mean = gram.iter().sum::<u64>() as f64 / (count * count);
    DMatrix::from_fn(n, n, |i, j| gram[i * n + j] as f64 - row_mean[i] - row_mean[j] + grand_mean)
}

#[cfg(test)]
mod tests;
