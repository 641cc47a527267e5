//! The seed's tables on motion that is known. The limits are the project's targets: degrees of mean
//! error over frames and joints, from masks with 15 % of their edge pixels flipped.

use std::path::Path;

use muybridge::gait::Repeats;
use muybridge::pipeline::{Trends, analyse_masks};
use muybridge::shot::{Method, Mirroring};
use muybridge::spectrum;
use muybridge::synthetic::Gait;
use muybridge::validate::{Settings, Shooting, Subject, Truth, Unsteady, Validation, validate};

use crate::data::data_folder;

fn run(subject: Subject, keys: usize, partners: bool) -> Validation {
    let method = if partners { Method::Switching } else { Method::Rbf };
    run_by(method, subject, spectrum::Gait::Unknown, 0.0, &[keys])
}

fn shooting(yaw_deg: f64) -> Shooting {
    Shooting {
        frames: 100,
        frames_per_cycle: 24.3,
        yaw_rad: yaw_deg.to_radians(),
        noise: 0.15,
        seed: 42,
        size_px: (320, 240),
        unsteady: Unsteady::default(),
    }
}

fn run_by(
    method: Method,
    subject: Subject,
    gait: spectrum::Gait,
    yaw_deg: f64,
    keys: &[usize],
) -> Validation {
    let partners = method == Method::Switching;
    let settings = Settings {
        subject,
        shooting: shooting(yaw_deg),
        keys: keys.to_vec(),
        partners,
        gait,
        method,
        time_limit_s: 30.0,
        ..eight_keys()
    };
    validate(&settings, &|_, _| true).unwrap()
}

/// The built-in walk, named symmetric, with eight keys by the default method.
fn eight_keys() -> Settings {
    Settings {
        subject: Subject::Horse(Gait::Walk),
        shooting: shooting(0.0),
        keys: vec![8],
        components: vec![2],
        partners: false,
        gait: spectrum::Gait::Symmetric,
        method: Method::Auto,
        mirror: Mirroring::Auto,
        amplitude: true,
        band_pass: true,
        time_limit_s: 5.0,
    }
}

fn rig(data: &Path, file: &str, clip: &str) -> Subject {
    Subject::Rig { file: data.join("rigs").join(file), clip: clip.to_owned() }
}

fn error_deg(found: &Validation) -> f64 {
    found.rows[0].cells[0].error.mean_deg
}

#[test]
fn the_built_in_horse_is_within_its_targets() {
    for (gait, keys, partners, limit) in
        [(Gait::Gallop, 4, false, 5.0), (Gait::Canter, 4, false, 5.0), (Gait::Walk, 4, true, 4.0)]
    {
        let found = run(Subject::Horse(gait), keys, partners);
        let in_plane = found.rows[0].cells[0].in_plane.unwrap().mean_deg;
        eprintln!("{gait}: {in_plane:.2} of {limit}; r {:?}", found.r);
        assert!(in_plane <= limit, "{gait}: {in_plane}");
        assert!(in_plane < 0.6 * found.mean_pose.mean_deg, "{gait}: {in_plane}");
        assert!(found.r[0] >= 0.8 && found.r[1] >= 0.8, "{gait}: {:?}", found.r);
        assert!(found.r[2..].iter().all(|r| *r <= 0.35), "{gait}: {:?}", found.r);
        assert_eq!(found.verdict, "usable");
        assert!(found.rows[0].cells[0].proven_optimal);
    }
}

#[test]
fn rigs_are_within_their_targets_and_the_floors_are_the_known_ones() {
    let Some(data) = data_folder() else { return };
    // File, clip, keys, partners, target, and the floor that an independent script found.
    let cases = [
        ("quaternius_horse.glb", "AnimalArmature|Gallop", 4, false, 4.8, 3.00),
        ("quaternius_alpaca.glb", "AnimalArmature|Gallop", 4, false, 4.8, 3.23),
        ("quaternius_husky.glb", "AnimalArmature|Gallop", 4, false, 4.6, 3.21),
        ("khronos_fox.glb", "Run", 4, false, 9.0, 7.40),
        ("quaternius_horse.glb", "AnimalArmature|Walk", 4, true, 4.0, 0.79),
        ("quaternius_triceratops.glb", "Armature|Triceratops_Walk", 4, true, 4.0, 0.82),
    ];
    for (file, clip, keys, partners, limit, floor) in cases {
        let found = run(rig(&data, file, clip), keys, partners);
        let error = error_deg(&found);
        let row = &found.rows[0];
        eprintln!("{file} {clip}: {error:.2} of {limit}");
        assert!(error <= limit, "{file} {clip}: {error}");
        assert!(
            (row.floor.unwrap().mean_deg - floor).abs() < 0.05,
            "{file} {clip}: {:?}",
            row.floor
        );
        if let Some(plain) = row.cells[0].without_switching {
            assert!(plain.mean_deg > 1.5 * error, "{file} {clip}: {plain:?} without switching");
        }
    }
}

