//! The second reading: pictures through a pipe.

use std::io::{BufRead, BufReader, ErrorKind, Read};
use std::path::{Path, PathBuf};
use std::process::{ChildStderr, ChildStdin, ChildStdout, Command, ExitStatus};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};

use super::program::Ffmpeg;
use crate::error::{Error, Result};
use crate::frames::decode;
use crate::image::{Frame, Picture, YuvMatrix, YuvPicture};

/// Last lines of ffmpeg's messages shown in an error.
pub(super) const LINES_SHOWN: usize = 6;

/// Exit code of ffmpeg when it ends on Ctrl-C or a polite kill (`ffmpeg.c`).
pub(super) const STOPPED_BY_SIGNAL: i32 = 255;

/// Bytes of the pipe that are read ahead: little more than a picture's header, since pixels that lie in
/// the buffer are copied once more. The others are read to where they stay.
const PIPE_BUFFER: usize = 4096;

/// Words in ffmpeg's error messages that mean picture data are missing or wrong. ffmpeg paints
/// over such places and ends with success, so the words are all there is. Collected from its
/// sources 4.4 to 9.0 (`mov.c`, `matroskadec.c`, `h264dec.c`, `mpeg4videodec.c`, `ffmpeg_dec.c`)
/// and from cutting and scratching MP4, MOV, MKV, WebM and AVI files. Other errors (a missing
/// reference at a cut, say) occur in healthy clips and do not count.
const DAMAGE: [&str; 15] = [
    "partial file",
    "ended prematurely",
    "invalid data found",
    "invalid nal",
    "error splitting",
    "damaged",
    "error at mb",
    "error while decoding",
    "error submitting packet",
    "error during demuxing",
    "corrupt decoded frame",
    "corrupted frame",
    "concealing",
    "truncated",
    "missing picture",
];

/// An ffmpeg process that does not outlive this value: it is killed and reaped on drop. It stays
/// in our process group, so a Ctrl-C on the terminal reaches it too.
pub(super) struct Child(std::process::Child);

impl Child {
    pub(super) fn spawn(ffmpeg: &Ffmpeg, path: &Path, command: &mut Command) -> Result<Self> {
        command.spawn().map(Self).map_err(|_| Error::FfmpegMissing {
            path: path.to_owned(),
            program: ffmpeg.program().to_owned(),
        })
    }

    pub(super) fn take_stdout(&mut self) -> Option<ChildStdout> {
        self.0.stdout.take()
    }

    pub(super) fn take_stdin(&mut self) -> Option<ChildStdin> {
        self.0.stdin.take()
    }

    pub(super) fn take_stderr(&mut self) -> Option<ChildStderr> {
        self.0.stderr.take()
    }

    pub(super) fn wait(&mut self, path: &Path) -> Result<ExitStatus> {
        self.0.wait().map_err(Error::io(path, "wait for ffmpeg to read"))
    }
}

impl Drop for Child {
    fn drop(&mut self) {
        // Both fail only when the process is gone and reaped already.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// What ffmpeg has said so far.
#[derive(Debug, Default)]
struct Messages {
    last: Vec<String>,
    damage: bool,
}

impl Messages {
    fn add(&mut self, line: &str) {
        let lower = line.to_ascii_lowercase();
        self.damage |= DAMAGE.iter().any(|words| lower.contains(words));
        if self.last.len() == LINES_SHOWN {
            self.last.remove(0);
        }
        self.last.push(line.to_owned());
    }
}

/// What is asked of the second reading.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Wanted {
    /// Whether frames hold two fields: the first is kept and its missing lines are filled from both
    /// and the frames around (ffmpeg's bwdif), as an animal that moves has two outlines otherwise.
    pub(super) interlaced: bool,
    /// The constant rate to resample to; without, every frame comes once.
    pub(super) resample_fps: Option<f64>,
    /// Most frames.
    pub(super) limit: Option<usize>,
    /// The matrix of a video whose frames are wanted in luma and chroma, 8-bit 4:2:0 with even
    /// sides; without, ffmpeg converts them to RGB.
    pub(super) matrix: Option<YuvMatrix>,
}

/// Decoded pictures of one video, in order.
pub(super) struct Stream {
    // Declared first, so that it is dropped first: only then do the pipes close.
    child: Child,
    pipe: BufReader<ChildStdout>,
    messages: Arc<Mutex<Messages>>,
    listener: Option<JoinHandle<()>>,
    path: PathBuf,
    matrix: Option<YuvMatrix>,
    given: usize,
    ended: bool,
}

impl Stream {
    /// Starts decoding.
    pub(super) fn start(ffmpeg: &Ffmpeg, path: &Path, wanted: &Wanted) -> Result<Self> {
        let mut command = ffmpeg.reading(path, "error");
        command.args(["-map", "0:V:0"]);
        let deinterlaced = wanted.interlaced.then(|| "bwdif=mode=send_frame".to_owned());
        let resampled = wanted.resample_fps.map(|fps| format!("fps=fps={fps:.9}"));
        let filters: Vec<String> = deinterlaced.into_iter().chain(resampled).collect();
        if !filters.is_empty() {
            command.arg("-vf").arg(filters.join(","));
        }
        command.args(ffmpeg.every_frame_once());
        if let Some(limit) = wanted.limit {
            command.arg("-frames:v").arg(limit.to_string());
        }
        let [pixels, codec] =
            if wanted.matrix.is_some() { ["yuv420p", "pgmyuv"] } else { ["rgb24", "ppm"] };
        command.args(["-pix_fmt", pixels, "-c:v", codec, "-f", "image2pipe", "pipe:1"]);
        let mut child = Child::spawn(ffmpeg, path, &mut command)?;
        let (Some(stdout), Some(stderr)) = (child.take_stdout(), child.take_stderr()) else {
            return Err(Error::VideoUnreadable { path: path.to_owned(), log: String::new() });
        };
        let messages = Arc::new(Mutex::new(Messages::default()));
        let heard = Arc::clone(&messages);
        let listener = thread::Builder::new()
            .name("ffmpeg-messages".to_owned())
            .spawn(move || listen(stderr, &heard))
            .map_err(Error::io(path, "start a thread to read"))?;
        Ok(Self {
            child,
            pipe: BufReader::with_capacity(PIPE_BUFFER, stdout),
            messages,
            listener: Some(listener),
            path: path.to_owned(),
            matrix: wanted.matrix,
            given: 0,
            ended: false,
        })
    }

