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
    // ---- report ------------------------------------------------------------------------------
    /// A plot, a sheet or the page could not be drawn.
    #[error("cannot draw \"{what}\": {reason}")]
    Drawing {
        /// What was to be drawn.
        what: String,
        /// The drawing library's reason.
        reason: String,
    },
    // ---- work --------------------------------------------------------------------------------
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

    /// What the user can do about it, one imperative sentence, or `None` where the message
    /// already says all there is.
    pub fn remedy(&self) -> Option<String> {
        match self {
            Error::Io { .. } => None,
            Error::Drawing { .. } => Some(
                "check the numbers in the shot's analysis folder, or make them anew with \
                 `muybridge analyze --force`"
                    .to_owned(),
            ),
            Error::Interrupted => Some("run the same command again to go on".to_owned()),
        }
    }
}
