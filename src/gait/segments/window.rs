//! One cycle fitted to a window of the scores, and followed beyond it.

use std::ops::Range;

use super::{Run, WINDOW_PERIODS};
use crate::gait::{GaitPhase, Known};
use crate::numeric::{Coefficients, Harmonics, median};

/// Periods that a window must hold by what was found in it.
const SEEN_PERIODS: f64 = 2.5;

/// A cycle is told from several in a row by this share of its power in the first two harmonics (two, since
/// a stride may hold two steps that are nearly alike): of four cycles taken as one, the first with power is
/// the fourth.
const LOW_HARMONICS: f64 = 0.25;

/// A window in which less than this share of the clip's variance moves stands still: what a cycle explains there
/// is the rest of a motion at its ends.
const STILL_SHARE: f64 = 0.1;

/// Components that are looked at; later ones are noise more than motion.
const COMPONENTS: usize = 8;

/// A frame belongs to a stretch while this share of the cycle's power is the most that it misses it by.
const MISSES_BY: f64 = 0.5;

/// Share of frames that must be used for their variance to be told.
const SEEN_SHARE: f64 = 0.75;

/// How far the phase is looked for beside where the speed of the stretch puts it, cycles, and the share of
/// what is found that it is moved by. It cannot stand still: at twelve frames a period it goes on by .083.
const PHASE_SEARCH: f64 = 0.1;
const PHASE_GAIN: f64 = 0.3;

/// The scores weighted by the roots of the components' shares.
pub(super) struct Rows {
    components: usize,
    values: Vec<f64>,
    pub(super) used: Vec<bool>,
    /// Variance of the used rows.
    power: f64,
}

/// A window that one cycle was fitted to.
pub(super) struct Window {
    pub(super) phase: GaitPhase,
    /// Mean of the rows it was fitted to (and their slope, if it was taken out).
    mean: Vec<f64>,
    pub(super) steadiness: f64,
}

impl Rows {
    pub(super) fn new(scores: &Coefficients, shares: &[f64], used: &[bool]) -> Self {
        let components = scores.components().min(COMPONENTS);
        let values = (0..scores.frames())
            .flat_map(|t| {
                let row = &scores.point(t)[..components];
                row.iter().zip(shares).map(|(v, s)| v * s.max(0.0).sqrt()).collect::<Vec<_>>()
            })
            .collect();
        let mut rows = Self { components, values, used: used.to_vec(), power: 0.0 };
        let (mean, _) = rows.line(&(0..used.len()));
        let seen: Vec<usize> = (0..used.len()).filter(|&t| used[t]).collect();
        let off = |t: &usize| -> f64 {
            rows.row(*t).iter().zip(&mean).map(|(v, m)| (v - m).powi(2)).sum()
        };
        rows.power = seen.iter().map(off).sum::<f64>() / seen.len().max(1) as f64;
        rows
    }

    pub(super) fn frames(&self) -> usize {
        self.used.len()
    }

    fn row(&self, t: usize) -> &[f64] {
        &self.values[t * self.components..(t + 1) * self.components]
    }

    /// Mean of the used rows, and their slope a frame about the middle frame.
    fn line(&self, frames: &Range<usize>) -> (Vec<f64>, Vec<f64>) {
        let middle = (frames.start + frames.end - 1) as f64 / 2.0;
        let (mut count, mut sum, mut square) = (0.0, 0.0, 0.0);
        let (mut values, mut moments) = (vec![0.0; self.components], vec![0.0; self.components]);
        for t in frames.clone().filter(|&t| self.used[t]) {
            let x = t as f64 - middle;
            count += 1.0;
            sum += x;
            square += x * x;
            for (c, v) in self.row(t).iter().enumerate() {
                values[c] += v;
                moments[c] += x * v;
            }
        }
        let determinant = f64::max(count * square - sum * sum, f64::MIN_POSITIVE);
        let slope: Vec<f64> = (values.iter().zip(&moments))
            .map(|(v, m)| (count * m - sum * v) / determinant)
            .collect();
        let count = f64::max(count, 1.0);
        let mean = values.iter().zip(&slope).map(|(v, k)| (v - k * sum) / count).collect();
        (mean, slope)
    }

    /// Variance of some frames' rows about their own mean, summed over the components; `None` where too few of them are
    /// used to speak for all.
    pub(super) fn variance(&self, frames: &Range<usize>) -> Option<f64> {
        let seen: Vec<usize> = frames.clone().filter(|&t| self.used[t]).collect();
        let count = seen.len() as f64;
        if seen.len() < 2 || count < SEEN_SHARE * frames.len() as f64 {
            return None;
        }
        let of_component = |c: usize| -> f64 {
            let mean = seen.iter().map(|&t| self.row(t)[c]).sum::<f64>() / count;
            seen.iter().map(|&t| (self.row(t)[c] - mean).powi(2)).sum::<f64>() / (count - 1.0)
        };
        Some((0..self.components).map(of_component).sum())
    }

