//! The command line, from an empty folder.

use std::fs;

use serde_json::Value;

use crate::shot_folder::Desk;

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
}

#[test]
fn the_demo_makes_a_complete_shot() {
    let desk = Desk::new();
    let places = desk.json("demo --out demo");
    for name in ["report", "keys", "animation", "masks", "settings"] {
        let place = places[name].as_str().unwrap();
        assert!(desk.path(place).exists(), "{place}");
    }
    let files: Vec<String> = desk.files("demo").into_iter().map(|(name, _)| name).collect();
    for file in [
        "analysis/diagnosis.json",
        "analysis/projections.csv",
        "analysis/spectrum.csv",
        "analysis/trajectory.svg",
        "analysis/spectra.svg",
        "analysis/eigen-silhouettes.png",
        "animation.bvh",
        "keys/keys.json",
        "keys/weights.csv",
        "masks/000099.png",
        "report.html",
    ] {
        assert!(files.iter().any(|f| f == file), "{file} of {files:?}");
    }
    assert!(!files.iter().any(|f| f.contains("partial")), "{files:?}");
    let page = fs::read_to_string(desk.path("demo/report.html")).unwrap();
    assert!(page.contains("Usable"));
    // Self-contained: nothing is fetched. (The name space of SVG is an address but no request.)
    for request in ["src=\"http", "href=\"http", "url(http", "<script src", "<link"] {
        assert!(!page.contains(request), "{request}");
    }

    let verdict = desk.json("analyze demo");
    assert_eq!(verdict["verdict"], "usable");
    assert!(verdict["reasons"].is_array() && verdict["advice"].is_array());
    assert!((verdict["step_frames"].as_f64().unwrap() - 24.3).abs() < 0.3);
    assert_eq!(verdict["stride_hz"], verdict["step_hz"]);
    let components = verdict["components"].as_array().unwrap();
    let r = |c: usize| components[c]["r"].as_f64().unwrap();
    assert!(r(0) > 0.8 && r(1) > 0.8 && r(2) < 0.35, "{components:?}");
    assert!(components[0]["variance_share"].as_f64().unwrap() > 0.2);
    assert!(components[0]["peak_hz"].is_number());

    let keys = desk.json("keys demo");
    assert_eq!(keys["keys"].as_array().unwrap().len(), 4);
    assert_eq!(keys["keys"][0]["key"], 1);
    assert!(keys["keys"][0]["partner_of"].is_null());
    assert_eq!(keys["proven_optimal"], true);
    assert_eq!(keys["lower_bound"], keys["condition"]);

    let animation = desk.json("animate demo");
    assert_eq!(animation["frames"], 100);
    assert_eq!(animation["fps"], 25.0);
    let (weights, sums) = (numbers(&animation["weight_range"]), numbers(&animation["sum_range"]));
    assert!(weights[0] > -0.5 && weights[1] < 1.5, "{weights:?}");
    assert!(sums[0] > 0.5 && sums[1] < 1.3, "{sums:?}");
}

