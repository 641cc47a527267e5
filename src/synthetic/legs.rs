//! A leg's joint angles from where its hoof has to be.
//!
//! The chain has more joints than the hoof has coordinates, so the angles are those nearest to a
//! wanted style (flexed in swing, straight in stance) that put the toe on its target, found by
//! damped least squares. The answer depends smoothly on target and style, so a periodic
//! target gives a periodic, smooth motion.

use nalgebra::{DMatrix, DVector};

/// Weight of the toe's position against one radian of style, per metre: a millimetre at the toe
/// costs as much as 3 degrees in every joint.
const TOE_WEIGHT: f64 = 50.0;

/// Weight of the hoof's pitch against one radian of style.
const PITCH_WEIGHT: f64 = 3.0;

/// Weight of a joint's excess over its limits.
const LIMIT_WEIGHT: f64 = 8.0;

/// Steps at most; the angles stop changing after about fifteen.
const STEPS: usize = 80;

/// What a leg should do at one moment.
pub(super) struct LegTask<'a> {
    /// Joints in the rest pose from the top, the toe last; (z, y), metres.
    pub(super) chain: &'a [(f64, f64)],
    /// Where the top joint is now and by what angle the body has turned it, radians.
    pub(super) root: (f64, f64),
    pub(super) root_angle: f64,
    /// Where the toe has to be.
    pub(super) toe: (f64, f64),
    /// The hoof's pitch in space, radians; 0 is flat on the ground.
    pub(super) pitch: f64,
    /// Wanted angles, one a joint, radians.
    pub(super) style: &'a [f64],
    /// How much each joint sticks to its style, over 0.
    pub(super) stiffness: &'a [f64],
    /// Lowest and highest angle of each joint, radians (soft).
    pub(super) limits: &'a [(f64, f64)],
}

/// Toe (z, y) for given joint angles.
pub(super) fn toe_place(task: &LegTask, angles: &[f64]) -> (f64, f64) {
    let mut at = task.root;
    let mut turned = task.root_angle;
    for (pair, angle) in task.chain.windows(2).zip(angles) {
        turned += angle;
        let moved = rotated((pair[1].0 - pair[0].0, pair[1].1 - pair[0].1), turned);
        at = (at.0 + moved.0, at.1 + moved.1);
    }
    at
}

/// A (z, y) vector turned by a rotation about +X: y turns towards z.
pub(super) fn rotated((z, y): (f64, f64), angle: f64) -> (f64, f64) {
    let (sin, cos) = angle.sin_cos();
    (cos * z + sin * y, cos * y - sin * z)
}

/// The angles of the chain, radians: Levenberg's and Marquardt's damping between Gauss-Newton and
/// steepest descent, from the style. Steps that do not help are never taken, so the answer stays in
/// the valley the style lies in.
pub(super) fn solve(task: &LegTask) -> Vec<f64> {
    let n = task.style.len();
    let mut angles = task.style.to_vec();
    let mut error = residuals(task, &angles);
    let mut damping = 1e-2;
    for _ in 0..STEPS {
        let jacobian = jacobian(task, &angles, &error);
        let mut normal = jacobian.transpose() * &jacobian;
        for joint in 0..n {
            normal[(joint, joint)] *= 1.0 + damping;
            normal[(joint, joint)] += 1e-9;
        }
        let Some(step) = normal.cholesky().map(|c| c.solve(&(jacobian.transpose() * &error)))
        else {
            break;
        };
        let tried: Vec<f64> = angles.iter().zip(step.iter()).map(|(a, s)| a - s).collect();
        let tried_error = residuals(task, &tried);
        if tried_error.norm_squared() < error.norm_squared() {
            (angles, error) = (tried, tried_error);
            damping = (damping / 4.0).max(1e-9);
            if step.amax() < 1e-10 {
                break;
            }
        } else {
            damping *= 6.0;
            if damping > 1e9 {
                break;
            }
        }
    }
    angles
}

fn jacobian(task: &LegTask, angles: &[f64], error: &DVector<f64>) -> DMatrix<f64> {
    let step = 1e-7;
    let columns: Vec<DVector<f64>> = (0..angles.len())
        .map(|joint| {
            let mut moved = angles.to_vec();
            moved[joint] += step;
            (residuals(task, &moved) - error) / step
        })
        .collect();
    DMatrix::from_columns(&columns)
}

fn residuals(task: &LegTask, angles: &[f64]) -> DVector<f64> {
    let toe = toe_place(task, angles);
    let pitch = task.root_angle + angles.iter().sum::<f64>();
    let mut rows = vec![
        TOE_WEIGHT * (toe.0 - task.toe.0),
        TOE_WEIGHT * (toe.1 - task.toe.1),
        PITCH_WEIGHT * (pitch - task.pitch),
    ];
    for (joint, angle) in angles.iter().enumerate() {
        rows.push(task.stiffness[joint] * (angle - task.style[joint]));
        let (low, high) = task.limits[joint];
        rows.push(LIMIT_WEIGHT * ((angle - high).max(0.0) + (angle - low).min(0.0)));
    }
    DVector::from_vec(rows)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synthetic::horse::{FORE_LEFT, leg_chain};

    #[test]
    fn the_toe_reaches_its_target() {
        let chain = leg_chain(FORE_LEFT);
        for dz in [-0.4, -0.2, 0.0, 0.2, 0.4] {
            let task = LegTask {
                chain: &chain,
                root: (chain[0].0, chain[0].1 - 0.03),
                root_angle: 0.02,
                toe: (0.52 + dz, 0.05),
                pitch: 0.0,
                style: &[0.0; 6],
                stiffness: &[1.0; 6],
                limits: &[(-1.5, 1.5); 6],
            };
            let toe = toe_place(&task, &solve(&task));
            assert!((toe.0 - task.toe.0).hypot(toe.1 - task.toe.1) < 0.01, "{dz} {toe:?}");
        }
    }
}
