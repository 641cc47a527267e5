//! Feet: found, their falls against published tables, planted on every rig, measured in the written file
//! by forward kinematics that share no code with the library's.

use muybridge::export::append_animation;
use muybridge::feet::{
    common_root, find_feet, foot_tracks, footfalls, gait_report, ground_speed_from_pan, plant,
    travel,
};
use muybridge::rig::{Clip, Driven, File, Model, Pose};
use muybridge::synthetic::{Foot, Gait, SyntheticFootage, SyntheticSettings, horse};
use nalgebra::{Matrix4, Point3, Quaternion, UnitQuaternion, Vector3};
use serde_json::Value;

use crate::gltf_fixture::real_rigs;
use crate::shot_folder::Desk;

/// Poses of a stride of the built-in horse, the first again at the end.
fn stride(gait: Gait, model: &Model, frames: usize) -> Clip {
    let pose = |i: usize| gait.pose(&model.skeleton, 0.3 + i as f64 / frames as f64).pose;
    let driven = Driven { translation: false, rotation: true, scale: false };
    Clip {
        name: "stride".to_owned(),
        fps: frames as f64 / gait.stride_s(),
        poses: (0..=frames).map(pose).collect(),
        driven: vec![driven; model.skeleton.nodes.len()],
    }
}

#[test]
fn the_built_in_gaits_have_their_footfalls_speed_and_name() {
    let model = horse();
    let names = ["walk", "trot", "canter", "transverse gallop"];
    for (gait, name) in Gait::ALL.into_iter().zip(names) {
        for looped in [true, false] {
            let mut clip = stride(gait, &model, 24);
            if !looped {
                // Three and a half strides, not a whole number of frames each.
                clip.poses =
                    (0..85).map(|i| gait.pose(&model.skeleton, f64::from(i) / 24.3).pose).collect();
                clip.fps = 24.3 / gait.stride_s();
            }
            let feet = find_feet(&model, &clip.poses, &[]);
            let names: Vec<&str> =
                feet.iter().map(|f| model.skeleton.nodes[f.node].name.as_str()).collect();
            let hooves =
                ["coffin_fore_left", "coffin_fore_right", "coffin_hind_left", "coffin_hind_right"];
            assert_eq!(names, hooves);
            let tracks = foot_tracks(&model.skeleton, &clip.poses, &feet);
            let falls = footfalls(&tracks, clip.fps, looped).unwrap();
            assert!((falls.forward - Vector3::z()).norm() < 0.02, "{:?}", falls.forward);
            let share = falls.speed / gait.speed_m_s();
            assert!((share - 1.0).abs() < 0.03, "{gait}: {share}");
            let report = gait_report(&tracks, &falls).unwrap();
            assert_eq!((report.name.as_deref(), report.warning), (Some(name), None), "{gait}");
            let order = [Foot::LeftFore, Foot::RightFore, Foot::LeftHind, Foot::RightHind];
            let reference = gait.stance(Foot::LeftHind).0;
            for (limb, foot) in report.limbs.iter().zip(order) {
                let (contact, duty) = gait.stance(foot);
                let off = (limb.phase.unwrap() - contact + reference + 0.5).rem_euclid(1.0) - 0.5;
                assert!(off.abs() < 0.03, "{gait} {foot:?}: phase off by {off}");
                let off = limb.duty_factor.unwrap() - duty;
                assert!(off.abs() < 0.05, "{gait} {foot:?}: duty off by {off}");
            }
        }
    }
}

/// Poses of a gallop may show a hoof on the ground of one side only: its counterpart is a foot as well.
#[test]
fn a_foot_that_never_comes_down_is_known_by_the_other_side() {
    let model = horse();
    let down = |pose: &Pose, name: &str| {
        let node = model.skeleton.nodes.iter().position(|n| n.name == name).unwrap();
        model.skeleton.world_matrices(pose)[node].transform_point(&Point3::origin()).y
    };
    let mut poses = stride(Gait::Gallop, &model, 24).poses;
    let low = poses.iter().map(|p| down(p, "coffin_fore_right")).fold(f64::INFINITY, f64::min);
    poses.retain(|p| down(p, "coffin_fore_right") > low + 0.2);
    let feet = find_feet(&model, &poses, &[]);
    let names: Vec<&str> =
        feet.iter().map(|f| model.skeleton.nodes[f.node].name.as_str()).collect();
    let hooves = ["coffin_fore_left", "coffin_fore_right", "coffin_hind_left", "coffin_hind_right"];
    assert_eq!(names, hooves);
}

