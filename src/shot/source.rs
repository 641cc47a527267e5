//! Opening what a shot's `[source]` names.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::PoisonError;

use rayon::prelude::*;

use super::Shot;
use super::store::{hash_files, read};
use crate::error::{Error, Result};
use crate::frames::mattes::{self, MatteSpec, Mattes};
use crate::frames::strokes::numbered_files;
use crate::frames::{self, FrameRange, FrameSource, SourceSpec};
use crate::mask::{CroppedMask, Mask};
use crate::synthetic::{Gait, SyntheticFootage, SyntheticSettings};

/// Frames a second of an image sequence of which nothing is said.
pub const DEFAULT_FPS: f64 = 25.0;

/// `synthetic:walk` and so on: the built-in horse.
pub const SYNTHETIC_PREFIX: &str = "synthetic:";

/// What masks are made from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Input {
    /// Footage, segmented by colour; strokes over it are hints.
    Footage,
    /// Ready mattes.
    Mattes,
    /// Sketched strokes are the binary images.
    Strokes,
}

impl Shot {
    /// What masks are made from. Mattes win over everything; strokes are used as they are when
    /// there is no footage, or when there are no rectangles to segment footage by.
    ///
    /// # Errors
    /// [`Error::NoSource`] when the settings name none.
    pub fn input(&self) -> Result<Input> {
        let source = &self.settings.source;
        let rectangles = source.foreground.is_some() && source.background.is_some();
        let sketched = self.strokes_folder().is_some();
        match (&source.from, &source.mattes) {
            (_, Some(_)) => Ok(Input::Mattes),
            (Some(from), None)
                if sketched && !rectangles && !from.starts_with(SYNTHETIC_PREFIX) =>
            {
                Ok(Input::Strokes)
            }
            (Some(_), None) => Ok(Input::Footage),
            (None, None) if sketched => Ok(Input::Strokes),
            (None, None) => Err(Error::NoSource { folder: self.folder().to_owned() }),
        }
    }

    /// The range of frames, where only a part is taken.
    ///
    /// # Errors
    /// [`Error::BadFrameRange`].
    pub fn range(&self) -> Result<Option<FrameRange>> {
        self.settings.source.frames.as_deref().map(str::parse).transpose()
    }

    /// The footage, front to back; `None` when the shot has mattes or strokes only.
    ///
    /// # Errors
    /// As [`frames::open`]; [`Error::UnknownGait`] for a synthetic source of another name.
    pub fn footage(&self) -> Result<Option<Box<dyn FrameSource>>> {
        self.opened_footage(false)
    }

    /// The same with frames [as stored](SourceSpec::as_stored).
    ///
    /// # Errors
    /// As [`footage`](Self::footage).
    pub fn stored_footage(&self) -> Result<Option<Box<dyn FrameSource>>> {
        self.opened_footage(true)
    }

    fn opened_footage(&self, as_stored: bool) -> Result<Option<Box<dyn FrameSource>>> {
        if self.settings.source.from.is_none() {
            return Ok(None);
        }
        if let Some(synthetic) = self.synthetic()? {
            let footage = match self.range()? {
                Some(range) => synthetic.with_range(range.first(), range.last()),
                None => synthetic,
            };
            return Ok(Some(Box::new(footage)));
        }
        let spec = SourceSpec { as_stored, ..self.source_spec()? };
        Ok(Some(Box::new(frames::open(&spec)?)))
    }

    /// The synthetic footage that is the source, with its truth; `None` for other sources. The
    /// pictures of it are drawn once, however often it is asked for.
    ///
    /// # Errors
    /// [`Error::UnknownGait`].
    pub fn synthetic(&self) -> Result<Option<SyntheticFootage>> {
        let Some(name) =
            self.settings.source.from.as_deref().and_then(|f| f.strip_prefix(SYNTHETIC_PREFIX))
        else {
            return Ok(None);
        };
        let gait: Gait = name.parse().map_err(|_| Error::UnknownGait { name: name.to_owned() })?;
        let settings = SyntheticSettings { fps: self.fps(), ..SyntheticSettings::default() };
        // Nothing of it is changed where it is kept, so a panic elsewhere leaves it whole.
        let mut kept = self.synthetic.lock().unwrap_or_else(PoisonError::into_inner);
        let same = |f: &SyntheticFootage| f.gait() == gait && *f.settings() == settings;
        if let Some(footage) = kept.as_ref().filter(|f| same(f)) {
            return Ok(Some(footage.clone()));
        }
        Ok(Some(kept.insert(SyntheticFootage::new(gait, settings)).clone()))
    }

    /// The files the footage is read from, in order; none when the shot has no footage or a
    /// synthetic one.
    ///
    /// # Errors
    /// As [`frames::source_files`].
    pub fn footage_files(&self) -> Result<Vec<PathBuf>> {
        match &self.settings.source.from {
            Some(from) if !from.starts_with(SYNTHETIC_PREFIX) => {
                frames::source_files(&self.source_spec()?)
            }
            _ => Ok(Vec::new()),
        }
    }

    fn source_spec(&self) -> Result<SourceSpec> {
        let source = &self.settings.source;
        let location = self.path(source.from.as_deref().unwrap_or_default());
        let (frames, fps) = (self.range()?, source.fps);
        Ok(SourceSpec { frames, fps, ..SourceSpec::new(location) })
    }

