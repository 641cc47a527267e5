//! Poses and weights to the animated rig.

use std::path::{Path, PathBuf};

use super::choose::resolved_method;
use super::feet;
use super::mirror;
use super::pan::{self, Pan};
use super::stages::{json, weights};
use super::timing::{self, LoopTiming, Timed};
use super::{Options, Outcome};
use crate::error::{Error, Result};
use crate::export::{BvhSettings, append_animation_with_extras, bvh};
use crate::interpolate::{Seam, blend, largest_step, smoothest_start};
use crate::rig::{Clip, File, KeyPoses, Moment, PoseSpec};
use crate::shot::{
    Freshness, Method, PoseOfKey, Reads, Shot, Stage, StoredAnimation, StoredLoop, WeightTable,
    hash_file, hash_files, hash_value, paths, read,
};

/// What `animate` made.
#[derive(Clone, Debug)]
pub struct AnimationResult {
    /// What is stored in `animation.json`.
    pub animation: StoredAnimation,
    /// What was done to the folder.
    pub outcome: Outcome,
    /// Files beside the rig that the animated file refers to (textures, buffers); a copy elsewhere
    /// needs them too.
    pub referenced_files: Vec<PathBuf>,
}

/// Writes the animated rig (`animation.glb` or `.gltf`), `animation.bvh` and `animation.json`.
///
/// # Errors
/// [`Error::PosesMissing`] when no rig is named or a key has no pose; as the stages before and the
/// reading of the rig.
pub fn animate(shot: &Shot, options: Options) -> Result<AnimationResult> {
    let (_, table) = weights(shot, options.for_earlier_stage())?;
    let Some(rig) = &shot.settings.poses.rig else {
        return Err(missing(shot, "no rig with key poses is named".to_owned()));
    };
    let file = File::read(&shot.path(rig))?;
    let specs = pose_specs(shot, table.posed())?;
    let reads = animate_reads(shot, &file)?;
    let outside = file.referenced_files();
    if !options.force && shot.freshness(Stage::Animate, &reads) == Freshness::UpToDate {
        let outcome = Outcome { ran: false, kept: shot.edited_files(Stage::Animate)? };
        let animation = shot.animation()?;
        return Ok(AnimationResult { animation, outcome, referenced_files: outside });
    }
    let (animation, outcome) = write(shot, &file, &specs, &table, reads, options)?;
    Ok(AnimationResult { animation, outcome, referenced_files: outside })
}

/// What the animation depends on.
pub(super) fn animate_reads(shot: &Shot, file: &File) -> Result<Reads> {
    let mut rig_files = vec![file.path().to_owned()];
    rig_files.extend(file.referenced_files().into_iter().filter(|f| f.is_file()));
    let settings = (
        &shot.settings.animation,
        &shot.settings.feet,
        &shot.settings.pose_of_key,
        shot.fps(),
        shot.name(),
    );
    let segment = shot.diagnosis()?.animated_frames();
    let mut reads = Reads::from([
        ("segment".to_owned(), format!("{}-{}", segment.start, segment.end)),
        ("weights".to_owned(), hash_file(&shot.path(paths::WEIGHTS))?),
        ("rig".to_owned(), hash_files(&rig_files)?),
        ("settings".to_owned(), hash_value(&settings)),
    ]);
    timing::reads(shot, &mut reads)?;
    pan::reads(shot, &mut reads)?;
    Ok(reads)
}

