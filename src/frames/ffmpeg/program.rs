//! Finding the ffmpeg program and knowing its dialect.

use std::env;
use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex, PoisonError};

use crate::error::{Error, Result};

/// Environment variable that names the program, before PATH is searched.
const VARIABLE: &str = "MUYBRIDGE_FFMPEG";

/// From this version on the option that keeps every frame is `-fps_mode`; before, it was `-vsync`,
/// which later versions dropped (ffmpeg's Changelog, 5.1).
const FPS_MODE_SINCE: (u32, u32) = (5, 1);

/// The ffmpeg program, found and started once to ask its version. It takes a while to start, so its answer
/// is not waited for until it is needed.
#[derive(Clone, Debug)]
pub struct Ffmpeg {
    program: PathBuf,
    answer: Arc<Mutex<Answer>>,
}

#[derive(Debug)]
enum Answer {
    Awaited(Child),
    /// The version, where it could be understood.
    Heard(Option<(u32, u32)>),
    /// It was no success.
    Failed,
}

impl Ffmpeg {
    /// Finds the program: `MUYBRIDGE_FFMPEG` if it is set, else `ffmpeg` on PATH. `video` is the
    /// file it is wanted for, named in the error.
    ///
    /// # Errors
    /// [`Error::FfmpegMissing`] when it is not there or does not start.
    pub fn find(video: &Path) -> Result<Self> {
        let found = Self::find_in(video, env::var_os(VARIABLE), env::var_os("PATH"))?;
        found.works_for(video)?;
        Ok(found)
    }

    /// The same without waiting for its answer; [`works_for`](Self::works_for) has to be asked.
    pub(in crate::frames) fn begin(video: &Path) -> Result<Self> {
        Self::find_in(video, env::var_os(VARIABLE), env::var_os("PATH"))
    }

    /// [`Ffmpeg::begin`] with the two environment variables as arguments.
    pub(in crate::frames) fn find_in(
        video: &Path,
        named: Option<OsString>,
        path: Option<OsString>,
    ) -> Result<Self> {
        let named = named.filter(|n| !n.is_empty()).map(PathBuf::from);
        let looked_for = named.clone().unwrap_or_else(|| PathBuf::from("ffmpeg"));
        let missing =
            || Error::FfmpegMissing { path: video.to_owned(), program: looked_for.clone() };
        let program =
            named.or_else(|| search(path.as_deref().unwrap_or_default())).ok_or_else(missing)?;
        let answer = Command::new(&program)
            .arg("-version")
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .map_err(|_| missing())?;
        Ok(Self { program, answer: Arc::new(Mutex::new(Answer::Awaited(answer))) })
    }

    /// Waits for the answer to the first call.
    ///
    /// # Errors
    /// [`Error::FfmpegMissing`] when there was none.
    pub(in crate::frames) fn works_for(&self, video: &Path) -> Result<()> {
        let missing =
            || Error::FfmpegMissing { path: video.to_owned(), program: self.program.clone() };
        self.heard().map(|_| ()).ok_or_else(missing)
    }

    /// The version, where it could be understood; `None` when there was no answer.
    fn heard(&self) -> Option<Option<(u32, u32)>> {
        // Whoever panicked left the answer as it was, or as failed.
        let mut answer = self.answer.lock().unwrap_or_else(PoisonError::into_inner);
        *answer = match std::mem::replace(&mut *answer, Answer::Failed) {
            Answer::Awaited(child) => {
                let output = child.wait_with_output().ok().filter(|o| o.status.success());
                let version = |bytes: &[u8]| parse_version(&String::from_utf8_lossy(bytes));
                output.map_or(Answer::Failed, |o| Answer::Heard(version(&o.stdout)))
            }
            heard => heard,
        };
        match *answer {
            Answer::Heard(version) => Some(version),
            Answer::Awaited(_) | Answer::Failed => None,
        }
    }

    /// The program's file.
    #[must_use]
    pub fn program(&self) -> &Path {
        &self.program
    }

