//! Amplitude spectra and the rectangular band-pass of a real series.

use rustfft::FftPlanner;
use rustfft::num_complex::Complex64;

/// Amplitudes of a real series at the bins 0…n/2 of its own length times `zero_padding`.
///
/// Bin k is at k / (n · `zero_padding`) cycles a sample; amplitudes are scaled so that a sinusoid
/// of amplitude A at a bin's frequency shows as A (bin 0: the mean's magnitude). The mean is
/// *not* removed.
#[must_use]
pub fn amplitude_spectrum(series: &[f64], zero_padding: usize) -> Vec<f64> {
    let n = series.len();
    if n == 0 {
        return Vec::new();
    }
    let length = n * zero_padding.max(1);
    let mut data: Vec<Complex64> = series.iter().map(|&v| Complex64::new(v, 0.0)).collect();
    data.resize(length, Complex64::new(0.0, 0.0));
    FftPlanner::new().plan_fft_forward(length).process(&mut data);
    (0..=length / 2)
        .map(|k| {
            let one_sided = if k == 0 || 2 * k == length { 1.0 } else { 2.0 };
            one_sided * data[k].norm() / n as f64
        })
        .collect()
}

/// The series with only the frequencies from `low` to `high` (both included, cycles a sample)
/// kept: Fourier transform at the series' own length, a rectangular window, and back. The mean is
/// removed unless `low` is 0 or less.
#[must_use]
pub fn band_pass(series: &[f64], low: f64, high: f64) -> Vec<f64> {
    let n = series.len();
    if n == 0 {
        return Vec::new();
    }
    let mut planner = FftPlanner::new();
    let mut data: Vec<Complex64> = series.iter().map(|&v| Complex64::new(v, 0.0)).collect();
    planner.plan_fft_forward(n).process(&mut data);
    for (k, value) in data.iter_mut().enumerate() {
        let frequency = k.min(n - k) as f64 / n as f64;
        if frequency < low || frequency > high {
            *value = Complex64::new(0.0, 0.0);
        }
    }
    planner.plan_fft_inverse(n).process(&mut data);
    data.iter().map(|v| v.re / n as f64).collect()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use proptest::prelude::*;

    use super::*;

    /// The transform by its definition.
    fn slow_amplitudes(series: &[f64]) -> Vec<f64> {
        let n = series.len();
        (0..=n / 2)
            .map(|k| {
                let angle = |t: usize| TAU * (k * t) as f64 / n as f64;
                let re: f64 = series.iter().enumerate().map(|(t, v)| v * angle(t).cos()).sum();
                let im: f64 = series.iter().enumerate().map(|(t, v)| v * angle(t).sin()).sum();
                let scale = if k == 0 || 2 * k == n { 1.0 } else { 2.0 };
                scale * re.hypot(im) / n as f64
            })
            .collect()
    }

    proptest! {
        #[test]
        fn the_spectrum_is_the_definition(series in prop::collection::vec(-1.0..1.0_f64, 1..40)) {
            let fast = amplitude_spectrum(&series, 1);
            for (a, b) in fast.iter().zip(slow_amplitudes(&series)) {
                prop_assert!((a - b).abs() < 1e-12);
            }
        }

        #[test]
        fn a_band_and_its_complement_make_the_whole(
            series in prop::collection::vec(-1.0..1.0_f64, 4..40)
        ) {
            let low = band_pass(&series, -1.0, 0.2);
            let high = band_pass(&series, 0.2 + 1e-9, 1.0);
            for ((a, b), whole) in low.iter().zip(&high).zip(&series) {
                prop_assert!((a + b - whole).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn a_planted_sinusoid_shows_its_amplitude_and_passes_its_band() {
        let n = 100;
        let wave: Vec<f64> =
            (0..n).map(|t| 3.0 * (TAU * 7.0 * f64::from(t) / 100.0).sin()).collect();
        assert!((amplitude_spectrum(&wave, 1)[7] - 3.0).abs() < 1e-12);
        assert!((amplitude_spectrum(&wave, 8)[56] - 3.0).abs() < 1e-12);
        let kept = band_pass(&wave, 0.06, 0.08);
        assert!(kept.iter().zip(&wave).all(|(a, b)| (a - b).abs() < 1e-12));
        assert!(band_pass(&wave, 0.08, 0.2).iter().all(|v| v.abs() < 1e-12));
    }
}
