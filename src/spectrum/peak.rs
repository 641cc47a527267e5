//! The peak of a spectrum and the band about it (seed 003, equation 20).

use serde::Serialize;

use crate::numeric::amplitude_spectrum;

/// Spectra are computed at eight points a bin: the half-amplitude point of a clip of few cycles
/// lies between two bins of its own length.
pub(super) const ZERO_PADDING: usize = 8;

/// Below this many cycles in the clip no peak is looked for: bin 0 is the mean, and what lies
/// between it and one cycle is drift.
const LEAST_CYCLES: f64 = 0.75;

/// Half-widths of the band in units of f_b − f0 (seed, section 5.2: the end points are at 10 % of
/// the peak).
const BAND_HALF_WIDTHS: f64 = 3.0;

/// An amplitude spectrum on an even grid of frequencies.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Spectrum {
    /// Distance of neighbouring points, hertz.
    pub resolution_hz: f64,
    /// Amplitude at 0, 1, 2… times the resolution.
    pub amplitudes: Vec<f64>,
}

impl Spectrum {
    /// The spectrum of a series sampled at `fps` hertz.
    pub(super) fn of(series: &[f64], fps: f64) -> Self {
        let length = (series.len() * ZERO_PADDING).max(1);
        Self {
            resolution_hz: fps / length as f64,
            amplitudes: amplitude_spectrum(series, ZERO_PADDING),
        }
    }

    /// Frequency of point `k`, hertz.
    #[must_use]
    pub fn frequency_hz(&self, k: usize) -> f64 {
        k as f64 * self.resolution_hz
    }

    /// Root of the weighted sum of the powers of several spectra on one grid: what unit-deviation
    /// components show together, weighted with their shares of the variance.
    pub(super) fn together(spectra: &[Self], shares: &[f64]) -> Self {
        let points = spectra.first().map_or(0, |s| s.amplitudes.len());
        let power = |k: usize| -> f64 {
            spectra.iter().zip(shares).map(|(s, share)| share * s.amplitudes[k].powi(2)).sum()
        };
        Self {
            resolution_hz: spectra.first().map_or(0.0, |s| s.resolution_hz),
            amplitudes: (0..points).map(|k| power(k).sqrt()).collect(),
        }
    }

    /// Index of the local maximum that is reached uphill from a frequency.
    pub(super) fn summit_near(&self, frequency_hz: f64) -> usize {
        let last = self.amplitudes.len().saturating_sub(1);
        let mut k = ((frequency_hz / self.resolution_hz).round() as usize).min(last);
        loop {
            let higher = [k.saturating_sub(1), (k + 1).min(last)]
                .into_iter()
                .max_by(|&a, &b| self.amplitudes[a].total_cmp(&self.amplitudes[b]))
                .filter(|&n| self.amplitudes[n] > self.amplitudes[k]);
            match higher {
                Some(next) => k = next,
                None => return k,
            }
        }
    }

    /// Index of the largest amplitude among the frequencies that can be a gait's.
    pub(super) fn peak_index(&self) -> usize {
        let first = (LEAST_CYCLES * ZERO_PADDING as f64).ceil() as usize;
        (first..self.amplitudes.len())
            .max_by(|&a, &b| self.amplitudes[a].total_cmp(&self.amplitudes[b]).then(b.cmp(&a)))
            .unwrap_or(0)
    }

    /// The frequency of the largest amplitude, refined by a parabola through the three points
    /// about it, hertz.
    #[must_use]
    pub fn peak_hz(&self) -> f64 {
        self.refined_hz(self.peak_index())
    }

    /// The top of the parabola through point `k` and its neighbours, hertz.
    fn refined_hz(&self, k: usize) -> f64 {
        if k == 0 || k + 1 >= self.amplitudes.len() {
            return self.frequency_hz(k);
        }
        let (a, b, c) = (self.amplitudes[k - 1], self.amplitudes[k], self.amplitudes[k + 1]);
        let curvature = a - 2.0 * b + c;
        let shift = if curvature < 0.0 { 0.5 * (a - c) / curvature } else { 0.0 };
        self.frequency_hz(k) + shift.clamp(-0.5, 0.5) * self.resolution_hz
    }
}

