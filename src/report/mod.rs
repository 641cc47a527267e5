//! What a shot looks like on paper: plots, contact sheets and one self-contained page.
//!
//! Nothing is computed here that a stage has not stored before; the inputs are plain data which
//! the caller fills from the shot's files. The same input gives the same bytes, on any number of
//! threads.
//!
//! - [`plots`]: one SVG a plot;
//! - [`sheets`]: contact sheet of the keys, overlay of the segmentation, eigen-silhouettes, as
//!   rasters;
//! - [`page`]: `report.html`, which holds all of these and needs no other file.
//!
//! Frames are counted from 0 throughout, and frame i of the footage is at time i/fps.

mod canvas;
mod drawing;
mod embedded;
mod film;
mod movie;
mod overlay;
pub mod page;
mod palette;
pub mod plots;
mod png;
mod rig_copy;
pub mod sheets;
mod stored_page;

pub use drawing::{can_draw_sheets, draw_sheets, write_page};
pub use embedded::{Embedded, ScriptJson};
pub use movie::write_movie;
pub use overlay::{OverlayDrawn, draw_overlay};
pub use png::Png;

/// A key image as the plots and sheets mark it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub struct KeyMark {
    /// Number of the key, from 1. Partners are numbered on from the keys proper.
    pub key: usize,
    /// Frame of the footage, from 0.
    pub frame: usize,
    /// For a partner (the other pose that has a like silhouette), the key it belongs to.
    pub partner_of: Option<usize>,
}
