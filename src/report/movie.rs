//! `animation.mp4`: the footage with its outline, and beside it the animated rig.

mod rig_panel;

use std::path::Path;

use ::image::RgbImage;

use super::canvas::Canvas;
use super::palette::{INK, PAPER, series};
use super::sheets::{Outline, draw_outline, scaled_mask, scaled_picture, silhouette, whole};
use super::stored_page::heading;
use crate::error::{Error, Result};
use crate::frames::MovieWriter;
use crate::image::Picture;
use crate::mask::Mask;
use crate::shot::{Shot, WeightTable, paths, read};
use rig_panel::RigPanel;

/// Largest size of one of the two panels, pixels.
const ROOM: (f64, f64) = (854.0, 480.0);
const OUTLINE_PX: f64 = 2.0;
/// Height of the bars of the weights, and of the longest.
const BAR_PX: u32 = 8;
const LONGEST_BAR_PX: f64 = 120.0;

/// Writes a movie of every frame: at the left the footage with the silhouette's outline, at the right
/// the animated rig at the same moment, seen from the side the footage shows. While there is no
/// animation the right panel is the silhouette with a bar for each pose's weight; without footage the
/// left one is the silhouette. Frames are read and written one at a time. `progress` is told how many
/// of how many frames are done and may stop the work.
///
/// # Errors
/// As [`MovieWriter`]; when the footage, a mask or the rig cannot be read; [`Error::Interrupted`].
pub fn write_movie(
    shot: &Shot,
    path: &Path,
    progress: &dyn Fn(usize, usize) -> bool,
) -> Result<()> {
    let files = shot.mask_files()?;
    let first = shot.first_mask()?;
    let size = panel_size((first.width(), first.height()));
    let (width, height) = (size.0 as usize, size.1 as usize);
    let mut footage = shot.footage()?;
    let rig = match shot.path(paths::ANIMATION).is_file() {
        true => Some(RigPanel::new(shot, &shot.animation()?, heading(shot)?, (width, height))?),
        false => None,
    };
    let weights = weights(shot)?;
    let mut movie = MovieWriter::start(path, shot.fps(), (2 * width, height))?;
    for (frame, file) in files.iter().enumerate() {
        let mask = Mask::from_image_bytes(file, &read(file)?)?;
        let picture = match &mut footage {
            Some(footage) => Some(footage.next_frame()?.ok_or(Error::SourceChanged { frame })?),
            None => None,
        };
        let mut canvas = Canvas::new(2 * size.0, size.1, PAPER);
        canvas.paste(&left(picture.as_ref(), &mask, size), (0, 0));
        match &rig {
            Some(rig) => canvas.paste(&rig.at(frame as f64 / shot.fps()), (size.0, 0)),
            None => {
                canvas.paste(&dark_on_light(&mask, size), (size.0, 0));
                bars(&mut canvas, weights.as_ref(), frame, size.0);
            }
        }
        movie.push(&canvas.into_picture())?;
        if !progress(frame + 1, files.len()) {
            return Err(Error::Interrupted);
        }
    }
    movie.finish()
}

/// The size of a panel that shows pictures of the given size: as large as fits, sides even as H.264
/// wants them.
fn panel_size(own: (usize, usize)) -> (u32, u32) {
    let (width, height) = (own.0.max(1) as f64, own.1.max(1) as f64);
    let scale = (ROOM.0 / width).min(ROOM.1 / height);
    let even = |length: f64| (2.0 * (length * scale / 2.0).round()).max(2.0) as u32;
    (even(width), even(height))
}

fn weights(shot: &Shot) -> Result<Option<WeightTable>> {
    let path = shot.path(paths::WEIGHTS);
    path.is_file().then(|| WeightTable::from_csv(&path, &read(&path)?)).transpose()
}

fn left(picture: Option<&Picture>, mask: &Mask, size: (u32, u32)) -> RgbImage {
    let Some(picture) = picture else { return dark_on_light(mask, size) };
    let view = (mask.width(), mask.height());
    let mut image = scaled_picture(picture, whole(mask), view, size);
    let coverage = scaled_mask(mask, whole(mask), size);
    draw_outline(&mut image, &coverage, Outline::over_footage(OUTLINE_PX));
    image
}

fn dark_on_light(mask: &Mask, size: (u32, u32)) -> RgbImage {
    silhouette(&scaled_mask(mask, whole(mask), size))
}

/// A bar for each weight, in the colour of its curve; one of a negative weight is dark.
fn bars(canvas: &mut Canvas, weights: Option<&WeightTable>, frame: usize, left: u32) {
    let Some(table) = weights.filter(|w| frame < w.frames()) else { return };
    for (key, &weight) in table.row(frame).iter().enumerate() {
        let length = (weight.abs() * LONGEST_BAR_PX).round().min(2.0 * LONGEST_BAR_PX) as u32;
        // A pose with left and right exchanged has the colour of the pose.
        let pose = if key < table.posed() { key } else { key - table.posed() };
        let colour = if weight < 0.0 { INK } else { series(pose) };
        canvas.fill((left + BAR_PX, BAR_PX + key as u32 * (BAR_PX + 4)), (length, BAR_PX), colour);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn panels_are_even_and_as_large_as_fits() {
        assert_eq!(panel_size((854, 480)), (854, 480));
        assert_eq!(panel_size((320, 240)), (640, 480));
        assert_eq!(panel_size((2208, 1242)), (854, 480));
        assert_eq!(panel_size((101, 999)), (48, 480));
    }
}
