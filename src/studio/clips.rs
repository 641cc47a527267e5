//! The clips whose frames are shown, the latest few.

use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use super::footage::Clip;
use super::refusal::Result;
use crate::shot::{Shot, hash_value};

/// Clips kept at a time.
const MOST_CLIPS: usize = 3;

/// Clips, the one used last first.
#[derive(Default)]
pub(super) struct Clips {
    open: Mutex<VecDeque<Arc<Clip>>>,
}

impl Clips {
    /// The clip of a shot; `None` when the shot has no footage. Decoding begins, and `ended` is
    /// called at its end.
    pub(super) fn of(
        &self,
        shot: &Shot,
        ended: impl FnOnce() + Send + 'static,
    ) -> Result<Option<Arc<Clip>>> {
        let Some(version) = footage_version(shot)? else { return Ok(None) };
        let mut open = self.lock();
        let clip = match open.iter().position(|clip| clip.version == version) {
            Some(at) => open.remove(at),
            None => Some(Clip::start(shot.clone(), version, ended)?),
        };
        open.extend(clip.clone());
        open.rotate_right(1);
        let kept = MOST_CLIPS.min(open.len());
        open.drain(kept..).for_each(|old| old.stop());
        drop(open);
        // What cannot be opened is tried again when it is asked for again.
        if let Some(clip) = &clip
            && let Err(refusal) = clip.size()
        {
            self.lock().retain(|c| !Arc::ptr_eq(c, clip));
            return Err(refusal);
        }
        Ok(clip)
    }

    /// A clip that is open already.
    pub(super) fn find(&self, version: &str) -> Option<Arc<Clip>> {
        self.lock().iter().find(|clip| clip.version == version).cloned()
    }

    /// Ends all decoding and removes the pictures.
    pub(super) fn close(&self) {
        for clip in self.lock().drain(..) {
            clip.stop();
        }
    }

    fn lock(&self) -> MutexGuard<'_, VecDeque<Arc<Clip>>> {
        self.open.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// What the pictures of a shot's footage depend on; `None` without footage. Contents are not read:
/// names, lengths and times are enough to tell pictures in a browser's cache apart.
fn footage_version(shot: &Shot) -> Result<Option<String>> {
    let source = &shot.settings.source;
    let Some(from) = &source.from else { return Ok(None) };
    let stamps: Vec<(PathBuf, u64, Option<Duration>)> = shot
        .footage_files()?
        .into_iter()
        .filter_map(|path| {
            let metadata = std::fs::metadata(&path).ok()?;
            let modified = metadata.modified().ok();
            let since = modified.and_then(|t| t.duration_since(std::time::UNIX_EPOCH).ok());
            Some((path, metadata.len(), since))
        })
        .collect();
    let all = (from, &source.frames, source.fps, shot.folder(), stamps);
    let mut version = hash_value(&all);
    version.truncate(32);
    Ok(Some(version))
}
