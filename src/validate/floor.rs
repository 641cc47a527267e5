//! The floor of the error tables: what the same number of poses could give if the phase were
//! known. As many poses as there are keys, equally spaced in the *true* phase, are joined by a
//! periodic cubic spline in rotation vectors about each joint's mean; the mean over eight
//! offsets of the first pose is the floor.

use nalgebra::{UnitQuaternion, Vector3};

use super::measure::{AngleError, geodesic_error};
use crate::numeric::PeriodicCubic;
use crate::rig::{NodePose, Pose, mean_rotation};

/// Offsets of the first pose that are averaged.
const OFFSETS: usize = 8;

/// Error of `keys` equally spaced poses with a perfect phase, mean over eight offsets (and the
/// mean of the standard deviations). `phases_cycles[t]` is the true phase of frame `t` in
/// cycles; poses are taken from the frames nearest to the wanted phases.
///
/// `None` with fewer than two keys or no frames: there is nothing to interpolate.
#[must_use]
pub fn floor_error(
    truth: &[Pose],
    phases_cycles: &[f64],
    joints: &[usize],
    keys: usize,
) -> Option<AngleError> {
    if keys < 2 || truth.is_empty() {
        return None;
    }
    let mut mean = 0.0;
    let mut sd = 0.0;
    for offset in 0..OFFSETS {
        let first = offset as f64 / (OFFSETS * keys) as f64;
        let frames: Vec<usize> = (0..keys)
            .map(|k| nearest_frame(phases_cycles, first + k as f64 / keys as f64))
            .collect();
        let predicted = spline_through(truth, phases_cycles, joints, &frames);
        let error = geodesic_error(truth, &predicted, joints);
        mean += error.mean_deg / OFFSETS as f64;
        sd += error.sd_deg / OFFSETS as f64;
    }
    Some(AngleError { mean_deg: mean, sd_deg: sd })
}

fn nearest_frame(phases_cycles: &[f64], wanted_cycles: f64) -> usize {
    let distance = |t: usize| {
        let d = (phases_cycles[t] - wanted_cycles).rem_euclid(1.0);
        d.min(1.0 - d)
    };
    (0..phases_cycles.len())
        .min_by(|&a, &b| distance(a).total_cmp(&distance(b)))
        .unwrap_or_default()
}

fn spline_through(
    truth: &[Pose],
    phases_cycles: &[f64],
    joints: &[usize],
    frames: &[usize],
) -> Vec<Pose> {
    let mut knots: Vec<(f64, usize)> =
        frames.iter().map(|&t| (phases_cycles[t].rem_euclid(1.0), t)).collect();
    knots.sort_by(|a, b| a.0.total_cmp(&b.0));
    knots.dedup_by(|a, b| a.0 - b.0 < 1e-9);
    let phases: Vec<f64> = knots.iter().map(|k| k.0).collect();
    let mut predicted: Vec<Pose> = truth.to_vec();
    let Some(spline) = PeriodicCubic::new(&phases) else { return predicted };
    let weights: Vec<Vec<f64>> = phases_cycles.iter().map(|&p| spline.weights(p)).collect();
    for &joint in joints {
        let rotations: Vec<UnitQuaternion<f64>> =
            knots.iter().map(|&(_, t)| truth[t].nodes[joint].rotation).collect();
        let mean = mean_rotation(&rotations);
        let vectors: Vec<Vector3<f64>> =
            rotations.iter().map(|r| (mean.inverse() * r).scaled_axis()).collect();
        for (pose, w) in predicted.iter_mut().zip(&weights) {
            let vector: Vector3<f64> = vectors.iter().zip(w).map(|(v, w)| v * *w).sum();
            let rotation = mean * UnitQuaternion::from_scaled_axis(vector);
            pose.nodes[joint] = NodePose { rotation, ..pose.nodes[joint] };
        }
    }
    predicted
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    fn swinging(phase: f64) -> Pose {
        let angle = 0.5 * (TAU * phase).sin() + 0.1 * (2.0 * TAU * phase).cos();
        let rotation = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), angle);
        Pose { nodes: vec![NodePose { rotation, ..NodePose::IDENTITY }] }
    }

    #[test]
    fn a_smooth_motion_is_met_better_with_more_poses() {
        let phases: Vec<f64> = (0..100).map(|t| f64::from(t) / 24.3).collect();
        let truth: Vec<Pose> = phases.iter().map(|&p| swinging(p)).collect();
        let error = |keys| floor_error(&truth, &phases, &[0], keys).unwrap().mean_deg;
        assert!(error(8) < 0.3, "{}", error(8));
        assert!(error(8) < error(4) && error(4) < error(3));
        assert!(floor_error(&truth, &phases, &[0], 1).is_none());
    }
}
