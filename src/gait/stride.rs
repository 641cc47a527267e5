//! Is a repeat of the silhouette a step or a stride?

use serde::Serialize;

use super::cycle::Fitted;
use super::{Clip, Symmetry, back};
use crate::numeric::{Coefficients, Harmonics};

/// Odd lines must hold this many times the power that noise would give them. On the rigs, yaw 0
/// and 20, they hold 16 times and more where the period is a step, and 1.1 at most where it is a
/// stride.
const LINE_OVER_NOISE: f64 = 3.0;

/// … and this share of the power of the even lines. Less may be the side of a changing speed, or
/// harmonics above the Nyquist frequency folded back: at 14.58 frames a period the twelfth to
/// fourteenth come to lie near odd lines, with .7 % of the power.
const LEAST_ODD_SHARE: f64 = 0.02;

/// A step period leaves odd lines: near and far legs never look quite alike (on the rigs and the
/// built-in horse 4.6 % of the even lines' power at the least, in pure profile). Where the odd
/// lines are certain to hold less than this, the period is the stride even of a gait that is
/// symmetric: the view shows its two halves differently. Unless the back says otherwise: drawn
/// animals can be perfectly symmetric.
const STEP_LEAVES_SHARE: f64 = 0.035;

/// A back whose middle has a second line with this many times the power of its first bobs twice a period: the
/// period is a stride. Over the period of a step (walks and trots of the rigs and the built-in horse, sound and lame,
/// seven views from the side to the front) it holds .12 times at the most, perfectly symmetric ones in pure profile .1;
/// over the stride of a walk .9 to 3000 times, but for an alpaca of which the left side is late by a fifth of the
/// stride (.24 at 45 degrees) and for the fox (.05 to 1), whose trunk rises with one pair of legs. The stride of
/// a gallop may hold two bobs as well, of the gathered and of the stretched flight: it is the stride all the same.
const BACK_BOBS_TWICE: f64 = 0.45;

/// Over all columns a back bobs once when its second line holds less than this, of a gait that was named symmetric and
/// so has two steps. (The middle of the fox's trunk hardly bobs twice, but no column of it is so still.)
const BACK_BOBS_ONCE: f64 = 0.14;

/// Periods that must be seen: each of the two halves twice.
const LEAST_PERIODS: f64 = 4.0;

/// How often the silhouette repeats in a stride.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Repeats {
    /// Its period is the stride.
    EveryStride,
    /// Its period is the step, half a stride.
    EveryStep,
    /// It cannot be told from this view.
    Unknown,
}

impl Repeats {
    /// The word used in documents.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Repeats::EveryStride => "every_stride",
            Repeats::EveryStep => "every_step",
            Repeats::Unknown => "unknown",
        }
    }
}

/// What speaks for steps or strides.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct StrideEvidence {
    /// The answer.
    pub repeats: Repeats,
    /// Power at odd multiples of half the silhouette's frequency over that of the even ones, with
    /// what noise gives taken off; 0 or more.
    pub odd_share: f64,
    /// The same power over what noise alone would give: about 1 when there is nothing.
    pub odd_over_noise: f64,
    /// The largest `odd_share` that the noise leaves room for.
    pub odd_share_at_most: f64,
    /// Power of the second line of the back's middle over that of its first, at the least that noise leaves
    /// room for: where it is large, the back goes up and down twice in the silhouette's period, which
    /// is the stride then. `None` where the back says nothing.
    pub back_second_over_first: Option<f64>,
    /// Whether the evidence contradicts the gait that was named.
    pub contradicts_gait: bool,
}

impl StrideEvidence {
    /// Whether the two steps of a stride look so different that there is more in the lines of the stride
    /// than in those of the step.
    #[must_use]
    pub fn outweighs_the_step(&self) -> bool {
        self.repeats == Repeats::EveryStep && self.odd_share > 1.0
    }

