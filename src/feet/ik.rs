//! Inverse kinematics of a chain of any length by damped least squares.
//!
//! Every joint may turn about all three axes; the turns are the smallest, in the sense of least squares,
//! that bring the end to its target (Wampler 1986; Levenberg's and Marquardt's damping makes each step
//! an improvement). Beginning from the animated pose, the answer depends smoothly on the target and
//! equals the pose where the target asks for nothing, so that a smooth way of the target gives smooth joints.

use nalgebra::{DMatrix, DVector, Matrix3, Point3, UnitQuaternion, Vector3};

use crate::rig::{Pose, Skeleton, rotation_from_vector};

/// Steps at most; within reach five to ten are usual.
const STEPS: usize = 60;

/// Distance, as a share of the chain's length, that counts as reached.
const TOLERANCE: f64 = 1e-9;

/// A straight chain cannot be shortened by infinitesimal turns. It is bent by this angle first, radians.
const NUDGE_RAD: f64 = 0.05;

/// Share of its length from which a chain counts as straight, a little; wholly so at 1.
const STRAIGHT_FROM: f64 = 0.97;

/// What came of an attempt.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reached {
    /// Distance that is left between the end and its target, rig units.
    pub distance: f64,
}

/// Turns `joints` (each an ancestor of the next, the uppermost first) so that the point `end` comes to
/// `target` in world space: `end` is a node at or below the last joint and a point in its space. What is
/// out of reach is approached as near as the chain can. Only rotations of `joints` change.
///
/// # Panics
/// When the pose has not one entry for each node of the skeleton.
pub fn reach(
    skeleton: &Skeleton,
    pose: &mut Pose,
    joints: &[usize],
    end: (usize, Point3<f64>),
    target: Point3<f64>,
) -> Reached {
    reach_bending(skeleton, pose, joints, end, target, &Vector3::zeros())
}

/// The same for a chain that is known to bend about an axis, `bow`, in world space (of zero length: unknown). A
/// leg that is straight in its pose may be bent to either side by rounding alone; it is bent as far as the target asks,
/// and the more the straighter it is, before the way to the target is looked for.
///
/// # Panics
/// As [`reach`].
pub fn reach_bending(
    skeleton: &Skeleton,
    pose: &mut Pose,
    joints: &[usize],
    end: (usize, Point3<f64>),
    target: Point3<f64>,
    bow: &Vector3<f64>,
) -> Reached {
    let mut chain = Chain::new(skeleton, pose, joints, end);
    let scale = chain.length().max(f64::MIN_POSITIVE);
    if chain.distance(&target) < TOLERANCE * scale {
        return Reached { distance: chain.distance(&target) };
    }
    chain.unlock(&target, scale, bow);
    chain.solve(&target, scale);
    let reachable = (target - chain.places[0]).norm() < 0.999 * scale;
    if chain.distance(&target) > 1e-4 * scale && reachable && joints.len() > 1 {
        chain.bend(scale);
        chain.solve(&target, scale);
    }
    chain.write(pose);
    Reached { distance: chain.distance(&target) }
}

/// The chain in world space: rigid pieces between the joints.
struct Chain<'a> {
    joints: &'a [usize],
    /// World rotation of each joint's parent at the start, to come back to local rotations.
    parents: Vec<Matrix3<f64>>,
    /// Turn of each joint in world space since the start, without that of the joints above it.
    turns: Vec<UnitQuaternion<f64>>,
    /// Place of each joint at the start, and of the end last.
    start: Vec<Point3<f64>>,
    /// The same now.
    places: Vec<Point3<f64>>,
}

impl<'a> Chain<'a> {
    fn new(
        skeleton: &Skeleton,
        pose: &Pose,
        joints: &'a [usize],
        end: (usize, Point3<f64>),
    ) -> Self {
        let world = skeleton.world_matrices(pose);
        let mut start: Vec<Point3<f64>> =
            joints.iter().map(|&j| world[j].transform_point(&Point3::origin())).collect();
        start.push(world[end.0].transform_point(&end.1));
        let rotation_above = |j: &usize| {
            let parent = skeleton.nodes[*j].parent;
            parent
                .map_or_else(Matrix3::identity, |p| world[p].fixed_view::<3, 3>(0, 0).into_owned())
        };
        let parents = joints.iter().map(rotation_above).collect();
        Self {
            joints,
            parents,
            turns: vec![UnitQuaternion::identity(); joints.len()],
            places: start.clone(),
            start,
        }
    }

