//! From weights to poses: the sum x(p) = Σ wᵢ(p) xᵢ of equation 7 over the key poses xᵢ.
//!
//! The paper sums joint angles. Here a rotation enters as its rotation vector about the mean of
//! that node's key rotations, which has no gimbal and no preferred axis: with the mean q̄ and
//! xᵢ = log(q̄⁻¹ qᵢ), a frame's rotation is q̄ exp(Σ wᵢ xᵢ).
//!
//! The weights of a frame need not sum to one. Translations and scales are therefore summed as
//! deviations from their mean as well, x̄ + Σ wᵢ (xᵢ − x̄): where the weights fade out, every
//! channel fades to the mean key pose and none to zero.

use nalgebra::{UnitQuaternion, Vector3};

use crate::error::{Error, Result};
use crate::rig::{
    Clip, Driven, KeyPoses, NodePose, Pose, Skeleton, angle_between_rad, mean_rotation,
    rotation_from_vector, rotation_vector,
};

/// The channels of one node: mean over the keys, and each key's deviation from it.
struct Deviations {
    mean: NodePose,
    translations: Vec<Vector3<f64>>,
    rotations: Vec<Vector3<f64>>,
    scales: Vec<Vector3<f64>>,
}

/// The clip that weights make of key poses: one pose a row of `weights`, at `fps` rows a second.
///
/// `weights` holds one row a frame and in a row one weight a key (frames × keys, row by row). A
/// row with a single 1 and otherwise 0 gives that key's pose, to rounding. Nodes and channels that
/// `keys.driven` does not name keep the rest transform of `skeleton`.
///
/// Limits: a key rotation exactly 180° from the node's mean has two valid rotation vectors (see
/// [`rotation_vector`]), one of which is taken; weights far outside [0, 1] can turn a joint round
/// or a scale negative, as the sum is not clamped.
///
/// # Errors
/// [`Error::WeightNotFinite`] naming frame and key.
///
/// # Panics
/// When there is no key, a pose has not one entry a node, or `weights` is not made of whole rows.
pub fn blend(
    name: &str,
    fps: f64,
    skeleton: &Skeleton,
    keys: &KeyPoses,
    weights: &[f64],
) -> Result<Clip> {
    let count = keys.poses.len();
    assert!(count > 0 && weights.len().is_multiple_of(count), "one weight a key in every row");
    assert_eq!(keys.driven.len(), skeleton.nodes.len(), "one entry a node");
    if let Some(bad) = weights.iter().position(|w| !w.is_finite()) {
        return Err(Error::WeightNotFinite { frame: bad / count, key: bad % count + 1 });
    }
    let nodes: Vec<Deviations> =
        (0..skeleton.nodes.len()).map(|node| deviations(&keys.poses, node)).collect();
    let poses = weights
        .chunks_exact(count)
        .map(|row| Pose {
            nodes: (skeleton.nodes.iter().zip(&nodes).zip(&keys.driven))
                .map(|((node, deviations), driven)| blended(&node.rest, deviations, *driven, row))
                .collect(),
        })
        .collect();
    Ok(Clip { name: name.to_owned(), fps, poses, driven: keys.driven.clone() })
}

fn deviations(poses: &[Pose], node: usize) -> Deviations {
    let of_keys = || poses.iter().map(move |p| &p.nodes[node]);
    let count = poses.len() as f64;
    let rotations: Vec<UnitQuaternion<f64>> = of_keys().map(|n| n.rotation).collect();
    let mean = NodePose {
        translation: of_keys().map(|n| n.translation).sum::<Vector3<f64>>() / count,
        rotation: mean_rotation(&rotations),
        scale: of_keys().map(|n| n.scale).sum::<Vector3<f64>>() / count,
    };
    Deviations {
        mean,
        translations: of_keys().map(|n| n.translation - mean.translation).collect(),
        rotations: rotations
            .iter()
            .map(|q| rotation_vector(&(mean.rotation.inverse() * q)))
            .collect(),
        scales: of_keys().map(|n| n.scale - mean.scale).collect(),
    }
}

fn blended(rest: &NodePose, node: &Deviations, driven: Driven, weights: &[f64]) -> NodePose {
    let sum =
        |xs: &[Vector3<f64>]| -> Vector3<f64> { xs.iter().zip(weights).map(|(x, &w)| x * w).sum() };
    let mut pose = *rest;
    if driven.translation {
        pose.translation = node.mean.translation + sum(&node.translations);
    }
    if driven.rotation {
        pose.rotation = node.mean.rotation * rotation_from_vector(&sum(&node.rotations));
    }
    if driven.scale {
        pose.scale = node.mean.scale + sum(&node.scales);
    }
    pose
}

/// The largest change of pose from one frame to the next.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LargestStep {
    /// The largest angle by which any node's local rotation changes, degrees.
    pub angle_deg: f64,
    /// The frame it leads to; 0 for a clip of fewer than two frames.
    pub frame: usize,
}

