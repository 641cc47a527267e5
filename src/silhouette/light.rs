//! Light that changes over a clip (a cloud, an exposure that adapts): measured along the camera's
//! path and taken out, so that a frame can be compared with others and with the rectangles' colours.

use rayon::prelude::*;

use super::lab_image::LabImage;
use crate::motion::CameraStep;

/// Every so manieth pixel, each way, is compared.
const GRID: usize = 3;

/// Pixels whose ratio differs from the median by more than this show something else in one of the two
/// frames.
const ALIKE: f64 = 0.08;

/// Darker than this, in bytes of L*, ratios are noise.
const LEAST_LIGHTNESS: u8 = 20;

/// Change of the cube root of luminance over the clip from which light is taken to change: a tenth of
/// the brightness in sRGB levels. What is less is left to what is learnt from the clip: distances
/// between frames are small then, and correcting could only add the estimate's own drift.
const LEAST_CHANGE: f64 = 0.06;

/// The light of each frame as the cube root of its luminance over that of the first frame; of a
/// later stretch, over what `before`, the frame before it as it was relit, was made like. `None`
/// where it hardly changes.
pub(super) fn light(
    frames: &[LabImage],
    before: Option<&LabImage>,
    steps: &[CameraStep],
) -> Option<Vec<f32>> {
    let ratio = |t: usize| {
        let from = if t > 0 { Some(&frames[t - 1]) } else { before };
        from.zip(steps.get(t)).map_or(1.0, |(from, step)| change(from, &frames[t], step))
    };
    let ratios: Vec<f64> = (0..frames.len()).into_par_iter().map(ratio).collect();
    let mut light = 1.0;
    let all: Vec<f64> = ratios
        .into_iter()
        .map(|ratio| {
            light *= ratio;
            light
        })
        .collect();
    let changes = all.iter().any(|light| light.ln().abs() > LEAST_CHANGE);
    changes.then(|| all.into_iter().map(|light| light as f32).collect())
}

/// By what factor the cube root of luminance changes from one frame to the next: the mean over
/// pixels of the background, which the step of the camera lays over one another, of those about the
/// median. The mean, since the median of bytes' ratios is 1 while light changes by less than a byte.
fn change(from: &LabImage, to: &LabImage, step: &CameraStep) -> f64 {
    let (w, h) = (from.width(), from.height());
    let root = |image: &LabImage, at: usize| f64::from(image.planes()[0][at]) / 2.0 + 16.0;
    let mut ratios = Vec::new();
    for y in (0..h).step_by(GRID) {
        for x in (0..w).step_by(GRID) {
            let (u, v) = step.from_previous.apply(x as f64, y as f64);
            let (u, v) = (u.round(), v.round());
            if !(u >= 0.0 && v >= 0.0 && u < w as f64 && v < h as f64) {
                continue;
            }
            let (here, there) = (y * w + x, v as usize * w + u as usize);
            if from.planes()[0][here].min(to.planes()[0][there]) >= LEAST_LIGHTNESS {
                ratios.push(root(to, there) / root(from, here));
            }
        }
    }
    if ratios.is_empty() {
        return 1.0;
    }
    let middle = ratios.len() / 2;
    let median = *ratios.select_nth_unstable_by(middle, f64::total_cmp).1;
    // In the order of the ratios, whichever way they were parted: the same sum at any time.
    ratios.retain(|ratio| (ratio / median - 1.0).abs() < ALIKE);
    ratios.sort_unstable_by(f64::total_cmp);
    ratios.iter().sum::<f64>() / ratios.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::Homography;

    fn frame(level: f64, square: usize) -> LabImage {
        let (w, h) = (60, 40);
        let lightness = |at: usize| {
            let (x, y) = (at % w, at / w);
            let ground = 60.0 + 20.0 * ((x * 7 + y * 13) as f64 * 0.3).sin();
            let there = (square..square + 10).contains(&x) && (10..25).contains(&y);
            let root = if there { 30.0 } else { ground + 16.0 };
            (2.0 * (level * root - 16.0)).round() as u8
        };
        let flat = vec![128; w * h];
        LabImage::from_planes(w, h, [(0..w * h).map(lightness).collect(), flat.clone(), flat])
    }

    fn still() -> CameraStep {
        CameraStep { from_previous: Homography::identity(), inliers: 1.0, residual: 0.0 }
    }

    #[test]
    fn slow_light_is_followed_past_an_animal_and_steady_light_is_left_alone() {
        let level = |t: usize| 1.0 - 0.2 * t as f64 / 59.0;
        let frames: Vec<LabImage> = (0..60).map(|t| frame(level(t), t / 2)).collect();
        let found = light(&frames, None, &[still(); 60]).unwrap();
        for (t, found) in found.into_iter().enumerate() {
            assert!((f64::from(found) / level(t) - 1.0).abs() < 0.01, "{t}: {found}");
        }
        let steady: Vec<LabImage> = (0..60).map(|t| frame(1.0, t / 2)).collect();
        assert_eq!(light(&steady, None, &[still(); 60]), None);
        // What a stretch after the first is measured against.
        let next = light(&frames[59..], Some(&steady[0]), &[still()]).unwrap();
        assert!((next[0] - 0.8).abs() < 0.01, "{next:?}");
    }
}
