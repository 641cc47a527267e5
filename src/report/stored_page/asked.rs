//! What was asked of the program, and of which files; what to be wary of.

use std::path::{Path, PathBuf};

use crate::error::Result;
use crate::report::page::{Asked, FileHash};
use crate::rig::File;
use crate::shot::{
    FlaggedFrames, Input, Method, SYNTHETIC_PREFIX, Shot, Stage, StoredAnimation, hash_file,
    hash_files, paths,
};
use crate::silhouette::FrameReport;
use crate::spectrum::Gait;

/// What was asked, a line each, in the order of the work.
pub(super) fn asked(shot: &Shot) -> Result<Vec<Asked>> {
    let settings = &shot.settings;
    let source = &settings.source;
    let mut lines = Vec::new();
    let mut line = |what: &str, value: String| {
        lines.push(Asked { what: what.to_owned(), value });
    };
    for (what, place) in
        [("Footage", &source.from), ("Mattes", &source.mattes), ("Strokes", &source.strokes)]
    {
        if let Some(place) = place {
            line(what, place.clone());
        }
    }
    line(
        "Frames",
        source.frames.as_ref().map_or("all".to_owned(), |f| format!("{f} of the source")),
    );
    match source.fps {
        Some(fps) => line("Frame rate", format!("{fps} frames a second")),
        None => line("Frame rate", format!("not said: {} frames a second assumed", shot.fps())),
    }
    let rectangle = |[x, y, width, height]: [usize; 4]| {
        format!("{width} × {height} pixels, {x} from the left, {y} from the top")
    };
    if let Some(r) = source.foreground {
        line("Rectangle inside the animal", rectangle(r));
    }
    if let Some(r) = source.background {
        line("Rectangle clear of it", rectangle(r));
    }
    if let Ok(input) = shot.input() {
        line("Silhouettes", silhouettes(shot, input));
    }
    line("Gait", gait(settings.analysis.gait));
    let partners = if settings.keys.partners { ", each with a partner" } else { "" };
    line("Key images", format!("{}{partners}", settings.keys.count));
    line("Interpolation", interpolation(settings.animation.method).to_owned());
    if settings.animation.loop_strides > 0 {
        line("Loop", format!("{} stride(s)", settings.animation.loop_strides));
    }
    if settings.animation.retime != 1.0 {
        line("Speed", format!("{} times that of the footage", settings.animation.retime));
    }
    line("Rig", settings.poses.rig.clone().unwrap_or_else(|| "none named yet".to_owned()));
    if !settings.pose_of_key.is_empty() {
        line("Poses", format!("{} named, see the key images", settings.pose_of_key.len()));
    }
    Ok(lines)
}

fn silhouettes(shot: &Shot, input: Input) -> String {
    let synthetic =
        shot.settings.source.from.as_deref().is_some_and(|f| f.starts_with(SYNTHETIC_PREFIX));
    match input {
        Input::Mattes => "taken from the mattes".to_owned(),
        Input::Strokes => "the strokes themselves".to_owned(),
        Input::Footage if synthetic => "cut from the built-in animal's footage".to_owned(),
        Input::Footage => match shot.settings.silhouette.method {
            crate::silhouette::Method::Plate => {
                "cut from the footage by background, colour and place, over the whole clip"
                    .to_owned()
            }
            crate::silhouette::Method::Colour => "cut from the footage by colour alone".to_owned(),
        },
    }
}

fn gait(gait: Gait) -> String {
    match serde_json::to_value(gait) {
        Ok(serde_json::Value::String(name)) if name != "unknown" => name.replace('-', " "),
        _ => "not named".to_owned(),
    }
}

fn interpolation(method: Method) -> &'static str {
    match method {
        Method::Auto => "left to the program",
        Method::Phase => "a periodic spline over the gait phase",
        Method::Rbf => "one radial basis over all keys",
        Method::Switching => "switching models",
    }
}

