//! The weight of every key pose at every frame.

use serde::{Deserialize, Serialize};

use crate::numeric::Coefficients;
use crate::{Error, Result};

use super::kernel::{KernelSettings, Rbf};
use super::switching::{Switching, switching_weights};

/// How coefficients become weights.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// One interpolation between all keys, equation 14.
    #[default]
    Rbf,
    /// Switching models between keys and their partners, equations 16 to 19.
    Switching(Switching),
}

/// The weight of each of K poses at each frame.
///
/// With [`Method::Rbf`] the poses are the keys, K = m. With [`Method::Switching`] they are the keys
/// followed by their partners in the same order, K = 2m. Over a mirrored motion they are the keys followed by the
/// same poses with left and right exchanged, K = 2m.
#[derive(Clone, Debug, PartialEq)]
pub struct Weights {
    frames: usize,
    poses: usize,
    mirrored: usize,
    values: Vec<f64>,
    active_models: Vec<Option<usize>>,
    phase_conflicts: Vec<usize>,
}

impl Weights {
    /// Number of frames.
    #[must_use]
    pub fn frames(&self) -> usize {
        self.frames
    }

    /// Number of poses, K.
    #[must_use]
    pub fn poses(&self) -> usize {
        self.poses
    }

    /// How many of the poses, the last ones, are the first ones with left and right exchanged.
    #[must_use]
    pub fn mirrored(&self) -> usize {
        self.mirrored
    }

    /// All weights, row-major: `frames` rows of `poses`.
    #[must_use]
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// The weights of frame `t`.
    ///
    /// # Panics
    /// When `t` is not a frame.
    #[must_use]
    pub fn row(&self, t: usize) -> &[f64] {
        &self.values[t * self.poses..(t + 1) * self.poses]
    }

    /// The sum of each frame's weights; near 1 where the frame is among the keys.
    #[must_use]
    pub fn sums(&self) -> Vec<f64> {
        (0..self.frames).map(|t| self.row(t).iter().sum()).collect()
    }

    /// The smallest and largest weight; `None` without frames.
    #[must_use]
    pub fn range(&self) -> Option<(f64, f64)> {
        let low = self.values.iter().copied().min_by(f64::total_cmp)?;
        let high = self.values.iter().copied().max_by(f64::total_cmp)?;
        Some((low, high))
    }

    /// The switching model in use at frame `t`, 0 to 3; `None` without switching.
    ///
    /// # Panics
    /// When `t` is not a frame.
    #[must_use]
    pub fn active_model(&self, t: usize) -> Option<usize> {
        self.active_models[t]
    }

    /// Key and partner frames (ascending) at which the measured phase says the other half of the
    /// stride: the wrong partner was named, or the phase was lost on the way. Their poses are given
    /// exactly all the same.
    #[must_use]
    pub fn phase_conflicts(&self) -> &[usize] {
        &self.phase_conflicts
    }

    pub(super) fn new(
        poses: usize,
        rows: Vec<Vec<f64>>,
        active_models: Vec<Option<usize>>,
        phase_conflicts: Vec<usize>,
    ) -> Self {
        let values = rows.concat();
        Self { frames: rows.len(), poses, mirrored: 0, values, active_models, phase_conflicts }
    }

    pub(super) fn with_mirrored(mut self, mirrored: usize) -> Self {
        self.mirrored = mirrored;
        self
    }
}

/// The weights of all frames of a clip.
///
/// `coefficients`: the points p(t), components of unit standard deviation (the defaults assume
/// it), the same that the keys were chosen from. `keys`: the frames whose poses are known, in the
/// order of the poses; [`Method::Switching`] brings their partners.
///
/// At the frame of a key (or partner) that key's pose has weight 1 and all others 0, to rounding,
/// unless there is a ridge.
///
/// # Errors
/// Those of [`Rbf::new`]; a frame listed twice; for switching models an odd number of keys, a wrong
/// number of partners, settings out of range.
pub fn weights(
    coefficients: &Coefficients,
    keys: &[usize],
    method: &Method,
    settings: &KernelSettings,
) -> Result<Weights> {
    match method {
        Method::Rbf => {
            check_distinct(keys.iter().copied())?;
            let rbf = Rbf::new(coefficients, keys, settings)?;
            let rows: Vec<Vec<f64>> =
                (0..coefficients.frames()).map(|t| rbf.weights_at(coefficients.point(t))).collect();
            let active = vec![None; rows.len()];
            Ok(Weights::new(keys.len(), rows, active, Vec::new()))
        }
        Method::Switching(switching) => {
            check_distinct(keys.iter().chain(&switching.partners).copied())?;
            switching_weights(coefficients, keys, switching, settings)
        }
    }
}

pub(super) fn check_distinct(frames: impl Iterator<Item = usize>) -> Result<()> {
    let mut sorted: Vec<usize> = frames.collect();
    sorted.sort_unstable();
    match sorted.windows(2).find(|w| w[0] == w[1]) {
        Some(w) => Err(Error::KeyListedTwice { frame: w[0] }),
        None => Ok(()),
    }
}
