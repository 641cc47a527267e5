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
    let mut chain = Chain::new(skeleton, pose, joints, end);
    let scale = chain.length().max(f64::MIN_POSITIVE);
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
