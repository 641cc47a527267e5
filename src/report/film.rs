//! The footage at the size of the page, with the outline of every silhouette as a drawn path.

use std::path::PathBuf;

use ::image::imageops::{FilterType, resize};
use ::image::{GrayImage, RgbImage};
use fast_image_resize::images::{Image, ImageRef};
use fast_image_resize::{FilterType as Kernel, PixelType, ResizeAlg, ResizeOptions, Resizer};
use imageproc::contours::find_contours;
use imageproc::geometry::approximate_polygon_dp;
use imageproc::point::Point;
use rayon::prelude::*;

use super::embedded::photograph;
use super::sheets::{scaled_mask, whole};
use crate::error::{Error, Result};
use crate::image::Picture;
use crate::mask::Mask;
use crate::shot::{Shot, read};

/// Pictures that are reduced and compressed side by side.
const BATCH: usize = 8;

/// Longest side of a picture in the page.
const LONGEST_SIDE_PX: f64 = 480.0;
/// Pictures are not made narrower than this; rather some are left out.
const LEAST_WIDTH_PX: f64 = 160.0;
/// What a pixel of a photograph takes. Measured on the clips of the tests: .11 to .24 at 480 pixels.
const BYTES_PER_PIXEL: f64 = 0.2;
/// Base64 writes three bytes as four letters.
const BASE64: f64 = 4.0 / 3.0;
/// What an outline takes, generously: .4 to .8 kB were measured.
const OUTLINE_LETTERS: f64 = 1000.0;
/// Pictures smaller than this show nothing.
const LEAST_SIDE_PX: u32 = 48;
/// How far a drawn outline may lie from the mask's, pixels of the page's picture.
const TOLERANCE_PX: f64 = 0.75;
/// Coverage from which a pixel counts as inside.
const INSIDE: u8 = 128;
/// By what factor pictures shrink that turned out too heavy.
const SHRINK: f64 = 0.8;

/// The clip for the page.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Film {
    /// Width and height of pictures and of the outlines' coordinates.
    pub(super) size: (u32, u32),
    /// Frames of the clip.
    pub(super) frames: usize,
    /// Every so manieth frame is kept.
    pub(super) step: usize,
    /// JPEG files of frames 0, `step`, 2 `step`…; empty without footage.
    pub(super) pictures: Vec<Vec<u8>>,
    /// An SVG path for each frame kept; empty for an empty mask.
    pub(super) outlines: Vec<String>,
    /// Why there are no pictures, or not all, in words.
    pub(super) note: Option<String>,
}

impl Film {
    /// Letters of the page that pictures and outlines take.
    pub(super) fn letters(&self) -> usize {
        let pictures: usize = self.pictures.iter().map(|p| p.len().div_ceil(3) * 4).sum();
        pictures + self.outlines.iter().map(String::len).sum::<usize>()
    }
}

/// Reads the footage once, a frame at a time, and keeps it within `budget` letters of the page. A
/// source that cannot be read leaves the outlines alone, and a note.
///
/// # Errors
/// [`Error::Interrupted`]; when a mask cannot be read.
pub(super) fn film(shot: &Shot, budget: usize) -> Result<Film> {
    let files = shot.mask_files()?;
    let first = shot.first_mask()?;
    let own = (first.width(), first.height());
    let (size, step) = plan(own, files.len(), budget);
    let mut film = Film { size, step, frames: files.len(), ..Film::default() };
    film.outlines = outlines(&files, step, size)?;
    match pictures(shot, &mut film) {
        Ok(()) => {}
        Err(Error::Interrupted) => return Err(Error::Interrupted),
        Err(error) => {
            film.note = Some(format!(
                "The footage could not be read for this page ({error}), so {} shown.",
                if film.pictures.is_empty() { "silhouettes alone are" } else { "only a part is" }
            ));
        }
    }
    while film.letters() > budget && !film.pictures.is_empty() {
        shrink(&mut film)?;
        film.outlines = outlines(&files, step, film.size)?;
    }
    if film.step > 1 && film.note.is_none() {
        film.note =
            Some(format!("The clip is long: one frame of {} is shown on this page.", film.step));
    }
    Ok(film)
}

