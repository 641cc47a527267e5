//! From coefficients to weights, and from weights to poses.

mod blend;

pub use blend::{blend, largest_step_deg};
