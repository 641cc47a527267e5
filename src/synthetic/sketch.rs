//! Rough strokes over the horse, as a person would label footage: spine, neck and head, and the
//! legs, drawn by a hand that is not quite steady.

use nalgebra::Point3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::camera::Camera;
use super::horse::{FORE_LEFT, FORE_RIGHT, HIND_LEFT, HIND_RIGHT};
use crate::rig::{Model, Pose};

/// Deviation of the hand at each point, as a share of the picture's diagonal.
const JITTER: f64 = 0.006;

/// The strokes of one frame as polylines in pixels; `seed` and `frame` fix the hand's error.
#[must_use]
pub fn sketch_strokes(
    model: &Model,
    pose: &Pose,
    camera: &Camera,
    seed: u64,
    frame: usize,
) -> Vec<Vec<(f64, f64)>> {
    let world = model.skeleton.world_matrices(pose);
    let mut rng = ChaCha8Rng::seed_from_u64(seed ^ (frame as u64).wrapping_mul(0x9E37_79B9));
    let jitter = JITTER * (camera.width() as f64).hypot(camera.height() as f64);
    let mut point = |joint: usize, offset: [f64; 3]| {
        let seen = camera.project(&world[joint + 1].transform_point(&Point3::from(offset)));
        let mut hand = || jitter * rng.random_range(-1.7..1.7);
        (seen.x + hand(), seen.y + hand())
    };
    let none = [0.0; 3];
    let mut strokes = vec![
        vec![point(10, none), point(0, none), point(1, none), point(2, none), point(3, none)],
        vec![point(3, none), point(5, none), point(6, none), point(6, [0.0, -0.34, 0.38])],
        vec![point(10, none), point(12, none), point(13, [0.0, -0.3, 0.0])],
    ];
    for first in [FORE_LEFT, FORE_RIGHT] {
        strokes.push((0..6).map(|j| point(first + j, none)).collect());
    }
    for first in [HIND_LEFT, HIND_RIGHT] {
        strokes.push((0..5).map(|j| point(first + j, none)).collect());
    }
    strokes
}
