//! Clips made by ffmpeg's own test sources and read back; skipped where there is no ffmpeg.

use std::fs;
use std::io::Write as _;
use std::process::Command;

use super::*;
use crate::frames::{SourceSpec, open};
use crate::image::YuvMatrix;

/// A clip that ffmpeg makes in a temporary folder.
struct Clips {
    ffmpeg: Ffmpeg,
    folder: tempfile::TempDir,
}

impl Clips {
    fn new() -> Option<Self> {
        match Ffmpeg::find(Path::new("test")) {
            Ok(ffmpeg) => Some(Self { ffmpeg, folder: tempfile::tempdir().unwrap() }),
            Err(_) => {
                eprintln!("skipped: no ffmpeg");
                None
            }
        }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Runs ffmpeg with the words of `arguments` and `name` as the file to write.
    fn make(&self, name: &str, arguments: &str) -> PathBuf {
        let path = self.path(name);
        let status = Command::new(self.ffmpeg.program())
            .args(["-nostdin", "-y", "-v", "error"])
            .args(arguments.split_whitespace())
            .arg(&path)
            .current_dir(self.folder.path())
            .status()
            .unwrap();
        assert!(status.success(), "{arguments}");
        path
    }

    /// The first `share` of a file, as another file.
    fn cut(&self, from: &Path, name: &str, share: f64) -> PathBuf {
        let bytes = fs::read(from).unwrap();
        let path = self.path(name);
        fs::write(&path, &bytes[..(bytes.len() as f64 * share) as usize]).unwrap();
        path
    }
}

/// Frame `n` of this source is the grey value `40 + 4 n`, so that each frame tells its number.
const COUNTING: &str = "-f lavfi -i color=black:s=64x48:r=25:d=1.6,format=gray,geq=lum='40+4*N'";

fn numbers(path: &Path) -> Result<(VideoInfo, Vec<usize>)> {
    let mut footage = open(&SourceSpec::new(path))?;
    let info = footage.video().unwrap().clone();
    let mut numbers = Vec::new();
    while let Some(picture) = footage.next_frame()? {
        let level = f64::from(picture.pixel(32, 24)[1]);
        numbers.push(((level - 40.0) / 4.0).round() as usize);
    }
    Ok((info, numbers))
}

#[test]
fn every_frame_comes_once_in_order() {
    let Some(clips) = Clips::new() else { return };
    for (name, codec) in [
        ("a.mkv", "-c:v ffv1"),
        ("a.avi", "-c:v mjpeg -q:v 1 -pix_fmt yuvj444p"),
        ("a.mp4", "-c:v mpeg4 -q:v 1 -bf 2"),
        ("a.mov", "-c:v png -pix_fmt rgb24"),
    ] {
        let (info, numbers) = numbers(&clips.make(name, &format!("{COUNTING} {codec}"))).unwrap();
        assert_eq!((info.width, info.height), (64, 48), "{name}");
        assert!((info.fps - 25.0).abs() < 1e-9, "{name}: {}", info.fps);
        assert_eq!((info.variable_frame_rate, info.rotation_deg), (false, 0), "{name}");
        assert_eq!(numbers, (0..40).collect::<Vec<_>>(), "{name}");
        assert_eq!(info.frame_count, Some(40), "{name}");
    }
}

#[test]
fn a_part_is_decoded_no_further_than_needed() {
    let Some(clips) = Clips::new() else { return };
    let path = clips.make("a.mkv", &format!("{COUNTING} -c:v ffv1"));
    let spec =
        |text: &str| SourceSpec { frames: Some(text.parse().unwrap()), ..SourceSpec::new(&path) };
    let mut footage = open(&spec("5-7")).unwrap();
    assert_eq!(footage.frame_count(), Some(3));
    let mut levels = Vec::new();
    while let Some(picture) = footage.next_frame().unwrap() {
        levels.push(picture.pixel(0, 0)[0].abs_diff(picture.pixel(0, 0)[1]));
    }
    assert_eq!(levels, [0, 0, 0]);
    let mut outside = open(&spec("38-40")).unwrap();
    let error = loop {
        match outside.next_frame() {
            Ok(Some(_)) => {}
            Ok(None) => panic!("the end came without an error"),
            Err(error) => break error,
        }
    };
    assert!(matches!(error, Error::FrameRangeOutside { available: 40, .. }), "{error}");
}

#[test]
fn ntsc_rates_are_exact() {
    let Some(clips) = Clips::new() else { return };
    let source = "-f lavfi -i testsrc2=s=64x48:r=30000/1001:d=2 -c:v mpeg4";
    for name in ["n.mkv", "n.mp4", "n.avi"] {
        let (info, numbers) = numbers(&clips.make(name, source)).unwrap();
        assert!((info.fps - 30_000.0 / 1001.0).abs() < 1e-9, "{name}: {}", info.fps);
        assert_eq!(numbers.len(), 60, "{name}");
    }
}

#[test]
fn holes_are_filled_by_the_frame_before() {
    let Some(clips) = Clips::new() else { return };
    let source = format!("{COUNTING},select='not(between(n\\,10\\,20))' -fps_mode vfr -c:v ffv1");
    let path = clips.make("vfr.mkv", &source);
    let (info, numbers) = numbers(&path).unwrap();
    assert!(info.variable_frame_rate);
    assert!((info.fps - 25.0).abs() < 1e-9, "{}", info.fps);
    let expected: Vec<usize> =
        (0..40).map(|i| if (10..=20).contains(&i) { 9 } else { i }).collect();
    assert_eq!(numbers, expected);
    let footage = open(&SourceSpec::new(&path)).unwrap();
    assert!(matches!(footage.findings(), [Finding::VariableFrameRate { .. }]));
}

/// How much each line differs from the two about it: what two fields of a moving picture do.
fn combing(picture: &Picture) -> f64 {
    let grey = |x: usize, y: usize| f64::from(picture.pixel(x, y)[1]);
    let mut sum = 0.0;
    for y in 1..picture.height() - 1 {
        for x in 0..picture.width() {
            let (above, here, below) = (grey(x, y - 1), grey(x, y), grey(x, y + 1));
            // Both neighbours on the same side: an edge is not.
            sum += ((here - above) * (here - below)).max(0.0).sqrt();
        }
    }
    sum / (picture.width() * picture.height()) as f64
}

#[test]
fn interlaced_frames_are_read_without_combs() {
    let Some(clips) = Clips::new() else { return };
    // A bar that moves by six pixels a field.
    let moving = "-f lavfi -i color=black:s=96x64:r=50:d=0.8,format=gray,geq=lum='if(between(X-6*N,0,20),235,16)',tinterlace=interleave_top";
    let flagged = "-c:v mpeg2video -q:v 1 -flags +ilme+ildct -top 1";
    let third = |name: &str, how: &str| {
        let path = clips.make(name, &format!("{moving} {how}"));
        let mut footage = open(&SourceSpec::new(&path)).unwrap();
        let findings = footage.findings().to_vec();
        let mut frames = 0;
        let mut combs = 0.0;
        while let Some(picture) = footage.next_frame().unwrap() {
            frames += 1;
            if frames == 3 {
                combs = combing(&picture);
            }
        }
        (findings, frames, combs)
    };
    let (findings, frames, combs) = third("fields.mpg", flagged);
    assert!(matches!(findings[..], [Finding::Interlaced { .. }]), "{findings:?}");
    let (unsaid, same, raw) = third("unsaid.mkv", "-c:v ffv1");
    assert!(unsaid.is_empty(), "{unsaid:?}");
    assert_eq!(frames, same);
    assert!(combs < 0.2 * raw, "{combs} of {raw}");
}

/// Our conversion of stored colours beside ffmpeg's own, which rounds more coarsely: the same matrix,
/// the same range, chroma at the same place.
#[test]
fn frames_as_stored_are_the_same_pictures() {
    let Some(clips) = Clips::new() else { return };
    for (matrix, tags) in [
        (YuvMatrix::Bt601, ""),
        (YuvMatrix::Bt709, "-colorspace bt709 -color_primaries bt709 -color_trc bt709"),
        (YuvMatrix::Bt2020, "-colorspace bt2020nc -color_range tv"),
    ] {
        let source = "-f lavfi -i testsrc2=s=150x98:r=25:d=0.2 -pix_fmt yuv420p -c:v ffv1";
        let path = clips.make("t.mkv", &format!("{source} {tags}"));
        let mut converted = open(&SourceSpec::new(&path)).unwrap();
        let stored = SourceSpec { as_stored: true, ..SourceSpec::new(&path) };
        let mut stored = open(&stored).unwrap();
        let mut frames = 0;
        while let Some(theirs) = converted.next_frame().unwrap() {
            let Some(Frame::Yuv(frame)) = stored.next_stored().unwrap() else {
                panic!("{matrix:?}")
            };
            assert_eq!(frame.matrix(), matrix);
            let ours = frame.to_rgb();
            let apart = ours.rgb().iter().zip(theirs.rgb()).map(|(a, b)| a.abs_diff(*b));
            assert!(apart.clone().max() <= Some(3), "{matrix:?}: {:?}", apart.max());
            let mean = apart.map(f64::from).sum::<f64>() / ours.rgb().len() as f64;
            assert!(mean < 1.0, "{matrix:?}: {mean}");
            frames += 1;
        }
        assert!(stored.next_stored().unwrap().is_none());
        assert_eq!(frames, 5);
    }
}

#[test]
fn what_is_stored_otherwise_comes_converted() {
    let Some(clips) = Clips::new() else { return };
    for (name, format) in [
        ("odd.mkv", "-vf scale=63:48 -pix_fmt yuv420p -c:v ffv1"),
        ("full.mkv", "-pix_fmt yuvj420p -color_range pc -c:v mjpeg"),
        ("444.mkv", "-pix_fmt yuv444p -c:v ffv1"),
        ("rgb.mov", "-pix_fmt rgb24 -c:v png"),
    ] {
        let path = clips.make(name, &format!("-f lavfi -i testsrc2=s=64x48:r=25:d=0.1 {format}"));
        let spec = SourceSpec { as_stored: true, ..SourceSpec::new(&path) };
        let first = open(&spec).unwrap().next_stored().unwrap();
        let plain = open(&SourceSpec::new(&path)).unwrap().next_frame().unwrap();
        assert_eq!(first, plain.map(Frame::Rgb), "{name}");
    }
}

/// The part of a clip is the same part however its frames are wanted.
#[test]
fn a_part_of_the_frames_as_stored_is_chosen_as_any_other() {
    let Some(clips) = Clips::new() else { return };
    let path = clips.make("a.mkv", &format!("{COUNTING},format=yuv420p -c:v ffv1"));
    let part = |frames: Option<&str>| {
        let frames = frames.map(|f| f.parse().unwrap());
        let spec = SourceSpec { frames, as_stored: true, ..SourceSpec::new(&path) };
        let mut footage = open(&spec).unwrap();
        std::iter::from_fn(|| footage.next_stored().unwrap()).collect::<Vec<_>>()
    };
    assert_eq!(part(Some("7-9")), part(None)[7..=9]);
}

/// Writes a rotation into the track header of an MP4 file: the matrix's first four numbers.
fn turn_track(path: &Path, [a, b, c, d]: [i32; 4]) {
    let mut bytes = fs::read(path).unwrap();
    let header = bytes.windows(4).position(|w| w == b"tkhd").unwrap();
    let matrix = header + 4 + 40;
    for (place, value) in [(0, a), (4, b), (12, c), (16, d)] {
        let at = matrix + place;
        bytes[at..at + 4].copy_from_slice(&(value << 16).to_be_bytes());
    }
    fs::File::create(path).unwrap().write_all(&bytes).unwrap();
}

#[test]
fn rotation_flags_turn_the_picture_upright() {
    let Some(clips) = Clips::new() else { return };
    // White on the left half, black on the right.
    let source = "-f lavfi -i color=black:s=64x32:r=25:d=0.2,drawbox=w=32:h=32:color=white:t=fill -c:v mpeg4";
    let path = clips.make("turned.mp4", source);
    turn_track(&path, [0, 1, -1, 0]); // a quarter clockwise, as phones write it
    let mut footage = open(&SourceSpec::new(&path)).unwrap();
    let info = footage.video().unwrap().clone();
    assert_eq!((info.width, info.height, info.rotation_deg), (32, 64, 90));
    let picture = footage.next_frame().unwrap().unwrap();
    assert!(picture.pixel(16, 8)[0] > 200, "left must have come to the top");
    assert!(picture.pixel(16, 56)[0] < 50);
}

#[test]
fn cut_and_broken_files_are_refused() {
    let Some(clips) = Clips::new() else { return };
    let source = "-f lavfi -i testsrc2=s=320x240:r=25:d=3";
    for (name, options) in [
        ("a.mp4", "-c:v mpeg4 -movflags +faststart"),
        ("a.mkv", "-c:v mpeg4"),
        ("a.avi", "-c:v mpeg4"),
        ("b.avi", "-c:v mjpeg"),
    ] {
        let whole = clips.make(name, &format!("{source} {options}"));
        assert_eq!(numbers(&whole).unwrap().1.len(), 75, "{name}");
        for share in [0.5, 0.8] {
            let cut = clips.cut(&whole, &format!("cut-{share}-{name}"), share);
            let error = numbers(&cut).unwrap_err();
            assert!(matches!(error, Error::VideoDamaged { .. }), "{name} {share}: {error}");
            let text = error.to_string();
            assert!(text.contains(name) && text.contains("frame"), "{text}");
            assert!(error.remedy().unwrap().contains("--frames"));
        }
    }
    // Without its index an MP4 cannot be opened at all.
    let whole = clips.make("c.mp4", &format!("{source} -c:v mpeg4"));
    let error = numbers(&clips.cut(&whole, "cut.mp4", 0.5)).unwrap_err();
    assert!(matches!(error, Error::VideoUnreadable { .. }), "{error}");
}

#[test]
fn the_whole_part_of_a_cut_file_can_be_used() {
    let Some(clips) = Clips::new() else { return };
    let whole = clips.make("a.mkv", &format!("{COUNTING} -c:v ffv1 -g 1"));
    let cut = clips.cut(&whole, "cut.mkv", 0.7);
    assert!(numbers(&cut).is_err());
    let spec = SourceSpec { frames: Some("0-9".parse().unwrap()), ..SourceSpec::new(&cut) };
    let mut footage = open(&spec).unwrap();
    let mut count = 0;
    while footage.next_frame().unwrap().is_some() {
        count += 1;
    }
    assert_eq!(count, 10);
}

#[test]
fn foreign_files_are_refused() {
    let Some(clips) = Clips::new() else { return };
    let text = clips.path("notes.mov");
    fs::write(&text, "this is no video, whatever it is called\n".repeat(50)).unwrap();
    let error = numbers(&text).unwrap_err();
    assert!(matches!(error, Error::VideoUnreadable { .. }), "{error}");
    assert!(error.to_string().contains("notes.mov"));

    let sound = clips.make("sound.wav", "-f lavfi -i sine=d=0.2");
    let error = numbers(&sound).unwrap_err();
    assert!(matches!(error, Error::NoVideoStream { .. }), "{error}");
    assert!(error.to_string().contains("sound.wav"));
}

#[test]
fn enormous_video_is_refused_before_it_is_decoded() {
    let Some(clips) = Clips::new() else { return };
    let path = clips.make("wide.mkv", "-f lavfi -i color=s=20000x16:r=1:d=1 -c:v ffv1");
    let error = numbers(&path).unwrap_err();
    assert!(matches!(error, Error::PictureTooLarge { width: 20_000, frame: 0, .. }), "{error}");
}

#[test]
fn a_stated_rate_replaces_the_files() {
    let Some(clips) = Clips::new() else { return };
    let path = clips.make("a.mkv", &format!("{COUNTING} -c:v ffv1"));
    let footage = open(&SourceSpec { fps: Some(240.0), ..SourceSpec::new(&path) }).unwrap();
    assert_eq!(footage.fps(), Some(240.0));
    assert!((footage.video().unwrap().fps - 25.0).abs() < 1e-9);
}

/// Numbers of the processes whose command line names a file.
#[cfg(target_os = "linux")]
fn processes_naming(path: &Path) -> Vec<String> {
    let name = path.as_os_str().as_encoded_bytes();
    let names_it = |folder: &Path| {
        fs::read(folder.join("cmdline")).is_ok_and(|l| l.windows(name.len()).any(|w| w == name))
    };
    fs::read_dir("/proc")
        .unwrap()
        .filter_map(|entry| entry.ok())
        .filter(|entry| names_it(&entry.path()))
        .filter_map(|entry| entry.file_name().into_string().ok())
        .collect()
}

/// A long stream that is dropped in the middle: the process must be gone, without waiting for the
/// rest.
#[test]
#[cfg(target_os = "linux")]
fn dropping_the_source_ends_ffmpeg() {
    let Some(clips) = Clips::new() else { return };
    let path = clips.make("long.mkv", "-f lavfi -i testsrc2=s=640x480:r=25:d=20 -c:v mpeg4");
    let running = || processes_naming(&path).len();
    let mut footage = open(&SourceSpec::new(&path)).unwrap();
    footage.next_frame().unwrap();
    assert_eq!(running(), 1);
    drop(footage);
    assert_eq!(running(), 0);
}

/// The interrupt that a terminal sends to the whole process group, sent to ffmpeg alone.
#[test]
#[cfg(target_os = "linux")]
fn an_interrupted_ffmpeg_is_no_end_of_the_video() {
    let Some(clips) = Clips::new() else { return };
    let path = clips.make("long.mkv", "-f lavfi -i testsrc2=s=640x480:r=25:d=20 -c:v mpeg4");
    let mut footage = open(&SourceSpec::new(&path)).unwrap();
    footage.next_frame().unwrap();
    for process in processes_naming(&path) {
        assert!(Command::new("kill").args(["-INT", &process]).status().unwrap().success());
    }
    let error = loop {
        match footage.next_frame() {
            Ok(Some(_)) => {}
            Ok(None) => panic!("the end came without an error"),
            Err(error) => break error,
        }
    };
    assert!(matches!(error, Error::Interrupted), "{error}");
}

#[test]
fn pictures_that_ffmpeg_writes_are_read() {
    let Some(clips) = Clips::new() else { return };
    // Mid grey at the left, white at the right; ffmpeg scales code values to floats linearly.
    let source = "-f lavfi -i color=0x808080:s=32x16:r=1:d=1,format=gbrp,drawbox=x=16:w=16:h=16:color=white:t=fill";
    for (name, options, left) in [
        ("deep.png", "-pix_fmt rgb48be -frames:v 1", 128),
        ("deep.tif", "-pix_fmt rgb48le -frames:v 1", 128),
        ("grey.tif", "-pix_fmt gray16le -frames:v 1", 128),
        ("float.exr", "-pix_fmt gbrpf32le -frames:v 1", 188),
        ("half.exr", "-pix_fmt gbrapf32le -format half -compression zip16 -frames:v 1", 188),
        ("grey.exr", "-pix_fmt grayf32le -frames:v 1", 188),
        ("plain.bmp", "-pix_fmt bgr24 -frames:v 1", 128),
    ] {
        let path = clips.make(name, &format!("{source} {options}"));
        let picture = open(&SourceSpec::new(&path)).unwrap().next_frame().unwrap().unwrap();
        let [grey, white] = [picture.pixel(4, 8), picture.pixel(28, 8)];
        for channel in 0..3 {
            assert!(grey[channel].abs_diff(left) <= 2, "{name}: {grey:?}");
            // ffmpeg's grey float keeps video's headroom: white is 235 of 255, coded as 246.
            assert!(white[channel] >= 246, "{name}: {white:?}");
        }
    }
}

#[test]
fn real_footage_is_read() {
    let Some(_clips) = Clips::new() else { return };
    let data = std::env::var_os("MUYBRIDGE_DATA").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data"),
        PathBuf::from,
    );
    let path = data.join("video/horse_walk/20210201_cento_walk_72_1612209370182.avi");
    if !path.is_file() {
        eprintln!("skipped: {} is not there", path.display());
        return;
    }
    let mut footage = open(&SourceSpec::new(&path)).unwrap();
    assert_eq!((footage.width(), footage.height()), (2208, 1242));
    assert_eq!(footage.fps(), Some(15.0));
    let mut count = 0;
    while footage.next_frame().unwrap().is_some() {
        count += 1;
    }
    assert_eq!(Some(count), footage.video().unwrap().frame_count);
    assert_eq!(count, 61);
}
