//! `animate --loop`, `--retime` and `--fps`, from the command line, read back from the written file.

use muybridge::interpolate::Seam;
use muybridge::rig::{Clip, File, angle_between_rad};
use serde_json::Value;

use crate::shot_folder::Desk;

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

/// The written animation at every one of its frames.
fn written(desk: &Desk, summary: &Value) -> Clip {
    let file = File::read(&desk.path(summary["path"].as_str().unwrap())).unwrap();
    let name = summary["animation"].as_str().unwrap();
    let animation = file.animation(name).unwrap();
    let (frames, fps) = (summary["frames"].as_u64().unwrap(), number(&summary["fps"]));
    assert!((animation.duration_s() - (frames - 1) as f64 / fps).abs() < 1e-5);
    Clip {
        name: name.to_owned(),
        fps,
        poses: (0..frames).map(|t| animation.sample(file.skeleton(), t as f64 / fps)).collect(),
        driven: animation.driven(file.skeleton()),
    }
}

#[test]
fn a_loop_closes_and_repeats_the_stride() {
    let desk = Desk::new();
    desk.run("demo --out demo").success();
    let clip = written(&desk, &desk.json("animate demo --no-plant"));
    let summary = desk.json("animate demo --loop");
    let looped = &summary["loop"];
    assert_eq!(looped["strides"], 1);
    assert!((number(&looped["strides_seen"]) - 100.0 / 24.3).abs() < 0.2, "{looped}");
    assert!((number(&looped["stretch"]) - 1.0).abs() < 0.03, "{looped}");
    let frames = summary["frames"].as_u64().unwrap();
    assert!((24..=26).contains(&frames), "24.3 frames a stride, and the first again: {frames}");

    let one = written(&desk, &summary);
    let seam = Seam::of(&one);
    // What is in the file has the precision of its f32.
    assert!(seam.angle_deg < 1e-6 && seam.distance < 1e-6, "{seam:?}");
    assert!(seam.angle_jump_deg < seam.median_turn_deg, "{seam:?}");
    let told = &looped["seam"];
    assert!(number(&told["angle_deg"]) < 1e-6 && number(&told["distance"]) < 1e-6, "{told}");
    assert!((number(&told["angle_jump_deg"]) - seam.angle_jump_deg).abs() < 0.01, "{told}");

    // The loop is the clip's stride: its pose lies near some frame of the second stride.
    for (t, pose) in one.poses.iter().enumerate() {
        let apart = |frame: usize| {
            let both = pose.nodes.iter().zip(&clip.poses[frame].nodes);
            both.map(|(a, b)| angle_between_rad(&a.rotation, &b.rotation)).fold(0.0, f64::max)
        };
        let nearest = (0..clip.poses.len()).map(apart).fold(f64::INFINITY, f64::min);
        assert!(nearest.to_degrees() < 12.0, "frame {t}: {}", nearest.to_degrees());
    }

    let three = desk.json("animate demo --loop 3");
    let frames = three["frames"].as_u64().unwrap();
    assert!((72..=76).contains(&frames), "three strides of 24.3 frames: {frames}");
    let complaint = desk.run("animate demo --loop 9").code(1).get_output().stderr.clone();
    assert!(String::from_utf8_lossy(&complaint).contains("a loop of 9 strides"));
    assert!(desk.json("animate demo --loop 0")["loop"].is_null());
}

#[test]
fn the_clip_is_resampled_to_another_rate_and_speed() {
    let desk = Desk::new();
    desk.run("demo --out demo").success();
    let plain = written(&desk, &desk.json("animate demo --no-plant"));
    let double = written(&desk, &desk.json("animate demo --fps 50"));
    assert_eq!((double.poses.len(), double.fps), (199, 50.0));
    for (t, pose) in plain.poses.iter().enumerate() {
        for (a, b) in pose.nodes.iter().zip(&double.poses[2 * t].nodes) {
            assert!(angle_between_rad(&a.rotation, &b.rotation) < 1e-5, "frame {t}");
        }
    }
    let summary = desk.json("animate demo --fps 50 --retime 0.5");
    assert_eq!((&summary["frames"], &summary["retime"]), (&397.into(), &0.5.into()));
    let summary = desk.json("animate demo --fps 25 --retime 2 --loop");
    let frames = summary["frames"].as_u64().unwrap();
    assert!((12..=14).contains(&frames), "half of 24.3 frames: {frames}");
    let seam = &summary["loop"]["seam"];
    assert!(number(&seam["angle_jump_deg"]) < number(&seam["median_turn_deg"]), "{seam}");
    desk.run("animate demo --retime 0").code(1);
}