#[test]
fn more_poses_are_better_and_a_run_repeats_itself() {
    let four = run(Subject::Horse(Gait::Gallop), 4, false);
    assert_eq!(four, run(Subject::Horse(Gait::Gallop), 4, false));
    let five = run(Subject::Horse(Gait::Gallop), 5, false);
    assert!(error_deg(&five) < error_deg(&four));
}

/// One and a half strides of a walk that is not quite even: a cycle as long as the clip would explain it, and be no phase.
#[test]
fn a_phase_that_something_slow_hides_is_found_without_it() {
    let Some(data) = data_folder() else { return };
    let settings = Settings {
        subject: rig(&data, "khronos_fox.glb", "Walk"),
        shooting: Shooting { frames: 36, ..shooting(0.0) },
        ..eight_keys()
    };
    let found = validate(&settings, &|_, _| true).unwrap();
    assert_eq!(found.method, "phase");
    assert_eq!(found.verdict, "usable");
    let share = error_deg(&found) / found.mean_pose.mean_deg;
    assert!(share < 0.15, "{share} of the mean pose's error");
}

/// From .6 to 1.4 of its mean speed within the clip: a phase that starts from an even speed slips (2.85 degrees), one
/// that follows the speed does not.
#[test]
fn a_speed_that_more_than_doubles_within_the_clip_is_followed() {
    let Some(data) = data_folder() else { return };
    for (file, limit_deg) in [("quaternius_horse.glb", 0.8), ("quaternius_alpaca.glb", 1.05)] {
        let unsteady = Unsteady { speed_drift: 0.8, ..Unsteady::default() };
        let settings = Settings {
            subject: rig(&data, file, "AnimalArmature|Walk"),
            shooting: Shooting { unsteady, ..shooting(0.0) },
            ..eight_keys()
        };
        let found = validate(&settings, &|_, _| true).unwrap();
        let phase_error = found.measured.as_ref().unwrap().phase_error_cycles;
        assert!(phase_error < 0.005, "{file}: {phase_error} strides");
        assert!(error_deg(&found) < limit_deg, "{file}: {} degrees", error_deg(&found));
    }
}

/// Over the gait phase: the default method, told only whether the gait is symmetric. The whole table
/// is in `docs/phase.md` (`cargo run --release --example phase_table`).
#[test]
fn the_phase_reaches_the_floor_and_halves_the_error_of_the_paper() {
    let Some(data) = data_folder() else { return };
    let cases = [
        ("quaternius_horse.glb", "AnimalArmature|Walk", spectrum::Gait::Symmetric, 20.0),
        ("khronos_fox.glb", "Walk", spectrum::Gait::Walk, 0.0),
        ("quaternius_alpaca.glb", "AnimalArmature|Gallop", spectrum::Gait::Gallop, 0.0),
        (
            "quaternius_triceratops.glb",
            "Armature|Triceratops_Walk",
            spectrum::Gait::Symmetric,
            20.0,
        ),
    ];
    let (mut shares, mut ours, mut papers) = (Vec::new(), 0.0, 0.0);
    for (file, clip, gait, yaw_deg) in cases {
        let subject = || rig(&data, file, clip);
        let found = run_by(Method::Auto, subject(), gait, yaw_deg, &[4, 6, 8]);
        assert_eq!(found.method, "phase");
        let paper = run_by(Method::Rbf, subject(), gait, yaw_deg, &[4, 6, 8]);
        for (row, old) in found.rows.iter().zip(&paper.rows) {
            let (error, floor) = (row.cells[0].error.mean_deg, row.floor.unwrap().mean_deg);
            eprintln!("{file} {clip} {}: {error:.2}, floor {floor:.2}", row.poses);
            assert!(error <= 1.1 * floor, "{file} {clip} {}: {error} of {floor}", row.poses);
            shares.push(error / floor);
            ours += error;
            papers += old.cells[0].error.mean_deg;
        }
    }
    let mean = shares.iter().sum::<f64>() / shares.len() as f64;
    assert!(mean <= 1.03, "{mean} of the floor");
    assert!(ours <= 0.6 * papers, "{ours} of {papers}");
}

