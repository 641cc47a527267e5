//! The one error type of the library.
//!
//! A variant holds data, its message says what went wrong and where (file, frame, line), and
//! [`Error::remedy`] says what to do about it. Callers match on variants, never on prose.

use std::path::{Path, PathBuf};

/// Result of everything in this library that can fail.
pub type Result<T> = std::result::Result<T, Error>;

/// What went wrong, with the place it went wrong in.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    // ---- files -------------------------------------------------------------------------------
    /// A file or folder could not be read, written, created or renamed.
    #[error("{}: cannot {action}: {source}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What was tried, an infinitive: "read", "create the folder".
        action: &'static str,
        /// The operating system's reason.
        source: std::io::Error,
    },
    /// A table in the shot cannot be understood.
    #[error("{}, line {line}: {what}", path.display())]
    Table {
        /// The CSV file.
        path: PathBuf,
        /// Counted from 1, the header included.
        line: usize,
        /// What is wrong with the line.
        what: String,
    },
    /// Another process works in the shot.
    #[error("{}: another muybridge is at work in this shot", shot.display())]
    ShotBusy {
        /// The shot folder.
        shot: PathBuf,
    },

    // ---- pictures ----------------------------------------------------------------------------
    /// A picture could not be decoded, or is not one that can be used.
    #[error("{}{}: {what}", path.display(), frame.map(|f| format!(" (frame {f})")).unwrap_or_default())]
    Picture {
        /// The file.
        path: PathBuf,
        /// The frame it should be, where there is a sequence.
        frame: Option<usize>,
        /// What is wrong with it.
        what: String,
    },
    /// A picture could not be written as PNG.
    #[error("cannot encode a PNG: {what}")]
    EncodePng {
        /// The encoder's reason.
        what: String,
    },

    /// A rectangle that cannot be used.
    #[error(
        "the {which} rectangle {},{},{},{} must lie within the picture of {} × {} pixels and hold at least {least_px} of them",
        rectangle[0], rectangle[1], rectangle[2], rectangle[3], picture.0, picture.1
    )]
    Rectangle {
        /// "foreground" or "background".
        which: &'static str,
        /// Left, top, width, height, pixels.
        rectangle: [usize; 4],
        /// Width and height of the picture.
        picture: (usize, usize),
        /// Fewest pixels it must hold.
        least_px: usize,
    },
    /// A setting outside its range.
    #[error("{name} must be a value that {rule}")]
    Setting {
        /// The setting.
        name: String,
        /// "lies between 0 and 1".
        rule: String,
    },

    // ---- analysis ----------------------------------------------------------------------------
    /// There are not enough masks to analyse.
    #[error("{frames} usable masks are too few to analyse; 4 or more are needed")]
    TooFewMasks {
        /// How many there are.
        frames: usize,
    },
    /// A mask has another size than the first.
    #[error("frame {frame}: the mask is {} × {} pixels, the others {} × {}", found.0, found.1, expected.0, expected.1)]
    MaskSize {
        /// The frame.
        frame: usize,
        /// Its width and height.
        found: (usize, usize),
        /// Width and height of the first mask.
        expected: (usize, usize),
    },
    /// No mask has a single pixel.
    #[error("all {frames} masks are empty: no animal was found")]
    MasksEmpty {
        /// How many masks.
        frames: usize,
    },
    /// All masks are the same.
    #[error("all {frames} masks are the same: nothing moves")]
    MasksConstant {
        /// How many masks.
        frames: usize,
    },
    /// A frame rate that is none.
    #[error("a frame rate of {fps} is none: it must be positive and finite")]
    FrameRate {
        /// What was given.
        fps: f64,
    },

    /// The work was stopped by the user (Ctrl-C or a progress callback that said stop).
    #[error("interrupted")]
    Interrupted,
}

impl Error {
    /// An [`Error::Io`]; made for `map_err(Error::io(path, "read"))`.
    pub fn io(path: &Path, action: &'static str) -> impl FnOnce(std::io::Error) -> Error {
        let path = path.to_owned();
        move |source| Error::Io { path, action, source }
    }

    /// An [`Error::Table`].
    pub(crate) fn table(path: &Path, line: usize, what: &str) -> Error {
        Error::Table { path: path.to_owned(), line, what: what.to_owned() }
    }

    /// An [`Error::Setting`].
    pub(crate) fn setting(name: &str, rule: &str) -> Error {
        Error::Setting { name: name.to_owned(), rule: rule.to_owned() }
    }

    /// What the user can do about it, one imperative sentence, or `None` where the message
    /// already says all there is.
    pub fn remedy(&self) -> Option<String> {
        match self {
            Error::Io { .. } => None,
            Error::Table { .. } => {
                Some("mend the line, or delete the file and run the stage again".to_owned())
            }
            Error::ShotBusy { .. } => Some("wait for it to end".to_owned()),
            Error::Picture { .. } => {
                Some("export the picture again, or leave its frame out with --frames".to_owned())
            }
            Error::EncodePng { .. } | Error::Setting { .. } => None,
            Error::Rectangle { which, .. } => Some(format!(
                "give --{which} as left,top,width,height in pixels of the first frame"
            )),
            Error::TooFewMasks { .. } => Some("take more frames of the clip".to_owned()),
            Error::MaskSize { .. } => Some(
                "save the mask at the size of the footage, or run `segment --force`".to_owned(),
            ),
            Error::MasksEmpty { .. } => Some(
                "place the two rectangles on the animal and clear of it, or paint masks or strokes"
                    .to_owned(),
            ),
            Error::MasksConstant { .. } => Some("take footage of a moving animal".to_owned()),
            Error::FrameRate { .. } => Some("give the footage's rate with --fps".to_owned()),
            Error::Interrupted => Some("run the same command again to go on".to_owned()),
        }
    }
}
