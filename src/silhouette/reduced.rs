//! Frames at the sizes they are worked at.

use std::borrow::Cow;

use fast_image_resize::images::{Image, ImageRef};
use fast_image_resize::{FilterType, IntoImageView, PixelType, ResizeAlg, ResizeOptions, Resizer};

use crate::image::{Frame, Picture, YuvConversion, YuvPicture};
use crate::numeric::{InstructionSet, Kernel};

/// Channels a pixel of the library's can have, and rows that are scaled as such.
const ROWS: usize = 4;

/// The frame as a picture of a size no larger than its own.
pub(super) fn sized(frame: &Frame, size: (usize, usize)) -> Cow<'_, Picture> {
    match frame {
        Frame::Rgb(picture) => sized_picture(picture, size),
        Frame::Yuv(stored) if (stored.width(), stored.height()) != size => {
            reduced_stored(stored, size).map_or_else(|| frame.rgb(), Cow::Owned)
        }
        Frame::Yuv(_) => frame.rgb(),
    }
}

/// The same of a picture.
pub(super) fn sized_picture(picture: &Picture, size: (usize, usize)) -> Cow<'_, Picture> {
    if (picture.width(), picture.height()) == size {
        return Cow::Borrowed(picture);
    }
    reduced(picture, size).map_or(Cow::Borrowed(picture), Cow::Owned)
}

/// By Catmull and Rom's kernel widened to the new pixels: edges of thin legs stay sharper than under a
/// mean, by .003 to .01 of overlap on four clips.
fn reduced(picture: &Picture, size: (usize, usize)) -> Option<Picture> {
    let (width, height) = sides((picture.width(), picture.height()))?;
    let whole = ImageRef::new(width, height, picture.rgb(), PixelType::U8x3).ok()?;
    Picture::from_rgb(size.0, size.1, resized(&whole, size, PixelType::U8x3)?)
}

/// Luma and chroma by that kernel each, converted where they are few. Conversion is linear but for
/// rounding and clamping, so in whichever order the two are done, a channel differs by what is rounded.
///
/// The library works down the columns first and then along the rows, where a plane by itself takes it several
/// times as long as a pixel's channels together. So for the latter four rows are taken as the channels of one,
/// of luma, or two of U and the two of V beside them, which changes no value.
fn reduced_stored(stored: &YuvPicture, size: (usize, usize)) -> Option<Picture> {
    let (width, height) = (stored.width(), stored.height());
    let luma = reduced_rows(stored.luma(), (width, height), 1, size)?;
    let chroma = reduced_rows(stored.chroma(), (width, height / 2), 2, size)?;
    let mut rgb = vec![0; 3 * size.0 * size.1.next_multiple_of(ROWS)];
    InstructionSet::best().run(RgbRows {
        rgb: &mut rgb,
        luma: luma.as_chunks().0,
        chroma: chroma.as_chunks().0,
        width: size.0,
        conversion: stored.conversion(),
    });
    rgb.truncate(3 * size.0 * size.1);
    Picture::from_rgb(size.0, size.1, rgb)
}

/// A plane, or some side by side, each at a size: row by row of one after the other, as many at a time as a
/// pixel has channels. There may be rows of nothing at the end.
fn reduced_rows(
    planes: &[u8],
    (width, height): (usize, usize),
    count: usize,
    size: (usize, usize),
) -> Option<Vec<u8>> {
    let (w, h) = sides((width, height))?;
    let whole = ImageRef::new(w, h, planes, PixelType::U8).ok()?;
    let mut rows = resized(&whole, (width, size.1), PixelType::U8)?;
    rows.resize(width * size.1.next_multiple_of(ROWS), 0);
    let width = width / count;
    let rows = InstructionSet::best().run(SideBySide { rows: &rows, width });
    let (w, h) = sides((width, rows.len() / width))?;
    let whole = ImageRef::new(w, h, rows.as_flattened(), PixelType::U8x4).ok()?;
    resized(&whole, (size.0, rows.len() / width), PixelType::U8x4)
}

/// Rows of bytes to be put side by side.
struct SideBySide<'a> {
    rows: &'a [u8],
    width: usize,
}

