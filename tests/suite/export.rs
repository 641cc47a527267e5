//! The artist's file comes back with one more animation and no other change.

#![allow(clippy::print_stderr, reason = "a skipped test says so")]

use std::path::{Path, PathBuf};
use std::process::Command;

use muybridge::Error;
use muybridge::export::{AppendedGltf, BvhSettings, append_animation, bvh};
use muybridge::interpolate::{blend, largest_step};
use muybridge::rig::{
    Clip, Driven, File, KeyPoses, Moment, NodePose, Pose, PoseSpec, angle_between_rad,
};
use nalgebra::{UnitQuaternion, Vector3};
use serde_json::{Value, json};

use crate::gltf_fixture::{Fixture, glb, real_rigs};

pub(crate) const FPS: f64 = 25.0;
/// Frames from one key to the next in [`walked`].
const STRIDE: usize = 10;

pub(crate) fn open(bytes: Vec<u8>) -> File {
    File::from_bytes(Path::new("test.glb"), bytes).unwrap()
}

/// Four poses of a clip of the file and a clip that passes through them: the weights are the
/// periodic triangle, so frames 0, 10, 20, 30 and 40 are key poses.
pub(crate) fn walked(file: &File, clip: &str, name: &str) -> (KeyPoses, Clip) {
    let duration = file.animation(clip).unwrap().duration_s();
    let specs: Vec<PoseSpec> = (0..4)
        .map(|i| PoseSpec {
            key: i + 1,
            clip: clip.to_owned(),
            at: Moment::Time(duration * i as f64 / 4.0),
        })
        .collect();
    let keys = KeyPoses::read(file, &specs, FPS).unwrap();
    let weights: Vec<f64> = (0..=4 * STRIDE)
        .flat_map(|frame| {
            (0..4).map(move |key| {
                let phase = (frame + 4 * STRIDE - key * STRIDE) % (4 * STRIDE);
                let distance = phase.min(4 * STRIDE - phase) as f64 / STRIDE as f64;
                (1.0 - distance).max(0.0)
            })
        })
        .collect();
    let clip = blend(name, FPS, file.skeleton(), &keys, &weights).unwrap();
    (keys, clip)
}

/// The fixture's clip that bends and hops.
pub(crate) fn bent(file: &File) -> Clip {
    let specs = ["1=Bend@0", "2=Bend@1", "3=Up"].map(|s| s.parse().unwrap());
    let keys = KeyPoses::read(file, &specs, FPS).unwrap();
    let weights: Vec<f64> = (0..30)
        .flat_map(|i| {
            let u = f64::from(i) / 29.0;
            [1.0 - u, u * 1.5, -u]
        })
        .collect();
    blend("shot", FPS, file.skeleton(), &keys, &weights).unwrap()
}

/// JSON text and chunk of a GLB, taken apart by the book.
fn parts(bytes: &[u8]) -> (Vec<u8>, Vec<u8>) {
    let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    assert_eq!(word(8), bytes.len());
    let json_end = 20 + word(12);
    let bin = if json_end < bytes.len() {
        bytes[json_end + 8..json_end + 8 + word(json_end)].to_vec()
    } else {
        Vec::new()
    };
    (bytes[20..json_end].to_vec(), bin)
}

/// Asserts that `new` is `old` with at most `most` insertions, and returns these.
fn insertions(old: &str, new: &str, most: usize) -> Vec<String> {
    let (old, new) = (old.as_bytes(), new.as_bytes());
    let (mut i, mut j) = (0, 0);
    let mut found = Vec::new();
    loop {
        while i < old.len() && j < new.len() && old[i] == new[j] {
            i += 1;
            j += 1;
        }
        if i == old.len() && j == new.len() {
            return found;
        }
        // Everything common to insertion and rest was matched too early: step back to the end of
        // the last value, where insertions begin.
        let back = old[..i].iter().rev().take_while(|b| !matches!(b, b'}' | b']')).count();
        (i, j) = (i - back, j - back);
        let ahead = &old[i..(i + 80).min(old.len())];
        let skip = new[j + 1..]
            .windows(ahead.len().max(1))
            .position(|w| w == ahead)
            .unwrap_or_else(|| panic!("changed: {:?}", String::from_utf8_lossy(ahead)));
        found.push(String::from_utf8(new[j..j + 1 + skip].to_vec()).unwrap());
        j += 1 + skip;
        assert!(found.len() <= most, "{found:?}");
    }
}

