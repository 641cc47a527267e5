//! What a measured distance says about a pixel, learnt from the clip itself.

use crate::numeric::rising_fit;

/// Counts every bin starts with, so that a distance never seen says little.
const PRIOR_COUNT: f64 = 20.0;

/// The most that one cue may say: odds of 55 to 1. Naive multiplication of cues that are not
/// independent would otherwise be far too sure.
pub(super) const STRONGEST: f32 = 4.0;

/// Natural logarithm of the likelihood ratio, animal over background, of each byte value.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Evidence {
    log_ratio: Vec<f32>,
}

/// Byte values seen inside the silhouettes drafted so far, and clear of them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Counts {
    pub(super) inside: Vec<u64>,
    pub(super) outside: Vec<u64>,
}

impl Counts {
    pub(super) fn new() -> Self {
        Self { inside: vec![0; 256], outside: vec![0; 256] }
    }

    pub(super) fn merged(mut self, other: &Self) -> Self {
        let add = |a: &mut Vec<u64>, b: &[u64]| a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
        add(&mut self.inside, &other.inside);
        add(&mut self.outside, &other.outside);
        self
    }
}

impl Evidence {
    /// The ratio of the two histograms, made to rise with the distance (a pixel that looks less
    /// like the background is never less likely the animal's), at most [`STRONGEST`] either way.
    /// The last value, a distance that is not known, says nothing.
    pub(super) fn from_counts(counts: &Counts) -> Self {
        let density = |histogram: &[u64]| -> Vec<f64> {
            let smooth: Vec<f64> = (0..255)
                .map(|at| {
                    // Bins widen with the distance: large ones are rare and alike.
                    let reach = 1 + at / 12;
                    let (from, to) = (at.max(reach) - reach, (at + reach).min(254));
                    let sum: u64 = histogram[from..=to].iter().sum();
                    sum as f64 / (to + 1 - from) as f64
                })
                .collect();
            let total: f64 = smooth.iter().sum::<f64>().max(1.0);
            smooth.iter().map(|n| (n + PRIOR_COUNT * (1.0 + total * 1e-6)) / total).collect()
        };
        let (inside, outside) = (density(&counts.inside), density(&counts.outside));
        let ratio: Vec<f64> = inside.iter().zip(&outside).map(|(a, b)| (a / b).ln()).collect();
        let weights: Vec<f64> = inside.iter().zip(&outside).map(|(a, b)| a + b).collect();
        let mut log_ratio: Vec<f32> = rising_fit(&ratio, &weights)
            .into_iter()
            .map(|v| (v as f32).clamp(-STRONGEST, STRONGEST))
            .collect();
        log_ratio.push(0.0);
        Self { log_ratio }
    }

    #[inline]
    pub(super) fn of(&self, distance: u8) -> f32 {
        self.log_ratio[usize::from(distance)]
    }
}
