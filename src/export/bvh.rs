//! BVH in the plainest form there is, since readers disagree about everything else.
//!
//! One `ROOT`, then `JOINT`s; every joint has channels, leaves too, and a leaf also has an
//! `End Site`. Rotations are `Zrotation Xrotation Yrotation` in degrees, so R = Rz·Rx·Ry; Y is up
//! and right-handed as in glTF. The root has six channels and offset zero. The others have three,
//! and the distance to the parent is their `OFFSET`; only when some joint's distance changes with
//! time, all joints get six channels, and the position channels then *replace* the offset (as
//! Blender and MotionBuilder read them).
//!
//! BVH has no scale. Joint positions are the true ones, scales included, in every frame; rotations
//! leave scales out.

use std::fmt::Write;

use nalgebra::{Matrix3, Matrix4, Rotation3, UnitQuaternion, Vector3};

use crate::error::{Error, Result};
use crate::rig::{Clip, Pose, Skeleton};

/// Largest change of a joint's distance to its parent that still counts as none, as a share of the
/// skeleton's extent: the rounding of f32 files, not motion.
const FIXED_TOLERANCE: f64 = 1e-6;

/// Cosine of the middle angle under which the outer two cannot be told apart.
const GIMBAL_COSINE: f64 = 1e-9;

/// Length of an `End Site` as a share of its joint's own bone: it only has to be seen.
const END_SITE_SHARE: f64 = 0.3;

/// How a BVH file is written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BvhSettings {
    /// BVH units a rig unit, positive: 1 keeps the rig's unit (metres in glTF), 100 gives
    /// centimetres.
    pub units: f64,
}

impl Default for BvhSettings {
    fn default() -> Self {
        Self { units: 1.0 }
    }
}

/// A joint of the file.
struct Joint {
    /// Index in the skeleton; `None` for the root that joins several roots.
    node: Option<usize>,
    name: String,
    /// Index among the joints.
    parent: Option<usize>,
    children: Vec<usize>,
}

/// A joint's rotation and position relative to its parent, as BVH composes them.
#[derive(Clone, Copy)]
struct Local {
    position: Vector3<f64>,
    rotation: UnitQuaternion<f64>,
}

/// The text of a BVH file of a clip. `joints` are the nodes to write, as a skin lists them
/// ([`crate::rig::File::joints`]); their ancestors come with them, and all nodes do when it is
/// empty. Several roots are joined under one named `root`, which does not move. Names keep letters, digits,
/// `_`, `-` and `.`; other characters become `_`, and repeated names get `_2`, `_3`, ….
///
/// # Errors
/// [`Error::NothingDriven`] for a clip without frames or a skeleton without nodes.
///
/// # Panics
/// When the clip's poses have not one entry for each node of the skeleton, or a joint is no node.
pub fn bvh(
    skeleton: &Skeleton,
    joints: &[usize],
    clip: &Clip,
    settings: &BvhSettings,
) -> Result<String> {
    if skeleton.nodes.is_empty() || clip.poses.is_empty() {
        return Err(Error::NothingDriven { name: clip.name.clone() });
    }
    let joints = hierarchy(skeleton, joints);
    let rest = locals(skeleton, &joints, &skeleton.rest_pose(), settings.units);
    let frames: Vec<Vec<Local>> =
        clip.poses.iter().map(|p| locals(skeleton, &joints, p, settings.units)).collect();
    let extent: f64 = rest.iter().map(|l| l.position.norm()).sum::<f64>().max(f64::MIN_POSITIVE);
    let moved = |i: usize, local: &Local| {
        (local.position - rest[i].position).norm() > FIXED_TOLERANCE * extent
    };
    let six = frames.iter().any(|f| f.iter().enumerate().skip(1).any(|(i, l)| moved(i, l)));

    let mut out = String::from("HIERARCHY\n");
    write_hierarchy(&mut out, &joints, &rest, six);
    out.push_str("MOTION\n");
    line(&mut out, 0, &format!("Frames: {}", frames.len()));
    line(&mut out, 0, &format!("Frame Time: {:.9}", 1.0 / clip.fps));
    write_motion(&mut out, &frames, six);
    Ok(out)
}

