//! A skeleton horse of ellipsoids with 36 in-plane joint angles.
//!
//! It faces +Z, Y is up, its left is +X, the unit is the metre, the ground is y = 0. Proportions are
//! those of a riding horse of 1.60 m at the withers, read off anatomical side views and rounded to the
//! centimetre; they were not fitted to one animal. An in-plane angle is a rotation about the
//! node's X axis relative to the rest pose: positive turns what hangs down backwards and what
//! points forwards downwards.

use nalgebra::{Point3, Rotation3, Unit, Vector3};

use crate::rig::{Mesh, Model, Node, NodePose, Skeleton};

/// Number of in-plane joint angles, as in the seed.
pub const IN_PLANE_ANGLES: usize = 36;

/// Names of the joints, in the order of the angles; a joint's node has the same name and index
/// one higher (node 0 carries the animal's translation).
pub const IN_PLANE_JOINTS: [&str; IN_PLANE_ANGLES] = [
    "pelvis",
    "lumbar",
    "thorax",
    "neck_1",
    "neck_2",
    "neck_3",
    "head",
    "jaw",
    "ear_left",
    "ear_right",
    "tail_1",
    "tail_2",
    "tail_3",
    "tail_4",
    "scapula_left",
    "shoulder_left",
    "elbow_left",
    "carpus_left",
    "fetlock_fore_left",
    "coffin_fore_left",
    "scapula_right",
    "shoulder_right",
    "elbow_right",
    "carpus_right",
    "fetlock_fore_right",
    "coffin_fore_right",
    "hip_left",
    "stifle_left",
    "tarsus_left",
    "fetlock_hind_left",
    "coffin_hind_left",
    "hip_right",
    "stifle_right",
    "tarsus_right",
    "fetlock_hind_right",
    "coffin_hind_right",
];

/// Index of the first angle of each leg's chain.
pub(super) const FORE_LEFT: usize = 14;
pub(super) const FORE_RIGHT: usize = 20;
pub(super) const HIND_LEFT: usize = 26;
pub(super) const HIND_RIGHT: usize = 31;

/// Half the distance of the left and right legs, metres.
const FORE_HALF_WIDTH: f64 = 0.13;
const HIND_HALF_WIDTH: f64 = 0.15;

/// Where a joint is in the rest pose, seen from the side: (z, y) in metres, and its parent's
/// index among the joints.
struct Joint {
    at: (f64, f64),
    parent: Option<usize>,
}

/// An ellipsoid on a joint: from `from` to `to` in the rest pose (z, y), with its half thickness in
/// the sagittal plane and half width across it.
struct Body {
    joint: usize,
    from: (f64, f64),
    to: (f64, f64),
    thick: f64,
    wide: f64,
}

fn joints() -> Vec<Joint> {
    let j = |z: f64, y: f64, parent: usize| Joint { at: (z, y), parent: Some(parent) };
    let mut all = vec![
        Joint { at: (-0.42, 1.30), parent: None }, // pelvis
        j(-0.18, 1.34, 0),                         // lumbar
        j(0.12, 1.32, 1),                          // thorax
        j(0.58, 1.30, 2),                          // neck_1
        j(0.76, 1.48, 3),                          // neck_2
        j(0.90, 1.66, 4),                          // neck_3
        j(1.00, 1.84, 5),                          // head
        j(1.06, 1.70, 6),                          // jaw
        j(0.99, 1.90, 6),                          // ear_left
        j(0.99, 1.90, 6),                          // ear_right
        j(-0.76, 1.38, 0),                         // tail_1
        j(-0.88, 1.26, 10),
        j(-0.93, 1.06, 11),
        j(-0.95, 0.86, 12),
    ];
    for _side in 0..2 {
        let first = all.len();
        all.push(j(0.36, 1.46, 2)); // scapula
        for (z, y) in [(0.58, 1.04), (0.42, 0.86), (0.45, 0.47), (0.45, 0.20), (0.52, 0.09)] {
            all.push(j(z, y, all.len() - 1));
        }
        debug_assert!(first == FORE_LEFT || first == FORE_RIGHT);
    }
    for _side in 0..2 {
        all.push(j(-0.50, 1.16, 0)); // hip
        for (z, y) in [(-0.30, 0.88), (-0.62, 0.57), (-0.60, 0.21), (-0.53, 0.09)] {
            all.push(j(z, y, all.len() - 1));
        }
    }
    all
}