/// The appended GLB differs from the original by the additions only.
fn assert_only_added(original: &[u8], made: &AppendedGltf) {
    let (old_json, old_bin) = parts(original);
    let (new_json, new_bin) = parts(&made.bytes);
    assert!(new_bin.starts_with(&old_bin) && new_bin.len() > old_bin.len());
    let old = String::from_utf8(old_json).unwrap();
    let new = String::from_utf8(new_json).unwrap();
    let length = |text: &str| -> String {
        let v: Value = serde_json::from_str(text).unwrap();
        v["buffers"][0]["byteLength"].to_string()
    };
    let (from, to) = (length(&old), length(&new));
    assert_eq!(old.matches(&from).count(), 1, "the length is recognisable");
    assert_eq!(to, new_bin.len().to_string());
    insertions(old.trim_end().replacen(&from, &to, 1).as_str(), new.trim_end(), 3);
}

fn assert_reads_back(made: &AppendedGltf, clip: &Clip, path: &Path) {
    let file = File::from_bytes(path, made.bytes.clone()).unwrap();
    let animation = file.animation(&made.animation).unwrap();
    let duration = ((clip.poses.len() - 1) as f64 / clip.fps) as f32;
    assert_eq!(animation.duration_s(), f64::from(duration));
    for (i, pose) in clip.poses.iter().enumerate() {
        let read = animation.sample(file.skeleton(), i as f64 / clip.fps);
        for (a, b) in read.nodes.iter().zip(&pose.nodes) {
            let degrees = angle_between_rad(&a.rotation, &b.rotation).to_degrees();
            assert!(degrees < 1e-4, "{degrees}");
            assert!((a.translation - b.translation).norm() <= 1e-6 * b.translation.norm().max(1.0));
            assert!((a.scale - b.scale).norm() <= 1e-6 * b.scale.norm().max(1.0));
        }
    }
    let driven = animation.driven(file.skeleton());
    for (read, clip) in driven.iter().zip(&clip.driven) {
        assert!(clip.translation || !read.translation);
        assert!(clip.rotation || !read.rotation);
        assert!(clip.scale || !read.scale);
    }
}

#[test]
fn real_rigs_come_back_with_one_more_animation_and_nothing_else() {
    for path in real_rigs() {
        let file = File::read(&path).unwrap();
        let source = if path.ends_with("khronos_fox.glb") { "Run" } else { "Walk" };
        let source =
            if path.ends_with("quaternius_triceratops.glb") { "Triceratops_Walk" } else { source };
        let (keys, clip) = walked(&file, source, "from footage");
        let made = append_animation(&file, &clip).unwrap();
        assert_eq!((made.animation.as_str(), made.extension), ("from footage", "glb"));
        assert_only_added(file.bytes(), &made);
        assert_reads_back(&made, &clip, &path);
        assert_eq!(append_animation(&file, &clip).unwrap(), made, "same bytes every time");
        assert!(largest_step(&clip).angle_deg < 30.0);

        let again = File::from_bytes(&path, made.bytes).unwrap();
        let animation = again.animation("from footage").unwrap();
        let mut worst: f64 = 0.0;
        for (k, key) in keys.poses.iter().enumerate() {
            let read = animation.sample(again.skeleton(), (k * STRIDE) as f64 / FPS);
            for (a, b) in read.nodes.iter().zip(&key.nodes) {
                worst = worst.max(angle_between_rad(&a.rotation, &b.rotation).to_degrees());
            }
        }
        assert!(worst < 1e-4, "{}: {worst}°", path.display());
    }
}

