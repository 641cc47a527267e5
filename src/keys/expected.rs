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

/// The expected motion: sums over the components of products of the silhouette's harmonics.
pub(super) struct Motion {
    /// Σ u_h conj(u_k) and Σ u_h u_k over the components, u the drawn-down complex amplitudes.
    conjugate: Vec<Vec<Complex<f64>>>,
    plain: Vec<Vec<Complex<f64>>>,
    /// Mean square of a derivative by the phase, per unit of variance.
    pub(super) speed_sq: f64,
}

impl Motion {
    pub(super) fn new(silhouette: &Harmonics) -> Self {
        let order = silhouette.order().min(SILHOUETTE_HARMONICS);
        let amplitude = |h: usize, c: usize| {
            let (cos, sin) = silhouette.of(h + 1, c);
            Complex::new(cos, -sin) / ((h + 1) as f64).powi(SILHOUETTE_FALL)
        };
        let components = silhouette.components();
        let variance: f64 = (0..order)
            .flat_map(|h| (0..components).map(move |c| (h, c)))
            .map(|(h, c)| amplitude(h, c).norm_sqr() / 2.0)
            .sum();
        // One part of the whole is the silhouette's.
        let scale = 1.0 / (variance.max(f64::MIN_POSITIVE) * (1.0 + STATIONARY_SHARE));
        let sums = |conjugate: bool| -> Vec<Vec<Complex<f64>>> {
            (0..order)
                .map(|h| {
                    (0..order)
                        .map(|k| {
                            let sum: Complex<f64> = (0..components)
                                .map(|c| {
                                    let other = amplitude(k, c);
                                    let other = if conjugate { other.conj() } else { other };
                                    amplitude(h, c) * other
                                })
                                .sum();
                            sum * scale
                        })
                        .collect()
                })
                .collect()
        };
        let speed_sq = (1..=STATIONARY_HARMONICS)
            .map(|h| (TAU * h as f64).powi(2) * stationary_power(h))
            .sum();
        Self { conjugate: sums(true), plain: sums(false), speed_sq }
    }

    /// Expected square error within the gap from `phase` on, times the gap's length.
    pub(super) fn gap_error(&self, phase: f64, gap: f64) -> f64 {
        let order = self.conjugate.len();
        let mut silhouette = 0.0;
        let mut stationary = 0.0;
        for place in 0..PLACES {
            let share = (place as f64 + 0.5) / PLACES as f64;
            let missed: Vec<Complex<f64>> = (1..=STATIONARY_HARMONICS)
                .map(|h| missed_by_spline(h as f64 * gap, share))
                .collect();
            stationary += missed
                .iter()
                .enumerate()
                .map(|(at, e)| stationary_power(at + 1) * e.norm_sqr())
                .sum::<f64>();
            let turned: Vec<Complex<f64>> = (0..order)
                .map(|h| missed[h] * Complex::from_polar(1.0, TAU * (h + 1) as f64 * phase))
                .collect();
            for h in 0..order {
                for k in 0..order {
                    silhouette += (turned[h] * turned[k].conj() * self.conjugate[h][k]
                        + turned[h] * turned[k] * self.plain[h][k])
                        .re
                        / 2.0;
                }
            }
        }
        let share = STATIONARY_SHARE / (1.0 + STATIONARY_SHARE);
        gap * (silhouette + share * stationary) / PLACES as f64
    }
}

/// Share of harmonic `h` in the variance of the motion without known phases.
fn stationary_power(h: usize) -> f64 {
    let power = |h: usize| (h as f64).powi(-STATIONARY_FALL);
    power(h) / (1..=STATIONARY_HARMONICS).map(power).sum::<f64>()
}

/// exp(2πi·f·x) minus the cubic spline through it at all whole x, at x = `share` of the first gap;
/// `frequency` f in cycles a gap. The spline's second derivatives at the knots are those of the
/// wave times 6(2 cos w − 2)/(4 + 2 cos w), w = 2πf.
fn missed_by_spline(frequency: f64, share: f64) -> Complex<f64> {
    let w = TAU * frequency;
    let bend = 6.0 * (2.0 * w.cos() - 2.0) / (4.0 + 2.0 * w.cos());
    let (a, b) = (1.0 - share, share);
    let end = Complex::from_polar(1.0, w);
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
                let found = missed_by_spline(h / keys as f64, share);
                assert!((missed.norm() - found.norm()).abs() < 1e-9, "{missed} {found}");
            }
        }
    }
}
