//! Reading rigs: against planted answers, against the `gltf` crate on real files, and on files
//! that are broken in every way.

use std::path::Path;

use muybridge::Error;
use muybridge::rig::{
    Driven, File, KeyPoses, Moment, PoseSpec, angle_between_rad, rotation_vector,
};
use nalgebra::{Point3, Vector3};
use proptest::prelude::*;
use serde_json::json;

use crate::gltf_fixture::{Fixture, glb, real_rigs};

fn open(bytes: Vec<u8>) -> Result<File, Error> {
    File::from_bytes(Path::new("test.glb"), bytes)
}

/// Reads everything there is to read.
fn open_all(bytes: Vec<u8>) -> Result<(), Error> {
    let file = open(bytes)?;
    let model = file.model()?;
    let _ = model.posed_vertices(&model.skeleton.rest_pose());
    file.joints()?;
    for name in file.animation_names() {
        let animation = file.animation(&name)?;
        for t in [-1.0, 0.0, 0.3, 1.0, 1e9] {
            let _ = animation.sample(file.skeleton(), t);
        }
    }
    Ok(())
}

fn assert_broken(fixture: &Fixture, place: &str, reason: &str) {
    match open_all(fixture.glb()) {
        Err(Error::RigBroken { path, place: p, reason: r }) => {
            assert_eq!(path, Path::new("test.glb"));
            assert!(p.contains(place) && r.contains(reason), "{p}: {r}");
        }
        other => panic!("{place}, {reason}: {other:?}"),
    }
}

#[test]
fn a_skinned_mesh_follows_its_bones() {
    let file = open(Fixture::two_bones().glb()).unwrap();
    let model = file.model().unwrap();
    assert_eq!(model.meshes.len(), 1, "lines are left out");
    assert_eq!(model.meshes[0].triangles, [[0, 1, 2]]);
    assert_eq!(file.joints().unwrap(), [0, 1]);
    let bend = file.animation("Bend").unwrap();
    let posed = model.posed_vertices(&bend.sample(file.skeleton(), 1.0));
    // The tip's joint is at (0, 2, 0) in the world and turns its vertex, one unit above it, by 90°.
    let expected = [[-0.5, 0.0, 0.0], [0.5, 0.0, 0.0], [-1.0, 2.0, 0.0]].map(Point3::from);
    for (p, q) in posed[0].iter().zip(expected) {
        assert!((p - q).norm() < 1e-6, "{p} {q}");
    }
}

#[test]
fn rotations_take_the_short_way_at_even_speed() {
    let file = open(Fixture::two_bones().glb()).unwrap();
    let bend = file.animation("Rig|Bend").unwrap();
    assert_eq!(bend.duration_s(), 1.0);
    for (t, degrees) in
        [(-1.0, 0.0), (0.0, 0.0), (0.25, 22.5), (0.5, 45.0), (1.0, 90.0), (7.0, 90.0)]
    {
        let pose = bend.sample(file.skeleton(), t);
        let v = rotation_vector(&pose.nodes[0].rotation) - Vector3::z() * f64::to_radians(degrees);
        assert!(v.norm() < 1e-6, "{t}: {v}");
    }
}

#[test]
fn steps_step_and_splines_follow_the_hermite_formula() {
    let file = open(Fixture::two_bones().glb()).unwrap();
    let hop = file.animation("Hop").unwrap();
    let at = |t: f64| hop.sample(file.skeleton(), t);
    assert_eq!(at(0.999).nodes[1].translation.y, 0.0);
    assert_eq!(at(1.0).nodes[1].translation.y, 3.0);
    // From 1 to 3 with tangents 2 and 1: cubic 1 + 2t + t² − t³ through both ends.
    for t in [0.0_f64, 0.125, 0.5, 0.75, 1.0] {
        let expected = 1.0 + 2.0 * t + t * t - t * t * t;
        assert!((at(t).nodes[0].scale.x - expected).abs() < 1e-12, "{t}");
        assert_eq!(at(t).nodes[0].scale.y, 1.0);
    }
    let driven = hop.driven(file.skeleton());
    assert_eq!(driven[0], Driven { scale: true, ..Driven::default() });
    assert_eq!(driven[1], Driven { translation: true, ..Driven::default() });
    assert_eq!(driven[2], Driven::default(), "pointers are not followed");
    assert_eq!(hop.clip(file.skeleton(), 24.0).unwrap().poses.len(), 25);
}

