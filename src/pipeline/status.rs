//! Which stages of a shot are up to date, told without running any.

use super::animate::animate_reads;
use super::segment::segment_reads;
use super::stages::{analyze_reads, keys_reads, weights_reads};
use super::{NoProgress, Options};
use crate::error::Result;
use crate::rig::File;
use crate::shot::{Freshness, Reads, Shot, Stage};

/// How far a stage is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum StageState {
    /// It never ran.
    Missing,
    /// It ran on something else than what is there now.
    Stale,
    /// Running it would change nothing.
    Fresh,
}

/// The states of `segment`, `analyze`, `keys`, `weights` and `animate`, in order. A stage after one
/// that is not fresh is not fresh either; a stage whose inputs cannot be read is stale.
#[must_use]
pub fn stage_states(shot: &Shot) -> Vec<(Stage, StageState)> {
    let mut upstream_fresh = true;
    let stages: [(Stage, ReadsOf); 5] = [
        (Stage::Segment, &|shot| {
            segment_reads(shot, Options { progress: &NoProgress, force: false }).map(|r| r.0)
        }),
        (Stage::Analyze, &analyze_reads),
        (Stage::Keys, &keys_reads),
        (Stage::Weights, &weights_reads),
        (Stage::Animate, &reads_of_animate),
    ];
    stages
        .into_iter()
        .map(|(stage, reads)| {
            let state = state(shot, stage, upstream_fresh, reads);
            upstream_fresh &= state == StageState::Fresh;
            (stage, state)
        })
        .collect()
}

type ReadsOf<'a> = &'a dyn Fn(&Shot) -> Result<Reads>;

fn state(shot: &Shot, stage: Stage, upstream_fresh: bool, reads: ReadsOf) -> StageState {
    if shot.made_files(stage).is_empty() {
        return StageState::Missing;
    }
    let fresh = upstream_fresh
        && reads(shot).is_ok_and(|reads| shot.freshness(stage, &reads) == Freshness::UpToDate);
    if fresh { StageState::Fresh } else { StageState::Stale }
}

fn reads_of_animate(shot: &Shot) -> Result<Reads> {
    let Some(rig) = &shot.settings.poses.rig else { return Ok(Reads::new()) };
    animate_reads(shot, &File::read(&shot.path(rig))?)
}
