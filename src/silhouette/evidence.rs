//! What a measured distance says about a pixel, learnt from the clip itself.

use crate::numeric::rising_fit;

/// Counts every bin starts with, so that a distance never seen says little.
const PRIOR_COUNT: f64 = 20.0;

/// The most that one cue may say: odds of 55 to 1. Naive multiplication of cues that are not
/// independent would otherwise be far too sure.
const STRONGEST: f32 = 4.0;

/// Natural logarithm of the likelihood ratio, animal over background, of each byte value.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Evidence {
    log_ratio: Vec<f32>,
}

/// Byte values seen inside the silhouettes drafted so far, and clear of them.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Counts {
    pub(super) inside: Vec<f64>,
    pub(super) outside: Vec<f64>,
}

impl Default for Counts {
    fn default() -> Self {
        Self { inside: vec![0.0; 256], outside: vec![0.0; 256] }
    }
}

impl Counts {
    /// Sums of whole numbers: the same in any order.
    pub(super) fn merged(mut self, other: &Self) -> Self {
        let add = |a: &mut Vec<f64>, b: &[f64]| a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
        add(&mut self.inside, &other.inside);
        add(&mut self.outside, &other.outside);
        self
    }

    /// As many counts as there are, `share` of them distributed as in `other`; where either is
    /// empty, the other.
    pub(super) fn mixed(&self, other: &Self, share: f64) -> Self {
        let class = |own: &[f64], other: &[f64]| -> Vec<f64> {
            let (total, others): (f64, f64) = (own.iter().sum(), other.iter().sum());
            if others == 0.0 {
                return own.to_vec();
            }
            if total == 0.0 {
                return other.to_vec();
            }
            let scale = share * total / others;
            own.iter().zip(other).map(|(a, b)| (1.0 - share) * a + scale * b).collect()
        };
        Self {
            inside: class(&self.inside, &other.inside),
            outside: class(&self.outside, &other.outside),
        }
    }
}

impl Evidence {
    /// The ratio of the two histograms, made to rise with the distance (a pixel that looks less
    /// like the background is never less likely the animal's), at most [`STRONGEST`] either way.
    /// The last value, a distance that is not known, says nothing.
    pub(super) fn from_counts(counts: &Counts) -> Self {
        let density = |histogram: &[f64]| -> Vec<f64> {
            let smooth: Vec<f64> = (0..255)
                .map(|at| {
                    // Bins widen with the distance: large ones are rare and alike.
                    let reach = 1 + at / 12;
                    let (from, to) = (at.max(reach) - reach, (at + reach).min(254));
                    let sum: f64 = histogram[from..=to].iter().sum();
                    sum / (to + 1 - from) as f64
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
