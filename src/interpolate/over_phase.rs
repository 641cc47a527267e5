//! Interpolation over the gait phase: the periodic cubic spline through the key poses.

use crate::numeric::{DriftingCycle, MirroredCycle, PeriodicCubic};
use crate::{Error, Result};

use super::weights::{Weights, check_distinct};

/// The weights of all frames: those of the periodic cubic spline through the key poses, each at its
/// frame's phase. They sum to one; at a key's frame that key's pose has weight 1.
///
/// `cycles[t]`: phase of frame t, unwrapped, in the unit in which the motion repeats (strides).
/// `keys`: the frames whose poses are known, in the order of the poses.
///
/// # Errors
/// No keys, a frame listed twice or outside the clip.
pub fn weights_over_phase(cycles: &[f64], keys: &[usize]) -> Result<Weights> {
    check_distinct(keys.iter().copied())?;
    if let Some(&frame) = keys.iter().find(|k| **k >= cycles.len()) {
        return Err(Error::KeyFrameOutOfRange { frame, frames: cycles.len() });
    }
    let phases: Vec<f64> = keys.iter().map(|&k| cycles[k]).collect();
    let spline = PeriodicCubic::new(&phases).ok_or(Error::NoKeys)?;
    let rows: Vec<Vec<f64>> = cycles.iter().map(|&p| spline.weights(p)).collect();
    let active = vec![None; rows.len()];
    Ok(Weights::new(keys.len(), rows, active, Vec::new()))
}

/// The weights of all frames of a motion that drifts as it repeats ([`DriftingCycle`]), `drift` one entry a
/// frame; `ridge` is how much the poses are doubted, as a share of the motion's variance. They sum to one; at a key's
/// frame that key's pose has weight 1 (to a ten thousandth) while the ridge is 0.
///
/// # Errors
/// As [`weights_over_phase`].
pub fn weights_over_drift(
    cycles: &[f64],
    drift: &[f64],
    keys: &[usize],
    ridge: f64,
) -> Result<Weights> {
    check_distinct(keys.iter().copied())?;
    let frames = cycles.len().min(drift.len());
    if let Some(&frame) = keys.iter().find(|k| **k >= frames) {
        return Err(Error::KeyFrameOutOfRange { frame, frames });
    }
    let known: Vec<(f64, f64)> = keys.iter().map(|&k| (cycles[k], drift[k])).collect();
    let motion = DriftingCycle::new(&known, ridge).ok_or(Error::NoKeys)?;
    let rows: Vec<Vec<f64>> =
        cycles.iter().zip(drift).map(|(p, d)| motion.weights(*p, *d)).collect();
    let active = vec![None; rows.len()];
    Ok(Weights::new(keys.len(), rows, active, Vec::new()))
}

/// The weights of all frames of a motion whose left does what its right does half a stride later
/// ([`MirroredCycle`]): of the key poses, and after them of the same poses with the sides exchanged, in the same order.
/// They sum to one; at a key's frame that key's pose has weight 1 (to a thousandth).
///
/// # Errors
/// As [`weights_over_phase`].
pub fn weights_over_mirrored(stride_cycles: &[f64], keys: &[usize]) -> Result<Weights> {
    check_distinct(keys.iter().copied())?;
    let frames = stride_cycles.len();
    if let Some(&frame) = keys.iter().find(|k| **k >= frames) {
        return Err(Error::KeyFrameOutOfRange { frame, frames });
    }
    let phases: Vec<f64> = keys.iter().map(|&k| stride_cycles[k]).collect();
    let motion = MirroredCycle::new(&phases).ok_or(Error::NoKeys)?;
    let rows: Vec<Vec<f64>> = stride_cycles.iter().map(|&p| motion.weights(p)).collect();
    let active = vec![None; rows.len()];
    Ok(Weights::new(2 * keys.len(), rows, active, Vec::new()).with_mirrored(keys.len()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_have_their_own_pose_and_the_motion_repeats() {
        let cycles: Vec<f64> = (0..50).map(|t| 0.3 + f64::from(t) / 12.5).collect();
        let keys = [3, 20, 9, 31];
        let found = weights_over_phase(&cycles, &keys).unwrap();
        for (k, &frame) in keys.iter().enumerate() {
            assert!((found.row(frame)[k] - 1.0).abs() < 1e-12);
        }
        for t in 0..25 {
            for (a, b) in found.row(t).iter().zip(found.row(t + 25)) {
                assert!((a - b).abs() < 1e-9);
            }
        }
        assert!(found.sums().iter().all(|s| (s - 1.0).abs() < 1e-12));
    }

    #[test]
    fn a_motion_that_drifts_is_followed() {
        let cycles: Vec<f64> = (0..60).map(|t| f64::from(t) / 20.0).collect();
        let drift: Vec<f64> = (0..60).map(|t| (f64::from(t) - 29.5) / 17.3).collect();
        let truth = |t: usize| (std::f64::consts::TAU * cycles[t]).sin() + 0.8 * drift[t];
        let keys = [2, 9, 17, 28, 34, 41, 50, 57];
        let error = |weights: &Weights| -> f64 {
            let guess =
                |t: usize| weights.row(t).iter().zip(keys).map(|(w, k)| w * truth(k)).sum::<f64>();
            (0..60).map(|t| (guess(t) - truth(t)).powi(2)).sum::<f64>() / 60.0
        };
        let followed = weights_over_drift(&cycles, &drift, &keys, 0.0).unwrap();
        let plain = weights_over_phase(&cycles, &keys).unwrap();
        assert!(
            error(&followed) < 0.01 && error(&plain) > 0.1,
            "{} {}",
            error(&followed),
            error(&plain)
        );
        assert!(keys.iter().enumerate().all(|(k, &t)| (followed.row(t)[k] - 1.0).abs() < 0.01));
        assert!(weights_over_drift(&cycles, &drift, &[60], 0.0).is_err());
        assert!(weights_over_drift(&cycles, &drift, &[], 0.0).is_err());
    }

    #[test]
    fn keys_outside_or_twice_are_refused() {
        let cycles = [0.0, 0.1, 0.2];
        assert!(weights_over_phase(&cycles, &[3]).is_err());
        assert!(weights_over_phase(&cycles, &[1, 1]).is_err());
        assert!(weights_over_phase(&cycles, &[]).is_err());
    }
}
