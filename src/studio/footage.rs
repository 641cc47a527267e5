//! Frames of the footage, fast enough to scrub: a clip is decoded once, forward, into a bounded
//! folder of JPEGs outside the shot, which goes when the studio ends. A frame that is far ahead of
//! the decoder is sought.

use std::num::NonZeroU32;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use rayon::prelude::*;
use tempfile::TempDir;

use super::jpeg;
use super::refusal::{Refusal, Result};
use crate::error::Error;
use crate::frames::FrameRange;
use crate::image::Picture;
use crate::shot::Shot;

/// Bytes of pictures kept of one clip. A 1080p frame takes .3 to .9 MB, so this is over 2000 frames;
/// what does not fit is sought.
const MOST_BYTES: u64 = 2 << 30;

/// A frame at most this far ahead of the decoder is waited for: seeking costs as much as decoding
/// some frames, and in a compressed video more.
const WAIT_FRAMES: usize = 24;

/// How long the decoder is waited for.
const PATIENCE: Duration = Duration::from_secs(20);

/// Frames encoded at a time, each on a thread.
const MOST_TOGETHER: usize = 8;

/// Footage on its way to pictures.
pub(super) struct Clip {
    shot: Shot,
    pub(super) version: String,
    folder: TempDir,
    state: Mutex<State>,
    changed: Condvar,
    stopped: AtomicBool,
}

/// What is known so far.
#[derive(Clone, Debug, Default)]
struct State {
    /// Width and height, pixels.
    size: Option<(usize, usize)>,
    /// All frames before this one have been decoded.
    decoded: usize,
    /// All frames before this one are in the folder.
    stored: usize,
    /// Number of frames.
    total: Option<usize>,
    /// Bytes in the folder.
    bytes: u64,
    /// The decoder has come to its end.
    ended: bool,
    /// Why the footage could not be read on.
    failed: Option<Refusal>,
}

impl Clip {
    /// Begins to decode; `ended` is called when all frames are there.
    pub(super) fn start(
        shot: Shot,
        version: String,
        ended: impl FnOnce() + Send + 'static,
    ) -> Result<Arc<Self>> {
        let folder = tempfile::Builder::new().prefix("muybridge-studio-").tempdir();
        let clip = Arc::new(Self {
            shot,
            version,
            folder: folder.map_err(Error::io(&std::env::temp_dir(), "write in"))?,
            state: Mutex::default(),
            changed: Condvar::new(),
            stopped: AtomicBool::new(false),
        });
        let decoder = Arc::clone(&clip);
        let thread = std::thread::Builder::new().name("footage".to_owned());
        let started = thread.spawn(move || {
            let failed = decoder.decode().err();
            decoder.update(|state| {
                state.ended = true;
                state.failed = failed;
                // What follows a damaged frame is never read by any stage.
                state.total = Some(state.decoded);
            });
            ended();
        });
        started.map_err(|_| Refusal::defect())?;
        Ok(clip)
    }

    /// Ends the decoding.
    pub(super) fn stop(&self) {
        self.stopped.store(true, Ordering::SeqCst);
        self.changed.notify_all();
    }

    /// Width and height of the frames, pixels.
    pub(super) fn size(&self) -> Result<(usize, usize)> {
        let state = self.wait(PATIENCE, |state| state.size.is_some());
        state.size.ok_or_else(|| state.failed.unwrap_or_else(too_slow))
    }

    /// Number of frames, or of those decoded so far, and whether these are all. A clip that does not
    /// say how long it is is waited for.
    pub(super) fn frames(&self, patience: Duration) -> (usize, bool) {
        let state = self.wait(patience, |state| state.total.is_some());
        (state.total.unwrap_or(state.decoded), state.total.is_some())
    }

    /// A frame as JPEG, reduced to a width.
    pub(super) fn picture(&self, frame: usize, width: Option<NonZeroU32>) -> Result<Vec<u8>> {
        let (full_width, _) = self.size()?;
        let narrow = width.filter(|w| (w.get() as usize) < full_width);
        let Some(width) = narrow else { return self.full(frame) };
        let kept = self.file(frame, Some(width));
        if let Ok(bytes) = std::fs::read(&kept) {
            return Ok(bytes);
        }
        let bytes = jpeg::narrowed(&self.full(frame)?, width)?;
        self.keep(&kept, &bytes);
        Ok(bytes)
    }

