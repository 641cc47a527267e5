//! Nodes, poses and clips.

use nalgebra::{Matrix4, Quaternion, Translation3, UnitQuaternion, Vector3};

/// Local transform of one node relative to its parent: scale first, then rotation, then
/// translation (glTF order T·R·S). Lengths are in the rig's own unit, axes as in its file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NodePose {
    /// Translation, rig units.
    pub translation: Vector3<f64>,
    /// Rotation.
    pub rotation: UnitQuaternion<f64>,
    /// Scale along the node's axes.
    pub scale: Vector3<f64>,
}

impl NodePose {
    /// No translation, no rotation, scale one.
    pub const IDENTITY: Self = Self {
        translation: Vector3::new(0.0, 0.0, 0.0),
        rotation: UnitQuaternion::new_unchecked(Quaternion::new(1.0, 0.0, 0.0, 0.0)),
        scale: Vector3::new(1.0, 1.0, 1.0),
    };

    /// The matrix T·R·S from the node's space to its parent's.
    #[must_use]
    pub fn matrix(&self) -> Matrix4<f64> {
        Translation3::from(self.translation).to_homogeneous()
            * self.rotation.to_homogeneous()
            * Matrix4::new_nonuniform_scaling(&self.scale)
    }
}

/// One node of the hierarchy.
#[derive(Clone, Debug, PartialEq)]
pub struct Node {
    /// The name in the file, or `node N` for a nameless one.
    pub name: String,
    /// Index of the parent, `None` for a root.
    pub parent: Option<usize>,
    /// The transform the file gives the node when no animation plays.
    pub rest: NodePose,
}

/// All nodes of a rig, in the order of the file (a parent may come after its child).
#[derive(Clone, Debug, PartialEq)]
pub struct Skeleton {
    /// The nodes; a node's index here is its index in the file.
    pub nodes: Vec<Node>,
}

impl Skeleton {
    /// The pose in which every node has its rest transform.
    #[must_use]
    pub fn rest_pose(&self) -> Pose {
        Pose { nodes: self.nodes.iter().map(|n| n.rest).collect() }
    }
}

/// Which channels of a node an animation drives.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Driven {
    /// Translation is driven.
    pub translation: bool,
    /// Rotation is driven.
    pub rotation: bool,
    /// Scale is driven.
    pub scale: bool,
}

/// The local transform of every node at one moment, in skeleton order.
#[derive(Clone, Debug, PartialEq)]
pub struct Pose {
    /// One entry a node.
    pub nodes: Vec<NodePose>,
}

/// Poses on an even time grid: pose `i` is at `i / fps` seconds.
#[derive(Clone, Debug, PartialEq)]
pub struct Clip {
    /// The animation's name.
    pub name: String,
    /// Poses a second, finite and positive.
    pub fps: f64,
    /// One pose a frame.
    pub poses: Vec<Pose>,
    /// For each node of the skeleton, the channels that move with this clip. A channel that is
    /// not driven is not exported.
    pub driven: Vec<Driven>,
}
