//! The first reading of a video file: times of its packets and what its header says, nothing
//! decoded.
//!
//! `ffmpeg -c copy -f framecrc` writes a line a packet on standard output (stream, decoding time,
//! presentation time, duration, bytes, checksum) after a head of `#` lines; what the header says
//! beyond that is on standard error in the words of `ffmpeg -i`.

use std::fs::File;
use std::io::{BufRead as _, BufReader, Read};
use std::path::Path;
use std::thread;

use super::program::Ffmpeg;
use super::stream::Child;
use crate::error::{Error, Result};
use crate::image::YuvMatrix;

/// Lines of ffmpeg's messages kept: the description of the file comes first and is never longer.
const LINES_KEPT: usize = 400;

/// Share of the stated duration that may be missing at the end before the file counts as cut
/// short, and the least time: containers round, and the last frame's duration is often not
/// stored.
const SHORTFALL_SHARE: f64 = 0.05;
const SHORTFALL_S: f64 = 0.5;

/// How ffmpeg says that a stream is interlaced, whichever field comes first.
const FIELD_ORDERS: [&str; 4] =
    ["top first", "bottom first", "top coded first", "bottom coded first"];

/// What the first reading found.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Probe {
    /// Stored width and height, pixels, not yet turned upright.
    pub(super) size: Option<(usize, usize)>,
    /// Presentation times of the video packets in ticks, ascending; decoding times where the file
    /// has no others.
    pub(super) times: Vec<i64>,
    /// Length of a tick, seconds.
    pub(super) tick_s: f64,
    /// Rate the header states, frames a second.
    pub(super) nominal_fps: Option<f64>,
    /// Degrees clockwise that make the stored picture upright.
    pub(super) rotation_deg: u16,
    /// Whether a frame holds two fields taken one after the other.
    pub(super) interlaced: bool,
    /// Width of a pixel over its height.
    pub(super) pixel_aspect: f64,
    /// The matrix of the stored colours, where they are 8-bit 4:2:0 of video range.
    pub(super) matrix: Option<YuvMatrix>,
    /// Duration the header states, seconds.
    pub(super) stated_s: Option<f64>,
    /// Time to which packets of any stream reach, from the first, seconds.
    pub(super) reached_s: f64,
    /// Bytes an AVI file says it has beyond those it has.
    pub(super) missing_bytes: u64,
}

impl Probe {
    /// Says how much is missing, when the file or its packets end before they should.
    pub(super) fn shortfall(&self) -> Option<String> {
        if self.missing_bytes > 0 {
            return Some(format!("the file ends {} bytes early", self.missing_bytes));
        }
        let stated = self.stated_s?;
        let missing = stated - self.reached_s;
        (missing > SHORTFALL_S.max(SHORTFALL_SHARE * stated)).then(|| {
            format!("the file says it lasts {stated:.2} s, but ends after {:.2} s", self.reached_s)
        })
    }
}

/// Reads the file once without decoding.
pub(super) fn run(ffmpeg: &Ffmpeg, path: &Path) -> Result<Probe> {
    let mut command = ffmpeg.reading(path, "info");
    // `V` leaves out cover pictures; sound is looked at for how far the file reaches.
    command.args(["-map", "0:V:0", "-map", "0:a?", "-c", "copy", "-f", "framecrc", "pipe:1"]);
    let mut child = Child::spawn(ffmpeg, path, &mut command)?;
    let (Some(stdout), Some(stderr)) = (child.take_stdout(), child.take_stderr()) else {
        return Err(Error::VideoUnreadable { path: path.to_owned(), log: String::new() });
    };
    let reader = thread::Builder::new()
        .name("ffmpeg-messages".to_owned())
        .spawn(move || first_lines(stderr))
        .map_err(Error::io(path, "start a thread to read"))?;
    let mut packets = Packets::default();
    for line in BufReader::new(stdout).lines() {
        packets.line(&line.map_err(Error::io(path, "read the packets of"))?);
    }
    let messages = reader.join().unwrap_or_default();
    let status = child.wait(path)?;
    if !status.success() {
        return Err(failure(path, status.code(), &messages));
    }
    let mut probe = packets.finish();
    describe(&messages, &mut probe);
    probe.missing_bytes = missing_riff_bytes(path)?;
    Ok(probe)
}