/// Size of the pictures, and of how many frames one is kept.
fn plan(own: (usize, usize), frames: usize, budget: usize) -> ((u32, u32), usize) {
    let (width, height) = (own.0.max(1) as f64, own.1.max(1) as f64);
    let letters_per_px = BASE64 * BYTES_PER_PIXEL;
    let most = (LONGEST_SIDE_PX / width.max(height)).min(1.0);
    let least = (LEAST_WIDTH_PX / width).min(most);
    let pixels = |scale: f64| scale * scale * width * height;
    let least_letters = pixels(least) * letters_per_px + OUTLINE_LETTERS;
    let frames = frames.max(1) as f64;
    let step = (frames * least_letters / (budget as f64).max(1.0)).ceil().clamp(1.0, frames);
    let room_px = (budget as f64 / (frames / step).ceil() - OUTLINE_LETTERS) / letters_per_px;
    let scale = (room_px.max(0.0) / (width * height)).sqrt();
    (scaled(own, scale.clamp(least, most)), step as usize)
}

fn scaled(size: (usize, usize), scale: f64) -> (u32, u32) {
    let side = |length: usize| ((length as f64 * scale).round() as u32).max(1);
    (side(size.0), side(size.1))
}

fn pictures(shot: &Shot, film: &mut Film) -> Result<()> {
    let Some(mut footage) = shot.footage()? else {
        film.note = Some("The shot was made from silhouettes, without footage.".to_owned());
        return Ok(());
    };
    let mut frame = 0;
    while frame < film.frames {
        let last = film.frames.min(frame + BATCH * film.step);
        let mut batch = Vec::new();
        let mut ended = Ok(None);
        while frame < last {
            let wanted = frame % film.step == 0;
            let read = if wanted {
                footage.next_frame().map(|picture| picture.map(|p| batch.push(p)).is_some())
            } else {
                footage.skip_frame()
            };
            match read {
                Ok(true) => frame += 1,
                Ok(false) => {
                    ended = Ok(Some(frame));
                    break;
                }
                Err(error) => {
                    ended = Err(error);
                    break;
                }
            }
        }
        // What was read before an error is shown all the same.
        let size = film.size;
        let photographs: Vec<Result<Vec<u8>>> =
            batch.par_iter().map(|picture| photograph(&small(picture, size)?)).collect();
        for photographed in photographs {
            film.pictures.push(photographed?);
        }
        if let Some(frame) = ended? {
            film.note = Some(format!("The footage ends at frame {frame}, before the silhouettes."));
            break;
        }
    }
    Ok(())
}

/// The picture at another size.
fn small(picture: &Picture, size: (u32, u32)) -> Result<RgbImage> {
    let resized = || {
        let side = |length: usize| u32::try_from(length).ok();
        let (width, height) = (side(picture.width())?, side(picture.height())?);
        let whole = ImageRef::new(width, height, picture.rgb(), PixelType::U8x3).ok()?;
        let mut small = Image::new(size.0, size.1, PixelType::U8x3);
        let how = ResizeOptions::new().resize_alg(ResizeAlg::Convolution(Kernel::Bilinear));
        Resizer::new().resize(&whole, &mut small, &how).ok()?;
        RgbImage::from_raw(size.0, size.1, small.into_vec())
    };
    resized().ok_or_else(|| Error::Drawing {
        what: "the footage of the page".to_owned(),
        reason: format!("a picture of {} × {} pixels", picture.width(), picture.height()),
    })
}

/// Makes all pictures smaller: noisy ones take more room than was planned for. Where even small ones do
/// not fit there are none.
fn shrink(film: &mut Film) -> Result<()> {
    film.size = scaled((film.size.0 as usize, film.size.1 as usize), SHRINK);
    if film.size.0.max(film.size.1) < LEAST_SIDE_PX {
        film.pictures.clear();
        film.note = Some("The footage does not fit into this page.".to_owned());
    }
    for jpeg in &mut film.pictures {
        let undecodable = |e: ::image::ImageError| Error::Drawing {
            what: "the footage of the page".to_owned(),
            reason: e.to_string(),
        };
        let large = ::image::load_from_memory(jpeg).map_err(undecodable)?.into_rgb8();
        *jpeg = photograph(&resize(&large, film.size.0, film.size.1, FilterType::Triangle))?;
    }
    Ok(())
}

