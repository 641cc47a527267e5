//! The outline over frames of the footage: whether the segmentation is right, at a glance.

use ::image::RgbImage;

use super::outline::{Outline, draw_outline};
use super::tile::{NO_FOOTAGE, OUTLINE_PX, moment, scaled_mask, scaled_picture, shown_size, whole};
use crate::image::Picture;
use crate::mask::Mask;
use crate::report::canvas::{Canvas, Face};
use crate::report::palette::{ACCENT, INK, PAPER};

/// One frame on the overlay sheet.
#[derive(Clone, Copy, Debug)]
pub struct FrameTile<'a> {
    /// Frame of the footage, from 0.
    pub frame: usize,
    /// Its time, seconds, where the frame rate is known.
    pub time_s: Option<f64>,
    /// The frame itself; `None` when the shot came as mattes or strokes.
    pub picture: Option<&'a Picture>,
    /// Its silhouette; of the footage's view, not necessarily of its size.
    pub mask: &'a Mask,
    /// What was found wrong with it, a few words.
    pub finding: Option<&'a str>,
}

const MARGIN_PX: u32 = 24;
const HEAD_PX: u32 = 58;
const GAP_PX: u32 = 14;
const CAPTION_PX: u32 = 22;
const ROOM: (u32, u32) = (420, 320);
/// Sheets are not made wider than this.
const WIDEST_PX: u32 = 1760;
const NARROWEST_PX: u32 = 180;

/// `count` frames of `frames`, evenly spaced, with the first and the last; all of them where
/// there are fewer.
#[must_use]
pub fn evenly_chosen(frames: usize, count: usize) -> Vec<usize> {
    if frames <= count {
        return (0..frames).collect();
    }
    if count < 2 {
        return (0..count).collect();
    }
    (0..count).map(|i| (i * (frames - 1) + (count - 1) / 2) / (count - 1)).collect()
}

/// A sheet with whole frames and the silhouette's outline over each, frame number and time below.
/// An empty mask and a finding are said in the caption.
#[must_use]
pub fn overlay_sheet(title: &str, tiles: &[FrameTile]) -> Picture {
    let sizes: Vec<(u32, u32)> = tiles.iter().map(size).collect();
    let cell = (
        sizes.iter().map(|s| s.0).max().unwrap_or(ROOM.0).max(NARROWEST_PX),
        sizes.iter().map(|s| s.1).max().unwrap_or(ROOM.1),
    );
    let fitting = ((WIDEST_PX - 2 * MARGIN_PX + GAP_PX) / (cell.0 + GAP_PX)).max(1);
    let columns = (tiles.len().max(1) as u32).min(fitting);
    let rows = (tiles.len() as u32).div_ceil(columns);
    let width = (2 * MARGIN_PX + columns * (cell.0 + GAP_PX) - GAP_PX).max(420);
    let height = HEAD_PX + rows * (cell.1 + CAPTION_PX + GAP_PX) + MARGIN_PX - GAP_PX;
    let mut canvas = Canvas::new(width, height, PAPER);
    let title = Face::Title.cut(title, width - 2 * MARGIN_PX);
    canvas.text(&title, (MARGIN_PX, 20), Face::Title, INK);
    for (i, (tile, &shown)) in tiles.iter().zip(&sizes).enumerate() {
        let (column, row) = (i as u32 % columns, i as u32 / columns);
        let x = MARGIN_PX + column * (cell.0 + GAP_PX);
        let y = HEAD_PX + row * (cell.1 + CAPTION_PX + GAP_PX);
        canvas.paste(&overlaid(tile, shown), (x, y));
        caption(&mut canvas, tile, (x, y + shown.1 + 5), cell.0);
    }
    canvas.into_picture()
}

fn size(tile: &FrameTile) -> (u32, u32) {
    let own =
        tile.picture.map_or((tile.mask.width(), tile.mask.height()), |p| (p.width(), p.height()));
    shown_size(own, ROOM)
}

fn overlaid(tile: &FrameTile, shown: (u32, u32)) -> RgbImage {
    let cut = whole(tile.mask);
    let mut image = match tile.picture {
        Some(footage) => {
            scaled_picture(footage, cut, (tile.mask.width(), tile.mask.height()), shown)
        }
        None => RgbImage::from_pixel(shown.0, shown.1, ::image::Rgb(NO_FOOTAGE)),
    };
    let coverage = scaled_mask(tile.mask, cut, shown);
    draw_outline(&mut image, &coverage, Outline::over_footage(OUTLINE_PX));
    image
}

fn caption(canvas: &mut Canvas, tile: &FrameTile, at: (u32, u32), room: u32) {
    let when = moment(tile.frame, tile.time_s);
    let wrong = match (tile.finding, tile.mask.area()) {
        (Some(finding), _) => Some(finding),
        (None, 0) => Some("no silhouette"),
        (None, _) => None,
    };
    let Some(wrong) = wrong else {
        canvas.text(&Face::Plain.cut(&when, room), at, Face::Plain, INK);
        return;
    };
    let text = Face::Bold.cut(&format!("{when} · {wrong}"), room);
    canvas.text(&text, at, Face::Bold, ACCENT);
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn chosen_frames_are_even() {
        assert_eq!(evenly_chosen(100, 4), [0, 33, 66, 99]);
        assert_eq!(evenly_chosen(3, 8), [0, 1, 2]);
        assert_eq!(evenly_chosen(10, 1), [0]);
        assert!(evenly_chosen(0, 5).is_empty() && evenly_chosen(5, 0).is_empty());
    }

    proptest! {
        #[test]
        fn chosen_frames_rise_within_the_clip(frames in 0..2000_usize, count in 0..40_usize) {
            let chosen = evenly_chosen(frames, count);
            prop_assert_eq!(chosen.len(), frames.min(count));
            prop_assert!(chosen.windows(2).all(|w| w[0] < w[1]));
            prop_assert!(chosen.iter().all(|&t| t < frames));
            if chosen.len() > 1 {
                let even = (frames - 1) as f64 / (chosen.len() - 1) as f64;
                for (i, &t) in chosen.iter().enumerate() {
                    prop_assert!((t as f64 - even * i as f64).abs() <= 1.0);
                }
            }
        }
    }

    #[test]
    fn an_empty_mask_and_a_finding_are_said_in_the_accent_colour() {
        let accents = |tile: FrameTile| {
            let sheet = overlay_sheet("shot", &[tile]);
            sheet.rgb().chunks(3).filter(|p| p == &ACCENT).count()
        };
        let empty = Mask::new(200, 100);
        let full = Mask::from_fn(200, 100, |x, _| x > 50);
        let tile = FrameTile { frame: 3, time_s: None, picture: None, mask: &full, finding: None };
        assert_eq!(accents(tile), 0);
        assert!(accents(FrameTile { mask: &empty, ..tile }) > 50);
        assert!(accents(FrameTile { finding: Some("jumped"), ..tile }) > 50);
    }
}