/// How many bytes the first chunk of a RIFF file (AVI) states that are not there. ffmpeg reads a
/// cut AVI without a word and shortens its duration to fit.
fn missing_riff_bytes(path: &Path) -> Result<u64> {
    let mut file = File::open(path).map_err(Error::io(path, "read"))?;
    let length = file.metadata().map_err(Error::io(path, "read"))?.len();
    let mut head = [0; 8];
    let [b'R', b'I', b'F', b'F', size @ ..] = (match file.read_exact(&mut head) {
        Ok(()) => head,
        Err(_) => return Ok(0),
    }) else {
        return Ok(0);
    };
    match u32::from_le_bytes(size) {
        // Written by recorders that never came back to fill the size in.
        0 | u32::MAX => Ok(0),
        stated => Ok((u64::from(stated) + 8).saturating_sub(length)),
    }
}

fn failure(path: &Path, code: Option<i32>, messages: &[String]) -> Error {
    if code == Some(super::stream::STOPPED_BY_SIGNAL) {
        return Error::Interrupted;
    }
    let path = path.to_owned();
    if messages.iter().any(|line| line.contains("matches no streams")) {
        return Error::NoVideoStream { path };
    }
    let tail = messages.len().saturating_sub(super::stream::LINES_SHOWN);
    Error::VideoUnreadable { path, log: messages[tail..].join("\n") }
}

/// All lines are read, so that the child never waits; the first ones are kept.
fn first_lines(from: impl Read) -> Vec<String> {
    let mut kept = Vec::new();
    let mut reader = BufReader::new(from);
    let mut line = Vec::new();
    while reader.read_until(b'\n', &mut line).is_ok_and(|n| n > 0) {
        if kept.len() < LINES_KEPT {
            kept.push(String::from_utf8_lossy(&line).trim_end().to_owned());
        }
        line.clear();
    }
    kept
}

/// The lines of the framecrc format, gathered.
#[derive(Default)]
struct Packets {
    size: Option<(usize, usize)>,
    aspect: Option<f64>,
    /// Tick of each stream, seconds.
    ticks_s: Vec<(usize, f64)>,
    presentation: Vec<i64>,
    decoding: Vec<i64>,
    without_presentation: bool,
    /// Earliest start and latest end of any packet, seconds.
    span_s: Option<(f64, f64)>,
}

impl Packets {
    fn line(&mut self, line: &str) {
        match line.strip_prefix('#') {
            Some(head) => self.head(head),
            None => {
                let _ = self.packet(line);
            }
        }
    }

    fn head(&mut self, head: &str) {
        let Some((key, value)) = head.split_once(": ") else { return };
        let Some((name, stream)) = key.split_once(' ') else { return };
        let Ok(stream) = stream.trim().parse::<usize>() else { return };
        match (name, stream) {
            ("tb", _) => {
                if let Some(tick) = fraction(value, '/') {
                    self.ticks_s.push((stream, tick));
                }
            }
            ("dimensions", 0) => {
                self.size = value
                    .trim()
                    .split_once('x')
                    .and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
            }
            ("sar", 0) => self.aspect = fraction(value, '/').filter(|a| *a > 0.0),
            _ => {}
        }
    }

    /// A packet's line; `None` when it is of another form, which says nothing.
    fn packet(&mut self, line: &str) -> Option<()> {
        let mut fields = line.split(',').map(str::trim);
        let stream: usize = fields.next()?.parse().ok()?;
        // A missing time is written as the least 64-bit number, or as a word.
        let time = |text: &str| text.parse::<i64>().ok().filter(|t| *t != i64::MIN);
        let decoding = time(fields.next()?);
        let presentation = time(fields.next()?);
        let duration: i64 = fields.next()?.parse().unwrap_or(0);
        let tick = self.ticks_s.iter().find(|(s, _)| *s == stream)?.1;
        if let Some(start) = presentation.or(decoding) {
            let (from, to) = (start as f64 * tick, (start.saturating_add(duration)) as f64 * tick);
            let span = self.span_s.get_or_insert((from, to));
            *span = (span.0.min(from), span.1.max(to));
        }
        if stream == 0 {
            self.presentation.extend(presentation);
            self.decoding.extend(decoding);
            self.without_presentation |= presentation.is_none();
        }
        Some(())
    }

    fn finish(self) -> Probe {
        let mut times = if self.without_presentation { self.decoding } else { self.presentation };
        times.sort_unstable();
        times.dedup();
        Probe {
            size: self.size,
            times,
            tick_s: self.ticks_s.iter().find(|(s, _)| *s == 0).map_or(0.0, |(_, tick)| *tick),
            pixel_aspect: self.aspect.unwrap_or(1.0),
            reached_s: self.span_s.map_or(0.0, |(from, to)| to - from),
            ..Probe::default()
        }
    }
}

