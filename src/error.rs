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
    /// The work was stopped by the user (Ctrl-C or a progress callback that said stop).
    #[error("interrupted")]
    Interrupted,
    // ---- keys --------------------------------------------------------------------------------
    /// A number of keys of zero or beyond what the search is made for.
    #[error("{keys} keys were asked for: from 1 to {most} are possible")]
    KeyCountOutOfRange {
        /// What was asked for.
        keys: usize,
        /// The largest number possible.
        most: usize,
    },
    /// After excluding, spacing and merging of equal frames there are not enough left.
    #[error("{keys} keys were asked for, but only {possible} can be chosen from these frames")]
    TooFewFramesForKeys {
        /// What was asked for.
        keys: usize,
        /// The most that can be chosen together.
        possible: usize,
    },
    /// Every admissible set of frames found has a singular kernel matrix.
    #[error("no {keys} frames differ enough to be keys: their kernel matrix is singular")]
    NoRegularKeys {
        /// What was asked for.
        keys: usize,
    },
    /// A frame number beyond the clip.
    #[error("frame {frame} was named as a key, a partner or to be left out: the clip has frames 0 to {}", frames.saturating_sub(1))]
    KeyFrameOutOfRange {
        /// The frame, counted from 0.
        frame: usize,
        /// Number of frames of the clip.
        frames: usize,
    },
    /// A frame that is both forced and excluded.
    #[error("frame {frame} is both forced and excluded")]
    ForcedKeyExcluded {
        /// The frame, counted from 0.
        frame: usize,
    },
    /// More forced frames than keys.
    #[error("{forced} frames are forced, but only {keys} keys were asked for")]
    TooManyForcedKeys {
        /// Number of forced frames.
        forced: usize,
        /// Number of keys.
        keys: usize,
    },
    /// Two forced frames are closer in time than the minimum spacing.
    #[error("the forced frames {first} and {second} are less than {spacing} frames apart")]
    ForcedKeysTooClose {
        /// The earlier frame.
        first: usize,
        /// The later frame.
        second: usize,
        /// The minimum spacing, frames.
        spacing: usize,
    },
    /// Two keys with the same silhouette as far as the components tell.
    #[error(
        "the keys at frames {first} and {second} coincide: interpolation between them is singular"
    )]
    CoincidingKeys {
        /// One frame.
        first: usize,
        /// The other frame.
        second: usize,
    },
    /// A coefficient that is NaN or infinite.
    #[error("frame {frame}: the coefficient of component {} is not a finite number", component + 1)]
    CoefficientNotFinite {
        /// The frame, counted from 0.
        frame: usize,
        /// The component, counted from 0.
        component: usize,
    },
    /// A setting of key choice or interpolation outside its range.
    #[error("{name} is {value}: it must be {allowed}")]
    KernelSetting {
        /// The setting's name.
        name: &'static str,
        /// What was given.
        value: f64,
        /// What is allowed, in words.
        allowed: &'static str,
    },
    /// No frame can be the partner of a key.
    #[error("key frame {key_frame}: no frame is left that could be its partner")]
    NoPartner {
        /// The key's frame.
        key_frame: usize,
    },
    /// A partner given by the user cannot be used.
    #[error("frame {partner} cannot be the partner of key frame {key_frame}: {reason}")]
    PartnerRefused {
        /// The key's frame.
        key_frame: usize,
        /// The partner's frame.
        partner: usize,
        /// Why not.
        reason: &'static str,
    },
    /// A partner given for a key that does not exist.
    #[error("a partner was named for key {}, but there are {keys} keys", position + 1)]
    PartnerForNoKey {
        /// Position in the list of keys, counted from 0.
        position: usize,
        /// Number of keys.
        keys: usize,
    },
    // ---- interpolate -------------------------------------------------------------------------
    /// A frame that is listed twice among keys and partners.
    #[error("frame {frame} is in the list of keys and partners twice")]
    KeyListedTwice {
        /// The frame, counted from 0.
        frame: usize,
    },
    /// An empty list of keys.
    #[error("the list of keys is empty")]
    NoKeys,
    /// Switching models for a number of keys that cannot be halved.
    #[error(
        "{keys} keys cannot be split into overlapping halves: switching models need an even number"
    )]
    OddKeysForSwitching {
        /// Number of keys.
        keys: usize,
    },
    /// Not one partner for each key.
    #[error("{keys} keys, but {partners} partners: switching models need one partner for each key")]
    PartnerCount {
        /// Number of keys.
        keys: usize,
        /// Number of partners.
        partners: usize,
    },
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
            Error::Interrupted => Some("run the same command again to go on".to_owned()),
            // ---- keys, interpolate
            Error::KeyCountOutOfRange { .. }
            | Error::KeyFrameOutOfRange { .. }
            | Error::KernelSetting { .. }
            | Error::PartnerForNoKey { .. } => None,
            Error::NoKeys => Some("choose keys first (`muybridge keys SHOT`)".to_owned()),
            Error::KeyListedTwice { .. } => Some("list every frame once".to_owned()),
            Error::OddKeysForSwitching { keys } => {
                Some(format!("choose {} keys, or turn switching models off", keys + 1))
            }
            Error::PartnerCount { .. } => {
                Some("let the tool propose partners (`muybridge keys SHOT --partners`)".to_owned())
            }
            Error::TooFewFramesForKeys { possible, .. } => Some(format!(
                "ask for at most {possible} keys, exclude fewer frames, or lower the spacing"
            )),
            Error::NoRegularKeys { .. } => {
                Some("ask for fewer keys, or use more components".to_owned())
            }
            Error::ForcedKeyExcluded { frame } => {
                Some(format!("take frame {frame} off one of the two lists"))
            }
            Error::TooManyForcedKeys { forced, .. } => {
                Some(format!("ask for {forced} keys or more, or force fewer frames"))
            }
            Error::ForcedKeysTooClose { .. } => {
                Some("force only one of them, or lower the spacing".to_owned())
            }
            Error::CoincidingKeys { first, second } => Some(format!(
                "replace frame {first} or {second} by another frame, use more components, or set a ridge above 0"
            )),
            Error::CoefficientNotFinite { .. } => {
                Some("run the analysis again; the coefficients file is damaged".to_owned())
            }
            Error::NoPartner { .. } => Some(
                "use a longer clip, or name the partner yourself (any frame of the other half of the stride)"
                    .to_owned(),
            ),
            Error::PartnerRefused { .. } => Some("name another frame".to_owned()),
        }
    }
}
