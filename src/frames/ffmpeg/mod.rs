//! Video files, decoded by the `ffmpeg` program.
//!
//! Only `ffmpeg` itself is needed, `ffprobe` is not. A file is read twice: once without decoding,
//! for the times of its frames ([`probe`]), and once decoded, each picture through a pipe as PPM or,
//! unconverted, as PGM ([`stream`]), which carry their own size. So the size is that of the decoded picture, upright
//! by the file's rotation flag, and memory does not grow with the clip (but for the 8 bytes a frame
//! of the first reading).
//!
//! Every decoded frame is given once where frames are evenly spaced, else ffmpeg resamples them to
//! a constant rate; [`timing`] says when. Network addresses and playlists that lead to them are
//! not opened.

mod encode;
mod probe;
mod program;
mod stream;
mod timing;

use std::path::{Path, PathBuf};

pub use encode::MovieWriter;
pub use program::Ffmpeg;

use super::{Finding, FrameRange, FrameSource, decode};
use crate::error::{Error, Result};
use crate::image::{Frame, Picture};
use stream::{Stream, Wanted};

/// What a video file says about itself, for logs and progress.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct VideoInfo {
    /// Width of the decoded, upright picture, pixels.
    pub width: usize,
    /// Height of the decoded, upright picture, pixels.
    pub height: usize,
    /// Rate the frames are given at, frames a second.
    pub fps: f64,
    /// Frames to expect, as far as the file's time stamps tell; the true number shows only when
    /// all are decoded.
    pub frame_count: Option<usize>,
    /// Whether the file's frames are unevenly spaced and therefore resampled to `fps`.
    pub variable_frame_rate: bool,
    /// Turn by which the stored picture was made upright, degrees clockwise, 0 to 359.
    pub rotation_deg: u16,
    /// Whether the file's frames are interlaced; they are given deinterlaced.
    pub interlaced: bool,
    /// Width of a stored pixel over its height; 1 for square pixels.
    pub pixel_aspect: f64,
}

/// A video file as a frame source.
pub(super) struct Video {
    path: PathBuf,
    info: VideoInfo,
    stream: Stream,
    /// Decoded when the source was opened.
    opening: Option<Frame>,
    /// Why the file is known to be cut short, to be said where it ends.
    shortfall: Option<String>,
    /// Frames given out so far.
    given: usize,
    /// Frames after which the reader stops asking, where a part was chosen.
    wanted: Option<usize>,
}

impl Video {
    /// Opens a file, looks at its time stamps and decodes the first frame. No more than `range`
    /// needs is decoded, but frames before it are.
    /// `as_stored` leaves pictures in luma and chroma where the file holds them in a form that
    /// [`YuvPicture`](crate::image::YuvPicture) can.
    pub(super) fn open(
        ffmpeg: &Ffmpeg,
        path: &Path,
        range: Option<FrameRange>,
        as_stored: bool,
    ) -> Result<Self> {
        let probe = probe::run(ffmpeg, path);
        // A program that does not even say its version is what is wrong then.
        ffmpeg.works_for(path)?;
        let probe = probe?;
        if let Some((width, height)) = probe.size {
            decode::check_size(path, 0, width, height)?;
        }
        let timing =
            timing::judge(&probe.times, probe.tick_s, probe.nominal_fps).ok_or_else(|| {
                Error::VideoUnreadable {
                    path: path.to_owned(),
                    log: "the file states no frame rate and its frames carry no times".to_owned(),
                }
            })?;
        let wanted = range.map(|r| r.last() + 1);
        let even = |(width, height): (usize, usize)| width % 2 == 0 && height % 2 == 0;
        let stored = as_stored && probe.size.is_some_and(even);
        let ask = Wanted {
            interlaced: probe.interlaced,
            resample_fps: timing.variable.then_some(timing.fps),
            limit: wanted,
            matrix: probe.matrix.filter(|_| stored),
        };
        let mut stream = Stream::start(ffmpeg, path, &ask)?;
        let opening = stream.next()?.ok_or_else(|| Error::VideoUnreadable {
            path: path.to_owned(),
            log: "no frame could be decoded".to_owned(),
        })?;
        let info = VideoInfo {
            width: opening.width(),
            height: opening.height(),
            fps: timing.fps,
            frame_count: timing.frames,
            variable_frame_rate: timing.variable,
            rotation_deg: probe.rotation_deg,
            interlaced: probe.interlaced,
            pixel_aspect: probe.pixel_aspect,
        };
        let shortfall = probe.shortfall();
        let opening = Some(opening);
        Ok(Self { path: path.to_owned(), info, stream, opening, shortfall, given: 0, wanted })
    }

    pub(super) fn info(&self) -> &VideoInfo {
        &self.info
    }

    pub(super) fn findings(&self) -> Vec<Finding> {
        let path = || self.path.clone();
        let uneven = self.info.variable_frame_rate;
        let squeezed = (self.info.pixel_aspect - 1.0).abs() > 1e-6;
        [
            uneven.then(|| Finding::VariableFrameRate { path: path(), fps: self.info.fps }),
            self.info.interlaced.then(|| Finding::Interlaced { path: path() }),
            squeezed
                .then(|| Finding::NonSquarePixels { path: path(), aspect: self.info.pixel_aspect }),
        ]
        .into_iter()
        .flatten()
        .collect()
    }
}

impl FrameSource for Video {
    fn width(&self) -> usize {
        self.info.width
    }

    fn height(&self) -> usize {
        self.info.height
    }

    fn fps(&self) -> Option<f64> {
        Some(self.info.fps)
    }

    /// Unknown before reading: what a container says about its length is a promise.
    fn frame_count(&self) -> Option<usize> {
        None
    }

    fn next_frame(&mut self) -> Result<Option<Picture>> {
        Ok(self.next_stored()?.map(Frame::into_rgb))
    }

    fn next_stored(&mut self) -> Result<Option<Frame>> {
        let frame = match self.opening.take() {
            Some(frame) => Some(frame),
            None => self.stream.next()?,
        };
        let Some(frame) = frame else {
            return match self.shortfall.take() {
                Some(log) if self.wanted.is_none_or(|wanted| self.given < wanted) => {
                    Err(Error::VideoDamaged { path: self.path.clone(), frame: self.given, log })
                }
                _ => Ok(None),
            };
        };
        let size = (frame.width(), frame.height());
        let expected = (self.info.width, self.info.height);
        decode::check_same_size(&self.path, self.given, size, expected)?;
        self.given += 1;
        Ok(Some(frame))
    }
}

#[cfg(test)]
mod tests;
