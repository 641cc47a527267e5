//! Real frames and mattes, read through the public interface.

use std::path::{Path, PathBuf};

use muybridge::Error;
use muybridge::frames::mattes::{self, Matte, MatteSpec};
use muybridge::frames::{self, FrameSource as _, SourceSpec};

/// A place in the test data, or `None` with a message when the data are absent.
#[allow(clippy::print_stderr, reason = "says why a test did nothing")]
fn data(place: &str) -> Option<PathBuf> {
    let root = std::env::var_os("MUYBRIDGE_DATA").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data"),
        PathBuf::from,
    );
    let path = root.join(place);
    if path.exists() {
        return Some(path);
    }
    eprintln!("skipped: {} is not there", path.display());
    None
}

fn matte_spec(location: PathBuf) -> MatteSpec {
    MatteSpec { location, frames: None, invert: false, size: None }
}

#[test]
fn davis_frames_and_mattes_belong_together() {
    let (Some(footage), Some(masks)) =
        (data("video/davis/frames/flamingo"), data("video/davis/masks/flamingo"))
    else {
        return;
    };
    let mut footage = frames::open(&SourceSpec::new(footage)).unwrap();
    assert_eq!((footage.width(), footage.height()), (854, 480));
    assert_eq!(footage.frame_count(), Some(80));
    assert!(footage.findings().is_empty(), "{:?}", footage.findings());
    let size = Some((footage.width(), footage.height()));
    let mattes: Vec<Matte> = mattes::open(&MatteSpec { size, ..matte_spec(masks) })
        .unwrap()
        .collect::<Result<_, _>>()
        .unwrap();
    assert_eq!(mattes.len(), 80);
    for (number, matte) in mattes.iter().enumerate() {
        // A bird that fills the picture or is not there would mean a wrong threshold.
        let share = matte.inside.iter().filter(|i| **i).count() as f64 / matte.inside.len() as f64;
        assert!((0.01..0.5).contains(&share), "frame {number}: {share}");
        assert_eq!(matte.frame, number);
        assert!(footage.next_frame().unwrap().is_some());
    }
    assert!(footage.next_frame().unwrap().is_none());
}

/// The camel's masks are smaller than its photographs: together they are refused, alone read.
#[test]
fn mattes_of_another_size_than_the_footage_are_refused() {
    let Some(masks) = data("video/muybridge/camel_gallop/masks") else { return };
    let alone: Vec<_> = mattes::open(&matte_spec(masks.clone())).unwrap().collect();
    assert_eq!(alone.len(), 12);
    assert!(alone.iter().all(Result::is_ok));
    let with_footage = MatteSpec { size: Some((400, 224)), ..matte_spec(masks) };
    let error = mattes::open(&with_footage).unwrap().next().unwrap().unwrap_err();
    assert!(matches!(error, Error::SizeMismatch { frame: 0, width: 300, .. }), "{error}");
    assert!(error.remedy().unwrap().contains("400×224"));
}
