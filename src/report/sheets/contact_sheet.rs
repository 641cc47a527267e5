//! The key images with their silhouettes, and each key image by itself.

use ::image::{GrayImage, RgbImage};

use super::outline::{Outline, draw_outline};
use super::tile::{
    NO_FOOTAGE, OUTLINE_PX, moment, scaled_mask, scaled_picture, shown_size, silhouette, whole,
    windows,
};
use crate::image::{Picture, Rectangle};
use crate::mask::Mask;
use crate::report::KeyMark;
use crate::report::canvas::{Canvas, Face, picture};
use crate::report::palette::{ACCENT, GRID, INK, MUTED, PAPER, Rgb};

/// One key image on a sheet.
#[derive(Clone, Copy, Debug)]
pub struct KeyTile<'a> {
    /// Which key, and which frame.
    pub mark: KeyMark,
    /// Time of the frame, seconds, where the frame rate is known.
    pub time_s: Option<f64>,
    /// The frame of the footage; `None` when the shot came as mattes or strokes.
    pub picture: Option<&'a Picture>,
    /// The silhouette in that frame; of the footage's view, not necessarily of its size.
    pub mask: &'a Mask,
}

const MARGIN_PX: u32 = 24;
const HEAD_PX: u32 = 58;
const PADDING_PX: u32 = 12;
const GAP_PX: u32 = 8;
const CAPTION_PX: u32 = 50;
/// Room for one picture when picture and silhouette stand one above the other.
const WIDE_ROOM: (u32, u32) = (340, 260);
/// The same when they stand side by side.
const TALL_ROOM: (u32, u32) = (166, 320);
/// "key 16 · partner of 12" must fit.
const NARROWEST_PX: u32 = 216;
const CARD: Rgb = [0xfa, 0xfb, 0xfc];

/// How all tiles of a sheet are laid out.
struct Layout {
    /// Size of one picture.
    shown: (u32, u32),
    side_by_side: bool,
    with_footage: bool,
    columns: u32,
}

/// A sheet with one tile a key: the frame about the animal with the silhouette's outline, the
/// silhouette itself, key, frame and time. A partner stands beside its key, in the same box.
/// All windows have one size, so that sizes compare. Without any footage only silhouettes are
/// shown. No tiles give a sheet that holds its title only.
#[must_use]
pub fn contact_sheet(title: &str, tiles: &[KeyTile]) -> Picture {
    let tiles = with_partners_adjacent(tiles);
    let masks: Vec<&Mask> = tiles.iter().map(|t| t.mask).collect();
    let windows = windows(&masks);
    let layout = layout(&tiles, &windows);
    let (tile_width, tile_height) = layout.tile_size();
    let rows = (tiles.len() as u32).div_ceil(layout.columns);
    let width = (2 * MARGIN_PX + layout.columns * tile_width).max(420);
    let height = HEAD_PX + rows * tile_height + MARGIN_PX;
    let mut canvas = Canvas::new(width, height, PAPER);
    let room = width - 2 * MARGIN_PX;
    canvas.text(&Face::Title.cut(title, room), (MARGIN_PX, 20), Face::Title, INK);
    for (i, (tile, &window)) in tiles.iter().zip(&windows).enumerate() {
        let (column, row) = (i as u32 % layout.columns, i as u32 / layout.columns);
        let corner = (MARGIN_PX + column * tile_width, HEAD_PX + row * tile_height);
        // A partner's card runs on from its key's, without the gap between cards.
        let joins_next = tiles.get(i + 1).is_some_and(|n| n.mark.partner_of == Some(tile.mark.key))
            && column + 1 < layout.columns;
        draw_tile(&mut canvas, corner, tile, window, &layout, joins_next);
    }
    canvas.into_picture()
}

