//! Ready silhouettes from roto and paint tools.
//!
//! What is inside is told by the alpha channel, or by luminance where there is none:
//!
//! - A picture whose alpha channel is not fully opaque everywhere is read by alpha. A fully opaque
//!   alpha says nothing and counts as no alpha; a fully transparent one is an empty silhouette.
//! - Otherwise by Rec. 709 luminance, `0.2126 R + 0.7152 G + 0.0722 B`, of the values as stored:
//!   no tone curve is applied, for floats these are the linear values.
//!
//! A pixel is inside when that number is at least half of full at the picture's own depth: 128 of
//! 255, 32768 of 65535, 0.5.

use std::path::{Path, PathBuf};

use ::image::DynamicImage;

use super::{Finding, FrameRange, chosen, decode, location};
use crate::error::Result;

/// Which mattes to read.
#[derive(Clone, Debug, PartialEq)]
pub struct MatteSpec {
    /// A folder, a glob, a printf pattern, or a single picture.
    pub location: PathBuf,
    /// The part to read, counted in natural order from 0; `None` is all.
    pub frames: Option<FrameRange>,
    /// Swap inside and outside.
    pub invert: bool,
    /// Width and height the mattes must have, pixels: those of the footage. `None`: those of the
    /// first matte.
    pub size: Option<(usize, usize)>,
}

/// One frame's silhouette.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Matte {
    /// Width, pixels.
    pub width: usize,
    /// Height, pixels.
    pub height: usize,
    /// Frame, from 0: the place in natural order, not the number in the name.
    pub frame: usize,
    /// The file it came from.
    pub file: PathBuf,
    /// Row by row from the top, `width * height` entries: is this pixel inside?
    pub inside: Vec<bool>,
}

/// Mattes one after the other, one in memory at a time. After an error the iterator goes on with
/// the next file.
#[derive(Debug)]
pub struct Mattes {
    files: Vec<PathBuf>,
    findings: Vec<Finding>,
    first: usize,
    next: usize,
    invert: bool,
    size: Option<(usize, usize)>,
}

/// Finds the mattes. Pixels are read by the iterator.
///
/// # Errors
/// When there is nothing at the place, the pattern is bad, or the chosen frames lie outside.
pub fn open(spec: &MatteSpec) -> Result<Mattes> {
    let sequence = location::locate_stills(&spec.location)?;
    let files = chosen::files(&spec.location, sequence.files, spec.frames)?;
    Ok(Mattes {
        files,
        findings: sequence.findings,
        first: spec.frames.map_or(0, FrameRange::first),
        next: 0,
        invert: spec.invert,
        size: spec.size,
    })
}

impl Mattes {
    /// The files, in the order they are read.
    #[must_use]
    pub fn files(&self) -> &[PathBuf] {
        &self.files
    }

    /// What is odd about the sequence of files.
    #[must_use]
    pub fn findings(&self) -> &[Finding] {
        &self.findings
    }

    fn read(&mut self, path: &Path, frame: usize) -> Result<Matte> {
        let image = decode::decode(path, frame)?;
        let size = (image.width() as usize, image.height() as usize);
        decode::check_same_size(path, frame, size, *self.size.get_or_insert(size))?;
        let (width, height) = size;
        let mut inside = coverage(&image);
        if self.invert {
            inside.iter_mut().for_each(|pixel| *pixel = !*pixel);
        }
        Ok(Matte { width, height, frame, file: path.to_owned(), inside })
    }
}

impl Iterator for Mattes {
    type Item = Result<Matte>;

    fn next(&mut self) -> Option<Self::Item> {
        let path = self.files.get(self.next)?.clone();
        let frame = self.first + self.next;
        self.next += 1;
        Some(self.read(&path, frame))
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        let left = self.files.len() - self.next;
        (left, Some(left))
    }
}

/// Inside or outside, by alpha that says something, else by luminance.
fn coverage(image: &DynamicImage) -> Vec<bool> {
    opacity(image).unwrap_or_else(|| bright(image))
}

/// For every pixel whether it is at least half opaque; `None` when there is no alpha channel or it
/// is fully opaque everywhere.
pub(super) fn opacity(image: &DynamicImage) -> Option<Vec<bool>> {
    if !image.color().has_alpha() {
        return None;
    }
    let (opaque, half): (bool, Vec<bool>) = match image {
        DynamicImage::ImageRgba32F(b) => {
            (b.pixels().all(|p| p[3] >= 1.0), b.pixels().map(|p| p[3] >= 0.5).collect())
        }
        DynamicImage::ImageRgba16(_) | DynamicImage::ImageLumaA16(_) => {
            let b = image.to_luma_alpha16();
            (b.pixels().all(|p| p[1] == u16::MAX), b.pixels().map(|p| p[1] >= 1 << 15).collect())
        }
        _ => {
            let b = image.to_luma_alpha8();
            (b.pixels().all(|p| p[1] == u8::MAX), b.pixels().map(|p| p[1] >= 1 << 7).collect())
        }
    };
    (!opaque).then_some(half)
}

/// For every pixel whether its luminance is at least half of full.
pub(super) fn bright(image: &DynamicImage) -> Vec<bool> {
    match image {
        DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_) => {
            image.to_rgb32f().pixels().map(|p| is_bright(p.0.map(f64::from), 1.0)).collect()
        }
        DynamicImage::ImageLuma16(_)
        | DynamicImage::ImageLumaA16(_)
        | DynamicImage::ImageRgb16(_)
        | DynamicImage::ImageRgba16(_) => {
            image.to_rgb16().pixels().map(|p| is_bright(p.0.map(f64::from), 65_535.0)).collect()
        }
        _ => image.to_rgb8().pixels().map(|p| is_bright(p.0.map(f64::from), 255.0)).collect(),
    }
}

/// Weights times 10000, so that grey at exactly one half is not lost to rounding. NaN is dark.
fn is_bright([r, g, b]: [f64; 3], full: f64) -> bool {
    2126.0 * r + 7152.0 * g + 722.0 * b >= 5000.0 * full
}

#[cfg(test)]
mod tests;
