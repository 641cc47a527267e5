//! How large the strides are: a tired animal's become smaller, and no two are quite alike.

use super::GaitPhase;
use crate::numeric::{Coefficients, Harmonics};

/// Harmonics of the stride that are fitted to the reach …
const MOST_HARMONICS: usize = 6;

/// … and frames a stride for each: with fewer the fit follows what is of one stride only.
const FRAMES_A_HARMONIC: f64 = 4.0;

/// Standard deviation of the Gaussian about a frame in which its amplitude is measured, strides. Narrower ones are noisier, wider ones
/// blur strides into one another: at .35 the errors below are least.
const WINDOW_STRIDES: f64 = 0.35;

/// … and how many of them it reaches.
const WINDOW_REACH: f64 = 3.0;

/// A place counts when its cycle has this many times the variance of what the cycle leaves.
const LEAST_OVER_NOISE: f64 = 0.4;

/// Share of a place's own variance by which it may be off for other reasons than noise.
const OWN_SHARE: f64 = 0.02;

/// Pixels² of variance that are noise at the least.
const LEAST_NOISE: f64 = 1e-3;

/// What varies less than noise would, this many times its variance, is not believed.
const NOISE_AT_MOST: f64 = 4.0;

/// The motion's amplitude varies by this many times what the outline's does: where a leg passes behind another, more
/// of its swing is hidden the farther it swings. On the walks and gallops of five rigs, yaw 0 and 20, whose amplitude falls
/// by 30 % over the clip, the outline's falls by .39 to .72 of that, .58 on the average.
const MOTION_OVER_OUTLINE: f64 = 1.6;

/// Amplitudes are kept within this range.
const RANGE: (f64, f64) = (0.5, 1.5);

/// Periods that must be seen for one stride to be told from another.
const LEAST_STRIDES: f64 = 2.0;

impl GaitPhase {
    /// With the amplitude of every frame measured: the size of the motion about it over the mean, from how far the
    /// silhouette reaches (`reach`: frames × places on the outline, pixels).
    ///
    /// A cycle is fitted to every place over the phase; about each frame the places' deviations from their means are compared with
    /// the cycle's by weighted least squares. The variance that noise alone would give the answer follows from
    /// what the cycles leave; what is seen is drawn towards 1 by the share that noise may have in it, so a motion that is steady
    /// as far as can be seen has 1 in every frame.
    #[must_use]
    pub fn with_amplitude(mut self, reach: &Coefficients) -> Self {
        if let Some(found) = self.measured_amplitude(reach) {
            self.amplitude = found;
        }
        self
    }

    fn measured_amplitude(&self, reach: &Coefficients) -> Option<Vec<f64>> {
        let frames = self.stride_cycles.len();
        let seen: f64 = self.trust.iter().sum();
        let strides = frames as f64 / self.stride_frames();
        let finest = (self.stride_frames() / FRAMES_A_HARMONIC).max(2.0) as usize;
        let order = self.cycle.order().min(MOST_HARMONICS).min(finest);
        let known = reach.frames() == frames && seen > 2.0 * (1 + 2 * order) as f64;
        if !known || strides < LEAST_STRIDES {
            return None;
        }
        let evidence = self.evidence(reach, order)?;
        let width = (WINDOW_STRIDES * self.stride_frames()).max(f64::MIN_POSITIVE);
        let far = (WINDOW_REACH * width).ceil() as usize;
        let (mut amplitude, mut by_chance) = (vec![1.0; frames], vec![0.0; frames]);
        for t in 0..frames {
            let (mut met, mut of, mut noise) = (0.0, 0.0, 0.0);
            let near = t.saturating_sub(far)..(t + far + 1).min(frames);
            for (s, said) in near.clone().zip(&evidence[near]) {
                let place = (s as f64 - t as f64) / width;
                let weight = self.trust[s] * (-0.5 * place * place).exp();
                met += weight * said.met;
                of += weight * said.of;
                noise += weight * weight * said.noise;
            }
            if of > 0.0 {
                (amplitude[t], by_chance[t]) = (met / of, noise / (of * of));
            }
        }
        let varies = self.trusted_mean(&|t| (amplitude[t] - 1.0).powi(2));
        let chance = self.trusted_mean(&|t| by_chance[t]);
        let believed = (1.0 - NOISE_AT_MOST * chance / varies.max(f64::MIN_POSITIVE)).max(0.0);
        let gain = MOTION_OVER_OUTLINE * believed;
        let of_motion = |a: &f64| (1.0 + gain * (a - 1.0)).clamp(RANGE.0, RANGE.1);
        Some(amplitude.iter().map(of_motion).collect())
    }

    /// The mean over the frames, each weighted by its trust.
    fn trusted_mean(&self, value: &dyn Fn(usize) -> f64) -> f64 {
        let sum: f64 = self.trust.iter().enumerate().map(|(t, w)| w * value(t)).sum();
        sum / self.trust.iter().sum::<f64>()
    }

