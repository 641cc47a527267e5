//! Making a shot: what `muybridge new` does, with paths below the root.

use serde::Deserialize;
use serde_json::Value;

use super::refusal::{Refusal, Result};
use super::root::Root;
use crate::pipeline::{self, NewShot};

/// What `POST /api/shots` asks for.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Wanted {
    shot: String,
    #[serde(default)]
    from: Option<String>,
    #[serde(default)]
    mattes: Option<String>,
    #[serde(default)]
    invert: bool,
    #[serde(default)]
    strokes: Option<String>,
    #[serde(default)]
    fps: Option<f64>,
    #[serde(default)]
    frames: Option<String>,
    #[serde(default)]
    foreground: Option<[usize; 4]>,
    #[serde(default)]
    background: Option<[usize; 4]>,
    #[serde(default)]
    force: bool,
}

/// Makes the shot; the document of `new --json`.
pub(super) fn make(root: &Root, wanted: &Wanted) -> Result<Value> {
    let folder = root.any(&wanted.shot)?;
    if folder == root.folder() || folder.is_file() {
        return Err(Refusal::unusable("a shot needs a folder of its own"));
    }
    if root.name(&folder).split('/').any(|part| part.starts_with('.')) {
        return Err(Refusal::unusable("a shot's folder cannot be hidden"));
    }
    let none = wanted.from.is_none() && wanted.mattes.is_none() && wanted.strokes.is_none();
    if none {
        return Err(Refusal::unusable("a shot needs footage, mattes or strokes"));
    }
    let source = |path: &Option<String>| path.as_deref().map(|p| root.source(p)).transpose();
    let settings = NewShot {
        from: source(&wanted.from)?,
        mattes: source(&wanted.mattes)?,
        invert: wanted.invert,
        strokes: source(&wanted.strokes)?,
        fps: wanted.fps,
        frames: wanted.frames.clone(),
        foreground: wanted.foreground,
        background: wanted.background,
    };
    let report = pipeline::new_shot(&folder, &settings, wanted.force)?;
    let report = serde_json::to_value(report).map_err(|_| Refusal::defect())?;
    Ok(root.without_paths(report))
}
