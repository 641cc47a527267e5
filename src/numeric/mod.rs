//! Numbers only: this room knows no image, pose or file. Everything is `f64`.

mod coefficients;

pub use coefficients::Coefficients;