fn write(
    shot: &Shot,
    file: &File,
    specs: &[PoseSpec],
    table: &WeightTable,
    reads: Reads,
    options: Options,
) -> Result<(StoredAnimation, Outcome)> {
    let settings = &shot.settings.animation;
    let frames = animated_frames(shot, table)?;
    let Timed { values, fps, looped } = timing::timed(shot, table, frames.clone())?;
    let name = if settings.name.is_empty() { shot.name() } else { settings.name.clone() };
    let mut poses = KeyPoses::read(file, specs, shot.fps())?;
    let exchanged_sides = if table.mirrored > 0 {
        mirror::exchanged(shot, file, table, &mut poses)?
    } else {
        Vec::new()
    };
    let mut clip = blend(&name, fps, file.skeleton(), &poses, &values)?;
    if !options.progress.step(Stage::Animate, 1, Some(2)) {
        return Err(Error::Interrupted);
    }
    let pan = Pan::of(shot, frames.clone())?;
    // A loop is stretched to whole frames.
    let faster = settings.retime / looped.map_or(1.0, |l| l.stretch);
    let mut ground = feet::stand(shot, file, &mut clip, looped.is_some(), pan, faster)?;
    if looped.is_some() {
        let start = smoothest_start(&clip);
        begin_at(&mut clip, start);
        if let Some(ground) = &mut ground {
            ground.begin_at(start);
        }
    }
    let looped = looped.map(|timing| stored_loop(timing, &clip));
    let feet = ground.map(|ground| ground.finish(shot, file, &mut clip));
    let extras = feet.as_ref().map(feet::extras);
    let appended = append_animation_with_extras(file, &clip, extras.as_ref())?;
    let path = format!("animation.{}", appended.extension);
    let mut writer = shot.begin(Stage::Animate, reads, options.force)?;
    writer.put(&path, &appended.bytes)?;
    for (inside, from) in beside(file.path(), &appended.referenced_files) {
        writer.put(&inside, &read(&from)?)?;
    }
    if settings.bvh {
        let text = bvh(file.skeleton(), &file.joints()?, &clip, &BvhSettings::default())?;
        writer.put(paths::BVH, text.as_bytes())?;
    }
    let (keys, has_phase) = (shot.keys(table.frames())?, shot.phase(table.frames())?.is_some());
    let switching = !keys.partner_frames().is_empty();
    let method = match resolved_method(settings.method, switching, has_phase)? {
        Method::Phase => "phase",
        Method::Switching => "switching",
        _ => "rbf",
    };
    let sums: Vec<f64> = values.chunks(table.poses).map(|row| row.iter().sum()).collect();
    let step = largest_step(&clip);
    let animation = StoredAnimation {
        path,
        animation: appended.animation,
        fps,
        frames: clip.poses.len(),
        first_frame: frames.start,
        method: method.to_owned(),
        mirrored_poses: table.mirrored,
        exchanged_sides,
        weight_range: range(&values),
        sum_range: range(&sums),
        largest_step_deg: step.angle_deg,
        largest_step_frame: step.frame,
        moved_nodes: poses.driven.iter().filter(|d| d.translation || d.rotation || d.scale).count(),
        retime: settings.retime,
        looped,
        feet,
    };
    writer.put(paths::ANIMATION, &json(&animation)?)?;
    let kept = writer.commit()?.kept;
    Ok((animation, Outcome { ran: true, kept }))
}

/// The frames of the chosen segment. A table of another length has been edited and is taken whole.
fn animated_frames(shot: &Shot, table: &WeightTable) -> Result<std::ops::Range<usize>> {
    let diagnosis = shot.diagnosis()?;
    let fits = diagnosis.frames == table.frames();
    Ok(if fits { diagnosis.animated_frames() } else { 0..table.frames() })
}

/// Lets a loop begin with another of its poses.
fn begin_at(clip: &mut Clip, start: usize) {
    clip.poses.pop();
    clip.poses.rotate_left(start);
    clip.poses.extend(clip.poses.first().cloned());
}

fn stored_loop(timing: LoopTiming, clip: &Clip) -> StoredLoop {
    StoredLoop {
        strides: timing.strides,
        strides_seen: timing.strides_seen,
        duration_s: clip.poses.len().saturating_sub(1) as f64 / clip.fps,
        stretch: timing.stretch,
        seam: Seam::of(clip),
    }
}

/// External files of a rig with the path they need in the shot: the same relative to the animated
/// file as they had to the rig. What lies outside the rig's folder cannot be kept in the shot's.
fn beside(rig: &Path, referenced: &[PathBuf]) -> Vec<(String, PathBuf)> {
    let folder = rig.parent().unwrap_or(Path::new(""));
    referenced
        .iter()
        .filter(|path| path.is_file())
        .filter_map(|path| {
            let inside = path.strip_prefix(folder).ok()?;
            let plain = inside.components().all(|c| matches!(c, std::path::Component::Normal(_)));
            plain.then(|| (inside.to_string_lossy().replace('\\', "/"), path.clone()))
        })
        .collect()
}

fn range(values: &[f64]) -> [f64; 2] {
    let low = values.iter().copied().fold(f64::INFINITY, f64::min);
    let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    [low, high]
}

/// One pose for each of the first `wanted` keys; poses of other keys are not needed and not read.
fn pose_specs(shot: &Shot, wanted: usize) -> Result<Vec<PoseSpec>> {
    let named = &shot.settings.pose_of_key;
    let lacking: Vec<String> = (1..=wanted)
        .filter(|key| !named.iter().any(|p| p.key == *key))
        .map(|key| key.to_string())
        .collect();
    if !lacking.is_empty() {
        let what = format!("no pose is named for key {}", lacking.join(", "));
        return Err(missing(shot, what));
    }
    named.iter().filter(|p| p.key <= wanted).map(|p| pose_spec(shot, p)).collect()
}

fn pose_spec(shot: &Shot, pose: &PoseOfKey) -> Result<PoseSpec> {
    let at = match (pose.frame, pose.time) {
        (Some(_), Some(_)) => {
            return Err(missing(
                shot,
                format!("the pose of key {} has a frame and a time", pose.key),
            ));
        }
        (Some(frame), None) => Moment::Frame(frame),
        (None, Some(time)) => Moment::Time(time),
        (None, None) => Moment::Frame(0),
    };
    Ok(PoseSpec { key: pose.key, clip: pose.clip.clone(), at })
}

fn missing(shot: &Shot, what: String) -> Error {
    Error::PosesMissing { shot: shot.folder().to_owned(), what }
}