    /// Weighs the evidence of a clip whose period is fitted; `back` as in
    /// [`Known::back`](super::Known::back).
    pub(super) fn weigh(
        clip: &Clip,
        fitted: &Fitted,
        symmetry: Symmetry,
        back: Option<&Coefficients>,
    ) -> Self {
        let lines = odd_lines(clip, fitted);
        let odd = (lines.power - lines.by_chance).max(0.0);
        let even: f64 = (1..=fitted.series.order()).map(|h| fitted.series.power(h)).sum();
        let share = odd / even.max(f64::MIN_POSITIVE);
        // Twice what noise gives on the average is exceeded by noise once in some hundreds.
        let at_most = (odd + 2.0 * lines.by_chance) / even.max(f64::MIN_POSITIVE);
        let over_noise = lines.power / lines.by_chance.max(f64::MIN_POSITIVE);
        let turns = fitted.phase[fitted.phase.len() - 1] - fitted.phase[0];
        let seen =
            turns >= LEAST_PERIODS && over_noise > LINE_OVER_NOISE && share > LEAST_ODD_SHARE;
        let compare = |rows: &Coefficients| back::second_over_first(clip, fitted, rows);
        let middle = back.and_then(back::middle).and_then(|row| compare(&row));
        let two_steps = middle.is_some_and(|b| b.at_least > BACK_BOBS_TWICE);
        let one_step = back.and_then(compare).is_some_and(|b| b.at_most < BACK_BOBS_ONCE);
        let (repeats, contradicts_gait) = match symmetry {
            Symmetry::Symmetric if seen => (Repeats::EveryStep, false),
            Symmetry::Symmetric if two_steps => (Repeats::EveryStride, false),
            Symmetry::Symmetric if one_step || at_most > STEP_LEAVES_SHARE => {
                (Repeats::EveryStep, false)
            }
            Symmetry::Symmetric => (Repeats::EveryStride, false),
            Symmetry::Asymmetric => (Repeats::EveryStride, seen),
            // One of the two is wrong, and nothing says which.
            Symmetry::Unknown if seen && two_steps => (Repeats::Unknown, false),
            Symmetry::Unknown if seen => (Repeats::EveryStep, false),
            Symmetry::Unknown if two_steps => (Repeats::EveryStride, false),
            Symmetry::Unknown => (Repeats::Unknown, false),
        };
        Self {
            repeats,
            odd_share: share,
            odd_over_noise: over_noise,
            odd_share_at_most: at_most,
            back_second_over_first: middle.map(|b| b.at_least),
            contradicts_gait,
        }
    }
}

struct OddLines {
    power: f64,
    by_chance: f64,
}

/// Power of what the period's series leaves, at odd multiples of half its frequency, and what
/// noise would give: the mean of the power at places between all lines.
fn odd_lines(clip: &Clip, fitted: &Fitted) -> OddLines {
    let mut rest = clip.restored(&fitted.phase, &fitted.series).values;
    for (t, row) in rest.chunks_exact_mut(clip.components).enumerate() {
        let (value, _) = fitted.series.at(fitted.phase[t]);
        for (x, v) in row.iter_mut().zip(value.iter()) {
            *x -= v;
        }
    }
    let at = |multiple: f64| -> f64 {
        let phase: Vec<f64> = fitted.phase.iter().map(|p| p * multiple).collect();
        Harmonics::fit(&phase, &rest, clip.components, &fitted.trust, 1).map_or(0.0, |s| s.power(1))
    };
    let highest = fitted.series.order().min(3);
    let odd: Vec<f64> = (0..highest).map(|k| k as f64 + 0.5).collect();
    let between = odd.iter().flat_map(|o| [o - 0.25, o + 0.25]);
    let chance: Vec<f64> = between.map(at).collect();
    OddLines {
        power: odd.iter().map(|o| at(*o)).sum(),
        by_chance: chance.iter().sum::<f64>() / 2.0,
    }
}
