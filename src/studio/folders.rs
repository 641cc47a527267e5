//! What there is to open below the root.

use std::fs;
use std::path::Path;

use serde::Serialize;

use super::refusal::{Refusal, Result};
use super::root::Root;
use crate::frames::natural_order;
use crate::shot::paths;

const VIDEOS: [&str; 11] =
    ["mp4", "mov", "avi", "mkv", "webm", "m4v", "mpg", "mpeg", "wmv", "mts", "gif"];
const PICTURES: [&str; 9] = ["png", "jpg", "jpeg", "tif", "tiff", "exr", "webp", "bmp", "gif"];
const RIGS: [&str; 2] = ["glb", "gltf"];

/// Entries of a folder that are looked at to tell what it is.
const MOST_ENTRIES: usize = 100_000;

/// A folder's content.
#[derive(Debug, Serialize)]
pub(super) struct Listing {
    path: String,
    parent: Option<String>,
    entries: Vec<Entry>,
}

#[derive(Debug, Serialize)]
struct Entry {
    name: String,
    path: String,
    kind: &'static str,
    count: Option<usize>,
}

/// Lists a folder: folders first, each kind in natural order.
pub(super) fn browse(root: &Root, path: &str) -> Result<Listing> {
    let folder = root.existing(path)?;
    if !folder.is_dir() {
        return Err(Refusal::not_found(format!("{path}: this is not a folder")));
    }
    let read = fs::read_dir(&folder).map_err(crate::Error::io(&folder, "read"))?;
    let mut entries = Vec::new();
    for entry in read.flatten().take(MOST_ENTRIES) {
        let name = entry.file_name().to_string_lossy().into_owned();
        let path = entry.path();
        if !name.starts_with('.') && root.holds(&path) {
            let (kind, count) = kind(&path);
            entries.push(Entry { name, path: root.name(&path), kind, count });
        }
    }
    entries.sort_by(|a, b| {
        let plain = |e: &Entry| !matches!(e.kind, "folder" | "shot" | "images");
        plain(a).cmp(&plain(b)).then_with(|| natural_order(Path::new(&a.name), Path::new(&b.name)))
    });
    let parent = folder.parent().filter(|_| folder != root.folder()).map(|p| root.name(p));
    Ok(Listing { path: root.name(&folder), parent, entries })
}

fn kind(path: &Path) -> (&'static str, Option<usize>) {
    if path.is_dir() {
        if path.join(paths::SETTINGS).is_file() {
            return ("shot", None);
        }
        return match pictures_in(path) {
            0 => ("folder", None),
            count => ("images", Some(count)),
        };
    }
    if has_extension(path, &VIDEOS) {
        ("video", None)
    } else if has_extension(path, &RIGS) {
        ("rig", None)
    } else {
        ("file", None)
    }
}

fn pictures_in(folder: &Path) -> usize {
    let Ok(entries) = fs::read_dir(folder) else { return 0 };
    let paths = entries.flatten().take(MOST_ENTRIES).map(|e| e.path());
    paths.filter(|p| has_extension(p, &PICTURES)).count()
}

fn has_extension(path: &Path, known: &[&str]) -> bool {
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default();
    known.iter().any(|k| extension.eq_ignore_ascii_case(k))
}
