//! Cutting and scaling of pictures and masks for a sheet.

use ::image::imageops::{FilterType, resize};
use ::image::{GrayImage, Luma, RgbImage};

use super::outline::mixed;
use crate::image::{Picture, Rectangle};
use crate::mask::Mask;
use crate::report::palette::{INK, Rgb};

/// Largest factor by which a small picture is magnified.
const LARGEST_MAGNIFICATION: usize = 4;
/// Ground of a silhouette on a sheet.
pub(super) const SILHOUETTE_GROUND: Rgb = [0xee, 0xf1, 0xf4];
/// Ground of a tile without footage.
pub(super) const NO_FOOTAGE: Rgb = [0x8c, 0x95, 0x9f];
/// Line width of outlines on a sheet, pixels.
pub(super) const OUTLINE_PX: f64 = 2.0;

/// The size at which `size` is shown within `room`: scaled down to fit, or magnified by a whole
/// number. Both sides are at least one pixel.
pub(super) fn shown_size(size: (usize, usize), room: (u32, u32)) -> (u32, u32) {
    let (width, height) = (size.0.max(1), size.1.max(1));
    let (room_width, room_height) = (room.0 as usize, room.1 as usize);
    let times = (room_width / width).min(room_height / height).min(LARGEST_MAGNIFICATION);
    if times >= 1 {
        return (side(width * times), side(height * times));
    }
    let scale = (room_width as f64 / width as f64).min(room_height as f64 / height as f64);
    let scaled = |length: usize| ((length as f64 * scale).round() as u32).max(1);
    (scaled(width), scaled(height))
}

/// Pixels of a sheet; sheets are far smaller than the cast's limit.
fn side(length: usize) -> u32 {
    u32::try_from(length).unwrap_or(u32::MAX)
}

fn filter(from: (usize, usize), to: (u32, u32)) -> FilterType {
    if (to.0 as usize) < from.0 || (to.1 as usize) < from.1 {
        FilterType::Triangle
    } else {
        FilterType::Nearest
    }
}

/// The part `cut` of a view that is `view` pixels large, in a picture of the same view that may
/// have another size. The result lies within the picture and holds at least one pixel, provided
/// the picture does.
fn carried(cut: Rectangle, view: (usize, usize), picture: (usize, usize)) -> Rectangle {
    let along = |start: usize, length: usize, from: usize, to: usize| {
        let ratio = to as f64 / from.max(1) as f64;
        let first = ((start as f64 * ratio).round() as usize).min(to.saturating_sub(1));
        let count = ((length as f64 * ratio).round() as usize).clamp(1, (to - first).max(1));
        (first, count)
    };
    let (x, width) = along(cut.x, cut.width, view.0, picture.0);
    let (y, height) = along(cut.y, cut.height, view.1, picture.1);
    Rectangle { x, y, width, height }
}

/// The part of a picture that shows `cut` of the `view`, at the given size. An empty picture
/// comes out grey.
pub(in crate::report) fn scaled_picture(
    picture: &Picture,
    cut: Rectangle,
    view: (usize, usize),
    size: (u32, u32),
) -> RgbImage {
    if picture.width() == 0 || picture.height() == 0 {
        return RgbImage::from_pixel(size.0, size.1, ::image::Rgb(NO_FOOTAGE));
    }
    let part = carried(cut, view, (picture.width(), picture.height()));
    let pixels = RgbImage::from_fn(side(part.width), side(part.height), |x, y| {
        ::image::Rgb(picture.pixel(part.x + x as usize, part.y + y as usize))
    });
    resize(&pixels, size.0, size.1, filter((part.width, part.height), size))
}

/// The part `cut` of a mask at the given size, as coverage from 0 to 255.
pub(in crate::report) fn scaled_mask(mask: &Mask, cut: Rectangle, size: (u32, u32)) -> GrayImage {
    let inside = |x: usize, y: usize| x < mask.width() && y < mask.height() && mask.get(x, y);
    let pixels = GrayImage::from_fn(side(cut.width), side(cut.height), |x, y| {
        Luma([if inside(cut.x + x as usize, cut.y + y as usize) { 255 } else { 0 }])
    });
    resize(&pixels, size.0, size.1, filter((cut.width, cut.height), size))
}

/// A silhouette dark on light.
pub(in crate::report) fn silhouette(coverage: &GrayImage) -> RgbImage {
    RgbImage::from_fn(coverage.width(), coverage.height(), |x, y| {
        let share = f64::from(coverage.get_pixel(x, y)[0]) / 255.0;
        ::image::Rgb(mixed(SILHOUETTE_GROUND, INK, share))
    })
}

/// The whole of a mask.
pub(in crate::report) fn whole(mask: &Mask) -> Rectangle {
    Rectangle { x: 0, y: 0, width: mask.width().max(1), height: mask.height().max(1) }
}