#[test]
fn mattes_go_all_the_way_to_an_animation_with_partners() {
    let desk = Desk::new();
    desk.run("render --clip walk --frames 80 --noise 0.05 --out mattes").success();
    let made = desk.json("new walk --mattes mattes --fps 25");
    assert_eq!(made["frames"], 80);
    desk.json("analyze walk --gait symmetric");
    let verdict = desk.json("analyze walk");
    let half = verdict["step_hz"].as_f64().unwrap() / 2.0;
    assert!((verdict["stride_hz"].as_f64().unwrap() - half).abs() < 1e-12);
    let keys = desk.json("keys walk -m 4 --partners");
    let partners: Vec<&Value> = keys["keys"].as_array().unwrap().iter().skip(4).collect();
    assert_eq!(partners.len(), 4);
    for (at, partner) in partners.iter().enumerate() {
        assert_eq!(partner["partner_of"], at + 1);
        let (a, b) = (&keys["keys"][at]["frame"], &partner["frame"]);
        // The other half of a stride of 24.3 frames.
        let apart = a.as_f64().unwrap() - b.as_f64().unwrap();
        let halves = (apart / 12.15).round();
        assert_eq!(halves.rem_euclid(2.0), 1.0, "{a} and {b}");
    }
    // Any rig serves; here the demo's.
    desk.run("samples --out samples").success();
    let poses: String = (1..=8).map(|k| format!(" --pose {k}=Walk@0.{k}")).collect();
    let animation =
        desk.json(&format!("animate walk --rig samples/poses/horse.glb{poses} --out out/walk.glb"));
    assert_eq!(animation["method"], "switching");
    assert!(desk.path("out/walk.glb").is_file());
    // What the flags said is kept, so that a plain run repeats it.
    let settings = fs::read_to_string(desk.path("walk/shot.toml")).unwrap();
    assert!(settings.contains("partners = true") && settings.contains("clip = \"Walk\""));
    let table = fs::read_to_string(desk.path("walk/keys/weights.csv")).unwrap();
    assert!(table.starts_with("frame,time_s,key_1,"), "{table}");
    assert_eq!(table.lines().count(), 81);
    assert_eq!(desk.json("run walk")["animate"]["method"], "switching");
}

#[test]
fn a_sketch_is_analysed_without_footage() {
    let desk = Desk::new();
    desk.run("samples --out samples").success();
    desk.run("new canter --strokes samples/sequences/canter_strokes --fps 25").success();
    let document = desk.json("run canter");
    let verdict = &document["analyze"];
    assert!((verdict["step_frames"].as_f64().unwrap() - 24.3).abs() < 1.5, "{verdict}");
    assert_ne!(verdict["verdict"], "unusable");
    assert!(document["animate"].is_null());
}

#[test]
fn a_mask_painted_by_hand_is_kept_and_used() {
    let desk = Desk::new();
    desk.run("render --clip gallop --frames 50 --noise 0 --out mattes").success();
    desk.run("new shot --mattes mattes --fps 25").success();
    desk.run("run shot").success();
    let before = desk.json("analyze shot");
    let painted = fs::read(desk.path("shot/masks/000000.png")).unwrap();
    fs::write(desk.path("shot/masks/000020.png"), &painted).unwrap();
    let after = desk.json("analyze shot");
    assert_ne!(before["components"], after["components"]);
    // Another setting makes all masks anew, but not the painted one.
    let settings = fs::read_to_string(desk.path("shot/shot.toml")).unwrap();
    let settings = settings.replace("stroke_radius_px = 0", "stroke_radius_px = 1");
    fs::write(desk.path("shot/shot.toml"), settings).unwrap();
    let summary = desk.json("segment shot");
    assert_eq!(summary["kept"], serde_json::json!(["masks/000020.png"]));
    assert_eq!(fs::read(desk.path("shot/masks/000020.png")).unwrap(), painted);
    desk.run("segment shot --force").success();
    assert_ne!(fs::read(desk.path("shot/masks/000020.png")).unwrap(), painted);
}

#[test]
fn an_unusable_clip_is_an_answer_and_strict_gives_it_a_code() {
    let desk = Desk::new();
    // Ten frames of a stride of 60: a sixth of a cycle.
    desk.run("render --clip walk --frames 10 --frames-per-cycle 60 --noise 0 --out mattes")
        .success();
    desk.run("new shot --mattes mattes --fps 25").success();
    let done = desk.run("analyze shot").success();
    let text = String::from_utf8(done.get_output().stdout.clone()).unwrap();
    assert!(text.contains("unusable") || text.contains("doubtful"), "{text}");
    assert!(text.contains("cycles"), "{text}");
    if text.contains("unusable") {
        desk.run("analyze shot --strict").code(3);
    }
}

#[test]
fn help_version_and_completions() {
    let desk = Desk::new();
    desk.run("--help").success();
    desk.run("--version").success();
    for shell in ["bash", "zsh", "fish"] {
        let done = desk.run(&format!("completions {shell}")).success();
        assert!(done.get_output().stdout.len() > 1000);
    }
}
