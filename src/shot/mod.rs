//! The shot folder: where every file of a shot is, and how it is loaded and saved. No algorithm.

mod record;
mod store;

use std::fs;
use std::path::{Path, PathBuf};

pub use record::{Freshness, Reads, StageWriter, Written};
pub use store::{hash_file, hash_files, hash_value, read, write_atomically};

use crate::error::{Error, Result};

/// The stages of a shot, in order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stage {
    /// Footage, mattes or strokes to masks.
    Segment,
    /// Masks to coefficients, spectrum and verdict.
    Analyze,
    /// Coefficients to key frames.
    Keys,
    /// Key frames to the weight of each pose in each frame.
    Weights,
    /// Poses and weights to the animated rig.
    Animate,
    /// The key images and contact sheet.
    Sheets,
    /// The page and its plots.
    Report,
}

impl Stage {
    /// The name used in records and messages.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Stage::Segment => "segment",
            Stage::Analyze => "analyze",
            Stage::Keys => "keys",
            Stage::Weights => "weights",
            Stage::Animate => "animate",
            Stage::Sheets => "sheets",
            Stage::Report => "report",
        }
    }
}