/// The peak of a spectrum and the band that follows from it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Peak {
    /// Frequency of the largest amplitude, f0, hertz.
    pub f0_hz: f64,
    /// The frequency nearest to f0 with half its amplitude, f_b, hertz.
    pub fb_hz: f64,
    /// Amplitude at f0.
    pub amplitude: f64,
    /// The band f0 ± 3(f_b − f0), clipped to what a sampled series can hold, hertz; it begins lower where
    /// the stride shows more than the step.
    pub band_hz: (f64, f64),
}

impl Peak {
    /// Fits the largest peak of a spectrum that reaches up to the Nyquist frequency `nyquist_hz`.
    pub(super) fn fit(spectrum: &Spectrum, nyquist_hz: f64) -> Self {
        Self::fit_at(spectrum, spectrum.peak_index(), nyquist_hz)
    }

    /// Fits the peak whose largest point is `at`.
    pub(super) fn fit_at(spectrum: &Spectrum, at: usize, nyquist_hz: f64) -> Self {
        let f0_hz = spectrum.refined_hz(at);
        let fb_hz = half_amplitude_hz(spectrum, at, f0_hz);
        let half_width = BAND_HALF_WIDTHS * (fb_hz - f0_hz).abs();
        let lowest = spectrum.resolution_hz;
        Self {
            f0_hz,
            fb_hz,
            amplitude: spectrum.amplitudes.get(at).copied().unwrap_or(0.0),
            band_hz: ((f0_hz - half_width).max(lowest), (f0_hz + half_width).min(nyquist_hz)),
        }
    }

    /// The same about another f0, a better measured one.
    pub(super) fn moved_to(self, f0_hz: f64, nyquist_hz: f64) -> Self {
        let shift = f0_hz - self.f0_hz;
        let (low, high) = self.band_hz;
        Self {
            f0_hz,
            fb_hz: self.fb_hz + shift,
            band_hz: ((low + shift).max(f64::MIN_POSITIVE), (high + shift).min(nyquist_hz)),
            ..self
        }
    }

    /// The same with the line of the stride in the band, as wide below it as the band is above f0.
    pub(super) fn with_stride(self, stride_hz: f64) -> Self {
        let (low, high) = self.band_hz;
        let below = stride_hz - (high - self.f0_hz);
        Self { band_hz: (low.min(below.max(f64::MIN_POSITIVE)), high), ..self }
    }

    /// Equation 20 times the peak's amplitude: a Lorentzian, 1 at f0 and one half at f_b.
    #[must_use]
    pub fn value(&self, frequency_hz: f64) -> f64 {
        let ratio = (frequency_hz - self.f0_hz) / (self.fb_hz - self.f0_hz);
        self.amplitude / (1.0 + ratio * ratio)
    }
}

