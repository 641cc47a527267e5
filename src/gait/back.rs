//! Does the back go up and down twice in a period of the silhouette?
//!
//! Each step lifts the trunk, of whichever side the leg is. Where near and far legs look so unlike
//! that the silhouette's strongest line is the stride, the back still shows two steps in it; over
//! a period that is a step, it goes up and down once. (So it does over the stride of a gallop:
//! that it bobs once says nothing.)
//!
//! A trunk also rocks: from end to end as some animals walk, and from side to side, which is what is seen from ahead.
//! Both happen once a stride and hide the steps in any one column, but leave the middle of the trunk where it is. So
//! whether there are two steps is asked of the middle ([`middle`]), the mean over the columns.

use super::Clip;
use super::cycle::Fitted;
use crate::numeric::{Coefficients, Harmonics};

/// Harmonics of the period that are fitted to the back.
const MOST_HARMONICS: usize = 4;

/// Periods that must be seen.
const LEAST_PERIODS: f64 = 2.0;

/// The second line must hold this many times the power that noise gives it …
const SEEN_OVER_NOISE: f64 = 10.0;

/// … and the noise's share in either line is taken to be at most this many times the mean.
const NOISE_AT_MOST: f64 = 3.0;

/// Power of the back's second line over that of its first, summed over the columns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SecondOverFirst {
    /// At the least that noise leaves room for; 0 where the second line is not seen.
    pub(super) at_least: f64,
    /// At the most; infinite where the first line may be nothing but noise.
    pub(super) at_most: f64,
}

/// The height of the trunk's middle: the mean over the columns.
pub(super) fn middle(rows: &Coefficients) -> Option<Coefficients> {
    let mean = |t: usize| rows.point(t).iter().sum::<f64>() / rows.components() as f64;
    Coefficients::from_rows(rows.frames(), 1, (0..rows.frames()).map(mean).collect())
}

/// Compares the lines. `rows` are frames × columns, in frames that are not seen without meaning.
/// `None` where nothing can be said.
pub(super) fn second_over_first(
    clip: &Clip,
    fitted: &Fitted,
    rows: &Coefficients,
) -> Option<SecondOverFirst> {
    let turns = fitted.phase[fitted.phase.len() - 1] - fitted.phase[0];
    let order = fitted.series.order().min(MOST_HARMONICS);
    let frames: f64 = fitted.trust.iter().sum();
    let free = frames - (2 + 2 * order) as f64;
    if rows.frames() != clip.frames() || order < 2 || turns < LEAST_PERIODS || free < 1.0 {
        return None;
    }
    let values = levelled(rows, &fitted.trust);
    let columns = rows.components();
    let lines = Harmonics::fit(&fitted.phase, &values, columns, &fitted.trust, order)?;
    let missed: f64 = values
        .chunks_exact(columns)
        .enumerate()
        .filter(|(t, _)| fitted.trust[*t] > 0.0)
        .map(|(t, row)| {
            let (value, _) = lines.at(fitted.phase[t]);
            let square: f64 = row.iter().zip(value.iter()).map(|(x, v)| (x - v).powi(2)).sum();
            fitted.trust[t] * square
        })
        .sum();
    let by_chance = 2.0 * missed / free / frames;
    let (first, second) = (lines.power(1), lines.power(2));
    let room = NOISE_AT_MOST * by_chance;
    let seen = second > SEEN_OVER_NOISE * by_chance;
    Some(SecondOverFirst {
        at_least: if seen { (second - room) / (first + room) } else { 0.0 },
        at_most: if first > room { (second + room) / (first - room) } else { f64::INFINITY },
    })
}

/// The rows with a straight line taken out of each column: a camera that tilts, an animal that
/// comes nearer.
fn levelled(rows: &Coefficients, trust: &[f64]) -> Vec<f64> {
    let total: f64 = trust.iter().sum::<f64>().max(f64::MIN_POSITIVE);
    let mean_of = |value: &dyn Fn(usize) -> f64| -> f64 {
        trust.iter().enumerate().map(|(t, w)| w * value(t)).sum::<f64>() / total
    };
    let middle = mean_of(&|t| t as f64);
    let inertia = mean_of(&|t| (t as f64 - middle).powi(2)).max(f64::MIN_POSITIVE);
    let columns = rows.components();
    let mut values = vec![0.0; rows.frames() * columns];
    for c in 0..columns {
        let mean = mean_of(&|t| rows.point(t)[c]);
        let slope = mean_of(&|t| (t as f64 - middle) * rows.point(t)[c]) / inertia;
        for t in 0..rows.frames() {
            values[t * columns + c] = rows.point(t)[c] - mean - slope * (t as f64 - middle);
        }
    }
    values
}