impl Kernel for SideBySide<'_> {
    type Result = Vec<[u8; ROWS]>;

    #[inline(always)]
    fn run(self) -> Self::Result {
        let mut together = vec![[0; ROWS]; self.rows.len() / ROWS];
        let rows = self.rows.chunks_exact(ROWS * self.width);
        for (to, rows) in together.chunks_exact_mut(self.width).zip(rows) {
            let (upper, lower) = rows.split_at(2 * self.width);
            let [(a, b), (c, d)] = [upper.split_at(self.width), lower.split_at(self.width)];
            for ((to, (a, b)), (c, d)) in to.iter_mut().zip(a.iter().zip(b)).zip(c.iter().zip(d)) {
                *to = [*a, *b, *c, *d];
            }
        }
        together
    }
}

/// Rows to be converted, [`ROWS`] at a time.
struct RgbRows<'a> {
    rgb: &'a mut [u8],
    luma: &'a [[u8; ROWS]],
    /// U and V of two rows.
    chroma: &'a [[u8; ROWS]],
    width: usize,
    conversion: YuvConversion,
}

impl Kernel for RgbRows<'_> {
    type Result = ();

    #[inline(always)]
    fn run(self) {
        let w = self.width;
        let rows = self.luma.chunks_exact(w).zip(self.chroma.chunks_exact(2 * w));
        for (rgb, (luma, chroma)) in self.rgb.chunks_exact_mut(3 * ROWS * w).zip(rows) {
            for (row, rgb) in rgb.chunks_exact_mut(3 * w).enumerate() {
                let colours = luma.iter().zip(&chroma[row / 2 * w..]);
                for (rgb, (luma, chroma)) in rgb.as_chunks_mut().0.iter_mut().zip(colours) {
                    // By shifts, of which vectors are made.
                    let y = u32::from_le_bytes(*luma) >> (8 * row);
                    let uv = u32::from_le_bytes(*chroma) >> (16 * (row % 2));
                    *rgb = self.conversion.rgb(y as u8, uv as u8, (uv >> 8) as u8);
                }
            }
        }
    }
}

fn sides(size: (usize, usize)) -> Option<(u32, u32)> {
    Some((u32::try_from(size.0).ok()?, u32::try_from(size.1).ok()?))
}

