//! What a place named by the user means: a folder, a pattern, a GIF, a video.

use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};

use ::image::ImageFormat;

use super::{Finding, complete, decode, natural};
use crate::error::{Error, Result};

/// Footage found, pixels not yet looked at.
pub(super) enum Located {
    /// Picture files in natural order, at least one.
    Stills(Sequence),
    /// A GIF of more than one frame.
    Gif(PathBuf),
    /// Any other file: ffmpeg will tell.
    Video(PathBuf),
}

/// Picture files in natural order, at least one, and what is odd about them.
pub(super) struct Sequence {
    pub(super) files: Vec<PathBuf>,
    pub(super) findings: Vec<Finding>,
}

/// Finds out what `location` means. What exists under this very name goes before patterns.
pub(super) fn locate(location: &Path) -> Result<Located> {
    if location.is_file() {
        return locate_file(location);
    }
    let candidates = list(location)?;
    sequence(location, candidates).map(Located::Stills)
}

/// The pictures at `location` as a sequence, whatever number of files it is; a single file is a
/// sequence of one.
pub(super) fn locate_stills(location: &Path) -> Result<Sequence> {
    if location.is_file() {
        return Ok(Sequence { files: vec![location.to_owned()], findings: Vec::new() });
    }
    sequence(location, list(location)?)
}

fn locate_file(path: &Path) -> Result<Located> {
    let single =
        || Located::Stills(Sequence { files: vec![path.to_owned()], findings: Vec::new() });
    let length = fs::metadata(path).map_err(Error::io(path, "read"))?.len();
    if length == 0 {
        return Err(Error::EmptyFile { path: path.to_owned(), frame: 0 });
    }
    match decode::kind(path)? {
        Some((ImageFormat::Gif, _)) => {
            let bytes = fs::read(path).map_err(Error::io(path, "read"))?;
            let many = complete::gif_delays_cs(&bytes).is_none_or(|delays| delays.len() > 1);
            Ok(if many { Located::Gif(path.to_owned()) } else { single() })
        }
        Some(_) => Ok(single()),
        None if decode::is_named_as_picture(path) => {
            Err(Error::NotAPicture { path: path.to_owned(), frame: 0 })
        }
        None => Ok(Located::Video(path.to_owned())),
    }
}

/// All files of a folder or pattern, hidden ones left aside, in no particular order.
fn list(location: &Path) -> Result<Vec<PathBuf>> {
    if location.is_dir() {
        return files_in(location);
    }
    let missing = || Error::SourceMissing { location: location.to_owned() };
    let text = location.to_str().ok_or_else(missing)?;
    let name = location.file_name().and_then(OsStr::to_str).unwrap_or_default();
    if text.contains('%') {
        let pattern = Numbered::parse(text, name)?;
        let folder = location.parent().filter(|p| *p != Path::new("")).unwrap_or(Path::new("."));
        let folder_files = if folder.is_dir() { files_in(folder)? } else { return Err(missing()) };
        let fits = |path: &PathBuf| {
            path.file_name().and_then(OsStr::to_str).is_some_and(|name| pattern.matches(name))
        };
        return Ok(folder_files.into_iter().filter(fits).collect());
    }
    if text.contains(['*', '?', '[']) {
        let entries = glob::glob(text)
            .map_err(|e| Error::BadPattern { pattern: text.to_owned(), reason: e.msg })?;
        let paths: Vec<PathBuf> = entries
            .map(|entry| {
                entry.map_err(|e| {
                    let path = e.path().to_owned();
                    Error::Io { path, action: "read", source: e.into() }
                })
            })
            .collect::<Result<_>>()?;
        return Ok(paths.into_iter().filter(|p| p.is_file() && !is_hidden(p)).collect());
    }
    Err(missing())
}

fn files_in(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).map_err(Error::io(folder, "read"))? {
        let path = entry.map_err(Error::io(folder, "read"))?.path();
        if path.is_file() && !is_hidden(&path) {
            files.push(path);
        }
    }
    Ok(files)
}

/// Files whose name starts with a dot are the system's (`.DS_Store`, the `._` doubles of macOS).
fn is_hidden(path: &Path) -> bool {
    path.file_name().is_some_and(|name| name.as_encoded_bytes().starts_with(b"."))
}

