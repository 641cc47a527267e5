//! The pose budget: what error to expect with so many keys, before any is posed.
//!
//! The share of the motion that the interpolation will miss follows from the phases of the frames
//! (`on_phase.rs`). How large the motion is, only its poses know; what the outline sweeps
//! over says it roughly. The error in degrees is therefore a calibrated guess with a spread:
//!
//! error ≈ 37° · share^1.1 · sweep^0.5
//!
//! fitted to 14 gaits of six animals, yaw 0, 20, 45 and −20, 2 to 12 keys (`examples/budget.rs`, docs/phase.md).
//! With the animal that is predicted left out of the fit, the logarithm of the error is off by
//! .43 root mean square, a factor of 1.54.

use std::ops::RangeInclusive;

use serde::{Deserialize, Serialize};

use super::circle::{Circle, Turn};
use super::on_mirror::Circles;
use super::on_phase::{PhaseKeySettings, PhasedFrames};
use crate::Result;

/// The factor and the exponents of the fit.
const SCALE_DEG: f64 = 37.0;
const SHARE_EXPONENT: f64 = 1.1;
const SWEEP_EXPONENT: f64 = 0.5;

/// One standard deviation of the true error about the expected one, as a factor either way.
const SPREAD: f64 = 1.54;

/// What to expect with a number of keys.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BudgetLine {
    /// Number of keys.
    pub keys: usize,
    /// Error expected as a share of the motion's deviation from its mean pose (root mean square).
    pub expected_error_share: f64,
    /// The same in degrees; `None` where it is not known what the outline sweeps over.
    #[serde(default)]
    pub expected_error_deg: Option<ExpectedDegrees>,
}

/// A mean error over frames and joints as it can be expected, degrees.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ExpectedDegrees {
    /// As likely to be too small as too large.
    pub likely: f64,
    /// Two thirds of the motions lie between this …
    pub low: f64,
    /// … and this.
    pub high: f64,
}

impl ExpectedDegrees {
    /// `share`: the error as a share of the motion, over 0. `sweep`: variance of the pixels that
    /// the gait's cycle explains (pixels²) over the animal's area (pixels), over 0.
    #[must_use]
    pub fn of(share: f64, sweep: f64) -> Self {
        let likely =
            SCALE_DEG * share.max(0.0).powf(SHARE_EXPONENT) * sweep.max(0.0).powf(SWEEP_EXPONENT);
        Self { likely, low: likely / SPREAD, high: likely * SPREAD }
    }
}

/// The expected error with each number of keys that can be had, from `counts`: what one more pose
/// would gain. Numbers that the constraints do not allow are left out. `sweep` as in
/// [`ExpectedDegrees::of`].
///
/// # Errors
/// As [`choose_keys_on_phase`](super::choose_keys_on_phase), except for numbers.
pub fn pose_budget(
    frames: PhasedFrames<'_>,
    settings: &PhaseKeySettings,
    counts: RangeInclusive<usize>,
    sweep: Option<f64>,
) -> Result<Vec<BudgetLine>> {
    let circle = Circle::new(frames, &most_keys(settings, &counts), Turn::Stride)?;
    let share = |keys| circle.shortest(keys).map(|(cost, _)| cost.max(0.0).sqrt());
    Ok(lines(counts, sweep, share))
}

/// The same of a gait whose left and right are alike, each pose counting with the sides exchanged too.
///
/// # Errors
/// As [`pose_budget`].
pub fn pose_budget_on_mirror(
    frames: PhasedFrames<'_>,
    settings: &PhaseKeySettings,
    counts: RangeInclusive<usize>,
    sweep: Option<f64>,
) -> Result<Vec<BudgetLine>> {
    let circles = Circles::new(frames, &most_keys(settings, &counts))?;
    Ok(lines(counts, sweep, |keys| circles.best(keys).map(|k| k.expected_error_share)))
}

fn most_keys(settings: &PhaseKeySettings, counts: &RangeInclusive<usize>) -> PhaseKeySettings {
    let keys = (*counts.end()).max(settings.force.len());
    PhaseKeySettings { keys, ..settings.clone() }
}

fn lines(
    counts: RangeInclusive<usize>,
    sweep: Option<f64>,
    share: impl Fn(usize) -> Option<f64>,
) -> Vec<BudgetLine> {
    let line = |keys: usize| {
        let share = share(keys)?;
        Some(BudgetLine {
            keys,
            expected_error_share: share,
            expected_error_deg: sweep.map(|s| ExpectedDegrees::of(share, s)),
        })
    };
    counts.filter_map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_larger_motion_and_a_larger_share_mean_more_degrees_within_the_spread() {
        let walk = ExpectedDegrees::of(0.077, 0.12);
        let gallop = ExpectedDegrees::of(0.077, 0.22);
        let fewer = ExpectedDegrees::of(0.23, 0.12);
        assert!(walk.likely < gallop.likely && gallop.likely < fewer.likely);
        for expected in [walk, gallop, fewer] {
            assert!((expected.high / expected.low - SPREAD * SPREAD).abs() < 1e-12);
        }
        // 37 · .077^1.1 · .12^.5, worked out by hand with logarithms.
        assert!((walk.likely - 0.764).abs() < 0.002, "{}", walk.likely);
    }
}
