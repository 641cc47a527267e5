//! Interpolation over the gait phase: the periodic cubic spline through the key poses.

use crate::numeric::PeriodicCubic;
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
    fn keys_outside_or_twice_are_refused() {
        let cycles = [0.0, 0.1, 0.2];
        assert!(weights_over_phase(&cycles, &[3]).is_err());
        assert!(weights_over_phase(&cycles, &[1, 1]).is_err());
        assert!(weights_over_phase(&cycles, &[]).is_err());
    }
}
