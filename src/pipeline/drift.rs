//! Slow changes of the silhouette's shape that are no gait.
//!
//! An animal that walks past a camera close by is seen from ahead first and from behind last; one that
//! turns changes as much. The silhouettes then vary more along that way than by their steps, and PC1
//! and PC2 are the way. As the slow trend of scale, it is no motion of the gait and is taken out
//! before the PCA: from the course of every pixel over the frames, by way of the Gram matrix.

use super::bridge::bridged;
use crate::error::Result;
use crate::image_pca::{CentredGram, ImagePca};
use crate::numeric::{dominant_frequency, line_frequency, slow_basis};
use crate::silhouette::TrendRemoval;

/// What is slower than this share of the frequency at which the silhouette repeats is drift. The
/// stride of a symmetric gait, at one half, stays.
const SLOW_SHARE: f64 = 0.4;

/// What repeats more often than this in the clip is a rhythm, what does not is drift: cosines of up to
/// three half cycles.
const DRIFT_HALF_CYCLES: usize = 3;

/// Share of PC1's variance from which PC1 is drift.
const LEADING_SHARE: f64 = 0.5;

/// Repeats of a faster rhythm that the clip must hold beside a drift, by all components with nothing
/// removed: of fewer, the drift may be the gait, and the rhythm its harmonic.
const LEAST_REPEATS: f64 = 3.0;

/// Two frequencies of one rhythm, one of them with the drift beside it, differ by this share or less; of the four horses
/// by a hundredth.
const SAME_RHYTHM: f64 = 0.1;

/// Least share of the silhouettes' variance that is worth removing where the phase can be measured without; of four
/// horses that walk past a fixed camera it is .23 to .41.
const LEAST_SHARE: f64 = 0.15;

/// Rounds in which the rhythm and what is slow beside it are found. It settles in two to four.
const ROUNDS: usize = 8;

/// The fastest rhythm that is looked for, repeats a frame: key images of a faster one miss its
/// extremes.
const FASTEST_REPEATS: f64 = 1.0 / 6.0;

/// What was found to change slowly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShapeDrift {
    /// Share of the silhouettes' variance, 0…1.
    pub share: f64,
    /// The slow part: the mean and cosines of up to so many half cycles over the seen frames.
    pub half_cycles: usize,
    /// Repeats of the silhouette a frame beside it.
    pub repeats_a_frame: f64,
    /// Whether it was removed.
    pub removed: bool,
}

/// The PCA of the used masks, without the drift if there is one to be removed.
///
/// `times` are the frames of the Gram matrix, counted from the first used one; `removal` is the
/// user's wish.
///
/// # Errors
/// As [`ImagePca::of_gram`].
pub(super) fn fit(
    gram: &CentredGram,
    times: &[usize],
    components: usize,
    removal: TrendRemoval,
) -> Result<(ImagePca, Option<ShapeDrift>)> {
    let plain = ImagePca::of_gram(gram, components)?;
    let span = times.last().map_or(0, |t| t + 1);
    if removal == TrendRemoval::Off {
        return Ok((plain, None));
    }
    let leads = slow_share(&plain, times, span) >= LEADING_SHARE
        && rhythm(&plain, times) * span as f64 >= LEAST_REPEATS;
    if removal == TrendRemoval::Auto && !leads {
        return Ok((plain, None));
    }
    let (left, drift) = Parting { gram, plain: &plain, times, components }.parted();
    if removal == TrendRemoval::On || drift.share >= LEAST_SHARE {
        return Ok((left, Some(drift)));
    }
    Ok((plain, Some(ShapeDrift { removed: false, ..drift })))
}

/// The PCA without what is slow, for a clip in which no phase was found with it: PC1 need not be the drift, a cycle as
/// long as the clip explains everything. `None` where too little repeats in the clip, or something else than before: a
/// step taken out as slow leaves its second harmonic.
pub(super) fn fit_rhythm(
    gram: &CentredGram,
    plain: &ImagePca,
    times: &[usize],
    components: usize,
) -> Option<(ImagePca, ShapeDrift)> {
    let span = times.last().map_or(0, |t| t + 1);
    let repeats = rhythm(plain, times);
    if repeats * (span as f64) < LEAST_REPEATS {
        return None;
    }
    let (left, drift) = Parting { gram, plain, times, components }.parted();
    same_rhythm(drift.repeats_a_frame, repeats).then_some((left, drift))
}

