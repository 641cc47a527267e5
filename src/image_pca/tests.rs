use proptest::prelude::*;

use super::*;

fn random_masks(n: usize, width: usize, height: usize, seed: u64) -> Vec<Mask> {
    (0..n)
        .map(|i| {
            Mask::from_fn(width, height, |x, y| {
                let mut h = seed
                    ^ ((i * 7919 + x * 131 + y * 17) as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15);
                h ^= h >> 29;
                h.wrapping_mul(0xBF58_476D_1CE4_E5B9) >> 63 == 1
            })
        })
        .collect()
}

/// Equations 1 to 5 as they stand: the pixel covariance matrix and its eigenvectors.
fn dense(masks: &[Mask]) -> (Vec<f64>, f64, DMatrix<f64>) {
    let (w, h, n) = (masks[0].width(), masks[0].height(), masks.len());
    let mut images =
        DMatrix::from_fn(n, w * h, |t, p| f64::from(u8::from(masks[t].get(p % w, p / w))));
    for mut column in images.column_iter_mut() {
        let mean = column.mean();
        column.add_scalar_mut(-mean);
    }
    let covariance = images.transpose() * &images / n as f64;
    let pairs = leading_eigenpairs(&covariance, 3);
    let basis = DMatrix::from_columns(&pairs.vectors);
    (pairs.values, covariance.trace(), images * basis)
}

proptest! {
    #[test]
    fn the_gram_route_gives_what_the_pixel_covariance_gives(n in 5_usize..12, seed in any::<u64>()) {
        let masks = random_masks(n, 7, 5, seed);
        let refs: Vec<&Mask> = masks.iter().collect();
        let pca = ImagePca::fit(&refs, 3).unwrap();
        let (values, trace, projections) = dense(&masks);
        prop_assert!((pca.total_variance - trace).abs() < 1e-9);
        for c in 0..3 {
            prop_assert!((pca.eigenvalues[c] - values[c]).abs() < 1e-9);
            // Nearly equal eigenvalues leave the direction within their plane free.
            let alone = values.iter().enumerate().all(|(o, v)| o == c || (v - values[c]).abs() > 1e-3);
            if alone && c < 2 {
                let column = pca.projections.column(c);
                let dot: f64 = column.iter().zip(projections.column(c).iter()).map(|(a, b)| a * b).sum();
                let size = n as f64 * values[c];
                prop_assert!((dot.abs() - size).abs() < 1e-6 * size, "{dot} {size}");
            }
        }
    }
}

#[test]
fn scores_have_unit_deviation_and_rebuild_the_images() {
    let masks = random_masks(8, 9, 4, 3);
    let refs: Vec<&Mask> = masks.iter().collect();
    let pca = ImagePca::fit(&refs, 8).unwrap();
    // Eight masks centred span seven dimensions.
    assert_eq!(pca.eigenvalues.len(), 7);
    let shares: f64 = pca.variance_shares().iter().sum();
    assert!((shares - 1.0).abs() < 1e-12);
    let images = pca.images(&Changes::of(&refs).unwrap());
    for (t, mask) in masks.iter().enumerate() {
        let mut rebuilt = images.mean.values.clone();
        for c in 0..7 {
            assert!((crate::numeric::standard_deviation(&pca.scores.column(c)) - 1.0).abs() < 1e-9);
            let step = images.along(c, 1.0);
            for (pixel, value) in rebuilt.iter_mut().enumerate() {
                *value += pca.scores.point(t)[c] * (step.values[pixel] - images.mean.values[pixel]);
            }
        }
        for (pixel, value) in rebuilt.iter().enumerate() {
            let truth = f64::from(u8::from(mask.get(pixel % 9, pixel / 9)));
            assert!((value - truth).abs() < 1e-9);
        }
    }
}

#[test]
fn masks_without_variation_are_said_plainly() {
    let mask = Mask::from_fn(10, 10, |x, y| x > 3 && y > 3);
    assert!(matches!(
        ImagePca::fit(&[&mask, &mask, &mask], 2),
        Err(Error::MasksConstant { frames: 3 })
    ));
    let empty = Mask::new(10, 10);
    assert!(matches!(ImagePca::fit(&[&empty, &empty], 2), Err(Error::MasksEmpty { frames: 2 })));
    assert!(matches!(ImagePca::fit(&[&mask], 2), Err(Error::TooFewMasks { frames: 1 })));
    assert!(matches!(ImagePca::fit(&[], 2), Err(Error::TooFewMasks { frames: 0 })));
    let small = Mask::new(9, 10);
    assert!(matches!(ImagePca::fit(&[&mask, &small], 2), Err(Error::MaskSize { frame: 1, .. })));
}

proptest! {
    // Eight columns of weights are one vector: with eight components and the mean there are two.
    #[test]
    fn images_are_the_weighted_sums_of_plain_booleans(
        width in 1_usize..200,
        height in 1_usize..4,
        n in 3_usize..80,
        seed in any::<u64>(),
    ) {
        let mut masks = random_masks(n, width, height, seed);
        // A part of the picture in which most masks show the same.
        for (i, mask) in masks.iter_mut().enumerate().skip(1) {
            for x in 0..width.min(70) {
                mask.set(x, 0, (x + i) % 9 > 0);
            }
        }
        let refs: Vec<&Mask> = masks.iter().collect();
        let Ok(pca) = ImagePca::fit(&refs, 8) else { return Ok(()); };
        let images = pca.images(&Changes::of(&refs).unwrap());
        prop_assert_eq!(images.deviations.len(), pca.eigenvalues.len());
        for pixel in 0..width * height {
            let set = |t: usize| f64::from(u8::from(masks[t].get(pixel % width, pixel / width)));
            let mean = (0..n).map(set).sum::<f64>() / n as f64;
            prop_assert_eq!(images.mean.values[pixel], mean);
            for (c, image) in images.deviations.iter().enumerate() {
                let slow: f64 = (0..n).map(|t| pca.scores.point(t)[c] * (set(t) - mean)).sum();
                prop_assert!((image.values[pixel] - slow / n as f64).abs() < 1e-12);
            }
        }
    }
}
