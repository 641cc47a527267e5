//! What real footage does and a looped clip does not: the speed drifts, strides differ in duration and
//! size, and some masks are broken.

use rand::seq::index::sample;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::mask::Mask;

/// How unsteady a rendered motion is; the default is steady.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Unsteady {
    /// Change of the speed from the first frame to the last, as a share of the mean speed.
    pub speed_drift: f64,
    /// Standard deviation of the duration of a stride, as a share of it: each stride runs at a speed
    /// of its own.
    pub stride_variation: f64,
    /// Change of the motion's size from the first frame to the last, as a share of the mean size: every pose's
    /// difference from the mean pose is larger or smaller by that.
    pub amplitude_drift: f64,
    /// Standard deviation of the size of a stride, as a share of the mean size.
    pub amplitude_variation: f64,
    /// Share of frames whose mask is broken, 0…1.
    pub broken_masks: f64,
}

/// Random streams apart from those of the frames' edge noise.
const STRIDE_STREAM: u64 = u64::MAX;
const BROKEN_STREAM: u64 = u64::MAX - 1;
const AMPLITUDE_STREAM: u64 = u64::MAX - 2;

/// A stride's duration and size stay within this share of the mean either way.
const LARGEST_VARIATION: f64 = 0.6;

/// Share of a broken mask's height that is lost, at the least and the most.
const LOST_HEIGHT: (f64, f64) = (0.25, 0.6);

impl Unsteady {
    /// The phase of each frame, cycles, from 0 on.
    #[must_use]
    pub fn phases(&self, frames: usize, frames_per_cycle: f64, seed: u64) -> Vec<f64> {
        let mut rng = stream(seed, STRIDE_STREAM);
        let mut duration = self.duration(&mut rng);
        let (mut phase, mut stride) = (0.0_f64, 0.0);
        (0..frames)
            .map(|t| {
                let at = phase;
                let place = t as f64 / (frames.max(2) - 1) as f64 - 0.5;
                phase += (1.0 + self.speed_drift * place) / (frames_per_cycle * duration);
                if phase.floor() > stride {
                    stride = phase.floor();
                    duration = self.duration(&mut rng);
                }
                if *self == Self::default() { t as f64 / frames_per_cycle } else { at }
            })
            .collect()
    }

    fn duration(&self, rng: &mut ChaCha8Rng) -> f64 {
        varied(self.stride_variation, rng)
    }

    /// The size of the motion at each frame over the mean. A stride has its own size in its middle and passes to the next one's
    /// along half a wave of the cosine.
    #[must_use]
    pub fn amplitudes(&self, phases_cycles: &[f64], seed: u64) -> Vec<f64> {
        let mut rng = stream(seed, AMPLITUDE_STREAM);
        let strides = phases_cycles.last().map_or(0.0, |p| p.max(0.0)) as usize + 2;
        let sizes: Vec<f64> =
            (0..=strides).map(|_| varied(self.amplitude_variation, &mut rng)).collect();
        let frames = phases_cycles.len();
        let at = |(t, phase): (usize, &f64)| {
            // The first half of the first stride belongs to it.
            let place = (phase - 0.5).max(0.0);
            let (stride, share) = (place as usize, place.fract());
            let passed = 0.5 - 0.5 * (std::f64::consts::PI * share).cos();
            let own = sizes[stride] + passed * (sizes[stride + 1] - sizes[stride]);
            let drifted = t as f64 / (frames.max(2) - 1) as f64 - 0.5;
            own * (1.0 + self.amplitude_drift * drifted)
        };
        phases_cycles.iter().enumerate().map(at).collect()
    }

    /// Breaks its share of the masks: the lower or the upper part of the animal is lost, as behind
    /// grass or against a dark background.
    pub fn break_masks(&self, masks: &mut [Mask], seed: u64) {
        let count = (self.broken_masks.clamp(0.0, 1.0) * masks.len() as f64).round() as usize;
        let mut rng = stream(seed, BROKEN_STREAM);
        let mut frames = sample(&mut rng, masks.len(), count).into_vec();
        frames.sort_unstable();
        for frame in frames {
            masks[frame] = broken(&masks[frame], &mut rng);
        }
    }
}