    fn length(&self) -> f64 {
        self.start.windows(2).map(|w| (w[1] - w[0]).norm()).sum()
    }

    fn distance(&self, target: &Point3<f64>) -> f64 {
        self.places.last().map_or(0.0, |p| (target - p).norm())
    }

    /// Places of all joints for the present turns: joint k turns what lies below it.
    fn place(&mut self) {
        let mut turned = UnitQuaternion::identity();
        for k in 0..self.joints.len() {
            turned *= self.turns[k];
            self.places[k + 1] = self.places[k] + turned * (self.start[k + 1] - self.start[k]);
        }
    }

    fn solve(&mut self, target: &Point3<f64>, scale: f64) {
        let n = self.joints.len();
        let mut damping = 1e-3;
        for _ in 0..STEPS {
            let error = self.distance(target);
            if error < TOLERANCE * scale {
                return;
            }
            let tip = self.places[n];
            let mut jacobian = DMatrix::<f64>::zeros(3, 3 * n);
            for k in 0..n {
                // A turn ω about joint k, in world space, moves the tip by ω × r.
                let r = (tip - self.places[k]) / scale;
                jacobian.fixed_view_mut::<3, 3>(0, 3 * k).copy_from(&(-r.cross_matrix()));
            }
            let wanted = DVector::from_column_slice(((target - tip) / scale).as_slice());
            let square = &jacobian * jacobian.transpose() + DMatrix::identity(3, 3) * damping;
            let Some(factor) = square.cholesky() else { return };
            let step = jacobian.transpose() * factor.solve(&wanted);
            let before = self.turns.clone();
            self.turn(&step);
            if self.distance(target) < error {
                damping = (damping * 0.1).max(1e-14);
            } else {
                self.turns = before;
                self.place();
                damping *= 10.0;
                if damping > 1e6 {
                    return;
                }
            }
        }
    }

    /// Turns joint k by ω_k in world space. The turn of a joint acts below the turns of those above it.
    fn turn(&mut self, step: &DVector<f64>) {
        let mut above = UnitQuaternion::identity();
        for k in 0..self.joints.len() {
            let old = above * self.turns[k];
            let omega = Vector3::new(step[3 * k], step[3 * k + 1], step[3 * k + 2]);
            self.turns[k] = UnitQuaternion::new_normalize(
                *(above.inverse() * rotation_from_vector(&omega) * old),
            );
            above = old;
        }
        self.place();
    }

    /// Bends a chain that is nearly straight about `bow`, if its end is to come nearer.
    fn unlock(&mut self, target: &Point3<f64>, scale: f64, bow: &Vector3<f64>) {
        let Some(axis) = bow.try_normalize(0.0) else { return };
        let extent = (self.places[self.joints.len()] - self.places[0]).norm() / scale;
        let wanted = (target - self.places[0]).norm() / scale;
        let straight = ((extent - STRAIGHT_FROM) / (1.0 - STRAIGHT_FROM)).clamp(0.0, 1.0);
        if straight == 0.0 || wanted >= extent || self.joints.len() < 2 {
            return;
        }
        // Two equal bones reach as far as the cosine of half the angle between them.
        let bend = |reach: f64| 2.0 * reach.min(1.0).acos();
        let angle = straight * (bend(wanted) - bend(extent)) / (self.joints.len() - 1) as f64;
        let mut step = DVector::zeros(3 * self.joints.len());
        for k in 1..self.joints.len() {
            step.fixed_rows_mut::<3>(3 * k).copy_from(&(axis * angle * k as f64));
        }
        self.turn(&step);
    }