#[test]
fn animations_answer_to_their_name_or_its_ending() {
    let mut fixture = Fixture::two_bones();
    let file = open(fixture.glb()).unwrap();
    assert_eq!(file.animation_names(), ["Rig|Bend", "Rig|Hop", "Up"]);
    assert_eq!(file.animation("Bend").unwrap().name(), "Rig|Bend");
    match file.animation("bend") {
        Err(e @ Error::AnimationNotFound { .. }) => {
            let text = e.to_string();
            assert!(text.contains("\"Rig|Bend\", \"Rig|Hop\", \"Up\""), "{text}");
        }
        other => panic!("{other:?}"),
    }
    fixture.json["animations"][2]["name"] = json!("Other|Bend");
    let file = open(fixture.glb()).unwrap();
    assert!(matches!(file.animation("Bend"), Err(Error::AnimationAmbiguous { .. })));
    fixture.json["animations"][2]["name"] = json!("Bend");
    let file = open(fixture.glb()).unwrap();
    assert_eq!(file.animation("Bend").unwrap().name(), "Bend", "exact before ending");
    fixture.json["animations"][0]["name"] = json!("Bend");
    let file = open(fixture.glb()).unwrap();
    assert!(
        matches!(file.animation("Bend"), Err(Error::AnimationAmbiguous { matches, .. }) if matches.len() == 2)
    );
}

#[test]
fn key_poses_come_from_clips_in_the_order_of_the_keys() {
    let file = open(Fixture::two_bones().glb()).unwrap();
    let spec = |text: &str| text.parse::<PoseSpec>().unwrap();
    let keys =
        KeyPoses::read(&file, &[spec("2=Bend@0.5"), spec("1=Up"), spec("3=Hop#24")], 24.0).unwrap();
    assert_eq!(keys.poses[0].nodes[1].translation.y, 5.0);
    assert!(
        (rotation_vector(&keys.poses[1].nodes[0].rotation).z - 45_f64.to_radians()).abs() < 1e-6
    );
    assert_eq!(keys.poses[2].nodes[1].translation.y, 3.0);
    assert_eq!(keys.driven[0], Driven { translation: false, rotation: true, scale: true });
    assert_eq!(keys.driven[1], Driven { translation: true, ..Driven::default() });
    // Half a frame past the end is the end; more is refused.
    assert!(KeyPoses::read(&file, &[spec("1=Bend@1.02")], 24.0).is_ok());
    for late in ["1=Bend@1.03", "1=Bend#25", "1=Up#1"] {
        let result = KeyPoses::read(&file, &[spec(late)], 24.0);
        assert!(matches!(result, Err(Error::PoseOutsideClip { key: 1, .. })), "{late}");
    }
    let nan = PoseSpec { key: 1, clip: "Up".to_owned(), at: Moment::Time(f64::NAN) };
    assert!(matches!(KeyPoses::read(&file, &[nan], 24.0), Err(Error::PoseOutsideClip { .. })));
}

#[test]
fn a_matrix_node_has_a_rest_pose_but_may_not_be_driven() {
    let mut fixture = Fixture::two_bones();
    fixture.json["nodes"][0] =
        json!({ "name": "tip", "matrix": [0, 2, 0, 0, -2, 0, 0, 0, 0, 0, 2, 0, 7, 8, 9, 1] });
    let file = open(fixture.glb()).unwrap();
    let rest = file.skeleton().nodes[0].rest;
    assert_eq!(rest.translation, Vector3::new(7.0, 8.0, 9.0));
    assert!((rest.scale - Vector3::repeat(2.0)).norm() < 1e-12);
    assert!((rotation_vector(&rest.rotation).z - 90_f64.to_radians()).abs() < 1e-12);
    assert!(
        matches!(file.animation("Bend"), Err(Error::MatrixNodeDriven { node, .. }) if node == "tip")
    );
    assert!(file.animation("Up").is_ok(), "other animations are still good");
}