fn fraction(text: &str, separator: char) -> Option<f64> {
    let (above, below) = text.trim().split_once(separator)?;
    let (above, below): (f64, f64) = (above.parse().ok()?, below.parse().ok()?);
    (below != 0.0).then(|| above / below)
}

/// Takes rate, rotation and duration from the words of `ffmpeg -i`. Only the description of the
/// input counts, which ends where that of the output begins.
fn describe(messages: &[String], probe: &mut Probe) {
    let mut in_video = false;
    let mut guessed = false;
    for line in messages {
        let line = line.trim();
        if line.starts_with("Output #") {
            break;
        }
        guessed |= line.contains("Estimating duration from bitrate");
        if let Some(rest) = line.strip_prefix("Duration: ") {
            probe.stated_s = clock_s(rest.split(',').next().unwrap_or_default());
        } else if line.starts_with("Stream #") {
            // The first video stream that is not a cover picture, as `0:V:0` chooses.
            in_video = probe.nominal_fps.is_none()
                && line.contains(": Video:")
                && !line.contains("(attached pic)");
            if in_video {
                probe.nominal_fps = stated_fps(line);
                probe.interlaced = FIELD_ORDERS.iter().any(|order| line.contains(order));
                probe.matrix = stated_matrix(line);
            }
        } else if in_video && let Some((_, degrees)) = line.split_once("rotation of ") {
            // ffmpeg states the turn counter-clockwise.
            let degrees: Option<f64> =
                degrees.split_whitespace().next().and_then(|d| d.parse().ok());
            probe.rotation_deg = degrees.map_or(0, |d| (-d).round().rem_euclid(360.0) as u16);
        }
    }
    if guessed {
        probe.stated_s = None;
    }
}

/// The matrix of a stream whose line says `yuv420p`, followed perhaps by what is known of its
/// colours: `yuv420p(tv, bt709, progressive)` or `yuv420p(bt470bg/unknown/smpte170m)`, the matrix
/// before primaries and curve. Where nothing is said it is that of BT.601, as ffmpeg's own
/// conversion has it. `None` for other formats, full range and rarer matrices.
fn stated_matrix(line: &str) -> Option<YuvMatrix> {
    let (_, rest) = line.split_once(", yuv420p")?;
    let known = match rest.strip_prefix('(') {
        Some(rest) => rest.split_once(')')?.0,
        None => rest.starts_with(',').then_some("")?,
    };
    let words: Vec<&str> = known.split(", ").map(|w| w.split('/').next().unwrap_or(w)).collect();
    let other = ["pc", "gbr", "fcc", "smpte240m", "ycgco", "bt2020c", "smpte2085"];
    if words.iter().any(|w| other.contains(w) || w.starts_with("chroma-derived") || *w == "ictcp") {
        return None;
    }
    Some(if words.contains(&"bt709") {
        YuvMatrix::Bt709
    } else if words.contains(&"bt2020nc") {
        YuvMatrix::Bt2020
    } else {
        YuvMatrix::Bt601
    })
}

/// The rate in a stream's line: `…, 29.97 fps, …`; thousands are written `1k`.
fn stated_fps(line: &str) -> Option<f64> {
    let of = |unit: &str| {
        let word = line.split(',').map(str::trim).find_map(|part| part.strip_suffix(unit))?;
        let (digits, factor) = word.strip_suffix('k').map_or((word, 1.0), |d| (d, 1000.0));
        digits.parse::<f64>().ok().map(|n| n * factor).filter(|n| *n > 0.0 && n.is_finite())
    };
    of(" fps").or_else(|| of(" tbr"))
}

