//! One file a command, each with `execute`.

pub(crate) mod analyze;
pub(crate) mod animate;
pub(crate) mod completions;
pub(crate) mod demo;
pub(crate) mod keys;
pub(crate) mod new;
pub(crate) mod render;
pub(crate) mod report;
pub(crate) mod run;
pub(crate) mod samples;
pub(crate) mod segment;
pub(crate) mod studio;
pub(crate) mod validate;

use std::path::Path;

use muybridge::pipeline::Options;
use muybridge::shot::{Lock, Shot};

use crate::args;
use crate::terminal::Bars;

/// Opens a shot and keeps other processes out of it.
fn open(stage: &args::Stage) -> anyhow::Result<(Shot, Lock)> {
    let shot = Shot::open(&stage.shot)?;
    let lock = shot.lock()?;
    Ok((shot, lock))
}

fn options<'a>(bars: &'a Bars, force: bool) -> Options<'a> {
    Options { progress: bars, force }
}

/// A path as it is shown to the user.
fn shown(path: &Path) -> String {
    path.display().to_string()
}
