//! Where pictures come from: image sequences, video through ffmpeg, mattes and strokes.
//!
//! [`open`] takes a folder of images, a glob (`dir/*.png`), a printf pattern
//! (`dir/img_%04d.png`), an animated GIF or a video file, and gives [`Footage`], read front to
//! back. Frames are numbered from 0 in the order they are read, whatever numbers their file names
//! carry. What kind of picture a file holds is told by its first bytes, not by its name.
//!
//! What is odd about the footage but no reason to stop (gaps in the numbering, files left out, a
//! variable frame rate) comes as a list of [`Finding`]s.

mod ahead;
mod chosen;
mod complete;
mod decode;
mod ffmpeg;
mod fields;
mod finding;
mod gif;
mod location;
pub mod mattes;
mod natural;
mod openexr;
mod stills;
pub mod strokes;
mod tiff_float;

use std::path::{Path, PathBuf};
use std::str::FromStr;

pub use ahead::{Ahead, read_ahead};
pub use decode::{MAX_PIXELS, MAX_SIDE_PX};
pub use ffmpeg::{Ffmpeg, MovieWriter, VideoInfo};
pub use finding::Finding;
#[cfg(feature = "studio")]
pub(crate) use natural::compare as natural_order;

use crate::error::{Error, Result};
use crate::image::{Frame, Picture};
use location::Located;

/// Footage read front to back, one frame in memory at a time.
pub trait FrameSource {
    /// Width of every frame, pixels.
    fn width(&self) -> usize;
    /// Height of every frame, pixels.
    fn height(&self) -> usize;
    /// Frames a second, where the source says so (video, GIF); `None` for plain image sequences.
    fn fps(&self) -> Option<f64>;
    /// Number of frames, where it is known before reading.
    fn frame_count(&self) -> Option<usize>;
    /// The next frame, or `None` after the last.
    ///
    /// # Errors
    /// When the frame cannot be read, is damaged, or has another size than the first.
    fn next_frame(&mut self) -> Result<Option<Picture>>;
    /// The next frame in the form its source holds it, for readers that look colours up and need no
    /// conversion. Only a video opened [as stored](SourceSpec::as_stored) holds luma and chroma.
    ///
    /// # Errors
    /// As [`next_frame`](Self::next_frame).
    fn next_stored(&mut self) -> Result<Option<Frame>> {
        Ok(self.next_frame()?.map(Frame::Rgb))
    }
    /// Passes the next frame over; `false` after the last. Sources that can do so do not decode it,
    /// and say nothing about what is wrong with it.
    ///
    /// # Errors
    /// As [`next_frame`](Self::next_frame).
    fn skip_frame(&mut self) -> Result<bool> {
        Ok(self.next_stored()?.is_some())
    }
    /// What was noticed about the source, in words.
    fn findings(&self) -> Vec<String> {
        Vec::new()
    }
}

/// Frames `first ..= last` of a source, counted from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameRange {
    first: usize,
    last: usize,
}

impl FrameRange {
    /// Frames `first ..= last`.
    ///
    /// # Errors
    /// [`Error::BadFrameRange`] when `last` comes before `first`.
    pub fn new(first: usize, last: usize) -> Result<Self> {
        if first <= last && last < usize::MAX {
            Ok(Self { first, last })
        } else {
            Err(Error::BadFrameRange { text: format!("{first}-{last}") })
        }
    }

    /// First frame, from 0.
    #[must_use]
    pub fn first(self) -> usize {
        self.first
    }

    /// Last frame, inclusive.
    #[must_use]
    pub fn last(self) -> usize {
        self.last
    }

    /// Number of frames, at least 1.
    #[must_use]
    pub fn count(self) -> usize {
        self.last - self.first + 1
    }
}

impl FromStr for FrameRange {
    type Err = Error;

    /// Reads `A-B`, or `A` for a single frame.
    fn from_str(text: &str) -> Result<Self> {
        let bad = || Error::BadFrameRange { text: text.to_owned() };
        let number = |s: &str| s.trim().parse::<usize>().map_err(|_| bad());
        let (first, last) = text.split_once('-').unwrap_or((text, text));
        Self::new(number(first)?, number(last)?).map_err(|_| bad())
    }
}

impl std::fmt::Display for FrameRange {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}-{}", self.first, self.last)
    }
}

/// Which footage to read, and which part of it.
#[derive(Clone, Debug, PartialEq)]
pub struct SourceSpec {
    /// A folder, a glob, a printf pattern, an animated GIF or a video file. What exists under this
    /// very name is taken as it is; only then is the text tried as a pattern.
    pub location: PathBuf,
    /// The part to read; `None` is all of it.
    pub frames: Option<FrameRange>,
    /// Frames a second the footage is said to have, finite and above zero. It replaces the rate
    /// the source states; it never changes which frames are read.
    pub fps: Option<f64>,
    /// Whether video that is stored as 8-bit luma and chroma, 4:2:0, is handed over so, to be
    /// converted here ([`YuvConversion`](crate::image::YuvConversion)) if at all, instead of by
    /// ffmpeg. Other sources take no notice.
    pub as_stored: bool,
}

