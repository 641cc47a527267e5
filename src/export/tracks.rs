//! The channels of a clip as they go into a file: f32 values, without what does not move.

use nalgebra::{UnitQuaternion, Vector3};

use crate::rig::{Clip, NodePose, Skeleton};

/// Largest distance from the rest value that still counts as the rest value, as a share of the
/// value's size (of 1 for smaller ones): a few units in the last place of f32.
const REST_TOLERANCE: f32 = 4.0 * f32::EPSILON;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Property {
    Translation,
    Rotation,
    Scale,
}

impl Property {
    /// The name in glTF.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Translation => "translation",
            Self::Rotation => "rotation",
            Self::Scale => "scale",
        }
    }

    /// Numbers a key.
    pub(super) fn width(self) -> usize {
        if self == Self::Rotation { 4 } else { 3 }
    }

    fn value(self, pose: &NodePose) -> Vec<f32> {
        let vector = |v: &Vector3<f64>| v.iter().map(|&x| x as f32).collect();
        match self {
            Self::Translation => vector(&pose.translation),
            Self::Scale => vector(&pose.scale),
            Self::Rotation => quaternion(&pose.rotation),
        }
    }
}

/// x, y, z, w, of unit length.
fn quaternion(q: &UnitQuaternion<f64>) -> Vec<f32> {
    UnitQuaternion::new_normalize(q.into_inner()).coords.iter().map(|&x| x as f32).collect()
}

/// One property of one node over the frames of a clip.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Track {
    pub(super) node: usize,
    pub(super) property: Property,
    /// One value a frame, or a single one when all frames have the same.
    pub(super) keys: Vec<Vec<f32>>,
}

/// The driven channels that differ from the rest pose in some frame, by node. When all of them
/// rest, the first driven one is kept, so that the animation is not empty; nothing comes back only
/// when nothing is driven.
pub(super) fn tracks(skeleton: &Skeleton, clip: &Clip) -> Vec<Track> {
    let mut moving = Vec::new();
    let mut resting = None;
    for (node, driven) in clip.driven.iter().enumerate() {
        for (property, on) in [
            (Property::Translation, driven.translation),
            (Property::Rotation, driven.rotation),
            (Property::Scale, driven.scale),
        ] {
            if !on || clip.poses.is_empty() {
                continue;
            }
            let rest = property.value(&skeleton.nodes[node].rest);
            let track = track(clip, node, property, &rest);
            if track.keys.iter().all(|key| close(key, &rest)) {
                resting.get_or_insert(track);
            } else {
                moving.push(track);
            }
        }
    }
    if moving.is_empty() {
        moving.extend(resting);
    }
    moving
}

fn track(clip: &Clip, node: usize, property: Property, rest: &[f32]) -> Track {
    let mut keys: Vec<Vec<f32>> =
        clip.poses.iter().map(|pose| property.value(&pose.nodes[node])).collect();
    if property == Property::Rotation {
        keep_hemisphere(&mut keys, rest);
    }
    if keys.iter().all(|key| close(key, &keys[0])) {
        keys.truncate(1);
    }
    Track { node, property, keys }
}

/// Chooses of q and −q the one on the side of the key before (of the rest rotation for the first),
/// since viewers that interpolate the components would otherwise turn the long way round.
fn keep_hemisphere(keys: &mut [Vec<f32>], rest: &[f32]) {
    let mut before = rest.to_vec();
    for key in keys {
        let dot: f32 = key.iter().zip(&before).map(|(a, b)| a * b).sum();
        if dot < 0.0 {
            key.iter_mut().for_each(|x| *x = -*x);
        }
        before.clone_from(key);
    }
}

fn close(a: &[f32], b: &[f32]) -> bool {
    a.iter().zip(b).all(|(x, y)| (x - y).abs() <= REST_TOLERANCE * y.abs().max(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rig::{Driven, Node, Pose};

    fn about_x(degrees: f64) -> NodePose {
        let rotation = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), degrees.to_radians());
        NodePose { rotation, ..NodePose::IDENTITY }
    }

    fn made(rest: NodePose, poses: &[NodePose]) -> Vec<Track> {
        let skeleton = Skeleton { nodes: vec![Node { name: "a".to_owned(), parent: None, rest }] };
        let driven = vec![Driven { translation: true, rotation: true, scale: true }];
        let poses = poses.iter().map(|&n| Pose { nodes: vec![n] }).collect();
        tracks(&skeleton, &Clip { name: "c".to_owned(), fps: 25.0, poses, driven })
    }

    #[test]
    fn a_limb_that_turns_on_and_on_stays_on_one_hemisphere() {
        let poses: Vec<NodePose> = (0..40).map(|i| about_x(f64::from(i) * 25.0)).collect();
        let tracks = made(NodePose::IDENTITY, &poses);
        assert_eq!(tracks.len(), 1, "translation and scale rest");
        for pair in tracks[0].keys.windows(2) {
            let dot: f32 = pair[0].iter().zip(&pair[1]).map(|(a, b)| a * b).sum();
            assert!(dot > 0.97, "{dot}");
        }
    }

    #[test]
    fn the_negative_of_the_rest_rotation_rests() {
        let q = about_x(40.0);
        let negative =
            NodePose { rotation: UnitQuaternion::new_unchecked(-q.rotation.into_inner()), ..q };
        let tracks = made(q, &[q, negative, q]);
        assert_eq!(
            (tracks.len(), tracks[0].property),
            (1, Property::Translation),
            "kept, not empty"
        );
    }

    #[test]
    fn what_is_constant_but_not_at_rest_has_one_key() {
        let tracks = made(NodePose::IDENTITY, &[about_x(40.0); 3]);
        assert_eq!(tracks.len(), 1);
        assert_eq!((tracks[0].property, tracks[0].keys.len()), (Property::Rotation, 1));
    }
}
