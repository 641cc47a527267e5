//! Weights on another time grid: resampled, or as one seamless loop averaged over the strides seen.
//!
//! Both are linear in the weights and keep the sum of a frame's weights where it is constant, so that
//! what comes out is a table of weights as good as what went in: every frame stays a weighted sum of poses.

use nalgebra::{Cholesky, DMatrix};

use crate::error::{Error, Result};
use crate::numeric::median;

/// Width in strides of the Gaussian over which the phase is evened: about the least that takes out
/// what repeats once a stride (a factor exp(−2π²σ²) = .007 of it is left).
const EVENING_STRIDES: f64 = 0.5;

/// Fewest knots of the loop's spline, for clips of very few frames a stride.
const LEAST_KNOTS: usize = 6;

/// Weight of the spline's squared second differences against one frame. It only decides what
/// phases that no frame shows; of a curve with three harmonics at 24 frames a stride it takes 3·10⁻⁴.
const ROUGHNESS: f64 = 1e-3;

/// Weights at other times: row `i` of the result is at source frame `i · step_frames`.
///
/// `values` holds `poses` weights a frame, row by row. Cubic Hermite interpolation with central
/// differences as slopes (Catmull and Rom 1974), one-sided at the ends: it goes through the frames'
/// own weights. The result ends at the last time not after the last frame.
///
/// # Panics
/// When `values` is not made of whole rows, or `step_frames` is not positive and finite.
#[must_use]
pub fn resample(values: &[f64], poses: usize, step_frames: f64) -> Vec<f64> {
    assert!(poses > 0 && values.len().is_multiple_of(poses), "whole rows");
    assert!(step_frames.is_finite() && step_frames > 0.0, "a positive step");
    let frames = values.len() / poses;
    let Some(last) = frames.checked_sub(1) else { return Vec::new() };
    // A time that rounding puts just behind the last frame is that frame.
    let count = (last as f64 / step_frames + 1e-9).floor() as usize + 1;
    let at = |t: usize, k: usize| values[t * poses + k];
    let slope = |t: usize, k: usize| {
        let (before, after) = (t.saturating_sub(1), (t + 1).min(last));
        (at(after, k) - at(before, k)) / (after - before).max(1) as f64
    };
    let mut out = Vec::with_capacity(count * poses);
    for i in 0..count {
        let time = (i as f64 * step_frames).min(last as f64);
        let t = (time.floor() as usize).min(last);
        let u = time - t as f64;
        let next = (t + 1).min(last);
        let (u2, u3) = (u * u, u * u * u);
        out.extend((0..poses).map(|k| {
            (2.0 * u3 - 3.0 * u2 + 1.0) * at(t, k)
                + (3.0 * u2 - 2.0 * u3) * at(next, k)
                + (u3 - 2.0 * u2 + u) * slope(t, k)
                + (u3 - u2) * slope(next, k)
        }));
    }
    out
}

/// The phase as an even clock: local lines through the phases about each frame, weighted by a
/// Gaussian half a stride wide. What the measured phase does within a stride (the trajectory is no
/// circle) would be played back as a change of speed; a change of speed over strides stays.
#[must_use]
pub fn evened(phase_cycles: &[f64]) -> Vec<f64> {
    let frames = phase_cycles.len();
    let Some(rate) = mean_rate(phase_cycles) else { return phase_cycles.to_vec() };
    let width = EVENING_STRIDES / rate;
    (0..frames)
        .map(|t| {
            let mut sums = [0.0; 5];
            for (s, phase) in phase_cycles.iter().enumerate() {
                let d = s as f64 - t as f64;
                let w = (-0.5 * (d / width).powi(2)).exp();
                for (sum, term) in sums.iter_mut().zip([1.0, d, d * d, *phase, d * phase]) {
                    *sum += w * term;
                }
            }
            let [n, x, xx, y, xy] = sums;
            (xx * y - x * xy) / (n * xx - x * x)
        })
        .collect()
}

/// Mean advance a frame, cycles; `None` unless the phase moves on. The median over all pairs of
/// frames half a clip apart, since a phase is least sure at the ends.
fn mean_rate(phase_cycles: &[f64]) -> Option<f64> {
    let apart = phase_cycles.len() / 2;
    let advances: Vec<f64> = (0..phase_cycles.len() - apart)
        .map(|t| (phase_cycles[t + apart] - phase_cycles[t]) / apart as f64)
        .collect();
    let rate = median(&advances);
    (rate.is_finite() && rate > 0.0).then_some(rate)
}

/// Weights of a loop.
#[derive(Clone, Debug, PartialEq)]
pub struct Loop {
    /// Weights of the loop, row by row; the last row equals the first.
    pub values: Vec<f64>,
    /// Strides in the clip.
    pub strides_seen: f64,
}

/// Frames of the clip that `strides` strides take, from the mean advance of the phase; `None` unless
/// the phase moves on.
#[must_use]
pub fn loop_frames(phase_cycles: &[f64], strides: usize) -> Option<f64> {
    mean_rate(phase_cycles).map(|rate| strides as f64 / rate)
}