/// Whether two frequencies, cycles a frame, are those of one rhythm.
fn same_rhythm(repeats: f64, expected: f64) -> bool {
    (repeats / expected - 1.0).abs() <= SAME_RHYTHM
}

/// What a rhythm is parted from what is slow with.
struct Parting<'a> {
    gram: &'a CentredGram,
    plain: &'a ImagePca,
    times: &'a [usize],
    components: usize,
}

/// A rhythm without what is slow beside it.
struct Parted {
    left: ImagePca,
    /// What was taken out: the mean and cosines of up to so many half cycles.
    half_cycles: usize,
    /// Repeats a frame.
    repeats: f64,
}

impl Parting<'_> {
    /// What repeats, apart from what is slow beside it, and what that is.
    fn parted(&self) -> (ImagePca, ShapeDrift) {
        // From above: a slow part cannot win by what leaks from it.
        let mut found = self.settled(FASTEST_REPEATS);
        // But of a rhythm that is slow to begin with its second harmonic may be left, and hold its own: what is too slow
        // for that is a little less than the rhythm, and more of it where frames are missing.
        let before = rhythm(self.plain, self.times);
        if same_rhythm(found.repeats, 2.0 * before) {
            let slower = self.settled(before);
            if same_rhythm(slower.repeats, before) {
                found = slower;
            }
        }
        let Parted { left, half_cycles, repeats } = found;
        let share = 1.0 - left.total_variance / self.plain.total_variance;
        let repeats_a_frame = refined(&left, self.times, self.span(), half_cycles, repeats);
        (left, ShapeDrift { share, half_cycles, repeats_a_frame, removed: true })
    }

    /// Takes out what is slow beside a rhythm of `repeats` a frame, and again beside the one that is left, until it stays.
    fn settled(&self, mut repeats: f64) -> Parted {
        let (mut left, mut half_cycles) = (self.plain.clone(), usize::MAX);
        for _ in 0..ROUNDS {
            let slower = (2.0 * self.span() as f64 * SLOW_SHARE * repeats) as usize;
            if slower == half_cycles {
                break;
            }
            half_cycles = slower;
            let slow = slow_basis(self.times, self.span(), half_cycles);
            let Ok(pca) = ImagePca::of_gram(&self.gram.without(&slow), self.components) else {
                break;
            };
            left = pca;
            repeats = rhythm(&left, self.times);
        }
        Parted { left, half_cycles, repeats }
    }

    fn span(&self) -> usize {
        self.times.last().map_or(0, |t| t + 1)
    }
}

/// Share of PC1's variance that does not repeat.
fn slow_share(plain: &ImagePca, times: &[usize], span: usize) -> f64 {
    let first = plain.scores.column(0);
    let held: f64 = slow_basis(times, span, DRIFT_HALF_CYCLES)
        .iter()
        .map(|b| b.iter().zip(&first).map(|(x, y)| x * y).sum::<f64>().powi(2))
        .sum();
    held / first.len() as f64
}

/// Repeats of the silhouette a frame, by all components together.
fn rhythm(pca: &ImagePca, times: &[usize]) -> f64 {
    let span = times.last().map_or(0, |t| t + 1);
    let used: Vec<bool> = (0..span).map(|t| times.binary_search(&t).is_ok()).collect();
    let scores = bridged(&pca.scores, &used);
    let columns: Vec<Vec<f64>> = (0..scores.components()).map(|c| scores.column(c)).collect();
    dominant_frequency(&columns, &pca.variance_shares())
}

