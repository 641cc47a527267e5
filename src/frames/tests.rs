use std::fs;

use ::image::codecs::gif::GifEncoder;
use ::image::{Delay, Frame, Rgb, RgbImage, Rgba, RgbaImage};

use super::strokes::Said;
use super::*;

/// A folder of test files.
struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// A 4 × 3 picture of one grey value.
    fn grey(self, name: &str, value: u8) -> Self {
        RgbImage::from_pixel(4, 3, Rgb([value; 3])).save(self.path(name)).unwrap();
        self
    }

    fn file(self, name: &str, bytes: &[u8]) -> Self {
        fs::write(self.path(name), bytes).unwrap();
        self
    }

    fn spec(&self, name: &str) -> SourceSpec {
        SourceSpec::new(self.path(name))
    }
}

/// The red value of every frame's first pixel.
fn values(footage: &mut dyn FrameSource) -> Result<Vec<u8>> {
    let mut values = Vec::new();
    while let Some(picture) = footage.next_frame()? {
        assert_eq!((picture.width(), picture.height()), (footage.width(), footage.height()));
        values.push(picture.pixel(0, 0)[0]);
    }
    Ok(values)
}

fn read(spec: &SourceSpec) -> Result<Vec<u8>> {
    let mut footage = open(spec)?;
    let known = footage.frame_count();
    let values = values(&mut footage)?;
    assert!(known.is_none_or(|count| count == values.len()));
    Ok(values)
}

fn numbered() -> Folder {
    Folder::new().grey("i1.png", 1).grey("i2.png", 2).grey("i10.png", 10).grey("i3.bmp", 3)
}

#[test]
fn folders_globs_and_patterns_read_in_natural_order() {
    let folder = numbered();
    assert_eq!(read(&folder.spec("")).unwrap(), [1, 2, 3, 10]);
    assert_eq!(read(&folder.spec("*.png")).unwrap(), [1, 2, 10]);
    assert_eq!(read(&folder.spec("i%d.png")).unwrap(), [1, 2, 10]);
    assert_eq!(read(&folder.spec("i10.png")).unwrap(), [10]);
}

#[test]
fn an_existing_name_goes_before_a_pattern() {
    let folder = Folder::new().grey("take [1].png", 7);
    assert_eq!(read(&folder.spec("take [1].png")).unwrap(), [7]);
}

#[test]
fn odd_things_are_findings() {
    let folder = numbered().file("notes.txt", b"hello").file(".DS_Store", b"x");
    let footage = open(&folder.spec("")).unwrap();
    let [
        Finding::LeftOut { count: 1, .. },
        Finding::MixedKinds { kinds },
        Finding::Gap { missing: 6, after, before },
    ] = footage.findings()
    else {
        panic!("{:?}", footage.findings())
    };
    assert_eq!(kinds, &["BMP", "PNG"]);
    assert!(after.ends_with("i3.bmp") && before.ends_with("i10.png"));
    for finding in footage.findings() {
        assert!(!finding.to_string().is_empty());
    }
}

#[test]
fn a_part_is_read_and_listed() {
    let folder = numbered();
    let spec = SourceSpec { frames: Some("1-2".parse().unwrap()), ..folder.spec("") };
    assert_eq!(read(&spec).unwrap(), [2, 3]);
    let files = source_files(&spec).unwrap();
    assert_eq!(files, [folder.path("i2.png"), folder.path("i3.bmp")]);
}

#[test]
fn a_part_outside_is_refused() {
    let folder = numbered();
    let spec = SourceSpec { frames: Some("2-4".parse().unwrap()), ..folder.spec("") };
    for error in [open(&spec).err().unwrap(), source_files(&spec).unwrap_err()] {
        assert!(matches!(error, Error::FrameRangeOutside { last: 4, available: 4, .. }));
        assert!(error.remedy().unwrap().contains("0-3"));
    }
}

#[test]
fn ranges_are_read_as_people_write_them() {
    let range: FrameRange = "3-7".parse().unwrap();
    assert_eq!((range.first(), range.last(), range.count()), (3, 7, 5));
    assert_eq!(range.to_string(), "3-7");
    assert_eq!("5".parse::<FrameRange>().unwrap(), FrameRange::new(5, 5).unwrap());
    for bad in ["7-3", "", "-", "a-b", "1-2-3", "-5", "1.5-2"] {
        let error = bad.parse::<FrameRange>().unwrap_err();
        assert!(matches!(&error, Error::BadFrameRange { text } if text == bad), "{bad}");
        assert!(error.remedy().is_some());
    }
}

