use std::path::Path;

use nalgebra::Point3;

use super::*;
use crate::rig::Pose;
use crate::synthetic::{Gait, NamedClip, horse, to_glb};

fn original(frames: usize) -> (File, Vec<Pose>) {
    let model = horse();
    let poses: Vec<Pose> = (0..frames)
        .map(|t| Gait::Walk.pose(&model.skeleton, t as f64 / frames as f64).pose)
        .collect();
    let clip = NamedClip { name: "walk", fps: 25.0, poses: &poses };
    let bytes = to_glb(&model, &[clip], "horse");
    (File::from_bytes(Path::new("horse.glb"), bytes).unwrap(), poses)
}

#[test]
fn the_copy_has_the_same_vertices_in_every_frame() {
    let (file, _) = original(7);
    let clip = file.animation("walk").unwrap().clip(file.skeleton(), 25.0).unwrap();
    let copied = rig_copy(&file, &clip, true).unwrap();
    let copy = File::from_bytes(Path::new("copy.glb"), copied).unwrap();
    let shown = copy.animation("walk").unwrap().clip(copy.skeleton(), 25.0).unwrap();
    let (model, drawn) = (file.model().unwrap(), copy.model().unwrap());
    assert_eq!(clip.poses.len(), shown.poses.len());
    for (pose, seen) in clip.poses.iter().zip(&shown.poses) {
        let (all, found) = (model.posed_vertices(pose), drawn.posed_vertices(seen));
        let all: Vec<&Point3<f64>> = all.iter().flatten().collect();
        let found: Vec<&Point3<f64>> = found.iter().flatten().collect();
        assert_eq!(all.len(), found.len());
        for (a, b) in all.iter().zip(&found) {
            assert!((*a - *b).norm() < 2e-4, "{a} {b}");
        }
    }
}

#[test]
fn of_many_influences_the_four_largest_stay_and_sum_to_one() {
    let influences = vec![vec![(3, 0.1), (1, 0.3), (9, 0.05), (2, 0.35), (4, 0.2)], vec![(7, 1.0)]];
    let (joints, shares) = four_largest(&SkinWeights { skin: 0, influences });
    assert_eq!(joints, [[2, 1, 4, 3], [7, 0, 0, 0]]);
    let expected = [0.35 / 0.95, 0.3 / 0.95, 0.2 / 0.95, 0.1 / 0.95];
    assert!(shares[0].iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12));
    assert_eq!(shares[1], [1.0, 0.0, 0.0, 0.0]);
}

#[test]
fn coded_numbers_read_back_within_their_grid() {
    let mut glb = Glb::default();
    let weights = [[0.5, 0.25, 0.125, 0.125], [1.0, 0.0, 0.0, 0.0]];
    let normals = [[0.6, -0.8, 0.0], [0.0, 0.0, -1.0]];
    let made = [glb.weights(&weights), glb.normals(&normals), glb.joints(&[[300, 2, 1, 0]])];
    assert_eq!(made, [0, 1, 2]);
    let bytes = glb.finish(json!({"asset": {"version": "2.0"}})).unwrap();
    let document = gltf::Gltf::from_slice(&bytes).unwrap();
    let of = |i: usize| document.accessors().nth(i).unwrap();
    assert!(of(0).normalized() && of(1).normalized() && !of(2).normalized());
    let stride = |i: usize| of(i).view().unwrap().stride();
    assert_eq!([stride(0), stride(1), stride(2)], [Some(8), Some(4), Some(8)]);
    let bin = document.blob.as_deref().unwrap();
    let word = |i: usize| u16::from_le_bytes([bin[2 * i], bin[2 * i + 1]]);
    let sum = |row: usize| (0..4).map(|i| u32::from(word(4 * row + i))).sum::<u32>();
    assert_eq!([sum(0), sum(1)], [65535, 65535]);
    assert_eq!(bin[16..20], [76, -102_i8 as u8, 0, 0]);
}