/// One and a share of it that is drawn anew. The sum of twelve uniform numbers is near enough to a Gaussian.
fn varied(share: f64, rng: &mut ChaCha8Rng) -> f64 {
    let normal: f64 = (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0;
    1.0 + (share * normal).clamp(-LARGEST_VARIATION, LARGEST_VARIATION)
}

fn stream(seed: u64, stream: u64) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(stream);
    rng
}

fn broken(mask: &Mask, rng: &mut impl Rng) -> Mask {
    let rows: Vec<usize> =
        (0..mask.height()).filter(|&y| (0..mask.width()).any(|x| mask.get(x, y))).collect();
    let (Some(&top), Some(&bottom)) = (rows.first(), rows.last()) else { return mask.clone() };
    let lost = rng.random_range(LOST_HEIGHT.0..LOST_HEIGHT.1) * (bottom + 1 - top) as f64;
    let from_below = rng.random::<bool>();
    Mask::from_fn(mask.width(), mask.height(), |x, y| {
        let gone = if from_below {
            (bottom + 1 - y.min(bottom)) as f64 <= lost
        } else {
            (y.max(top) - top) as f64 <= lost
        };
        mask.get(x, y) && !gone
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_steady_motion_is_even_and_drift_and_variation_are_as_asked() {
        let steady = Unsteady::default().phases(100, 24.3, 1);
        assert!(steady.iter().enumerate().all(|(t, p)| *p == t as f64 / 24.3));
        let drifting = Unsteady { speed_drift: 0.2, ..Unsteady::default() }.phases(100, 24.3, 1);
        let speed = |t: usize| drifting[t + 1] - drifting[t];
        assert!((speed(98) / speed(0) - 1.1 / 0.9).abs() < 0.01);
        let varied = Unsteady { stride_variation: 0.1, ..Unsteady::default() };
        let phases = varied.phases(20_000, 20.0, 3);
        let ends: Vec<f64> =
            (1..900_u32).map(|k| phases.partition_point(|p| *p < f64::from(k)) as f64).collect();
        let lengths: Vec<f64> = ends.windows(2).map(|w| w[1] - w[0]).collect();
        let mean = lengths.iter().sum::<f64>() / lengths.len() as f64;
        let sd =
            (lengths.iter().map(|l| (l - mean).powi(2)).sum::<f64>() / lengths.len() as f64).sqrt();
        assert!((sd / mean - 0.1).abs() < 0.02, "{}", sd / mean);
    }

    #[test]
    fn sizes_are_as_asked_and_pass_smoothly() {
        let phases: Vec<f64> = (0..20_000).map(|t| f64::from(t) / 20.0).collect();
        let of = |unsteady: Unsteady| unsteady.amplitudes(&phases, 3);
        assert!(of(Unsteady::default()).iter().all(|a| *a == 1.0));
        let fallen = of(Unsteady { amplitude_drift: -0.3, ..Unsteady::default() });
        assert!((fallen[0] - 1.15).abs() < 1e-12 && (fallen[19_999] - 0.85).abs() < 1e-12);
        let varied = of(Unsteady { amplitude_variation: 0.1, ..Unsteady::default() });
        // In the middle of each stride.
        let own: Vec<f64> = (0..999).map(|k| varied[20 * k + 10]).collect();
        let mean = own.iter().sum::<f64>() / own.len() as f64;
        let sd = (own.iter().map(|a| (a - mean).powi(2)).sum::<f64>() / own.len() as f64).sqrt();
        assert!((mean - 1.0).abs() < 0.02 && (sd - 0.1).abs() < 0.01, "{mean} {sd}");
        assert!(varied.windows(2).all(|w| (w[1] - w[0]).abs() < 0.06));
    }

    #[test]
    fn the_wanted_number_of_masks_is_broken() {
        let whole = Mask::from_fn(40, 40, |x, y| (10..30).contains(&x) && (10..30).contains(&y));
        let mut masks = vec![whole.clone(); 100];
        Unsteady { broken_masks: 0.05, ..Unsteady::default() }.break_masks(&mut masks, 7);
        let broken: Vec<&Mask> = masks.iter().filter(|m| **m != whole).collect();
        assert_eq!(broken.len(), 5);
        assert!(broken.iter().all(|m| m.area() < whole.area() && !m.is_empty()));
    }
}