#[test]
fn accessors_of_every_kind_give_the_same_positions() {
    let base = Fixture::two_bones();
    let positions =
        |f: &Fixture| open(f.glb()).unwrap().model().unwrap().meshes[0].positions.clone();
    let planted = [[1.0, 0.0, 2.0], [3.0, 4.0, 5.0], [-6.0, 7.0, 8.0]].map(Point3::from);
    let flat = || planted.iter().flat_map(|p| p.iter().copied().collect::<Vec<f64>>());
    let with = |make: &dyn Fn(&mut Fixture) -> usize| {
        let mut f = Fixture { json: base.json.clone(), bin: base.bin.clone() };
        let index = make(&mut f);
        f.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = json!(index);
        positions(&f)
    };
    let floats: Vec<f32> = flat().map(|x| x as f32).collect();
    assert_eq!(with(&|f| f.floats("VEC3", &floats)), planted);

    let shorts: Vec<u8> = flat().flat_map(|x| (x as i16).to_le_bytes()).collect();
    let short = json!({ "componentType": 5122, "type": "VEC3" });
    assert_eq!(with(&|f| f.push(&shorts, short.clone(), 3)), planted);

    // Signed bytes, interleaved with a byte of something else.
    let strided: Vec<u8> =
        planted.iter().flat_map(|p| [p.x as i8 as u8, p.y as u8, p.z as u8, 99]).collect();
    let bytes = json!({ "componentType": 5120, "type": "VEC3" });
    let made = with(&|f| {
        let index = f.push(&strided, bytes.clone(), 3);
        let view = f.json["accessors"][index]["bufferView"].as_u64().unwrap() as usize;
        f.json["bufferViews"][view]["byteStride"] = json!(4);
        index
    });
    assert_eq!(made, planted);

    // Normalised: −128 and −127 are both −1.
    let norm = json!({ "componentType": 5120, "type": "VEC3", "normalized": true });
    let made = with(&|f| f.push(&[128, 129, 127, 0, 0, 0, 0, 0, 0], norm.clone(), 3));
    assert_eq!(made[0], Point3::new(-1.0, -1.0, 1.0));

    // Sparse over zeros.
    let made = with(&|f| {
        let indices = f.view(&[2, 0, 1, 0]);
        let values: Vec<f32> =
            [2, 1].iter().flat_map(|&i| floats[3 * i..3 * i + 3].to_vec()).collect();
        let bytes: Vec<u8> = values.iter().flat_map(|x| x.to_le_bytes()).collect();
        let values = f.view(&bytes);
        f.add(
            "accessors",
            json!({ "componentType": 5126, "type": "VEC3", "count": 3, "sparse": {
            "count": 2,
            "indices": { "bufferView": indices, "componentType": 5123 },
            "values": { "bufferView": values } } }),
        )
    });
    assert_eq!(made, [Point3::origin(), planted[1], planted[2]]);
}

#[test]
fn several_sets_of_joints_count_together() {
    let mut f = Fixture::two_bones();
    let j = f.bytes("VEC4", &[1, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0], false);
    let w = f.floats("VEC4", &[1., 0., 0., 0., 3., 0., 0., 0., 0., 0., 0., 0.]);
    let attributes = &mut f.json["meshes"][0]["primitives"][0]["attributes"];
    attributes["JOINTS_1"] = json!(j);
    attributes["WEIGHTS_1"] = json!(w);
    let model = open(f.glb()).unwrap().model().unwrap();
    let influences = &model.meshes[0].skin.as_ref().unwrap().influences;
    assert_eq!(influences[0], [(0, 0.5), (1, 0.5)]);
    assert_eq!(influences[1], [(0, 0.25), (1, 0.75)]);
    assert_eq!(influences[2], [(1, 1.0)]);
}

#[test]
fn text_files_bring_their_buffers_as_data_or_as_files() {
    let fixture = Fixture::two_bones();
    let model = open(fixture.glb()).unwrap().model().unwrap();
    let inline = open(fixture.text(&fixture.data_uri())).unwrap();
    assert!(!inline.is_glb());
    assert_eq!(inline.model().unwrap(), model);

    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("rig.gltf");
    std::fs::write(&path, fixture.text("my%20rig.bin")).unwrap();
    match File::read(&path) {
        Err(Error::RigBuffer { buffer: 0, file, .. }) => {
            assert_eq!(file, folder.path().join("my rig.bin"));
        }
        other => panic!("{other:?}"),
    }
    std::fs::write(folder.path().join("my rig.bin"), &fixture.bin).unwrap();
    let external = File::read(&path).unwrap();
    assert_eq!(external.model().unwrap(), model);
    assert_eq!(external.referenced_files(), [Path::new("my rig.bin")]);
    std::fs::write(folder.path().join("my rig.bin"), &fixture.bin[1..]).unwrap();
    assert!(
        matches!(File::read(&path), Err(Error::RigBroken { place, .. }) if place == "buffer 0")
    );
}

#[test]
fn extensions_nobody_knows_are_no_obstacle() {
    let mut f = Fixture::two_bones();
    f.json["extensionsUsed"] = json!(["VENDOR_unheard_of"]);
    f.json["extensionsRequired"] = json!(["VENDOR_unheard_of"]);
    f.json["nodes"][0]["extensions"] = json!({ "VENDOR_unheard_of": { "x": 1 } });
    open_all(f.glb()).unwrap();
}

