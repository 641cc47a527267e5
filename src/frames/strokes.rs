//! What the user drew on a frame: strokes, one picture a frame, for any subset of the frames.
//!
//! The number at the end of the file name is the frame (`000012.png` is frame 12, counted from 0).
//!
//! | the pixel is | in a picture with transparency | in a picture without |
//! |---|---|---|
//! | white | foreground | foreground |
//! | black | background | says nothing |
//! | transparent | says nothing | |
//!
//! White is a Rec. 709 luminance of at least one half, transparent an alpha below one half, both
//! of the values as stored. A picture whose alpha is fully opaque everywhere counts as one without
//! transparency. In floats, whose colour is premultiplied, the colour is taken as it stands.

use std::path::{Path, PathBuf};

use super::mattes::{bright, opacity};
use super::{decode, location, natural};
use crate::error::{Error, Result};

/// What a stroke picture says about one pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Said {
    /// The animal is here.
    Foreground,
    /// The animal is not here.
    Background,
    /// Nothing was drawn here.
    Unsaid,
}

/// One frame's strokes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Strokes {
    /// Width, pixels.
    pub width: usize,
    /// Height, pixels.
    pub height: usize,
    /// Frame, from 0.
    pub frame: usize,
    /// The file they came from.
    pub file: PathBuf,
    /// Row by row from the top, `width * height` entries.
    pub said: Vec<Said>,
}

/// The stroke pictures at `location` (a folder, a glob, a printf pattern or one picture) with the
/// frames they are for, in order of the frames.
///
/// # Errors
/// [`Error::UnnumberedStrokes`] for a picture without a number at the end of its name,
/// [`Error::DuplicateStrokes`] for two pictures of one frame; nothing there, no pictures.
pub fn numbered_files(location: &Path) -> Result<Vec<(usize, PathBuf)>> {
    let mut numbered = Vec::new();
    for path in location::locate_stills(location)?.files {
        match natural::trailing_number(&path) {
            Some(frame) => numbered.push((frame, path)),
            None => return Err(Error::UnnumberedStrokes { path }),
        }
    }
    // Stable: pictures of one frame stay in natural order.
    numbered.sort_by_key(|(frame, _)| *frame);
    for pair in numbered.windows(2) {
        if pair[0].0 == pair[1].0 {
            return Err(Error::DuplicateStrokes {
                frame: pair[0].0,
                first: pair[0].1.clone(),
                second: pair[1].1.clone(),
            });
        }
    }
    Ok(numbered)
}

/// Reads the strokes of frame `frame`; `size` is the width and height of the footage, pixels,
/// where there is some.
///
/// # Errors
/// When the picture cannot be decoded or has another size.
pub fn read(path: &Path, frame: usize, size: Option<(usize, usize)>) -> Result<Strokes> {
    let image = decode::decode(path, frame)?;
    let (width, height) = (image.width() as usize, image.height() as usize);
    decode::check_same_size(path, frame, (width, height), size.unwrap_or((width, height)))?;
    let white = bright(&image);
    let said = match opacity(&image) {
        Some(opaque) => white.into_iter().zip(opaque).map(with_transparency).collect(),
        None => {
            white.into_iter().map(|w| if w { Said::Foreground } else { Said::Unsaid }).collect()
        }
    };
    Ok(Strokes { width, height, frame, file: path.to_owned(), said })
}

fn with_transparency((white, opaque): (bool, bool)) -> Said {
    match (opaque, white) {
        (false, _) => Said::Unsaid,
        (true, true) => Said::Foreground,
        (true, false) => Said::Background,
    }
}