/// The rhythm by least squares on the seen frames alone.
fn refined(left: &ImagePca, times: &[usize], span: usize, half_cycles: usize, repeats: f64) -> f64 {
    let columns: Vec<Vec<f64>> =
        (0..left.scores.components()).map(|c| left.scores.column(c)).collect();
    let basis = slow_basis(times, span, half_cycles);
    line_frequency(&columns, &left.variance_shares(), times, &basis, repeats)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::image_pca::Changes;
    use crate::mask::Mask;

    /// A trunk that widens by `drift` over the clip, with two legs that swing every nine frames.
    fn clip(frames: usize, drift: f64) -> Vec<Mask> {
        swinging(frames, drift, 9.0)
    }

    /// The same, every so many frames.
    fn swinging(frames: usize, drift: f64, period_frames: f64) -> Vec<Mask> {
        (0..frames)
            .map(|t| {
                let swing = (TAU * t as f64 / period_frames).sin_cos();
                let half_width = 20.0 + drift * t as f64 / frames as f64;
                Mask::from_fn(120, 60, |x, y| {
                    let (x, y) = (x as f64 - 60.0, y as f64 - 20.0);
                    let trunk = (x / half_width).hypot(y / 12.0) < 1.0;
                    let leg = |at: f64, way: f64| {
                        y > 0.0 && y < 32.0 && (x - at - way * 6.0 * y / 32.0).abs() < 2.5
                    };
                    trunk || leg(-12.0, swing.0) || leg(12.0, swing.1)
                })
            })
            .collect()
    }

    fn fitted(drift: f64, removal: TrendRemoval) -> (ImagePca, Option<ShapeDrift>) {
        let masks = clip(50, drift);
        let gram = CentredGram::of(&Changes::of(&masks.iter().collect::<Vec<_>>()).unwrap());
        fit(&gram, &(0..50).collect::<Vec<_>>(), 6, removal).unwrap()
    }

    #[test]
    fn a_rhythm_beneath_a_drift_comes_first_once_the_drift_is_gone() {
        let (pca, drift) = fitted(24.0, TrendRemoval::Auto);
        let drift = drift.unwrap();
        assert!(drift.removed && drift.share > 0.3, "{drift:?}");
        assert!((drift.repeats_a_frame * 9.0 - 1.0).abs() < 0.02, "{drift:?}");
        // What is left is the swing: its first component varies with it.
        let first = pca.scores.column(0);
        let swing = |phase: f64| -> f64 {
            first.iter().enumerate().map(|(t, v)| v * (TAU * t as f64 / 9.0 + phase).cos()).sum()
        };
        let power = swing(0.0).hypot(swing(TAU / 4.0)) / 25.0;
        assert!(power > 1.3, "amplitude {power} of √2");
    }

    #[test]
    fn a_rhythm_is_looked_for_beside_a_drift_that_does_not_lead_unless_hardly_anything_repeats() {
        let apart = |frames: usize, drift: f64| {
            let masks = clip(frames, drift);
            let gram = CentredGram::of(&Changes::of(&masks.iter().collect::<Vec<_>>()).unwrap());
            let plain = ImagePca::of_gram(&gram, 6).unwrap();
            let times: Vec<usize> = (0..frames).collect();
            assert!(slow_share(&plain, &times, frames) < LEADING_SHARE || frames < 27);
            fit_rhythm(&gram, &plain, &times, 6)
        };
        let (pca, drift) = apart(50, 4.0).unwrap();
        assert!(drift.removed && (drift.repeats_a_frame * 9.0 - 1.0).abs() < 0.02, "{drift:?}");
        assert!((pca.total_variance > 0.0) && drift.share < 0.5, "{drift:?}");
        // Two and a half repeats, and of the drift alone none.
        assert!(apart(22, 4.0).is_none());
        assert!(apart(10, 24.0).is_none());
    }

    #[test]
    fn a_rhythm_is_not_taken_out_as_slow_beside_its_second_harmonic() {
        // Legs that cross nine and a half times in 120 frames, of which 24 are hidden: beside the fastest rhythm that is
        // looked for, and so beside the second harmonic, what is slow is all but the rhythm.
        let step = 12.15;
        let masks = swinging(120, 12.0, step);
        let times: Vec<usize> = (0..120).filter(|t| !(52..76).contains(t)).collect();
        let seen: Vec<&Mask> = times.iter().map(|t| &masks[*t]).collect();
        let gram = CentredGram::of(&Changes::of(&seen).unwrap());
        let (_, drift) = fit(&gram, &times, 6, TrendRemoval::On).unwrap();
        let drift = drift.unwrap();
        assert!((drift.repeats_a_frame * step - 1.0).abs() < 0.02, "{drift:?}");
    }

    #[test]
    fn a_steady_gait_and_a_wish_to_keep_it_are_left_alone() {
        let (steady, none) = fitted(0.0, TrendRemoval::Auto);
        assert_eq!(none, None);
        let (kept, none) = fitted(24.0, TrendRemoval::Off);
        assert_eq!(none, None);
        let masks = clip(50, 24.0);
        let plain = ImagePca::fit(&masks.iter().collect::<Vec<_>>(), 6).unwrap();
        assert_eq!(kept, plain);
        assert!(steady.total_variance < plain.total_variance);
        let (_, asked) = fitted(0.0, TrendRemoval::On);
        let asked = asked.unwrap();
        assert!(asked.removed && (asked.repeats_a_frame * 9.0 - 1.0).abs() < 0.02, "{asked:?}");
    }
}