/// The largest angle by which any node's local rotation changes from one frame to the next. A jump
/// in the animation shows here. Of equal steps the first is given.
#[must_use]
pub fn largest_step(clip: &Clip) -> LargestStep {
    let mut largest = LargestStep::default();
    for (before, pair) in clip.poses.windows(2).enumerate() {
        for (a, b) in pair[0].nodes.iter().zip(&pair[1].nodes) {
            let angle_deg = angle_between_rad(&a.rotation, &b.rotation).to_degrees();
            if angle_deg > largest.angle_deg {
                largest = LargestStep { angle_deg, frame: before + 1 };
            }
        }
    }
    largest
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::rig::Node;

    const ALL: Driven = Driven { translation: true, rotation: true, scale: true };

    fn skeleton(rests: &[NodePose]) -> Skeleton {
        let node = |rest: &NodePose| Node { name: "bone".to_owned(), parent: None, rest: *rest };
        Skeleton { nodes: rests.iter().map(node).collect() }
    }

    fn about_y(degrees: f64) -> NodePose {
        let rotation = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), degrees.to_radians());
        NodePose { rotation, ..NodePose::IDENTITY }
    }

    fn keys(poses: &[NodePose], driven: Driven) -> KeyPoses {
        let poses = poses.iter().map(|&n| Pose { nodes: vec![n] }).collect();
        KeyPoses { poses, driven: vec![driven] }
    }

    fn any_node() -> impl Strategy<Value = NodePose> {
        let three = || prop::array::uniform3(-1.0..1.0_f64).prop_map(Vector3::from);
        (three(), three(), three()).prop_map(|(t, r, s)| NodePose {
            translation: t * 100.0,
            rotation: UnitQuaternion::from_scaled_axis(r * 3.0),
            scale: s.map(|x| x + 2.0),
        })
    }

    proptest! {
        #[test]
        fn a_single_one_gives_the_key_pose(nodes in prop::collection::vec(any_node(), 1..7)) {
            let keys = keys(&nodes, ALL);
            let n = nodes.len();
            let identity: Vec<f64> =
                (0..n * n).map(|i| f64::from(u8::from(i / n == i % n))).collect();
            let clip =
                blend("c", 25.0, &skeleton(&[NodePose::IDENTITY]), &keys, &identity).unwrap();
            for (made, key) in clip.poses.iter().zip(&nodes) {
                prop_assert!((made.nodes[0].translation - key.translation).norm() < 1e-12);
                prop_assert!((made.nodes[0].scale - key.scale).norm() < 1e-12);
                prop_assert!(angle_between_rad(&made.nodes[0].rotation, &key.rotation) < 1e-12);
            }
        }

        #[test]
        fn the_sign_of_a_key_quaternion_does_not_matter(
            nodes in prop::collection::vec(any_node(), 2..5), w in prop::collection::vec(-0.5..1.5_f64, 4),
        ) {
            let flipped: Vec<NodePose> = nodes.iter().enumerate().map(|(i, n)| NodePose {
                rotation: if i % 2 == 0 {
                    n.rotation
                } else {
                    UnitQuaternion::new_unchecked(-n.rotation.into_inner())
                },
                ..*n
            }).collect();
            let row = &w[..nodes.len()];
            let s = skeleton(&[NodePose::IDENTITY]);
            let a = blend("c", 25.0, &s, &keys(&nodes, ALL), row).unwrap();
            let b = blend("c", 25.0, &s, &keys(&flipped, ALL), row).unwrap();
            // The mean's iteration may round differently, hence not bit for bit.
            let angle = angle_between_rad(&a.poses[0].nodes[0].rotation, &b.poses[0].nodes[0].rotation);
            prop_assert!(angle < 1e-9, "{}", angle);
        }
    }

    #[test]
    fn turns_about_one_axis_add_like_angles() {
        let keys = keys(&[about_y(170.0), about_y(190.0), about_y(240.0)], ALL);
        // Mean 200°, deviations −30°, −10°, 40°.
        let weights = [0.5, 0.5, 0.0, 0.0, 0.0, 1.5, -0.5, 0.0, 0.0, 0.0, 0.0, 0.0];
        let clip = blend("c", 25.0, &skeleton(&[NodePose::IDENTITY]), &keys, &weights).unwrap();
        for (pose, degrees) in clip.poses.iter().zip([180.0, 260.0, 215.0, 200.0]) {
            let angle = angle_between_rad(&pose.nodes[0].rotation, &about_y(degrees).rotation);
            assert!(angle < 1e-12, "{degrees}: {angle}");
        }
        assert!((largest_step(&clip).angle_deg - 80.0).abs() < 1e-9);
    }

    #[test]
    fn without_weights_every_channel_fades_to_the_mean() {
        let at = |x: f64, s: f64| NodePose {
            translation: Vector3::new(x, 0.0, 0.0),
            scale: Vector3::repeat(s),
            ..NodePose::IDENTITY
        };
        let keys = keys(&[at(2.0, 1.0), at(4.0, 3.0)], ALL);
        let clip = blend("c", 25.0, &skeleton(&[NodePose::IDENTITY]), &keys, &[0.0, 0.0]).unwrap();
        assert_eq!(clip.poses[0].nodes[0], at(3.0, 2.0));
    }

    #[test]
    fn channels_nobody_drives_stay_at_rest() {
        let rest = NodePose { translation: Vector3::new(0.0, 7.0, 0.0), ..about_y(15.0) };
        let only_rotation = Driven { rotation: true, ..Driven::default() };
        let keys = keys(&[about_y(30.0), about_y(50.0)], only_rotation);
        let clip = blend("c", 25.0, &skeleton(&[rest]), &keys, &[1.0, 0.0]).unwrap();
        assert_eq!(clip.poses[0].nodes[0].translation, rest.translation);
        assert!(
            angle_between_rad(&clip.poses[0].nodes[0].rotation, &about_y(30.0).rotation) < 1e-12
        );
        assert_eq!(clip.driven, [only_rotation]);
    }

    #[test]
    fn a_weight_that_is_no_number_is_named() {
        let keys = keys(&[about_y(0.0), about_y(1.0)], ALL);
        let s = skeleton(&[NodePose::IDENTITY]);
        let result = blend("c", 25.0, &s, &keys, &[0.0, 1.0, 0.5, f64::NAN]);
        assert!(matches!(result, Err(Error::WeightNotFinite { frame: 1, key: 2 })));
    }
}
