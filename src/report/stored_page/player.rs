//! What the page's player plays: footage, outlines and the animated rig, within the page's size.

use nalgebra::Point3;
use serde::Serialize;

use crate::error::{Error, Result};
use crate::report::embedded::{Embedded, ScriptJson};
use crate::report::film::Film;
use crate::report::page::{Player, StripFrame};
use crate::report::png::base64;
use crate::report::rig_copy::rig_copy;
use crate::report::sheets::evenly_chosen;
use crate::rig::{Clip, File, Model};
use crate::shot::{CameraTable, Shot, StoredAnimation, paths, read};
use crate::silhouette::FrameReport;

/// Frames of the strip.
const STRIP_FRAMES: usize = 12;
/// Poses that the viewer's camera is framed on.
const FRAMED_POSES: usize = 24;
/// The way of the animal over the ground, in widths of the picture, from which its direction is
/// believed.
const LEAST_WAY: f64 = 0.05;

/// What the player's script reads; times are seconds.
#[derive(Serialize)]
struct PlayerData<'a> {
    fps: f64,
    frames: usize,
    size: (u32, u32),
    step: usize,
    pictures: Vec<Embedded>,
    outlines: &'a [String],
    keys: Vec<(usize, usize)>,
    animation: Option<Timing>,
    rig: Option<RigData>,
}

/// The animation's time axis beside the footage's.
#[derive(Clone, Copy, Serialize)]
struct Timing {
    duration: f64,
    /// When it begins in the footage, seconds.
    start: f64,
    /// Seconds of the footage a second of the animation.
    retime: f64,
    looped: bool,
}

/// The rig and where to look at it from.
#[derive(Serialize)]
struct RigData {
    glb: String,
    low: [f64; 3],
    high: [f64; 3],
    /// Where the animal goes in the rig's space.
    forward: [f64; 3],
    /// -1 when it goes to the left in the footage, else 1.
    heading: i8,
    /// Speed of the ground below the animal, rig units a second.
    ground_speed: f64,
    /// The node that the camera follows.
    follow: Option<usize>,
}

/// What stands in the page for the rig.
pub(super) struct RigShown {
    data: Option<RigData>,
    /// What is left out, or why there is no rig, in words.
    pub(super) note: Option<String>,
}

/// The strip of the footage: frames evenly spread.
pub(super) fn strip(film: &Film, reports: &[FrameReport], fps: f64) -> Vec<StripFrame> {
    let step = film.step.max(1);
    evenly_chosen(film.outlines.len(), STRIP_FRAMES)
        .into_iter()
        .map(|kept| {
            let frame = kept * step;
            let report = reports.get(frame);
            let words: Vec<&str> =
                report.iter().flat_map(|r| r.flags.iter()).map(|f| f.sentence()).collect();
            StripFrame {
                frame,
                time_s: frame as f64 / fps,
                picture: film.pictures.get(kept).map(|p| Embedded::jpeg(p)),
                outline: film.outlines[kept].clone(),
                words: words.join("; "),
                excludes: report.is_some_and(FrameReport::is_excluded),
            }
        })
        .collect()
}

/// The player's data; `None` without silhouettes.
///
/// # Errors
/// When stored files cannot be understood.
pub(super) fn player(
    shot: &Shot,
    film: &Film,
    keys: &[(usize, usize)],
    animation: Option<&StoredAnimation>,
    rig: Option<RigShown>,
) -> Result<Option<Player>> {
    if film.outlines.is_empty() {
        return Ok(None);
    }
    let timing = animation.map(|a| Timing {
        duration: a.frames.saturating_sub(1) as f64 / a.fps,
        start: a.first_frame as f64 / shot.fps(),
        retime: a.retime,
        looped: a.looped.is_some(),
    });
    let (rig, rig_note) = rig.map_or((None, None), |r| (r.data, r.note));
    let has_rig = rig.is_some();
    let data = PlayerData {
        fps: shot.fps(),
        frames: film.frames,
        size: film.size,
        step: film.step,
        pictures: film.pictures.iter().map(|p| Embedded::jpeg(p)).collect(),
        outlines: &film.outlines,
        keys: keys.to_vec(),
        animation: timing,
        rig,
    };
    Ok(Some(Player {
        width: film.size.0,
        height: film.size.1,
        frames: film.frames,
        has_rig,
        looped: timing.is_some_and(|t| t.looped),
        notes: film.note.iter().cloned().chain(rig_note).collect(),
        data: ScriptJson::of(&data)?,
    }))
}