/// The chosen nodes and their ancestors, each before its children and next to its siblings'
/// subtrees (the order in which BVH nests them), under one root.
fn hierarchy(skeleton: &Skeleton, chosen: &[usize]) -> Vec<Joint> {
    let count = skeleton.nodes.len();
    let mut kept = vec![chosen.is_empty(); count];
    for &start in chosen {
        let mut at = Some(start);
        while let Some(node) = at.filter(|&n| !kept[n]) {
            kept[node] = true;
            at = skeleton.nodes[node].parent;
        }
    }
    let mut children = vec![Vec::new(); count];
    let mut roots = Vec::new();
    for node in (0..count).filter(|&n| kept[n]) {
        skeleton.nodes[node].parent.map_or(&mut roots, |p| &mut children[p]).push(node);
    }
    let mut joints: Vec<Joint> = Vec::new();
    let mut names = Names::default();
    let joined = roots.len() > 1;
    if joined {
        let name = names.safe("root");
        joints.push(Joint { node: None, name, parent: None, children: Vec::new() });
    }
    let mut open: Vec<(usize, Option<usize>)> =
        roots.iter().rev().map(|&r| (r, joined.then_some(0))).collect();
    while let Some((node, parent)) = open.pop() {
        let index = joints.len();
        if let Some(parent) = parent {
            joints[parent].children.push(index);
        }
        let name = names.safe(&skeleton.nodes[node].name);
        joints.push(Joint { node: Some(node), name, parent, children: Vec::new() });
        open.extend(children[node].iter().rev().map(|&c| (c, Some(index))));
    }
    joints
}

/// Names given out so far.
#[derive(Default)]
struct Names(Vec<String>);

impl Names {
    fn safe(&mut self, name: &str) -> String {
        let plain = |c: char| c.is_alphanumeric() || matches!(c, '_' | '-' | '.');
        let base: String = name.chars().map(|c| if plain(c) { c } else { '_' }).collect();
        let mut safe = base.clone();
        let mut number = 2;
        while self.0.contains(&safe) {
            safe = format!("{base}_{number}");
            number += 1;
        }
        self.0.push(safe.clone());
        safe
    }
}

/// Local transforms whose composition without scales gives the true positions of a pose.
fn locals(skeleton: &Skeleton, joints: &[Joint], pose: &Pose, units: f64) -> Vec<Local> {
    let world = skeleton.world_matrices(pose);
    let mut turned: Vec<UnitQuaternion<f64>> = Vec::with_capacity(joints.len());
    let position =
        |joint: &Joint| joint.node.map_or_else(Vector3::zeros, |n| translation(&world[n]) * units);
    joints
        .iter()
        .map(|joint| {
            let rotation =
                joint.node.map_or_else(UnitQuaternion::identity, |n| pose.nodes[n].rotation);
            let (above, origin) = joint.parent.map_or_else(
                || (UnitQuaternion::identity(), Vector3::zeros()),
                |p| (turned[p], position(&joints[p])),
            );
            turned.push(above * rotation);
            Local { position: above.inverse() * (position(joint) - origin), rotation }
        })
        .collect()
}

fn translation(m: &Matrix4<f64>) -> Vector3<f64> {
    m.fixed_view::<3, 1>(0, 3).into_owned()
}

fn line(out: &mut String, depth: usize, text: &str) {
    out.extend(std::iter::repeat_n('\t', depth));
    out.push_str(text);
    out.push('\n');
}

fn offset(v: &Vector3<f64>) -> String {
    format!("OFFSET {} {} {}", number(v.x, 9), number(v.y, 9), number(v.z, 9))
}

/// A number with fixed decimals and without a minus before zero.
fn number(x: f64, decimals: usize) -> String {
    let text = format!("{x:.decimals$}");
    match text.strip_prefix('-') {
        Some(rest) if rest.bytes().all(|b| matches!(b, b'0' | b'.')) => rest.to_owned(),
        _ => text,
    }
}

fn write_hierarchy(out: &mut String, joints: &[Joint], rest: &[Local], six: bool) {
    // Joints are in nesting order, so braces close down to the next joint's depth.
    let mut depths: Vec<usize> = Vec::with_capacity(joints.len());
    for (i, joint) in joints.iter().enumerate() {
        let depth = joint.parent.map_or(0, |p| depths[p] + 1);
        depths.push(depth);
        let kind = if depth == 0 { "ROOT" } else { "JOINT" };
        line(out, depth, &format!("{kind} {}", joint.name));
        line(out, depth, "{");
        // The root's position is all in its channels: some readers add them to the offset.
        let at = if depth == 0 { Vector3::zeros() } else { rest[i].position };
        line(out, depth + 1, &offset(&at));
        line(out, depth + 1, channels(depth == 0 || six));
        if joint.children.is_empty() {
            let bone = rest[i].position.norm();
            let length = if bone > 0.0 { bone * END_SITE_SHARE } else { END_SITE_SHARE };
            line(out, depth + 1, "End Site");
            line(out, depth + 1, "{");
            line(out, depth + 2, &offset(&Vector3::new(0.0, length, 0.0)));
            line(out, depth + 1, "}");
        }
        let next = joints.get(i + 1).map_or(0, |j| j.parent.map_or(0, |p| depths[p] + 1));
        if joint.children.is_empty() {
            for depth in (next..=depth).rev() {
                line(out, depth, "}");
            }
        }
    }
}

fn channels(six: bool) -> &'static str {
    if six {
        "CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation"
    } else {
        "CHANNELS 3 Zrotation Xrotation Yrotation"
    }
}

