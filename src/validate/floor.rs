//! The floor of the error tables: what the same number of poses could give if the phase were
//! known. As many poses as there are keys, equally spaced in the *true* phase, are joined by a
//! periodic cubic spline in rotation vectors about each joint's mean; the mean over eight
//! offsets of the first pose is the floor.

use nalgebra::{DMatrix, UnitQuaternion, Vector3};

use super::measure::{AngleError, geodesic_error};
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
    let weights: Vec<Vec<f64>> =
        phases_cycles.iter().map(|&p| periodic_cubic_weights(&phases, p)).collect();
    let mut predicted: Vec<Pose> = truth.to_vec();
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

/// Weights of the knots' values in the periodic cubic spline (period one) through them, at
/// `phase`. The spline is twice continuously differentiable; its second derivatives solve the
/// cyclic tridiagonal system of the textbooks.
fn periodic_cubic_weights(knots: &[f64], phase: f64) -> Vec<f64> {
    let n = knots.len();
    if n < 2 {
        return vec![1.0; n];
    }
    let gap =
        |i: usize| (knots[(i + 1) % n] - knots[i] + f64::from(u8::from(i + 1 == n))).max(1e-12);
    let mut left = DMatrix::<f64>::zeros(n, n);
    let mut right = DMatrix::<f64>::zeros(n, n);
    for i in 0..n {
        let (before, after) = ((i + n - 1) % n, (i + 1) % n);
        let (h0, h1) = (gap(before), gap(i));
        left[(i, before)] += h0;
        left[(i, i)] += 2.0 * (h0 + h1);
        left[(i, after)] += h1;
        right[(i, before)] += 6.0 / h0;
        right[(i, i)] -= 6.0 / h0 + 6.0 / h1;
        right[(i, after)] += 6.0 / h1;
    }
    let second = left.lu().solve(&right).unwrap_or(right);
    let p = phase.rem_euclid(1.0);
    let i = knots.iter().rposition(|&k| k <= p).unwrap_or(n - 1);
    let after = (i + 1) % n;
    let h = gap(i);
    let b = (p - knots[i]).rem_euclid(1.0) / h;
    let a = 1.0 - b;
    let (ca, cb) = ((a.powi(3) - a) * h * h / 6.0, (b.powi(3) - b) * h * h / 6.0);
    let mut weights: Vec<f64> =
        (0..n).map(|k| ca * second[(i, k)] + cb * second[(after, k)]).collect();
    weights[i] += a;
    weights[after] += b;
    weights
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
    fn the_spline_goes_through_its_knots_and_keeps_constants() {
        let knots = [0.05, 0.3, 0.52, 0.8];
        for (k, &knot) in knots.iter().enumerate() {
            let w = periodic_cubic_weights(&knots, knot);
            assert!((w[k] - 1.0).abs() < 1e-12);
        }
        for step in 0..50 {
            let w = periodic_cubic_weights(&knots, f64::from(step) / 50.0);
            assert!((w.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        }
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
