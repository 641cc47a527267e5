//! Where in its stride the animal is, at every frame: the gait phase.
//!
//! The scores of all components (each with its share of the variance) are one periodic curve run
//! through at a changing speed. Three steps find the phase:
//!
//! 1. *Carrier*: at the frequency f0 where all components together vary most, a sinusoid and a
//!    straight line are fitted to every component about every frame (Gaussian window). The complex
//!    amplitudes of the components are combined coherently along their leading direction, which is
//!    the plane in which the motion turns, whichever components span it. Nothing wraps round the
//!    ends of the clip, and no pair of components is singled out.
//! 2. *Stride*: lines at odd multiples of f0/2 say that the silhouette repeats every second period
//!    only: the period is a step, and near and far legs differ. A back that bobs twice in the period
//!    says that it is the stride ([`StrideEvidence`]).
//! 3. *Cycle*: a Fourier series of all components over the stride and the phase that runs through
//!    it are fitted in turns, the phase as the likeliest path of a speed that wanders about its mean,
//!    how far and how long chosen by its own evidence, frames that do not fit the cycle
//!    weighted down.

mod amplitude;
mod back;
mod carrier;
mod cycle;
mod segments;
mod stride;

pub use segments::{Stretch, stretches};
pub use stride::{Repeats, StrideEvidence};

use crate::error::{Error, Result};
use crate::numeric::{Coefficients, Harmonics, slow_basis};

/// What is known of the gait's left/right symmetry.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Symmetry {
    /// Nothing.
    #[default]
    Unknown,
    /// Left and right do the same half a stride apart.
    Symmetric,
    /// They do not.
    Asymmetric,
}

/// What is known of a clip beside its scores.
#[derive(Clone, Copy, Debug, Default)]
pub struct Known<'a> {
    /// Left and right.
    pub symmetry: Symmetry,
    /// The frequency to follow, repeats of the silhouette a frame; `None` takes the strongest.
    pub repeats_a_frame: Option<f64>,
    /// What is slow was taken out of the scores, from the first used frame to the last: their mean and cosines of up to
    /// so many half cycles ([`slow_basis`]).
    pub slow_half_cycles: Option<usize>,
    /// Height of the back at places along it, frames × places, in any unit and from any height that stands still or
    /// moves steadily: it tells two steps from one.
    pub back: Option<&'a Coefficients>,
    /// The frames are a window that asks whether the gait goes on evenly: a speed that changes much within it is not
    /// followed.
    pub even_speed: bool,
}

/// Fewest frames that a phase is measured of.
const LEAST_FRAMES: usize = 8;

/// The measured phase of a clip.
#[derive(Clone, Debug, PartialEq)]
pub struct GaitPhase {
    /// Phase of each frame, strides, unwrapped; the zero is arbitrary. While it is not known
    /// whether the silhouette repeats once or twice a stride, one repeat counts as a stride.
    pub stride_cycles: Vec<f64>,
    /// Standard deviation of each phase, strides.
    pub deviation_cycles: Vec<f64>,
    /// How well each frame fits the cycle, 0 (not at all, or not seen) to 1.
    pub trust: Vec<f64>,
    /// Size of the motion about each frame over the mean; 1 throughout until [`GaitPhase::with_amplitude`] measures it.
    pub amplitude: Vec<f64>,
    /// The scores over the stride, each component times the root of its share of the variance.
    pub cycle: Harmonics,
    /// Share of the variance of all components that the cycle explains, with the unknowns of the fit
    /// allowed for, 0…1.
    pub explained_share: f64,
    /// Frames from one repeat of the silhouette at f0 to the next, mean over the clip.
    pub repeat_frames: f64,
    /// Steps or strides.
    pub stride: StrideEvidence,
}

impl GaitPhase {
    /// Measures the phase. `scores` are of unit deviation, `variance_shares` has one entry a
    /// component, `used` says for each frame whether its silhouette counts. `repeats_a_frame` is the
    /// frequency to follow, repeats of the silhouette a frame; `None` takes the strongest.
    ///
    /// # Errors
    /// [`Error::TooFewMasks`] with fewer than eight used frames or without variation;
    /// [`Error::CoefficientNotFinite`].
    pub fn measure(
        scores: &Coefficients,
        variance_shares: &[f64],
        used: &[bool],
        symmetry: Symmetry,
        repeats_a_frame: Option<f64>,
    ) -> Result<Self> {
        let known = Known { symmetry, repeats_a_frame, ..Known::default() };
        Self::measure_knowing(scores, variance_shares, used, &known)
    }

    /// The same with all else that may be known.
    ///
    /// # Errors
    /// As [`GaitPhase::measure`].
    pub fn measure_knowing(
        scores: &Coefficients,
        variance_shares: &[f64],
        used: &[bool],
        known: &Known,
    ) -> Result<Self> {
        scores.check_finite()?;
        let clip = Clip::new(scores, variance_shares, used, known.slow_half_cycles);
        let too_few = Error::TooFewMasks { frames: clip.seen() };
        if clip.seen() < LEAST_FRAMES || clip.power() <= 0.0 {
            return Err(too_few);
        }
        let carrier = carrier::track(&clip, known.repeats_a_frame);
        let Some(by_period) = cycle::fit(&clip, &carrier, known.even_speed) else {
            return Err(too_few);
        };
        let stride = StrideEvidence::weigh(&clip, &by_period, known.symmetry, known.back);
        let fitted = if stride.repeats == Repeats::EveryStep {
            cycle::fit(&clip, &carrier.halved(), known.even_speed)
        } else {
            Some(by_period.clone())
        };
        let Some(fitted) = fitted else { return Err(too_few) };
        let turns = by_period.phase[by_period.phase.len() - 1] - by_period.phase[0];
        Ok(Self {
            explained_share: explained_share(&clip, &fitted),
            stride_cycles: fitted.phase,
            deviation_cycles: fitted.deviation,
            amplitude: vec![1.0; fitted.trust.len()],
            trust: fitted.trust,
            cycle: fitted.series,
            repeat_frames: (clip.frames() - 1) as f64 / turns.max(f64::MIN_POSITIVE),
            stride,
        })
    }