fn write_motion(out: &mut String, frames: &[Vec<Local>], six: bool) {
    let mut before: Option<Vec<[f64; 3]>> = None;
    for frame in frames {
        let mut angles = Vec::with_capacity(frame.len());
        for (i, local) in frame.iter().enumerate() {
            if i > 0 {
                out.push(' ');
            }
            if i == 0 || six {
                for x in local.position.iter() {
                    // Writing to a String cannot fail.
                    let _ = write!(out, "{} ", number(*x, 9));
                }
            }
            let zxy = euler_zxy(&local.rotation, before.as_ref().map(|b| b[i]));
            let [z, x, y] = zxy.map(|a| number(a.to_degrees(), 6));
            let _ = write!(out, "{z} {x} {y}");
            angles.push(zxy);
        }
        out.push('\n');
        before = Some(angles);
    }
}

/// Angles z, x, y in radians with R = Rz·Rx·Ry; of the equivalent triples the nearest to the frame
/// before, so that curves have no jumps of 360°. Where z and y turn about one axis (x = ±90°), y
/// keeps its value.
fn euler_zxy(rotation: &UnitQuaternion<f64>, before: Option<[f64; 3]>) -> [f64; 3] {
    use std::f64::consts::{PI, TAU};
    let r: Matrix3<f64> = Rotation3::from(*rotation).into_inner();
    let cosine = r[(2, 0)].hypot(r[(2, 2)]);
    let x = r[(2, 1)].atan2(cosine);
    let near = |angle: f64, to: f64| angle + TAU * ((to - angle) / TAU).round();
    if cosine < GIMBAL_COSINE {
        let y = before.map_or(0.0, |b| b[2]);
        // Rz(z)·Rx(±90°)·Ry(y) depends on z ± y only, read off the first column at y = 0.
        let z = r[(1, 0)].atan2(r[(0, 0)]) - y * x.signum();
        return [near(z, before.map_or(z, |b| b[0])), x, y];
    }
    let z = (-r[(0, 1)]).atan2(r[(1, 1)]);
    let y = (-r[(2, 0)]).atan2(r[(2, 2)]);
    let Some(b) = before else { return [z, x, y] };
    let candidates = [[z, x, y], [z + PI, PI - x, y + PI]]
        .map(|c| std::array::from_fn::<f64, 3, _>(|i| near(c[i], b[i])));
    let distance = |c: &[f64; 3]| -> f64 { c.iter().zip(b).map(|(p, q)| (p - q).powi(2)).sum() };
    if distance(&candidates[1]) < distance(&candidates[0]) { candidates[1] } else { candidates[0] }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use proptest::prelude::*;

    use super::*;
    use crate::rig::angle_between_rad;

    fn composed([z, x, y]: [f64; 3]) -> UnitQuaternion<f64> {
        UnitQuaternion::from_axis_angle(&Vector3::z_axis(), z)
            * UnitQuaternion::from_axis_angle(&Vector3::x_axis(), x)
            * UnitQuaternion::from_axis_angle(&Vector3::y_axis(), y)
    }

    proptest! {
        #[test]
        fn angles_compose_to_the_rotation(
            v in prop::array::uniform3(-3.0..3.0_f64),
            before in prop::option::of(prop::array::uniform3(-20.0..20.0_f64)),
        ) {
            let q = UnitQuaternion::from_scaled_axis(Vector3::from(v));
            prop_assert!(angle_between_rad(&composed(euler_zxy(&q, before)), &q) < 1e-9);
        }

        #[test]
        fn gimbal_lock_still_composes(
            z in -3.0..3.0_f64, y in -3.0..3.0_f64, up in any::<bool>(),
            before in prop::option::of(prop::array::uniform3(-20.0..20.0_f64)),
        ) {
            let q = composed([z, if up { FRAC_PI_2 } else { -FRAC_PI_2 }, y]);
            prop_assert!(angle_between_rad(&composed(euler_zxy(&q, before)), &q) < 1e-7);
        }
    }

    #[test]
    fn angles_run_on_past_half_a_turn() {
        let mut before = None;
        for step in 0..200 {
            let angle = f64::from(step) * 0.1;
            let angles = euler_zxy(&composed([angle, 0.3, -0.2]), before);
            assert!((angles[0] - angle).abs() < 1e-9, "{angle}: {angles:?}");
            before = Some(angles);
        }
    }

    #[test]
    fn names_become_safe_and_stay_apart() {
        let mut names = Names::default();
        let made: Vec<String> = ["mixamorig:Leg", "mixamorig Leg", "a|b", "mixamorig:Leg"]
            .map(|n| names.safe(n))
            .into();
        assert_eq!(made, ["mixamorig_Leg", "mixamorig_Leg_2", "a_b", "mixamorig_Leg_3"]);
    }

    #[test]
    fn zero_has_no_sign() {
        assert_eq!(number(-1e-12, 6), "0.000000");
        assert_eq!(number(-0.5, 6), "-0.500000");
    }
}
