//! Steps or strides, of walks, trots and gallops whose stride is known. The whole table is in
//! `docs/phase.md` (`cargo run --release --example left_right`).

use muybridge::gait::Repeats;
use muybridge::mask::Mask;
use muybridge::pipeline::{Trends, analyse_masks};
use muybridge::spectrum::{Gait, Settings};
use muybridge::synthetic;
use muybridge::validate::{Shooting, Subject, Truth, Unsteady};

use crate::data::data_folder;

const STRIDE_FRAMES: f64 = 24.0;

fn masks(subject: &Subject, yaw_deg: f64, frames: usize) -> Vec<Mask> {
    let shooting = Shooting {
        frames,
        frames_per_cycle: STRIDE_FRAMES,
        yaw_rad: yaw_deg.to_radians(),
        noise: 0.15,
        seed: 42,
        size_px: (320, 240),
        unsteady: Unsteady::default(),
    };
    Truth::of(subject, &shooting).unwrap().masks(&shooting)
}

/// What is said of the silhouette's repeats, and the stride where it is known, frames.
fn said(masks: &[Mask], gait: Gait) -> (Repeats, Option<f64>) {
    let settings = Settings { gait, ..Settings::default() };
    let found = analyse_masks(masks, 25.0, 5, Trends::default(), &settings).unwrap();
    (found.gait.unwrap().stride.repeats, found.spectral.rhythm.stride_frames)
}

fn is_the_stride(frames: Option<f64>) -> bool {
    frames.is_some_and(|f| (f / STRIDE_FRAMES - 1.0).abs() < 0.03)
}

#[test]
fn a_walk_whose_strongest_line_is_the_stride_is_known_by_its_back() {
    for gait in [synthetic::Gait::Walk, synthetic::Gait::Trot] {
        let masks = masks(&Subject::Horse(gait), 30.0, 100);
        for named in [Gait::Unknown, Gait::Symmetric] {
            let (repeats, stride) = said(&masks, named);
            assert_eq!(repeats, Repeats::EveryStride, "{gait} {named:?}");
            assert!(is_the_stride(stride), "{gait} {named:?}: {stride:?}");
        }
    }
}

/// What a walk looks like of which near and far legs cannot be told apart at all: each frame is
/// drawn over the one half a stride later.
#[test]
fn a_perfectly_symmetric_walk_and_a_gallop_cannot_be_told_apart_but_by_name() {
    let half = STRIDE_FRAMES as usize / 2;
    let walk = masks(&Subject::Horse(synthetic::Gait::Walk), 0.0, 100 + half);
    let walk: Vec<Mask> = walk.iter().zip(&walk[half..]).map(|(a, b)| a.or(b)).collect();
    let gallop = masks(&Subject::Horse(synthetic::Gait::Gallop), 0.0, 100);
    assert_eq!(said(&walk, Gait::Unknown), (Repeats::Unknown, None));
    assert_eq!(said(&gallop, Gait::Unknown), (Repeats::Unknown, None));
    let (repeats, stride) = said(&walk, Gait::Walk);
    assert!(repeats == Repeats::EveryStep && is_the_stride(stride), "{repeats:?}, {stride:?}");
    let (repeats, stride) = said(&gallop, Gait::Gallop);
    assert!(repeats == Repeats::EveryStride && is_the_stride(stride), "{repeats:?}, {stride:?}");
}

#[test]
fn what_is_said_of_the_rigs_is_right() {
    let Some(data) = data_folder() else { return };
    let cases = [
        ("quaternius_horse.glb", "AnimalArmature|Walk", 0.0, Repeats::EveryStep),
        ("quaternius_horse.glb", "AnimalArmature|Walk", 30.0, Repeats::EveryStride),
        ("quaternius_alpaca.glb", "AnimalArmature|Walk", 30.0, Repeats::EveryStride),
        ("quaternius_triceratops.glb", "Armature|Triceratops_Walk", 20.0, Repeats::EveryStride),
        // Its trunk rocks from end to end.
        ("quaternius_husky.glb", "AnimalArmature|Walk", 45.0, Repeats::EveryStride),
        // From ahead it rocks from side to side, and half a stride later is the same in a mirror.
        ("quaternius_horse.glb", "AnimalArmature|Walk", 90.0, Repeats::EveryStride),
        ("quaternius_alpaca.glb", "AnimalArmature|Walk", 90.0, Repeats::EveryStride),
        // Its trunk rises with one pair of legs; a gallop's once a stride.
        ("khronos_fox.glb", "Walk", 20.0, Repeats::Unknown),
        ("quaternius_horse.glb", "AnimalArmature|Gallop", 20.0, Repeats::Unknown),
        // A fast run has a bob in either flight.
        ("khronos_fox.glb", "Run", 20.0, Repeats::EveryStride),
    ];
    for (file, clip, yaw_deg, expected) in cases {
        let subject = Subject::Rig { file: data.join("rigs").join(file), clip: clip.to_owned() };
        let masks = masks(&subject, yaw_deg, 100);
        let (repeats, stride) = said(&masks, Gait::Unknown);
        assert_eq!(repeats, expected, "{file} {clip} {yaw_deg}");
        assert!(repeats == Repeats::Unknown || is_the_stride(stride), "{file} {clip}: {stride:?}");
        let name = if clip.ends_with("Run") || clip.ends_with("Gallop") {
            Gait::Asymmetric
        } else {
            Gait::Symmetric
        };
        let (_, stride) = said(&masks, name);
        assert!(is_the_stride(stride), "{file} {clip} {yaw_deg}, named: {stride:?}");
    }
}
