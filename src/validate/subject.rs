//! What is rendered: the built-in horse or a clip of a rig, with its true motion.

use std::path::PathBuf;

use nalgebra::{UnitQuaternion, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::unsteady::Unsteady;
use crate::error::Result;
use crate::mask::Mask;
use crate::rig::{
    Driven, File, KeyPoses, Model, NodePose, Pose, mean_rotation, rotation_from_vector,
    rotation_vector,
};
use crate::synthetic::{
    Camera, Gait, IN_PLANE_ANGLES, Projection, View, edge_noise, horse, silhouette,
};

/// What is rendered.
#[derive(Clone, Debug, PartialEq)]
pub enum Subject {
    /// The built-in horse.
    Horse(Gait),
    /// A clip of a rig, played as a loop.
    Rig {
        /// The glTF or GLB file.
        file: PathBuf,
        /// The clip's name.
        clip: String,
    },
}

/// How it is rendered.
#[derive(Clone, Debug, PartialEq)]
pub struct Shooting {
    /// Number of frames.
    pub frames: usize,
    /// Frames a cycle of the clip (for the horse: a stride), over 0.
    pub frames_per_cycle: f64,
    /// Camera yaw, radians.
    pub yaw_rad: f64,
    /// Share of edge pixels flipped, 0…1.
    pub noise: f64,
    /// Seed of the noise.
    pub seed: u64,
    /// Picture width and height, pixels.
    pub size_px: (usize, usize),
    /// Drift, variation and broken masks.
    pub unsteady: Unsteady,
}

/// The true motion of a rendered clip.
#[derive(Clone, Debug)]
pub struct Truth {
    /// What can be posed and drawn.
    pub model: Model,
    /// Channels the clip drives.
    pub driven: Vec<Driven>,
    /// The pose of each frame.
    pub poses: Vec<Pose>,
    /// The phase of each frame, cycles.
    pub phases_cycles: Vec<f64>,
    /// In-plane angles of the built-in horse, radians.
    pub in_plane_rad: Option<Vec<[f64; IN_PLANE_ANGLES]>>,
}

impl Truth {
    /// The true motion of a subject.
    ///
    /// # Errors
    /// When the rig cannot be read or has no such clip.
    pub fn of(subject: &Subject, shooting: &Shooting) -> Result<Self> {
        let unsteady = &shooting.unsteady;
        let phases = unsteady.phases(shooting.frames, shooting.frames_per_cycle, shooting.seed);
        let sizes = unsteady.amplitudes(&phases, shooting.seed);
        let mut found = Self::of_phases(subject, phases)?;
        found.resize(&sizes);
        Ok(found)
    }

    fn of_phases(subject: &Subject, phases: Vec<f64>) -> Result<Self> {
        match subject {
            Subject::Horse(gait) => Ok(Self::of_horse(*gait, phases)),
            Subject::Rig { file, clip } => {
                let file = File::read(file)?;
                let animation = file.animation(clip)?;
                let skeleton = file.skeleton();
                let poses = phases
                    .iter()
                    .map(|p| animation.sample(skeleton, p.fract() * animation.duration_s()))
                    .collect();
                let driven = animation.driven(skeleton);
                let model = file.model()?;
                Ok(Self { model, driven, poses, phases_cycles: phases, in_plane_rad: None })
            }
        }
    }

    fn of_horse(gait: Gait, phases: Vec<f64>) -> Self {
        let model = horse();
        let moments: Vec<_> = phases.iter().map(|&p| gait.pose(&model.skeleton, p)).collect();
        let driven = (0..model.skeleton.nodes.len())
            .map(|n| Driven { translation: n == 0, rotation: n > 0, scale: false })
            .collect();
        let in_plane = moments.iter().map(|m| m.angles_rad).collect();
        let poses = moments.into_iter().map(|m| m.pose).collect();
        Self { model, driven, poses, phases_cycles: phases, in_plane_rad: Some(in_plane) }
    }

    /// Makes each frame's difference from the mean pose of the clip so many times as large.
    fn resize(&mut self, sizes: &[f64]) {
        if sizes.iter().all(|s| *s == 1.0) {
            return;
        }
        let frames = self.poses.len() as f64;
        for node in 0..self.driven.len() {
            let own: Vec<NodePose> = self.poses.iter().map(|p| p.nodes[node]).collect();
            let mean = mean_rotation(&own.iter().map(|n| n.rotation).collect::<Vec<_>>());
            let place = own.iter().map(|n| n.translation).sum::<Vector3<f64>>() / frames;
            for ((pose, own), size) in self.poses.iter_mut().zip(own).zip(sizes) {
                let turn = rotation_vector(&(mean.inverse() * own.rotation)) * *size;
                pose.nodes[node] = NodePose {
                    rotation: mean * rotation_from_vector(&turn),
                    translation: place + (own.translation - place) * *size,
                    ..own
                };
            }
        }
        if self.in_plane_rad.is_some() {
            self.in_plane_rad = Some(in_plane_angles(&self.poses));
        }
    }

    /// The masks of all frames: orthographic, framed on the whole clip, with noise on their edges.
    /// Every frame has its own random numbers, so the masks do not depend on threads.
    #[must_use]
    pub fn masks(&self, shooting: &Shooting) -> Vec<Mask> {
        let view = View {
            yaw_rad: shooting.yaw_rad,
            projection: Projection::Orthographic,
            width: shooting.size_px.0,
            height: shooting.size_px.1,
        };
        let camera = Camera::framing(&self.model, &self.poses, view);
        let mut masks: Vec<Mask> = self
            .poses
            .par_iter()
            .enumerate()
            .map(|(t, pose)| {
                let mask = silhouette(&self.model, pose, &camera);
                let mut rng = ChaCha8Rng::seed_from_u64(shooting.seed);
                rng.set_stream(t as u64);
                edge_noise(&mask, shooting.noise, &mut rng)
            })
            .collect();
        shooting.unsteady.break_masks(&mut masks, shooting.seed);
        masks
    }

    /// The poses of some frames, as an artist would give them: all of the truth that the method ever
    /// sees.
    #[must_use]
    pub fn key_poses(&self, frames: &[usize]) -> KeyPoses {
        KeyPoses {
            poses: frames.iter().map(|&f| self.poses[f].clone()).collect(),
            driven: self.driven.clone(),
        }
    }
}

/// In-plane angles of poses of the horse: the turn about each joint's X axis, radians.
#[must_use]
pub fn in_plane_angles(poses: &[Pose]) -> Vec<[f64; IN_PLANE_ANGLES]> {
    let angle = |q: &UnitQuaternion<f64>| 2.0 * q.i.atan2(q.w);
    poses
        .iter()
        .map(|pose| std::array::from_fn(|joint| angle(&pose.nodes[joint + 1].rotation)))
        .collect()
}
