//! Numbers only: this room knows no image, pose or file. Everything is `f64`.

mod coefficients;
mod eigen_jacobi;
mod kernel;
mod monotone;
mod phase;

pub use coefficients::Coefficients;
pub use eigen_jacobi::extreme_eigenvalues;
pub use kernel::{DEFAULT_ALPHA, KernelMatrix, distance_sq, gaussian};
pub use monotone::rising_fit;
pub use phase::{CyclePhase, wrapped};