/// The tip of the hoof in the rest pose, (z, y), fore and hind.
const FORE_TOE: (f64, f64) = (0.59, 0.0);
const HIND_TOE: (f64, f64) = (-0.46, 0.0);

fn bodies() -> Vec<Body> {
    let b = |joint, from, to, thick, wide| Body { joint, from, to, thick, wide };
    let mut all = vec![
        b(0, (-0.82, 1.20), (-0.14, 1.18), 0.29, 0.25),
        b(1, (-0.46, 1.14), (0.22, 1.10), 0.27, 0.27),
        b(2, (-0.24, 1.12), (0.72, 1.14), 0.32, 0.27),
        b(2, (0.10, 1.42), (0.58, 1.44), 0.13, 0.10),
        b(3, (0.44, 1.22), (0.86, 1.58), 0.20, 0.13),
        b(4, (0.68, 1.42), (0.98, 1.72), 0.155, 0.10),
        b(5, (0.84, 1.60), (1.06, 1.90), 0.12, 0.08),
        b(6, (0.94, 1.88), (1.44, 1.46), 0.105, 0.09),
        b(6, (0.96, 1.84), (1.20, 1.60), 0.14, 0.09),
        b(7, (1.08, 1.66), (1.36, 1.42), 0.05, 0.05),
        b(8, (0.97, 1.88), (1.00, 2.06), 0.03, 0.02),
        b(9, (0.97, 1.88), (1.00, 2.06), 0.03, 0.02),
        b(10, (-0.72, 1.40), (-0.91, 1.22), 0.055, 0.05),
        b(11, (-0.87, 1.30), (-0.95, 1.02), 0.065, 0.06),
        b(12, (-0.92, 1.12), (-0.97, 0.80), 0.07, 0.06),
        b(13, (-0.94, 0.92), (-0.97, 0.52), 0.055, 0.05),
    ];
    for first in [FORE_LEFT, FORE_RIGHT] {
        all.push(b(first, (0.30, 1.52), (0.62, 0.98), 0.15, 0.07));
        all.push(b(first + 1, (0.64, 1.08), (0.36, 0.80), 0.115, 0.07));
        all.push(b(first + 2, (0.41, 0.92), (0.455, 0.43), 0.072, 0.055));
        all.push(b(first + 3, (0.45, 0.51), (0.45, 0.16), 0.042, 0.035));
        all.push(b(first + 4, (0.44, 0.22), (0.54, 0.06), 0.04, 0.035));
        all.push(b(first + 5, (0.46, 0.055), (0.61, 0.025), 0.05, 0.06));
    }
    for first in [HIND_LEFT, HIND_RIGHT] {
        all.push(b(first, (-0.56, 1.26), (-0.26, 0.80), 0.19, 0.09));
        all.push(b(first + 1, (-0.26, 0.94), (-0.66, 0.54), 0.098, 0.065));
        all.push(b(first + 2, (-0.63, 0.62), (-0.60, 0.17), 0.048, 0.04));
        all.push(b(first + 3, (-0.61, 0.23), (-0.51, 0.06), 0.042, 0.037));
        all.push(b(first + 4, (-0.59, 0.055), (-0.44, 0.025), 0.05, 0.06));
    }
    all
}

/// Sideways position of a joint.
fn lateral(joint: usize) -> f64 {
    match joint {
        8 => 0.06,
        9 => -0.06,
        FORE_LEFT..FORE_RIGHT => FORE_HALF_WIDTH,
        FORE_RIGHT..HIND_LEFT => -FORE_HALF_WIDTH,
        HIND_LEFT..HIND_RIGHT => HIND_HALF_WIDTH,
        HIND_RIGHT..IN_PLANE_ANGLES => -HIND_HALF_WIDTH,
        _ => 0.0,
    }
}

/// The horse: node 0 is the animal as a whole, nodes 1 to 36 its joints, each with a rigid mesh.
#[must_use]
pub fn horse() -> Model {
    let joints = joints();
    let mut nodes = vec![Node { name: "horse".to_owned(), parent: None, rest: NodePose::IDENTITY }];
    let place = |j: usize| Vector3::new(lateral(j), joints[j].at.1, joints[j].at.0);
    for (j, joint) in joints.iter().enumerate() {
        let origin = joint.parent.map_or_else(Vector3::zeros, place);
        nodes.push(Node {
            name: IN_PLANE_JOINTS[j].to_owned(),
            parent: Some(joint.parent.map_or(0, |p| p + 1)),
            rest: NodePose { translation: place(j) - origin, ..NodePose::IDENTITY },
        });
    }
    let meshes = bodies().iter().map(|body| ellipsoid(body, place(body.joint))).collect();
    Model { skeleton: Skeleton { nodes }, meshes, skins: Vec::new() }
}

