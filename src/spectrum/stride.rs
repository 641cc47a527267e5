//! From the frequency at which the silhouette repeats to steps and strides.

use serde::{Deserialize, Serialize};

use super::peak::{Spectrum, ZERO_PADDING};

/// What is known of the gait's left/right symmetry.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Gait {
    /// Not said: to be told from the footage where it can be.
    #[default]
    Unknown,
    /// Left and right do the same half a stride apart (walk, trot, pace, amble): the silhouette
    /// repeats every half stride.
    Symmetric,
    /// They do not (canter, gallop, bound): the silhouette repeats once a stride.
    Asymmetric,
    /// Four beats, each foot a quarter after the one before; symmetric.
    Walk,
    /// Diagonal pairs; symmetric.
    Trot,
    /// Lateral pairs; symmetric.
    Pace,
    /// The walk's order at running speed; symmetric.
    Amble,
    /// Three beats; asymmetric.
    Canter,
    /// Four beats and a suspension; asymmetric.
    Gallop,
    /// Both hind feet, then both fore feet; asymmetric.
    Bound,
}

impl Gait {
    /// Whether left and right do the same half a stride apart; `None` when nothing is known.
    #[must_use]
    pub fn is_symmetric(self) -> Option<bool> {
        match self {
            Gait::Unknown => None,
            Gait::Symmetric | Gait::Walk | Gait::Trot | Gait::Pace | Gait::Amble => Some(true),
            Gait::Asymmetric | Gait::Canter | Gait::Gallop | Gait::Bound => Some(false),
        }
    }
}

/// How the stride frequency is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum StrideBasis {
    /// The user named the gait.
    Given,
    /// The spectrum has a line at half the repeat frequency: near and far legs differ.
    SubharmonicSeen,
    /// The back goes up and down twice in a repeat: it holds two steps.
    TwoStepsSeen,
    /// Nothing tells whether the silhouette repeats once or twice a stride.
    Unknown,
}

impl StrideBasis {
    /// The word used in documents.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            StrideBasis::Given => "given",
            StrideBasis::SubharmonicSeen => "subharmonic_seen",
            StrideBasis::TwoStepsSeen => "two_steps_seen",
            StrideBasis::Unknown => "unknown",
        }
    }
}

/// A line at f0/2 must stand this far above the median power about it. Chi-squared noise of two
/// degrees of freedom exceeds ten times its median once in a thousand.
const LINE_OVER_MEDIAN: f64 = 10.0;

/// … and hold at least this share of the power at f0, or it is a sideband of a changing speed.
const LINE_OVER_PEAK: f64 = 0.02;

/// Cycles of f0/2 the clip must hold: with fewer, its line lies in the skirts of f0 and of drift.
const LEAST_STRIDES: f64 = 2.0;

/// Whether the components together show a significant line at half of f0. `shares` weigh the
/// unit-deviation components by their variance.
pub(super) fn has_subharmonic(spectra: &[Spectrum], shares: &[f64], f0_hz: f64) -> bool {
    let Some(first) = spectra.first() else { return false };
    let at = |frequency_hz: f64| (frequency_hz / first.resolution_hz).round() as usize;
    let half = at(f0_hz / 2.0);
    if (half as f64) < LEAST_STRIDES * ZERO_PADDING as f64 {
        return false;
    }
    let power = |k: usize| -> f64 {
        spectra
            .iter()
            .zip(shares)
            .map(|(s, w)| w * s.amplitudes.get(k).map_or(0.0, |a| a * a))
            .sum()
    };
    let slack = ZERO_PADDING / 2;
    let Some(peak) =
        (half.saturating_sub(slack)..=half + slack).max_by(|&a, &b| power(a).total_cmp(&power(b)))
    else {
        return false;
    };
    // A slope towards f0 or towards drift has its largest value at an end of the window.
    let is_local = peak > half - slack && peak < half + slack;
    // Medians over the background: from a quarter of f0 to 1.75 f0, clear of the two lines.
    let clear = 3 * ZERO_PADDING / 2;
    let mut background: Vec<f64> = (at(0.25 * f0_hz)..at(1.75 * f0_hz))
        .filter(|k| k.abs_diff(half) > clear && k.abs_diff(at(f0_hz)) > clear)
        .map(power)
        .collect();
    if background.is_empty() {
        return false;
    }
    background.sort_by(f64::total_cmp);
    let median = background[background.len() / 2];
    is_local
        && power(peak) > LINE_OVER_MEDIAN * median
        && power(peak) > LINE_OVER_PEAK * power(at(f0_hz))
}

