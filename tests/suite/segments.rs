//! Clips in which the motion changes, rendered, and steady ones: where they are cut.

use muybridge::pipeline::MaskAnalysis;
use muybridge::shot::SegmentChoice;
use muybridge::spectrum::Verdict;
use muybridge::synthetic::{Gait, NamedClip, to_glb};
use muybridge::validate::{Shooting, Subject, Truth, Unsteady};
use serde_json::Value;

use crate::data::data_folder;
use crate::shot_folder::Desk;

#[path = "../../examples/support/acts.rs"]
mod acts;
use acts::Act;

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

fn analysed(truth: &Truth, shooting: &Shooting, choice: SegmentChoice) -> MaskAnalysis {
    acts::segmented(&acts::masks(truth, shooting), choice).unwrap()
}

/// The frames at which segments end, and whether a gait was seen in each.
fn ends(found: &MaskAnalysis) -> Vec<(usize, bool)> {
    found.segments.iter().map(|s| (s.frames.end, s.gait.is_some())).collect()
}

fn is_cut(found: &MaskAnalysis, planted: &[(usize, bool)], slack: usize) -> bool {
    let ends = ends(found);
    ends.len() == planted.len()
        && ends.iter().zip(planted).all(|(e, p)| e.1 == p.1 && e.0.abs_diff(p.0) <= slack)
}

#[test]
fn a_stop_and_a_change_of_gait_are_cut_out_and_the_rest_is_judged_by_itself() {
    let stop = [Act::Cycle("walk", 60, 24.3), Act::Hold(30), Act::Cycle("walk", 60, 24.3)];
    let change = [Act::Cycle("walk", 75, 24.3), Act::Cycle("gallop", 60, 14.0)];
    for yaw in [0.0, 20.0] {
        let truth = acts::truth(None, &stop).unwrap();
        let found = analysed(&truth, &shooting(yaw), SegmentChoice::Auto);
        assert!(is_cut(&found, &[(60, true), (90, false), (150, true)], 6), "{:?}", ends(&found));
        // Of two walks of the same verdict the longer.
        let longest = found.segments.iter().map(|s| s.frames.len()).max();
        assert_eq!(Some(found.frames.len()), longest);
        assert!((0..150).all(|t| !found.used[t] || found.frames.contains(&t)));

        let truth = acts::truth(None, &change).unwrap();
        let found = analysed(&truth, &shooting(yaw), SegmentChoice::Auto);
        assert!(is_cut(&found, &[(75, true), (135, true)], 4), "{:?}", ends(&found));
        let gaits: Vec<_> = found.segments.iter().map(|s| s.gait.clone().unwrap()).collect();
        assert!(gaits.iter().all(|g| g.verdict < Verdict::Unusable), "{gaits:?}");
        let walk = gaits[0].step_frames;
        assert!((walk / 24.3 - 1.0).abs() < 0.05 || (walk / 12.15 - 1.0).abs() < 0.05, "{walk}");
        assert!((gaits[1].step_frames / 14.0 - 1.0).abs() < 0.05, "{gaits:?}");
        // The one that is asked for is the one that is measured, and the other is out of its way.
        let gallop = analysed(&truth, &shooting(yaw), SegmentChoice::Number(2));
        assert_eq!(gallop.frames.end, 135);
        let phase = gallop.gait.unwrap();
        let speed = phase.stride_cycles[130] - phase.stride_cycles[90];
        assert!((speed / (40.0 / 14.0) - 1.0).abs() < 0.02, "{speed}");
        assert!(phase.trust[..70].iter().all(|t| *t == 0.0));
        assert!(phase.stride_cycles[..70].iter().all(|p| *p == phase.stride_cycles[0]));
    }
}

#[test]
fn a_halt_of_half_a_stride_is_cut_out_of_a_gait_that_goes_on_as_it_was() {
    for (gait, frames) in [("walk", 12), ("walk", 20), ("gallop", 15), ("gallop", 30)] {
        let halt = [Act::Cycle(gait, 66, 24.3), Act::Hold(frames), Act::Onward(gait, 66, 24.3)];
        let truth = acts::truth(None, &halt).unwrap();
        for yaw in [0.0, 20.0] {
            let found = analysed(&truth, &shooting(yaw), SegmentChoice::Auto);
            let planted = [(66, true), (66 + frames, false), (132 + frames, true)];
            assert!(is_cut(&found, &planted, 6), "{gait} {frames} {yaw}: {:?}", ends(&found));
        }
    }
}

#[test]
fn a_jump_in_a_gallop_is_cut_out_on_every_rig() {
    let Some(data) = data_folder() else { return };
    for (name, jump) in [("horse", 35), ("alpaca", 40), ("husky", 24)] {
        let rig = data.join(format!("rigs/quaternius_{name}.glb"));
        let gallop = Act::Cycle("AnimalArmature|Gallop", 56, 14.0);
        let acts = [gallop, Act::Once("AnimalArmature|Gallop_Jump", jump), gallop];
        let truth = acts::truth(Some(&rig), &acts).unwrap();
        for yaw in [0.0, 20.0] {
            let found = analysed(&truth, &shooting(yaw), SegmentChoice::Auto);
            // A jump begins and ends in a gallop's pose: what is left of it may be half as long.
            let ends = ends(&found);
            let [(first, true), (second, false), (112.., true)] = ends[..] else {
                panic!("{name}: {ends:?}");
            };
            assert!(first.abs_diff(56) <= 10, "{name}: {ends:?}");
            assert!(second.abs_diff(56 + jump) <= 12 && second > first + 10, "{name}: {ends:?}");
        }
    }
}