/// Seconds of `00:01:02.50`.
fn clock_s(text: &str) -> Option<f64> {
    let mut parts = text.trim().split(':').map(|p| p.parse::<f64>().ok());
    let (hours, minutes, seconds) = (parts.next()??, parts.next()??, parts.next()??);
    Some(3600.0 * hours + 60.0 * minutes + seconds)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn described(text: &str) -> Probe {
        let mut probe = Probe::default();
        describe(&text.lines().map(str::to_owned).collect::<Vec<_>>(), &mut probe);
        probe
    }

    #[test]
    fn the_description_of_the_input_is_read() {
        let probe = described(
            "  Duration: 00:01:02.50, start: 0.000000, bitrate: 296 kb/s
  Stream #0:0: Video: mjpeg, yuvj420p, 600x600, 90k tbr, 90k tbn (attached pic)
  Stream #0:1[0x1](und): Video: h264 (High) (avc1 / 0x31637661), yuv420p(tv, bt709), 320x240 [SAR 1:1 DAR 4:3], 269 kb/s, 29.97 fps, 30 tbr, 12800 tbn (default)
    Side data:
      displaymatrix: rotation of -90.00 degrees
Output #0, framecrc, to 'pipe:1':
  Stream #0:0: Video: h264, 320x240, q=2-31, 25 fps, 25 tbr
      displaymatrix: rotation of 180.00 degrees",
        );
        assert_eq!(probe.nominal_fps, Some(29.97));
        assert_eq!(probe.rotation_deg, 90);
        assert_eq!(probe.stated_s, Some(62.5));
    }

    #[test]
    fn a_field_order_says_that_a_stream_is_interlaced() {
        for (order, interlaced) in [
            ("tv, top first", true),
            ("tv, bt470bg, bottom first", true),
            ("top coded first (swapped)", true),
            ("tv, progressive", false),
            ("tv, bt709", false),
        ] {
            let line = format!(
                "  Stream #0:0: Video: mpeg2video (Main), yuv420p({order}), 720x576, 25 fps"
            );
            assert_eq!(described(&line).interlaced, interlaced, "{order}");
        }
    }

    #[test]
    fn the_matrix_is_that_of_the_stated_colours() {
        for (format, matrix) in [
            ("yuv420p, 320x240", Some(YuvMatrix::Bt601)),
            ("yuv420p(progressive), 320x240", Some(YuvMatrix::Bt601)),
            ("yuv420p(tv, bt709, progressive), 320x240", Some(YuvMatrix::Bt709)),
            ("yuv420p(bt470bg/unknown/bt709), 320x240", Some(YuvMatrix::Bt601)),
            ("yuv420p(unknown/bt709/bt709), 320x240", Some(YuvMatrix::Bt601)),
            ("yuv420p(tv, bt2020nc/bt2020/arib-std-b67), 320x240", Some(YuvMatrix::Bt2020)),
            ("yuv420p(pc, bt709), 320x240", None),
            ("yuv420p(smpte240m), 320x240", None),
            ("yuvj420p(pc, bt470bg/unknown/unknown), 320x240", None),
            ("yuv420p10le(tv, bt709), 320x240", None),
            ("yuv444p, 320x240", None),
        ] {
            let line = format!("  Stream #0:0: Video: h264 (High), {format}, 25 fps");
            assert_eq!(described(&line).matrix, matrix, "{format}");
        }
    }

    #[test]
    fn guessed_durations_do_not_count() {
        let probe = described(
            "[mp3 @ 0x1] Estimating duration from bitrate, this may be inaccurate
  Duration: 00:01:02.50, bitrate: 1 kb/s
  Stream #0:0: Video: mpeg4, yuv420p, 320x240, 1k fps",
        );
        assert_eq!(probe.stated_s, None);
        assert_eq!(probe.nominal_fps, Some(1000.0));
        assert_eq!(described("  Duration: N/A, start: 0").stated_s, None);
    }

    #[test]
    fn packets_come_in_decoding_order_and_leave_in_order_of_show() {
        let mut packets = Packets::default();
        for line in [
            "#software: Lavf59",
            "#tb 0: 1/100",
            "#dimensions 0: 320x240",
            "#sar 0: 4/3",
            "#tb 1: 1/10",
            "0, -4, 0, 4, 99, 0x1",
            "0, 0, 12, 4, 99, 0x1, F=0x0",
            "1, 0, 0, 30, 9, 0x1",
            "0, 4, 4, 4, 99, 0x1",
            "0, 8, 8, 4, 99, 0x1",
            "nonsense",
        ] {
            packets.line(line);
        }
        let probe = packets.finish();
        assert_eq!(probe.times, [0, 4, 8, 12]);
        assert_eq!((probe.size, probe.tick_s), (Some((320, 240)), 0.01));
        assert_eq!(probe.pixel_aspect, 4.0 / 3.0);
        assert_eq!(probe.reached_s, 3.0);
    }

    #[test]
    fn decoding_times_stand_in_for_missing_ones() {
        let mut packets = Packets::default();
        for line in ["#tb 0: 1/15", "0, 0, 0, 1, 9, 0x1", "0, 1, -9223372036854775808, 1, 9, 0x1"] {
            packets.line(line);
        }
        assert_eq!(packets.finish().times, [0, 1]);
    }

    #[test]
    fn a_file_that_ends_early_says_so() {
        let probe =
            |stated, reached| Probe { stated_s: stated, reached_s: reached, ..Probe::default() };
        assert!(probe(Some(10.0), 6.0).shortfall().is_some());
        assert!(probe(Some(10.0), 9.7).shortfall().is_none());
        assert!(probe(None, 6.0).shortfall().is_none());
    }
}
