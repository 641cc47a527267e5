//! The artist's rig: nodes, rest pose, skins, meshes, and clips of poses over time.

mod model;
mod pose;

pub use model::{Mesh, Model, Skin, SkinWeights};
pub use pose::{Clip, Driven, Node, NodePose, Pose, Skeleton};
