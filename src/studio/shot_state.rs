//! Everything the page has to know of a shot.

use std::time::Duration;

use serde_json::{Map, Value, json};

use super::clips::Clips;
use super::desk::Desk;
use super::refusal::{Refusal, Result};
use super::root::Root;
use super::settings;
use crate::frames::strokes;
use crate::pipeline::{StageState, stage_states};
use crate::shot::{Shot, Stage, paths};

/// How long a video of unknown length is waited for before the page is told what is known so far.
const WAIT_FOR_LENGTH: Duration = Duration::from_secs(3);

/// Files the page of the shot is made from.
const REPORT_READS: [&str; 9] = [
    paths::SETTINGS,
    paths::SILHOUETTES,
    paths::PROJECTIONS,
    paths::SPECTRUM,
    paths::DIAGNOSIS,
    paths::KEYS,
    paths::WEIGHTS,
    paths::ANIMATION,
    paths::CONTACT_SHEET,
];

/// Size and length of the pictures.
pub(super) struct Extent {
    pub(super) size: (usize, usize),
    frames: usize,
    frames_known: bool,
    footage_version: Option<String>,
    /// Why footage that is named cannot be shown.
    problem: Option<Refusal>,
}

/// The answer to `GET /api/shot`.
pub(super) fn state(
    root: &Root,
    desk: &Desk,
    clips: &Clips,
    ended: impl FnOnce() + Send + 'static,
) -> Result<Value> {
    let shot = desk.shot()?;
    let extent = extent(&shot, clips, ended);
    let files = desk.snapshot(root, &shot);
    let mut stages: Map<String, Value> = stage_states(&shot)
        .into_iter()
        .map(|(stage, state)| (stage.name().to_owned(), json!({"state": state})))
        .collect();
    let report = report_state(&shot, |name| files.get(name).cloned());
    stages.insert("report".to_owned(), json!({"state": report}));
    Ok(json!({
        "shot": desk.name,
        "name": shot.name(),
        "width": extent.size.0,
        "height": extent.size.1,
        "frames": extent.frames,
        "frames_known": extent.frames_known,
        "fps": shot.fps(),
        "footage": extent.footage_version.is_some(),
        "footage_version": extent.footage_version,
        "footage_problem": extent.problem.map(|p| root.without_path(&p.sentence)),
        "settings": settings::as_json(&shot.settings),
        "settings_version": files.get(paths::SETTINGS),
        "stages": stages,
        "files": files,
        "edited": edited(&shot),
        "job": desk.job().map(|job| job.status()),
    }))
}

/// Files of all stages that were edited by hand.
fn edited(shot: &Shot) -> Vec<String> {
    use Stage::{Analyze, Animate, Keys, Overlay, Report, Segment, Sheets, Weights};
    let stages = [Segment, Analyze, Keys, Weights, Animate, Overlay, Sheets, Report];
    let mut files: Vec<String> =
        stages.into_iter().flat_map(|s| shot.edited_files(s).unwrap_or_default()).collect();
    files.sort();
    files
}

/// The page is fresh while every file it was made from is what it was then, and none is new.
fn report_state(shot: &Shot, version: impl Fn(&str) -> Option<String>) -> StageState {
    if shot.made_files(Stage::Report).is_empty() {
        return StageState::Missing;
    }
    let read = shot.recorded_reads(Stage::Report);
    let same = REPORT_READS.iter().all(|name| read.get(*name).cloned() == version(name));
    if same { StageState::Fresh } else { StageState::Stale }
}

/// Finds out how large and how long the pictures are: from the footage, else from mattes, strokes
/// or masks.
pub(super) fn extent(shot: &Shot, clips: &Clips, ended: impl FnOnce() + Send + 'static) -> Extent {
    let mut extent = Extent {
        size: (0, 0),
        frames: 0,
        frames_known: true,
        footage_version: None,
        problem: None,
    };
    match clips.of(shot, ended).and_then(|clip| clip.map(|c| Ok((c.size()?, c))).transpose()) {
        Ok(Some((size, clip))) => {
            extent.size = size;
            let masks = shot.mask_files().map_or(0, |masks| masks.len());
            let patience = if masks > 0 { Duration::ZERO } else { WAIT_FOR_LENGTH };
            let (frames, known) = clip.frames(patience);
            extent.frames = frames.max(masks);
            extent.frames_known = known || masks > 0;
            extent.footage_version = Some(clip.version.clone());
            return extent;
        }
        Ok(None) => {}
        Err(problem) => extent.problem = Some(problem),
    }
    if let Some((size, frames)) = without_footage(shot) {
        extent.size = size;
        extent.frames = frames;
    }
    extent
}

fn without_footage(shot: &Shot) -> Option<((usize, usize), usize)> {
    if shot.settings.source.mattes.is_some()
        && let Ok(mut mattes) = shot.mattes()
    {
        let frames = mattes.files().len();
        let first = mattes.next()?.ok()?;
        return Some(((first.width, first.height), frames));
    }
    let numbered = match shot.strokes() {
        Ok(strokes) if !strokes.is_empty() => strokes,
        _ => shot.mask_files().ok()?.into_iter().enumerate().collect(),
    };
    let (frame, path) = numbered.first()?;
    let first = strokes::read(path, *frame, None).ok()?;
    let frames =
        numbered.last()?.0 + 1 - if shot.settings.source.from.is_some() { 0 } else { *frame };
    Some(((first.width, first.height), frames))
}