/// Keeps the pictures among `candidates`. A file named as a picture whose content is none stays,
/// so that reading it reports it: a broken frame must not vanish silently.
fn sequence(location: &Path, candidates: Vec<PathBuf>) -> Result<Sequence> {
    let total = candidates.len();
    let mut files = Vec::with_capacity(total);
    let mut kinds = BTreeSet::new();
    for path in candidates {
        match decode::kind(&path)? {
            Some((_, kind)) => {
                kinds.insert(kind);
                files.push(path);
            }
            None if decode::is_named_as_picture(&path) => files.push(path),
            None => {}
        }
    }
    let ignored = total - files.len();
    if files.is_empty() {
        return Err(Error::NoPictures { location: location.to_owned(), ignored });
    }
    files.sort_by(|a, b| natural::compare(a, b));
    let mut findings = Vec::new();
    if ignored > 0 {
        findings.push(Finding::LeftOut { location: location.to_owned(), count: ignored });
    }
    if kinds.len() > 1 {
        findings.push(Finding::MixedKinds { kinds: kinds.into_iter().collect() });
    }
    findings.extend(natural::gaps(&files));
    Ok(Sequence { files, findings })
}

/// A file name with one `%d`, `%4d`-style width only with the zero flag (`%04d`), `%%` for a per
/// cent sign, as ffmpeg and most renderers write it.
struct Numbered {
    prefix: String,
    suffix: String,
    /// Digits at least, with leading zeros; 0 for plain `%d`.
    width: usize,
}

impl Numbered {
    fn parse(pattern: &str, name: &str) -> Result<Self> {
        let bad = |reason| Error::BadPattern { pattern: pattern.to_owned(), reason };
        let mut parts = [String::new(), String::new()];
        let mut width = None;
        let mut rest = name.chars();
        while let Some(c) = rest.next() {
            let part = &mut parts[usize::from(width.is_some())];
            if c != '%' {
                part.push(c);
                continue;
            }
            let digits: String = rest.as_str().chars().take_while(char::is_ascii_digit).collect();
            if digits.is_empty() && rest.as_str().starts_with('%') {
                rest.next();
                part.push('%');
                continue;
            }
            let conversion = rest.by_ref().nth(digits.len());
            if conversion != Some('d') || width.is_some() {
                return Err(bad("it may hold one `%d` or `%04d`, and `%%` for a per cent sign"));
            }
            width = Some(match digits.strip_prefix('0') {
                Some(zeros) if zeros.len() <= 2 => zeros.parse().unwrap_or(0),
                None if digits.is_empty() => 0,
                _ => {
                    return Err(bad(
                        "the width must look like 04, two digits at most behind the 0",
                    ));
                }
            });
        }
        let width = width.ok_or_else(|| bad("`%d` must be in the file name, not in a folder's"))?;
        let [prefix, suffix] = parts;
        Ok(Self { prefix, suffix, width })
    }

    fn matches(&self, name: &str) -> bool {
        let number = name.strip_prefix(&*self.prefix).and_then(|n| n.strip_suffix(&*self.suffix));
        number.is_some_and(|n| {
            let padded = n.len() == self.width.max(1) || !n.starts_with('0');
            !n.is_empty()
                && n.len() >= self.width
                && padded
                && n.bytes().all(|b| b.is_ascii_digit())
        })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn pattern(name: &str) -> Result<Numbered> {
        Numbered::parse(name, name)
    }

    #[test]
    fn printf_patterns_take_exactly_what_printf_writes() {
        let four = pattern("img_%04d.png").unwrap();
        for (name, fits) in [
            ("img_0001.png", true),
            ("img_12345.png", true),
            ("img_01.png", false),
            ("img_00001.png", false),
            ("img_.png", false),
            ("img_00a1.png", false),
            ("img_0001.jpg", false),
            ("0001.png", false),
        ] {
            assert_eq!(four.matches(name), fits, "{name}");
        }
        let plain = pattern("50%%_%d").unwrap();
        assert!(plain.matches("50%_0") && plain.matches("50%_12"));
        assert!(!plain.matches("50%_012") && !plain.matches("50%%_1"));
    }

    #[test]
    fn bad_printf_patterns_are_refused() {
        for bad in ["%s.png", "a%4d.png", "%d_%d.png", "%", "%0999d.png", "%x", "a%%b.png"] {
            assert!(matches!(pattern(bad), Err(Error::BadPattern { .. })), "{bad}");
        }
    }

    proptest! {
        #[test]
        fn what_printf_writes_fits(number: u32, width in 0_usize..12) {
            let spec = if width == 0 { "f%d.x".to_owned() } else { format!("f%0{width}d.x") };
            let name = format!("f{number:0width$}.x");
            prop_assert!(pattern(&spec).unwrap().matches(&name), "{} {}", spec, name);
        }
    }
}
