//! The error to expect between two keys of a motion whose poses are not known yet.

use std::f64::consts::{PI, TAU};

use nalgebra::Complex;

use crate::numeric::Harmonics;

/// Parts of the motion without known phases for one part that follows the silhouette. Between 1 and
/// 10 the errors above change by less than half a percent.
const STATIONARY_SHARE: f64 = 3.0;

/// Power of the harmonics of that motion: h to minus this. The cubic spline is the best linear
/// interpolation of such a motion.
const STATIONARY_FALL: i32 = 4;
const STATIONARY_HARMONICS: usize = 12;

/// Amplitude of the silhouette's harmonics, as a joint's are expected: times h to minus this, and
/// none above the last.
const SILHOUETTE_FALL: i32 = 2;
const SILHOUETTE_HARMONICS: usize = 8;

/// Places within a gap at which the error is evaluated.
const PLACES: usize = 8;

/// The expected motion.
pub(super) struct Motion {
    /// Harmonics of the silhouette that count.
    order: usize,
    /// Σ α αᵀ over the components, row by row; α the drawn-down amplitudes of one, the real parts of all harmonics
    /// and then the imaginary ones.
    silhouette: Vec<f64>,
    /// Power of the harmonics of the motion without known phases.
    stationary: [f64; STATIONARY_HARMONICS],
    /// Mean square of a derivative by the phase, per unit of variance.
    pub(super) speed_sq: f64,
}

impl Motion {
    pub(super) fn new(silhouette: &Harmonics) -> Self {
        let order = silhouette.order().min(SILHOUETTE_HARMONICS);
        let components = silhouette.components();
        // Real and imaginary parts of the complex amplitudes.
        let amplitudes = |c: usize| -> Vec<f64> {
            let parts = (1..=order).map(|h| {
                let (cos, sin) = silhouette.of(h, c);
                let fall = (h as f64).powi(SILHOUETTE_FALL);
                (cos / fall, -sin / fall)
            });
            let (real, imaginary): (Vec<f64>, Vec<f64>) = parts.unzip();
            [real, imaginary].concat()
        };
        let all: Vec<Vec<f64>> = (0..components).map(amplitudes).collect();
        let variance: f64 = all.iter().flatten().map(|a| a * a / 2.0).sum();
        // One part of the whole is the silhouette's.
        let scale = 1.0 / (variance.max(f64::MIN_POSITIVE) * (1.0 + STATIONARY_SHARE));
        let size = 2 * order;
        let silhouette = (0..size * size)
            .map(|at| scale * all.iter().map(|a| a[at / size] * a[at % size]).sum::<f64>())
            .collect();
        let power = |h: usize| (h as f64).powi(-STATIONARY_FALL);
        let total: f64 = (1..=STATIONARY_HARMONICS).map(power).sum();
        let stationary: [f64; STATIONARY_HARMONICS] =
            std::array::from_fn(|at| power(at + 1) / total);
        let speed_sq =
            (1..=STATIONARY_HARMONICS).map(|h| (TAU * h as f64).powi(2) * stationary[h - 1]).sum();
        Self { order, silhouette, stationary, speed_sq }
    }

    /// What the phase a gap begins at does to the harmonics.
    pub(super) fn turned(&self, phase: f64) -> Vec<Complex<f64>> {
        (1..=self.order).map(|h| Complex::from_polar(1.0, TAU * h as f64 * phase)).collect()
    }

    /// Expected square error within a gap, times the gap's length; [`Motion::turned`] says where it begins. With
    /// `both_halves` the same half a stride later is added.
    pub(super) fn gap_error(&self, turned: &[Complex<f64>], gap: f64, both_halves: bool) -> f64 {
        let halves = if both_halves { 2.0 } else { 1.0 };
        let (mut silhouette, mut stationary) = (0.0, 0.0);
        let mut wave = [0.0; 2 * SILHOUETTE_HARMONICS];
        let bends: [(Complex<f64>, f64); STATIONARY_HARMONICS] =
            std::array::from_fn(|at| end_and_bend((at + 1) as f64 * gap));
        for place in 0..PLACES {
            let share = (place as f64 + 0.5) / PLACES as f64;
            for (at, power) in self.stationary.iter().enumerate() {
                let frequency = (at + 1) as f64 * gap;
                let missed = missed_by_spline(frequency, share, bends[at]);
                stationary += power * missed.norm_sqr();
                if at < self.order {
                    // A joint's value is the real part of amplitude times wave.
                    let here = missed * turned[at];
                    wave[at] = here.re;
                    wave[self.order + at] = -here.im;
                }
            }
            silhouette += self.of_wave(&wave);
            if both_halves {
                // Half a stride later every odd harmonic is upside down.
                for at in (0..self.order).step_by(2) {
                    wave[at] = -wave[at];
                    wave[self.order + at] = -wave[self.order + at];
                }
                silhouette += self.of_wave(&wave);
            }
        }
        let share = STATIONARY_SHARE / (1.0 + STATIONARY_SHARE);
        gap * (silhouette + halves * share * stationary) / PLACES as f64
    }

