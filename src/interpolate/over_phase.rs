//! Interpolation over the gait phase: the periodic cubic spline through the key poses, larger and smaller as
//! the strides are.

use crate::numeric::{DriftingCycle, MirroredCycle, PeriodicCubic};
use crate::{Error, Result};

use super::weights::{Weights, check_distinct};

/// The weights of all frames: those of the periodic cubic spline through the key poses, each at its
/// frame's phase. They sum to one; at a key's frame that key's pose has weight 1.
///
/// `cycles[t]`: phase of frame t, unwrapped, in the unit in which the motion repeats (strides).
/// `keys`: the frames whose poses are known, in the order of the poses.
/// `amplitude[t]`: size of the motion at frame t over the mean, over 0; empty of a motion of one size. With a(t) for it
/// the weights w of the spline become a(t) w(t) / a(k) for key k, and what they lack of one is shared out as in the mean pose
/// of the stride: the poses' differences from the mean pose grow and shrink, and keys keep their own pose.
///
/// # Errors
/// No keys, a frame listed twice or outside the clip.
pub fn weights_over_phase(cycles: &[f64], amplitude: &[f64], keys: &[usize]) -> Result<Weights> {
    check_distinct(keys.iter().copied())?;
    if let Some(&frame) = keys.iter().find(|k| **k >= cycles.len()) {
        return Err(Error::KeyFrameOutOfRange { frame, frames: cycles.len() });
    }
    let phases: Vec<f64> = keys.iter().map(|&k| cycles[k]).collect();
    let spline = PeriodicCubic::new(&phases).ok_or(Error::NoKeys)?;
    let rows = sized(cycles, amplitude, keys, &|phase| spline.weights(phase));
    let active = vec![None; rows.len()];
    Ok(Weights::new(keys.len(), rows, active, Vec::new()))
}

/// Places of the stride over which the mean pose is taken.
const MEAN_PLACES: usize = 64;

/// The weights at each frame's phase, made larger and smaller as [`weights_over_phase`] says. Weights of mirrored
/// poses come after those of the keys, in the same order.
fn sized(
    cycles: &[f64],
    amplitude: &[f64],
    keys: &[usize],
    at: &dyn Fn(f64) -> Vec<f64>,
) -> Vec<Vec<f64>> {
    let mut rows: Vec<Vec<f64>> = cycles.iter().map(|&p| at(p)).collect();
    if amplitude.len() != rows.len() || keys.is_empty() || amplitude.iter().all(|a| *a == 1.0) {
        return rows;
    }
    let places: Vec<Vec<f64>> =
        (0..MEAN_PLACES).map(|k| at(k as f64 / MEAN_PLACES as f64)).collect();
    let poses = places.first().map_or(0, Vec::len);
    let size_of = |k: usize| amplitude[keys[k % keys.len()]];
    // The poses have sizes too, and their differences are to cancel out.
    let mean: Vec<f64> =
        (0..poses).map(|k| places.iter().map(|w| w[k]).sum::<f64>() / size_of(k)).collect();
    let total: f64 = mean.iter().sum();
    let mean: Vec<f64> = mean.iter().map(|m| m / total).collect();
    for (row, size) in rows.iter_mut().zip(amplitude) {
        for (k, weight) in row.iter_mut().enumerate() {
            *weight *= size / size_of(k);
        }
        let lacking = 1.0 - row.iter().sum::<f64>();
        for (weight, mean) in row.iter_mut().zip(&mean) {
            *weight += lacking * mean;
        }
    }
    rows
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
/// They sum to one; at a key's frame that key's pose has weight 1 (to a thousandth). `amplitude` as in
/// [`weights_over_phase`].
///
/// # Errors
/// As [`weights_over_phase`].
pub fn weights_over_mirrored(
    stride_cycles: &[f64],
    amplitude: &[f64],
    keys: &[usize],
) -> Result<Weights> {
    check_distinct(keys.iter().copied())?;
    let frames = stride_cycles.len();
    if let Some(&frame) = keys.iter().find(|k| **k >= frames) {
        return Err(Error::KeyFrameOutOfRange { frame, frames });
    }
    let phases: Vec<f64> = keys.iter().map(|&k| stride_cycles[k]).collect();
    let motion = MirroredCycle::new(&phases).ok_or(Error::NoKeys)?;
    let rows = sized(stride_cycles, amplitude, keys, &|phase| motion.weights(phase));
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
        let found = weights_over_phase(&cycles, &[], &keys).unwrap();
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
        let plain = weights_over_phase(&cycles, &[], &keys).unwrap();
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

    /// A mean pose and a cycle about it that becomes larger: with its size known it is followed as well as one that does
    /// not, and no key moves.
    #[test]
    fn strides_of_other_sizes_are_followed() {
        let cycles: Vec<f64> = (0..80).map(|t| f64::from(t) / 20.0).collect();
        let amplitude: Vec<f64> = (0..80).map(|t| 0.8 + 0.4 * f64::from(t) / 79.0).collect();
        let keys = [3, 71, 28, 34, 50, 57];
        let moment = |t: usize, size: f64| {
            let turn = std::f64::consts::TAU * cycles[t];
            5.0 + size * (turn.sin() + 0.2 * (2.0 * turn).cos())
        };
        let error = |weights: &Weights, size: &dyn Fn(usize) -> f64| -> f64 {
            let guess = |t: usize| -> f64 {
                weights.row(t).iter().zip(keys).map(|(w, k)| w * moment(k, size(k))).sum()
            };
            let square = |t: usize| (guess(t) - moment(t, size(t))).powi(2);
            ((0..80).map(square).sum::<f64>() / 80.0).sqrt()
        };
        let plain = weights_over_phase(&cycles, &[], &keys).unwrap();
        let sized = weights_over_phase(&cycles, &amplitude, &keys).unwrap();
        let steady = error(&plain, &|_| 1.0);
        let (unseen, seen) = (error(&plain, &|t| amplitude[t]), error(&sized, &|t| amplitude[t]));
        assert!(unseen > 1.8 * steady && seen < 1.1 * steady, "{unseen} {seen} {steady}");
        for (k, &frame) in keys.iter().enumerate() {
            assert!((sized.row(frame)[k] - 1.0).abs() < 1e-12);
        }
        assert!(sized.sums().iter().all(|s| (s - 1.0).abs() < 1e-12));
        assert_eq!(weights_over_phase(&cycles, &[1.0; 80], &keys).unwrap(), plain);
        let mirrored = weights_over_mirrored(&cycles, &amplitude, &keys).unwrap();
        assert!(mirrored.sums().iter().all(|s| (s - 1.0).abs() < 1e-9));
        for (k, &frame) in keys.iter().enumerate() {
            assert!((mirrored.row(frame)[k] - 1.0).abs() < 1e-3);
        }
    }

    #[test]
    fn keys_outside_or_twice_are_refused() {
        let cycles = [0.0, 0.1, 0.2];
        assert!(weights_over_phase(&cycles, &[], &[3]).is_err());
        assert!(weights_over_phase(&cycles, &[], &[1, 1]).is_err());
        assert!(weights_over_phase(&cycles, &[], &[]).is_err());
    }
}
