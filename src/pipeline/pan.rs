//! How fast the animal crosses the ground, by the footage: its silhouette against the background.

use std::ops::Range;

use crate::error::Result;
use crate::feet::ground_speed_from_pan;
use crate::mask::CroppedMask;
use crate::motion::CameraPath;
use crate::numeric::median;
use crate::shot::{CameraTable, Reads, Shot, StoredPan, hash_file, paths, read};
use crate::silhouette::FrameReport;

/// Share of the steps between frames that must be measured.
const LEAST_STEPS: f64 = 0.5;

/// An animal that goes by less than this a frame stands; its steps are compared with this, pixels.
const LEAST_STEP_PX: f64 = 1e-3;

/// Standard deviations of a normal distribution in one median absolute deviation.
const DEVIATIONS_OF_MEDIAN: f64 = 1.4826;

/// The animal in pixels, over the frames whose silhouette is whole.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pan {
    /// Way against the background, pixels a second of footage, positive to the right.
    px_a_second: f64,
    /// Mean height and width of the silhouettes, pixels.
    size_px: (f64, f64),
    /// Steps from frame to frame it was measured on.
    steps: usize,
    /// Robust standard deviation of the single steps over their median.
    unevenness: f64,
}

/// What the pan reads beyond what the animation reads anyway.
pub(super) fn reads(shot: &Shot, reads: &mut Reads) -> Result<()> {
    for (name, file) in [("camera", paths::CAMERA), ("silhouettes", paths::SILHOUETTES)] {
        let path = shot.path(file);
        if path.is_file() {
            reads.insert(name.to_owned(), hash_file(&path)?);
        }
    }
    Ok(())
}

impl Pan {
    /// Of some of a shot's frames; `None` where nothing is known of the camera (mattes, sketches) or
    /// too little of the animal.
    ///
    /// # Errors
    /// When stored files cannot be read.
    pub(super) fn of(shot: &Shot, frames: Range<usize>) -> Result<Option<Self>> {
        let path = shot.path(paths::CAMERA);
        if !path.is_file() {
            return Ok(None);
        }
        let camera = CameraTable::from_csv(&path, &read(&path)?)?.path;
        let (masks, reports) = (shot.masks()?, shot.frame_reports()?);
        let end = frames.end.min(masks.len()).min(reports.len()).min(camera.steps().len());
        if frames.start >= end {
            return Ok(None);
        }
        Ok(Self::measure(&camera, &masks, &reports, frames.start..end, shot.fps()))
    }

    fn measure(
        camera: &CameraPath,
        masks: &[CroppedMask],
        reports: &[FrameReport],
        frames: Range<usize>,
        fps: f64,
    ) -> Option<Self> {
        let whole = |t: usize| reports[t].centre_px.filter(|_| !reports[t].is_excluded());
        // The first entry is not looked at. What the ground under the animal did since the frame before,
        // seen from where the animal was then: zoom and roll move the two alike.
        let background: Vec<f64> = frames
            .clone()
            .map(|t| {
                let step = camera.steps()[t];
                let seen = t > frames.start && step.inliers > 0.0;
                let before = t.saturating_sub(1);
                let place = whole(before).filter(|_| seen).zip(masks[before].bounds());
                // On the ground it stands on: seen from rails, what is nearer passes faster.
                place.map_or(f64::NAN, |((x, _), bounds)| {
                    step.from_previous.apply(x, bounds.bottom as f64).0 - x
                })
            })
            .collect();
        let subject: Vec<f64> =
            frames.clone().map(|t| whole(t).map_or(f64::NAN, |c| c.0)).collect();
        let measured = |t: &usize| subject[*t].is_finite() && background[*t].is_finite();
        let steps = (1..subject.len()).filter(measured).count();
        if (steps as f64) < LEAST_STEPS * (subject.len() - 1) as f64 {
            return None;
        }
        let sizes: Vec<(f64, f64)> = frames
            .filter(|&t| whole(t).is_some())
            .filter_map(|t| masks[t].bounds())
            .map(|b| ((b.bottom - b.top + 1) as f64, (b.right - b.left + 1) as f64))
            .collect();
        let mean =
            |side: fn(&(f64, f64)) -> f64| sizes.iter().map(side).sum::<f64>() / sizes.len() as f64;
        let ways: Vec<f64> = (1..subject.len())
            .map(|t| subject[t] - subject[t - 1] - background[t])
            .filter(|way| way.is_finite())
            .collect();
        let middle = median(&ways);
        let spread = median(&ways.iter().map(|way| (way - middle).abs()).collect::<Vec<_>>());
        let unevenness = DEVIATIONS_OF_MEDIAN * spread / middle.abs().max(LEAST_STEP_PX);
        let px_a_second = ground_speed_from_pan(&background, &subject, fps, 1.0)?;
        Some(Self { px_a_second, size_px: (mean(|s| s.0), mean(|s| s.1)), steps, unevenness })
    }

