//! Rigs with left and right exchanged: against the generator's own symmetry and against skinned meshes reflected as
//! points, and the whole way through the command line.

use std::fs;

use muybridge::interpolate::exchanged_sides;
use muybridge::rig::{Driven, File, Mirror, Model, Pose, angle_between_rad};
use muybridge::synthetic::{Gait, NamedClip, horse, to_glb};
use muybridge::validate::{Shooting, Subject, Truth, Unsteady};
use nalgebra::{Point3, UnitQuaternion, Vector3};
use serde_json::Value;

use crate::data::data_folder;
use crate::shot_folder::Desk;

const ALL: Driven = Driven { translation: true, rotation: true, scale: true };

fn mirror_of(model: &Model) -> Mirror {
    Mirror::of(&model.skeleton, &model.skins).unwrap()
}

/// The generator lets the right legs do what the left ones do half a stride later; nothing of it knows of mirrors.
#[test]
fn half_a_stride_later_a_symmetric_gait_looks_as_in_the_mirror() {
    let model = horse();
    let mirror = mirror_of(&model);
    let driven = vec![ALL; model.skeleton.nodes.len()];
    for gait in [Gait::Walk, Gait::Trot] {
        for step in 0..12 {
            let phase = f64::from(step) / 12.0;
            let mirrored = mirror.pose(&gait.pose(&model.skeleton, phase).pose, &driven);
            let later = gait.pose(&model.skeleton, phase + 0.5).pose;
            for (node, (a, b)) in mirrored.nodes.iter().zip(&later.nodes).enumerate() {
                let name = &model.skeleton.nodes[node].name;
                // Jaw, ears and tail move once a stride, as they do on both sides.
                if ["jaw", "ear", "tail"].iter().any(|part| name.starts_with(part)) {
                    continue;
                }
                let angle = angle_between_rad(&a.rotation, &b.rotation);
                assert!(angle < 1e-6, "{gait} {phase} {name}: {angle}");
                assert!((a.translation - b.translation).norm() < 1e-6, "{gait} {phase} {name}");
            }
        }
    }
    // A gallop does not.
    let mirrored = mirror.pose(&Gait::Gallop.pose(&model.skeleton, 0.1).pose, &driven);
    let later = Gait::Gallop.pose(&model.skeleton, 0.6).pose;
    let apart = |(a, b): (&muybridge::rig::NodePose, &muybridge::rig::NodePose)| {
        angle_between_rad(&a.rotation, &b.rotation)
    };
    assert!(mirrored.nodes.iter().zip(&later.nodes).map(apart).fold(0.0, f64::max) > 0.3);
}

/// Of true poses none is doubted; of two that were made the wrong way round both are found.
#[test]
fn poses_made_the_wrong_way_round_are_found() {
    let mut subjects = vec![Subject::Horse(Gait::Walk), Subject::Horse(Gait::Trot)];
    if let Some(folder) = data_folder() {
        for (name, clip) in [
            ("quaternius_horse", "AnimalArmature|Walk"),
            ("quaternius_alpaca", "AnimalArmature|Walk"),
            ("quaternius_husky", "AnimalArmature|Walk"),
            ("khronos_fox", "Walk"),
            ("quaternius_triceratops", "Armature|Triceratops_Walk"),
        ] {
            let file = folder.join(format!("rigs/{name}.glb"));
            if file.is_file() {
                subjects.push(Subject::Rig { file, clip: clip.to_owned() });
            }
        }
    }
    for subject in subjects {
        let truth = Truth::of(&subject, &shooting(96, 96.0)).unwrap();
        let mirror = mirror_of(&truth.model);
        for frames in
            [vec![3, 27, 51, 75], vec![0, 12, 24, 36, 48, 60, 72, 84], vec![5, 20, 44, 61, 80]]
        {
            let cycles: Vec<f64> = frames.iter().map(|&f| truth.phases_cycles[f]).collect();
            let mut poses = truth.key_poses(&frames);
            let skeleton = &truth.model.skeleton;
            let doubted = exchanged_sides(&cycles, &poses, skeleton, &mirror).unwrap();
            assert!(doubted.is_empty(), "{subject:?} {frames:?}: {doubted:?}");
            poses.poses[1] = mirror.pose(&poses.poses[1], &poses.driven);
            if frames.len() == 8 {
                poses.poses[6] = mirror.pose(&poses.poses[6], &poses.driven);
                let doubted = exchanged_sides(&cycles, &poses, skeleton, &mirror).unwrap();
                assert_eq!(doubted, [1, 6], "{subject:?}");
            }
        }
    }
}

