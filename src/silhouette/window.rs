//! The window about the centre of mass, one size for the shot.

use std::borrow::Cow;

use rayon::prelude::*;

use super::scale_trend::{ScaleTrend, TrendRemoval};
use crate::mask::{CroppedMask, Mask};

/// Pixels of margin on every side of the window.
const MARGIN_PX: i64 = 2;

/// Settings of the windows.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WindowSettings {
    /// Removal of a slow trend of scale.
    pub scale_trend: TrendRemoval,
}

/// Masks cut to one size about their centres of mass.
#[derive(Clone, Debug, PartialEq)]
pub struct Windowed {
    /// The windows, all of one size; that of an empty mask is empty. Held cropped: a single frame in
    /// which the animal reaches far would make those of a long clip many times as large.
    pub masks: Vec<CroppedMask>,
    /// For each frame, column and row of the window's top left corner in the picture.
    pub corners_px: Vec<(i64, i64)>,
    /// The trend of scale, where one could be fitted.
    pub trend: Option<ScaleTrend>,
}

/// Cuts the window of every mask: it is centred on the centre of mass rounded to the nearest
/// pixel (which removes the animal's translation on purpose), after the trend of scale is
/// removed, and large enough for the silhouette that reaches farthest from its centre.
#[must_use]
pub fn windowed(masks: &[&CroppedMask], settings: WindowSettings) -> Windowed {
    let areas: Vec<Option<usize>> = masks.iter().map(|m| whole_area(m)).collect();
    let trend = ScaleTrend::fit(&areas, settings.scale_trend);
    let centred: Vec<(Cow<'_, CroppedMask>, (i64, i64))> = masks
        .par_iter()
        .enumerate()
        .map(|(t, &mask)| {
            let same = Cow::Borrowed(mask);
            let Some((x, y)) = mask.centre_of_mass() else { return (same, (0, 0)) };
            let scaled = match trend.map_or(1.0, |s| s.correction(t)) {
                1.0 => same,
                factor => {
                    let scaled = scaled_in_larger_picture(&mask.to_mask(), x, y, factor);
                    Cow::Owned(CroppedMask::from(&scaled))
                }
            };
            let centre = scaled.centre_of_mass().unwrap_or((x, y));
            (scaled, (centre.0.round() as i64, centre.1.round() as i64))
        })
        .collect();
    let (mut half_width, mut half_height) = (0, 0);
    for (mask, (x, y)) in &centred {
        if let Some(b) = mask.bounds() {
            half_width = half_width.max(x - b.left as i64).max(b.right as i64 - x);
            half_height = half_height.max(y - b.top as i64).max(b.bottom as i64 - y);
        }
    }
    let (half_width, half_height) = (half_width + MARGIN_PX, half_height + MARGIN_PX);
    let (width, height) = ((2 * half_width + 1) as usize, (2 * half_height + 1) as usize);
    let corners_px: Vec<(i64, i64)> =
        centred.iter().map(|(_, (x, y))| (x - half_width, y - half_height)).collect();
    let masks = centred
        .iter()
        .zip(&corners_px)
        .map(|((mask, _), &(left, top))| mask.cut(left, top, width, height))
        .collect();
    Windowed { masks, corners_px, trend }
}

/// Area of a silhouette that is wholly inside the picture.
fn whole_area(mask: &CroppedMask) -> Option<usize> {
    let b = mask.bounds()?;
    let inside =
        b.left > 0 && b.top > 0 && b.right + 1 < mask.width() && b.bottom + 1 < mask.height();
    inside.then(|| mask.area())
}

/// Scales about the centre of mass. A silhouette that grows may leave its picture, so it is first
/// put in the middle of one that holds it.
fn scaled_in_larger_picture(mask: &Mask, x: f64, y: f64, factor: f64) -> Mask {
    let grow = |size: usize| (size as f64 * (factor - 1.0).max(0.0)).ceil() as i64;
    let (dx, dy) = (grow(mask.width()), grow(mask.height()));
    let larger =
        mask.window(-dx, -dy, mask.width() + 2 * dx as usize, mask.height() + 2 * dy as usize);
    larger.scaled_about(x + dx as f64, y + dy as f64, factor)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn windows_of(masks: &[Mask]) -> Windowed {
        let cropped: Vec<CroppedMask> = masks.iter().map(CroppedMask::from).collect();
        windowed(&cropped.iter().collect::<Vec<_>>(), WindowSettings::default())
    }

    fn disc(x: f64, y: f64, r: f64) -> Mask {
        Mask::from_fn(160, 90, |px, py| (px as f64 - x).hypot(py as f64 - y) <= r)
    }

    #[test]
    fn translation_is_removed() {
        let masks = [disc(30.0, 40.0, 9.0), disc(90.0, 45.0, 9.0), disc(120.0, 30.0, 9.0)];
        let windows = windows_of(&masks);
        assert_eq!(windows.masks[0], windows.masks[1]);
        assert_eq!(windows.masks[1], windows.masks[2]);
        assert_eq!((windows.masks[0].width(), windows.masks[0].height()), (23, 23));
        assert_eq!(windows.corners_px[1], (79, 34));
    }

    #[test]
    fn an_empty_mask_stays_empty_and_the_size_is_the_largest() {
        let masks = [disc(40.0, 40.0, 5.0), Mask::new(160, 90), disc(60.0, 40.0, 20.0)];
        let windows = windows_of(&masks);
        assert!(windows.masks[1].is_empty());
        assert!(windows.masks.iter().all(|m| m.width() == 45 && m.height() == 45));
        let none = windows_of(&[Mask::new(8, 8)]);
        assert!(none.masks[0].is_empty());
    }

    #[test]
    fn a_shrinking_animal_keeps_its_size() {
        let masks: Vec<Mask> = (0..20)
            .map(|t| disc(30.0 + 5.0 * f64::from(t), 45.0, 30.0 / (1.0 + 0.05 * f64::from(t))))
            .collect();
        let windows = windows_of(&masks);
        let areas: Vec<f64> = windows.masks.iter().map(|m| m.area() as f64).collect();
        let mean = areas.iter().sum::<f64>() / 20.0;
        assert!(windows.trend.unwrap().removed);
        assert!(areas.iter().all(|a| (a / mean - 1.0).abs() < 0.06), "{areas:?}");
    }
}