#[test]
fn compressed_meshes_are_named_and_do_not_stop_the_bones() {
    let mut f = Fixture::two_bones();
    f.json["meshes"][0]["primitives"][0]["extensions"] =
        json!({ "KHR_draco_mesh_compression": {} });
    let file = open(f.glb()).unwrap();
    assert!(
        matches!(file.model(), Err(Error::RigUnsupported { what, .. }) if what.contains("draco"))
    );
    assert!(file.animation("Bend").is_ok());
}

#[test]
fn files_that_are_no_rigs_say_so() {
    let message = |bytes: &[u8]| open(bytes.to_vec()).unwrap_err().to_string();
    assert!(message(b"").contains("neither a GLB"));
    assert!(message(b"\x89PNG\r\n").contains("neither a GLB"));
    assert!(message(b"{ \"asset\": }").contains("JSON: expected value at line 1"));
    assert!(message(b"{}").contains("not a glTF 2.0 file"));
    assert!(message(b"{\"asset\":{\"version\":\"1.0\"}}").contains("version 1.0"));
    let whole = Fixture::two_bones().glb();
    assert!(message(&whole[..whole.len() - 1]).contains("truncated"));
    assert!(message(&glb(b"[1]", None)).contains("not an object"));
    let missing = File::read(Path::new("/nowhere/rig.glb"));
    assert!(
        matches!(missing, Err(Error::Io { path, .. }) if path == Path::new("/nowhere/rig.glb"))
    );
}

#[test]
fn broken_parts_are_named() {
    let broken = |edit: &dyn Fn(&mut Fixture), place: &str, reason: &str| {
        let mut fixture = Fixture::two_bones();
        edit(&mut fixture);
        assert_broken(&fixture, place, reason);
    };
    broken(&|f| f.json["accessors"][0]["count"] = json!(4), "accessor 0", "do not fit");
    broken(&|f| f.json["accessors"][0]["count"] = json!(u64::MAX), "accessor 0", "do not fit");
    broken(&|f| f.json["accessors"][0]["byteOffset"] = json!(-4), "accessor 0", "not an index");
    broken(&|f| f.json["accessors"][0]["componentType"] = json!(5130), "accessor 0", "component");
    broken(&|f| f.json["accessors"][0]["type"] = json!("VEC9"), "accessor 0", "VEC9");
    broken(&|f| f.json["bufferViews"][0]["byteLength"] = json!(1 << 30), "bufferView 0", "end");
    broken(&|f| f.json["bufferViews"][0]["buffer"] = json!(3), "bufferView 0", "buffer 3");
    broken(&|f| f.json["nodes"][0]["children"] = json!([2]), "node", "ancestor");
    broken(&|f| f.json["nodes"][3]["children"] = json!([0]), "node 0", "both");
    broken(&|f| f.json["nodes"][3]["children"] = json!([9]), "node 3", "child 9");
    broken(&|f| f.json["nodes"][0]["rotation"] = json!([0, 0, 0, 0]), "node 0", "quaternion");
    broken(&|f| f.json["nodes"][0]["scale"] = json!([1, 1]), "node 0", "3 numbers");
    broken(&|f| f.json["skins"][0]["joints"] = json!([1, 44]), "skin 0", "44");
    broken(&|f| f.json["nodes"][3]["skin"] = json!(4), "node 3", "skin 4");
    broken(&|f| f.json["nodes"][3]["mesh"] = json!(4), "node 3", "mesh 4");
    broken(&|f| f.json["scenes"][0]["nodes"] = json!([77]), "scene 0", "77");
    broken(&|f| f.json["nodes"] = json!({}), "nodes", "array");
    let channel = "animation 0 \"Rig|Bend\", channel 0";
    broken(
        &|f| f.json["animations"][0]["channels"][0]["target"]["node"] = json!(50),
        channel,
        "node 50",
    );
    broken(&|f| f.json["animations"][0]["channels"][0]["sampler"] = json!(5), channel, "sampler 5");
    broken(
        &|f| f.json["animations"][0]["samplers"][0]["interpolation"] = json!("SMOOTH"),
        channel,
        "SMOOTH",
    );
    broken(
        &|f| {
            let times = f.floats("SCALAR", &[1.0, 0.5]);
            f.json["animations"][0]["samplers"][0]["input"] = json!(times);
        },
        channel,
        "increase",
    );
    broken(
        &|f| {
            let values = f.floats("VEC4", &[0.0; 8]);
            f.json["animations"][0]["samplers"][0]["output"] = json!(values);
        },
        channel,
        "zero quaternion",
    );
    broken(
        &|f| f.bin[..4].copy_from_slice(&f32::NAN.to_le_bytes()),
        "accessor 0",
        "element 0 is not a finite number",
    );
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(3000))]

    #[test]
    fn damaged_files_never_panic(
        flips in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..6),
        cut in prop::option::weighted(0.3, any::<prop::sample::Index>()),
    ) {
        let mut bytes = Fixture::two_bones().glb();
        for (at, value) in &flips {
            let at = at.index(bytes.len());
            bytes[at] = *value;
        }
        if let Some(cut) = cut {
            bytes.truncate(cut.index(bytes.len()));
        }
        let _ = open_all(bytes);
    }
}

