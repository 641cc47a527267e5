//! Writing a movie through the ffmpeg program, one picture at a time.

use std::ffi::OsString;
use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{ChildStdin, Command, Stdio};

use tempfile::TempDir;

use super::program::Ffmpeg;
use super::stream::{Child, LINES_SHOWN, STOPPED_BY_SIGNAL};
use crate::error::{Error, Result};
use crate::frames::check_rate;
use crate::image::Picture;

/// H.264 that every player and browser reads, visually without loss; the index stands first, so that
/// it plays while it loads.
const MP4: [&str; 10] = [
    "-c:v",
    "libx264",
    "-preset",
    "medium",
    "-crf",
    "18",
    "-pix_fmt",
    "yuv420p",
    "-movflags",
    "+faststart",
];
/// A palette for every picture: better colours than one for all, and no picture has to wait for the
/// last one.
const GIF: [&str; 2] = [
    "-filter_complex",
    "[0:v]split[a][b];[a]palettegen=stats_mode=single[p];[b][p]paletteuse=new=1:dither=bayer",
];

/// A movie that is being written. It appears under its name when [`MovieWriter::finish`] succeeds, and
/// not at all when it is dropped before.
pub struct MovieWriter {
    child: Child,
    pipe: Option<ChildStdin>,
    path: PathBuf,
    /// Where ffmpeg writes, in a folder of its own beside the movie; removed on drop.
    folder: TempDir,
    partial: PathBuf,
    size: (usize, usize),
}

impl MovieWriter {
    /// Begins a movie of pictures of one size, both sides even: `.mp4`, or an animated `.gif`.
    ///
    /// # Errors
    /// [`Error::MovieFormat`] for another name; [`Error::MovieNeedsFfmpeg`] when the program is not
    /// there; [`Error::BadFrameRate`]; [`Error::Io`] when the folder cannot be written to.
    pub fn start(path: &Path, fps: f64, size: (usize, usize)) -> Result<Self> {
        check_rate(fps)?;
        let (extension, coding) = coding(path)?;
        let ffmpeg = Ffmpeg::find(path).map_err(|error| match error {
            Error::FfmpegMissing { path, program } => Error::MovieNeedsFfmpeg { path, program },
            other => other,
        })?;
        let beside = match path.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent,
            _ => Path::new("."),
        };
        fs::create_dir_all(beside).map_err(Error::io(beside, "create the folder"))?;
        let folder = tempfile::Builder::new()
            .prefix(".muybridge-")
            .tempdir_in(beside)
            .map_err(Error::io(beside, "write in"))?;
        let partial = folder.path().join("movie").with_extension(extension);
        let log = File::create(log_of(&folder)).map_err(Error::io(folder.path(), "write in"))?;
        let mut output = OsString::from("file:");
        output.push(&partial);
        let mut command = Command::new(ffmpeg.program());
        command
            .args(["-hide_banner", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgb24"])
            .arg("-video_size")
            .arg(format!("{}x{}", size.0, size.1))
            .arg("-framerate")
            .arg(format!("{fps:.9}"))
            .args(["-i", "pipe:0"])
            .args(coding)
            .arg(output)
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::from(log));
        let mut child = Child::spawn(&ffmpeg, path, &mut command)?;
        let pipe = child.take_stdin();
        Ok(Self { child, pipe, path: path.to_owned(), folder, partial, size })
    }

    /// Adds a picture.
    ///
    /// # Errors
    /// [`Error::MovieFailed`] when ffmpeg has given up, or the picture has another size.
    pub fn push(&mut self, picture: &Picture) -> Result<()> {
        let found = (picture.width(), picture.height());
        if found != self.size {
            let log = format!("a picture of {found:?} pixels among ones of {:?}", self.size);
            return Err(Error::MovieFailed { path: self.path.clone(), log });
        }
        let written = self.pipe.as_mut().map(|pipe| pipe.write_all(picture.rgb()));
        match written {
            Some(Ok(())) => Ok(()),
            _ => {
                self.pipe = None;
                let status = self.child.wait(&self.path)?;
                Err(self.failure(status.code()))
            }
        }
    }

