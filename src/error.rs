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

    // ---- rig ---------------------------------------------------------------------------------
    /// A rig file breaks the glTF 2.0 specification in a way that leaves its content unknown.
    #[error("{}: {place}: {reason}", path.display())]
    RigBroken {
        /// The glTF or GLB file.
        path: PathBuf,
        /// The part of the file: "accessor 12", "animation 3, channel 0".
        place: String,
        /// What is wrong with it.
        reason: String,
    },
    /// A rig file uses a valid feature that is not read here.
    #[error("{}: {what} cannot be read", path.display())]
    RigUnsupported {
        /// The glTF or GLB file.
        path: PathBuf,
        /// The feature, with its place.
        what: String,
        /// How to save the file without it, an imperative sentence.
        remedy: &'static str,
    },
    /// A rig file names a buffer file that cannot be read.
    #[error("{}: buffer {buffer} is in {}, which cannot be read: {source}", path.display(), file.display())]
    RigBuffer {
        /// The glTF or GLB file.
        path: PathBuf,
        /// Index of the buffer in the file.
        buffer: usize,
        /// The file that should hold the buffer.
        file: PathBuf,
        /// The operating system's reason.
        source: std::io::Error,
    },
    /// No animation of a rig file has the name asked for.
    #[error("{}: no animation named \"{name}\"; the file has {}", path.display(), quoted(available))]
    AnimationNotFound {
        /// The glTF or GLB file.
        path: PathBuf,
        /// The name asked for.
        name: String,
        /// The names in the file.
        available: Vec<String>,
    },
    /// Several animations of a rig file answer to the name asked for.
    #[error("{}: \"{name}\" names several animations: {}", path.display(), quoted(matches))]
    AnimationAmbiguous {
        /// The glTF or GLB file.
        path: PathBuf,
        /// The name asked for.
        name: String,
        /// The full names that match.
        matches: Vec<String>,
    },
    /// An animation drives a node whose transform is given as a matrix, which glTF forbids.
    #[error("{}: node \"{node}\" has a matrix, so it cannot be animated", path.display())]
    MatrixNodeDriven {
        /// The glTF or GLB file.
        path: PathBuf,
        /// Name of the node.
        node: String,
    },
    /// An animation of a rig file is too long to be sampled.
    #[error("the animation \"{name}\" lasts {duration_s} s, too long to be sampled")]
    AnimationTooLong {
        /// The animation's name.
        name: String,
        /// Time of its last key, seconds.
        duration_s: f64,
    },
    /// A pose was asked for at a time its clip does not reach.
    #[error(
        "key {key}: {time_s:.4} s is outside the clip \"{clip}\", which ends at {duration_s:.4} s"
    )]
    PoseOutsideClip {
        /// Number of the key image, from 1.
        key: usize,
        /// Name of the clip.
        clip: String,
        /// The time asked for, seconds.
        time_s: f64,
        /// The end of the clip, seconds.
        duration_s: f64,
    },
    /// A pose was not given in the form `KEY=CLIP#FRAME` or `KEY=CLIP@SECONDS`.
    #[error("\"{text}\" does not name a pose")]
    PoseForm {
        /// What was given.
        text: String,
    },
    /// The poses do not cover the keys 1 to K once each.
    #[error("of the {keys} poses, {count} are for key {key}")]
    PoseKeys {
        /// How many poses were given.
        keys: usize,
        /// The key with no pose, or with more than one.
        key: usize,
        /// How many poses it has.
        count: usize,
    },

    // ---- interpolate/blend -------------------------------------------------------------------
    /// A weight is NaN or infinite.
    #[error("frame {frame}: the weight of key {key} is not a finite number")]
    WeightNotFinite {
        /// Frame of the clip, from 0.
        frame: usize,
        /// Number of the key, from 1.
        key: usize,
    },

    // ---- export ------------------------------------------------------------------------------
    /// A clip drives no channel of any node, so there is no animation to write.
    #[error("the animation \"{name}\" drives no node")]
    NothingDriven {
        /// Name of the animation.
        name: String,
    },
    /// The result would not fit the 4 GiB that a GLB file can hold.
    #[error("{}: with the animation the file would have {bytes} bytes, over the limit of GLB", path.display())]
    GlbTooLarge {
        /// The artist's file.
        path: PathBuf,
        /// Size the file would have.
        bytes: u64,
    },
}

/// The names in quotes, separated by commas; "none" when there are none.
fn quoted(names: &[String]) -> String {
    if names.is_empty() {
        return "none".to_owned();
    }
    names.iter().map(|n| format!("\"{n}\"")).collect::<Vec<_>>().join(", ")
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

            // ---- rig
            Error::RigBroken { .. } => Some(
                "open the file in the program that made it and export it again, or run the Khronos glTF validator on it".to_owned(),
            ),
            Error::RigUnsupported { remedy, .. } => Some((*remedy).to_owned()),
            Error::RigBuffer { .. } => Some(
                "keep the .bin files where the .gltf expects them, or export the rig as one .glb file".to_owned(),
            ),
            Error::AnimationNotFound { .. } => {
                Some("name one of the file's animations, or the part of its name after the last \"|\"".to_owned())
            }
            Error::AnimationAmbiguous { .. } => {
                Some("give the full name, and rename animations that share one".to_owned())
            }
            Error::MatrixNodeDriven { .. } => Some(
                "export the node with translation, rotation and scale instead of a matrix".to_owned(),
            ),
            Error::AnimationTooLong { .. } => {
                Some("check the times of the animation's keys, or take a lower frame rate".to_owned())
            }
            Error::PoseOutsideClip { .. } => Some(
                "frames count from 0 at the shot's frame rate; check the rate, or give the time in seconds".to_owned(),
            ),
            Error::PoseForm { .. } => Some(
                "write KEY=CLIP#FRAME or KEY=CLIP@SECONDS, for example 1=KeyPoses#1 or 2=Walk@0.25".to_owned(),
            ),
            Error::PoseKeys { .. } => Some("give exactly one pose for each key, numbered from 1".to_owned()),

            // ---- interpolate/blend
            Error::WeightNotFinite { .. } => None,

            // ---- export
            Error::NothingDriven { .. } => {
                Some("pose the rig in a clip that has channels for its bones".to_owned())
            }
            Error::GlbTooLarge { .. } => {
                Some("save the rig as .gltf with separate buffers, or shrink its textures".to_owned())
            }
        }
    }
}
