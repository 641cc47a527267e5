//! Where in a clip a steady gait is: stretches that repeat, between stops, jumps and changes of gait.
//!
//! Nothing is assumed of what happens in between. A window of three periods about every half period is
//! asked how much of what moves in it one cycle explains ([`GaitPhase`](super::GaitPhase), but every frame counted, none
//! weighted down), for periods from six frames to a third of the clip; the best period's answer is the
//! *steadiness* of that place. A stop leaves noise, which no cycle explains; about a jump or a change
//! of gait there are two motions, where one cycle is only one. A slow drift, a changing speed and strides
//! of different length leave it high: within three periods they are small.
//!
//! A penalised dynamic programme over the frames then finds the stretches in which the steadiness
//! is high against the clip's own (footage of poor masks is never as steady as a rendering), each
//! change paid for; and the ends of each stretch are laid where the cycle of its inside stops
//! explaining what comes.

use std::ops::Range;

use rayon::prelude::*;

use crate::numeric::{Coefficients, median};

mod still;
mod window;

use window::Rows;

/// Length of a window, periods: two are needed to see anything repeat, a third to contradict it.
const WINDOW_PERIODS: f64 = 3.0;

/// Shortest period that is looked for, frames: key images of a faster rhythm miss its extremes.
const SHORTEST_PERIOD: f64 = 6.0;

/// From one period to the next, a quarter of an octave: the phase's own window follows a frequency that is
/// off by that much.
const PERIOD_STEP: f64 = 1.189_207_115;

/// A clip whose own steadiness is less shows no gait: of noise it is .2 to .35.
const LEAST_STEADINESS: f64 = 0.4;

/// The clip's own steadiness: that of its steadiest fifth.
const OWN_RANK: f64 = 0.8;

/// A place is steady from this share of the clip's own steadiness on: above one half, since where two motions
/// meet one cycle explains the one that fills half of the window, and the more above the less noise there is
/// to make it waver. Over the rigs' steady and unsteady clips no place falls below .90 of the clip's own, of
/// four real horses none below .63 where it is .57; jumps and changes of gait fall to .64 to .1 of .96.
fn steady_share(own: f64) -> f64 {
    0.5 + 0.25 * own
}

/// Cost of a change between steady and not, in periods of a stretch that is all one or the other.
const CHANGE_PERIODS: f64 = 0.2;

/// Periods that a steady stretch has at the least.
const LEAST_PERIODS: f64 = 2.0;

/// Two stretches with nothing between them are one when one cycle explains both at least this share as well
/// as each is by its own.
const ONE_CYCLE: f64 = 0.8;

/// A stretch of a clip.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Stretch {
    /// Its frames.
    pub frames: Range<usize>,
    /// Whether a gait is seen to repeat in it.
    pub steady: bool,
}

/// Cuts a clip into stretches, in order and without gaps. `scores` are of unit deviation, `variance_shares` has
/// one entry a component, `used` says for each frame whether its silhouette counts. One stretch where nothing
/// breaks the gait, and where no gait is seen at all.
#[must_use]
pub fn stretches(scores: &Coefficients, variance_shares: &[f64], used: &[bool]) -> Vec<Stretch> {
    let clip = Rows::new(scores, variance_shares, used);
    let whole = |steady| vec![Stretch { frames: 0..clip.frames(), steady }];
    let Some(profile) = Profile::of(&clip) else { return whole(false) };
    let mut runs = profile.steady_runs();
    if runs.is_empty() {
        return whole(false);
    }
    if runs.len() > 1 || runs[0].frames != (0..clip.frames()) {
        let refined: Vec<Range<usize>> = runs.iter().map(|run| clip.extent(run)).collect();
        for (run, frames) in runs.iter_mut().zip(refined) {
            run.frames = frames;
        }
        settle(&mut runs);
        merge(&clip, &mut runs);
    }
    let runs: Vec<Run> = runs.iter().flat_map(|run| without_stops(&clip, run)).collect();
    fill(&runs, clip.frames())
}

/// A steady stretch under way.
#[derive(Clone, Debug, PartialEq)]
struct Run {
    frames: Range<usize>,
    /// Frames a period.
    period: f64,
}

impl Run {
    fn is_long_enough(&self) -> bool {
        self.frames.len() as f64 >= LEAST_PERIODS * self.period
    }

