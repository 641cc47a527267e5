//! Images of the components, straight from packed bits.

use rayon::prelude::*;

use crate::mask::Mask;

/// A grey image of `width` × `height` values, rows from top to bottom.
#[derive(Clone, Debug, PartialEq)]
pub struct GreyImage {
    /// Width, pixels.
    pub width: usize,
    /// Height, pixels.
    pub height: usize,
    /// One value a pixel, row-major; 0 is black, 1 is white, values outside are clipped when shown.
    pub values: Vec<f64>,
}

impl GreyImage {
    /// The image as bytes: 0 black, 255 white, rounded, clipped.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        self.values.iter().map(|v| (v.clamp(0.0, 1.0) * 255.0).round() as u8).collect()
    }
}

/// Σ weight(t) · mask(t), pixel by pixel. Rows are independent, and each pixel adds its masks in
/// order, so the result does not depend on the number of threads.
pub(super) fn weighted_sum(masks: &[&Mask], weights: &[f64]) -> GreyImage {
    let (width, height) = masks.first().map_or((0, 0), |m| (m.width(), m.height()));
    let mut values = vec![0.0; width * height];
    values.par_chunks_mut(width.max(1)).enumerate().for_each(|(y, row)| {
        for (mask, weight) in masks.iter().zip(weights) {
            let words = mask.words_per_row();
            for (at, &word) in mask.words()[y * words..(y + 1) * words].iter().enumerate() {
                let mut rest = word;
                while rest != 0 {
                    row[64 * at + rest.trailing_zeros() as usize] += weight;
                    rest &= rest - 1;
                }
            }
        }
    });
    GreyImage { width, height, values }
}