/// One seamless loop of `strides` strides, averaged over the strides seen, as `intervals` + 1 rows
/// evenly spaced in phase, the last equal to the first.
///
/// `values` holds `poses` weights a frame; `phase_cycles` the phase of each frame in strides, growing.
/// Every weight is the periodic cubic spline over the phase modulo `strides`, with one knot a frame
/// of the loop, that is nearest to all frames in the sense of least squares (de Boor, *A Practical
/// Guide to Splines*, 1978, chapter XIV, with the differences of coefficients as penalty after Eilers and
/// Marx 1996). At each phase that is an average over the strides, and being twice continuously
/// differentiable round the circle it has no seam in value or velocity. The loop begins at the
/// phase of the first frame.
///
/// # Errors
/// [`Error::LoopTooShort`] when the clip holds fewer strides than the loop, to half a frame.
///
/// # Panics
/// When `values` and `phase_cycles` differ in frames.
pub fn seamless(
    values: &[f64],
    poses: usize,
    phase_cycles: &[f64],
    strides: usize,
    intervals: usize,
) -> Result<Loop> {
    assert_eq!(values.len(), poses * phase_cycles.len(), "one row a frame");
    let frames = phase_cycles.len();
    let rate = mean_rate(phase_cycles).unwrap_or(0.0);
    // Each frame stands for the time until the next one.
    let strides_seen = rate * frames as f64;
    if strides == 0 || strides_seen + 0.5 * rate < strides as f64 {
        return Err(Error::LoopTooShort { strides, seen: strides_seen });
    }
    let knots = ((strides as f64 / rate).round() as usize).max(LEAST_KNOTS);
    let place = |phase: f64| (phase / strides as f64).rem_euclid(1.0) * knots as f64;
    let mut normal = DMatrix::<f64>::zeros(knots, knots);
    let mut right = DMatrix::<f64>::zeros(knots, poses);
    for (t, phase) in phase_cycles.iter().enumerate() {
        let basis = basis(place(phase - phase_cycles[0]), knots);
        for &(i, a) in &basis {
            for &(j, b) in &basis {
                normal[(i, j)] += a * b;
            }
            for k in 0..poses {
                right[(i, k)] += a * values[t * poses + k];
            }
        }
    }
    for i in 0..knots {
        let terms = [(i, 1.0), ((i + 1) % knots, -2.0), ((i + 2) % knots, 1.0)];
        for (a, x) in terms {
            for (b, y) in terms {
                normal[(a, b)] += ROUGHNESS * x * y;
            }
        }
    }
    // The sum of frames and penalty is positive definite: only constants have no roughness.
    let Some(factor) = Cholesky::new(normal) else {
        return Err(Error::LoopTooShort { strides, seen: strides_seen });
    };
    let coefficients = factor.solve(&right);
    let mut out = Vec::with_capacity((intervals + 1) * poses);
    for i in 0..intervals {
        let basis = basis(knots as f64 * i as f64 / intervals as f64, knots);
        out.extend(
            (0..poses)
                .map(|k| -> f64 { basis.iter().map(|&(j, b)| b * coefficients[(j, k)]).sum() }),
        );
    }
    out.extend_from_within(..poses.min(out.len()));
    Ok(Loop { values: out, strides_seen })
}