/// The animated rig within `budget` letters: with its textures, else without, else not at all. What is
/// wrong with a rig leaves the page without it, and a note.
///
/// # Errors
/// [`Error::Interrupted`].
pub(super) fn rig(shot: &Shot, stored: &StoredAnimation, budget: usize) -> Result<RigShown> {
    let made = File::read(&shot.path(&stored.path)).and_then(|file| {
        let clip = file.animation(&stored.animation)?.clip(file.skeleton(), stored.fps)?;
        Ok((fitting(&file, &clip, budget)?, file, clip))
    });
    match made {
        Ok(((Some(glb), note), file, clip)) => {
            Ok(RigShown { data: Some(framed(shot, stored, &file, &clip, glb)?), note })
        }
        Ok(((None, note), ..)) => Ok(RigShown { data: None, note }),
        Err(Error::Interrupted) => Err(Error::Interrupted),
        Err(error) => {
            let note = format!("The animated rig cannot be shown here: {error}.");
            Ok(RigShown { data: None, note: Some(note) })
        }
    }
}

/// The rig as base64, and what was left out of it.
fn fitting(file: &File, clip: &Clip, budget: usize) -> Result<(Option<String>, Option<String>)> {
    let letters = |bytes: &[u8]| bytes.len().div_ceil(3) * 4;
    let morphs = has_morph_targets(file)
        .then(|| "Morph targets of the rig are not shown here; they are in the file.".to_owned());
    let full = rig_copy(file, clip, true)?;
    if letters(&full) <= budget {
        return Ok((Some(base64(&full)), morphs));
    }
    let bare = rig_copy(file, clip, false)?;
    if letters(&bare) <= budget {
        let mut note = "The rig's textures are left out here, to keep this page small.".to_owned();
        if let Some(morphs) = morphs {
            note = format!("{note} {morphs}");
        }
        return Ok((Some(base64(&bare)), Some(note)));
    }
    let megabytes = letters(&bare) as f64 / 1e6;
    let note = format!(
        "The rig is too heavy for this page ({megabytes:.1} MB even without textures): open the animated file in a viewer."
    );
    Ok((None, Some(note)))
}

fn has_morph_targets(file: &File) -> bool {
    let meshes = file.document().get("meshes").and_then(|m| m.as_array());
    let mut primitives =
        meshes.into_iter().flatten().filter_map(|m| m.get("primitives")?.as_array()).flatten();
    primitives.any(|p| p.get("targets").is_some())
}

fn framed(
    shot: &Shot,
    stored: &StoredAnimation,
    file: &File,
    clip: &Clip,
    glb: String,
) -> Result<RigData> {
    let feet = stored.feet.as_ref();
    let follow = feet
        .and_then(|f| f.root_node.as_deref())
        .and_then(|name| file.skeleton().nodes.iter().position(|n| n.name == name));
    let (low, high) = bounds(&file.model()?, clip, follow);
    Ok(RigData {
        glb,
        low,
        high,
        forward: feet.map_or([0.0, 0.0, 1.0], |f| f.forward),
        heading: heading(shot)?,
        ground_speed: feet.filter(|_| follow.is_none()).map_or(0.0, |f| f.ground_speed),
        follow,
    })
}

/// Least and largest coordinates of all vertices over the clip, relative to where the followed node is.
fn bounds(model: &Model, clip: &Clip, follow: Option<usize>) -> ([f64; 3], [f64; 3]) {
    let place = |pose| {
        follow.map_or_else(Point3::origin, |node| {
            let at = model.skeleton.world_matrices(pose)[node].transform_point(&Point3::origin());
            Point3::new(at.x, 0.0, at.z)
        })
    };
    let start = clip.poses.first().map_or_else(Point3::origin, place);
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for frame in evenly_chosen(clip.poses.len(), FRAMED_POSES) {
        let pose = &clip.poses[frame];
        let moved = place(pose) - start;
        for vertex in model.posed_vertices(pose).iter().flatten() {
            let at = vertex - moved;
            for axis in 0..3 {
                low[axis] = low[axis].min(at[axis]);
                high[axis] = high[axis].max(at[axis]);
            }
        }
    }
    if low[0] <= high[0] { (low, high) } else { ([-0.5; 3], [0.5; 3]) }
}

/// Whether the animal goes to the left (-1) in the footage, by its way over the background; 1 where
/// that cannot be told.
pub(in crate::report) fn heading(shot: &Shot) -> Result<i8> {
    let path = shot.path(paths::CAMERA);
    if !path.is_file() {
        return Ok(1);
    }
    let camera = CameraTable::from_csv(&path, &read(&path)?)?;
    let reports = shot.frame_reports()?;
    let mut way_px = 0.0;
    for (pair, step) in reports.windows(2).zip(camera.path.steps().iter().skip(1)) {
        if let (Some(before), Some(now)) = (pair[0].centre_px, pair[1].centre_px) {
            way_px += now.0 - step.from_previous.apply(before.0, before.1).0;
        }
    }
    let width = shot.first_mask()?.width() as f64;
    Ok(if way_px < -LEAST_WAY * width { -1 } else { 1 })
}