#[test]
fn rates_that_are_none_are_refused() {
    let folder = numbered();
    for fps in [0.0, -25.0, f64::NAN, f64::INFINITY] {
        let spec = SourceSpec { fps: Some(fps), ..folder.spec("") };
        let error = open(&spec).err().unwrap();
        assert!(matches!(error, Error::BadFrameRate { .. }));
        assert!(error.remedy().is_some());
    }
    let spec = SourceSpec { fps: Some(12.5), ..folder.spec("") };
    assert_eq!(open(&spec).unwrap().fps(), Some(12.5));
    assert_eq!(open(&folder.spec("")).unwrap().fps(), None);
}

#[test]
fn nothing_there_is_said_plainly() {
    let folder = Folder::new().file("notes.txt", b"hello");
    for name in ["missing", "missing.mov", "missing/%04d.png"] {
        let error = open(&folder.spec(name)).err().unwrap();
        assert!(matches!(error, Error::SourceMissing { .. }), "{name}: {error}");
        assert!(error.to_string().contains(name));
    }
    for (name, ignored) in [("", 1), ("*.png", 0), ("f%04d.png", 0), ("*", 1)] {
        let error = open(&folder.spec(name)).err().unwrap();
        assert!(
            matches!(error, Error::NoPictures { ignored: n, .. } if n == ignored),
            "{name}: {error}"
        );
        assert!(error.remedy().is_some());
    }
    let error = open(&folder.spec("f%s.png")).err().unwrap();
    assert!(matches!(error, Error::BadPattern { .. }));
    let error = open(&folder.spec("a[.png")).err().unwrap();
    assert!(matches!(error, Error::BadPattern { .. }), "{error}");
}

#[test]
fn a_broken_frame_stops_where_it_is() {
    let folder = Folder::new().grey("f0.png", 0).file("f1.png", b"").grey("f2.png", 2);
    let error = read(&folder.spec("")).unwrap_err();
    assert!(matches!(error, Error::EmptyFile { frame: 1, .. }), "{error}");
    assert!(error.to_string().contains("f1.png"));
    // Frame numbers are those of the whole sequence, also in a part.
    let part = SourceSpec { frames: Some("1-2".parse().unwrap()), ..folder.spec("") };
    assert!(matches!(open(&part).err().unwrap(), Error::EmptyFile { frame: 1, .. }));
}

#[test]
fn single_files_that_are_none_are_refused() {
    let folder = Folder::new().file("empty.mov", b"").file("text.png", b"hello there");
    let error = open(&folder.spec("empty.mov")).err().unwrap();
    assert!(matches!(error, Error::EmptyFile { frame: 0, .. }));
    let error = open(&folder.spec("text.png")).err().unwrap();
    assert!(matches!(error, Error::NotAPicture { frame: 0, .. }));
}

#[test]
fn sizes_must_agree() {
    let folder = Folder::new().grey("f0.png", 0);
    RgbImage::new(5, 3).save(folder.path("f1.png")).unwrap();
    let error = read(&folder.spec("")).unwrap_err();
    let Error::SizeMismatch { frame: 1, width: 5, expected_width: 4, .. } = error else {
        panic!("{error:?}")
    };
    let text = error.to_string();
    assert!(text.contains("f1.png") && text.contains("5×3") && text.contains("4×3"), "{text}");
}

#[test]
fn video_without_ffmpeg_says_what_to_install() {
    let folder = Folder::new().file("lion.mov", b"surely a video");
    let find = |video: &Path| Ffmpeg::find_in(video, None, Some(folder.path("").into()));
    let error = open_with(&folder.spec("lion.mov"), find).err().unwrap();
    assert!(matches!(error, Error::FfmpegMissing { .. }), "{error}");
}

fn gif(delays_ms: &[u32]) -> Vec<u8> {
    let mut bytes = Vec::new();
    {
        let mut encoder = GifEncoder::new(&mut bytes);
        for (i, &ms) in delays_ms.iter().enumerate() {
            let frame = RgbaImage::from_pixel(4, 3, Rgba([i as u8 * 20, 0, 0, 255]));
            let delay = Delay::from_numer_denom_ms(ms, 1);
            encoder.encode_frame(Frame::from_parts(frame, 0, 0, delay)).unwrap();
        }
    }
    bytes
}

