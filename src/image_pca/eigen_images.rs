//! Images of the components, straight from packed bits.

use rayon::prelude::*;

use super::changes::{Changes, TILE};
use crate::numeric::{InstructionSet, Kernel};

/// Weighted sums of the masks that are made together: one vector of eight numbers.
const LANES: usize = 8;

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

/// The mean image of a clip and the images of its components.
#[derive(Clone, Debug, PartialEq)]
pub struct EigenImages {
    /// The mean image ī, in shares of coverage, 0…1.
    pub mean: GreyImage,
    /// For each component √λ·E, the change of the image with a score of one standard deviation, in
    /// shares of coverage.
    pub deviations: Vec<GreyImage>,
}

impl EigenImages {
    /// The images of the bands of a picture, from top to bottom, in one.
    pub(super) fn stacked(bands: impl Iterator<Item = Self>) -> Self {
        let mut bands = bands;
        let none = GreyImage { width: 0, height: 0, values: Vec::new() };
        let mut whole = bands.next().unwrap_or(Self { mean: none, deviations: Vec::new() });
        for band in bands {
            whole.mean.append(band.mean);
            for (image, below) in whole.deviations.iter_mut().zip(band.deviations) {
                image.append(below);
            }
        }
        whole
    }

    /// The mean image ī + `deviations` · √λ·E along one component (seed, figure 7), in shares of
    /// coverage; values may leave 0…1.
    ///
    /// # Panics
    /// When there is no such component.
    #[must_use]
    pub fn along(&self, component: usize, deviations: f64) -> GreyImage {
        let along = &self.deviations[component].values;
        let values = self.mean.values.iter().zip(along).map(|(m, d)| m + deviations * d).collect();
        GreyImage { values, ..self.mean }
    }
}

/// Mean and components: `scores` are the columns of unit scores.
pub(super) fn eigen_images(changes: &Changes, scores: &[Vec<f64>]) -> EigenImages {
    // With unit scores s(t), E = Σ s(t)(i(t) − ī) / (n √λ), so √λ·E = 1/n Σ s(t) i(t), for the
    // scores have mean zero.
    let n = changes.masks;
    let count = n as f64;
    let columns: Vec<Vec<f64>> =
        std::iter::once(vec![1.0; n]).chain(scores.iter().cloned()).collect();
    let mut images = columns.chunks(LANES).flat_map(|columns| weighted_sums(changes, columns));
    let mean = images.next().map(|i| i.scaled(count)).unwrap_or(GreyImage {
        width: 0,
        height: 0,
        values: Vec::new(),
    });
    EigenImages { mean, deviations: images.map(|i| i.scaled(count)).collect() }
}

impl GreyImage {
    fn append(&mut self, below: Self) {
        self.height += below.height;
        self.values.extend(below.values);
    }

    fn scaled(mut self, divisor: f64) -> Self {
        for value in &mut self.values {
            *value /= divisor;
        }
        self
    }
}

/// Σ weight(t) · mask(t), pixel by pixel, for up to [`LANES`] columns of weights.
///
/// A mask is a = m XOR d: where m is clear the sum is that of the weights of the d that are set,
/// where it is set that of all weights less those. Words are independent and each pixel adds its
/// masks in order, so the result does not depend on the number of threads.
fn weighted_sums(changes: &Changes, columns: &[Vec<f64>]) -> Vec<GreyImage> {
    let lanes = |t: usize| -> [f64; LANES] {
        std::array::from_fn(|c| columns.get(c).map_or(0.0, |column| column[t]))
    };
    let weights: Vec<[f64; LANES]> = (0..changes.masks).map(lanes).collect();
    let mut all = [0.0; LANES];
    for weight in &weights {
        add(&mut all, weight);
    }
    let instructions = InstructionSet::best();
    let sums: Vec<[[f64; LANES]; 64]> = (0..changes.words.len())
        .into_par_iter()
        .map(|word| instructions.run(WordSums { changes, word, weights: &weights }))
        .collect();
    let (width, height) = changes.size;
    let words_per_row = width.div_ceil(64);
    let image = |c: usize| {
        let mut values = vec![0.0; width * height];
        let pixels = |word: usize| {
            let first = 64 * (word % words_per_row);
            let place = word / words_per_row * width + first;
            (place, (width - first).min(64))
        };
        for (word, &majority) in changes.majority.iter().enumerate().filter(|(_, m)| **m != 0) {
            let (place, length) = pixels(word);
            for (bit, value) in values[place..place + length].iter_mut().enumerate() {
                *value = if majority >> bit & 1 == 1 { all[c] } else { 0.0 };
            }
        }
        for (&word, sums) in changes.words.iter().zip(&sums) {
            let (place, length) = pixels(word);
            for (bit, value) in values[place..place + length].iter_mut().enumerate() {
                let sum = sums[bit][c];
                *value += if changes.majority[word] >> bit & 1 == 1 { -sum } else { sum };
            }
        }
        GreyImage { width, height, values }
    };
    (0..columns.len()).into_par_iter().map(image).collect()
}

/// For each bit of a word, the sum of the weights of the masks in which it changes.
struct WordSums<'a> {
    changes: &'a Changes,
    /// Which of the words in which anything changes.
    word: usize,
    weights: &'a [[f64; LANES]],
}

impl Kernel for WordSums<'_> {
    type Result = [[f64; LANES]; 64];

    #[inline(always)]
    fn run(self) -> Self::Result {
        let mut sums = [[0.0; LANES]; 64];
        for (tile, weights) in self.changes.tiles.iter().zip(self.weights.chunks(TILE)) {
            for (&word, weight) in tile[self.word].iter().zip(weights) {
                let mut open = word;
                while open != 0 {
                    add(&mut sums[open.trailing_zeros() as usize], weight);
                    open &= open - 1;
                }
            }
        }
        sums
    }
}

#[inline(always)]
fn add(sums: &mut [f64; LANES], weight: &[f64; LANES]) {
    for (sum, weight) in sums.iter_mut().zip(weight) {
        *sum += weight;
    }
}
