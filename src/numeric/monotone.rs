//! Least-squares fit of a rising sequence.

/// The non-decreasing sequence x that minimises Σ wᵢ (xᵢ − valuesᵢ)², by pooling of adjacent
/// violators (Barlow et al., *Statistical Inference under Order Restrictions*, 1972).
///
/// Weights are positive; the fit is exact up to rounding and unique.
///
/// # Panics
/// When the lengths differ.
#[must_use]
pub fn rising_fit(values: &[f64], weights: &[f64]) -> Vec<f64> {
    assert_eq!(values.len(), weights.len(), "one weight a value");
    // Blocks of equal fitted value: (mean, weight, length).
    let mut blocks: Vec<(f64, f64, usize)> = Vec::new();
    for (&value, &weight) in values.iter().zip(weights) {
        let mut block = (value, weight, 1);
        while let Some(&(mean, w, length)) = blocks.last() {
            if mean <= block.0 {
                break;
            }
            let total = w + block.1;
            block = ((mean * w + block.0 * block.1) / total, total, length + block.2);
            blocks.pop();
        }
        blocks.push(block);
    }
    blocks.into_iter().flat_map(|(mean, _, length)| std::iter::repeat_n(mean, length)).collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_dip_is_pooled_by_weight() {
        assert_eq!(rising_fit(&[0.0, 3.0, 0.0, 5.0], &[1.0, 1.0, 2.0, 1.0]), [0.0, 1.0, 1.0, 5.0]);
    }

    proptest! {
        /// The min-max formula: x_i = max over a ≤ i of min over b ≥ i of the mean of a..=b.
        #[test]
        fn agrees_with_the_min_max_formula(
            data in prop::collection::vec((-5.0..5.0_f64, 0.1..3.0_f64), 1..14)
        ) {
            let (values, weights): (Vec<f64>, Vec<f64>) = data.iter().copied().unzip();
            let mean = |a: usize, b: usize| {
                let total: f64 = weights[a..=b].iter().sum();
                (a..=b).map(|i| values[i] * weights[i]).sum::<f64>() / total
            };
            for (i, x) in rising_fit(&values, &weights).into_iter().enumerate() {
                let expected = (0..=i)
                    .map(|a| (i..values.len()).map(|b| mean(a, b)).fold(f64::INFINITY, f64::min))
                    .fold(f64::NEG_INFINITY, f64::max);
                prop_assert!((x - expected).abs() < 1e-12);
            }
        }
    }
}