    /// Frames a stride, mean over the clip.
    #[must_use]
    pub fn stride_frames(&self) -> f64 {
        let n = self.stride_cycles.len();
        (n - 1) as f64 / (self.stride_cycles[n - 1] - self.stride_cycles[0]).max(f64::MIN_POSITIVE)
    }
}

/// Share of the variance that the cycle explains, with its unknowns allowed for: of noise nothing.
fn explained_share(clip: &Clip, fitted: &cycle::Fitted) -> f64 {
    let frames: f64 = fitted.trust.iter().sum();
    let free = (frames - (1 + 2 * fitted.series.order()) as f64).max(1.0);
    let missed = fitted.residual_power * frames / free;
    (1.0 - missed / clip.power()).clamp(0.0, 1.0)
}

/// The curve whose phase is sought.
#[derive(Clone)]
struct Clip {
    components: usize,
    /// Frames × components, each about its mean and weighted by the root of its variance share.
    values: Vec<f64>,
    /// 1 for a frame that is seen, else 0.
    seen: Vec<f64>,
    /// Orthonormal, one value a frame: what was taken out of the values because it is slow.
    slow: Vec<Vec<f64>>,
}

impl Clip {
    fn new(
        scores: &Coefficients,
        shares: &[f64],
        used: &[bool],
        slow_half_cycles: Option<usize>,
    ) -> Self {
        let (frames, components) = (scores.frames(), scores.components());
        let seen: Vec<f64> = (0..frames)
            .map(|t| f64::from(u8::from(used.get(t).copied().unwrap_or(true))))
            .collect();
        let total: f64 = seen.iter().sum::<f64>().max(1.0);
        let mut values = vec![0.0; frames * components];
        for c in 0..components {
            let column = scores.column(c);
            let mean = column.iter().zip(&seen).map(|(v, s)| v * s).sum::<f64>() / total;
            let root = shares.get(c).copied().unwrap_or(0.0).max(0.0).sqrt();
            for (t, v) in column.iter().enumerate() {
                values[t * components + c] = root * (v - mean);
            }
        }
        let slow = slow_half_cycles.map_or_else(Vec::new, |most| slow_over(&seen, most));
        Self { components, values, seen, slow }
    }

    /// The clip with what the removal of the slow part took of a cycle given back: with B its orthonormal basis the
    /// values are x − BBᵀx, so a cycle s leaves s − BBᵀs in them. At the ends, above all, that is no cycle.
    fn restored(&self, phase: &[f64], series: &Harmonics) -> Self {
        let mut whole = self.clone();
        if self.slow.is_empty() {
            return whole;
        }
        let cycle: Vec<_> = phase.iter().map(|p| series.at(*p).0).collect();
        for slow in &self.slow {
            for c in 0..self.components {
                let along: f64 = slow.iter().zip(&cycle).map(|(b, s)| b * s[c]).sum();
                let column = whole.values.iter_mut().skip(c).step_by(self.components);
                column.zip(slow).for_each(|(v, b)| *v += along * b);
            }
        }
        whole
    }

    fn frames(&self) -> usize {
        self.seen.len()
    }

    fn seen(&self) -> usize {
        self.seen.iter().filter(|s| **s > 0.0).count()
    }

    /// Mean speed of a path, per frame, from the first seen frame to the last: what lies beyond is not told by anything.
    fn speed(&self, path: &[f64]) -> f64 {
        let seen = |s: &f64| *s > 0.0;
        let first = self.seen.iter().position(seen).unwrap_or(0);
        let last = self.seen.iter().rposition(seen).unwrap_or(0);
        let speed = (path[last] - path[first]) / last.saturating_sub(first).max(1) as f64;
        speed.max(f64::MIN_POSITIVE)
    }

    fn row(&self, t: usize) -> &[f64] {
        &self.values[t * self.components..(t + 1) * self.components]
    }

    /// Variance of the seen frames, summed over the components.
    fn power(&self) -> f64 {
        let sum: f64 = (0..self.frames())
            .map(|t| self.seen[t] * self.row(t).iter().map(|v| v * v).sum::<f64>())
            .sum();
        sum / self.seen().max(1) as f64
    }
}

/// The mean and the cosines of up to so many half cycles from the first seen frame to the last, orthonormal over the seen ones.
fn slow_over(seen: &[f64], half_cycles: usize) -> Vec<Vec<f64>> {
    let frames: Vec<usize> = (0..seen.len()).filter(|t| seen[*t] > 0.0).collect();
    let first = frames.first().copied().unwrap_or(0);
    let times: Vec<usize> = frames.iter().map(|t| t - first).collect();
    let span = times.last().map_or(0, |t| t + 1);
    let spread = |values: Vec<f64>| {
        let mut all = vec![0.0; seen.len()];
        frames.iter().zip(values).for_each(|(t, v)| all[*t] = v);
        all
    };
    slow_basis(&times, span, half_cycles).into_iter().map(spread).collect()
}

#[cfg(test)]
mod tests;
