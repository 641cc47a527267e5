//! Clips to files: one more animation in the artist's glTF file, and BVH.
//!
//! Everything here returns bytes; the caller writes them.

mod bvh;
mod gltf;
mod splice;
mod tracks;

pub use bvh::{BvhSettings, bvh};
pub use gltf::{AppendedGltf, append_animation, append_animation_with_extras};
