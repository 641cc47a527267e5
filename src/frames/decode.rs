//! One picture file to pixels: kind by content, limits before memory, whole or not at all.

use std::fs::{self, File};
use std::io::{Cursor, Read as _};
use std::path::Path;

use ::image::{DynamicImage, ImageDecoder as _, ImageError, ImageFormat, ImageReader};

use super::{complete, openexr, tiff_float};
use crate::error::{Error, Result};

/// Longest side of a picture that is read, pixels: twice 8K video. Beyond it a file is far more
/// often broken or meant for print than footage.
pub const MAX_SIDE_PX: usize = 16_384;

/// Most pixels of a picture that is read: 16384 × 8192. In the widest format (four floats) that is
/// 2 GiB while decoding.
pub const MAX_PIXELS: usize = 1 << 27;

/// Memory a decoder may take: the largest picture as four floats, and as much again to work in.
const MAX_DECODER_BYTES: u64 = 2 * 16 * MAX_PIXELS as u64;

/// The picture kinds that are read, with their names for people.
const KINDS: [(ImageFormat, &str); 7] = [
    (ImageFormat::Png, "PNG"),
    (ImageFormat::Jpeg, "JPEG"),
    (ImageFormat::Tiff, "TIFF"),
    (ImageFormat::OpenExr, "OpenEXR"),
    (ImageFormat::WebP, "WebP"),
    (ImageFormat::Bmp, "BMP"),
    (ImageFormat::Gif, "GIF"),
];

/// The kind of picture a file holds by its first bytes, or `None` when it is none that is read.
///
/// # Errors
/// When the file cannot be read.
pub(super) fn kind(path: &Path) -> Result<Option<(ImageFormat, &'static str)>> {
    let mut head = Vec::with_capacity(16);
    File::open(path)
        .and_then(|file| file.take(16).read_to_end(&mut head))
        .map_err(Error::io(path, "read"))?;
    Ok(kind_of(&head))
}

fn kind_of(head: &[u8]) -> Option<(ImageFormat, &'static str)> {
    let format = ::image::guess_format(head).ok()?;
    KINDS.into_iter().find(|(known, _)| *known == format)
}

/// Whether the file's name claims a picture kind that is read.
pub(super) fn is_named_as_picture(path: &Path) -> bool {
    ImageFormat::from_path(path).is_ok_and(|f| KINDS.iter().any(|(known, _)| *known == f))
}

/// Decodes the picture in `path`, frame `frame` of its source, upright by its orientation tag. Of
/// a file with several pictures (animated, multi-page) the first is taken.
///
/// # Errors
/// [`Error::Io`], [`Error::EmptyFile`], [`Error::NotAPicture`], [`Error::PictureTooLarge`],
/// [`Error::PictureTruncated`], [`Error::PictureUndecodable`].
pub(super) fn decode(path: &Path, frame: usize) -> Result<DynamicImage> {
    let Some((format, _)) = kind(path)? else {
        let empty = fs::metadata(path).is_ok_and(|m| m.len() == 0);
        let path = path.to_owned();
        return Err(if empty {
            Error::EmptyFile { path, frame }
        } else {
            Error::NotAPicture { path, frame }
        });
    };
    let bytes = fs::read(path).map_err(Error::io(path, "read"))?;
    let file = Encoded { path, frame, format, bytes };
    file.decode()
}

/// A picture file in memory.
struct Encoded<'a> {
    path: &'a Path,
    frame: usize,
    format: ImageFormat,
    bytes: Vec<u8>,
}

