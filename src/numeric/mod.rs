//! Numbers only: this room knows no image, pose or file. Everything is `f64`,
//! but for cuts and distances on pixel grids, which are exact in integers.

mod coefficients;
mod distance;
mod drifting;
mod eigen;
mod eigen_jacobi;
mod eigen_krylov;
mod exponential;
mod fourier;
mod instructions;
mod kernel;
mod max_flow;
mod mirrored;
mod mixture;
mod monotone;
mod periodic;
mod phase;
mod rhythm;
mod smooth_path;
mod statistics;

pub use coefficients::Coefficients;
pub use distance::grid_distances_sq;
pub use drifting::DriftingCycle;
pub use eigen::{EigenPairs, leading_eigenpairs};
pub use eigen_jacobi::extreme_eigenvalues;
pub use fourier::{amplitude_spectrum, band_pass};
pub use instructions::InstructionSet;
pub(crate) use instructions::{Kernel, whole_part};
pub use kernel::{DEFAULT_ALPHA, KernelMatrix, distance_sq, gaussian};
pub use max_flow::{Cut, GridCut, GridProblem};
pub use mirrored::MirroredCycle;
pub use mixture::{Mixture, MixtureSettings};
pub use monotone::rising_fit;
pub use periodic::{Harmonics, PeriodicCubic};
pub use phase::{CyclePhase, wrapped};
pub use rhythm::{dominant_frequency, line_frequency, slow_basis};
pub use smooth_path::{SmoothPath, SpeedPrior, likeliest_prior, smooth_path};
pub use statistics::{
    correlation, mean, median, robust_deviation, standard_deviation, standardized,
};
