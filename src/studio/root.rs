//! The folder below which everything is that the page may name.

use std::path::{Component, Path, PathBuf};

use serde_json::Value;

use super::refusal::{Refusal, Result};
use crate::error::Error;
use crate::frames::{self, SourceSpec};
use crate::shot::SYNTHETIC_PREFIX;

/// The root folder, without symbolic links in its own path.
#[derive(Clone, Debug)]
pub(super) struct Root {
    folder: PathBuf,
}

impl Root {
    pub(super) fn new(folder: &Path) -> std::result::Result<Self, Error> {
        let folder = std::fs::canonicalize(folder).map_err(Error::io(folder, "open"))?;
        Ok(Self { folder })
    }

    pub(super) fn folder(&self) -> &Path {
        &self.folder
    }

    /// The root folder's own name.
    pub(super) fn title(&self) -> String {
        self.folder.file_name().map_or_else(|| "/".to_owned(), |n| n.to_string_lossy().into_owned())
    }

    /// What exists under a path given by the page, symbolic links followed.
    pub(super) fn existing(&self, path: &str) -> Result<PathBuf> {
        let wanted = self.folder.join(plain(path)?);
        let found = std::fs::canonicalize(&wanted)
            .map_err(|_| Refusal::not_found(format!("{path}: there is no such file or folder")))?;
        self.inside(found)
    }

    /// Where a path given by the page points, be there something or not: the part that exists must
    /// be inside the root.
    pub(super) fn any(&self, path: &str) -> Result<PathBuf> {
        let wanted = self.folder.join(plain(path)?);
        for known in wanted.ancestors() {
            let Ok(real) = std::fs::canonicalize(known) else { continue };
            let rest = wanted.strip_prefix(known).unwrap_or(Path::new(""));
            let real = self.inside(real)?;
            return Ok(if rest.as_os_str().is_empty() { real } else { real.join(rest) });
        }
        Err(outside())
    }

    /// Passes a path without symbolic links when it is below the root.
    pub(super) fn inside(&self, real: PathBuf) -> Result<PathBuf> {
        if real.starts_with(&self.folder) { Ok(real) } else { Err(outside()) }
    }

    /// Whether what a path leads to is below the root.
    pub(super) fn holds(&self, path: &Path) -> bool {
        std::fs::canonicalize(path).is_ok_and(|real| real.starts_with(&self.folder))
    }

    /// A path below the root as the page knows it: relative, with `/`.
    pub(super) fn name(&self, path: &Path) -> String {
        let inside = path.strip_prefix(&self.folder).unwrap_or(path);
        let parts: Vec<_> = inside.components().map(|c| c.as_os_str().to_string_lossy()).collect();
        parts.join("/")
    }

    /// Where a source of footage, mattes or strokes given by the page is: a video, a folder or a
    /// pattern. Every picture it stands for must be inside the root.
    pub(super) fn source(&self, source: &str) -> Result<String> {
        if source.starts_with(SYNTHETIC_PREFIX) {
            return Ok(source.to_owned());
        }
        let location = self.any(source)?;
        self.check_source(&location)?;
        Ok(location.to_string_lossy().into_owned())
    }

    /// Checks every file that a source stands for.
    pub(super) fn check_source(&self, location: &Path) -> Result<()> {
        let folder = location.parent().unwrap_or(location);
        let patterned = folder.to_string_lossy().contains(['*', '?', '[', '%']);
        if patterned && !folder.is_dir() {
            return Err(Refusal::unusable("only the last part of a pattern may hold wildcards"));
        }
        // What cannot be listed is explained by whoever reads it.
        let files = frames::source_files(&SourceSpec::new(location)).unwrap_or_default();
        if files.iter().all(|file| self.holds(file)) { Ok(()) } else { Err(outside()) }
    }

    /// A text without the root folder's own path, which is nobody's business.
    pub(super) fn without_path(&self, text: &str) -> String {
        let own = self.folder.to_string_lossy();
        if own.len() < 2 {
            return text.to_owned();
        }
        text.replace(&format!("{own}{}", std::path::MAIN_SEPARATOR), "")
            .replace(&*own, &self.title())
    }

    /// The same for every text of a document.
    pub(super) fn without_paths(&self, value: Value) -> Value {
        match value {
            Value::String(text) => Value::String(self.without_path(&text)),
            Value::Array(items) => items.into_iter().map(|v| self.without_paths(v)).collect(),
            Value::Object(members) => {
                members.into_iter().map(|(k, v)| (k, self.without_paths(v))).collect()
            }
            other => other,
        }
    }
}

fn outside() -> Refusal {
    Refusal::forbidden("this path leaves the folder the studio was opened on")
}

/// A relative path of plain names.
fn plain(path: &str) -> Result<PathBuf> {
    if path.contains('\0') {
        return Err(Refusal::malformed("a path cannot hold a zero byte"));
    }
    if path.contains('\\') {
        return Err(outside());
    }
    let mut plain = PathBuf::new();
    for component in Path::new(path).components() {
        match component {
            Component::Normal(name) => plain.push(name),
            Component::CurDir => {}
            _ => return Err(outside()),
        }
    }
    Ok(plain)
}

#[cfg(test)]
mod tests {
    use axum::http::StatusCode;

    use super::*;

    #[test]
    fn paths_cannot_leave_the_root() {
        let dir = tempfile::tempdir().unwrap();
        let root = Root::new(dir.path()).unwrap();
        std::fs::create_dir(dir.path().join("a")).unwrap();
        for escape in ["..", "a/../..", "/etc/passwd", "..\\x", "a/../../x"] {
            let status = |r: Result<PathBuf>| r.unwrap_err().status;
            assert_eq!(status(root.existing(escape)), StatusCode::FORBIDDEN, "{escape}");
            assert_eq!(status(root.any(escape)), StatusCode::FORBIDDEN, "{escape}");
        }
        assert_eq!(root.existing("a").unwrap(), root.folder().join("a"));
        assert_eq!(root.existing("").unwrap(), root.folder());
        assert_eq!(root.any("a/b/c").unwrap(), root.folder().join("a/b/c"));
        assert_eq!(root.existing("b").unwrap_err().status, StatusCode::NOT_FOUND);
    }

    #[cfg(unix)]
    #[test]
    fn links_that_lead_out_are_refused() {
        let (dir, other) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        let root = Root::new(dir.path()).unwrap();
        std::os::unix::fs::symlink(other.path(), dir.path().join("out")).unwrap();
        std::os::unix::fs::symlink(dir.path(), dir.path().join("round")).unwrap();
        for out in ["out", "out/x", "round/out"] {
            assert_eq!(root.any(out).unwrap_err().status, StatusCode::FORBIDDEN, "{out}");
        }
        assert_eq!(root.existing("round").unwrap(), root.folder());
    }

    #[test]
    fn messages_do_not_hold_the_roots_path() {
        let dir = tempfile::tempdir().unwrap();
        let root = Root::new(dir.path()).unwrap();
        let text = format!("{}: cannot read", root.folder().join("a/b.png").display());
        assert_eq!(root.without_path(&text), "a/b.png: cannot read");
    }
}
