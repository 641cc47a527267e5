//! What each command does on a shot, and the document it answers with: the stages of the pipeline
//! together with the sheets and the page that belong to them. The command line and the studio both
//! call these, so that both leave the same files.

use std::path::Path;

use serde::Serialize;

use crate::error::{Error, Result};
use crate::pipeline::{self, AnalyzeResult, AnimationResult, KeysResult, Options, SegmentSummary};
use crate::report::{self, OverlayDrawn};
use crate::shot::{Shot, Stage, StoredAnimation, StoredDiagnosis, StoredKeys, paths};

/// What `segment --json` prints.
#[derive(Clone, Debug, Serialize)]
pub struct SegmentDocument {
    /// The masks.
    #[serde(flatten)]
    pub summary: SegmentSummary,
    /// The sheet, when it was asked for.
    pub overlay: Option<OverlayDocument>,
}

/// The sheet of outlines in `segment --json`.
#[derive(Clone, Debug, Serialize)]
pub struct OverlayDocument {
    /// Where it is.
    pub path: String,
    /// What is on it.
    #[serde(flatten)]
    pub drawn: OverlayDrawn,
}

/// What `report --json` prints.
#[derive(Clone, Debug, Serialize)]
pub struct ReportDocument {
    /// Where the page is.
    pub report: String,
    /// Where the movie is; null when none was asked for.
    pub movie: Option<String>,
}

/// What `report` did.
#[derive(Debug)]
pub struct Reported {
    /// What `report --json` prints.
    pub document: ReportDocument,
    /// Files edited by hand that were kept.
    pub kept: Vec<String>,
    /// Why the sheets were not drawn again; the page shows the ones there are.
    pub sheets_left: Option<Error>,
}

/// What `run --json` prints.
#[derive(Clone, Debug, Serialize)]
pub struct RunDocument {
    /// The masks.
    pub segment: SegmentSummary,
    /// The verdict.
    pub analyze: StoredDiagnosis,
    /// The keys.
    pub keys: StoredKeys,
    /// The animation; null when no rig is named.
    pub animate: Option<StoredAnimation>,
    /// Where the page is.
    pub report: String,
}

/// `segment`: masks, and with `overlay` the outlines over the footage.
///
/// # Errors
/// As [`pipeline::segment`] and [`report::draw_overlay`].
pub fn segment(shot: &Shot, overlay: bool, options: Options) -> Result<SegmentDocument> {
    let summary = pipeline::segment(shot, options)?;
    let drawn = overlay.then(|| report::draw_overlay(shot, options.force)).transpose()?;
    let overlay = drawn.map(|drawn| OverlayDocument { path: shown(shot, paths::OVERLAY), drawn });
    Ok(SegmentDocument { summary, overlay })
}

/// `analyze`: the verdict, and the page with it.
///
/// # Errors
/// As [`pipeline::analyze`] and [`report::write_page`].
pub fn analyze(shot: &Shot, options: Options) -> Result<AnalyzeResult> {
    let result = pipeline::analyze(shot, options)?;
    report::write_page(shot, false)?;
    Ok(result)
}

/// `keys`: the keys, their weights and the sheets to pose by.
///
/// # Errors
/// As [`pipeline::keys`], [`pipeline::weights`] and [`report::draw_sheets`].
pub fn keys(shot: &Shot, options: Options) -> Result<KeysResult> {
    let result = pipeline::keys(shot, options)?;
    pipeline::weights(shot, options.for_earlier_stage())?;
    report::draw_sheets(shot, options.force)?;
    Ok(result)
}

/// `animate`: the animated rig.
///
/// # Errors
/// As [`pipeline::animate`].
pub fn animate(shot: &Shot, options: Options) -> Result<AnimationResult> {
    pipeline::animate(shot, options)
}

/// What `animate --json` prints: the animation with its path as the user would type it.
#[must_use]
pub fn animate_document(shot: &Shot, animation: &StoredAnimation) -> StoredAnimation {
    StoredAnimation { path: shown(shot, &animation.path), ..animation.clone() }
}

/// `report`: sheets, plots and page, as far as the shot has come, and the movie, if it is asked for. A
/// page can be made of what is stored, even where the footage is not at hand.
///
/// # Errors
/// As [`report::draw_sheets`] when interrupted, [`report::write_page`] and [`report::write_movie`].
pub fn report(shot: &Shot, movie: Option<&Path>, options: Options) -> Result<Reported> {
    let sheets_left = match report::can_draw_sheets(shot) {
        true => match report::draw_sheets(shot, options.force) {
            Err(Error::Interrupted) => return Err(Error::Interrupted),
            drawn => drawn.err(),
        },
        false => None,
    };
    let kept = report::write_page(shot, options.force)?;
    if let Some(file) = movie {
        let progress =
            |done: usize, total: usize| options.progress.step(Stage::Report, done, Some(total));
        report::write_movie(shot, file, &progress)?;
    }
    let document = ReportDocument {
        report: shown(shot, paths::REPORT),
        movie: movie.map(|file| file.display().to_string()),
    };
    Ok(Reported { document, kept, sheets_left })
}

/// `run`: every stage that can run, in order; also the files edited by hand that were kept.
///
/// # Errors
/// As the stages.
pub fn run(shot: &Shot, options: Options) -> Result<(RunDocument, Vec<String>)> {
    let segment = pipeline::segment(shot, options)?;
    let analyzed = pipeline::analyze(shot, options)?;
    let chosen = pipeline::keys(shot, options)?;
    pipeline::weights(shot, options)?;
    report::draw_sheets(shot, options.force)?;
    let animate = match &shot.settings.poses.rig {
        Some(_) => Some(pipeline::animate(shot, options)?.animation),
        None => None,
    };
    let mut kept = segment.kept.clone();
    kept.extend(analyzed.outcome.kept);
    kept.extend(chosen.outcome.kept);
    kept.extend(report::write_page(shot, options.force)?);
    let document = RunDocument {
        segment,
        analyze: analyzed.diagnosis,
        keys: chosen.keys,
        animate,
        report: shown(shot, paths::REPORT),
    };
    Ok((document, kept))
}

fn shown(shot: &Shot, file: &str) -> String {
    shot.path(file).display().to_string()
}
