//! Numbers only: this room knows no image, pose or file. Everything is `f64`.

mod coefficients;
mod eigen;
mod eigen_jacobi;
mod fourier;
mod kernel;
mod mixture;
mod monotone;
mod phase;
mod statistics;

pub use coefficients::Coefficients;
pub use eigen::{EigenPairs, leading_eigenpairs};
pub use eigen_jacobi::extreme_eigenvalues;
pub use fourier::{amplitude_spectrum, band_pass};
pub use kernel::{DEFAULT_ALPHA, KernelMatrix, distance_sq, gaussian};
pub use mixture::{Mixture, MixtureSettings};
pub use monotone::rising_fit;
pub use phase::{CyclePhase, wrapped};
pub use statistics::{
    correlation, mean, median, robust_deviation, standard_deviation, standardized,
};
