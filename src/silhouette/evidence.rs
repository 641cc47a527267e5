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

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Counts of 255 distances and of what is not known: few, many, or none at all.
    fn histogram() -> impl Strategy<Value = Vec<f64>> {
        let some = |most: u32| proptest::collection::vec((0..most).prop_map(f64::from), 256);
        prop_oneof![some(4), some(3000), Just(vec![0.0; 256])]
    }

    fn counts() -> impl Strategy<Value = Counts> {
        (histogram(), histogram()).prop_map(|(inside, outside)| Counts { inside, outside })
    }

    /// The density of one bin: the mean of the counts about it, and the prior's, over the sum of
    /// those means.
    fn density(histogram: &[f64]) -> Vec<f64> {
        let mut means = Vec::new();
        for at in 0_i32..255 {
            let reach = 1 + at / 12;
            let near: Vec<f64> = (0_i32..255)
                .filter(|other| (other - at).abs() <= reach)
                .map(|other| histogram[other as usize])
                .collect();
            means.push(near.iter().sum::<f64>() / near.len() as f64);
        }
        let total = means.iter().sum::<f64>().max(1.0);
        means.iter().map(|m| (m + 20.0 + 20e-6 * total) / total).collect()
    }

    /// The rising sequence nearest to `values`, by the formula of isotonic regression: the largest,
    /// over all beginnings at or before a place, of the least weighted mean up to any end at or
    /// after it.
    fn isotonic(values: &[f64], weights: &[f64]) -> Vec<f64> {
        let sums = |terms: &dyn Fn(usize) -> f64| {
            let mut sums = vec![0.0];
            for at in 0..values.len() {
                sums.push(sums[at] + terms(at));
            }
            sums
        };
        let (weighted, weight) = (sums(&|i| weights[i] * values[i]), sums(&|i| weights[i]));
        let mean = |from: usize, to: usize| {
            (weighted[to + 1] - weighted[from]) / (weight[to + 1] - weight[from])
        };
        (0..values.len())
            .map(|at| {
                let least = |from: usize| {
                    (at..values.len()).map(|to| mean(from, to)).fold(f64::INFINITY, f64::min)
                };
                (0..=at).map(least).fold(f64::NEG_INFINITY, f64::max)
            })
            .collect()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        #[test]
        fn ratios_are_those_of_the_smoothed_histograms_made_to_rise(counts in counts()) {
            let (inside, outside) = (density(&counts.inside), density(&counts.outside));
            let pairs = || inside.iter().zip(&outside);
            let ratios: Vec<f64> = pairs().map(|(a, b)| (a / b).ln()).collect();
            let weights: Vec<f64> = pairs().map(|(a, b)| a + b).collect();
            let found = Evidence::from_counts(&counts);
            for (at, wanted) in isotonic(&ratios, &weights).into_iter().enumerate() {
                let found = f64::from(found.of(at as u8));
                prop_assert!((found - wanted.clamp(-4.0, 4.0)).abs() < 1e-4, "{at}: {found} {wanted}");
            }
            prop_assert_eq!(found.of(255), 0.0);
        }

        #[test]
        fn mixing_keeps_how_many_there_are_and_shares_out_how_they_lie(
            own in counts(), other in counts(), share in 0.0..1.0_f64,
        ) {
            let mixed = own.mixed(&other, share);
            let classes = [
                (&own.inside, &other.inside, &mixed.inside),
                (&own.outside, &other.outside, &mixed.outside),
            ];
            for (own, other, mixed) in classes {
                let (total, others): (f64, f64) = (own.iter().sum(), other.iter().sum());
                let kept = if total == 0.0 { others } else { total };
                prop_assert!((mixed.iter().sum::<f64>() - kept).abs() <= 1e-9 * kept);
                for at in 0..256 {
                    let wanted = match (total == 0.0, others == 0.0) {
                        (_, true) => own[at],
                        (true, false) => other[at],
                        _ => total * ((1.0 - share) * own[at] / total + share * other[at] / others),
                    };
                    prop_assert!((mixed[at] - wanted).abs() <= 1e-9 * (1.0 + wanted));
                }
            }
        }
    }
}
