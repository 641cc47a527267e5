//! The best round trip over a number of candidates on a circle of phases, by dynamic programming.

use super::expected::Motion;
use super::on_phase::{PhaseKeySettings, PhasedFrames};
use crate::{Error, Result};

/// Frames that are considered; of a longer clip the most trusted one in each of as many equal
/// parts of the cycle.
const MOST_CANDIDATES: usize = 360;

/// A frame trusted less than this is no key unless the user names it.
const LEAST_TRUST: f64 = 0.5;

/// What a step from a key to the next costs, as a square share of the motion, when both are of the same half of the
/// stride: what left and right do differently is better seen evenly over the stride.
const SAME_HALF_COST: f64 = 0.01;

/// What one turn of the circle is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Turn {
    /// A stride.
    Stride,
    /// A step, half a stride: each key counts for the other half too, with the sides exchanged.
    Step,
}

/// The candidates in the order of their phase, and the cost of every gap between two of them.
pub(super) struct Circle {
    frames: Vec<usize>,
    turn: Turn,
    /// Phase within the turn, strides.
    phases: Vec<f64>,
    /// Whether a candidate is of the second half of its stride.
    second: Vec<bool>,
    forced: Vec<bool>,
    /// `costs[a * n + b]`: from candidate a forward to candidate b (a full turn for b = a);
    /// infinite where a forced candidate lies between or the two are too near in time.
    costs: Vec<f64>,
}

impl Circle {
    pub(super) fn new(
        frames: PhasedFrames<'_>,
        settings: &PhaseKeySettings,
        turn: Turn,
    ) -> Result<Self> {
        let n = frames.cycles.len();
        if settings.keys == 0
            || settings.keys > super::MAX_KEYS
            || settings.force.len() > settings.keys
        {
            return Err(Error::setting(
                "keys.count",
                "is 1 to 24, and no fewer than the frames that must be keys",
            ));
        }
        if let Some(&frame) = settings.force.iter().chain(&settings.exclude).find(|f| **f >= n) {
            return Err(Error::KeyFrameOutOfRange { frame, frames: n });
        }
        if settings.force.iter().any(|f| settings.exclude.contains(f)) {
            return Err(Error::setting("keys.include", "names no frame that keys.exclude names"));
        }
        let mut chosen = candidates(&frames, settings);
        let place = |t: usize| frames.cycles[t].rem_euclid(turn.strides());
        chosen.sort_by(|&a, &b| place(a).total_cmp(&place(b)).then(a.cmp(&b)));
        let mut circle = Self {
            turn,
            phases: chosen.iter().map(|&t| place(t)).collect(),
            second: chosen.iter().map(|&t| frames.cycles[t].rem_euclid(1.0) >= 0.5).collect(),
            forced: chosen.iter().map(|t| settings.force.contains(t)).collect(),
            frames: chosen,
            costs: Vec::new(),
        };
        circle.costs = circle.all_costs(&frames, settings.min_spacing_frames);
        Ok(circle)
    }

    fn all_costs(&self, frames: &PhasedFrames<'_>, spacing: usize) -> Vec<f64> {
        let n = self.frames.len();
        let motion = Motion::new(frames.silhouette);
        let mut costs = vec![f64::INFINITY; n * n];
        for a in 0..n {
            let turned = motion.turned(self.phases[a]);
            for step in 1..=n {
                let b = (a + step) % n;
                let near = self.frames[a].abs_diff(self.frames[b]) < spacing && step < n;
                if !near {
                    let gap = self.gap(a, step);
                    let phase_error = [a, b]
                        .iter()
                        .map(|&i| frames.deviation_cycles[self.frames[i]].powi(2))
                        .sum::<f64>()
                        / 2.0;
                    let off = self.turn.times() * gap * motion.speed_sq * phase_error;
                    let both = self.turn == Turn::Step;
                    let same = if self.same_half(a, b) { SAME_HALF_COST } else { 0.0 };
                    costs[a * n + b] = motion.gap_error(&turned, gap, both) + off + same;
                }
                if self.forced[b] {
                    break;
                }
            }
        }
        costs
    }

    /// Whether a key counts for both halves of the stride and `a` and its successor `b` are of the same one.
    fn same_half(&self, a: usize, b: usize) -> bool {
        // Past the end of the turn the other half begins.
        self.turn == Turn::Step && self.second[a] == (self.second[b] != (b <= a))
    }

    /// Phase from candidate `a` forward by `step` candidates, strides.
    fn gap(&self, a: usize, step: usize) -> f64 {
        let n = self.frames.len();
        if step == n {
            return self.turn.strides();
        }
        (self.phases[(a + step) % n] - self.phases[a]).rem_euclid(self.turn.strides())
    }

    /// The cheapest round trip over `keys` candidates: its cost and its frames, ascending. Every trip passes each forced
    /// candidate; without any, every candidate is tried as the first.
    pub(super) fn shortest(&self, keys: usize) -> Option<(f64, Vec<usize>)> {
        let n = self.frames.len();
        if n < keys || keys == 0 || keys < self.forced.iter().filter(|f| **f).count() {
            return None;
        }
        let starts = match self.forced.iter().position(|f| *f) {
            Some(first) => first..first + 1,
            None => 0..n,
        };
        let mut best: Option<(f64, Vec<usize>)> = None;
        for start in starts {
            // A trip is found from any of its keys; its lowest one will do, which lies in the
            // first of the n / keys parts only if gaps were even, so all are tried.
            let limit = best.as_ref().map_or(f64::INFINITY, |b| b.0);
            if let Some(found) = self.trip(start, keys, limit) {
                best = Some(found);
            }
        }
        best.map(|(cost, trip)| {
            let mut frames: Vec<usize> = trip.into_iter().map(|i| self.frames[i]).collect();
            frames.sort_unstable();
            (cost, frames)
        })
    }