    /// The mattes.
    ///
    /// # Errors
    /// As [`mattes::open`]; [`Error::NoSource`] without any.
    pub fn mattes(&self) -> Result<Mattes> {
        let source = &self.settings.source;
        let Some(folder) = &source.mattes else {
            return Err(Error::NoSource { folder: self.folder().to_owned() });
        };
        mattes::open(&MatteSpec {
            location: self.path(folder),
            frames: self.range()?,
            invert: source.invert_mattes,
            size: None,
        })
    }

    /// Where strokes are: what the settings name, else `strokes/` in the shot when it is there.
    #[must_use]
    pub fn strokes_folder(&self) -> Option<PathBuf> {
        match &self.settings.source.strokes {
            Some(folder) => Some(self.path(folder)),
            // When the last stroke is taken back, its folder stays.
            None => Some(self.path("strokes")).filter(|folder| {
                std::fs::read_dir(folder).is_ok_and(|mut files| files.next().is_some())
            }),
        }
    }

    /// The stroke files with their frame numbers, ascending.
    ///
    /// # Errors
    /// As [`numbered_files`].
    pub fn strokes(&self) -> Result<Vec<(usize, PathBuf)>> {
        self.strokes_folder().map_or(Ok(Vec::new()), |folder| numbered_files(&folder))
    }

    /// Every file that the masks are made from, strokes last; none for the built-in animal.
    ///
    /// # Errors
    /// When a source is missing.
    pub fn source_files(&self) -> Result<Vec<PathBuf>> {
        let mut files = self.filmed_files()?;
        files.extend(self.strokes()?.into_iter().map(|(_, path)| path));
        Ok(files)
    }

    /// A hash of everything the masks are made from.
    ///
    /// # Errors
    /// When a source is missing or cannot be read.
    pub fn source_hash(&self) -> Result<String> {
        hash_files(&self.source_files()?)
    }

    /// The same without the strokes: a hash of what was filmed.
    ///
    /// # Errors
    /// As [`source_hash`](Self::source_hash).
    pub fn footage_hash(&self) -> Result<String> {
        hash_files(&self.filmed_files()?)
    }

    fn filmed_files(&self) -> Result<Vec<PathBuf>> {
        let mut files = Vec::new();
        match self.input()? {
            Input::Mattes => files.extend_from_slice(self.mattes()?.files()),
            Input::Footage if self.synthetic()?.is_none() => {
                files.extend(frames::source_files(&self.source_spec()?)?);
            }
            Input::Footage | Input::Strokes => {}
        }
        Ok(files)
    }

    /// The mask files in the folder, in order; the frames must be 0, 1, 2… without a gap.
    ///
    /// # Errors
    /// [`Error::MaskMissing`] naming the frame.
    pub fn mask_files(&self) -> Result<Vec<PathBuf>> {
        let folder = self.path("masks");
        if !folder.is_dir() {
            return Err(Error::MaskMissing { folder, frame: 0 });
        }
        let numbered = numbered_files(&folder)?;
        for (expected, (frame, _)) in numbered.iter().enumerate() {
            if *frame != expected {
                return Err(Error::MaskMissing { folder, frame: expected });
            }
        }
        Ok(numbered.into_iter().map(|(_, path)| path).collect())
    }

    /// The mask of frame 0, which tells the size of all.
    ///
    /// # Errors
    /// When it is missing or unreadable.
    pub fn first_mask(&self) -> Result<Mask> {
        let path = self.path(&super::paths::mask(0));
        Mask::from_image_bytes(&path, &read(&path)?)
    }

    /// The masks of some frames, by frame.
    ///
    /// # Errors
    /// When one is missing, unreadable, or of another size than that of frame 0.
    pub fn some_masks(&self, frames: &[usize]) -> Result<BTreeMap<usize, Mask>> {
        let files = self.mask_files()?;
        let first = self.first_mask()?;
        let expected = (first.width(), first.height());
        let one = |&frame: &usize| {
            let path = files
                .get(frame)
                .ok_or_else(|| Error::MaskMissing { folder: self.path("masks"), frame })?;
            let mask = Mask::from_image_bytes(path, &read(path)?)?;
            let found = (mask.width(), mask.height());
            if found == expected {
                Ok((frame, mask))
            } else {
                Err(Error::MaskSize { frame, found, expected })
            }
        };
        frames.iter().map(one).collect()
    }

    /// All masks.
    ///
    /// # Errors
    /// When one is missing, unreadable, or of another size than the first.
    pub fn masks(&self) -> Result<Vec<CroppedMask>> {
        let one = |path: &PathBuf| -> Result<CroppedMask> {
            Ok(CroppedMask::from(&Mask::from_image_bytes(path, &read(path)?)?))
        };
        let files = self.mask_files()?;
        // Kept in order, so that of several bad files the first is named.
        let read: Vec<Result<CroppedMask>> = files.par_iter().map(one).collect();
        let masks: Vec<CroppedMask> = read.into_iter().collect::<Result<_>>()?;
        let size = |mask: &CroppedMask| (mask.width(), mask.height());
        if let Some(expected) = masks.first().map(size)
            && let Some(frame) = masks.iter().position(|m| size(m) != expected)
        {
            return Err(Error::MaskSize { frame, found: size(&masks[frame]), expected });
        }
        Ok(masks)
    }
}