/// Turns that nobody poses, the same on every machine.
fn crooked(model: &Model) -> Pose {
    let mut pose = model.skeleton.rest_pose();
    for (n, node) in pose.nodes.iter_mut().enumerate() {
        let n = n as f64;
        let turn = Vector3::new((1.7 * n).sin(), (2.9 * n).cos(), (0.7 * n + 1.0).sin()) * 0.3;
        node.rotation *= UnitQuaternion::from_scaled_axis(turn);
    }
    pose
}

fn real_models() -> Vec<(String, Model)> {
    let Some(folder) = data_folder() else { return Vec::new() };
    let names = [
        "quaternius_horse",
        "quaternius_alpaca",
        "quaternius_husky",
        "khronos_fox",
        "quaternius_triceratops",
    ];
    let of = |name: &str| {
        let file = File::read(&folder.join(format!("rigs/{name}.glb"))).ok()?;
        Some((name.to_owned(), file.model().unwrap()))
    };
    names.iter().filter_map(|name| of(name)).collect()
}

#[test]
fn twice_in_the_mirror_is_as_it_was() {
    for (name, model) in real_models().into_iter().chain([("built-in".to_owned(), horse())]) {
        let mirror = mirror_of(&model);
        let driven = vec![ALL; model.skeleton.nodes.len()];
        let pose = crooked(&model);
        let twice = mirror.pose(&mirror.pose(&pose, &driven), &driven);
        for (a, b) in pose.nodes.iter().zip(&twice.nodes) {
            assert!(angle_between_rad(&a.rotation, &b.rotation) < 1e-6, "{name}");
            assert!((a.translation - b.translation).norm() < 1e-6 * (1.0 + a.translation.norm()));
        }
    }
}

/// The skinned mesh of the mirrored pose is the mesh of the pose, reflected: found without bones, by nearest vertices.
#[test]
fn the_mesh_of_a_mirrored_pose_is_the_mesh_reflected() {
    for (name, model) in real_models() {
        let mirror = mirror_of(&model);
        let driven = vec![ALL; model.skeleton.nodes.len()];
        let mut pose = model.skeleton.rest_pose();
        let crooked = crooked(&model);
        // Only what has a skin, so that nothing but the animal is bent.
        for &joint in model.skins.iter().flat_map(|s| &s.joints) {
            pose.nodes[joint].rotation = crooked.nodes[joint].rotation;
        }
        let points = |pose: &Pose| -> Vec<Point3<f64>> { model.posed_vertices(pose).concat() };
        let (before, after) = (points(&pose), points(&mirror.pose(&pose, &driven)));
        let rest = points(&model.skeleton.rest_pose());
        let width = |axis: usize| {
            let of = |p: &Point3<f64>| p[axis];
            let low = rest.iter().map(of).fold(f64::INFINITY, f64::min);
            rest.iter().map(of).fold(f64::NEG_INFINITY, f64::max) - low
        };
        let size = (0..3).map(|a| width(a).powi(2)).sum::<f64>().sqrt();
        // All five look along Z, with X from side to side.
        let missed: Vec<f64> = before
            .iter()
            .step_by(7)
            .map(|p| {
                let reflected = Point3::new(-p.x, p.y, p.z);
                after.iter().map(|q| (q - reflected).norm()).fold(f64::INFINITY, f64::min) / size
            })
            .collect();
        let mean = missed.iter().sum::<f64>() / missed.len() as f64;
        assert!(mean < 0.004, "{name}: {mean}");
        // And it is not what it was.
        let moved = before.iter().zip(&after).map(|(p, q)| (p - q).norm()).sum::<f64>();
        assert!(moved / before.len() as f64 > 0.02 * size, "{name}");
    }
}

