//! The version of a file is the BLAKE3 hash of its content. Hashes are kept as long as the file's
//! length and times stay.

use std::collections::BTreeMap;
use std::fs::Metadata;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::SystemTime;

use crate::error::Result;
use crate::shot::hash_file;

/// What tells whether a file may have changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Stamp {
    bytes: u64,
    modified: Option<SystemTime>,
    /// File number and time of the last change of any kind, where the system has them.
    identity: (u64, i64, i64),
}

#[cfg(unix)]
fn identity(metadata: &Metadata) -> (u64, i64, i64) {
    use std::os::unix::fs::MetadataExt;
    (metadata.ino(), metadata.ctime(), metadata.ctime_nsec())
}

#[cfg(not(unix))]
fn identity(_metadata: &Metadata) -> (u64, i64, i64) {
    (0, 0, 0)
}

/// Hashes of files, remembered.
#[derive(Debug, Default)]
pub(super) struct Versions {
    known: Mutex<BTreeMap<PathBuf, (Stamp, String)>>,
}

impl Versions {
    /// The version of a file; empty when there is none.
    pub(super) fn of(&self, path: &Path) -> Result<String> {
        let Ok(metadata) = std::fs::metadata(path) else { return Ok(String::new()) };
        if !metadata.is_file() {
            return Ok(String::new());
        }
        let stamp = Stamp {
            bytes: metadata.len(),
            modified: metadata.modified().ok(),
            identity: identity(&metadata),
        };
        let known = |versions: &Self| {
            let known = versions.known.lock().unwrap_or_else(PoisonError::into_inner);
            known.get(path).filter(|(s, _)| *s == stamp).map(|(_, version)| version.clone())
        };
        if let Some(version) = known(self) {
            return Ok(version);
        }
        let version = hash_file(path)?;
        let mut known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        known.insert(path.to_owned(), (stamp, version.clone()));
        Ok(version)
    }
}

/// The version of a file as it is at this moment; empty when there is none.
pub(super) fn now(path: &Path) -> Result<String> {
    if path.is_file() { hash_file(path) } else { Ok(String::new()) }
}
