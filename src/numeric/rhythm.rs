//! What is fast and what is slow in several series at once.

use nalgebra::DMatrix;

use super::amplitude_spectrum;

/// Points a bin at which the spectrum is searched.
const ZERO_PADDING: usize = 8;

/// Below this many cycles in the series lies drift, whatever its strength.
const LEAST_CYCLES: f64 = 0.75;

/// The frequency at which power times frequency, the power of all columns added up with their
/// weights, is largest, cycles a sample; 0 of series too short to have one.
///
/// Power times frequency is power an octave. What changes slowly without repeating has power that
/// falls with the square of the frequency or faster, so it cannot win by being slow; a rhythm's
/// second harmonic wins only when it has more than half of the rhythm's own power.
#[must_use]
pub fn dominant_frequency(columns: &[Vec<f64>], weights: &[f64]) -> f64 {
    let n = columns.first().map_or(0, Vec::len);
    let mut power = vec![0.0; n * ZERO_PADDING / 2 + 1];
    for (column, weight) in columns.iter().zip(weights) {
        let mean = super::mean(column);
        let centred: Vec<f64> = column.iter().map(|v| v - mean).collect();
        for (k, (sum, a)) in
            power.iter_mut().zip(amplitude_spectrum(&centred, ZERO_PADDING)).enumerate()
        {
            *sum += weight * a * a * k as f64;
        }
    }
    let first = (LEAST_CYCLES * ZERO_PADDING as f64).ceil() as usize;
    let Some(peak) = (first..power.len().saturating_sub(1))
        .max_by(|&a, &b| power[a].total_cmp(&power[b]).then(b.cmp(&a)))
    else {
        return 0.0;
    };
    let (before, top, after) = (power[peak - 1], power[peak], power[peak + 1]);
    let curvature = before - 2.0 * top + after;
    let shift = if curvature < 0.0 { 0.5 * (before - after) / curvature } else { 0.0 };
    (peak as f64 + shift.clamp(-0.5, 0.5)) / (n * ZERO_PADDING) as f64
}

/// An orthonormal basis of what is slow over `span` samples: the mean and the cosines of 1 to
/// `half_cycles` half cycles over the span, at the samples `times` (0 to span − 1, rising).
/// Fewer vectors when there are fewer samples.
#[must_use]
pub fn slow_basis(times: &[usize], span: usize, half_cycles: usize) -> Vec<Vec<f64>> {
    let count = (half_cycles + 1).min(times.len());
    if count == 0 {
        return Vec::new();
    }
    let turn = std::f64::consts::PI / span.max(1) as f64;
    let cosines = DMatrix::from_fn(times.len(), count, |row, j| {
        (turn * j as f64 * (times[row] as f64 + 0.5)).cos()
    });
    let q = cosines.qr().q();
    (0..count).map(|j| q.column(j).iter().copied().collect()).collect()
}

/// Widest search for a line's frequency on either side of where it is expected, as a share of it, and
/// the steps in which it is searched.
const LINE_SEARCH: f64 = 0.12;
const LINE_STEPS: i32 = 60;

/// The frequency near `about`, cycles a sample, of the sinusoid that explains most of all columns, by
/// least squares on what the orthonormal `basis` leaves of it: exact where samples are missing, and
/// not drawn aside by what the basis has taken out of the columns. `times` are the columns' samples;
/// `weights` weigh the columns' power.
#[must_use]
pub fn line_frequency(
    columns: &[Vec<f64>],
    weights: &[f64],
    times: &[usize],
    basis: &[Vec<f64>],
    about: f64,
) -> f64 {
    let explained = |frequency: f64| -> f64 {
        let turn = std::f64::consts::TAU * frequency;
        let wave = |shift: f64| times.iter().map(move |&t| (turn * t as f64 + shift).cos());
        let cos = without(wave(0.0).collect(), basis);
        let sin = without(wave(-std::f64::consts::FRAC_PI_2).collect(), basis);
        // The two, made orthonormal; a wave that the basis holds explains nothing.
        let Some(cos) = unit(cos) else { return 0.0 };
        let Some(sin) = unit(without(sin, std::slice::from_ref(&cos))) else { return 0.0 };
        columns
            .iter()
            .zip(weights)
            .map(|(c, w)| w * (dot(c, &cos).powi(2) + dot(c, &sin).powi(2)))
            .sum()
    };
    let at = |step: i32| about * (1.0 + LINE_SEARCH * f64::from(step) / f64::from(LINE_STEPS));
    (-LINE_STEPS..=LINE_STEPS)
        .map(|step| (at(step), explained(at(step))))
        .max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.total_cmp(&a.0)))
        .map_or(about, |best| best.0)
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