#[test]
fn an_animated_gif_is_footage() {
    let folder = Folder::new().file("a.gif", &gif(&[40, 40, 40])).file("b.gif", &gif(&[40, 120]));
    let even = open(&folder.spec("a.gif")).unwrap();
    assert_eq!((even.fps(), even.findings().len()), (Some(25.0), 0));
    assert_eq!(read(&folder.spec("a.gif")).unwrap(), [0, 20, 40]);
    assert_eq!(read(&folder.spec("b.gif")).unwrap(), [0, 20, 20, 20]);
    let uneven = open(&folder.spec("b.gif")).unwrap();
    assert!(matches!(uneven.findings(), [Finding::VariableFrameRate { fps: 25.0, .. }]));
    let part = SourceSpec { frames: Some("1-2".parse().unwrap()), ..folder.spec("a.gif") };
    assert_eq!(read(&part).unwrap(), [20, 40]);
    let outside = SourceSpec { frames: Some("1-3".parse().unwrap()), ..folder.spec("a.gif") };
    let error = open(&outside).err().unwrap();
    assert!(matches!(error, Error::FrameRangeOutside { available: 3, .. }));
    assert_eq!(source_files(&folder.spec("a.gif")).unwrap(), [folder.path("a.gif")]);
}

#[test]
fn a_gif_cut_short_is_refused() {
    let whole = gif(&[40, 40, 40]);
    let folder = Folder::new().file("a.gif", &whole[..whole.len() * 2 / 3]);
    let error = open(&folder.spec("a.gif")).err().unwrap();
    assert!(matches!(error, Error::PictureTruncated { .. }), "{error}");
}

#[test]
fn a_gif_without_pixels_is_refused() {
    let mut flat = gif(&[40, 40]);
    flat[6..8].fill(0); // width of the canvas
    let folder = Folder::new().file("a.gif", &flat);
    let error = read(&folder.spec("a.gif")).unwrap_err();
    assert!(matches!(error, Error::PictureUndecodable { frame: 0, .. }), "{error}");
    assert!(error.to_string().contains("a.gif"));
}

#[test]
fn strokes_are_numbered_by_name() {
    let folder = Folder::new().grey("000012.png", 255).grey("b_3.png", 0).file("x.txt", b"x");
    let numbered = strokes::numbered_files(&folder.path("")).unwrap();
    assert_eq!(numbered, [(3, folder.path("b_3.png")), (12, folder.path("000012.png"))]);

    let twice = Folder::new().grey("a12.png", 0).grey("b012.png", 0);
    let error = strokes::numbered_files(&twice.path("")).unwrap_err();
    assert!(matches!(error, Error::DuplicateStrokes { frame: 12, .. }));
    assert!(error.to_string().contains("a12.png") && error.to_string().contains("b012.png"));

    let unnumbered = Folder::new().grey("sketch.png", 0);
    let error = strokes::numbered_files(&unnumbered.path("")).unwrap_err();
    assert!(matches!(error, Error::UnnumberedStrokes { .. }));
    assert!(error.remedy().unwrap().contains("000012.png"));
}

#[test]
fn strokes_say_three_things() {
    let folder = Folder::new();
    let pixels = [[255, 255, 255, 255], [0, 0, 0, 255], [255, 255, 255, 100], [0, 0, 0, 0]];
    let clear = RgbaImage::from_fn(4, 1, |x, _| Rgba(pixels[x as usize]));
    clear.save(folder.path("1.png")).unwrap();
    let said = strokes::read(&folder.path("1.png"), 1, Some((4, 1))).unwrap().said;
    assert_eq!(said, [Said::Foreground, Said::Background, Said::Unsaid, Said::Unsaid]);

    let opaque = RgbaImage::from_fn(2, 1, |x, _| Rgba(pixels[x as usize]));
    opaque.save(folder.path("2.png")).unwrap();
    let said = strokes::read(&folder.path("2.png"), 2, None).unwrap().said;
    assert_eq!(said, [Said::Foreground, Said::Unsaid]);

    let error = strokes::read(&folder.path("2.png"), 2, Some((4, 1))).unwrap_err();
    assert!(matches!(error, Error::SizeMismatch { frame: 2, .. }));
}