#[test]
fn no_track_is_constant_and_no_quaternion_changes_sides() {
    for path in real_rigs() {
        let file = File::read(&path).unwrap();
        let name = file.animation_names().into_iter().find(|n| n.contains("Walk")).unwrap();
        let (_, clip) = walked(&file, &name, "shot");
        let made = append_animation(&file, &clip).unwrap();
        let oracle = gltf::Gltf::from_slice_without_validation(&made.bytes).unwrap();
        let animation = oracle.animations().last().unwrap();
        let mut inputs: Vec<usize> = Vec::new();
        for channel in animation.channels() {
            inputs.push(channel.sampler().input().index());
            let reader = channel.reader(|_| oracle.blob.as_deref());
            let times: Vec<f32> = reader.read_inputs().unwrap().collect();
            use gltf::animation::util::ReadOutputs;
            let values: Vec<Vec<f32>> = match reader.read_outputs().unwrap() {
                ReadOutputs::Translations(v) | ReadOutputs::Scales(v) => {
                    v.map(|x| x.to_vec()).collect()
                }
                ReadOutputs::Rotations(v) => v.into_f32().map(|x| x.to_vec()).collect(),
                ReadOutputs::MorphTargetWeights(_) => panic!("no morph targets"),
            };
            if times.len() == 2 {
                assert_eq!((times[0], times[1]), (0.0, (40.0 / FPS) as f32));
                assert_eq!(values[0], values[1]);
                continue;
            }
            let grid: Vec<f32> = (0..=40).map(|i| (f64::from(i) / FPS) as f32).collect();
            assert_eq!(times, grid);
            assert!(values.iter().any(|v| v != &values[0]));
            if values[0].len() == 4 {
                for pair in values.windows(2) {
                    let dot: f32 = pair[0].iter().zip(&pair[1]).map(|(a, b)| a * b).sum();
                    assert!(dot > 0.0);
                }
            }
        }
        inputs.sort_unstable();
        inputs.dedup();
        assert!(inputs.len() <= 2, "inputs are shared");
    }
}

#[test]
fn pretty_text_keeps_its_spelling_and_gets_a_buffer_of_its_own() {
    let fixture = Fixture::two_bones();
    let mut text = String::from_utf8(fixture.text(&fixture.data_uri())).unwrap();
    // Spellings that a parser and writer would lose.
    text = text.replacen("1000.0", "1.000e+03", 1).replacen("\"tip\"", "\"t\\u0069p\"", 1);
    assert!(text.contains("1.000e+03") && text.contains("t\\u0069p"));
    let file = open(text.clone().into_bytes());
    let clip = bent(&file);
    let made = append_animation(&file, &clip).unwrap();
    assert_eq!(made.extension, "gltf");
    let added = insertions(&text, std::str::from_utf8(&made.bytes).unwrap(), 4);
    assert_eq!(added.len(), 4);
    assert!(added.iter().all(|a| a.starts_with(",\n    {")), "{added:?}");
    assert_reads_back(&made, &clip, Path::new("test.gltf"));
}

#[test]
fn external_buffers_stay_as_they_are() {
    let fixture = Fixture::two_bones();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("rig.gltf");
    std::fs::write(&path, fixture.text("rig.bin")).unwrap();
    std::fs::write(folder.path().join("rig.bin"), &fixture.bin).unwrap();
    let file = File::read(&path).unwrap();
    let clip = bent(&file);
    let made = append_animation(&file, &clip).unwrap();
    assert_eq!(made.referenced_files, [PathBuf::from("rig.bin")]);
    assert_reads_back(&made, &clip, &path);
    let text = std::str::from_utf8(&made.bytes).unwrap();
    insertions(std::str::from_utf8(file.bytes()).unwrap(), text, 4);

    // A GLB whose first buffer is a file: its binary chunk is not that buffer.
    let bytes = glb(&fixture.text("rig.bin"), Some(&vec![1, 2, 3, 4]));
    let file = File::from_bytes(&path, bytes).unwrap();
    let made = append_animation(&file, &clip).unwrap();
    assert_eq!(parts(&made.bytes).1, [1, 2, 3, 4]);
    assert_reads_back(&made, &clip, &path);
}