/// Hashes of what the shot was made from. What cannot be read has none, and a warning says so.
///
/// # Errors
/// When a file of the shot itself cannot be read.
pub(super) fn inputs(shot: &Shot, warnings: &mut Vec<String>) -> Result<Vec<FileHash>> {
    let mut inputs = Vec::new();
    let mut add = |path: String, hash: String| inputs.push(FileHash { path, hash });
    add(paths::SETTINGS.to_owned(), hash_file(&shot.path(paths::SETTINGS))?);
    match source(shot) {
        Ok(Some((name, hash))) => add(name, hash),
        Ok(None) => {}
        Err(error) => warnings.push(format!(
            "The source was not there when this page was made, so its hash is missing: {error}."
        )),
    }
    if shot.path(&paths::mask(0)).is_file() {
        let masks = shot.mask_files()?;
        add(format!("masks: {} files", masks.len()), hash_files(&masks)?);
    }
    if let Some(rig) = &shot.settings.poses.rig {
        match rig_hash(&shot.path(rig)) {
            Ok((beside, hash)) => add(format!("{rig}{beside}"), hash),
            Err(error) => warnings.push(format!("The rig cannot be read: {error}.")),
        }
    }
    Ok(inputs)
}

/// Name and hash of the source; `None` when the program draws it itself.
fn source(shot: &Shot) -> Result<Option<(String, String)>> {
    let files = shot.source_files()?;
    let settings = &shot.settings.source;
    let named = settings.mattes.as_ref().or(settings.from.as_ref()).or(settings.strokes.as_ref());
    let name = named.cloned().unwrap_or_else(|| "strokes".to_owned());
    match files.as_slice() {
        [] => Ok(None),
        [one] => Ok(Some((name, hash_file(one)?))),
        many => Ok(Some((format!("{name}: {} files", many.len()), hash_files(many)?))),
    }
}

/// The hash of a rig and of the files it refers to.
fn rig_hash(path: &Path) -> Result<(String, String)> {
    let file = File::read(path)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let beside: Vec<PathBuf> = (file.referenced_files().into_iter())
        .map(|inside| folder.join(inside))
        .filter(|file| file.is_file())
        .collect();
    if beside.is_empty() {
        return Ok((String::new(), hash_file(path)?));
    }
    let words = format!(" and {} files it refers to", beside.len());
    let files: Vec<PathBuf> = std::iter::once(path.to_owned()).chain(beside).collect();
    Ok((words, hash_files(&files)?))
}

/// What to be wary of, a sentence each. The verdict's own reasons stand with the verdict.
///
/// # Errors
/// When a file of the shot cannot be read.
pub(super) fn warnings(
    shot: &Shot,
    reports: &[FrameReport],
    animation: Option<&StoredAnimation>,
) -> Result<Vec<String>> {
    let mut warnings = Vec::new();
    if shot.settings.source.fps.is_none() && shot.settings.source.from.is_some() {
        warnings.push(format!(
            "The frame rate is not known; {} frames a second are assumed, and every time and frequency with it.",
            shot.fps()
        ));
    }
    let excluded = reports.iter().filter(|r| r.is_excluded()).count();
    if excluded > 0 {
        let done = match shot.settings.analysis.flagged_frames {
            FlaggedFrames::LeaveOut => {
                "are left out of the analysis and bridged, unless that would be most of the clip"
            }
            FlaggedFrames::Use => "are used all the same, as the settings say",
        };
        warnings.push(format!(
            "{excluded} of {} frames have a doubtful silhouette; they {done}.",
            reports.len()
        ));
    }
    for (stage, what) in [
        (Stage::Segment, "silhouettes"),
        (Stage::Keys, "choice of keys"),
        (Stage::Weights, "weights"),
    ] {
        let edited = shot.edited_files(stage)?.len();
        if edited > 0 {
            warnings.push(format!("The {what} were edited by hand ({edited} file(s))."));
        }
    }
    if let Some(feet) = animation.and_then(|a| a.feet.as_ref()) {
        warnings.extend(feet.warnings.iter().map(|w| format!("Feet: {w}")));
    }
    Ok(warnings)
}