/// The outlines of every so manieth mask.
fn outlines(files: &[PathBuf], step: usize, size: (u32, u32)) -> Result<Vec<String>> {
    let one = |file: &PathBuf| Ok(outline(&Mask::from_image_bytes(file, &read(file)?)?, size));
    let kept: Vec<&PathBuf> = files.iter().step_by(step).collect();
    kept.into_par_iter().map(one).collect()
}

/// The outline of a mask as an SVG path, in pixels of a picture of the given size: one closed polygon
/// for each border, outer and inner.
fn outline(mask: &Mask, size: (u32, u32)) -> String {
    let coverage = scaled_mask(mask, whole(mask), size);
    let inside = GrayImage::from_fn(size.0, size.1, |x, y| {
        ::image::Luma([if coverage.get_pixel(x, y)[0] >= INSIDE { 255 } else { 0 }])
    });
    let mut path = String::new();
    for contour in find_contours::<i32>(&inside) {
        let polygon = approximate_polygon_dp(&contour.points, TOLERANCE_PX, true);
        if polygon.len() > 2 {
            push_polygon(&mut path, &polygon);
        }
    }
    path
}

/// Appends a polygon: the first corner, then the way to each next one.
fn push_polygon(path: &mut String, polygon: &[Point<i32>]) {
    let mut last: Option<Point<i32>> = None;
    for corner in polygon {
        match last {
            None => path.push_str(&format!("M{} {}l", corner.x, corner.y)),
            Some(from) => {
                let (x, y) = (corner.x - from.x, corner.y - from.y);
                let between = if x < 0 || path.ends_with('l') { "" } else { " " };
                let comma = if y < 0 { "" } else { " " };
                path.push_str(&format!("{between}{x}{comma}{y}"));
            }
        }
        last = Some(*corner);
    }
    path.push('z');
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Corners of a path that [`push_polygon`] wrote.
    fn corners(path: &str) -> Vec<Vec<(i32, i32)>> {
        let polygon = |text: &str| {
            let spaced = text.replace('l', " ").replace('-', " -");
            let numbers: Vec<i32> = spaced.split_whitespace().map(|n| n.parse().unwrap()).collect();
            let mut at = (0, 0);
            numbers
                .chunks(2)
                .map(|step| {
                    at = (at.0 + step[0], at.1 + step[1]);
                    at
                })
                .collect()
        };
        path.split('M').skip(1).map(|p| polygon(p.trim_end_matches('z'))).collect()
    }

    #[test]
    fn an_outline_runs_through_the_corners_of_box_and_hole() {
        let mask = Mask::from_fn(60, 40, |x, y| {
            (10..50).contains(&x)
                && (5..35).contains(&y)
                && !((20..30).contains(&x) && (15..25).contains(&y))
        });
        let polygons = corners(&outline(&mask, (60, 40)));
        assert_eq!(polygons.len(), 2);
        for corner in [(10, 5), (49, 5), (49, 34), (10, 34)] {
            assert!(polygons[0].contains(&corner), "{corner:?} of {polygons:?}");
        }
        assert!(polygons[1].iter().all(|&(x, y)| (19..=30).contains(&x) && (14..=25).contains(&y)));
        assert_eq!(outline(&Mask::new(60, 40), (60, 40)), "");
    }

    #[test]
    fn the_plan_keeps_to_its_budget_and_leaves_frames_out_last() {
        let letters = |frames: usize, (size, step): ((u32, u32), usize)| {
            let picture = f64::from(size.0 * size.1) * BYTES_PER_PIXEL * BASE64;
            (picture + OUTLINE_LETTERS) * frames.div_ceil(step) as f64
        };
        let usual = plan((854, 480), 137, 4_000_000);
        assert_eq!(usual.1, 1);
        assert!(usual.0.0 >= 320, "{usual:?}");
        for (frames, own) in
            [(137, (854, 480)), (20, (4096, 2160)), (5000, (854, 480)), (1, (8, 9))]
        {
            let planned = plan(own, frames, 4_000_000);
            assert!(letters(frames, planned) < 4_080_000.0, "{frames}: {planned:?}");
            assert!(planned.0.0.max(planned.0.1) <= 480);
        }
        assert_eq!(plan((8, 9), 1, 4_000_000), ((8, 9), 1));
        assert!(plan((854, 480), 5000, 4_000_000).1 > 1);
    }
}
