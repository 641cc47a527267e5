//! The Gaussian kernel of key choice and interpolation (equation 15 of the paper).

use super::Coefficients;

/// The paper's alpha: with unit-deviation components two interpolation points are about 2 apart,
/// and midway, at distance 1, either should count one half: `h(1) = 0.5`.
pub const DEFAULT_ALPHA: f64 = std::f64::consts::LN_2;

/// Squared Euclidean distance of two points of equal dimension.
#[must_use]
pub fn distance_sq(p: &[f64], q: &[f64]) -> f64 {
    p.iter().zip(q).map(|(a, b)| (a - b) * (a - b)).sum()
}

/// h(r) = exp(−alpha · r²), equation 15, of the distance between `p` and `q`; in (0, 1], 1 for
/// equal points.
#[must_use]
pub fn gaussian(p: &[f64], q: &[f64], alpha: f64) -> f64 {
    (-alpha * distance_sq(p, q)).exp()
}

/// The symmetric matrix K_ij = h(|p_i − p_j|) of all frames, `frames × frames`, row-major.
///
/// Positive definite exactly when all points differ; its diagonal is exactly 1 and it is symmetric
/// to the bit.
#[derive(Clone, Debug, PartialEq)]
pub struct KernelMatrix {
    frames: usize,
    values: Vec<f64>,
}

impl KernelMatrix {
    /// The kernel matrix of all frames' points, 8·frames² bytes.
    #[must_use]
    pub fn of(coefficients: &Coefficients, alpha: f64) -> Self {
        let frames = coefficients.frames();
        let mut values = vec![1.0; frames * frames];
        for i in 0..frames {
            for j in 0..i {
                let h = gaussian(coefficients.point(i), coefficients.point(j), alpha);
                values[i * frames + j] = h;
                values[j * frames + i] = h;
            }
        }
        Self { frames, values }
    }

    /// Row `i`: the kernel between frame `i` and every frame.
    ///
    /// # Panics
    /// When `i` is not a frame.
    #[must_use]
    pub fn row(&self, i: usize) -> &[f64] {
        &self.values[i * self.frames..(i + 1) * self.frames]
    }

    /// The principal submatrix of `chosen`, row-major, in the order given.
    ///
    /// # Panics
    /// When one of `chosen` is not a frame.
    #[must_use]
    pub fn submatrix(&self, chosen: &[usize]) -> Vec<f64> {
        chosen.iter().flat_map(|&i| chosen.iter().map(move |&j| self.row(i)[j])).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_alpha_is_one_half_at_distance_one() {
        assert!((gaussian(&[0.0, 0.0], &[0.6, 0.8], DEFAULT_ALPHA) - 0.5).abs() < 1e-15);
    }

    #[test]
    fn the_matrix_holds_the_kernel_of_each_pair() {
        let c = Coefficients::from_rows(3, 1, vec![0.0, 1.0, 3.0]).unwrap();
        let k = KernelMatrix::of(&c, DEFAULT_ALPHA);
        assert_eq!(k.submatrix(&[0, 1]), vec![1.0, 0.5, 0.5, 1.0]);
        assert!((k.row(2)[0] - 2.0_f64.powi(-9)).abs() < 1e-15);
    }
}