    /// The speed in the rig's unit, for a rig whose mean height in the animation is `height` and an animation
    /// that plays `retime` times as fast as the footage.
    pub(super) fn on_rig(&self, height: f64, retime: f64) -> StoredPan {
        let px_a_unit = self.size_px.0 / height;
        let px_a_second = self.px_a_second.abs() * retime;
        StoredPan {
            ground_speed: px_a_second / px_a_unit,
            body_lengths_a_second: px_a_second / self.size_px.1,
            px_a_second: self.px_a_second,
            px_a_unit,
            steps: self.steps,
            unevenness: self.unevenness,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mask::Mask;
    use crate::motion::{CameraStep, Homography};
    use crate::silhouette::report_of_mask;

    /// A block of 20 × 10 pixels that goes right by 3 pixels a frame before a camera that follows by 2,
    /// lost in one frame.
    #[test]
    fn the_background_is_taken_off_and_lost_frames_are_left_out() {
        let masks: Vec<Mask> = (0..12)
            .map(|t| {
                let left = 20 + t;
                let here = t != 6;
                Mask::from_fn(80, 40, |x, y| {
                    here && (left..left + 20).contains(&x) && (5..15).contains(&y)
                })
            })
            .collect();
        let reports: Vec<FrameReport> =
            masks.iter().enumerate().map(|(t, m)| report_of_mask(t, m)).collect();
        let step = |t: usize| CameraStep {
            from_previous: Homography::translation(if t == 9 { 55.0 } else { -2.0 }, 0.0),
            inliers: if t == 9 { 0.0 } else { 1.0 },
            residual: 0.0,
        };
        let camera = CameraPath::from_steps((0..12).map(step).collect());
        let masks: Vec<CroppedMask> = masks.iter().map(CroppedMask::from).collect();
        let pan = Pan::measure(&camera, &masks, &reports, 0..12, 25.0).unwrap();
        // Of 11 steps, two end or begin in the lost frame and one was not seen.
        assert_eq!((pan.steps, pan.size_px), (8, (10.0, 20.0)));
        assert!(pan.unevenness < 1e-9, "{pan:?}");
        assert!((pan.px_a_second - 75.0).abs() < 1e-9, "{pan:?}");
        let on_rig = pan.on_rig(2.0, 2.0);
        assert!((on_rig.px_a_unit - 5.0).abs() < 1e-12);
        assert!((on_rig.ground_speed - 30.0).abs() < 1e-9);
        assert!((on_rig.body_lengths_a_second - 7.5).abs() < 1e-9);
        assert!(Pan::measure(&camera, &masks, &reports, 5..8, 25.0).is_none(), "one step of three");

        // From rails the ground passes the faster the nearer it is: by 2 pixels in the lowest row of the animal.
        let mut nearer = nalgebra::Matrix3::identity();
        nearer[(0, 1)] = -2.0 / 14.0;
        let from_previous = Homography::from_matrix(nearer).unwrap();
        let step = CameraStep { from_previous, inliers: 1.0, residual: 0.0 };
        let rails = CameraPath::from_steps(vec![step; 12]);
        let pan = Pan::measure(&rails, &masks, &reports, 0..12, 25.0).unwrap();
        assert!((pan.px_a_second - 75.0).abs() < 1e-9, "{pan:?}");
    }
}
