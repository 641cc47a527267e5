//! Bit-packed silhouettes: one bit a pixel, 64 pixels a word, and the set operations on them.

mod components;
mod cropped;
mod geometry;
mod morphology;
mod packed;
mod png;
mod png_rows;
mod reach;
mod stroke;

pub(crate) use components::Run;
pub use components::{Component, Connectivity, components, linked_components};
pub use cropped::CroppedMask;
pub use packed::{Bounds, Mask};
pub use reach::Reach;
pub use stroke::default_stroke_radius_px;
