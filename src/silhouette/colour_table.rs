//! The colours of animal and background over the whole clip, as one table.

use nalgebra::Vector3;

use super::colour_cube::ColourCube;
use super::lab_image::lab_of;
use crate::numeric::{Mixture, MixtureSettings};

/// Gaussians of the animal's and of the background's mixture. More than the seed's, since the
/// samples come from the whole clip: all lights, all backgrounds that pass.
const ANIMAL_COMPONENTS: usize = 6;
const BACKGROUND_COMPONENTS: usize = 8;

/// Most samples a mixture is fitted to.
const MAX_SAMPLES: usize = 8_000;

/// Variance under which colours do not differ, L*a*b* units squared.
const VARIANCE_FLOOR: f64 = 4.0;

/// The most that a cell holds, nats; users limit it further.
const STRONGEST: f32 = 8.0;

/// Share of each class that may have any colour, and the volume those are spread over.
const OUTLIERS: f64 = 0.01;
const LAB_VOLUME: f64 = 100.0 * 185.0 * 203.0;

/// Logarithm of the likelihood ratio, animal over background, of each cell of L*a*b* bytes: two units
/// of L* and four of a* and b*.
#[derive(Clone, Debug)]
pub(super) struct ColourTable {
    animal: Mixture,
    background: Mixture,
    cells: ColourCube,
}

impl ColourTable {
    /// Fits a mixture to each set of samples; `None` when one has too few to fit anything.
    pub(super) fn fit(animal: &[[u8; 3]], background: &[[u8; 3]], seed: u64) -> Option<Self> {
        let how = MixtureSettings { seed, variance_floor: VARIANCE_FLOOR };
        let fit =
            |samples: &[[u8; 3]], components| Mixture::fit(&thinned(samples), components, how);
        let (animal, background) = rayon::join(
            || fit(animal, ANIMAL_COMPONENTS),
            || fit(background, BACKGROUND_COMPONENTS),
        );
        Some(Self { animal: animal?, background: background?, cells: ColourCube::new() })
    }

    #[inline]
    pub(super) fn of(&self, bytes: [u8; 3]) -> f32 {
        self.cells.of(bytes, |middle| self.log_ratio(middle))
    }

    fn log_ratio(&self, bytes: [u8; 3]) -> f32 {
        let x = colour(bytes);
        let density = |mixture: &Mixture| {
            (1.0 - OUTLIERS) * mixture.log_density(&x).exp() + OUTLIERS / LAB_VOLUME
        };
        ((density(&self.animal) / density(&self.background)).ln() as f32)
            .clamp(-STRONGEST, STRONGEST)
    }
}

fn colour(bytes: [u8; 3]) -> Vector3<f64> {
    Vector3::from(lab_of(bytes).map(f64::from))
}

fn thinned(samples: &[[u8; 3]]) -> Vec<Vector3<f64>> {
    let step = samples.len().div_ceil(MAX_SAMPLES).max(1);
    samples.iter().step_by(step).map(|&bytes| colour(bytes)).collect()
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, Normal};

    use super::*;

    /// A planted Gaussian: mean and deviation of the three bytes.
    #[derive(Clone, Copy)]
    struct Planted {
        mean: [f64; 3],
        deviation: [f64; 3],
    }

    impl Planted {
        fn samples(&self, count: usize, random: &mut ChaCha8Rng) -> Vec<[u8; 3]> {
            let normal = |c: usize| Normal::new(self.mean[c], self.deviation[c]).unwrap();
            let axes = [normal(0), normal(1), normal(2)];
            (0..count).map(|_| axes.each_ref().map(|n| n.sample(random).round() as u8)).collect()
        }

        /// Density a unit of L*a*b* volume, bytes of L* being half units.
        fn density(&self, bytes: [u8; 3]) -> f64 {
            (0..3)
                .map(|c| {
                    let unit = if c == 0 { 0.5 } else { 1.0 };
                    let z = (f64::from(bytes[c]) - self.mean[c]) / self.deviation[c];
                    (-0.5 * z * z).exp() / (self.deviation[c] * unit * std::f64::consts::TAU.sqrt())
                })
                .product()
        }
    }

    /// Mixtures of two planted Gaussians for either class: the table holds the logarithm of the ratio
    /// of their densities, wherever samples of either are not rare.
    #[test]
    fn a_cell_holds_the_ratio_of_the_planted_densities() {
        let planted = |mean, deviation| Planted { mean, deviation };
        let animal = [
            planted([90.0, 135.0, 140.0], [12.0, 5.0, 6.0]),
            planted([130.0, 128.0, 150.0], [10.0, 6.0, 7.0]),
        ];
        let background = [
            planted([110.0, 120.0, 145.0], [14.0, 7.0, 8.0]),
            planted([160.0, 125.0, 120.0], [9.0, 5.0, 9.0]),
        ];
        let mut random = ChaCha8Rng::seed_from_u64(7);
        let mut drawn = |class: &[Planted; 2]| -> Vec<[u8; 3]> {
            // By turns, so that every other sample is as good a choice.
            let [a, b] = class.each_ref().map(|g| g.samples(4000, &mut random));
            a.into_iter().zip(b).flat_map(|(a, b)| [a, b]).collect()
        };
        let (of_animal, of_background) = (drawn(&animal), drawn(&background));
        let table = ColourTable::fit(&of_animal, &of_background, 42).unwrap();
        let mixed = |class: &[Planted; 2], bytes| {
            let half = 0.5 * (class[0].density(bytes) + class[1].density(bytes));
            0.99 * half + 0.01 / (100.0 * 185.0 * 203.0)
        };
        let mut errors = Vec::new();
        for bytes in of_animal.iter().chain(&of_background).step_by(7) {
            let middle = bytes.map(|b| b / 4 * 4 + 2);
            let wanted = (mixed(&animal, middle) / mixed(&background, middle)).ln();
            errors.push((f64::from(table.of(*bytes)) - wanted.clamp(-8.0, 8.0)).abs());
        }
        errors.sort_by(f64::total_cmp);
        let at = |share: f64| errors[(share * (errors.len() - 1) as f64) as usize];
        // Six and eight Gaussians fitted to samples of two: .22 and .75 were measured. A unit or an axis
        // mistaken for another is off by nats.
        assert!(at(0.5) < 0.3 && at(0.95) < 1.0, "{} {}", at(0.5), at(0.95));
    }

    #[test]
    fn too_few_samples_teach_nothing() {
        let one = [[100, 128, 128]];
        assert!(ColourTable::fit(&one, &[], 1).is_none());
        assert!(ColourTable::fit(&[], &one, 1).is_none());
    }
}