    /// Bends a straight chain a little in the plane it is nearest to lie in.
    fn bend(&mut self, scale: f64) {
        let line = self.places[self.joints.len()] - self.places[0];
        let bow = self
            .places
            .windows(3)
            .map(|w| (w[1] - w[0]).cross(&(w[2] - w[1])))
            .sum::<Vector3<f64>>();
        let axis = if bow.norm() > 1e-9 * scale * scale {
            bow
        } else {
            line.cross(&Vector3::z()) + line.cross(&Vector3::x()) * 1e-3
        };
        let Some(axis) = axis.try_normalize(0.0) else { return };
        let mut step = DVector::zeros(3 * self.joints.len());
        for k in 1..self.joints.len() {
            step.fixed_rows_mut::<3>(3 * k).copy_from(&(axis * NUDGE_RAD * k as f64));
        }
        self.turn(&step);
    }

    /// Local rotations: with the parent's world rotation P at the start and the turns T above a joint,
    /// its world rotation goes from P·q to T·P·q, its parent's from P to T'·P, so q becomes P⁻¹T'⁻¹T·P·q.
    fn write(&self, pose: &mut Pose) {
        for (k, &joint) in self.joints.iter().enumerate() {
            let rotation = &mut pose.nodes[joint].rotation;
            let parent = orthonormal(&self.parents[k]);
            let local = parent.inverse() * self.turns[k] * parent;
            *rotation = UnitQuaternion::new_normalize(*(local * *rotation));
        }
    }
}

