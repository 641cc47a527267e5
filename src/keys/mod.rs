//! Which frames are worth posing: the m of n frames whose Gaussian kernel matrix H has the
//! smallest condition number, found exactly.
//!
//! The paper (section 3.1) ranks by cond(HᵀH) and tries all n-choose-m sets. H is symmetric
//! positive definite, so cond(HᵀH) = cond(H)² and the order is the same; branch and bound finds
//! the same minimiser without trying most sets, and knows when it has proven it.
//!
//! # What "proven" means
//! Sets are refused only when a factorisation shows that their condition exceeds the best found by
//! more than a relative 1e-9 (or condition · 1e-14, whichever is larger), with a margin above the
//! rounding error of the factorisation. All sets within that share of the optimum count as equal,
//! and of these the one with the lexicographically smallest sorted frame list is returned.
//! Therefore a proven result is the same for any number of threads and any machine speed. An
//! unproven one (time limit) is the best of a seeded search and what the proof met on its way. With
//! a single key every frame is as good as any other: it is the first admissible one.
//!
//! # What it costs
//! Processor seconds to the proof on noisy rings in two dimensions: 4 of 1000 0.7, 6 of 300 1.1,
//! 8 of 100 0.8, 8 of 137 3.4 (`cargo bench --bench keys`, `docs/performance.md`). It grows
//! exponentially with the number of keys; memory grows with the square of the number of frames.
//! On a single component conditions are large and bounds weak: 8 of 100 take minutes.

mod budget;
mod circle;
mod condition;
mod cycle;
mod expected;
mod factor;
mod graph;
mod incumbent;
mod node;
mod on_drift;
mod on_mirror;
mod on_phase;
mod partners;
mod problem;
mod search;
mod watch;

#[cfg(test)]
mod tests;

use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

use crate::numeric::{Coefficients, DEFAULT_ALPHA};
use crate::{Error, Result};

use problem::Problem;

pub use budget::{BudgetLine, ExpectedDegrees, pose_budget, pose_budget_on_mirror};
pub use cycle::cycle_order;
pub use on_drift::choose_keys_on_drift;
pub use on_mirror::choose_keys_on_mirror;
pub use on_phase::{PhaseKeySettings, PhaseKeys, PhasedFrames, choose_keys_on_phase};
pub use partners::{Partner, PartnerSettings, propose_partners};

/// The largest number of keys that can be asked for.
pub const MAX_KEYS: usize = 24;

/// What to choose and how long to try.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct KeySettings {
    /// Number of keys m, 1 to [`MAX_KEYS`]. Default: 4, the paper's choice for running gaits (8 for
    /// walks).
    pub keys: usize,
    /// alpha of the Gaussian exp(−alpha·r²), above 0. Default: ln 2.
    pub alpha: f64,
    /// Frames (from 0) never chosen. Default: none.
    pub exclude: Vec<usize>,
    /// Frames (from 0) always chosen. Default: none.
    pub force: Vec<usize>,
    /// Least distance in time of two keys, frames; 0 and 1 mean no constraint. Default: 1.
    pub min_spacing_frames: usize,
    /// Wall time after which the best set and the bound so far are returned, seconds; infinity is
    /// allowed. Default: 30.
    pub time_limit_s: f64,
    /// Pairs of frames the proof may look at before the best set and the bound so far are returned.
    /// Unlike time it ends the search at the same place on every machine. Default: no limit.
    pub pair_limit: u64,
    /// Number of random starts of the local search that finds the first set. Default: 32.
    pub restarts: usize,
    /// Seed of the random starts. Default: 42.
    pub seed: u64,
}

impl Default for KeySettings {
    fn default() -> Self {
        Self {
            keys: 4,
            alpha: DEFAULT_ALPHA,
            exclude: Vec::new(),
            force: Vec::new(),
            min_spacing_frames: 1,
            time_limit_s: 30.0,
            pair_limit: u64::MAX,
            restarts: 32,
            seed: 42,
        }
    }
}

/// The chosen frames and what is known about them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct KeyChoice {
    /// The key frames, ascending, counted from 0.
    pub frames: Vec<usize>,
    /// cond(H), the ratio of the largest to the smallest eigenvalue; at least 1.
    pub condition: f64,
    /// cond(HᵀH) = cond(H)², the number the paper minimises.
    pub condition_squared: f64,
    /// Whether it is proven that no admissible set has a smaller condition (to the tolerance in
    /// the module documentation).
    pub proven_optimal: bool,
    /// No admissible set has a condition cond(H) below this; equals `condition` when proven.
    pub lower_bound: f64,
}

/// Chooses the key frames of a clip: the exact minimiser of cond(H), H_ij = exp(−alpha·|p_i − p_j|²),
/// unless the time limit strikes first.
///
/// `coefficients`: the frames' points, each component scaled to unit standard deviation.
/// `progress(done, total)` is called from any thread a few times a second with the milliseconds
/// spent and those allowed by the time limit (0 when there is none): how far a proof has come
/// cannot be told. When it returns `false` the search ends with [`Error::Interrupted`].
///
/// # Errors
/// Settings out of range, constraints that contradict each other, fewer distinct frames than keys,
/// coefficients that are not finite, interruption.
pub fn choose_keys(
    coefficients: &Coefficients,
    settings: &KeySettings,
    progress: &(dyn Fn(usize, usize) -> bool + Sync),
) -> Result<KeyChoice> {
    let start = Instant::now();
    let problem = Problem::new(coefficients, settings)?;
    let deadline = Duration::try_from_secs_f64(settings.time_limit_s)
        .ok()
        .and_then(|limit| start.checked_add(limit));
    let watch = watch::Watch::new(deadline, settings.pair_limit, progress);
    let first = incumbent::local_search(&problem, settings.restarts, settings.seed, &watch);
    let outcome = search::prove(&problem, first, &watch);
    if watch.interrupted() {
        return Err(Error::Interrupted);
    }
    let (condition, frames) = outcome.best.ok_or(Error::NoRegularKeys { keys: settings.keys })?;
    Ok(KeyChoice {
        frames,
        condition,
        condition_squared: condition * condition,
        proven_optimal: outcome.proven,
        lower_bound: if outcome.proven { condition } else { outcome.lower_bound.min(condition) },
    })
}
