//! Whether the animal is seen ever more from another side while it goes on as before.
//!
//! Points on the animal then move in the picture by their steps and, slowly, by the turn of the view; poses drawn over
//! the frames do the same. Interpolation that only repeats the stride would put poses of the clip's beginning at its
//! end.

use std::ops::Range;

use super::drift::ShapeDrift;
use crate::gait::GaitPhase;
use crate::numeric::Coefficients;

/// Share of the silhouettes' variance in a straight line over the clip, besides the cycle, from which the view drifts.
/// Of the rigs' steady and unsteady clips it is .0017 at most; of a horse that walks past a camera, by too little for
/// its drift to lead the components, .06.
const LEAST_LINE_SHARE: f64 = 0.03;

/// How far the view has drifted at each frame: time in standard deviations about its mean over the used frames, held
/// outside `frames`; `None` where it does not. `scores` are those of all frames, `gait` the phase of `frames`.
pub(super) fn view_drift(
    scores: &Coefficients,
    variance_shares: &[f64],
    used: &[bool],
    frames: &Range<usize>,
    gait: &GaitPhase,
    removed: Option<ShapeDrift>,
) -> Option<Vec<f64>> {
    let times: Vec<usize> = frames.clone().filter(|&t| used[t]).collect();
    let count = times.len() as f64;
    let mean = times.iter().map(|&t| t as f64).sum::<f64>() / count;
    let spread = times.iter().map(|&t| (t as f64 - mean).powi(2)).sum::<f64>();
    let drifts = removed.is_some_and(|d| d.removed)
        || line_share(scores, variance_shares, &times, frames.start, gait) >= LEAST_LINE_SHARE;
    let place = |t: usize| {
        let held = t.clamp(frames.start, frames.end - 1) as f64;
        (held - mean) / (spread / count).sqrt()
    };
    (drifts && spread > 0.0).then(|| (0..used.len()).map(place).collect())
}

/// Share of the scores' variance that a straight line explains of what the cycle leaves.
fn line_share(
    scores: &Coefficients,
    shares: &[f64],
    times: &[usize],
    first: usize,
    gait: &GaitPhase,
) -> f64 {
    let count = times.len() as f64;
    let middle = times.iter().map(|&t| t as f64).sum::<f64>() / count;
    let moment: f64 = times.iter().map(|&t| (t as f64 - middle).powi(2)).sum();
    let (mut line, mut all) = (0.0, 0.0);
    for (c, share) in shares.iter().enumerate().filter(|(_, s)| **s > 0.0) {
        let mean = times.iter().map(|&t| scores.point(t)[c]).sum::<f64>() / count;
        let mut slope = 0.0;
        for &t in times {
            let value = scores.point(t)[c] - mean;
            // The cycle's values are weighted by the root of the share.
            let (cycle, _) = gait.cycle.at(gait.stride_cycles[t - first]);
            slope += (t as f64 - middle) * (value - cycle[c] / share.sqrt());
            all += share * value * value;
        }
        line += share * slope * slope / moment.max(f64::MIN_POSITIVE);
    }
    line / all.max(f64::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::gait::Symmetry;

    fn drift_of(slope: f64) -> Option<Vec<f64>> {
        let rows: Vec<f64> = (0..80)
            .flat_map(|t| {
                let (sin, cos) = (TAU * t as f64 / 13.0).sin_cos();
                [1.4 * sin + slope * (t as f64 - 39.5) / 23.0, 1.4 * cos]
            })
            .collect();
        let scores = Coefficients::from_rows(80, 2, rows).unwrap();
        let (shares, used) = ([0.6, 0.4], [true; 80]);
        let own = Symmetry::Asymmetric;
        let gait = GaitPhase::measure(&scores, &shares, &used, own, Some(1.0 / 13.0)).unwrap();
        view_drift(&scores, &shares, &used, &(0..80), &gait, None)
    }

    #[test]
    fn a_line_besides_the_cycle_is_a_drift_and_its_absence_none() {
        assert_eq!(drift_of(0.0), None);
        let drift = drift_of(0.6).unwrap();
        let mean = drift.iter().sum::<f64>() / 80.0;
        let spread = drift.iter().map(|d| d * d).sum::<f64>() / 80.0;
        assert!(mean.abs() < 1e-9 && (spread - 1.0).abs() < 1e-9);
        assert!(drift.windows(2).all(|w| w[1] > w[0]));
    }
}
