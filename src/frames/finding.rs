//! What is odd about footage but no reason to stop.

use std::fmt;
use std::path::PathBuf;

/// Something about the footage that its owner may not know.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Finding {
    /// Numbers are missing between two files of a sequence. The frames on either side follow each
    /// other directly; nothing is put in the gap.
    Gap {
        /// The last file before the gap.
        after: PathBuf,
        /// The first file behind it.
        before: PathBuf,
        /// Frames missing.
        missing: u64,
    },
    /// Files of the folder or pattern are no pictures and were left out.
    LeftOut {
        /// The folder or pattern.
        location: PathBuf,
        /// How many files.
        count: usize,
    },
    /// A sequence holds several kinds of picture; all are read, in the order of their names.
    MixedKinds {
        /// Names of the kinds in alphabetical order, such as "JPEG".
        kinds: Vec<&'static str>,
    },
    /// Frames of a video or GIF do not follow each other evenly: they are resampled to a constant
    /// rate, a frame repeated while it is shown longer.
    VariableFrameRate {
        /// The file.
        path: PathBuf,
        /// The constant rate it is read at, frames a second.
        fps: f64,
    },
    /// The frames of a video, or stills of one, are two fields each, taken one after the other: they
    /// are deinterlaced.
    Interlaced {
        /// The file, folder or pattern.
        path: PathBuf,
    },
    /// The pixels of a video are not square; they are read as stored, so the picture looks
    /// squeezed.
    NonSquarePixels {
        /// The file.
        path: PathBuf,
        /// Width of a pixel over its height.
        aspect: f64,
    },
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Finding::Gap { after, before, missing } => write!(
                f,
                "{missing} {} missing between {} and {}",
                if *missing == 1 { "frame is" } else { "frames are" },
                after.display(),
                before.display()
            ),
            Finding::LeftOut { location, count } => write!(
                f,
                "{}: {count} {} left out",
                location.display(),
                if *count == 1 {
                    "file is no picture and was"
                } else {
                    "files are no pictures and were"
                }
            ),
            Finding::MixedKinds { kinds } => {
                write!(f, "the sequence mixes {}; all are read, by name", kinds.join(" and "))
            }
            Finding::VariableFrameRate { path, fps } => write!(
                f,
                "{}: the frame rate varies; read at a constant {fps:.3} frames a second",
                path.display()
            ),
            Finding::Interlaced { path } => {
                write!(f, "{}: interlaced; read deinterlaced, one picture a frame", path.display())
            }
            Finding::NonSquarePixels { path, aspect } => write!(
                f,
                "{}: pixels are {aspect:.3} times as wide as high; read as stored",
                path.display()
            ),
        }
    }
}