/// Step and stride frequency, as far as they are known.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Rhythm {
    /// Frequency at which the silhouette repeats, f0, hertz: the step frequency of a symmetric
    /// gait, the stride frequency of an asymmetric one.
    pub step_hz: f64,
    /// Frames from one repeat to the next.
    pub step_frames: f64,
    /// Stride frequency, hertz; `None` when it cannot be told: it is then either `step_hz`
    /// (asymmetric) or half of it (symmetric).
    pub stride_hz: Option<f64>,
    /// Frames a stride, where known.
    pub stride_frames: Option<f64>,
    /// How the stride is known.
    pub stride_basis: StrideBasis,
}

impl Rhythm {
    pub(super) fn new(f0_hz: f64, fps: f64, gait: Gait, subharmonic: bool) -> Self {
        let (stride_hz, stride_basis) = match gait.is_symmetric() {
            Some(true) => (Some(f0_hz / 2.0), StrideBasis::Given),
            Some(false) => (Some(f0_hz), StrideBasis::Given),
            None if subharmonic => (Some(f0_hz / 2.0), StrideBasis::SubharmonicSeen),
            None => (None, StrideBasis::Unknown),
        };
        Self {
            step_hz: f0_hz,
            step_frames: fps / f0_hz,
            stride_hz,
            stride_frames: stride_hz.map(|f| fps / f),
            stride_basis,
        }
    }
}

impl Rhythm {
    /// The same with the stride that the gait phase found, frames; `None` when it could not be
    /// told. The stride is a whole number of repeats, or of halves of one where PC1 shows the
    /// stride and the gait repeats twice in it.
    #[must_use]
    pub fn with_stride(self, stride_frames: Option<f64>, basis: StrideBasis) -> Self {
        let repeats = stride_frames.map(|f| (2.0 * f / self.step_frames).round().max(1.0) / 2.0);
        Self {
            stride_frames: repeats.map(|r| self.step_frames * r),
            stride_hz: repeats.map(|r| self.step_hz / r),
            stride_basis: if repeats.is_some() { basis } else { StrideBasis::Unknown },
            ..self
        }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    fn spectra(half_amplitude: f64) -> Vec<Spectrum> {
        let mut state = 1_u64;
        let mut noise = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            ((state >> 33) as f64 / f64::from(1_u32 << 31) - 0.5) * 0.2
        };
        let series: Vec<f64> = (0..120)
            .map(|t| {
                let phase = TAU * 10.0 * f64::from(t) / 120.0;
                phase.sin() + half_amplitude * (phase / 2.0).sin() + noise()
            })
            .collect();
        vec![Spectrum::of(&series, 25.0)]
    }

    #[test]
    fn a_line_at_half_the_frequency_is_seen_and_its_absence_too() {
        let f0_hz = 25.0 * 10.0 / 120.0;
        assert!(has_subharmonic(&spectra(0.4), &[1.0], f0_hz));
        assert!(!has_subharmonic(&spectra(0.0), &[1.0], f0_hz));
    }

    #[test]
    fn the_stride_is_not_guessed() {
        let rhythm = Rhythm::new(2.0, 24.0, Gait::Unknown, false);
        assert_eq!(rhythm.stride_hz, None);
        assert_eq!(rhythm.step_frames, 12.0);
        assert_eq!(Rhythm::new(2.0, 24.0, Gait::Symmetric, false).stride_hz, Some(1.0));
        assert_eq!(Rhythm::new(2.0, 24.0, Gait::Asymmetric, true).stride_hz, Some(2.0));
        assert_eq!(Rhythm::new(2.0, 24.0, Gait::Unknown, true).stride_frames, Some(24.0));
    }
}