    /// What each frame says, summed over the places that count.
    fn evidence(&self, reach: &Coefficients, order: usize) -> Option<Vec<Evidence>> {
        let (frames, places) = (reach.frames(), reach.components());
        let values: Vec<f64> = (0..frames).flat_map(|t| reach.point(t).to_vec()).collect();
        let phases = &self.stride_cycles;
        let series = Harmonics::fit(phases, &values, places, &self.trust, order)?;
        let seen: f64 = self.trust.iter().sum();
        let means = series.mean();
        let cycle: Vec<Vec<f64>> =
            phases.iter().map(|p| (series.at(*p).0 - &means).iter().copied().collect()).collect();
        let off = |t: usize, c: usize| reach.point(t)[c] - means[c];
        // What the fit has taken along is put back.
        let taken = seen / (seen - (1 + 2 * order) as f64);
        let (mut weights, mut noises) = (vec![0.0; places], vec![0.0; places]);
        for c in 0..places {
            let signal = self.trusted_mean(&|t| cycle[t][c].powi(2));
            let missed = self.trusted_mean(&|t| (off(t, c) - cycle[t][c]).powi(2));
            noises[c] = taken * missed + LEAST_NOISE;
            if signal > LEAST_OVER_NOISE * noises[c] {
                weights[c] = 1.0 / (noises[c] + OWN_SHARE * signal);
            }
        }
        let of_frame = |t: usize| {
            let mut sums = Evidence::default();
            for c in 0..places {
                let (weight, own) = (weights[c], cycle[t][c]);
                sums.met += weight * own * off(t, c);
                sums.of += weight * own * own;
                sums.noise += weight * weight * own * own * noises[c];
            }
            sums
        };
        Some((0..frames).map(of_frame).collect())
    }
}

/// Sums over the places: weighted products of cycle and what is seen, of the cycle with itself, and the variance of the first that
/// noise gives.
#[derive(Clone, Copy, Default)]
struct Evidence {
    met: f64,
    of: f64,
    noise: f64,
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::super::Symmetry;
    use super::super::tests::{noise_source, phase_error, planted, steady};
    use super::*;

    const STRIDE_FRAMES: f64 = 24.3;

    /// Twelve places on an outline that go to and fro over the stride, each as the sine of an angle that swings by `sizes[t]`:
    /// what the outline shows of a swing becomes less the wider it is.
    fn reach(phases: &[f64], sizes: &[f64], noise: f64, seed: u64) -> Coefficients {
        let mut draw = noise_source(seed);
        let rows: Vec<f64> = phases
            .iter()
            .zip(sizes)
            .flat_map(|(p, size)| {
                (0..12).map(move |k| {
                    let shift = f64::from(k) / 12.0;
                    let swing = size * ((TAU * (p + shift)).sin() + 0.3 * (2.0 * TAU * p).cos());
                    60.0 + 12.0 * swing.sin()
                })
            })
            .map(|v| v + noise * draw())
            .collect();
        Coefficients::from_rows(phases.len(), 12, rows).unwrap()
    }

    fn measured(frames: usize, sizes: &[f64], noise: f64, seed: u64) -> GaitPhase {
        let truth = steady(frames, STRIDE_FRAMES);
        let scores = planted(&truth, 0.4, 0.1, seed);
        let used = vec![true; frames];
        let found =
            GaitPhase::measure(&scores, &[1.0; 5], &used, Symmetry::Symmetric, None).unwrap();
        assert!(phase_error(&found.stride_cycles, &truth) < 0.01);
        found.with_amplitude(&reach(&truth, sizes, noise, seed + 50))
    }

    /// Slope of what is found over what is true, and their correlation.
    fn follows(found: &[f64], truth: &[f64]) -> (f64, f64) {
        let n = found.len() as f64;
        let mean = |v: &[f64]| v.iter().sum::<f64>() / n;
        let (f, t) = (mean(found), mean(truth));
        let sum = |a: &[f64], ma: f64, b: &[f64], mb: f64| {
            a.iter().zip(b).map(|(x, y)| (x - ma) * (y - mb)).sum::<f64>()
        };
        let (ft, tt, ff) =
            (sum(found, f, truth, t), sum(truth, t, truth, t), sum(found, f, found, f));
        (ft / tt, ft / (ff * tt).sqrt())
    }

    #[test]
    fn a_motion_that_becomes_smaller_is_seen_to() {
        for seed in 0..4 {
            let sizes: Vec<f64> = (0..110).map(|t| 1.15 - 0.3 * f64::from(t) / 109.0).collect();
            let found = measured(110, &sizes, 0.7, seed);
            let (slope, alike) = follows(&found.amplitude, &sizes);
            assert!((0.6..1.4).contains(&slope) && alike > 0.95, "{slope} {alike}");
        }
    }

    #[test]
    fn strides_of_unlike_size_are_told_apart() {
        let own = [1.0, 0.85, 1.1, 0.95, 1.12];
        let sizes: Vec<f64> =
            (0..110).map(|t| own[((f64::from(t) / STRIDE_FRAMES) as usize).min(4)]).collect();
        let found = measured(110, &sizes, 0.7, 9);
        let (slope, alike) = follows(&found.amplitude, &sizes);
        assert!((0.5..1.4).contains(&slope) && alike > 0.8, "{slope} {alike}");
    }

    #[test]
    fn a_steady_motion_has_one_size_whatever_the_noise() {
        for (seed, noise) in [(1, 0.2), (2, 0.7), (3, 2.0), (4, 8.0)] {
            let found = measured(110, &[1.0; 110], noise, seed);
            let off = found.amplitude.iter().map(|a| (a - 1.0).abs()).fold(0.0, f64::max);
            assert!(off < 0.01, "{noise}: {off}");
        }
        // Of other frames, or too few of them, nothing is said.
        let found = measured(110, &[1.0; 110], 0.2, 1);
        let other = reach(&steady(50, STRIDE_FRAMES), &[0.7; 50], 0.2, 1);
        assert_eq!(found.clone().with_amplitude(&other).amplitude, found.amplitude);
    }
}