/// The smallest rectangle about all pixels set; `None` for an empty mask.
fn bounds(mask: &Mask) -> Option<Rectangle> {
    let mut found: Option<(usize, usize, usize, usize)> = None;
    for y in 0..mask.height() {
        for x in (0..mask.width()).filter(|&x| mask.get(x, y)) {
            let (left, top, right, bottom) = found.unwrap_or((x, y, x, y));
            found = Some((left.min(x), top.min(y), right.max(x), bottom.max(y)));
        }
    }
    found.map(|(left, top, right, bottom)| Rectangle {
        x: left,
        y: top,
        width: right - left + 1,
        height: bottom - top + 1,
    })
}

/// A window is this much larger than the largest silhouette: whoever poses the rig wants to see the
/// whole animal even where segmentation lost a part of it.
const SURROUNDINGS: f64 = 1.6;

/// One window size for all masks, large enough for the largest silhouette and its surroundings,
/// and its place about each silhouette, kept within the mask.
pub(super) fn windows(masks: &[&Mask]) -> Vec<Rectangle> {
    let found: Vec<Option<Rectangle>> = masks.iter().map(|m| bounds(m)).collect();
    let largest = |side: fn(&Rectangle) -> usize| {
        let length = found.iter().flatten().map(side).max();
        length.map(|l| (l as f64 * SURROUNDINGS).ceil() as usize)
    };
    let (width, height) = (largest(|r| r.width), largest(|r| r.height));
    let place = |middle: usize, length: usize, limit: usize| {
        middle.saturating_sub(length / 2).min(limit.saturating_sub(length))
    };
    let window = |(mask, bounds): (&&Mask, &Option<Rectangle>)| {
        let all = whole(mask);
        let window = (
            width.unwrap_or(all.width).min(all.width),
            height.unwrap_or(all.height).min(all.height),
        );
        let middle = bounds
            .map_or((all.width / 2, all.height / 2), |b| (b.x + b.width / 2, b.y + b.height / 2));
        Rectangle {
            x: place(middle.0, window.0, all.width),
            y: place(middle.1, window.1, all.height),
            width: window.0,
            height: window.1,
        }
    };
    masks.iter().zip(&found).map(window).collect()
}

/// "frame 37 · 1.48 s", or without the time.
pub(super) fn moment(frame: usize, time_s: Option<f64>) -> String {
    match time_s.filter(|t| t.is_finite()) {
        Some(time) => format!("frame {frame} · {time:.2} s"),
        None => format!("frame {frame}"),
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn large_pictures_shrink_and_small_ones_grow_by_whole_factors() {
        assert_eq!(shown_size((2208, 1242), (400, 300)), (400, 225));
        assert_eq!(shown_size((90, 34), (400, 300)), (360, 136));
        assert_eq!(shown_size((20, 10), (400, 300)), (80, 40));
        assert_eq!(shown_size((10_000, 1), (400, 300)), (400, 1));
        assert_eq!(shown_size((0, 0), (400, 300)), (4, 4));
    }

    #[test]
    fn a_cut_is_carried_to_footage_of_another_size() {
        let cut = Rectangle { x: 30, y: 20, width: 60, height: 40 };
        let carried = carried(cut, (300, 168), (400, 224));
        assert_eq!(carried, Rectangle { x: 40, y: 27, width: 80, height: 53 });
    }

    #[test]
    fn windows_are_of_one_size_and_hold_each_silhouette() {
        let blob = |x0: usize, y0: usize, w: usize, h: usize| {
            Mask::from_fn(120, 80, |x, y| (x0..x0 + w).contains(&x) && (y0..y0 + h).contains(&y))
        };
        let masks =
            [blob(0, 0, 20, 10), blob(100, 60, 20, 20), blob(50, 30, 9, 9), blob(0, 0, 0, 0)];
        let windows = windows(&masks.iter().collect::<Vec<_>>());
        for (mask, window) in masks.iter().zip(&windows) {
            assert_eq!((window.width, window.height), (32, 32));
            let held = (window.y..window.y + window.height)
                .flat_map(|y| (window.x..window.x + window.width).map(move |x| (x, y)))
                .filter(|&(x, y)| mask.get(x, y))
                .count();
            assert_eq!(held, mask.area());
        }
    }

    proptest! {
        #[test]
        fn a_carried_cut_lies_within_the_picture(
            (w, h) in (1..400_usize, 1..400_usize),
            (pw, ph) in (1..400_usize, 1..400_usize),
            (fx, fy, fw, fh) in (0.0..1.0_f64, 0.0..1.0_f64, 0.0..1.0_f64, 0.0..1.0_f64),
        ) {
            let x = (fx * (w - 1) as f64) as usize;
            let y = (fy * (h - 1) as f64) as usize;
            let cut = Rectangle {
                x,
                y,
                width: 1 + (fw * (w - x - 1) as f64) as usize,
                height: 1 + (fh * (h - y - 1) as f64) as usize,
            };
            let part = carried(cut, (w, h), (pw, ph));
            prop_assert!(part.width >= 1 && part.height >= 1);
            prop_assert!(part.x + part.width <= pw && part.y + part.height <= ph);
        }

        #[test]
        fn what_is_shown_fits_its_room(w in 1..5000_usize, h in 1..5000_usize) {
            let (sw, sh) = shown_size((w, h), (420, 300));
            prop_assert!(sw >= 1 && sh >= 1 && sw <= 420 && sh <= 300);
        }
    }
}