/// The rotation of a matrix that may scale.
pub(super) fn orthonormal(m: &Matrix3<f64>) -> UnitQuaternion<f64> {
    let columns: [Vector3<f64>; 3] = std::array::from_fn(|i| m.column(i).normalize());
    UnitQuaternion::from_basis_unchecked(&columns)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::rig::{Node, NodePose};

    /// A chain of bones along their parents' -Y under a scaled and turned root, bent by `angles`.
    fn chain(lengths: &[f64], angles: &[[f64; 3]]) -> (Skeleton, Pose, Vec<usize>) {
        let root = NodePose {
            rotation: UnitQuaternion::from_euler_angles(0.3, -0.7, 1.1),
            scale: Vector3::repeat(3.0),
            ..NodePose::IDENTITY
        };
        let mut nodes = vec![Node { name: "root".to_owned(), parent: None, rest: root }];
        for (i, angle) in angles.iter().enumerate() {
            let above = if i == 0 { 0.5 } else { lengths[i - 1] };
            let rest = NodePose {
                translation: Vector3::new(0.0, -above, 0.0),
                rotation: rotation_from_vector(&Vector3::from(*angle)),
                ..NodePose::IDENTITY
            };
            nodes.push(Node { name: i.to_string(), parent: Some(i), rest });
        }
        let tip = NodePose {
            translation: Vector3::new(0.0, -lengths[angles.len() - 1], 0.0),
            ..NodePose::IDENTITY
        };
        nodes.push(Node { name: "tip".to_owned(), parent: Some(angles.len()), rest: tip });
        let skeleton = Skeleton { nodes };
        let pose = skeleton.rest_pose();
        (skeleton, pose, (1..=angles.len()).collect())
    }

    fn tip(skeleton: &Skeleton, pose: &Pose) -> Point3<f64> {
        let last = skeleton.nodes.len() - 1;
        skeleton.world_matrices(pose)[last].transform_point(&Point3::origin())
    }

    fn bends(count: usize) -> impl Strategy<Value = Vec<[f64; 3]>> {
        prop::collection::vec(prop::array::uniform3(-0.8..0.8_f64), count)
    }

    proptest! {
        #[test]
        fn a_place_the_chain_can_take_is_reached(
            (lengths, from, to) in (2..7_usize).prop_flat_map(|n| {
                (prop::collection::vec(0.2..1.0_f64, n), bends(n), bends(n))
            }),
        ) {
            let (skeleton, mut pose, joints) = chain(&lengths, &from);
            let (other, posed, _) = chain(&lengths, &to);
            // A target that some pose of the same bones takes, and no bone longer than the rest.
            let target = tip(&other, &posed);
            let end = skeleton.nodes.len() - 1;
            let bones = pose.clone();
            let reached = reach(&skeleton, &mut pose, &joints, (end, Point3::origin()), target);
            prop_assert!(reached.distance < 1e-6, "{}", reached.distance);
            prop_assert!((tip(&skeleton, &pose) - target).norm() < 1e-6);
            for (a, b) in pose.nodes.iter().zip(&bones.nodes) {
                prop_assert_eq!((a.translation, a.scale), (b.translation, b.scale));
            }
        }

        #[test]
        fn out_of_reach_the_chain_is_stretched_towards_the_target(
            from in bends(3), direction in prop::array::uniform3(-1.0..1.0_f64),
        ) {
            prop_assume!(Vector3::from(direction).norm() > 0.2);
            let (skeleton, mut pose, joints) = chain(&[1.0, 0.7, 0.5], &from);
            let top = skeleton.world_matrices(&pose)[1].transform_point(&Point3::origin());
            let target = top + Vector3::from(direction).normalize() * 10.0;
            let reached = reach(&skeleton, &mut pose, &joints, (4, Point3::origin()), target);
            // The chain is 3 · 2.2 long.
            prop_assert!((reached.distance - (10.0 - 6.6)).abs() < 0.02, "{}", reached.distance);
        }

        #[test]
        fn small_ways_of_the_target_turn_joints_little(from in bends(4), by in prop::array::uniform3(-1.0..1.0_f64)) {
            let (skeleton, mut pose, joints) = chain(&[0.6, 0.8, 0.7, 0.4], &from);
            let before = pose.clone();
            let still = tip(&skeleton, &pose);
            reach(&skeleton, &mut pose, &joints, (5, Point3::origin()), still);
            prop_assert_eq!(&pose, &before, "nothing is asked for");
            // Bent enough that the end can move in every direction.
            let extent = (still - skeleton.world_matrices(&pose)[1].transform_point(&Point3::origin())).norm();
            prop_assume!(extent < 0.9 * 3.0 * 2.5);
            reach(&skeleton, &mut pose, &joints, (5, Point3::origin()), still + Vector3::from(by) * 0.01);
            for (a, b) in pose.nodes.iter().zip(&before.nodes) {
                prop_assert!(a.rotation.angle_to(&b.rotation) < 0.06);
            }
        }
    }

    #[test]
    fn a_straight_leg_bends_to_the_side_it_is_known_to() {
        let (skeleton, straight, joints) = chain(&[1.0, 1.0], &[[0.0; 3]; 2]);
        let top = skeleton.world_matrices(&straight)[1].transform_point(&Point3::origin());
        let line = tip(&skeleton, &straight) - top;
        let axis = line.cross(&Vector3::new(0.2, 0.1, 1.0)).normalize();
        for (side, share) in [(1.0, 0.999), (1.0, 0.9), (-1.0, 0.9), (-1.0, 0.99)] {
            // As straight as rounding of a file leaves it, and a little to the wrong side.
            let mut pose = straight.clone();
            let wrong = rotation_from_vector(&Vector3::new(1e-4 * side, 1e-4, 0.0));
            pose.nodes[2].rotation *= wrong;
            let (end, target) = ((3, Point3::origin()), top + line * share);
            let found =
                reach_bending(&skeleton, &mut pose, &joints, end, target, &(axis * side * 7.0));
            assert!(found.distance < 1e-6, "{}", found.distance);
            let world = skeleton.world_matrices(&pose);
            let knee = world[2].transform_point(&Point3::origin());
            let bow = (knee - top).cross(&(target - knee)).dot(&axis);
            assert!(bow * side > 0.0, "{side} {share}: {bow}");
        }
    }

    #[test]
    fn a_straight_chain_is_shortened() {
        let (skeleton, mut pose, joints) = chain(&[1.0, 1.0, 1.0], &[[0.0; 3]; 3]);
        let top = skeleton.world_matrices(&pose)[1].transform_point(&Point3::origin());
        let target = top + (tip(&skeleton, &pose) - top) * 0.7;
        let reached = reach(&skeleton, &mut pose, &joints, (4, Point3::origin()), target);
        assert!(reached.distance < 1e-6, "{}", reached.distance);
    }
}
