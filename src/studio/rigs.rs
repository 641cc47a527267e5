//! Rigs: their bytes for the page to draw, and what the pipeline reads in them.

use std::collections::BTreeSet;
use std::fs::File as OsFile;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use axum::response::Response;
use serde_json::{Value, json};

use super::answer;
use super::refusal::{Refusal, Result};
use super::root::Root;
use crate::error::Error;
use crate::rig::File;

/// Largest rig, or file beside one, that is sent.
const MOST_BYTES: u64 = 512 << 20;

/// Files that rigs the page has opened refer to: nothing else beside a rig is sent.
#[derive(Debug, Default)]
pub(super) struct Rigs {
    named: Mutex<BTreeSet<PathBuf>>,
}

impl Rigs {
    /// The bytes of a rig, or of a file that a rig sent before refers to.
    pub(super) fn bytes(&self, root: &Root, name: &str) -> Result<Response> {
        let path = root.existing(name)?;
        if is_rig(&path) {
            let bytes = read(&path)?;
            self.remember(root, &path, &bytes);
            return Ok(answer::bytes(bytes, answer::content_type(name)));
        }
        if !self.named.lock().unwrap_or_else(PoisonError::into_inner).contains(&path) {
            return Err(Refusal::forbidden(format!("{name} is no part of a rig that was opened")));
        }
        Ok(answer::bytes(read(&path)?, answer::content_type(name)))
    }

    fn remember(&self, root: &Root, path: &Path, bytes: &[u8]) {
        // What the reader refuses has no files the page could use.
        let Ok(file) = checked(root, path, bytes.to_vec()) else { return };
        let folder = path.parent().unwrap_or(root.folder());
        let mut named = self.named.lock().unwrap_or_else(PoisonError::into_inner);
        let inside = file.referenced_files().into_iter().map(|f| folder.join(f));
        named.extend(inside.filter_map(|f| std::fs::canonicalize(f).ok()));
    }
}

/// The clips, with the times of their keys, as the pipeline reads them.
pub(super) fn clips(root: &Root, name: &str) -> Result<Value> {
    let path = root.existing(name)?;
    let file = checked(root, &path, read(&path)?)?;
    let mut clips = Vec::new();
    for name in file.animation_names() {
        let clip = match file.animation(&name) {
            Ok(animation) => json!({
                "name": name, "duration_s": animation.duration_s(), "frames": animation.key_times_s(),
            }),
            // Two clips of one name cannot be told apart in a shot's settings either.
            Err(Error::AnimationAmbiguous { .. }) => continue,
            Err(error) => return Err(error.into()),
        };
        clips.push(clip);
    }
    let meshes = match file.model() {
        Ok(model) => model.meshes.len(),
        // Meshes that are compressed, say, cannot be looked at, but the rig can be animated.
        Err(Error::RigUnsupported { .. }) => {
            file.document().get("meshes").and_then(Value::as_array).map_or(0, Vec::len)
        }
        Err(error) => return Err(error.into()),
    };
    Ok(json!({"clips": clips, "joints": file.joints()?.len(), "meshes": meshes}))
}

/// Passes a rig that can be read.
pub(super) fn check(root: &Root, path: &Path) -> Result<()> {
    checked(root, path, read(path)?).map(|_| ())
}

/// Reads a rig of which every part is inside the root.
fn checked(root: &Root, path: &Path, bytes: Vec<u8>) -> Result<File> {
    let folder = path.parent().unwrap_or(root.folder());
    for part in crate::rig::referenced_files(path, &bytes)? {
        let part = folder.join(part);
        // What is not there is reported by the reader; what is no plain file would never end.
        if part.exists() && !(part.is_file() && root.holds(&part)) {
            return Err(Refusal::forbidden(
                "a part of this rig lies outside the folder the studio was opened on",
            ));
        }
    }
    Ok(File::from_bytes(path, bytes)?)
}

fn is_rig(path: &Path) -> bool {
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default();
    ["glb", "gltf"].iter().any(|known| extension.eq_ignore_ascii_case(known))
}

fn read(path: &Path) -> Result<Vec<u8>> {
    if !path.is_file() {
        return Err(Refusal::not_found("this is not a file"));
    }
    let mut bytes = Vec::new();
    let file = OsFile::open(path).map_err(Error::io(path, "read"))?;
    file.take(MOST_BYTES + 1).read_to_end(&mut bytes).map_err(Error::io(path, "read"))?;
    if bytes.len() as u64 > MOST_BYTES {
        return Err(Refusal::too_large("the file is larger than half a gigabyte"));
    }
    Ok(bytes)
}