/// One key image of its own: the whole frame with the silhouette's outline, small footage
/// magnified by whole factors; without footage the silhouette's outline on grey.
#[must_use]
pub fn key_image(tile: &KeyTile) -> Picture {
    /// Footage smaller than this is magnified (a picture of 90 × 34 pixels cannot be read).
    const COMFORTABLE: (usize, usize) = (480, 360);
    let cut = whole(tile.mask);
    let view = (tile.mask.width(), tile.mask.height());
    let own = tile.picture.map_or(view, |p| (p.width(), p.height()));
    let room = (own.0.max(COMFORTABLE.0), own.1.max(COMFORTABLE.1));
    let size = shown_size(own, (room.0 as u32, room.1 as u32));
    let coverage = scaled_mask(tile.mask, cut, size);
    let mut image = match tile.picture {
        Some(footage) => scaled_picture(footage, cut, view, size),
        None => RgbImage::from_pixel(size.0, size.1, ::image::Rgb(NO_FOOTAGE)),
    };
    let width_px = OUTLINE_PX.max(f64::from(size.0) / 600.0);
    draw_outline(&mut image, &coverage, Outline::over_footage(width_px));
    picture(image)
}

/// Keys in their order, each followed by its partners; partners of keys that are not there last.
fn with_partners_adjacent<'a>(tiles: &[KeyTile<'a>]) -> Vec<KeyTile<'a>> {
    let is_key =
        |key: usize| tiles.iter().any(|t| t.mark.partner_of.is_none() && t.mark.key == key);
    let mut ordered = Vec::with_capacity(tiles.len());
    for tile in tiles.iter().filter(|t| t.mark.partner_of.is_none()) {
        ordered.push(*tile);
        ordered.extend(tiles.iter().filter(|t| t.mark.partner_of == Some(tile.mark.key)));
    }
    ordered.extend(tiles.iter().filter(|t| t.mark.partner_of.is_some_and(|k| !is_key(k))));
    ordered
}

fn layout(tiles: &[KeyTile], windows: &[Rectangle]) -> Layout {
    let window = windows.first().map_or((4, 3), |w| (w.width, w.height));
    let with_footage = tiles.iter().any(|t| t.picture.is_some());
    let side_by_side = with_footage && window.0 * 10 < window.1 * 9;
    let room = if side_by_side { TALL_ROOM } else { WIDE_ROOM };
    let columns = match tiles.len() {
        0..=4 => tiles.len().max(1) as u32,
        5..=6 if tiles.iter().all(|t| t.mark.partner_of.is_none()) => 3,
        _ => 4,
    };
    Layout { shown: shown_size(window, room), side_by_side, with_footage, columns }
}

impl Layout {
    /// Size of what is shown, without the card about it.
    fn inner(&self) -> (u32, u32) {
        let (width, height) = self.shown;
        match (self.with_footage, self.side_by_side) {
            (false, _) => (width, height),
            (true, true) => (2 * width + GAP_PX, height),
            (true, false) => (width, 2 * height + GAP_PX),
        }
    }

    fn tile_size(&self) -> (u32, u32) {
        let (width, height) = self.inner();
        (
            width.max(NARROWEST_PX) + 2 * PADDING_PX + GAP_PX,
            height + CAPTION_PX + 2 * PADDING_PX + GAP_PX,
        )
    }
}