    /// Ends the movie and puts it in place.
    ///
    /// # Errors
    /// [`Error::MovieFailed`] with ffmpeg's last words; [`Error::Io`] when it cannot be put in place.
    pub fn finish(mut self) -> Result<()> {
        self.pipe = None;
        let status = self.child.wait(&self.path)?;
        if !status.success() {
            return Err(self.failure(status.code()));
        }
        fs::rename(&self.partial, &self.path).map_err(Error::io(&self.path, "put in place"))
    }

    fn failure(&self, code: Option<i32>) -> Error {
        if code == Some(STOPPED_BY_SIGNAL) {
            return Error::Interrupted;
        }
        let said = fs::read(log_of(&self.folder)).unwrap_or_default();
        let said = String::from_utf8_lossy(&said);
        let lines: Vec<&str> = said.lines().collect();
        let log = lines[lines.len().saturating_sub(LINES_SHOWN)..].join("\n");
        Error::MovieFailed { path: self.path.clone(), log }
    }
}

fn log_of(folder: &TempDir) -> PathBuf {
    folder.path().join("messages.txt")
}

/// How the name of a movie asks to be coded.
fn coding(path: &Path) -> Result<(&'static str, &'static [&'static str])> {
    let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
    match extension.as_deref() {
        Some("mp4") => Ok(("mp4", &MP4)),
        Some("gif") => Ok(("gif", &GIF)),
        _ => Err(Error::MovieFormat { path: path.to_owned() }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::{FrameSource, SourceSpec, open};

    fn grey(level: u8) -> Picture {
        Picture::from_rgb(32, 16, vec![level; 32 * 16 * 3]).unwrap()
    }

    #[test]
    fn a_movie_reads_back_frame_by_frame() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["walk, side: 1.mp4", "walk.GIF"] {
            let path = folder.path().join(name);
            let mut movie = MovieWriter::start(&path, 25.0, (32, 16)).unwrap();
            for t in 0..9 {
                movie.push(&grey(20 * t)).unwrap();
            }
            assert!(!path.exists(), "{name} is there before its end");
            movie.finish().unwrap();
            let mut read = open(&SourceSpec::new(&path)).unwrap();
            assert_eq!((read.width(), read.height()), (32, 16));
            assert!((read.fps().unwrap() - 25.0).abs() < 1e-6);
            for t in 0..9_u8 {
                let picture = read.next_frame().unwrap().unwrap();
                let level = picture.pixel(9, 9)[0];
                assert!(level.abs_diff(20 * t) <= 6, "{name}: {level} for {}", 20 * t);
            }
            assert!(read.next_frame().unwrap().is_none());
        }
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
    }

    #[test]
    fn a_movie_given_up_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("walk.mp4");
        let mut movie = MovieWriter::start(&path, 25.0, (32, 16)).unwrap();
        movie.push(&grey(9)).unwrap();
        let wrong = Picture::from_rgb(2, 2, vec![0; 12]).unwrap();
        assert!(matches!(movie.push(&wrong), Err(Error::MovieFailed { .. })));
        drop(movie);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    }

    #[test]
    fn other_names_and_failures_are_said() {
        let folder = tempfile::tempdir().unwrap();
        let named = |name: &str| MovieWriter::start(&folder.path().join(name), 25.0, (31, 16));
        for name in ["walk.avi", "walk"] {
            assert!(matches!(named(name), Err(Error::MovieFormat { .. })), "{name}");
        }
        // H.264 in 4:2:0 has no odd width.
        let mut movie = named("walk.mp4").unwrap();
        let odd = Picture::from_rgb(31, 16, vec![0; 31 * 16 * 3]).unwrap();
        let ended = (0..3).try_for_each(|_| movie.push(&odd)).and_then(|()| movie.finish());
        let Err(Error::MovieFailed { log, .. }) = ended else { panic!("{ended:?}") };
        assert!(!log.is_empty());
    }
}