/// Translation, rotation (x, y, z, w) and scale of a node.
type Local = ([f32; 3], [f32; 4], [f32; 3]);

/// World matrices of every node at every key of the last animation of a file, by the `gltf` crate.
fn kinematics(bytes: &[u8], frames: usize) -> Vec<Vec<Matrix4<f64>>> {
    use gltf::animation::util::ReadOutputs;
    let file = gltf::Gltf::from_slice_without_validation(bytes).unwrap();
    let nodes: Vec<_> = file.nodes().collect();
    let mut locals: Vec<Vec<Local>> =
        vec![nodes.iter().map(|n| n.transform().decomposed()).collect(); frames];
    for channel in file.animations().last().unwrap().channels() {
        let node = channel.target().node().index();
        let reader = channel.reader(|_| file.blob.as_deref());
        let at = |count: usize, t: usize| if count == frames { t } else { 0 };
        match reader.read_outputs().unwrap() {
            ReadOutputs::Translations(v) => {
                let v: Vec<_> = v.collect();
                (0..frames).for_each(|t| locals[t][node].0 = v[at(v.len(), t)]);
            }
            ReadOutputs::Rotations(v) => {
                let v: Vec<_> = v.into_f32().collect();
                (0..frames).for_each(|t| locals[t][node].1 = v[at(v.len(), t)]);
            }
            ReadOutputs::Scales(v) => {
                let v: Vec<_> = v.collect();
                (0..frames).for_each(|t| locals[t][node].2 = v[at(v.len(), t)]);
            }
            ReadOutputs::MorphTargetWeights(_) => {}
        }
    }
    let mut parents = vec![None; nodes.len()];
    for node in &nodes {
        node.children().for_each(|c| parents[c.index()] = Some(node.index()));
    }
    let matrix = |(t, r, s): Local| -> Matrix4<f64> {
        let [x, y, z, w] = r.map(f64::from);
        let q = UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z));
        Matrix4::new_translation(&Vector3::from(t.map(f64::from)))
            * q.to_homogeneous()
            * Matrix4::new_nonuniform_scaling(&Vector3::from(s.map(f64::from)))
    };
    let world = |t: usize, node: usize| {
        let up = std::iter::successors(Some(node), |&n| parents[n]);
        up.fold(Matrix4::identity(), |m, n| matrix(locals[t][n]) * m)
    };
    (0..frames).map(|t| (0..nodes.len()).map(|n| world(t, n)).collect()).collect()
}

