//! The outline over frames of the footage: whether the segmentation is right, at a glance.

use ::image::RgbImage;

use super::outline::{Outline, draw_outline};
use super::tile::{NO_FOOTAGE, OUTLINE_PX, moment, scaled_mask, scaled_picture, shown_size, whole};
use crate::image::{Picture, Rectangle};
use crate::mask::Mask;
use crate::report::canvas::{Canvas, Face, picture};
use crate::report::palette::{ACCENT, INK, NOTED, PAPER, Rgb};
use crate::silhouette::Flags;

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
    /// How sure the outline is, 0 to 1, where that is known.
    pub confidence: Option<f64>,
    /// What was noticed about it.
    pub flags: Flags,
}

const MARGIN_PX: u32 = 24;
const HEAD_PX: u32 = 58;
const GAP_PX: u32 = 14;
/// Two lines: the moment, and the flags.
const CAPTION_PX: u32 = 38;
const LINE_PX: u32 = 16;
/// The frame about a flagged tile, outside of the picture.
const BORDER_PX: u32 = 4;
const ROOM: (u32, u32) = (320, 240);
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

/// A sheet with whole frames and the silhouette's outline over each; below it frame number, time,
/// confidence, and the words of its flags. A frame with a flag has a border: orange when the flag keeps it
/// out of the PCA, blue when it is only noted. An empty mask is said too.
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
        if let Some(colour) = colour(tile) {
            let corner = (x - BORDER_PX, y - BORDER_PX);
            canvas.fill(corner, (shown.0 + 2 * BORDER_PX, shown.1 + 2 * BORDER_PX), colour);
        }
        canvas.paste(&overlaid(tile, shown), (x, y));
        caption(&mut canvas, tile, (x, y + shown.1 + 6), cell.0);
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

/// The colour of a tile's border; `None` where there is nothing to say.
fn colour(tile: &FrameTile) -> Option<Rgb> {
    if tile.flags.exclude() || tile.mask.is_empty() {
        Some(ACCENT)
    } else if tile.flags.is_empty() {
        None
    } else {
        Some(NOTED)
    }
}

fn caption(canvas: &mut Canvas, tile: &FrameTile, at: (u32, u32), room: u32) {
    let mut when = moment(tile.frame, tile.time_s);
    if let Some(confidence) = tile.confidence {
        when.push_str(&format!(" · sure {:.0} %", 100.0 * confidence));
    }
    let colour = colour(tile);
    let face = if colour.is_some() { Face::Bold } else { Face::Plain };
    canvas.text(&face.cut(&when, room), at, face, colour.unwrap_or(INK));
    let mut words: Vec<String> = tile.flags.iter().map(|f| f.name().replace('_', " ")).collect();
    if words.is_empty() && tile.mask.is_empty() {
        words.push("no silhouette".to_owned());
    }
    if let Some(colour) = colour {
        let below = (at.0, at.1 + LINE_PX);
        canvas.text(&Face::Bold.cut(&words.join(", "), room), below, Face::Bold, colour);
    }
}

/// A picture at the size it has on the sheet, where that is smaller than its own.
pub(in crate::report) fn reduced(large: &Picture) -> Picture {
    let own = (large.width(), large.height());
    let shown = shown_size(own, ROOM);
    if shown.0 as usize >= own.0 {
        return large.clone();
    }
    let all = Rectangle { x: 0, y: 0, width: own.0, height: own.1 };
    picture(scaled_picture(large, all, own, shown))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::silhouette::Flag;

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
    fn flagged_and_empty_frames_have_a_border_and_words_in_its_colour() {
        let count = |tile: FrameTile, colour: Rgb| {
            let sheet = overlay_sheet("shot", &[tile]);
            sheet.rgb().chunks(3).filter(|p| *p == colour).count()
        };
        let empty = Mask::new(200, 100);
        let full = Mask::from_fn(200, 100, |x, _| x > 50);
        let tile = FrameTile {
            frame: 3,
            time_s: None,
            picture: None,
            mask: &full,
            confidence: Some(0.75),
            flags: Flags::NONE,
        };
        assert_eq!((count(tile, ACCENT), count(tile, NOTED)), (0, 0));
        let border = (2 * BORDER_PX * (200 + 100 + 2 * BORDER_PX)) as usize;
        assert!(count(FrameTile { mask: &empty, ..tile }, ACCENT) > border);
        let jumped = FrameTile { flags: Flag::AreaJump.into(), ..tile };
        assert!(count(jumped, ACCENT) > border && count(jumped, NOTED) == 0);
        let corrected = FrameTile { flags: Flag::Corrected.into(), ..tile };
        assert!(count(corrected, NOTED) > border && count(corrected, ACCENT) == 0);
    }

    #[test]
    fn a_large_picture_is_reduced_and_a_small_one_stays() {
        let of = |w: usize, h: usize| Picture::from_rgb(w, h, vec![90; 3 * w * h]).unwrap();
        let size = |p: Picture| (p.width(), p.height());
        assert_eq!(size(reduced(&of(1280, 720))), (320, 180));
        assert_eq!(size(reduced(&of(100, 50))), (100, 50));
    }
}
