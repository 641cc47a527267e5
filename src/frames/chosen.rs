//! The part `A-B` of a source.

use std::path::{Path, PathBuf};

use super::{FrameRange, FrameSource};
use crate::error::{Error, Result};
use crate::image::{Frame, Picture};

fn outside(location: &Path, range: FrameRange, available: usize) -> Error {
    Error::FrameRangeOutside {
        location: location.to_owned(),
        first: range.first,
        last: range.last,
        available,
    }
}

/// The chosen ones of a sequence's files.
pub(super) fn files(
    location: &Path,
    mut files: Vec<PathBuf>,
    range: Option<FrameRange>,
) -> Result<Vec<PathBuf>> {
    let Some(range) = range else { return Ok(files) };
    if range.last >= files.len() {
        return Err(outside(location, range, files.len()));
    }
    files.truncate(range.last + 1);
    Ok(files.split_off(range.first))
}

/// Frames `A-B` of a source that can only be read from its start: those before `A` are decoded
/// and dropped, those after `B` not asked for.
pub(super) struct Chosen<S> {
    inner: S,
    location: PathBuf,
    range: Option<FrameRange>,
    /// Frames taken from `inner` so far.
    read: usize,
}

impl<S: FrameSource> Chosen<S> {
    pub(super) fn new(inner: S, location: &Path, range: Option<FrameRange>) -> Result<Self> {
        if let (Some(range), Some(count)) = (range, inner.frame_count())
            && range.last >= count
        {
            return Err(outside(location, range, count));
        }
        Ok(Self { inner, location: location.to_owned(), range, read: 0 })
    }

    fn step(&mut self, range: FrameRange) -> Result<Frame> {
        let frame =
            self.inner.next_stored()?.ok_or_else(|| outside(&self.location, range, self.read))?;
        self.read += 1;
        Ok(frame)
    }
}

impl<S: FrameSource> FrameSource for Chosen<S> {
    fn width(&self) -> usize {
        self.inner.width()
    }

    fn height(&self) -> usize {
        self.inner.height()
    }

    fn fps(&self) -> Option<f64> {
        self.inner.fps()
    }

    fn frame_count(&self) -> Option<usize> {
        self.range.map(FrameRange::count).or(self.inner.frame_count())
    }

    fn next_frame(&mut self) -> Result<Option<Picture>> {
        Ok(self.next_stored()?.map(Frame::into_rgb))
    }

    fn next_stored(&mut self) -> Result<Option<Frame>> {
        let Some(range) = self.range else { return self.inner.next_stored() };
        while self.read < range.first {
            self.step(range)?;
        }
        if self.read > range.last { Ok(None) } else { self.step(range).map(Some) }
    }
}