    fn full(&self, frame: usize) -> Result<Vec<u8>> {
        let state = self.lock().clone();
        let sought = match frame < state.decoded {
            true => frame >= state.stored,
            false => frame > state.decoded + WAIT_FRAMES || state.bytes >= MOST_BYTES,
        };
        if state.total.is_some_and(|total| frame >= total) {
            return Err(Refusal::not_found(format!("the footage has no frame {frame}")));
        }
        if !sought {
            let state = self.wait(PATIENCE, |state| state.decoded > frame);
            if frame < state.stored
                && let Ok(bytes) = std::fs::read(self.file(frame, None))
            {
                return Ok(bytes);
            }
            if state.ended && frame >= state.decoded {
                let missing = || Refusal::not_found(format!("the footage has no frame {frame}"));
                return Err(state.failed.unwrap_or_else(missing));
            }
        }
        jpeg::encoded(&self.seek(frame)?)
    }

    /// Reads one frame by itself.
    fn seek(&self, frame: usize) -> Result<Picture> {
        let first = self.shot.range()?.map_or(0, FrameRange::first);
        let mut shot = self.shot.clone();
        let at = frame.saturating_add(first);
        shot.settings.source.frames = Some(format!("{at}-{at}"));
        let picture = shot.footage()?.map(|mut footage| footage.next_frame()).transpose()?;
        picture
            .flatten()
            .ok_or_else(|| Refusal::not_found(format!("the footage has no frame {frame}")))
    }

    /// Frames are encoded in parallel, a few at a time, and stored in order.
    fn decode(&self) -> Result<()> {
        let Some(mut footage) = self.shot.footage()? else { return Ok(()) };
        self.update(|state| {
            state.size = Some((footage.width(), footage.height()));
            state.total = footage.frame_count();
        });
        let together = rayon::current_num_threads().clamp(1, MOST_TOGETHER);
        while !self.stopped.load(Ordering::SeqCst) {
            let mut batch: Vec<Picture> = Vec::with_capacity(together);
            let mut failed = None;
            while batch.len() < together && failed.is_none() {
                match footage.next_frame() {
                    Ok(Some(picture)) => batch.push(picture),
                    Ok(None) => break,
                    Err(error) => failed = Some(error),
                }
            }
            let ended = batch.len() < together;
            self.store(&batch)?;
            match failed {
                Some(error) => return Err(error.into()),
                None if ended => break,
                None => {}
            }
        }
        Ok(())
    }

    fn store(&self, batch: &[Picture]) -> Result<()> {
        let State { decoded, stored, bytes, .. } = *self.lock();
        let mut kept = 0;
        // Once a frame has not been kept, none after it is.
        if bytes < MOST_BYTES && stored == decoded {
            let pictures = batch.par_iter().map(jpeg::encoded).collect::<Result<Vec<_>>>()?;
            for (at, picture) in pictures.iter().enumerate() {
                if !self.keep(&self.file(decoded + at, None), picture) {
                    break;
                }
                kept += 1;
            }
        }
        self.update(|state| {
            state.decoded += batch.len();
            state.stored += kept;
        });
        Ok(())
    }

    /// Puts a picture into the folder, if there is room; a full disk is no reason to fail.
    fn keep(&self, path: &Path, bytes: &[u8]) -> bool {
        let length = bytes.len() as u64;
        if self.lock().bytes + length > MOST_BYTES {
            return false;
        }
        if crate::shot::write_atomically(path, bytes).is_err() {
            return false;
        }
        self.lock().bytes += length;
        true
    }

    fn file(&self, frame: usize, width: Option<NonZeroU32>) -> PathBuf {
        let width = width.map_or_else(|| "full".to_owned(), |w| w.to_string());
        self.folder.path().join(width).join(format!("{frame:06}.jpg"))
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn update(&self, change: impl FnOnce(&mut State)) {
        change(&mut self.lock());
        self.changed.notify_all();
    }

    /// What is known when `enough` is, the decoder has ended, or patience has.
    fn wait(&self, patience: Duration, enough: impl Fn(&State) -> bool) -> State {
        let until = Instant::now() + patience;
        let mut state = self.lock();
        while !(enough(&state) || state.ended || self.stopped.load(Ordering::SeqCst)) {
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() {
                break;
            }
            let woken = self.changed.wait_timeout(state, left);
            state = woken.unwrap_or_else(PoisonError::into_inner).0;
        }
        state.clone()
    }
}

fn too_slow() -> Refusal {
    let sentence = "the footage takes too long to read";
    Refusal::new(axum::http::StatusCode::SERVICE_UNAVAILABLE, sentence)
}