/// The chain of a leg in the rest pose, seen from the side: joints from the top and the toe last,
/// as (z, y).
pub(super) fn leg_chain(first: usize) -> Vec<(f64, f64)> {
    let joints = joints();
    let (count, toe) = if first < HIND_LEFT { (6, FORE_TOE) } else { (5, HIND_TOE) };
    let mut chain: Vec<(f64, f64)> = joints[first..first + count].iter().map(|j| j.at).collect();
    chain.push(toe);
    chain
}

/// Rest position (z, y) of a joint and the indices of its ancestors, nearest first.
pub(super) fn rest_place(joint: usize) -> ((f64, f64), Vec<usize>) {
    let joints = joints();
    let mut ancestors = Vec::new();
    let mut at = joints[joint].parent;
    while let Some(parent) = at {
        ancestors.push(parent);
        at = joints[parent].parent;
    }
    (joints[joint].at, ancestors)
}

/// An ellipsoid of 12 × 8 faces in the space of its joint.
fn ellipsoid(body: &Body, joint_at: Vector3<f64>) -> Mesh {
    const AROUND: usize = 12;
    const RINGS: usize = 8;
    let side = joint_at.x;
    let from = Vector3::new(side, body.from.1, body.from.0) - joint_at;
    let to = Vector3::new(side, body.to.1, body.to.0) - joint_at;
    let (middle, axis) = ((from + to) / 2.0, to - from);
    let turn = Rotation3::rotation_between(&Vector3::y(), &axis)
        .unwrap_or_else(|| Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI));
    let radii = Vector3::new(body.wide, axis.norm() / 2.0, body.thick);
    let point = |ring: usize, around: usize| {
        let latitude = std::f64::consts::PI * ring as f64 / RINGS as f64;
        let longitude = std::f64::consts::TAU * around as f64 / AROUND as f64;
        let unit = Unit::new_normalize(Vector3::new(
            latitude.sin() * longitude.cos(),
            -latitude.cos(),
            latitude.sin() * longitude.sin(),
        ));
        Point3::from(middle + turn * unit.component_mul(&radii))
    };
    let mut positions = vec![point(0, 0)];
    for ring in 1..RINGS {
        positions.extend((0..AROUND).map(|around| point(ring, around)));
    }
    positions.push(point(RINGS, 0));
    let top = positions.len() - 1;
    let at = |ring: usize, around: usize| 1 + (ring - 1) * AROUND + around % AROUND;
    let mut triangles = Vec::new();
    for around in 0..AROUND {
        triangles.push([0, at(1, around), at(1, around + 1)]);
        for ring in 1..RINGS - 1 {
            let (a, b) = (at(ring, around), at(ring, around + 1));
            let (c, d) = (at(ring + 1, around), at(ring + 1, around + 1));
            triangles.push([a, c, d]);
            triangles.push([a, d, b]);
        }
        triangles.push([top, at(RINGS - 1, around + 1), at(RINGS - 1, around)]);
    }
    Mesh { node: body.joint + 1, positions, triangles, skin: None }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_horse_stands_on_the_ground_at_its_height() {
        let model = horse();
        assert_eq!(model.skeleton.nodes.len(), IN_PLANE_ANGLES + 1);
        let points = model.posed_vertices(&model.skeleton.rest_pose());
        let lowest = points.iter().flatten().map(|p| p.y).fold(f64::INFINITY, f64::min);
        assert!(lowest.abs() < 0.04, "{lowest}");
        let withers = points[3].iter().map(|p| p.y).fold(0.0, f64::max);
        assert!((withers - 1.58).abs() < 0.06, "{withers}");
        for (j, name) in IN_PLANE_JOINTS.iter().enumerate() {
            assert_eq!(model.skeleton.nodes[j + 1].name, *name);
        }
    }

    #[test]
    fn ellipsoids_are_closed_and_face_outwards() {
        let model = horse();
        for mesh in &model.meshes {
            let centre = mesh.positions.iter().map(|p| p.coords).sum::<Vector3<f64>>()
                / mesh.positions.len() as f64;
            for t in &mesh.triangles {
                let [a, b, c] = t.map(|v| mesh.positions[v]);
                let normal = (b - a).cross(&(c - a));
                assert!(normal.dot(&(a.coords - centre)) > 0.0);
            }
        }
    }
}
