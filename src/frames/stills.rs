//! An image sequence as a frame source.

use std::collections::BTreeMap;
use std::path::PathBuf;

use super::fields::{self, LookedAt};
use super::{FrameSource, decode};
use crate::error::{Error, Result};
use crate::image::Picture;

/// Picture files read one after the other.
pub(super) struct Stills {
    files: Vec<PathBuf>,
    /// Number of `files[0]` in the whole sequence, for messages.
    first: usize,
    /// Next of `files` to give out.
    next: usize,
    size: (usize, usize),
    /// `files[0]`, decoded when the source was opened.
    opening: Option<Picture>,
    /// Pictures that are decoded already, by their numbers in the whole sequence.
    decoded: BTreeMap<usize, Picture>,
    /// Whether the first of two fields is given instead of the frames.
    interlaced: bool,
}

impl Stills {
    /// Opens `files`, of which the first is frame `first` of the whole sequence, and decodes it.
    /// Of interlaced pictures only the first field is given.
    pub(super) fn open(files: Vec<PathBuf>, first: usize, seen: LookedAt) -> Result<Self> {
        let Some(path) = files.first() else {
            return Err(Error::NoPictures { location: PathBuf::new(), ignored: 0 });
        };
        let opening = Picture::from_dynamic(&decode::decode(path, first)?);
        let size = (opening.width(), opening.height());
        let LookedAt { interlaced, pictures: decoded } = seen;
        Ok(Self { files, first, next: 0, size, opening: Some(opening), decoded, interlaced })
    }
}

impl FrameSource for Stills {
    fn width(&self) -> usize {
        self.size.0
    }

    fn height(&self) -> usize {
        self.size.1
    }

    fn fps(&self) -> Option<f64> {
        None
    }

    fn frame_count(&self) -> Option<usize> {
        Some(self.files.len())
    }

    fn next_frame(&mut self) -> Result<Option<Picture>> {
        let Some(path) = self.files.get(self.next) else { return Ok(None) };
        let frame = self.first + self.next;
        let picture = match self.opening.take() {
            Some(picture) => picture,
            None => {
                let picture = match self.decoded.remove(&frame) {
                    Some(picture) => picture,
                    None => Picture::from_dynamic(&decode::decode(path, frame)?),
                };
                let size = (picture.width(), picture.height());
                decode::check_same_size(path, frame, size, self.size)?;
                picture
            }
        };
        self.next += 1;
        let field = self.interlaced.then(|| fields::first_field(&picture)).flatten();
        Ok(Some(field.unwrap_or(picture)))
    }

    fn skip_frame(&mut self) -> Result<bool> {
        let any = self.next < self.files.len();
        self.opening = None;
        self.decoded.remove(&(self.first + self.next));
        self.next += usize::from(any);
        Ok(any)
    }
}