impl SourceSpec {
    /// All of the footage at `location`, at its own rate.
    #[must_use]
    pub fn new(location: impl Into<PathBuf>) -> Self {
        Self { location: location.into(), frames: None, fps: None, as_stored: false }
    }
}

/// Opened footage: a [`FrameSource`] and what is known about it.
pub struct Footage {
    source: Box<dyn FrameSource>,
    fps: Option<f64>,
    findings: Vec<Finding>,
    video: Option<VideoInfo>,
}

impl Footage {
    /// What is odd about the footage, in the order it was noticed.
    #[must_use]
    pub fn findings(&self) -> &[Finding] {
        &self.findings
    }

    /// What the video file says about itself; `None` for images.
    #[must_use]
    pub fn video(&self) -> Option<&VideoInfo> {
        self.video.as_ref()
    }
}

impl FrameSource for Footage {
    fn width(&self) -> usize {
        self.source.width()
    }

    fn height(&self) -> usize {
        self.source.height()
    }

    fn fps(&self) -> Option<f64> {
        self.fps.or(self.source.fps())
    }

    fn frame_count(&self) -> Option<usize> {
        self.source.frame_count()
    }

    fn next_frame(&mut self) -> Result<Option<Picture>> {
        self.source.next_frame()
    }

    fn next_stored(&mut self) -> Result<Option<Frame>> {
        self.source.next_stored()
    }

    fn skip_frame(&mut self) -> Result<bool> {
        self.source.skip_frame()
    }

    fn findings(&self) -> Vec<String> {
        self.findings.iter().map(ToString::to_string).collect()
    }
}

/// Opens footage. The first frame is decoded at once, so that what is wrong with the whole source
/// shows here.
///
/// # Errors
/// Every `Error` of the section "frames": nothing there, no pictures, a bad pattern, rate or
/// range, a file that is empty, cut short, too large or not decodable, ffmpeg missing, no video in
/// the file.
pub fn open(spec: &SourceSpec) -> Result<Footage> {
    open_with(spec, Ffmpeg::begin)
}

/// [`open`], with the search for ffmpeg as an argument: it is called for video files only.
fn open_with(spec: &SourceSpec, find: impl FnOnce(&Path) -> Result<Ffmpeg>) -> Result<Footage> {
    if let Some(fps) = spec.fps {
        check_rate(fps)?;
    }
    let (source, findings, video): (Box<dyn FrameSource>, _, _) =
        match location::locate(&spec.location)? {
            Located::Stills(sequence) => {
                let first = spec.frames.map_or(0, FrameRange::first);
                // Told from the whole sequence, so that a frame looks the same in every part of it.
                let seen = fields::look(&sequence.files);
                let files = chosen::files(&spec.location, sequence.files, spec.frames)?;
                let mut findings = sequence.findings;
                if seen.interlaced {
                    findings.push(Finding::Interlaced { path: spec.location.clone() });
                }
                (Box::new(stills::Stills::open(files, first, seen)?), findings, None)
            }
            Located::Gif(path) => {
                let gif = gif::AnimatedGif::open(&path)?;
                let findings = gif.findings();
                (Box::new(chosen::Chosen::new(gif, &path, spec.frames)?), findings, None)
            }
            Located::Video(path) => {
                let ffmpeg = find(&path)?;
                let video = ffmpeg::Video::open(&ffmpeg, &path, spec.frames, spec.as_stored)?;
                let (findings, info) = (video.findings(), video.info().clone());
                (Box::new(chosen::Chosen::new(video, &path, spec.frames)?), findings, Some(info))
            }
        };
    Ok(Footage { source, fps: spec.fps, findings, video })
}

/// Every file that reading this footage reads, in the order of reading: the chosen pictures, or
/// the one GIF or video file. Pixels are not looked at.
///
/// # Errors
/// When nothing is there, the pattern is bad, or the chosen frames lie outside a sequence.
pub fn source_files(spec: &SourceSpec) -> Result<Vec<PathBuf>> {
    match location::locate(&spec.location)? {
        Located::Stills(sequence) => chosen::files(&spec.location, sequence.files, spec.frames),
        Located::Gif(path) | Located::Video(path) => Ok(vec![path]),
    }
}

/// Passes a frame rate that is finite and above zero.
///
/// # Errors
/// [`Error::BadFrameRate`] for every other number.
pub fn check_rate(fps: f64) -> Result<f64> {
    if fps.is_finite() && fps > 0.0 { Ok(fps) } else { Err(Error::BadFrameRate { fps }) }
}

#[cfg(test)]
mod tests;