fn resized(whole: &impl IntoImageView, size: (usize, usize), of: PixelType) -> Option<Vec<u8>> {
    let (width, height) = sides(size)?;
    let mut small = Image::new(width, height, of);
    // A fourth channel is none of opacity.
    let how = ResizeOptions::new()
        .use_alpha(false)
        .resize_alg(ResizeAlg::Convolution(FilterType::CatmullRom));
    Resizer::new().resize(whole, &mut small, &how).ok()?;
    Some(small.into_vec())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::YuvMatrix;

    /// The kernel in one dimension: how much each of `from` pixels counts for pixel `at` of `to`.
    fn weights(at: usize, to: usize, from: usize) -> Vec<(usize, f64)> {
        let scale = from as f64 / to as f64;
        let middle = (at as f64 + 0.5) * scale;
        let kernel = |x: f64| match x.abs() {
            x if x < 1.0 => 1.5 * x.powi(3) - 2.5 * x.powi(2) + 1.0,
            x if x < 2.0 => -0.5 * x.powi(3) + 2.5 * x.powi(2) - 4.0 * x + 2.0,
            _ => 0.0,
        };
        let all: Vec<(usize, f64)> =
            (0..from).map(|i| (i, kernel((i as f64 + 0.5 - middle) / scale))).collect();
        let sum: f64 = all.iter().map(|w| w.1).sum();
        all.into_iter().filter(|w| w.1 != 0.0).map(|(i, w)| (i, w / sum)).collect()
    }

    /// Against the textbook's kernel, to what is rounded between its two passes.
    #[test]
    fn a_reduced_picture_is_that_of_the_kernel() {
        let ((w, h), (to_w, to_h)) = ((101, 67), (60, 41));
        let level = |i: usize| 128.0 + 90.0 * ((i * i % 997) as f64 * 0.02).sin();
        let rgb: Vec<u8> = (0..3 * w * h).map(|i| level(i) as u8).collect();
        let whole = Picture::from_rgb(w, h, rgb.clone()).unwrap();
        let small = reduced(&whole, (to_w, to_h)).unwrap();
        for at in 0..3 * to_w * to_h {
            let (x, y, c) = (at / 3 % to_w, at / 3 / to_w, at % 3);
            let mut wanted = 0.0;
            for (row, v) in weights(y, to_h, h) {
                for (column, u) in weights(x, to_w, w) {
                    wanted += u * v * f64::from(rgb[3 * (row * w + column) + c]);
                }
            }
            let found = f64::from(small.rgb()[at]);
            assert!((found - wanted.clamp(0.0, 255.0)).abs() <= 2.0, "{at}: {found} {wanted}");
        }
    }

    /// Against conversion first: planes in which neither order clamps, and chroma that is the same along
    /// each block differs by rounding alone.
    #[test]
    fn stored_frames_are_reduced_to_what_converted_ones_are() {
        let (w, h) = (204, 136);
        let wave = |x: usize, y: usize, at: f64| (x as f64 * at + y as f64 * 0.05).sin();
        let luma = (0..w * h).map(|at| (126.0 + 60.0 * wave(at % w, at / w, 0.11)) as u8);
        let chroma = (0..w * h / 2).map(|at| {
            let (x, y) = (at % w, at / w);
            let left = x < w / 2;
            let x = if left { x } else { x - w / 2 };
            (128.0 + 30.0 * wave(x, y, if left { 0.04 } else { 0.06 })) as u8
        });
        let bytes: Vec<u8> = luma.chain(chroma).collect();
        let stored = YuvPicture::new(w, h, YuvMatrix::Bt709, bytes).unwrap();
        for size in [(60, 40), (97, 33), (150, 100)] {
            let found = sized(&Frame::Yuv(stored.clone()), size).into_owned();
            let wanted = reduced(&stored.to_rgb(), size).unwrap();
            assert_eq!((found.width(), found.height()), size);
            let apart: Vec<u8> =
                found.rgb().iter().zip(wanted.rgb()).map(|(a, b)| a.abs_diff(*b)).collect();
            let mean = apart.iter().map(|d| f64::from(*d)).sum::<f64>() / apart.len() as f64;
            assert!(
                mean < 0.8 && apart.iter().all(|d| *d <= 4),
                "{size:?}: {mean} {:?}",
                apart.iter().max()
            );
        }
    }

    /// Against each plane scaled by itself, to the bit.
    #[test]
    fn rows_side_by_side_are_what_they_are_by_themselves() {
        for ((w, h), size) in [((204, 136), (97, 33)), ((66, 70), (66, 35)), ((66, 70), (40, 70))] {
            let bytes = (0..w * h * 3 / 2).map(|at| (at * at % 251) as u8).collect();
            let stored = YuvPicture::new(w, h, YuvMatrix::Bt709, bytes).unwrap();
            let alone = |plane: &[u8], w: usize| {
                let whole = ImageRef::new(w as u32, (plane.len() / w) as u32, plane, PixelType::U8);
                resized(&whole.unwrap(), size, PixelType::U8).unwrap()
            };
            let (u, v): (Vec<&[u8]>, Vec<&[u8]>) =
                (0..h / 2).map(|y| stored.chroma_rows(y)).unzip();
            let [y, u, v] = [(stored.luma(), w), (&u.concat(), w / 2), (&v.concat(), w / 2)]
                .map(|(p, w)| alone(p, w));
            let conversion = stored.conversion();
            let rgb = (0..y.len()).flat_map(|at| conversion.rgb(y[at], u[at], v[at])).collect();
            let wanted = Picture::from_rgb(size.0, size.1, rgb).unwrap();
            assert!(reduced_stored(&stored, size).unwrap() == wanted, "{size:?}");
        }
    }

    #[test]
    fn a_frame_of_the_size_wanted_is_converted_only() {
        let bytes: Vec<u8> = (0..96).map(|v| 40 + v).collect();
        let stored = YuvPicture::new(8, 8, YuvMatrix::Bt601, bytes).unwrap();
        assert_eq!(*sized(&Frame::Yuv(stored.clone()), (8, 8)), stored.to_rgb());
    }
}
