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
//! The method in memory, on a rendered gallop, from masks to the frames worth posing:
//!
//! ```
//! use muybridge::pipeline::{KeyRequest, Trends, analyse_masks, choose};
//! use muybridge::synthetic::{Gait, SyntheticFootage, SyntheticSettings};
//! use muybridge::{keys::KeySettings, spectrum};
//!
//! let footage = SyntheticFootage::new(Gait::Gallop, SyntheticSettings::default());
//! let masks: Vec<_> = (0..60).map(|frame| footage.true_mask(frame)).collect();
//! let settings = spectrum::Settings::default();
//! let found = analyse_masks(&masks, 25.0, 5, Trends::default(), &settings)?;
//! assert_eq!(found.spectral.diagnosis.verdict, spectrum::Verdict::Usable);
//!
//! let request = KeyRequest {
//!     keys: KeySettings { keys: 4, ..KeySettings::default() },
//!     partners: false,
//!     partner_of: Vec::new(),
//!     step_frames: found.spectral.rhythm.step_frames,
//! };
//! let chosen = choose(&found.coefficients(true).leading(2), &request, &|_, _| true)?;
//! assert!(chosen.choice.proven_optimal);
//! # Ok::<(), muybridge::Error>(())
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
pub mod motion;
pub mod rig;

pub mod export;
pub mod feet;
pub mod gait;
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
pub mod work;

#[cfg(feature = "studio")]
pub mod studio;

pub use error::{Error, Result};