impl Encoded<'_> {
    fn decode(&self) -> Result<DynamicImage> {
        let mut reader = ImageReader::with_format(Cursor::new(&self.bytes[..]), self.format);
        let mut limits = ::image::Limits::no_limits();
        limits.max_alloc = Some(MAX_DECODER_BYTES);
        reader.limits(limits);
        let mut decoder = match reader.into_decoder() {
            Ok(decoder) => decoder,
            Err(error) => return self.decode_rare(error),
        };
        let (width, height) = decoder.dimensions();
        check_size(self.path, self.frame, width as usize, height as usize)?;
        if width == 0 || height == 0 {
            return Err(without_pixels(self.path, self.frame));
        }
        let whole = match self.format {
            ImageFormat::Jpeg => complete::jpeg_is_complete(&self.bytes),
            ImageFormat::Gif => complete::gif_delays_cs(&self.bytes).is_some(),
            ImageFormat::Bmp => bmp_is_complete(&self.bytes),
            _ => true,
        };
        if !whole {
            return Err(self.truncated());
        }
        let orientation = decoder.orientation().map_err(|e| self.failed(e))?;
        let mut image = DynamicImage::from_decoder(decoder).map_err(|e| self.failed(e))?;
        image.apply_orientation(orientation);
        Ok(image)
    }

    /// The variants the image library refuses and this program reads all the same; `error` is the
    /// library's reason, which stands when they are not the cause.
    fn decode_rare(&self, error: ImageError) -> Result<DynamicImage> {
        let undecodable = |source| Error::PictureUndecodable {
            path: self.path.to_owned(),
            frame: self.frame,
            source,
        };
        let size = match self.format {
            ImageFormat::OpenExr => openexr::largest_size(&self.bytes),
            ImageFormat::Tiff => tiff_float::size(&self.bytes),
            _ => return Err(self.failed(error)),
        };
        let Ok((width, height)) = size else { return Err(self.failed(error)) };
        check_size(self.path, self.frame, width, height)?;
        match self.format {
            ImageFormat::OpenExr => openexr::decode(&self.bytes),
            _ => tiff_float::decode(&self.bytes),
        }
        .map_err(undecodable)
    }

    fn truncated(&self) -> Error {
        Error::PictureTruncated { path: self.path.to_owned(), frame: self.frame }
    }

    fn failed(&self, error: ImageError) -> Error {
        match error {
            ImageError::IoError(e) if e.kind() == std::io::ErrorKind::UnexpectedEof => {
                self.truncated()
            }
            error => Error::PictureUndecodable {
                path: self.path.to_owned(),
                frame: self.frame,
                source: error.into(),
            },
        }
    }
}

/// Passes a size within the limits.
///
/// # Errors
/// [`Error::PictureTooLarge`].
pub(super) fn check_size(path: &Path, frame: usize, width: usize, height: usize) -> Result<()> {
    let fits = width <= MAX_SIDE_PX
        && height <= MAX_SIDE_PX
        && width.checked_mul(height).is_some_and(|pixels| pixels <= MAX_PIXELS);
    if fits {
        return Ok(());
    }
    Err(Error::PictureTooLarge {
        path: path.to_owned(),
        frame,
        width,
        height,
        max_side: MAX_SIDE_PX,
        max_pixels: MAX_PIXELS,
    })
}

/// The error for a picture of width or height zero, which some formats can state.
pub(super) fn without_pixels(path: &Path, frame: usize) -> Error {
    let source = "its width or height is zero".into();
    Error::PictureUndecodable { path: path.to_owned(), frame, source }
}

/// Passes a size equal to the expected one.
///
/// # Errors
/// [`Error::SizeMismatch`].
pub(super) fn check_same_size(
    path: &Path,
    frame: usize,
    (width, height): (usize, usize),
    (expected_width, expected_height): (usize, usize),
) -> Result<()> {
    if (width, height) == (expected_width, expected_height) {
        return Ok(());
    }
    Err(Error::SizeMismatch {
        path: path.to_owned(),
        frame,
        width,
        height,
        expected_width,
        expected_height,
    })
}

/// Whether a BMP file is as long as the rows of an uncompressed picture need; other compressions
/// are left to the decoder.
fn bmp_is_complete(bytes: &[u8]) -> bool {
    needed_bmp_bytes(bytes).is_none_or(|needed| bytes.len() as u64 >= needed)
}

fn needed_bmp_bytes(bytes: &[u8]) -> Option<u64> {
    let word = |at: usize| Some(u32::from_le_bytes(bytes.get(at..at + 4)?.try_into().ok()?));
    let (header, pixels_at) = (word(14)?, word(10)?);
    if header < 40 || word(30)? != 0 {
        return None;
    }
    let (width, height) = (u64::from(word(18)?), u64::from((word(22)? as i32).unsigned_abs()));
    let bits = u64::from(u16::from_le_bytes([*bytes.get(28)?, *bytes.get(29)?]));
    let row = (width * bits).div_ceil(32) * 4;
    Some(u64::from(pixels_at) + row * height)
}

#[cfg(test)]
mod tests;
