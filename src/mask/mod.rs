//! Bit-packed silhouettes: one bit a pixel, 64 pixels a word, and the set operations on them.

mod packed;

pub use packed::Mask;
