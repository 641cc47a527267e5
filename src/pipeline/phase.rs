//! The gait phase of a clip's masks, and how its stride is known.

use std::ops::Range;

use super::bridge::bridged;
use super::drift::ShapeDrift;
use crate::gait::{GaitPhase, Known, Repeats, Symmetry};
use crate::image_pca::ImagePca;
use crate::numeric::Coefficients;
use crate::spectrum::{Gait, StrideBasis};

/// Repeats of the silhouette that a clip must hold for its phase to mean anything.
const LEAST_REPEATS: f64 = 1.5;

/// The gait phase of some frames, where they are enough for one. `removed` is the slow change that was taken out of them.
pub(super) fn measure_phase(
    pca: &ImagePca,
    used: &[bool],
    frames: &Range<usize>,
    gait: Gait,
    removed: Option<ShapeDrift>,
    back: Option<&Coefficients>,
) -> Option<GaitPhase> {
    let symmetry = match gait.is_symmetric() {
        None => Symmetry::Unknown,
        Some(true) => Symmetry::Symmetric,
        Some(false) => Symmetry::Asymmetric,
    };
    let scores = bridged(&pca.scores, used).rows(frames.clone());
    let used = &used[frames.clone()];
    let back = back.map(|rows| rows.rows(frames.clone()));
    let shares = pca.variance_shares();
    let known = Known {
        symmetry,
        repeats_a_frame: removed.map(|d| d.repeats_a_frame),
        slow_half_cycles: removed.map(|d| d.half_cycles),
        back: back.as_ref(),
        ..Known::default()
    };
    let found = GaitPhase::measure_knowing(&scores, &shares, used, &known).ok()?;
    let repeats = scores.frames() as f64 / found.repeat_frames;
    (repeats >= LEAST_REPEATS).then_some(found)
}

/// How the stride is known, where it is.
pub(super) fn stride_basis(gait: Gait, repeats: Repeats) -> StrideBasis {
    match (gait.is_symmetric(), repeats) {
        (Some(_), _) => StrideBasis::Given,
        (None, Repeats::EveryStride) => StrideBasis::TwoStepsSeen,
        (None, Repeats::EveryStep) => StrideBasis::SubharmonicSeen,
        (None, Repeats::Unknown) => StrideBasis::Unknown,
    }
}
