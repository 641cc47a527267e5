//! Sheets of pictures: what the tool saw, at a glance.
//!
//! Footage and masks need not have the same size; they are taken to show the same view. Large
//! pictures are scaled down with a triangle filter, small ones magnified by whole factors only,
//! at most fourfold, each pixel a square.

mod contact_sheet;
mod eigen_sheet;
mod outline;
mod overlay_sheet;
mod tile;

pub use contact_sheet::{KeyTile, contact_sheet, key_image};
pub use eigen_sheet::{EigenRow, eigen_sheet};
pub(super) use outline::{Outline, draw_outline};
pub(super) use overlay_sheet::reduced;
pub use overlay_sheet::{FrameTile, evenly_chosen, overlay_sheet};
pub(super) use tile::{scaled_mask, scaled_picture, silhouette, whole};
