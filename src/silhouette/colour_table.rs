//! The colours of animal and background over the whole clip, as one table.

use nalgebra::Vector3;
use rayon::prelude::*;

use super::lab_image::lab_of;
use crate::numeric::{Mixture, MixtureSettings};

/// Bits a channel of the table: cells of two units of L* and four of a* and b*.
const BITS: u32 = 6;

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

/// Logarithm of the likelihood ratio, animal over background, of each cell of L*a*b* bytes.
#[derive(Clone, Debug)]
pub(super) struct ColourTable {
    cells: Vec<f32>,
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
        let (animal, background) = (animal?, background?);
        let density = |mixture: &Mixture, x: &Vector3<f64>| {
            (1.0 - OUTLIERS) * mixture.log_density(x).exp() + OUTLIERS / LAB_VOLUME
        };
        let side = 1_usize << BITS;
        let step = 256 >> BITS;
        let cells = (0..side * side * side)
            .into_par_iter()
            .with_min_len(side)
            .map(|at| {
                let middle = |level: usize| (level * step + step / 2) as u8;
                let bytes = [at / (side * side), at / side % side, at % side].map(middle);
                let x = colour(bytes);
                ((density(&animal, &x) / density(&background, &x)).ln() as f32)
                    .clamp(-STRONGEST, STRONGEST)
            })
            .collect();
        Some(Self { cells })
    }

    #[inline]
    pub(super) fn of(&self, bytes: [u8; 3]) -> f32 {
        let drop = 8 - BITS;
        self.cells[bytes.iter().fold(0, |at, &c| at << BITS | usize::from(c >> drop))]
    }
}

fn colour(bytes: [u8; 3]) -> Vector3<f64> {
    Vector3::from(lab_of(bytes).map(f64::from))
}

fn thinned(samples: &[[u8; 3]]) -> Vec<Vector3<f64>> {
    let step = samples.len().div_ceil(MAX_SAMPLES).max(1);
    samples.iter().step_by(step).map(|&bytes| colour(bytes)).collect()
}