    /// The next picture, or `None` when all have come and ffmpeg had nothing to complain of.
    pub(super) fn next(&mut self) -> Result<Option<Frame>> {
        if self.ended {
            return Ok(None);
        }
        if self.heard(|m| m.damage) {
            self.ended = true;
            return Err(self.damaged());
        }
        match read_pnm(&mut self.pipe, self.matrix) {
            Ok(Some(Pnm::Frame(frame))) => {
                self.given += 1;
                Ok(Some(frame))
            }
            Ok(Some(Pnm::TooLarge(width, height))) => {
                self.ended = true;
                decode::check_size(&self.path, self.given, width, height).map(|()| None)
            }
            Ok(None) => self.finish(false).map(|()| None),
            Err(e) if matches!(e.kind(), ErrorKind::UnexpectedEof | ErrorKind::InvalidData) => {
                self.finish(true).map(|()| None)
            }
            Err(e) => Err(Error::io(&self.path, "read the decoded pictures of")(e)),
        }
    }

    /// The pipe is at its end, `torn` in the middle of a picture: was that the end of the video?
    fn finish(&mut self, torn: bool) -> Result<()> {
        self.ended = true;
        let status = self.child.wait(&self.path)?;
        if let Some(listener) = self.listener.take() {
            // A listener that panicked has nothing more to say.
            let _ = listener.join();
        }
        if status.code() == Some(STOPPED_BY_SIGNAL) {
            return Err(Error::Interrupted);
        }
        if self.given == 0 {
            let path = self.path.clone();
            return Err(Error::VideoUnreadable { path, log: self.heard(|m| m.last.join("\n")) });
        }
        if torn || !status.success() || self.heard(|m| m.damage) {
            return Err(self.damaged());
        }
        Ok(())
    }

    fn heard<T>(&self, ask: impl FnOnce(&Messages) -> T) -> T {
        ask(&self.messages.lock().unwrap_or_else(PoisonError::into_inner))
    }