    /// The cheapest trip from `start` round to itself, if it costs less than `limit`. Candidates
    /// before `start` were starts themselves, so the trip need not pass them unless one is forced.
    fn trip(&self, start: usize, keys: usize, limit: f64) -> Option<(f64, Vec<usize>)> {
        let n = self.frames.len();
        let last = if self.forced.iter().any(|f| *f) { n } else { n - start };
        // reached[k][i]: cost of being at the i-th candidate after the start with k + 1 keys.
        let mut reached = vec![vec![f64::INFINITY; last]; keys];
        let mut from = vec![vec![0_usize; last]; keys];
        reached[0][0] = 0.0;
        for k in 1..keys {
            for i in k..last {
                let at = (start + i) % n;
                for j in (k - 1)..i {
                    let before = reached[k - 1][j];
                    if before >= limit {
                        continue;
                    }
                    let cost = before + self.costs[(start + j) % n * n + at];
                    if cost < reached[k][i] {
                        reached[k][i] = cost;
                        from[k][i] = j;
                    }
                }
            }
        }
        let close = |i: usize| reached[keys - 1][i] + self.costs[(start + i) % n * n + start];
        let end = (keys - 1..last).min_by(|&a, &b| close(a).total_cmp(&close(b)))?;
        let total = close(end);
        if !(total < limit && total.is_finite()) {
            return None;
        }
        let mut path = vec![end];
        for k in (1..keys).rev() {
            path.push(from[k][path[path.len() - 1]]);
        }
        Some((total, path.into_iter().map(|i| (start + i) % n).collect()))
    }
}

/// Frames that may be keys: trusted and not excluded, or forced.
fn candidates(frames: &PhasedFrames<'_>, settings: &PhaseKeySettings) -> Vec<usize> {
    let all = 0..frames.cycles.len();
    let forced = |t: &usize| settings.force.contains(t);
    let allowed: Vec<usize> = all
        .filter(|t| forced(t) || (frames.trust[*t] >= LEAST_TRUST && !settings.exclude.contains(t)))
        .collect();
    if allowed.len() <= MOST_CANDIDATES {
        return allowed;
    }
    let mut best: Vec<Option<usize>> = vec![None; MOST_CANDIDATES];
    let better = |a: usize, b: usize| {
        let rank = |t: usize| (frames.deviation_cycles[t] / frames.trust[t], t);
        rank(a) < rank(b)
    };
    for &t in allowed.iter().filter(|t| !forced(t)) {
        let part = (frames.cycles[t].rem_euclid(1.0) * MOST_CANDIDATES as f64) as usize;
        let slot = &mut best[part.min(MOST_CANDIDATES - 1)];
        if slot.is_none_or(|b| better(t, b)) {
            *slot = Some(t);
        }
    }
    let mut kept: Vec<usize> = best.into_iter().flatten().chain(settings.force.clone()).collect();
    kept.sort_unstable();
    kept.dedup();
    kept
}

impl Turn {
    /// Length, strides.
    fn strides(self) -> f64 {
        match self {
            Turn::Stride => 1.0,
            Turn::Step => 0.5,
        }
    }

    /// Turns in a stride.
    fn times(self) -> f64 {
        1.0 / self.strides()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::Harmonics;

    #[test]
    fn no_set_is_better_than_the_chosen_one() {
        let n = 14;
        let cycles: Vec<f64> =
            (0..n).map(|t| t as f64 * 0.0731 + 0.004 * (t as f64 * 1.7).sin()).collect();
        let (deviation, trust) = (vec![0.002; n], vec![1.0; n]);
        let harmonics = [(vec![1.0, 0.3], vec![-0.2, 0.9]), (vec![0.4, 0.1], vec![0.3, -0.2])];
        let silhouette = Harmonics::from_parts(&[0.0, 0.0], &harmonics).unwrap();
        let frames = PhasedFrames {
            cycles: &cycles,
            deviation_cycles: &deviation,
            trust: &trust,
            silhouette: &silhouette,
        };
        for (turn, force) in [Turn::Stride, Turn::Step]
            .into_iter()
            .flat_map(|t| [vec![], vec![3], vec![2, 9]].map(|f| (t, f)))
        {
            let settings = PhaseKeySettings {
                keys: 4,
                force: force.clone(),
                min_spacing_frames: 1,
                exclude: vec![5],
            };
            let circle = Circle::new(frames, &settings, turn).unwrap();
            let (cost, found) = circle.shortest(4).unwrap();
            let mut best = f64::INFINITY;
            let m = circle.frames.len();
            for set in 0_u32..1 << m {
                let members: Vec<usize> = (0..m).filter(|i| set >> i & 1 == 1).collect();
                if members.len() == 4 {
                    let cost: f64 =
                        (0..4).map(|k| circle.costs[members[k] * m + members[(k + 1) % 4]]).sum();
                    best = best.min(cost);
                }
            }
            assert!((cost - best).abs() < 1e-12);
            assert!(force.iter().all(|f| found.contains(f)) && !found.contains(&5));
        }
    }
}
