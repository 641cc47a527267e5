//! The artist's rig: nodes, rest pose, skins, meshes, and clips of poses over time, read from
//! glTF 2.0 files (`.glb`, or `.gltf` with `data:` or external buffers).
//!
//! [`File`] holds a file as it is; [`File::skeleton`], [`File::model`] and [`File::animation`]
//! read what they name and nothing else, so that a rig with, say, compressed meshes can still be
//! animated. [`KeyPoses`] picks the poses of the key images.

mod accessor;
mod animation;
pub(crate) mod container;
mod file;
mod key_poses;
mod meshes;
mod mirror;
mod model;
mod nodes;
mod pose;
mod rotation;
mod sides;
mod surface;
mod uri;

pub use animation::Animation;
pub use file::{File, referenced_files};
pub use key_poses::{KeyPoses, Moment, PoseSpec};
pub use mirror::{Mirror, NoMirror};
pub use model::{Mesh, Model, Skin, SkinWeights};
pub use pose::{Clip, Driven, Node, NodePose, Pose, Skeleton};
pub use rotation::{angle_between_rad, mean_rotation, rotation_from_vector, rotation_vector};
pub use surface::{Look, Surface};
