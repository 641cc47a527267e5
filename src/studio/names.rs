//! Which files of a shot the page may see, and under which names.

use std::fs;
use std::path::{Path, PathBuf};

use super::refusal::{Refusal, Result};
use super::root::Root;
use crate::frames::strokes::numbered_files;
use crate::shot::{Shot, Stage, paths};

/// Folders of a shot whose files are shown.
const FOLDERS: [&str; 4] = ["masks", "strokes", "analysis", "keys"];

/// What the page can do with a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// The mask of a frame.
    Mask(usize),
    /// The strokes on a frame.
    Stroke(usize),
    /// `keys/keys.json`.
    Keys,
    /// `keys/weights.csv`.
    Weights,
    /// Everything else can be read only.
    ReadOnly,
}

impl Kind {
    pub(super) fn of(name: &str) -> Self {
        let frame = |folder: &str| -> Option<usize> {
            let digits = name.strip_prefix(folder)?.strip_suffix(".png")?;
            let plain = digits.len() >= 6 && digits.bytes().all(|b| b.is_ascii_digit());
            // Only one name a frame: no zeros beyond the six digits.
            digits.parse().ok().filter(|f| plain && format!("{f:06}") == digits)
        };
        if let Some(frame) = frame("masks/") {
            return Kind::Mask(frame);
        }
        if let Some(frame) = frame("strokes/") {
            return Kind::Stroke(frame);
        }
        match name {
            paths::KEYS => Kind::Keys,
            paths::WEIGHTS => Kind::Weights,
            _ => Kind::ReadOnly,
        }
    }
}

/// The path of a file of a shot by the name the page gives, be there such a file or not.
pub(super) fn path_of(root: &Root, shot: &Shot, name: &str) -> Result<PathBuf> {
    let relative = root.name(shot.folder());
    // Refuses what is not a plain relative path, and links that lead out.
    let direct = root.any(&format!("{relative}/{name}"))?;
    if name.starts_with('/') {
        return Err(Refusal::forbidden("names of files are relative to the shot"));
    }
    if !is_documented(shot, name) {
        return Err(Refusal::not_found(format!("{name}: a shot has no such file")));
    }
    match Kind::of(name) {
        Kind::Stroke(frame) if shot.settings.source.strokes.is_some() => stroke(root, shot, frame),
        _ => Ok(direct),
    }
}

/// Strokes can be in a folder of their own, under any numbered name.
fn stroke(root: &Root, shot: &Shot, frame: usize) -> Result<PathBuf> {
    let folder = shot.strokes_folder().unwrap_or_else(|| shot.path("strokes"));
    let there =
        if folder.is_dir() { numbered_files(&folder).unwrap_or_default() } else { Vec::new() };
    let path = match there.into_iter().find(|(f, _)| *f == frame) {
        Some((_, path)) => path,
        None => folder.join(format!("{frame:06}.png")),
    };
    root.any(&root.name(&path))
}

fn is_documented(shot: &Shot, name: &str) -> bool {
    if name.split('/').any(|part| part.is_empty() || part.starts_with('.')) {
        return false;
    }
    match name.split_once('/') {
        None => is_top_level(name) || made_by_animate(shot, name),
        Some((folder, file)) => {
            (FOLDERS.contains(&folder) && !file.contains('/')) || made_by_animate(shot, name)
        }
    }
}

fn is_top_level(name: &str) -> bool {
    name == paths::SETTINGS || name == paths::REPORT || name.starts_with("animation.")
}

/// Pictures and buffers that stand beside the animated rig.
fn made_by_animate(shot: &Shot, name: &str) -> bool {
    shot.made_files(Stage::Animate).iter().any(|file| file == name)
}

/// Every file the page may see, sorted by name.
pub(super) fn all(root: &Root, shot: &Shot) -> Vec<(String, PathBuf)> {
    let mut found: Vec<(String, PathBuf)> =
        files_in(root, shot.folder()).into_iter().filter(|(name, _)| is_top_level(name)).collect();
    for folder in FOLDERS {
        if folder == "strokes" && shot.settings.source.strokes.is_some() {
            continue;
        }
        let inside = files_in(root, &shot.folder().join(folder));
        found.extend(inside.into_iter().map(|(name, path)| (format!("{folder}/{name}"), path)));
    }
    if shot.settings.source.strokes.is_some()
        && let Ok(strokes) = shot.strokes()
    {
        let inside = strokes.into_iter().filter(|(_, path)| root.holds(path));
        found.extend(inside.map(|(frame, path)| (format!("strokes/{frame:06}.png"), path)));
    }
    for name in shot.made_files(Stage::Animate) {
        let path = shot.path(&name);
        if !found.iter().any(|(n, _)| *n == name) && path.is_file() && root.holds(&path) {
            found.push((name, path));
        }
    }
    found.sort();
    found
}

/// Plain files of a folder; links only when they stay inside the root.
fn files_in(root: &Root, folder: &Path) -> Vec<(String, PathBuf)> {
    let Ok(entries) = fs::read_dir(folder) else { return Vec::new() };
    if !root.holds(folder) {
        return Vec::new();
    }
    let mut files = Vec::new();
    for entry in entries.flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        let Ok(kind) = entry.file_type() else { continue };
        let path = entry.path();
        let plain = kind.is_file() || (kind.is_symlink() && path.is_file() && root.holds(&path));
        if plain && !name.starts_with('.') {
            files.push((name, path));
        }
    }
    files
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_say_what_can_be_written() {
        assert_eq!(Kind::of("masks/000012.png"), Kind::Mask(12));
        assert_eq!(Kind::of("strokes/1234567.png"), Kind::Stroke(1_234_567));
        assert_eq!(Kind::of("keys/keys.json"), Kind::Keys);
        for other in
            ["masks/12.png", "masks/0000012.png", "masks/+00012.png", "shot.toml", "keys/x"]
        {
            assert_eq!(Kind::of(other), Kind::ReadOnly, "{other}");
        }
    }
}
