//! How far a predicted motion is from the true one.

use nalgebra::UnitQuaternion;
use serde::Serialize;

use crate::rig::{Driven, Pose};

/// Mean and spread of an angle over frames and joints.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct AngleError {
    /// Mean, degrees.
    pub mean_deg: f64,
    /// Population standard deviation, degrees.
    pub sd_deg: f64,
}

impl AngleError {
    /// Of a list of angles in radians; an empty list gives zeros.
    #[must_use]
    pub fn of_angles_rad(angles_rad: &[f64]) -> Self {
        let n = angles_rad.len().max(1) as f64;
        let mean = angles_rad.iter().sum::<f64>() / n;
        let variance = angles_rad.iter().map(|a| (a - mean).powi(2)).sum::<f64>() / n;
        Self { mean_deg: mean.to_degrees(), sd_deg: variance.sqrt().to_degrees() }
    }
}

/// Indices of the joints that are compared: those whose rotation the clip drives.
#[must_use]
pub fn rotating_joints(driven: &[Driven]) -> Vec<usize> {
    driven.iter().enumerate().filter(|(_, d)| d.rotation).map(|(j, _)| j).collect()
}

/// The geodesic angle between true and predicted local rotation, over all frames and the joints
/// given: the smallest angle that turns the one into the other, in 0…π.
///
/// # Panics
/// When the two motions have not the same number of frames.
#[must_use]
pub fn geodesic_error(truth: &[Pose], predicted: &[Pose], joints: &[usize]) -> AngleError {
    assert_eq!(truth.len(), predicted.len(), "one predicted pose a true pose");
    let mut angles = Vec::with_capacity(truth.len() * joints.len());
    for (a, b) in truth.iter().zip(predicted) {
        angles
            .extend(joints.iter().map(|&j| angle_rad(&a.nodes[j].rotation, &b.nodes[j].rotation)));
    }
    AngleError::of_angles_rad(&angles)
}

/// The seed's own measure on the built-in horse: the absolute difference of the in-plane angles
/// (seed, section 4), each row one frame.
#[must_use]
pub fn in_plane_error<const N: usize>(truth: &[[f64; N]], predicted: &[[f64; N]]) -> AngleError {
    let angles: Vec<f64> = truth
        .iter()
        .zip(predicted)
        .flat_map(|(a, b)| a.iter().zip(b).map(|(x, y)| wrapped(x - y).abs()))
        .collect();
    AngleError::of_angles_rad(&angles)
}

/// The angle between two rotations. From the vector part of the relative quaternion and its
/// scalar by `atan2`, which stays exact near 0 where an arc cosine loses half of its digits.
fn angle_rad(a: &UnitQuaternion<f64>, b: &UnitQuaternion<f64>) -> f64 {
    let relative = a.rotation_to(b);
    2.0 * relative.imag().norm().atan2(relative.w.abs())
}

fn wrapped(angle_rad: f64) -> f64 {
    let turn = std::f64::consts::TAU;
    angle_rad - turn * (angle_rad / turn).round()
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::rig::NodePose;

    fn pose(angle_deg: f64) -> Pose {
        let rotation = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), angle_deg.to_radians());
        Pose { nodes: vec![NodePose { rotation, ..NodePose::IDENTITY }] }
    }

    #[test]
    fn the_error_is_the_angle_between_the_rotations() {
        let error = geodesic_error(&[pose(10.0), pose(-5.0)], &[pose(40.0), pose(5.0)], &[0]);
        assert!((error.mean_deg - 20.0).abs() < 1e-9);
        assert!((error.sd_deg - 10.0).abs() < 1e-9);
    }

    #[test]
    fn a_rotation_and_its_double_cover_are_the_same() {
        let mut turned = pose(30.0);
        let q = turned.nodes[0].rotation.into_inner();
        turned.nodes[0].rotation = UnitQuaternion::new_unchecked(-q);
        assert!(geodesic_error(&[pose(30.0)], &[turned], &[0]).mean_deg < 1e-9);
    }

    #[test]
    fn in_plane_angles_wrap_around_the_turn() {
        let error = in_plane_error(&[[3.1, 0.0]], &[[-3.1, 0.0]]);
        let expected = (std::f64::consts::TAU - 6.2) / 2.0;
        assert!((error.mean_deg - expected.to_degrees()).abs() < 1e-9);
    }
}