#[test]
fn a_steady_clip_stays_one_segment_however_unsteady_it_is() {
    let unsteady = [
        Unsteady::default(),
        Unsteady { speed_drift: 0.12, ..Unsteady::default() },
        Unsteady { stride_variation: 0.1, ..Unsteady::default() },
        Unsteady { broken_masks: 0.05, ..Unsteady::default() },
        Unsteady {
            speed_drift: 0.12,
            stride_variation: 0.1,
            broken_masks: 0.05,
            ..Unsteady::default()
        },
    ];
    let mut subjects: Vec<Subject> = Gait::ALL.into_iter().map(Subject::Horse).collect();
    if let Some(data) = data_folder() {
        let rig = |file: &str, clip: &str| Subject::Rig {
            file: data.join("rigs").join(file),
            clip: clip.to_owned(),
        };
        for name in ["horse", "alpaca", "husky"] {
            for clip in ["Walk", "Gallop"] {
                let clip = format!("AnimalArmature|{clip}");
                subjects.push(rig(&format!("quaternius_{name}.glb"), &clip));
            }
        }
        for clip in ["Walk", "Run"] {
            subjects.push(rig("khronos_fox.glb", clip));
            let of_triceratops = format!("Armature|Triceratops_{clip}");
            subjects.push(rig("quaternius_triceratops.glb", &of_triceratops));
        }
    }
    for (at, subject) in subjects.iter().enumerate() {
        // Every subject with two of the five, at one of two yaws: all are met over the subjects.
        for kind in [at % 5, (at + 2) % 5] {
            let shooting =
                Shooting { unsteady: unsteady[kind], ..shooting(20.0 * (at % 2) as f64) };
            let truth = Truth::of(subject, &shooting).unwrap();
            let found = analysed(&truth, &shooting, SegmentChoice::Auto);
            assert_eq!(ends(&found), [(100, true)], "{subject:?} {:?}", unsteady[kind]);
        }
    }
}

fn number(value: &Value) -> usize {
    value.as_u64().unwrap() as usize
}

#[test]
fn the_chosen_segment_is_what_keys_and_animation_are_of() {
    let desk = Desk::new();
    let acts = [Act::Cycle("walk", 75, 24.3), Act::Cycle("gallop", 60, 14.0)];
    let truth = acts::truth(None, &acts).unwrap();
    std::fs::create_dir(desk.path("mattes")).unwrap();
    for (t, mask) in acts::masks(&truth, &shooting(0.0)).iter().enumerate() {
        std::fs::write(desk.path(&format!("mattes/{t:03}.png")), mask.to_png().unwrap()).unwrap();
    }
    let clip = NamedClip { name: "Truth", fps: 25.0, poses: &truth.poses };
    std::fs::write(desk.path("rig.glb"), to_glb(&truth.model, &[clip], "horse")).unwrap();
    desk.run("new shot --mattes mattes --fps 25").success();

    let told = desk.run("-q analyze shot --gait walk").success();
    let told = String::from_utf8(told.get_output().stdout.clone()).unwrap();
    assert!(told.contains("segments of the clip") && told.contains("  1  frames 0 to 7"), "{told}");
    let found = desk.json("analyze shot --segment 2 --gait gallop");
    let segments = found["segments"].as_array().unwrap();
    assert_eq!((segments.len(), &segments[1]["chosen"]), (2, &Value::Bool(true)), "{found}");
    let (first, last) = (number(&segments[1]["first_frame"]), number(&segments[1]["last_frame"]));
    assert!(first.abs_diff(75) <= 4 && last == 134, "{found}");
    let csv = std::fs::read_to_string(desk.path("shot/analysis/segments.csv")).unwrap();
    assert_eq!(csv.lines().count(), 3, "{csv}");
    assert!(csv.lines().nth(2).unwrap().starts_with(&format!("2,{first},134,1,")), "{csv}");

    let keys = desk.json("keys shot -m 5");
    let mut poses = String::new();
    for key in keys["keys"].as_array().unwrap() {
        let frame = number(&key["frame"]);
        assert!((first..=last).contains(&frame), "{keys}");
        poses.push_str(&format!(" --pose {}=Truth#{frame}", key["key"]));
    }
    let made = desk.json(&format!("animate shot --rig rig.glb{poses}"));
    assert_eq!(number(&made["first_frame"]), first);
    assert_eq!(number(&made["frames"]), last + 1 - first);
    let weights = std::fs::read_to_string(desk.path("shot/keys/weights.csv")).unwrap();
    assert_eq!(weights.lines().count(), 136, "weights have a row a frame of the clip");

    assert!(desk.complaint("analyze shot --segment 3", 1).contains("is 1 to 2"));
    assert!(desk.complaint("analyze shot --segment two", 2).contains("--segment «two»"));
    let whole = desk.json("analyze shot --segment whole");
    assert_eq!(whole["segments"].as_array().unwrap().len(), 1, "{whole}");
    assert_eq!(number(&whole["segments"][0]["last_frame"]), 134);
}
