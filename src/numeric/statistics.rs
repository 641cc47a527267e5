//! Means, deviations and correlation of a series. Deviations are of the population (divisor n),
//! as in the seed's equation 3.

/// Arithmetic mean; 0 of an empty series.
#[must_use]
pub fn mean(series: &[f64]) -> f64 {
    if series.is_empty() { 0.0 } else { series.iter().sum::<f64>() / series.len() as f64 }
}

/// Population standard deviation; 0 of an empty series.
#[must_use]
pub fn standard_deviation(series: &[f64]) -> f64 {
    let centre = mean(series);
    let squares: Vec<f64> = series.iter().map(|v| (v - centre).powi(2)).collect();
    mean(&squares).sqrt()
}

/// The series with mean 0 and standard deviation 1. A series that does not vary (deviation at
/// the rounding of its own size, 1e-12 of the largest value) becomes all zeros.
#[must_use]
pub fn standardized(series: &[f64]) -> Vec<f64> {
    let centre = mean(series);
    let deviation = standard_deviation(series);
    let size = series.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    if deviation <= 1e-12 * size || deviation == 0.0 {
        return vec![0.0; series.len()];
    }
    series.iter().map(|v| (v - centre) / deviation).collect()
}

/// Pearson's correlation coefficient, −1…1; 0 when either series does not vary.
///
/// # Panics
/// When the lengths differ.
#[must_use]
pub fn correlation(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len(), "series of equal length");
    let products: Vec<f64> =
        standardized(a).iter().zip(standardized(b)).map(|(x, y)| x * y).collect();
    mean(&products).clamp(-1.0, 1.0)
}

/// The lower median; 0 of an empty series.
#[must_use]
pub fn median(series: &[f64]) -> f64 {
    let mut sorted = series.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len().saturating_sub(1) / 2).copied().unwrap_or(0.0)
}

/// Median distance from the median, times the factor that makes it the standard deviation of a
/// normal distribution: outliers, up to half of the series, hardly move it. 0 of an empty series.
#[must_use]
pub fn robust_deviation(series: &[f64]) -> f64 {
    /// 1 / Φ⁻¹(3/4).
    const OF_NORMAL: f64 = 1.482_602_218_505_602;
    let centre = median(series);
    let distances: Vec<f64> = series.iter().map(|v| (v - centre).abs()).collect();
    OF_NORMAL * median(&distances)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_textbook_correlation() {
        // Anscombe's first set: r = 0.81642 (Anscombe 1973).
        let x = [10.0, 8.0, 13.0, 9.0, 11.0, 14.0, 6.0, 4.0, 12.0, 7.0, 5.0];
        let y = [8.04, 6.95, 7.58, 8.81, 8.33, 9.96, 7.24, 4.26, 10.84, 4.82, 5.68];
        assert!((correlation(&x, &y) - 0.81642).abs() < 1e-5);
        assert!((mean(&y) - 7.500_909).abs() < 1e-6);
    }

    #[test]
    fn a_constant_has_no_deviation_and_no_correlation() {
        assert_eq!(standardized(&[0.1; 7]), vec![0.0; 7]);
        assert_eq!(correlation(&[0.1; 3], &[1.0, 2.0, 3.0]), 0.0);
        assert_eq!(standard_deviation(&[]), 0.0);
    }

    #[test]
    fn outliers_do_not_move_the_robust_deviation() {
        assert_eq!(median(&[3.0, 1.0, 2.0, 9.0]), 2.0);
        assert_eq!((median(&[]), robust_deviation(&[])), (0.0, 0.0));
        let mut series: Vec<f64> = (0..101).map(|i| f64::from(i) / 50.0 - 1.0).collect();
        // Uniform on -1…1: half of it lies within .5 of the middle.
        assert!((robust_deviation(&series) - 0.5 * 1.4826).abs() < 1e-3);
        series[3] = 1e6;
        assert!((robust_deviation(&series) - 0.5 * 1.4826).abs() < 0.05);
    }
}
