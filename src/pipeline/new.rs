//! Making a shot folder.

use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
use crate::frames::strokes::numbered_files;
use crate::shot::{SYNTHETIC_PREFIX, Shot, ShotFile, relative_to};
use crate::spectrum;

/// What the user says of a new shot; paths are relative to the working folder.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct NewShot {
    /// Video, folder, pattern or `synthetic:GAIT`.
    pub from: Option<String>,
    /// Ready mattes.
    pub mattes: Option<String>,
    /// The mattes are black where the animal is.
    pub invert: bool,
    /// Sketched strokes.
    pub strokes: Option<String>,
    /// Frames a second.
    pub fps: Option<f64>,
    /// `A-B`.
    pub frames: Option<String>,
    /// Left, top, width, height.
    pub foreground: Option<[usize; 4]>,
    /// Left, top, width, height.
    pub background: Option<[usize; 4]>,
}

/// What was found out about the source.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct NewShotReport {
    /// The shot folder.
    pub shot: PathBuf,
    /// Width and height of the frames, pixels.
    pub size_px: [usize; 2],
    /// Frames a second.
    pub fps: f64,
    /// Whether the rate was neither given nor stated by the source.
    pub fps_assumed: bool,
    /// Number of frames, where it is known before reading.
    pub frames: Option<usize>,
    /// What was noticed about the source, in words.
    pub findings: Vec<String>,
}

/// Makes the folder after a look at the source: its first frame is read and the rectangles are
/// checked against it, so that mistakes show before any work is done. Nothing is left behind when
/// the source cannot be used.
///
/// # Errors
/// Whatever opening the source fails with; [`Error::Rectangle`]; [`Error::ShotExists`] unless
/// `force`.
pub fn new_shot(folder: &Path, wanted: &NewShot, force: bool) -> Result<NewShotReport> {
    let here = Path::new(".");
    let here = std::path::absolute(here).map_err(Error::io(here, "find"))?;
    let inside = |path: &String| relative_to(folder, &here, path);
    let mut settings = ShotFile::default();
    let source = &mut settings.source;
    source.from = wanted
        .from
        .as_ref()
        .map(|from| if from.starts_with(SYNTHETIC_PREFIX) { from.clone() } else { inside(from) });
    source.mattes = wanted.mattes.as_ref().map(inside);
    source.invert_mattes = wanted.invert;
    source.strokes = wanted.strokes.as_ref().map(inside);
    source.fps = wanted.fps;
    source.frames.clone_from(&wanted.frames);
    source.foreground = wanted.foreground;
    source.background = wanted.background;

    // The folder need not exist yet: paths are resolved by name.
    let probe = Shot::unsaved(folder, settings.clone())?;
    let look = look_at(&probe)?;
    check_rectangles(&probe, look.size_px)?;
    settings.source.fps = wanted.fps.or(look.fps);
    if let Some(synthetic) = probe.synthetic()? {
        settings.analysis.gait = match synthetic.gait().is_symmetric() {
            true => spectrum::Gait::Symmetric,
            false => spectrum::Gait::Asymmetric,
        };
        if settings.source.foreground.is_none() && settings.source.background.is_none() {
            let (f, b) = synthetic.rectangles();
            settings.source.foreground = Some([f.x, f.y, f.width, f.height]);
            settings.source.background = Some([b.x, b.y, b.width, b.height]);
        }
    }
    let shot = Shot::create(folder, settings, force)?;
    Ok(NewShotReport {
        shot: folder.to_owned(),
        size_px: [look.size_px.0, look.size_px.1],
        fps: shot.fps(),
        fps_assumed: shot.settings.source.fps.is_none(),
        frames: look.frames,
        findings: look.findings,
    })
}

struct Look {
    size_px: (usize, usize),
    fps: Option<f64>,
    frames: Option<usize>,
    findings: Vec<String>,
}

fn look_at(shot: &Shot) -> Result<Look> {
    let mut look = Look { size_px: (0, 0), fps: None, frames: None, findings: Vec::new() };
    if let Some(mut footage) = shot.footage()? {
        look.size_px = (footage.width(), footage.height());
        look.fps = footage.fps();
        look.frames = footage.frame_count();
        look.findings = footage.findings();
        footage.next_frame()?;
    }
    if shot.settings.source.mattes.is_some() {
        let mut mattes = shot.mattes()?;
        look.frames = Some(mattes.files().len());
        look.findings.extend(mattes.findings().iter().map(ToString::to_string));
        if let Some(first) = mattes.next() {
            let first = first?;
            look.size_px = (first.width, first.height);
        }
    } else if let Some(folder) = shot.strokes_folder() {
        let files = numbered_files(&folder)?;
        if shot.settings.source.from.is_none() {
            look.frames = Some(files.len());
        }
        if let Some((frame, path)) = files.first() {
            let size = Some(look.size_px).filter(|s| *s != (0, 0));
            let first = crate::frames::strokes::read(path, *frame, size)?;
            look.size_px = (first.width, first.height);
        }
    }
    Ok(look)
}

fn check_rectangles(shot: &Shot, picture: (usize, usize)) -> Result<()> {
    let source = &shot.settings.source;
    for (which, rectangle) in [("foreground", source.foreground), ("background", source.background)]
    {
        let Some([x, y, width, height]) = rectangle else { continue };
        let right = x.checked_add(width).is_some_and(|r| r <= picture.0);
        let bottom = y.checked_add(height).is_some_and(|b| b <= picture.1);
        if !(right && bottom && width > 0 && height > 0) {
            let rectangle = [x, y, width, height];
            return Err(Error::Rectangle { which, rectangle, picture, least_px: 16 });
        }
    }
    Ok(())
}