    fn damaged(&self) -> Error {
        let log = self.heard(|m| m.last.join("\n"));
        Error::VideoDamaged { path: self.path.clone(), frame: self.given, log }
    }
}

fn listen(from: impl Read, messages: &Mutex<Messages>) {
    let mut reader = BufReader::new(from);
    let mut line = Vec::new();
    while reader.read_until(b'\n', &mut line).is_ok_and(|n| n > 0) {
        let text = String::from_utf8_lossy(&line);
        messages.lock().unwrap_or_else(PoisonError::into_inner).add(text.trim_end());
        line.clear();
    }
}

/// One picture of the pipe.
enum Pnm {
    Frame(Frame),
    /// Larger than the limits; the pixels were not read.
    TooLarge(usize, usize),
}

/// Reads one binary picture as ffmpeg writes it, without comments; `None` at a clean end. RGB comes
/// as PPM (`P6`, width, height, 255, pixels); luma and chroma, when a `matrix` says what they mean,
/// as PGM (`P5`) of half as many rows again, which hold the chroma (ffmpeg's `pgmyuv`).
fn read_pnm(from: &mut impl BufRead, matrix: Option<YuvMatrix>) -> std::io::Result<Option<Pnm>> {
    if from.fill_buf()?.is_empty() {
        return Ok(None);
    }
    let bad = || std::io::Error::from(ErrorKind::InvalidData);
    let mut words = [0_usize; 3];
    if word(from)? != if matrix.is_some() { "P5" } else { "P6" } {
        return Err(bad());
    }
    for value in &mut words {
        *value = word(from)?.parse().map_err(|_| bad())?;
    }
    let [width, rows, full] = words;
    if full != 255 {
        return Err(bad());
    }
    let height = if matrix.is_some() { rows / 3 * 2 } else { rows };
    if decode::check_size(Path::new(""), 0, width, height).is_err() {
        return Ok(Some(Pnm::TooLarge(width, height)));
    }
    let length = if matrix.is_some() { width * rows } else { 3 * width * rows };
    // Memory that is read into need not be cleared first.
    let mut bytes = Vec::with_capacity(length);
    if from.by_ref().take(length as u64).read_to_end(&mut bytes)? < length {
        return Err(ErrorKind::UnexpectedEof.into());
    }
    let frame = match matrix {
        Some(matrix) => YuvPicture::new(width, height, matrix, bytes).map(Frame::Yuv),
        None => Picture::from_rgb(width, height, bytes).map(Frame::Rgb),
    };
    frame.map(|f| Some(Pnm::Frame(f))).ok_or_else(bad)
}

/// A word and the one white space behind it.
fn word(from: &mut impl BufRead) -> std::io::Result<String> {
    /// No word of the header is longer.
    const LONGEST: usize = 12;
    let mut text = String::new();
    while text.len() <= LONGEST {
        let mut byte = [0];
        from.read_exact(&mut byte)?;
        if byte[0].is_ascii_whitespace() {
            return Ok(text);
        }
        text.push(char::from(byte[0]));
    }
    Err(ErrorKind::InvalidData.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(mut bytes: &[u8]) -> std::io::Result<Option<Pnm>> {
        read_pnm(&mut bytes, None)
    }

    #[test]
    fn pictures_follow_each_other_and_end_cleanly() {
        let mut bytes: &[u8] = b"P6\n2 1\n255\nabcdefP6\n1 1\n255\n\n\n\n";
        for rgb in [&b"abcdef"[..], b"\n\n\n"] {
            let Some(Pnm::Frame(Frame::Rgb(picture))) = read_pnm(&mut bytes, None).unwrap() else {
                panic!()
            };
            assert_eq!(picture.rgb(), rgb);
        }
        assert!(read_pnm(&mut bytes, None).unwrap().is_none());
    }

    #[test]
    fn luma_and_chroma_come_as_rows_below_each_other() {
        let matrix = Some(YuvMatrix::Bt709);
        let mut bytes: &[u8] = b"P5\n4 3\n255\nabcdefghuUvV";
        let Some(Pnm::Frame(Frame::Yuv(picture))) = read_pnm(&mut bytes, matrix).unwrap() else {
            panic!()
        };
        assert_eq!((picture.width(), picture.height()), (4, 2));
        assert_eq!(picture.luma_row(1), b"efgh");
        assert_eq!(picture.chroma_rows(0), (&b"uU"[..], &b"vV"[..]));
        for foreign in [&b"P6\n4 3\n255\nabcdefghuUvV"[..], b"P5\n4 4\n255\nabcdefghuUvVabcd"] {
            assert!(read_pnm(&mut &foreign[..], matrix).is_err());
        }
    }

    #[test]
    fn torn_and_foreign_bytes_are_errors() {
        let whole = b"P6\n2 1\n255\nabcdef";
        for length in 1..whole.len() {
            assert!(read(&whole[..length]).is_err(), "cut at {length}");
        }
        for foreign in [&b"P5\n1 1\n255\na"[..], b"P6\n1 1\n65535\nabcdef", b"P6\n-1 1\n255\nabc"] {
            assert!(read(foreign).is_err());
        }
        assert!(matches!(read(b"P6\n20000 1\n255\n"), Ok(Some(Pnm::TooLarge(20_000, 1)))));
    }

    #[test]
    fn messages_keep_the_last_lines_and_notice_damage() {
        let mut messages = Messages::default();
        for i in 0..20 {
            messages.add(&format!("[h264] mmco: unref short failure {i}"));
        }
        assert!(!messages.damage);
        assert_eq!(messages.last.len(), LINES_SHOWN);
        messages.add("[mov,mp4 @ 0x5] stream 0, offset 0xddb8: partial file");
        assert!(messages.damage);
        assert!(messages.last.last().unwrap().contains("partial file"));
    }
}