    /// The same in a clip of `n` frames that runs backwards.
    fn mirrored(&self, n: usize) -> Run {
        Run { frames: n - self.frames.end..n - self.frames.start, period: self.period }
    }
}

/// Steadiness and period of every frame.
struct Profile {
    steadiness: Vec<f64>,
    periods: Vec<f64>,
}

impl Profile {
    /// `None` of a clip too short for a window.
    fn of(clip: &Rows) -> Option<Self> {
        let n = clip.frames();
        let periods: Vec<f64> =
            std::iter::successors(Some(SHORTEST_PERIOD), |p| Some(p * PERIOD_STEP))
                .take_while(|p| WINDOW_PERIODS * p <= n as f64)
                .collect();
        let tracks: Vec<Vec<(f64, f64)>> = periods.par_iter().map(|&p| track(clip, p)).collect();
        if tracks.is_empty() {
            return None;
        }
        let best = |t: usize| {
            let all = tracks.iter().map(|track| track[t]);
            all.fold((0.0, SHORTEST_PERIOD), |a, b| if b.0 > a.0 { b } else { a })
        };
        let (steadiness, periods) = (0..n).map(best).unzip();
        Some(Self { steadiness, periods })
    }

    /// The stretches that are steady, by a penalised dynamic programme.
    fn steady_runs(&self) -> Vec<Run> {
        let n = self.steadiness.len();
        let mut sorted = self.steadiness.clone();
        sorted.sort_by(f64::total_cmp);
        let own = sorted[((n - 1) as f64 * OWN_RANK) as usize];
        if own < LEAST_STEADINESS {
            return Vec::new();
        }
        let limit = steady_share(own) * own;
        let steady: Vec<f64> =
            (0..n).filter(|&t| self.steadiness[t] >= limit).map(|t| self.periods[t]).collect();
        // What a stretch of one period that is steady through and through gains by being called so.
        let change = CHANGE_PERIODS * median(&steady) * (1.0 - steady_share(own));
        let gains: Vec<f64> = self.steadiness.iter().map(|s| (s - limit) / own).collect();
        let mut runs = Vec::new();
        for frames in chosen(&gains, change) {
            let period = median(&self.periods[frames.clone()]);
            // Its ends are not yet where they belong.
            if frames.len() as f64 >= (LEAST_PERIODS - 1.0) * period {
                runs.push(Run { frames, period });
            }
        }
        runs
    }
}

/// Steadiness and measured period of every frame for windows of three periods of about `period` frames: between the
/// middles of windows linear, beyond the first and last as they are.
fn track(clip: &Rows, period: f64) -> Vec<(f64, f64)> {
    let n = clip.frames();
    let length = (WINDOW_PERIODS * period).round().min(n as f64) as usize;
    let hop = period / 2.0;
    let count = ((n - length) as f64 / hop).floor() as usize + 1;
    // The last window ends with the clip.
    let last = (n - length) as f64;
    let start = |k: usize| if count > 1 { last * k as f64 / (count - 1) as f64 } else { 0.0 };
    let asked: Vec<Option<(f64, f64)>> = (0..count)
        .map(|k| {
            let from = start(k).round() as usize;
            let window = from..from + length;
            let seen = clip.used[window.clone()].iter().filter(|u| **u).count();
            let answer = || {
                clip.fit(&window, period, true)
                    .map_or((0.0, period), |w| (w.steadiness, w.phase.repeat_frames))
            };
            (2 * seen >= length).then(answer)
        })
        .collect();
    // Where too little is seen, the next window that sees enough answers.
    let answers = |k: &usize| asked[*k];
    let found: Vec<(f64, f64)> = (0..count)
        .map(|k| {
            let before = (0..=k).rev().find(|k| answers(k).is_some());
            let after = (k..count).find(|k| answers(k).is_some());
            let nearest = match (before, after) {
                (Some(b), Some(a)) => Some(if k - b <= a - k { b } else { a }),
                (one, other) => one.or(other),
            };
            nearest.and_then(|k| asked[k]).unwrap_or((0.0, period))
        })
        .collect();
    let middle = (length - 1) as f64 / 2.0;
    (0..n)
        .map(|t| {
            let place = (t as f64 - middle).clamp(0.0, last);
            let at = if count > 1 && last > 0.0 { place / last * (count - 1) as f64 } else { 0.0 };
            let k = (at as usize).min(count.saturating_sub(2));
            let share = at - k as f64;
            let next = found[(k + 1).min(count - 1)];
            (found[k].0 + share * (next.0 - found[k].0), found[k].1)
        })
        .collect()
}