/// Left and right: of walks and trots seen from the side, told nothing, no stride is taken for a
/// step or the other way round; told that the gait is symmetric, the stride is found in all.
/// A motion that becomes smaller by 30 % over the clip, and one whose strides are of unlike size: following the size has
/// less error than playing every stride alike. A steady motion is not touched.
#[test]
fn strides_of_unlike_size_are_followed() {
    let error = |gait: Gait, unsteady: Unsteady, amplitude: bool| {
        let settings = Settings {
            subject: Subject::Horse(gait),
            shooting: Shooting { unsteady, ..shooting(20.0) },
            gait: if gait == Gait::Gallop {
                spectrum::Gait::Asymmetric
            } else {
                spectrum::Gait::Symmetric
            },
            method: Method::Phase,
            amplitude,
            ..eight_keys()
        };
        error_deg(&validate(&settings, &|_, _| true).unwrap())
    };
    let steady = Unsteady::default();
    let smaller = Unsteady { amplitude_drift: -0.3, ..steady };
    let unlike = Unsteady { amplitude_variation: 0.1, ..steady };
    for gait in [Gait::Walk, Gait::Gallop] {
        let share = |unsteady| error(gait, unsteady, true) / error(gait, unsteady, false);
        let shares = [share(smaller), share(unlike), share(steady)];
        eprintln!("{gait}: followed over not followed {shares:.3?}");
        assert!(shares[0] < 0.88, "{gait}: {shares:?}");
        assert!(shares[1] < 0.98, "{gait}: {shares:?}");
        assert!((0.99..1.01).contains(&shares[2]), "{gait}: {shares:?}");
    }
}

#[test]
fn steps_and_strides_are_never_confused() {
    let Some(data) = data_folder() else { return };
    let rig = |file: &str, clip: &str| rig(&data, file, clip);
    let subjects = [
        rig("quaternius_horse.glb", "AnimalArmature|Walk"),
        rig("quaternius_husky.glb", "AnimalArmature|Walk"),
        rig("khronos_fox.glb", "Walk"),
        rig("quaternius_triceratops.glb", "Armature|Triceratops_Walk"),
        Subject::Horse(Gait::Walk),
        Subject::Horse(Gait::Trot),
    ];
    for subject in subjects {
        for yaw_deg in [0.0, 10.0, 20.0, 30.0] {
            let stride_frames = |gait: spectrum::Gait| {
                let shooting = shooting(yaw_deg);
                let truth = Truth::of(&subject, &shooting).unwrap();
                let settings = spectrum::Settings { gait, ..spectrum::Settings::default() };
                let masks = truth.masks(&shooting);
                let found = analyse_masks(&masks, 25.0, 5, Trends::default(), &settings).unwrap();
                assert_eq!(found.drift, None, "{subject:?} {yaw_deg}");
                let gait = found.gait.unwrap();
                (gait.stride.repeats != Repeats::Unknown).then(|| gait.stride_frames())
            };
            let near = |frames: f64| (frames - 24.3).abs() < 0.5;
            assert!(
                stride_frames(spectrum::Gait::Unknown).is_none_or(near),
                "{subject:?} {yaw_deg}"
            );
            assert!(
                stride_frames(spectrum::Gait::Symmetric).is_some_and(near),
                "{subject:?} {yaw_deg}"
            );
        }
    }
}

/// The verdict and the error over that of the mean pose, of the built-in walk with eight keys.
fn judged(change: impl Fn(&mut Shooting)) -> (String, f64) {
    let mut settings = Settings { shooting: shooting(20.0), ..eight_keys() };
    change(&mut settings.shooting);
    let found = validate(&settings, &|_, _| true).unwrap();
    let share = error_deg(&found) / found.mean_pose.mean_deg;
    (found.verdict, share)
}

#[test]
fn the_verdict_foretells_the_error() {
    for (what, (verdict, share)) in [
        ("two strides", judged(|s| s.frames = 49)),
        ("a third of the masks broken", judged(|s| s.unsteady.broken_masks = 0.3)),
        ("uneven strides", judged(|s| s.unsteady.stride_variation = 0.3)),
    ] {
        assert_eq!(verdict, "usable", "{what}");
        assert!(share < 0.2, "{what}: {share}");
    }
    // A step of 1.7 frames looks like one of 2.4.
    let (verdict, share) = judged(|s| s.frames_per_cycle = 3.4);
    assert_eq!(verdict, "unusable");
    assert!(share > 0.5, "{share}");
}

#[test]
fn the_expected_degrees_rank_the_errors() {
    let counts: Vec<usize> = (2..=12).collect();
    let subject = Subject::Horse(Gait::Trot);
    let found = run_by(Method::Phase, subject, spectrum::Gait::Symmetric, 20.0, &counts);
    let cells = found
        .rows
        .iter()
        .map(|r| (r.cells[0].expected_error_deg.unwrap(), r.cells[0].error.mean_deg));
    for (expected, truth) in cells.clone() {
        // One standard deviation of the calibration is a factor of 1.54.
        assert!((truth / expected).ln().abs() < 2.0 * 1.54_f64.ln(), "{expected} {truth}");
    }
    let pairs: Vec<(f64, f64)> = cells.collect();
    let inversions = pairs.windows(2).filter(|w| (w[1].0 < w[0].0) != (w[1].1 < w[0].1)).count();
    assert!(inversions <= 1, "{pairs:?}");
}
