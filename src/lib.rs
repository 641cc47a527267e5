//! Footage of an animal becomes 3D animation on the artist's own rig.
//!
//! The way through the library is one way, each arrow one type:
//!
//! ```text
//! frames ──Picture──▶ silhouette ──Mask──▶ image_pca ──Coefficients──▶ spectrum ──▶ keys
//!                                                          │                        │
//!                                                          └──▶ interpolate ◀───────┘  ──Clip──▶ export
//! ```
//!
//! A module uses modules of a lower rank only (`tests/suite/layers.rs` holds the table).
//! The method is that of Favreau, Reveret, Depraz and Cani, *Animal Gaits from Video*,
//! INRIA RR-5170, 2004; `docs/method.md` says which equation lives in which file.

pub mod error;

pub mod image;
pub mod numeric;

pub mod frames;
pub mod mask;
pub mod rig;

pub mod export;
pub mod image_pca;
pub mod interpolate;
pub mod keys;
pub mod silhouette;
pub mod spectrum;
pub mod synthetic;

pub mod shot;

pub mod pipeline;
pub mod report;

pub mod validate;

pub use error::{Error, Result};
