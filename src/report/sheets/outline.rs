//! The line around a silhouette.

use ::image::{GrayImage, Luma, RgbImage};
use imageproc::distance_transform::euclidean_squared_distance_transform;

use crate::report::palette::{ACCENT, Rgb};

/// Coverage from which a pixel counts as inside.
const INSIDE: u8 = 128;

/// How an outline is drawn.
#[derive(Clone, Copy)]
pub(in crate::report) struct Outline {
    pub(super) line: Rgb,
    pub(super) width_px: f64,
    /// Opacity of the dark seam at either side.
    pub(super) seam: f64,
}

const SEAM: Rgb = [0x10, 0x18, 0x20];
const SEAM_PX: f64 = 1.2;

impl Outline {
    /// Bright, in a colour that is rare in nature, with a dark seam: it stands out from fur,
    /// grass, sand, snow and sky.
    pub(in crate::report) fn over_footage(width_px: f64) -> Self {
        Self { line: [0x19, 0xe0, 0xff], width_px, seam: 0.6 }
    }

    /// A thin line over a silhouette in greys.
    pub(super) fn over_greys() -> Self {
        Self { line: ACCENT, width_px: 1.0, seam: 0.0 }
    }
}

/// Draws the edge of a silhouette. `coverage` has the picture's size, 255 inside and 0 outside.
pub(in crate::report) fn draw_outline(
    picture: &mut RgbImage,
    coverage: &GrayImage,
    outline: Outline,
) {
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
        // Most pixels are beyond the line, those of a picture without an edge infinitely.
        if from_edge >= 0.5 * outline.width_px + SEAM_PX + 0.5 {
            continue;
        }
        let within = |half: f64| (half + 0.5 - from_edge).clamp(0.0, 1.0);
        let half = 0.5 * outline.width_px;
        pixel.0 = mixed(pixel.0, SEAM, outline.seam * within(half + SEAM_PX));
        pixel.0 = mixed(pixel.0, outline.line, within(half));
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
        draw_outline(&mut picture, &coverage, Outline::over_footage(2.0));
        for at in [(10, 20), (9, 20), (29, 20), (20, 10), (20, 30)] {
            assert_eq!(picture.get_pixel(at.0, at.1).0, Outline::over_footage(2.0).line, "{at:?}");
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
            let coverage = GrayImage::from_pixel(12, 9, Luma([value]));
            draw_outline(&mut picture, &coverage, Outline::over_footage(2.0));
            assert!(picture == before);
        }
    }
}