/// The four cubic B-splines on a circle of `knots` that are not zero at a place, with their values.
fn basis(place: f64, knots: usize) -> [(usize, f64); 4] {
    let cell = place.floor();
    let u = place - cell;
    let v = 1.0 - u;
    let values = [
        v * v * v,
        3.0 * u * u * u - 6.0 * u * u + 4.0,
        3.0 * v * v * v - 6.0 * v * v + 4.0,
        u * u * u,
    ];
    std::array::from_fn(|i| ((cell as usize + i) % knots, values[i] / 6.0))
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use proptest::prelude::*;

    use super::*;

    /// Three weights that sum to one, with two harmonics.
    fn row(phase: f64) -> [f64; 3] {
        let a = 0.3 + 0.4 * (TAU * phase).sin() + 0.1 * (2.0 * TAU * phase).cos();
        let b = 0.3 - 0.3 * (TAU * (phase - 0.1)).cos();
        [a, b, 1.0 - a - b]
    }

    fn clip(frames: usize, period: f64) -> (Vec<f64>, Vec<f64>) {
        let phase: Vec<f64> = (0..frames).map(|t| 0.37 + t as f64 / period).collect();
        (phase.iter().flat_map(|&p| row(p)).collect(), phase)
    }

    #[test]
    fn the_loop_of_a_planted_cycle_is_the_cycle() {
        for (frames, period, worst) in [(100, 24.3, 0.003), (60, 17.7, 0.006), (25, 24.3, 0.01)] {
            let (values, phase) = clip(frames, period);
            let made = seamless(&values, 3, &phase, 1, 40).unwrap();
            for (i, found) in made.values.chunks(3).enumerate() {
                let true_row = row(0.37 + i as f64 / 40.0);
                for (f, t) in found.iter().zip(true_row) {
                    assert!((f - t).abs() < worst, "{frames} frames, {i}: {f} {t}");
                }
                assert!((found.iter().sum::<f64>() - 1.0).abs() < 1e-9);
            }
            assert_eq!(made.values[..3], made.values[40 * 3..]);
        }
    }

    #[test]
    fn noise_is_averaged_over_the_strides_and_drift_closed() {
        let mut state = 7_u64;
        let mut noise = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (state >> 33) as f64 / f64::from(1_u32 << 31) - 0.5
        };
        let error = |frames: usize, noise: &mut dyn FnMut() -> f64| {
            let (mut values, phase) = clip(frames, 24.3);
            values.iter_mut().for_each(|v| *v += 0.2 * noise());
            let made = seamless(&values, 3, &phase, 1, 40).unwrap().values;
            let off = |i: usize| made[3 * i] - row(0.37 + i as f64 / 40.0)[0];
            ((0..40).map(|i| off(i).powi(2)).sum::<f64>() / 40.0).sqrt()
        };
        let (one, eight) = (error(25, &mut noise), error(8 * 25, &mut noise));
        assert!(eight < 0.6 * one, "{one} {eight}");

        // A weight that only drifts has no seam in value or velocity either.
        let phase: Vec<f64> = (0..50).map(|t| f64::from(t) / 12.5).collect();
        let drift: Vec<f64> = (0..50).map(|t| f64::from(t) / 50.0).collect();
        let made = seamless(&drift, 1, &phase, 1, 200).unwrap().values;
        let jump = (made[1] - made[0]) - (made[200] - made[199]);
        let steps: Vec<f64> = made.windows(2).map(|w| (w[1] - w[0]).abs()).collect();
        assert!(jump.abs() < 0.2 * steps.iter().copied().fold(0.0, f64::max), "{jump}");
    }

    #[test]
    fn several_strides_keep_what_differs_between_them() {
        let phase: Vec<f64> = (0..120).map(|t| f64::from(t) / 15.0).collect();
        let values: Vec<f64> = phase.iter().map(|p| (TAU * p / 2.0).cos()).collect();
        let two = seamless(&values, 1, &phase, 2, 30).unwrap().values;
        assert!((two[15] + 1.0).abs() < 0.01 && (two[0] - 1.0).abs() < 0.01);
        let one = seamless(&values, 1, &phase, 1, 30).unwrap().values;
        assert!(one.iter().all(|w| w.abs() < 0.05), "the two kinds of stride cancel");
    }

    #[test]
    fn a_clip_of_less_than_the_loop_is_refused() {
        let (values, phase) = clip(20, 24.3);
        let error = seamless(&values, 3, &phase, 1, 24).unwrap_err();
        assert!(matches!(error, Error::LoopTooShort { strides: 1, seen } if seen < 0.9));
        // One stride of 12 frames whose thirteenth would be the first again.
        let (values, phase) = clip(12, 12.0);
        assert!(seamless(&values, 3, &phase, 1, 24).is_ok());
        assert!(seamless(&[1.0; 12], 1, &[0.5; 12], 1, 24).is_err(), "no motion");
    }

    #[test]
    fn an_uneven_phase_becomes_even_and_a_change_of_speed_stays() {
        let steady: Vec<f64> = (0..120).map(|t| f64::from(t) / 24.0).collect();
        let wavy: Vec<f64> = steady.iter().map(|p| p + 0.05 * (2.0 * TAU * p).sin()).collect();
        for (found, wanted) in evened(&wavy).iter().zip(&steady).skip(24).take(72) {
            assert!((found - wanted).abs() < 0.004, "{found} {wanted}");
        }
        let faster: Vec<f64> = steady.iter().map(|p| p + 0.01 * p * p).collect();
        for (found, wanted) in evened(&faster).iter().zip(&faster).skip(24).take(72) {
            assert!((found - wanted).abs() < 0.005, "{found} {wanted}");
        }
    }

    proptest! {
        #[test]
        fn resampling_goes_through_the_frames_and_keeps_lines(
            values in prop::collection::vec(-1.0..1.0_f64, 2..40), slope in -1.0..1.0_f64,
            step in 0.11..2.5_f64,
        ) {
            let same = resample(&values, 1, 1.0);
            prop_assert_eq!(&same, &values);
            let halves = resample(&values, 1, 0.5);
            prop_assert_eq!(halves.len(), 2 * values.len() - 1);
            for (t, v) in values.iter().enumerate() {
                prop_assert!((halves[2 * t] - v).abs() < 1e-12);
            }
            let line: Vec<f64> = (0..values.len()).map(|t| 3.0 + slope * t as f64).collect();
            for (i, v) in resample(&line, 1, step).iter().enumerate() {
                prop_assert!((v - 3.0 - slope * step * i as f64).abs() < 1e-9);
            }
        }
    }
}
