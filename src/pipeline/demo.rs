//! The whole way on the built-in horse: the program plays the artist as well.

use std::path::Path;

use super::new::{NewShot, new_shot};
use super::stages::keys;
use super::{AnimationResult, Options, animate};
use crate::error::{Error, Result};
use crate::rig::Pose;
use crate::shot::{PoseOfKey, Shot, paths, write_atomically};
use crate::synthetic::{NamedClip, SyntheticFootage, to_glb};

/// Where the demo puts the rig with the key poses.
const RIG: &str = "rig/horse_with_key_poses.glb";

/// Makes a complete shot of the synthetic gallop in `folder`: footage to masks, verdict and keys;
/// then the poses of the key frames, as an artist would have made them (here from the motion that
/// was rendered), as a clip of the rig; then the animation.
///
/// # Errors
/// As the stages.
pub fn demo(folder: &Path, options: Options) -> Result<(Shot, AnimationResult)> {
    if !folder.join(paths::SETTINGS).is_file() {
        let wanted = NewShot { from: Some("synthetic:gallop".to_owned()), ..NewShot::default() };
        new_shot(folder, &wanted, false)?;
    }
    let mut shot = Shot::open(folder)?;
    let chosen = keys(&shot, options)?.keys;
    let Some(footage) = shot.synthetic()? else {
        return Err(Error::ShotExists { folder: folder.to_owned() });
    };
    let offset = shot.range()?.map_or(0, |r| r.first());
    let poses: Vec<Pose> =
        chosen.keys.iter().map(|k| pose_from_truth(&footage, k.frame + offset)).collect();
    let clip = NamedClip { name: "KeyPoses", fps: shot.fps(), poses: &poses };
    let rig = to_glb(footage.model(), &[clip], "horse");
    write_atomically(&shot.path(RIG), &rig)?;
    shot.settings.poses.rig = Some(RIG.to_owned());
    shot.settings.pose_of_key = chosen
        .keys
        .iter()
        .map(|k| PoseOfKey {
            key: k.key,
            clip: "KeyPoses".to_owned(),
            frame: u32::try_from(k.key - 1).ok(),
            time: None,
        })
        .collect();
    shot.save_settings()?;
    let animation = animate(&shot, options)?;
    Ok((shot, animation))
}

/// The pose that was rendered in a frame: what an artist who sees the key image would give.
#[must_use]
pub fn pose_from_truth(footage: &SyntheticFootage, frame: usize) -> Pose {
    footage.truth(frame).pose
}
