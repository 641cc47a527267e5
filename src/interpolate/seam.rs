//! How well a loop closes.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::numeric::median;
use crate::rig::{Clip, NodePose, angle_between_rad, rotation_vector};

/// Where a loop is best cut: the pose at which the turns of the nodes change least from one frame to the
/// next. A loop has no beginning of its own, and players that drop or double a frame show it least there.
/// The last pose of the clip stands for its first one; 0 for fewer than three poses.
#[must_use]
pub fn smoothest_start(clip: &Clip) -> usize {
    let count = clip.poses.len().saturating_sub(1);
    if count < 2 {
        return 0;
    }
    let turns: Vec<Vec<Vector3<f64>>> = (0..count)
        .map(|t| {
            let both = clip.poses[t].nodes.iter().zip(&clip.poses[t + 1].nodes);
            both.map(|(a, b)| turn(a, b)).collect()
        })
        .collect();
    let jump = |t: usize| {
        let both = turns[(t + count - 1) % count].iter().zip(&turns[t]);
        both.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
    };
    (0..count).min_by(|&a, &b| jump(a).total_cmp(&jump(b))).unwrap_or(0)
}

/// What changes where the last frame of a loop meets the first. Each number is the largest of any
/// node; lengths are in the rig's unit, in the space of the node's parent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Seam {
    /// Angle between the first and the last rotation, degrees.
    pub angle_deg: f64,
    /// Distance of the first and the last translation.
    pub distance: f64,
    /// Difference of the turn into the seam and the turn out of it, degrees a frame.
    pub angle_jump_deg: f64,
    /// The same of the translation, a frame.
    pub distance_jump: f64,
    /// Median over the frames of the turn from frame to frame, degrees: what the jump is to be
    /// compared with.
    pub median_turn_deg: f64,
    /// Median over the frames of the way from frame to frame.
    pub median_way: f64,
}

impl Seam {
    /// Measures a clip whose last pose stands for its first one. All zero for fewer than three poses.
    ///
    /// A turn is the rotation vector of q₀⁻¹q₁, in the frame that turns.
    #[must_use]
    pub fn of(clip: &Clip) -> Self {
        let last = clip.poses.len().saturating_sub(1);
        if last < 2 {
            return Self::default();
        }
        let nodes = |t: usize| clip.poses[t].nodes.iter();
        let most = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, f64::max);
        let turns = |t: usize| -> Vec<Vector3<f64>> {
            nodes(t).zip(nodes(t + 1)).map(|(a, b)| turn(a, b)).collect()
        };
        let ways = |t: usize| -> Vec<Vector3<f64>> {
            nodes(t).zip(nodes(t + 1)).map(|(a, b)| b.translation - a.translation).collect()
        };
        let largest = |vectors: Vec<Vector3<f64>>| most(&mut vectors.iter().map(Vector3::norm));
        let jump = |before: Vec<Vector3<f64>>, after: Vec<Vector3<f64>>| {
            most(&mut before.iter().zip(&after).map(|(a, b)| (a - b).norm()))
        };
        let all_turns: Vec<f64> = (0..last).map(|t| largest(turns(t))).collect();
        let all_ways: Vec<f64> = (0..last).map(|t| largest(ways(t))).collect();
        let ends = || nodes(0).zip(nodes(last));
        Self {
            angle_deg: most(&mut ends().map(|(a, b)| angle_between_rad(&a.rotation, &b.rotation)))
                .to_degrees(),
            distance: most(&mut ends().map(|(a, b)| (a.translation - b.translation).norm())),
            angle_jump_deg: jump(turns(last - 1), turns(0)).to_degrees(),
            distance_jump: jump(ways(last - 1), ways(0)),
            median_turn_deg: median(&all_turns).to_degrees(),
            median_way: median(&all_ways),
        }
    }
}

fn turn(a: &NodePose, b: &NodePose) -> Vector3<f64> {
    rotation_vector(&(a.rotation.inverse() * b.rotation))
}

#[cfg(test)]
mod tests {
    use nalgebra::UnitQuaternion;

    use super::*;
    use crate::rig::{Driven, Pose};

    fn clip(degrees: &[f64]) -> Clip {
        let pose = |d: &f64| {
            let rotation = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), d.to_radians());
            let translation = Vector3::new(d / 10.0, 0.0, 0.0);
            Pose { nodes: vec![NodePose { rotation, translation, ..NodePose::IDENTITY }] }
        };
        let driven = vec![Driven { translation: true, rotation: true, scale: false }];
        Clip { name: "c".to_owned(), fps: 25.0, poses: degrees.iter().map(pose).collect(), driven }
    }

    #[test]
    fn a_gap_and_a_kink_are_measured() {
        // In by 3 degrees a frame, out by 2; 1 degree is missing.
        let seam = Seam::of(&clip(&[0.0, 2.0, 0.0, -2.0, 1.0 - 3.0, 1.0]));
        assert!((seam.angle_deg - 1.0).abs() < 1e-9 && (seam.distance - 0.1).abs() < 1e-12);
        assert!((seam.angle_jump_deg - 1.0).abs() < 1e-9);
        assert!((seam.distance_jump - 0.1).abs() < 1e-12);
        assert!((seam.median_turn_deg - 2.0).abs() < 1e-9);
    }
}