/// `vector` less its projections on an orthonormal basis.
fn without(mut vector: Vec<f64>, basis: &[Vec<f64>]) -> Vec<f64> {
    for b in basis {
        let along = dot(&vector, b);
        vector.iter_mut().zip(b).for_each(|(v, b)| *v -= along * b);
    }
    vector
}

/// `vector` at length one; `None` when next to nothing is left of a vector of ones.
fn unit(mut vector: Vec<f64>) -> Option<Vec<f64>> {
    let length = dot(&vector, &vector).sqrt();
    (length > 1e-6 * (vector.len() as f64).sqrt()).then(|| {
        vector.iter_mut().for_each(|v| *v /= length);
        vector
    })
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn a_rhythm_is_found_under_a_drift_ten_times_as_large(
            n in 40_usize..120, cycles in 3.0..9.0_f64, phase in 0.0..TAU, bend in -10.0..10.0_f64
        ) {
            let at = |t: usize| t as f64 / n as f64;
            let wave = |shift: f64| -> Vec<f64> {
                (0..n).map(|t| (TAU * cycles * at(t) + phase + shift).cos()).collect()
            };
            let drift: Vec<f64> = (0..n).map(|t| bend * (at(t) - 0.5)).collect();
            // A drift alone is found at its own slowness, never above it.
            let columns = [drift, wave(0.0), wave(0.25 * TAU)];
            let found = dominant_frequency(&columns, &[0.05, 1.0, 1.0]) * n as f64;
            prop_assert!((found - cycles).abs() < 0.3, "{found} instead of {cycles}");
        }

        #[test]
        fn the_slow_basis_is_orthonormal_and_holds_what_is_slow(
            span in 12_usize..60, half_cycles in 0_usize..6, gap in 0_usize..5
        ) {
            let times: Vec<usize> = (0..span).filter(|t| t % 7 != gap).collect();
            let basis = slow_basis(&times, span, half_cycles);
            let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
            for (i, a) in basis.iter().enumerate() {
                for (j, b) in basis.iter().enumerate() {
                    prop_assert!((dot(a, b) - f64::from(u8::from(i == j))).abs() < 1e-9);
                }
            }
            let ones = vec![1.0; times.len()];
            let held: f64 = basis.iter().map(|b| dot(b, &ones).powi(2)).sum();
            prop_assert!((held - times.len() as f64).abs() < 1e-6);
        }
    }

    #[test]
    fn a_line_is_found_beside_gaps_and_without_the_slow() {
        let times: Vec<usize> = (0..50).filter(|t| !(20..27).contains(t) && t % 11 != 3).collect();
        let truth = 1.0 / 9.3;
        let basis = slow_basis(&times, 50, 4);
        let wave = |shift: f64| -> Vec<f64> {
            times
                .iter()
                .map(|&t| (TAU * truth * t as f64 + shift).cos() + 0.05 * t as f64)
                .collect()
        };
        let columns: Vec<Vec<f64>> = [wave(0.3), wave(1.7)].map(|c| without(c, &basis)).into();
        let found = line_frequency(&columns, &[0.7, 0.3], &times, &basis, 1.0 / 8.7);
        // A step of the search is a five hundredth.
        assert!((found / truth - 1.0).abs() < 0.004, "{}", 1.0 / found);
    }

    #[test]
    fn without_samples_there_is_nothing_to_find() {
        assert_eq!(dominant_frequency(&[], &[]), 0.0);
        assert_eq!(dominant_frequency(&[vec![1.0]], &[1.0]), 0.0);
        assert!(slow_basis(&[], 5, 3).is_empty());
    }
}