#[test]
fn files_without_arrays_or_chunk_get_them() {
    for (json, bin) in [
        (r#"{"asset":{"version":"2.0"},"nodes":[{"name":"a"}]}"#, None),
        (r#"{"nodes":[{}],"asset":{"version":"2.0"},"animations":[],"buffers":[ ]}"#, None),
        (
            r#"{"nodes":[{}],"asset":{"version":"2.0"},"buffers":[{"byteLength":3}]}"#,
            Some(vec![7; 3]),
        ),
        (r#"{"nodes":[{}],"asset":{"version":"2.0"},"buffers":[{"byteLength":3}]}"#, None),
    ] {
        let pose = |degrees: f64| Pose {
            nodes: vec![NodePose {
                rotation: UnitQuaternion::from_euler_angles(0.0, degrees.to_radians(), 0.0),
                ..NodePose::IDENTITY
            }],
        };
        let clip = Clip {
            name: "turn \"left\"".to_owned(),
            fps: 24.0,
            poses: vec![pose(0.0), pose(10.0), pose(20.0)],
            driven: vec![Driven { rotation: true, ..Driven::default() }],
        };
        let file = open(glb(json.as_bytes(), bin.as_ref()));
        let made = append_animation(&file, &clip).unwrap();
        assert_eq!(made.animation, clip.name);
        assert_reads_back(&made, &clip, Path::new("test.glb"));
        let new: Value = serde_json::from_slice(&parts(&made.bytes).0).unwrap();
        assert_eq!(new["nodes"], serde_json::from_str::<Value>(json).unwrap()["nodes"]);
        // As text, a binary chunk has nowhere to be.
        if bin.is_none() {
            let file = open(json.as_bytes().to_vec());
            let made = append_animation(&file, &clip).unwrap();
            assert_reads_back(&made, &clip, Path::new("test.gltf"));
        }
    }
}

#[test]
fn chunks_of_unknown_types_follow_unchanged() {
    let mut bytes = Fixture::two_bones().glb();
    bytes.extend([4, 0, 0, 0, b'S', b'H', b'O', b'T', 9, 8, 7, 6]);
    let length = bytes.len() as u32;
    bytes[8..12].copy_from_slice(&length.to_le_bytes());
    let file = open(bytes.clone());
    let made = append_animation(&file, &bent(&file)).unwrap();
    assert_eq!(made.bytes[made.bytes.len() - 12..], bytes[bytes.len() - 12..]);
    assert_only_added(&bytes, &made);
}

#[test]
fn what_cannot_be_written_is_refused() {
    let mut fixture = Fixture::two_bones();
    let file = open(fixture.glb());
    let clip = bent(&file);
    let nothing = Clip { driven: vec![Driven::default(); 4], ..clip.clone() };
    assert!(matches!(append_animation(&file, &nothing), Err(Error::NothingDriven { .. })));
    fixture.json["nodes"][0] =
        json!({ "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1] });
    let file = open(fixture.glb());
    assert!(matches!(append_animation(&file, &clip), Err(Error::MatrixNodeDriven { .. })));
    let empty = Clip { poses: Vec::new(), ..clip };
    assert!(matches!(append_animation(&file, &empty), Err(Error::NothingDriven { .. })));
    let bvh = bvh(file.skeleton(), &[], &empty, &BvhSettings::default());
    assert!(matches!(bvh, Err(Error::NothingDriven { .. })));
}

#[test]
fn a_taken_name_gets_a_number() {
    let file = open(Fixture::two_bones().glb());
    let clip = Clip { name: "Up".to_owned(), ..bent(&file) };
    let made = append_animation(&file, &clip).unwrap();
    assert_eq!(made.animation, "Up.001");
    assert_reads_back(&made, &clip, Path::new("test.glb"));
}

// ---- the Khronos validator -----------------------------------------------------------------------

/// Errors and warnings of the validator for each file, or nothing where its package is not installed.
fn validated(files: &[PathBuf]) -> Option<Vec<Vec<String>>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/validator");
    if !folder.join("node_modules/gltf-validator").is_dir() {
        let required = std::env::var_os("MUYBRIDGE_REQUIRE_TOOLS").is_some_and(|v| v == "1");
        assert!(!required, "gltf-validator is missing: run npm ci in {}", folder.display());
        eprintln!("skipped: run npm ci in {} for the glTF validator", folder.display());
        return None;
    }
    let run = Command::new("node").arg(folder.join("validate.mjs")).args(files).output().unwrap();
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let reports: Vec<Value> = serde_json::from_slice(&run.stdout).unwrap();
    let text = |v: &Value| v.as_str().unwrap().to_owned();
    Some(
        reports
            .iter()
            .map(|r| r["problems"].as_array().unwrap().iter().map(text).collect())
            .collect(),
    )
}

#[test]
fn the_khronos_validator_finds_nothing_that_was_not_in_the_original() {
    let folder = tempfile::tempdir().unwrap();
    let put = |name: String, bytes: &[u8]| -> PathBuf {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        path
    };
    let mut made = Vec::new();
    let mut originals = Vec::new();
    for path in real_rigs() {
        let file = File::read(&path).unwrap();
        let name = file.animation_names().into_iter().find(|n| n.contains("Walk")).unwrap();
        let (_, clip) = walked(&file, &name, "shot");
        let stem = path.file_stem().unwrap().to_str().unwrap();
        made.push(put(format!("{stem}.glb"), &append_animation(&file, &clip).unwrap().bytes));
        originals.push(path);
    }
    let fixture = Fixture::two_bones();
    put("rig.bin".to_owned(), &fixture.bin);
    for (name, bytes) in [
        ("chunk.glb", fixture.glb()),
        ("inline.gltf", fixture.text(&fixture.data_uri())),
        ("external.gltf", fixture.text("rig.bin")),
        ("empty.glb", glb(br#"{"asset":{"version":"2.0"},"nodes":[{}]}"#, None)),
    ] {
        let original = put(format!("original_{name}"), &bytes);
        let file = File::read(&original).unwrap();
        let mut clip = if name == "empty.glb" { sliding() } else { bent(&file) };
        for frames in [clip.poses.len(), 1] {
            clip.poses.truncate(frames);
            let bytes = append_animation(&file, &clip).unwrap().bytes;
            made.push(put(format!("{frames}_{name}"), &bytes));
            originals.push(original.clone());
        }
    }
    let (Some(after), Some(before)) = (validated(&made), validated(&originals)) else { return };
    for (file, (after, before)) in made.iter().zip(after.iter().zip(&before)) {
        assert_eq!(after, before, "{}", file.display());
    }
    // The validator does look: a file with a wrong bound is not clean.
    let mut wrong = Fixture::two_bones();
    wrong.json["accessors"][0]["max"][0] = json!(9.0);
    let found = validated(&[put("wrong.glb".to_owned(), &wrong.glb())]).unwrap();
    assert!(found[0].iter().any(|p| p.starts_with("ACCESSOR_MAX_MISMATCH")), "{found:?}");
}

/// A clip of one node.
fn sliding() -> Clip {
    let at = |x: f64| NodePose { translation: Vector3::new(x, 0.0, 0.0), ..NodePose::IDENTITY };
    Clip {
        name: "slide".to_owned(),
        fps: 30.0,
        poses: (0..5).map(|i| Pose { nodes: vec![at(f64::from(i))] }).collect(),
        driven: vec![Driven { translation: true, rotation: true, scale: true }],
    }
}