#[test]
fn real_rigs_agree_with_the_gltf_crate() {
    for path in real_rigs() {
        let bytes = std::fs::read(&path).unwrap();
        let oracle = gltf::Gltf::from_slice_without_validation(&bytes).unwrap();
        let blob = oracle.blob.as_deref();
        let file = File::read(&path).unwrap();
        let model = file.model().unwrap();

        let skin = oracle.skins().next().unwrap();
        let joints: Vec<usize> = skin.joints().map(|j| j.index()).collect();
        assert_eq!(model.skins[0].joints, joints);
        let bind = skin.reader(|_| blob).read_inverse_bind_matrices().unwrap();
        for (m, n) in bind.zip(&model.skins[0].inverse_bind) {
            assert_eq!(nalgebra::Matrix4::from(m).cast::<f64>(), *n);
        }

        let node = oracle.nodes().find(|n| n.mesh().is_some()).unwrap();
        for (primitive, mesh) in node.mesh().unwrap().primitives().zip(&model.meshes) {
            let reader = primitive.reader(|_| blob);
            let positions: Vec<_> =
                reader.read_positions().unwrap().map(|p| Point3::from(p).cast::<f64>()).collect();
            assert_eq!(mesh.positions, positions);
            let corners: Vec<usize> = match reader.read_indices() {
                Some(indices) => indices.into_u32().map(|i| i as usize).collect(),
                None => (0..positions.len()).collect(),
            };
            assert_eq!(mesh.triangles.concat(), corners);
            let weights = reader.read_weights(0).unwrap().into_f32();
            let joints = reader.read_joints(0).unwrap().into_u16();
            let influences = &mesh.skin.as_ref().unwrap().influences;
            for ((w, j), mine) in weights.zip(joints).zip(influences) {
                let sum: f32 = w.iter().sum();
                let theirs = w.iter().zip(j).filter(|(w, _)| **w > 0.0);
                for ((w, j), (joint, weight)) in theirs.zip(mine) {
                    assert_eq!(usize::from(j), *joint);
                    assert!((f64::from(w / sum) - weight).abs() < 1e-6);
                }
            }
        }

        for (animation, name) in oracle.animations().zip(file.animation_names()) {
            let mine = file.animation(&name).unwrap();
            for channel in animation.channels() {
                let reader = channel.reader(|_| blob);
                let node = channel.target().node().index();
                let times: Vec<f32> = reader.read_inputs().unwrap().collect();
                let pose = |i: usize| mine.sample(file.skeleton(), f64::from(times[i])).nodes[node];
                use gltf::animation::util::ReadOutputs;
                match reader.read_outputs().unwrap() {
                    ReadOutputs::Translations(ts) => ts.enumerate().for_each(|(i, t)| {
                        assert_eq!(pose(i).translation, Vector3::from(t).cast::<f64>());
                    }),
                    ReadOutputs::Scales(ss) => ss.enumerate().for_each(|(i, s)| {
                        assert_eq!(pose(i).scale, Vector3::from(s).cast::<f64>());
                    }),
                    ReadOutputs::Rotations(rs) => rs.into_f32().enumerate().for_each(|(i, r)| {
                        let [x, y, z, w] = r.map(f64::from);
                        let q = nalgebra::UnitQuaternion::new_normalize(nalgebra::Quaternion::new(
                            w, x, y, z,
                        ));
                        assert!(angle_between_rad(&pose(i).rotation, &q) < 1e-7);
                    }),
                    ReadOutputs::MorphTargetWeights(_) => {}
                }
            }
        }
    }
}