#[test]
fn planted_feet_do_not_slide_on_any_rig() {
    for path in real_rigs() {
        let file = File::read(&path).unwrap();
        let model = file.model().unwrap();
        let cycles = file
            .animation_names()
            .into_iter()
            .filter(|n| ["Walk", "Gallop", "Run"].iter().any(|end| n.ends_with(end)));
        for name in cycles {
            let animation = file.animation(&name).unwrap();
            let length = animation.duration_s();
            let pose =
                |i: usize| animation.sample(file.skeleton(), (i % 24) as f64 / 24.0 * length);
            let poses: Vec<Pose> = (0..=24).map(pose).collect();
            let driven = animation.driven(file.skeleton());
            let mut clip = Clip { name: "planted".to_owned(), fps: 24.0 / length, poses, driven };
            let feet = find_feet(&model, &clip.poses, &[]);
            assert_eq!(feet.len(), 4, "{} {name}", path.display());
            let tracks = foot_tracks(file.skeleton(), &clip.poses, &feet);
            let falls = footfalls(&tracks, clip.fps, true).unwrap();
            assert!((falls.forward - Vector3::z()).norm() < 0.05, "{name}: {:?}", falls.forward);
            let planted = plant(file.skeleton(), &mut clip, &feet, &falls);
            let count: usize = planted.contacts.iter().map(Vec::len).sum();
            assert!(count >= 3, "{} {name}: {count} contacts", path.display());
            assert!(planted.contacts.iter().flatten().all(|c| c.last > c.first));
            if name.ends_with("Walk") {
                let root = common_root(file.skeleton(), &feet).unwrap();
                travel(file.skeleton(), &mut clip, root, &falls);
            }
            let made = append_animation(&file, &clip).unwrap();
            let worlds = kinematics(&made.bytes, 25);
            // In place the ground moves; under a travelling animal it stays, but for the turn of the loop.
            let ground = if name.ends_with("Walk") {
                Vector3::zeros()
            } else {
                falls.forward * (-falls.speed / clip.fps)
            };
            let turn = falls.forward * (falls.speed / clip.fps * 24.0);
            for (foot, contacts) in feet.iter().zip(&planted.contacts) {
                for contact in contacts {
                    let place = |t: usize| {
                        let sole: Point3<f64> =
                            worlds[t % 24][foot.node].transform_point(&foot.sole);
                        let turns = if name.ends_with("Walk") { (t / 24) as f64 } else { 0.0 };
                        sole.coords + turn * turns - ground * t as f64
                    };
                    let ways = (contact.first..=contact.last)
                        .map(|t| (place(t) - place(contact.first)).norm());
                    let slide = ways.fold(0.0, f64::max) / foot.leg_length;
                    assert!(slide < 0.01, "{} {name}: {slide} of a leg", path.display());
                }
            }
        }
    }
}