#[test]
fn a_rig_without_two_sides_has_no_mirror() {
    let mut model = horse();
    for (n, node) in model.skeleton.nodes.iter_mut().enumerate() {
        node.rest.translation += Vector3::new(0.4, -0.2, 0.3) * (1.9 * n as f64).sin();
    }
    let why = Mirror::of(&model.skeleton, &[]).unwrap_err().to_string();
    assert!(why.contains("miss one another") || why.contains("no other side"), "{why}");
}

fn shooting(frames: usize, frames_per_cycle: f64) -> Shooting {
    Shooting {
        frames,
        frames_per_cycle,
        yaw_rad: 0.3,
        noise: 0.1,
        seed: 42,
        size_px: (320, 240),
        unsteady: Unsteady::default(),
    }
}

fn walking() -> (Desk, Truth) {
    let desk = Desk::new();
    let shooting = shooting(80, 24.3);
    let truth = Truth::of(&Subject::Horse(Gait::Walk), &shooting).unwrap();
    fs::create_dir(desk.path("mattes")).unwrap();
    for (t, mask) in truth.masks(&shooting).iter().enumerate() {
        fs::write(desk.path(&format!("mattes/{t:03}.png")), mask.to_png().unwrap()).unwrap();
    }
    let clip = NamedClip { name: "Truth", fps: 25.0, poses: &truth.poses };
    fs::write(desk.path("rig.glb"), to_glb(&truth.model, &[clip], "horse")).unwrap();
    desk.run("new walk --mattes mattes --fps 25").success();
    (desk, truth)
}

/// Keys, their true poses, the animation; and its mean error over frames and joints, degrees.
fn animated(desk: &Desk, truth: &Truth, flags: &str) -> (Value, Value, f64) {
    let chosen = desk.json(&format!("keys walk {flags}"));
    let poses: String = (chosen["keys"].as_array().unwrap().iter())
        .map(|k| format!(" --pose {}=Truth#{}", k["key"], k["frame"]))
        .collect();
    let made = desk.json(&format!("animate walk --rig rig.glb{poses} --no-plant"));
    let file = File::read(&desk.path("walk/animation.glb")).unwrap();
    let found = file.animation(made["animation"].as_str().unwrap()).unwrap();
    let mut angles = Vec::new();
    for (frame, known) in truth.poses.iter().enumerate() {
        let pose = found.sample(file.skeleton(), frame as f64 / 25.0);
        let pairs = pose.nodes.iter().zip(&known.nodes);
        angles.extend(pairs.map(|(a, b)| angle_between_rad(&a.rotation, &b.rotation).to_degrees()));
    }
    let error = angles.iter().sum::<f64>() / angles.len() as f64;
    (chosen, made, error)
}

#[test]
fn three_poses_of_a_walk_count_as_six() {
    let (desk, truth) = walking();
    desk.json("analyze walk --gait walk");
    let (chosen, made, error) = animated(&desk, &truth, "-m 3");
    assert_eq!(chosen["mirrored"], true);
    assert_eq!(made["mirrored_poses"], 3);
    let table = fs::read_to_string(desk.path("walk/keys/weights.csv")).unwrap();
    let header = "frame,time_s,key_1,key_2,key_3,mirrored_1,mirrored_2,mirrored_3,sum,model";
    assert_eq!(table.lines().next().unwrap(), header);
    // The report draws a curve for each.
    desk.run("report walk").success();
    assert!(fs::read_to_string(desk.path("walk/report.html")).unwrap().contains("exchanged"));

    let (chosen, made, plain) = animated(&desk, &truth, "-m 3 --mirror off");
    assert_eq!((&chosen["mirrored"], &made["mirrored_poses"]), (&false.into(), &0.into()));
    assert!(error < 0.65 * plain, "{error} {plain}");
    assert!(fs::read_to_string(desk.path("walk/shot.toml")).unwrap().contains("mirror = \"off\""));

    // An asymmetric gait has no such halves.
    desk.json("analyze walk --gait gallop");
    assert_eq!(desk.json("keys walk --mirror auto")["mirrored"], false);
}