    /// Σ (αᵀ wave)² over the components.
    fn of_wave(&self, wave: &[f64]) -> f64 {
        let size = 2 * self.order;
        let row = |i: usize| &self.silhouette[i * size..(i + 1) * size];
        (0..size).map(|i| wave[i] * row(i).iter().zip(wave).map(|(a, w)| a * w).sum::<f64>()).sum()
    }
}

/// exp(2πi·f), and the spline's second derivatives at the knots as multiples of the wave: 6(2 cos w − 2)/(4 + 2 cos w),
/// w = 2πf. `frequency` f in cycles a gap.
fn end_and_bend(frequency: f64) -> (Complex<f64>, f64) {
    let end = Complex::from_polar(1.0, TAU * frequency);
    (end, 6.0 * (2.0 * end.re - 2.0) / (4.0 + 2.0 * end.re))
}

/// exp(2πi·f·x) minus the cubic spline through it at all whole x, at x = `share` of the first gap; the last argument is
/// [`end_and_bend`] of the frequency.
fn missed_by_spline(frequency: f64, share: f64, (end, bend): (Complex<f64>, f64)) -> Complex<f64> {
    let (a, b) = (1.0 - share, share);
    let spline = end * (b + bend * (b.powi(3) - b) / 6.0) + a + bend * (a.powi(3) - a) / 6.0;
    Complex::from_polar(1.0, 2.0 * PI * frequency * share) - spline
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::PeriodicCubic;

    #[test]
    fn the_error_of_a_wave_is_that_of_the_periodic_spline() {
        for keys in [4_usize, 6, 9] {
            let knots: Vec<f64> = (0..keys).map(|k| k as f64 / keys as f64).collect();
            let spline = PeriodicCubic::new(&knots).unwrap();
            for h in [1.0, 2.0, 3.0] {
                let share = 0.37;
                let phase = (1.0 + share) / keys as f64;
                let weights = spline.weights(phase);
                let value: Complex<f64> = weights
                    .iter()
                    .zip(&knots)
                    .map(|(w, k)| Complex::from_polar(*w, TAU * h * k))
                    .sum();
                let missed = Complex::from_polar(1.0, TAU * h * phase) - value;
                let f = h / keys as f64;
                let found = missed_by_spline(f, share, end_and_bend(f));
                assert!((missed.norm() - found.norm()).abs() < 1e-9, "{missed} {found}");
            }
        }
    }

    /// The error within a gap against the definition: a silhouette's own cycle, drawn down, at many phases.
    #[test]
    fn a_gap_misses_what_its_waves_miss() {
        let parts = [
            (vec![1.0, 0.3], vec![-0.2, 0.9]),
            (vec![0.4, 0.1], vec![0.3, -0.2]),
            (vec![0.2, -0.5], vec![0.0, 0.1]),
        ];
        let motion = Motion::new(&Harmonics::from_parts(&[0.0, 0.0], &parts).unwrap());
        let (phase, gap) = (0.31, 0.17);
        let slow = |phase: f64| -> f64 {
            let (mut missed, mut variance, mut stationary) = (0.0, 0.0, 0.0);
            for c in 0..2 {
                for place in 0..PLACES {
                    let share = (place as f64 + 0.5) / PLACES as f64;
                    let value: f64 = (1..=3)
                        .map(|h| {
                            let (cos, sin) = (parts[h - 1].0[c], parts[h - 1].1[c]);
                            let amplitude = Complex::new(cos, -sin) / (h * h) as f64;
                            let f = h as f64 * gap;
                            let turn = Complex::from_polar(1.0, TAU * h as f64 * phase);
                            (amplitude * turn * missed_by_spline(f, share, end_and_bend(f))).re
                        })
                        .sum();
                    missed += value * value / PLACES as f64;
                }
                variance += (1..=3)
                    .map(|h| {
                        let (cos, sin) = (parts[h - 1].0[c], parts[h - 1].1[c]);
                        (cos * cos + sin * sin) / (h as f64).powi(4) / 2.0
                    })
                    .sum::<f64>();
            }
            let total: f64 = (1..=12).map(|h| f64::from(h).powi(-4)).sum();
            for h in 1..=12 {
                for place in 0..PLACES {
                    let f = f64::from(h) * gap;
                    let share = (place as f64 + 0.5) / PLACES as f64;
                    let wave = missed_by_spline(f, share, end_and_bend(f)).norm_sqr();
                    stationary += f64::from(h).powi(-4) / total * wave / PLACES as f64;
                }
            }
            gap * (missed / variance + 3.0 * stationary) / 4.0
        };
        let turned = motion.turned(phase);
        assert!((motion.gap_error(&turned, gap, false) - slow(phase)).abs() < 1e-12);
        let both = slow(phase) + slow(phase + 0.5);
        assert!((motion.gap_error(&turned, gap, true) - both).abs() < 1e-12);
    }
}