fn draw_tile(
    canvas: &mut Canvas,
    (x, y): (u32, u32),
    tile: &KeyTile,
    window: Rectangle,
    layout: &Layout,
    joins_next: bool,
) {
    let (width, height) = layout.tile_size();
    let gap = if joins_next { 0 } else { GAP_PX };
    let partner = tile.mark.partner_of.is_some();
    canvas.fill((x, y), (width - gap, height - GAP_PX), GRID);
    canvas.fill((x, y), (width - gap, 3), ACCENT);
    canvas.fill((x + 1, y + 3), (width - gap - 2, height - GAP_PX - 4), CARD);
    let text_x = x + PADDING_PX;
    let name = match tile.mark.partner_of {
        Some(of) => format!("key {} · partner of {of}", tile.mark.key),
        None => format!("key {}", tile.mark.key),
    };
    canvas.text(&name, (text_x, y + PADDING_PX), Face::Strong, if partner { ACCENT } else { INK });
    let below = y + PADDING_PX + Face::Strong.height() + 2;
    canvas.text(&moment(tile.mark.frame, tile.time_s), (text_x, below), Face::Plain, MUTED);
    let left = x + PADDING_PX + (width - GAP_PX - 2 * PADDING_PX - layout.inner().0) / 2;
    let top = y + PADDING_PX + CAPTION_PX;
    let coverage = scaled_mask(tile.mask, window, layout.shown);
    if !layout.with_footage {
        canvas.paste(&silhouette(&coverage), (left, top));
        return;
    }
    canvas.paste(&outlined(tile, window, layout.shown, &coverage), (left, top));
    let second = if layout.side_by_side {
        (left + layout.shown.0 + GAP_PX, top)
    } else {
        (left, top + layout.shown.1 + GAP_PX)
    };
    canvas.paste(&silhouette(&coverage), second);
}

fn outlined(tile: &KeyTile, window: Rectangle, size: (u32, u32), coverage: &GrayImage) -> RgbImage {
    let view = (tile.mask.width(), tile.mask.height());
    let mut image = match tile.picture {
        Some(footage) => scaled_picture(footage, window, view, size),
        None => RgbImage::from_pixel(size.0, size.1, ::image::Rgb(NO_FOOTAGE)),
    };
    draw_outline(&mut image, coverage, Outline::over_footage(OUTLINE_PX));
    image
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mark(key: usize, partner_of: Option<usize>) -> KeyMark {
        KeyMark { key, frame: 3 * key, partner_of }
    }

    fn tile(mark: KeyMark, mask: &Mask) -> KeyTile<'_> {
        KeyTile { mark, time_s: Some(0.5), picture: None, mask }
    }

    #[test]
    fn a_partner_stands_beside_its_key() {
        let mask = Mask::new(8, 8);
        let marks =
            [mark(1, None), mark(2, None), mark(3, Some(1)), mark(4, Some(2)), mark(5, Some(9))];
        let tiles: Vec<_> = marks.iter().map(|&m| tile(m, &mask)).collect();
        let order: Vec<usize> = with_partners_adjacent(&tiles).iter().map(|t| t.mark.key).collect();
        assert_eq!(order, [1, 3, 2, 4, 5]);
    }

    #[test]
    fn sheets_stay_readable_for_every_count_and_shape() {
        for (width, height) in [(90, 34), (2208, 1242), (300, 900), (16, 16), (1, 500)] {
            let mask = Mask::from_fn(width, height, |_, _| true);
            for count in [0, 1, 4, 5, 8, 16] {
                let tiles: Vec<_> = (1..=count).map(|k| tile(mark(k, None), &mask)).collect();
                let sheet = contact_sheet("shot", &tiles);
                assert!(sheet.width() <= 2400 && sheet.width() >= 200, "{}", sheet.width());
            }
        }
    }

    #[test]
    fn a_key_image_keeps_the_size_of_its_footage_unless_it_is_tiny() {
        let mask = Mask::from_fn(300, 168, |x, y| x > 100 && x < 200 && y > 50 && y < 100);
        let footage = Picture::from_rgb(640, 360, vec![100; 640 * 360 * 3]).unwrap();
        let full = KeyTile { picture: Some(&footage), ..tile(mark(1, None), &mask) };
        let image = key_image(&full);
        assert_eq!((image.width(), image.height()), (640, 360));
        // The outline's left edge, carried from the mask's size to the footage's.
        let at = (100.0 * 640.0 / 300.0_f64) as usize;
        assert!((at - 4..at + 6).any(|x| image.pixel(x, 160)[2] > 200));
        let small = Mask::from_fn(90, 34, |x, _| x > 40);
        let image = key_image(&tile(mark(1, None), &small));
        assert_eq!((image.width(), image.height()), (360, 136));
    }
}