/// Walks down from the peak on both sides to half its amplitude, linear between points, and
/// takes the nearer of the two. A side that never falls so far before the spectrum ends does not
/// count; a spectrum that falls on neither has no peak, and the band becomes all of it.
fn half_amplitude_hz(spectrum: &Spectrum, at: usize, f0_hz: f64) -> f64 {
    let amplitudes = &spectrum.amplitudes;
    let Some(&top) = amplitudes.get(at) else { return f0_hz + spectrum.resolution_hz };
    let half = top / 2.0;
    let crossing = |inner: usize, outer: usize| {
        let (a, b) = (amplitudes[inner], amplitudes[outer]);
        let share = if a > b { (a - half) / (a - b) } else { 0.0 };
        let step = outer as f64 - inner as f64;
        (inner as f64 + share * step) * spectrum.resolution_hz
    };
    let above =
        (at + 1..amplitudes.len()).find(|&k| amplitudes[k] <= half).map(|k| crossing(k - 1, k));
    let below = (0..at).rev().find(|&k| amplitudes[k] <= half).map(|k| crossing(k + 1, k));
    let last = spectrum.frequency_hz(amplitudes.len().saturating_sub(1));
    [above, below]
        .into_iter()
        .flatten()
        .min_by(|a, b| (a - f0_hz).abs().total_cmp(&(b - f0_hz).abs()))
        .filter(|fb| (fb - f0_hz).abs() > 0.0)
        .unwrap_or(last.max(f0_hz + spectrum.resolution_hz))
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use proptest::prelude::*;

    use super::*;

    fn wave(n: usize, cycles: f64, phase: f64) -> Vec<f64> {
        (0..n).map(|t| (TAU * cycles * t as f64 / n as f64 + phase).sin()).collect()
    }

    proptest! {
        #[test]
        fn a_planted_frequency_is_found_within_a_fifth_of_a_bin(
            n in 40_usize..200, cycles in 2.0..12.0_f64, phase in 0.0..TAU
        ) {
            let spectrum = Spectrum::of(&wave(n, cycles, phase), 25.0);
            let bin_hz = 25.0 / n as f64;
            prop_assert!((spectrum.peak_hz() - cycles * bin_hz).abs() < 0.2 * bin_hz);
            // Half of a sinc's main lobe is 0.603 bins wide; leakage from the mirror image at
            // negative frequencies moves it a little.
            let peak = Peak::fit(&spectrum, 12.5);
            let half_width = (peak.fb_hz - peak.f0_hz).abs() / bin_hz;
            prop_assert!((0.45..0.75).contains(&half_width), "{half_width}");
        }
    }

    #[test]
    fn equation_20_is_one_at_f0_a_half_at_fb_and_a_tenth_at_the_band_ends() {
        let peak = Peak { f0_hz: 2.0, fb_hz: 2.5, amplitude: 1.0, band_hz: (0.5, 3.5) };
        assert_eq!(peak.value(2.0), 1.0);
        assert_eq!(peak.value(2.5), 0.5);
        assert!((peak.value(0.5) - 0.1).abs() < 1e-12 && (peak.value(3.5) - 0.1).abs() < 1e-12);
    }

    #[test]
    fn the_peak_near_a_frequency_is_found_beside_a_higher_one() {
        let (slow, fast) = (wave(60, 3.0, 0.4), wave(60, 9.0, 0.0));
        let both: Vec<f64> = slow.iter().zip(&fast).map(|(a, b)| a + 0.5 * b).collect();
        let spectrum = Spectrum::of(&both, 30.0);
        let near = Peak::fit_at(&spectrum, spectrum.summit_near(4.3), 15.0);
        assert!((near.f0_hz - 4.5).abs() < 0.05, "{}", near.f0_hz);
        assert!((Peak::fit(&spectrum, 15.0).f0_hz - 1.5).abs() < 0.05);
        let together = Spectrum::together(
            &[Spectrum::of(&slow, 30.0), Spectrum::of(&fast, 30.0)],
            &[0.25, 4.0],
        );
        assert!((together.peak_hz() - 4.5).abs() < 0.05);
        assert!((together.amplitudes[9 * ZERO_PADDING] - 2.0).abs() < 0.05);
    }

    #[test]
    fn the_mean_is_never_the_peak() {
        let series: Vec<f64> = wave(60, 3.0, 0.0).iter().map(|v| v + 50.0).collect();
        let centred: Vec<f64> = series.iter().map(|v| v - 50.0).collect();
        assert_eq!(Spectrum::of(&centred, 30.0).peak_index(), 3 * ZERO_PADDING);
        assert!(Spectrum::of(&series, 30.0).peak_index() >= 6);
    }
}