    /// Fits one cycle to a window. With `level`, a straight line is taken out first.
    pub(super) fn fit(&self, frames: &Range<usize>, period: f64, level: bool) -> Option<Window> {
        let (mean, mut slope) = self.line(frames);
        if !level {
            slope.fill(0.0);
        }
        let middle = (frames.start + frames.end - 1) as f64 / 2.0;
        let rows: Vec<f64> = frames
            .clone()
            .flat_map(|t| {
                let x = t as f64 - middle;
                let line = mean.iter().zip(&slope).map(move |(m, k)| m + k * x);
                self.row(t).iter().zip(line).map(|(v, l)| v - l).collect::<Vec<_>>()
            })
            .collect();
        let used = &self.used[frames.clone()];
        let seen: Vec<usize> = (0..frames.len()).filter(|&t| used[t]).collect();
        let count = seen.len() as f64;
        let row = |t: usize| &rows[t * self.components..(t + 1) * self.components];
        let mean_power = seen.iter().flat_map(|&t| row(t)).map(|v| v * v).sum::<f64>() / count;
        let scores = Coefficients::from_rows(frames.len(), self.components, rows.clone())?;
        let shares = vec![1.0; self.components];
        let known =
            Known { repeats_a_frame: Some(1.0 / period), even_speed: true, ..Known::default() };
        let phase = GaitPhase::measure_knowing(&scores, &shares, used, &known).ok()?;
        let missed: f64 = (seen.iter())
            .map(|&t| {
                // The fit takes off the mean of the used rows, which is zero here.
                let (value, _) = phase.cycle.at(phase.stride_cycles[t]);
                let rest = row(t).iter().zip(value.iter()).map(|(x, v)| (x - v).powi(2));
                // A frame that is explained by nothing misses as much as moves; a broken one no more.
                rest.sum::<f64>().min(mean_power)
            })
            .sum();
        let free = (count - (1 + 2 * phase.cycle.order()) as f64).max(1.0);
        let steadiness = (1.0 - missed / free / mean_power.max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        let repeats = mean_power >= STILL_SHARE * self.power
            && frames.len() as f64 >= SEEN_PERIODS * phase.repeat_frames
            && is_one_cycle(&phase.cycle);
        Some(Window { phase, mean, steadiness: if repeats { steadiness } else { 0.0 } })
    }

    /// Where a stretch begins and ends: as far as the cycle of the three periods next to the end goes on
    /// explaining the frames.
    pub(super) fn extent(&self, run: &Run) -> Range<usize> {
        let n = self.frames();
        let start =
            if run.frames.start == 0 { 0 } else { n - self.reversed().end(&run.mirrored(n)) };
        let end = if run.frames.end == n { n } else { self.end(run) };
        start.min(run.frames.end - 1)..end.max(run.frames.start + 1)
    }

    fn reversed(&self) -> Self {
        let values = (0..self.frames()).rev().flat_map(|t| self.row(t).to_vec()).collect();
        let used = self.used.iter().rev().copied().collect();
        Self { components: self.components, values, used, power: self.power }
    }

    /// The end of a stretch, refined.
    fn end(&self, run: &Run) -> usize {
        let half = (run.period / 2.0).ceil() as usize;
        let inside = run.frames.end.saturating_sub(half).max(run.frames.start + half);
        let length = (WINDOW_PERIODS * run.period).round() as usize;
        let near = inside.saturating_sub(length).max(run.frames.start)..inside;
        let Some(window) = self.fit(&near, run.period, false) else { return run.frames.end };
        let misses = self.misses(&window, &near, (run.frames.end + 3 * half).min(self.frames()));
        let mut best = (0.0, inside);
        let mut sum = 0.0;
        for (i, missed) in misses.iter().enumerate() {
            sum += MISSES_BY - missed;
            if sum > best.0 {
                best = (sum, inside + i + 1);
            }
        }
        best.1
    }

    /// For each frame from the window's end to `until` by how much the window's cycle misses it, as a share of the
    /// cycle's power, 0 to 1.
    fn misses(&self, window: &Window, frames: &Range<usize>, until: usize) -> Vec<f64> {
        let cycles = &window.phase.stride_cycles;
        let speed = (cycles[cycles.len() - 1] - cycles[0]) / (cycles.len() - 1) as f64;
        let cycle = &window.phase.cycle;
        let power: f64 = (1..=cycle.order()).map(|h| cycle.power(h)).sum();
        let miss = |t: usize, phase: f64| -> f64 {
            let (value, _) = cycle.at(phase);
            let rest = self.row(t).iter().zip(&window.mean).zip(value.iter());
            rest.map(|((x, m), v)| (x - m - v).powi(2)).sum()
        };
        let inside: Vec<f64> = frames
            .clone()
            .filter(|&t| self.used[t])
            .map(|t| miss(t, cycles[t - frames.start]))
            .collect();
        let usual = median(&inside);
        let mut phase = cycles[cycles.len() - 1];
        (frames.end..until)
            .map(|t| {
                phase += speed;
                if !self.used[t] {
                    return MISSES_BY;
                }
                let (off, least) = (-10..=10)
                    .map(|k| PHASE_SEARCH * f64::from(k) / 10.0)
                    .map(|off| (off, miss(t, phase + off)))
                    .min_by(|a, b| a.1.total_cmp(&b.1))
                    .unwrap_or((0.0, 0.0));
                phase += PHASE_GAIN * off;
                ((least - usual) / power.max(f64::MIN_POSITIVE)).clamp(0.0, 1.0)
            })
            .collect()
    }
}

/// Whether a series is one cycle and not several in a row.
fn is_one_cycle(series: &Harmonics) -> bool {
    let power = |most: usize| (1..=most).map(|h| series.power(h)).sum::<f64>();
    power(series.order().min(2)) >= LOW_HARMONICS * power(series.order())
}