/// The runs of frames whose gains, less `change` for every change on the way, add up to the most.
fn chosen(gains: &[f64], change: f64) -> Vec<Range<usize>> {
    // Best sums that end inside (1) or outside (0) a run, and where each came from.
    let mut best = [0.0, 0.0];
    let mut from: Vec<[usize; 2]> = Vec::with_capacity(gains.len());
    for gain in gains {
        let came: [usize; 2] =
            std::array::from_fn(|s| if best[1 - s] - change > best[s] { 1 - s } else { s });
        let reached = |s: usize| best[came[s]] - if came[s] == s { 0.0 } else { change };
        best = [reached(0) - gain, reached(1) + gain];
        from.push(came);
    }
    let mut state = usize::from(best[1] >= best[0]);
    let mut runs: Vec<Range<usize>> = Vec::new();
    for (t, came) in from.iter().enumerate().rev() {
        if state == 1 {
            match runs.last_mut() {
                Some(run) if run.start == t + 1 => run.start = t,
                _ => runs.push(t..t + 1),
            }
        }
        state = came[state];
    }
    runs.reverse();
    runs
}

/// Stretches that reach into one another part in the middle of what both claim; one that is too short by then
/// is none.
fn settle(runs: &mut Vec<Run>) {
    for k in 1..runs.len() {
        let (end, start) = (runs[k - 1].frames.end, runs[k].frames.start);
        if end > start {
            let middle = usize::midpoint(end, start);
            runs[k - 1].frames.end = middle;
            runs[k].frames.start = middle;
        }
    }
    runs.retain(Run::is_long_enough);
}

/// A run without the stops in it; what lies between two and is too short is left out with them.
fn without_stops(clip: &Rows, run: &Run) -> Vec<Run> {
    let parts = still::moving(clip, run).into_iter();
    let runs = parts.map(|frames| Run { frames, period: run.period });
    runs.filter(Run::is_long_enough).collect()
}

/// Joins neighbours with less than half a period between them when one cycle explains both; else they meet in the
/// middle.
fn merge(clip: &Rows, runs: &mut Vec<Run>) {
    let mut k = 1;
    while k < runs.len() {
        let (a, b) = (runs[k - 1].clone(), runs[k].clone());
        let gap = b.frames.start.saturating_sub(a.frames.end) as f64;
        if gap >= 0.5 * a.period.min(b.period) {
            k += 1;
            continue;
        }
        let whole = a.frames.start..b.frames.end;
        let longer = if a.frames.len() >= b.frames.len() { a.period } else { b.period };
        let steady = |frames: &Range<usize>, period| {
            clip.fit(frames, period, true).map_or(0.0, |w| w.steadiness)
        };
        let (one, two) = (a.frames.len() as f64, b.frames.len() as f64);
        let apart =
            (one * steady(&a.frames, a.period) + two * steady(&b.frames, b.period)) / (one + two);
        if steady(&whole, longer) >= ONE_CYCLE * apart {
            runs[k - 1] = Run { frames: whole, period: longer };
            runs.remove(k);
        } else {
            let middle = usize::midpoint(a.frames.end, b.frames.start);
            runs[k - 1].frames.end = middle;
            runs[k].frames.start = middle;
            k += 1;
        }
    }
}

/// The runs with what lies between them. Less than half a period at an end of the clip belongs to the run beside it.
fn fill(runs: &[Run], frames: usize) -> Vec<Stretch> {
    let mut all = Vec::new();
    let mut at = 0;
    for (k, run) in runs.iter().enumerate() {
        let short = |gap: usize| (gap as f64) < 0.5 * run.period;
        let mut own = run.frames.clone();
        if k == 0 && short(own.start) {
            own.start = 0;
        }
        if k + 1 == runs.len() && short(frames - own.end) {
            own.end = frames;
        }
        if own.start > at {
            all.push(Stretch { frames: at..own.start, steady: false });
        }
        at = own.end;
        all.push(Stretch { frames: own, steady: true });
    }
    if at < frames {
        all.push(Stretch { frames: at..frames, steady: false });
    }
    all
}

#[cfg(test)]
mod tests;
