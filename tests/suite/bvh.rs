//! BVH moves the joints to the same places as the rig's own skeleton, by a reader of its own.

use muybridge::export::{BvhSettings, bvh};
use muybridge::rig::{Clip, File};
use nalgebra::{Matrix4, Rotation3, Vector3};

use crate::export::{FPS, bent, open, walked};
use crate::gltf_fixture::{Fixture, real_rigs};

struct Bone {
    name: String,
    parent: Option<usize>,
    offset: Vector3<f64>,
    channels: Vec<String>,
    end_site: bool,
}

struct Bvh {
    bones: Vec<Bone>,
    frame_time: f64,
    frames: Vec<Vec<f64>>,
}

/// A reader of the plain form and nothing else.
fn read_bvh(text: &str) -> Bvh {
    let mut words = text.split_whitespace();
    let mut bones: Vec<Bone> = Vec::new();
    let mut open: Vec<Option<usize>> = Vec::new();
    let mut pending = None;
    assert_eq!(words.next(), Some("HIERARCHY"));
    let mut number = 0;
    loop {
        match words.next().unwrap() {
            kind @ ("ROOT" | "JOINT") => {
                assert_eq!(kind == "ROOT", bones.is_empty());
                let parent = open.last().copied().flatten();
                let name = words.next().unwrap().to_owned();
                bones.push(Bone {
                    name,
                    parent,
                    offset: Vector3::zeros(),
                    channels: Vec::new(),
                    end_site: false,
                });
                pending = Some(bones.len() - 1);
            }
            "End" => {
                assert_eq!(words.next(), Some("Site"));
                bones[open.last().unwrap().unwrap()].end_site = true;
                pending = None;
            }
            "{" => open.push(pending),
            "}" => drop(open.pop().unwrap()),
            "OFFSET" => {
                let v = Vector3::from_fn(|_, _| words.next().unwrap().parse().unwrap());
                match open.last().unwrap() {
                    Some(bone) => bones[*bone].offset = v,
                    None => assert!(v.norm() > 0.0, "a visible end site"),
                }
            }
            "CHANNELS" => {
                let count: usize = words.next().unwrap().parse().unwrap();
                number += count;
                bones[open.last().unwrap().unwrap()].channels =
                    (0..count).map(|_| words.next().unwrap().to_owned()).collect();
            }
            "MOTION" => break,
            other => panic!("{other}"),
        }
    }
    assert!(open.is_empty());
    let rest: Vec<&str> = words.collect();
    assert_eq!((rest[0], rest[2], rest[3]), ("Frames:", "Frame", "Time:"));
    let values: Vec<f64> = rest[5..].iter().map(|w| w.parse().unwrap()).collect();
    let frames: Vec<Vec<f64>> = values.chunks(number).map(<[f64]>::to_vec).collect();
    assert_eq!(frames.len(), rest[1].parse::<usize>().unwrap());
    Bvh { bones, frame_time: rest[4].parse().unwrap(), frames }
}

/// Positions of all bones in a frame: channels in the order they are declared.
fn positions(bvh: &Bvh, frame: &[f64]) -> Vec<Vector3<f64>> {
    let mut values = frame.iter();
    let mut world: Vec<Matrix4<f64>> = Vec::new();
    for bone in &bvh.bones {
        let mut at = bone.offset;
        let mut turn = Matrix4::identity();
        for channel in &bone.channels {
            let value = *values.next().unwrap();
            let (axis, kind) = channel.split_at(1);
            let i = "XYZ".find(axis).unwrap();
            if kind == "position" {
                at[i] = value;
            } else {
                let unit = Vector3::ith_axis(i);
                turn *= Rotation3::from_axis_angle(&unit, value.to_radians()).to_homogeneous();
            }
        }
        let local = Matrix4::new_translation(&at) * turn;
        world.push(bone.parent.map_or(local, |p| world[p] * local));
    }
    world.iter().map(|m| m.fixed_view::<3, 1>(0, 3).into_owned()).collect()
}

fn assert_bvh_follows(file: &File, clip: &Clip, units: f64) -> Bvh {
    let joints = file.joints().unwrap();
    let text = bvh(file.skeleton(), &joints, clip, &BvhSettings { units }).unwrap();
    let read = read_bvh(&text);
    assert_eq!(read.frames.len(), clip.poses.len());
    assert!((read.frame_time - 1.0 / clip.fps).abs() < 1e-9);
    let safe = |name: &str| name.replace([' ', ':', '|'], "_");
    for (frame, pose) in read.frames.iter().zip(&clip.poses) {
        let world = file.skeleton().world_matrices(pose);
        let found = positions(&read, frame);
        for &joint in &joints {
            let name = safe(&file.skeleton().nodes[joint].name);
            let bone = read.bones.iter().position(|b| b.name == name).unwrap();
            let expected = world[joint].fixed_view::<3, 1>(0, 3) * units;
            let error = (found[bone] - expected).norm();
            assert!(error < 1e-4, "{name}: {error}");
        }
    }
    for (i, bone) in read.bones.iter().enumerate() {
        let leaf = !read.bones.iter().any(|b| b.parent == Some(i));
        assert_eq!(bone.end_site, leaf, "{}", bone.name);
    }
    read
}

#[test]
fn bvh_joints_are_where_the_rig_s_are() {
    for path in real_rigs() {
        let file = File::read(&path).unwrap();
        let name = file.animation_names().into_iter().find(|n| n.contains("Walk")).unwrap();
        let (_, clip) = walked(&file, &name, "shot");
        assert_bvh_follows(&file, &clip, 1.0);
    }
}

#[test]
fn bvh_has_three_channels_until_a_bone_moves_off_its_parent() {
    let file = open(Fixture::two_bones().glb());
    let whole = |name: &str| file.animation(name).unwrap().clip(file.skeleton(), FPS).unwrap();
    let bend = assert_bvh_follows(&file, &whole("Bend"), 100.0);
    let counts = |b: &Bvh| b.bones.iter().map(|b| b.channels.len()).collect::<Vec<_>>();
    assert_eq!(counts(&bend), [6, 3, 3]);
    assert_eq!(bend.bones[2].offset, Vector3::new(0.0, 200.0, 0.0), "armature scale and units");
    let hop = assert_bvh_follows(&file, &whole("Hop"), 1.0);
    assert_eq!(counts(&hop), [6, 6, 6]);
}

#[test]
fn bvh_joins_several_roots_under_one() {
    let file = open(Fixture::two_bones().glb());
    let text = bvh(file.skeleton(), &[], &bent(&file), &BvhSettings::default()).unwrap();
    let names: Vec<String> = read_bvh(&text).bones.into_iter().map(|b| b.name).collect();
    assert_eq!(names, ["root", "Rig", "hip", "tip", "Skin"]);
}
