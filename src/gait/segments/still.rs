//! Where an animal stands in the middle of its gait.
//!
//! A stop of a period or so is lost on windows of three: they hold as much of the gait on either side as ever, with
//! one cycle, and the phase that is fitted to them runs through the stop a whole cycle ahead. But within half of a period
//! every gait gets along on its cycle, and in the slowest half of one period about as far as in that of the next; in a
//! stop nothing but noise moves.

use std::ops::Range;

use super::Run;
use super::window::Rows;
use crate::numeric::median;

/// Length of the windows that are looked at, periods; no stop that is shorter is found. The phase follows those.
const WINDOW_PERIODS: f64 = 0.5;

/// Fewest frames of a window, and of what is hidden.
const LEAST_FRAMES: usize = 4;

/// A window is still when its frames vary by less than this share of what the slowest window of a period usually does.
const STILL_SHARE: f64 = 0.5;

/// Within half of a period a sinusoid varies by .59 of its variance. What varies by less than this in the middle is a part
/// of something slower, the period is not the motion's own, and nothing is said.
const LEAST_OF_ALL: f64 = 0.4;

/// The parts of a run that lie between the stretches in which nothing moves, in order; the whole run where there are none.
pub(super) fn moving(clip: &Rows, run: &Run) -> Vec<Range<usize>> {
    let mut parts = vec![run.frames.clone()];
    let length = ((WINDOW_PERIODS * run.period).ceil() as usize).max(LEAST_FRAMES);
    // A stop at which the run begins or ends reaches beyond it.
    let last = (run.frames.end + length).min(clip.frames()) - length;
    let starts = run.frames.start.saturating_sub(length)..=last;
    let hidden = hidden(&clip.used);
    let reach = run.period.ceil() as usize;
    let is_beside_hidden = |from: usize| {
        let meets = |h: &Range<usize>| h.start < from + length + reach && from < h.end + reach;
        hidden.iter().any(meets)
    };
    let windows: Vec<(usize, f64)> = starts
        .filter(|from| !is_beside_hidden(*from))
        .filter_map(|from| Some((from, clip.variance(&(from..from + length))?)))
        .collect();
    let is_inside =
        |(from, _): &(usize, f64)| *from >= run.frames.start && from + length <= run.frames.end;
    let inside: Vec<(usize, f64)> = windows.iter().copied().filter(is_inside).collect();
    let all: Vec<f64> = inside.iter().map(|window| window.1).collect();
    if clip.variance(&run.frames).is_none_or(|whole| median(&all) < LEAST_OF_ALL * whole) {
        return parts;
    }
    let limit = STILL_SHARE * median(&slowest(&inside, run.period));
    for (from, _) in windows.into_iter().filter(|window| window.1 < limit) {
        // Windows come in order: only the last part can be cut.
        let Some(part) = parts.pop() else { break };
        let before = part.start..from.min(part.end);
        let after = part.start.max(from + length)..part.end;
        parts.extend([before, after].into_iter().filter(|part| !part.is_empty()));
    }
    parts
}

/// Stretches of frames that do not count. What is about to be hidden is hidden in part, and what is left moves less; so
/// within a period of them nothing is said.
fn hidden(used: &[bool]) -> Vec<Range<usize>> {
    let mut at = 0;
    let mut found = Vec::new();
    for alike in used.chunk_by(|a, b| a == b) {
        let frames = at..at + alike.len();
        at = frames.end;
        if !alike[0] && alike.len() >= LEAST_FRAMES {
            found.push(frames);
        }
    }
    found
}

/// For every window what the slowest one within half a period of it varies by.
fn slowest(windows: &[(usize, f64)], period: f64) -> Vec<f64> {
    let reach = (period / 2.0).ceil() as usize;
    let near = |from: usize| windows.iter().filter(move |other| other.0.abs_diff(from) <= reach);
    windows.iter().map(|w| near(w.0).map(|other| other.1).fold(f64::INFINITY, f64::min)).collect()
}
