//! The line around a silhouette.

use ::image::{GrayImage, Luma, RgbImage};
use imageproc::distance_transform::euclidean_squared_distance_transform;

use crate::report::palette::Rgb;

/// Coverage from which a pixel counts as inside.
const INSIDE: u8 = 128;
/// Bright, and rare in nature: it stands out from fur, grass, sand and snow.
const LINE: Rgb = [0x19, 0xe0, 0xff];
const HALO: Rgb = [0x10, 0x18, 0x20];
const HALO_OPACITY: f64 = 0.6;
/// The dark seam at either side of the line, pixels.
const HALO_PX: f64 = 1.2;

/// Draws the edge of a silhouette as a bright line `width_px` wide with a dark seam, so that it
/// shows on any ground. `coverage` has the picture's size, 255 inside and 0 outside.
pub(super) fn draw_outline(picture: &mut RgbImage, coverage: &GrayImage, width_px: f64) {
    let inside = GrayImage::from_fn(coverage.width(), coverage.height(), |x, y| {
        Luma([if coverage.get_pixel(x, y)[0] >= INSIDE { 255 } else { 0 }])
    });
    let mut outside = inside.clone();
    ::image::imageops::invert(&mut outside);
    // Squared distances to the nearest pixel inside and outside; the edge runs half a pixel from
    // the centres of the pixels at either side.
    let to_inside = euclidean_squared_distance_transform(&inside);
    let to_outside = euclidean_squared_distance_transform(&outside);
    for (x, y, pixel) in picture.enumerate_pixels_mut() {
        let squared = to_inside.get_pixel(x, y)[0].max(to_outside.get_pixel(x, y)[0]);
        let from_edge = squared.sqrt() - 0.5;
        if !from_edge.is_finite() {
            continue;
        }
        let within = |half: f64| (half + 0.5 - from_edge).clamp(0.0, 1.0);
        let half = 0.5 * width_px;
        pixel.0 = mixed(pixel.0, HALO, HALO_OPACITY * within(half + HALO_PX));
        pixel.0 = mixed(pixel.0, LINE, within(half));
    }
}

/// `share` of `over` on the rest of `under`.
pub(super) fn mixed(under: Rgb, over: Rgb, share: f64) -> Rgb {
    std::array::from_fn(|c| {
        (f64::from(under[c]) * (1.0 - share) + f64::from(over[c]) * share).round() as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_runs_along_the_edge_and_nowhere_else() {
        let ground = [90, 90, 90];
        let mut picture = RgbImage::from_pixel(40, 40, ::image::Rgb(ground));
        let square = |x: u32, y: u32| (10..30).contains(&x) && (10..30).contains(&y);
        let coverage =
            GrayImage::from_fn(40, 40, |x, y| Luma([if square(x, y) { 255 } else { 0 }]));
        draw_outline(&mut picture, &coverage, 2.0);
        for at in [(10, 20), (9, 20), (29, 20), (20, 10), (20, 30)] {
            assert_eq!(picture.get_pixel(at.0, at.1).0, LINE, "{at:?}");
        }
        for at in [(20, 20), (2, 2), (15, 15), (35, 20)] {
            assert_eq!(picture.get_pixel(at.0, at.1).0, ground, "{at:?}");
        }
    }

    #[test]
    fn a_mask_without_edge_leaves_the_picture_as_it_is() {
        for value in [0, 255] {
            let mut picture = RgbImage::from_pixel(12, 9, ::image::Rgb([7; 3]));
            let before = picture.clone();
            draw_outline(&mut picture, &GrayImage::from_pixel(12, 9, Luma([value])), 2.0);
            assert!(picture == before);
        }
    }
}
