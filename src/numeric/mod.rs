//! Numbers only: this room knows no image, pose or file. Everything is `f64`.

mod coefficients;
mod eigen;
mod fourier;
mod mixture;
mod statistics;

pub use coefficients::Coefficients;
pub use eigen::{EigenPairs, leading_eigenpairs};
pub use fourier::{amplitude_spectrum, band_pass};
pub use mixture::{Mixture, MixtureSettings};
pub use statistics::{correlation, mean, standard_deviation, standardized};