    /// Major and minor version, or `None` for builds whose version does not say (such as those
    /// straight from the source repository), which are taken as recent.
    #[must_use]
    pub fn version(&self) -> Option<(u32, u32)> {
        self.heard().flatten()
    }

    /// A command that reads `video` as its first input: quiet, without standard input, local
    /// files only. What to do with it is for the caller to add.
    pub(super) fn reading(&self, video: &Path, log_level: &str) -> Command {
        let mut input = OsString::from("file:");
        input.push(video);
        let mut command = Command::new(&self.program);
        command
            .args(["-hide_banner", "-nostdin", "-loglevel", log_level])
            .args(["-protocol_whitelist", "file", "-i"])
            .arg(input)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        command
    }

    /// The option that hands every frame on exactly once.
    pub(super) fn every_frame_once(&self) -> [&'static str; 2] {
        match self.version() {
            Some(version) if version < FPS_MODE_SINCE => ["-vsync", "passthrough"],
            _ => ["-fps_mode", "passthrough"],
        }
    }
}

fn search(path: &OsStr) -> Option<PathBuf> {
    let name = format!("ffmpeg{}", env::consts::EXE_SUFFIX);
    env::split_paths(path).map(|folder| folder.join(&name)).find(|file| file.is_file())
}

/// The version in the first line, `ffmpeg version 5.1.9-0+deb12u1 Copyright …` or
/// `ffmpeg version n7.0 …`.
fn parse_version(answer: &str) -> Option<(u32, u32)> {
    let word = answer.strip_prefix("ffmpeg version ")?.split_whitespace().next()?;
    let mut numbers = word
        .trim_start_matches('n')
        .split(|c: char| !c.is_ascii_digit())
        .map_while(|digits| digits.parse().ok());
    let major = numbers.next()?;
    Some((major, numbers.next().unwrap_or(0)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn versions_of_all_kinds_of_builds() {
        for (line, version) in [
            ("ffmpeg version 5.1.9-0+deb12u1 Copyright (c) 2000", Some((5, 1))),
            ("ffmpeg version n7.0 Copyright", Some((7, 0))),
            ("ffmpeg version 4.4.2-0ubuntu0.22.04.1", Some((4, 4))),
            ("ffmpeg version 8 Copyright", Some((8, 0))),
            ("ffmpeg version N-109542-g6a0d7b2 Copyright", None),
            ("ffmpeg version git-2020-01-01", None),
            ("", None),
        ] {
            assert_eq!(parse_version(line), version, "{line}");
        }
    }

    #[test]
    fn the_dialect_follows_the_version() {
        let with = |version| {
            let answer = Arc::new(Mutex::new(Answer::Heard(version)));
            Ffmpeg { program: PathBuf::new(), answer }.every_frame_once()[0]
        };
        assert_eq!(with(Some((5, 0))), "-vsync");
        assert_eq!(with(Some((5, 1))), "-fps_mode");
        assert_eq!(with(Some((9, 0))), "-fps_mode");
        assert_eq!(with(None), "-fps_mode");
    }

    #[test]
    fn a_program_that_is_not_there_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = Some(folder.path().as_os_str().to_owned());
        let video = Path::new("clips/lion.mov");
        let unset = Ffmpeg::find_in(video, None, path.clone()).unwrap_err();
        let Error::FfmpegMissing { program, .. } = &unset else { panic!("{unset}") };
        assert_eq!(program, Path::new("ffmpeg"));
        assert!(unset.to_string().contains("clips/lion.mov"), "{unset}");
        let remedy = unset.remedy().unwrap();
        assert!(remedy.contains("install ffmpeg"), "{remedy}");
        assert!(remedy.contains("image sequences need nothing"), "{remedy}");

        let wrong = folder.path().join("no-such-ffmpeg");
        let named = Ffmpeg::find_in(video, Some(wrong.clone().into()), path).unwrap_err();
        assert!(matches!(named, Error::FfmpegMissing { program, .. } if program == wrong));
    }
}
