//! Where the animal is expected: about where the draft has it.

use crate::mask::Mask;
use crate::numeric::grid_distances_sq;

/// Distance of every pixel from the nearest set pixel, pixels; very far for an empty mask.
pub(super) fn distances(mask: &Mask) -> Vec<f32> {
    let (w, h) = (mask.width(), mask.height());
    let set: Vec<bool> = (0..w * h).map(|at| mask.get(at % w, at / w)).collect();
    grid_distances_sq(&set, w, h).into_iter().map(|d| (d as f32).sqrt()).collect()
}

/// Logarithm of the prior odds at every pixel: up to +1 inside the draft, down to −3 a body's
/// length outside it. The unit of length is the root of the area, so that nothing depends on how
/// large the animal shows.
pub(super) fn location_odds(draft: &Mask) -> Vec<f32> {
    let length = (draft.area() as f32).sqrt().max(1.0);
    let outside = distances(draft);
    let inside = distances(&draft.not());
    outside
        .iter()
        .zip(&inside)
        .map(|(&out, &within)| {
            if out > 0.0 {
                -(3.0 * out / length).min(3.0)
            } else {
                (20.0 * within / length).min(1.0)
            }
        })
        .collect()
}
