//! Ground speed from the camera's pan.

use crate::numeric::median;

/// Three standard deviations in median absolute deviations of a normal distribution.
const OUTLIER_DEVIATIONS: f64 = 3.0 * 1.4826;

/// The animal's speed over the ground, rig units a second, from how the background moves: the mean over
/// the frames of subject minus background, with outliers (a cut, a lost registration) drawn in to three
/// deviations from the median. A mean, since the outline's centre swings to and fro within a stride and
/// over whole strides only a mean is free of that.
///
/// `background_px` is by how much the background moved to the right since the frame before, at the
/// animal's distance, pixels (`dx_px` of `analysis/camera.csv`); `subject_px` where the animal is in each
/// frame, pixels to the right (the silhouette's centre of mass); `px_per_unit` how many pixels one unit of
/// the rig has at the animal's distance (for example the silhouette's height over the posed rig's). The
/// first frame's background entry is not used. Positive to the right; `None` for fewer than two frames or
/// nothing finite.
#[must_use]
pub fn ground_speed_from_pan(
    background_px: &[f64],
    subject_px: &[f64],
    fps: f64,
    px_per_unit: f64,
) -> Option<f64> {
    let steps: Vec<f64> = (subject_px.windows(2).zip(background_px.iter().skip(1)))
        .map(|(at, ground)| (at[1] - at[0]) - ground)
        .filter(|v| v.is_finite())
        .collect();
    let usable = !steps.is_empty() && px_per_unit > 0.0 && px_per_unit.is_finite();
    let middle = median(&steps);
    let spread = median(&steps.iter().map(|v| (v - middle).abs()).collect::<Vec<_>>());
    let most = OUTLIER_DEVIATIONS * spread;
    let sum: f64 = steps.iter().map(|v| v.clamp(middle - most, middle + most)).sum();
    usable.then(|| sum / steps.len() as f64 * fps / px_per_unit)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panned_and_a_static_camera_say_the_same() {
        let still = ground_speed_from_pan(&[0.0; 5], &[0.0, 4.0, 8.0, 12.0, 16.0], 25.0, 50.0);
        let panned = ground_speed_from_pan(&[0.0, -4.0, -4.0, 90.0, -4.0], &[7.0; 5], 25.0, 50.0);
        assert_eq!((still, panned), (Some(2.0), Some(2.0)));
        assert_eq!(ground_speed_from_pan(&[0.0], &[1.0], 25.0, 50.0), None);
        assert_eq!(ground_speed_from_pan(&[0.0; 2], &[1.0; 2], 25.0, 0.0), None);
    }
}