#[test]
fn the_speed_of_a_rendered_pan_is_found() {
    for gait in [Gait::Walk, Gait::Canter] {
        let settings = SyntheticSettings { frames: 50, ..SyntheticSettings::default() };
        let footage = SyntheticFootage::new(gait, settings);
        let (inside, _) = footage.rectangles();
        // The background: every fourth row, without the animal.
        let band = |frame: usize| -> Vec<Vec<f64>> {
            let (picture, mask) = (footage.picture(frame), footage.true_mask(frame));
            let grey = |x: usize, y: usize| match mask.get(x, y) {
                true => f64::NAN,
                false => picture.pixel(x, y).iter().map(|&c| f64::from(c)).sum::<f64>(),
            };
            let row = |y: usize| (0..picture.width()).map(|x| grey(x, y)).collect();
            (0..picture.height()).step_by(4).map(row).collect()
        };
        let bands: Vec<_> = (0..50).map(band).collect();
        let shift = |a: &[Vec<f64>], b: &[Vec<f64>]| -> f64 {
            let cost = |s: i32| -> f64 {
                let (mut sum, mut n) = (0.0, 0.0);
                for (p, q) in a.iter().zip(b) {
                    for x in 60..260_i32 {
                        let d = p[x as usize] - q[(x + s) as usize];
                        if d.is_finite() {
                            sum += d * d;
                            n += 1.0;
                        }
                    }
                }
                sum / n
            };
            let best = (-58..=58).min_by(|&i, &j| cost(i).total_cmp(&cost(j))).unwrap();
            let [l, m, r] = [cost(best - 1), cost(best), cost(best + 1)];
            f64::from(best) + 0.5 * (l - r) / (l - 2.0 * m + r)
        };
        let mut background = vec![0.0];
        background.extend(bands.windows(2).map(|w| shift(&w[0], &w[1])));
        let subject: Vec<f64> =
            (0..50).map(|t| footage.true_mask(t).centre_of_mass().unwrap().0).collect();
        // The scale, from the silhouette's height over the posed model's.
        let model = footage.model();
        let heights = model.posed_vertices(&footage.truth(0).pose);
        let ys = || heights.iter().flatten().map(|p| p.y);
        let units = ys().fold(f64::MIN, f64::max) - ys().fold(f64::MAX, f64::min);
        let bounds = footage.true_mask(0).bounds().unwrap();
        let scale = (bounds.bottom - bounds.top + 1) as f64 / units;
        let found = ground_speed_from_pan(&background, &subject, 25.0, scale).unwrap();
        let truth = gait.speed_m_s() * gait.stride_s() / (24.3 / 25.0);
        assert!(
            (found.abs() / truth - 1.0).abs() < 0.05,
            "{gait}: {found} of {truth} ({inside:?})"
        );
    }
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

#[test]
fn contacts_and_root_motion_are_written() {
    let desk = Desk::new();
    desk.run("demo --out demo").success();
    let place = desk.json("animate demo --loop");
    let feet = &place["feet"];
    // Four keys blur which of the hind feet is first; which feet go together they do not.
    assert!(
        feet["gait"].as_str().is_some_and(|g| g.contains("bound") || g.contains("gallop")),
        "{feet}"
    );
    assert_eq!((feet["root"].as_str(), &feet["root_node"]), (Some("in-place"), &Value::Null));
    assert!(number(&feet["planted"]["slide_leg_lengths"][1]) < 0.01, "{feet}");
    // Played at 25 frames a second a stride takes 24.3 of them. A foot stands for a fifth of the
    // stride, so of four poses at most one has it on the ground: the speed is rough (.77 measured).
    // With the true poses it is measured above.
    let truth = Gait::Gallop.speed_m_s() * Gait::Gallop.stride_s() / (24.3 / 25.0);
    let share = number(&feet["ground_speed"]) / truth;
    assert!((share - 1.0).abs() < 0.3, "{share}");
    let seam = &place["loop"]["seam"];
    assert!(number(&seam["angle_deg"]) < 1e-6, "{seam}");
    assert!(number(&seam["angle_jump_deg"]) < number(&seam["median_turn_deg"]), "{seam}");

    let summary = desk.json("animate demo --loop 0 --root travel");
    let feet = &summary["feet"];
    assert_eq!(feet["root"], "travel");
    let path = desk.path(summary["path"].as_str().unwrap());
    let bytes = std::fs::read(&path).unwrap();
    let frames = summary["frames"].as_u64().unwrap() as usize;
    let worlds = kinematics(&bytes, frames);
    let file = gltf::Gltf::from_slice_without_validation(&bytes).unwrap();
    let node = |name: &Value| file.nodes().find(|n| n.name() == name.as_str()).unwrap().index();
    let root = node(&feet["root_node"]);
    let way = (worlds[frames - 1][root] - worlds[0][root]).column(3).norm();
    let told = number(&feet["ground_speed"]) * (frames - 1) as f64 / 25.0;
    assert!((way - told).abs() < 0.02 * told, "{way} {told}");

    // The contacts of the document, of the file, and what the feet do are one.
    let animation = file.animations().last().unwrap();
    let extras: Value = serde_json::from_str(animation.extras().as_ref().unwrap().get()).unwrap();
    let written = &extras["muybridge"]["contacts"];
    let mut count = 0;
    for (at, foot) in feet["feet"].as_array().unwrap().iter().enumerate() {
        assert_eq!(written[at]["node"], foot["node"]);
        let sole: Vec<f64> = foot["sole"].as_array().unwrap().iter().map(number).collect();
        let sole = Point3::new(sole[0], sole[1], sole[2]);
        for (k, contact) in foot["contacts"].as_array().unwrap().iter().enumerate() {
            assert_eq!(written[at]["down_up_s"][k][0], contact["down_s"]);
            let frame = |name: &str| contact[name].as_u64().unwrap() as usize;
            let place = |t: usize| worlds[t][node(&foot["node"])].transform_point(&sole);
            let first = place(frame("first_frame"));
            for t in frame("first_frame")..=frame("last_frame") {
                let slide = (place(t) - first).norm() / number(&foot["leg_length"]);
                assert!(slide < 0.01, "{foot}, frame {t}: {slide}");
            }
            count += 1;
        }
    }
    assert!(count >= 12, "four strides of four feet: {count}");

    let free = desk.json("animate demo --loop --root in-place --no-plant");
    assert!(free["feet"]["planted"].is_null() && free["feet"]["gait"].is_string());
    let settings = std::fs::read_to_string(desk.path("demo/shot.toml")).unwrap();
    assert!(settings.contains("plant = false"));
    let named = settings.replace("nodes = []", "nodes = [\"hoof\"]");
    std::fs::write(desk.path("demo/shot.toml"), named).unwrap();
    assert!(desk.complaint("animate demo", 1).contains("«hoof»"));
}
