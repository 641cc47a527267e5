//! An animated GIF as a frame source.

use std::fs;
use std::io::Cursor;
use std::path::{Path, PathBuf};

use ::image::codecs::gif::GifDecoder;
use ::image::{AnimationDecoder as _, DynamicImage, Frames, ImageDecoder as _, ImageError};

use super::{Finding, FrameSource, complete, decode};
use crate::error::{Error, Result};
use crate::image::Picture;

/// Delays up to this many hundredths of a second …
const UNHURRIED_CS: u16 = 1;
/// … are shown for this long: all current browsers do so, and GIFs are made to look right there.
const BROWSER_DELAY_CS: u64 = 10;

/// How often each frame of a GIF is given out, and at what rate.
///
/// GIF counts in hundredths of a second, so 30 frames a second are written as delays of 3, 3, 4.
/// Delays that differ by no more than 1 are therefore a constant rate, the mean, each frame once.
/// Otherwise the rate is that of the shortest delay, and output frame `k` is the GIF frame shown
/// at time `k / fps`, so that longer delays repeat their frame.
#[derive(Debug, PartialEq)]
struct Schedule {
    fps: f64,
    repeats: Vec<usize>,
    variable: bool,
}

fn schedule(delays_cs: &[u16]) -> Schedule {
    let delays: Vec<u64> = delays_cs
        .iter()
        .map(|&d| if d <= UNHURRIED_CS { BROWSER_DELAY_CS } else { u64::from(d) })
        .collect();
    let total: u64 = delays.iter().sum();
    let shortest = delays.iter().copied().min().unwrap_or(BROWSER_DELAY_CS);
    let longest = delays.iter().copied().max().unwrap_or(BROWSER_DELAY_CS);
    if longest - shortest <= 1 {
        let fps = 100.0 * delays.len() as f64 / total.max(1) as f64;
        return Schedule { fps, repeats: vec![1; delays.len()], variable: false };
    }
    let mut end = 0;
    let mut given = 0;
    let repeats = delays
        .iter()
        .map(|delay| {
            end += delay;
            let until = end.div_ceil(shortest);
            let repeats = until - given;
            given = until;
            repeats as usize
        })
        .collect();
    Schedule { fps: 100.0 / shortest as f64, repeats, variable: true }
}

/// The frames of a GIF, composed on its canvas over black, at a constant rate.
pub(super) struct AnimatedGif {
    path: PathBuf,
    size: (usize, usize),
    frames: Frames<'static>,
    schedule: Schedule,
    /// GIF frames decoded so far.
    decoded: usize,
    /// The frame on show and how often it is still to be given out.
    current: Option<(Picture, usize)>,
}

impl AnimatedGif {
    /// Opens a GIF file; it is held in memory as it is stored.
    pub(super) fn open(path: &Path) -> Result<Self> {
        let bytes = fs::read(path).map_err(Error::io(path, "read"))?;
        let delays = complete::gif_delays_cs(&bytes)
            .ok_or_else(|| Error::PictureTruncated { path: path.to_owned(), frame: 0 })?;
        let undecodable = |e: ImageError| Error::PictureUndecodable {
            path: path.to_owned(),
            frame: 0,
            source: e.into(),
        };
        let decoder = GifDecoder::new(Cursor::new(bytes)).map_err(undecodable)?;
        let (width, height) = decoder.dimensions();
        let size = (width as usize, height as usize);
        decode::check_size(path, 0, size.0, size.1)?;
        if size.0 == 0 || size.1 == 0 {
            return Err(decode::without_pixels(path, 0));
        }
        Ok(Self {
            path: path.to_owned(),
            size,
            frames: decoder.into_frames(),
            schedule: schedule(&delays),
            decoded: 0,
            current: None,
        })
    }

    pub(super) fn findings(&self) -> Vec<Finding> {
        if !self.schedule.variable {
            return Vec::new();
        }
        vec![Finding::VariableFrameRate { path: self.path.clone(), fps: self.schedule.fps }]
    }

    fn decode_next(&mut self) -> Result<Option<Picture>> {
        match self.frames.next() {
            None => Ok(None),
            Some(Ok(frame)) => {
                let image = DynamicImage::ImageRgba8(frame.into_buffer());
                Ok(Some(Picture::from_dynamic(&image)))
            }
            Some(Err(error)) => Err(Error::PictureUndecodable {
                path: self.path.clone(),
                frame: self.schedule.repeats.iter().take(self.decoded).sum(),
                source: error.into(),
            }),
        }
    }
}

impl FrameSource for AnimatedGif {
    fn width(&self) -> usize {
        self.size.0
    }

    fn height(&self) -> usize {
        self.size.1
    }

    fn fps(&self) -> Option<f64> {
        Some(self.schedule.fps)
    }

    fn frame_count(&self) -> Option<usize> {
        Some(self.schedule.repeats.iter().sum())
    }

    fn next_frame(&mut self) -> Result<Option<Picture>> {
        loop {
            match self.current.take() {
                Some((picture, 1)) => return Ok(Some(picture)),
                Some((picture, left)) if left > 1 => {
                    self.current = Some((picture.clone(), left - 1));
                    return Ok(Some(picture));
                }
                _ => {}
            }
            let Some(picture) = self.decode_next()? else { return Ok(None) };
            let repeats = self.schedule.repeats.get(self.decoded).copied().unwrap_or(1);
            self.decoded += 1;
            self.current = Some((picture, repeats));
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn rounded_delays_are_a_constant_rate() {
        let thirty = schedule(&[3, 3, 4, 3, 3, 4]);
        assert_eq!(thirty, Schedule { fps: 30.0, repeats: vec![1; 6], variable: false });
    }

    #[test]
    fn hurried_delays_are_shown_as_browsers_do() {
        assert_eq!(schedule(&[0, 1, 0]).fps, 10.0);
    }

    #[test]
    fn a_pause_repeats_its_frame() {
        let pause = schedule(&[4, 4, 20, 6]);
        assert_eq!(pause, Schedule { fps: 25.0, repeats: vec![1, 1, 5, 2], variable: true });
    }

    proptest! {
        /// The twin asks, for every output time, which frame is on show.
        #[test]
        fn repeats_agree_with_asking_at_every_time(
            delays in prop::collection::vec(2_u16..40, 1..20)
        ) {
            let found = schedule(&delays);
            prop_assume!(found.variable);
            let shortest = u64::from(*delays.iter().min().unwrap());
            let total: u64 = delays.iter().map(|&d| u64::from(d)).sum();
            let mut counts = vec![0; delays.len()];
            let mut time = 0;
            while time < total {
                let mut end = 0;
                let shown = delays.iter().position(|&d| { end += u64::from(d); time < end });
                counts[shown.unwrap()] += 1;
                time += shortest;
            }
            prop_assert_eq!(found.repeats, counts);
        }
    }
}
