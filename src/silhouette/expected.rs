//! Where the animal is expected by the drafts of the frames around, and which of the pieces that
//! were cut is it.

use nalgebra::{Matrix3, Vector3};

use crate::mask::{Connectivity, Mask, components};

/// A draft is taken for a part of the animal when its area is under this share of the median of as
/// many frames before and after, and for the whole when it is over that.
const USUAL_FRAMES: usize = 5;
const PARTLY: f64 = 0.85;
const WHOLE: f64 = 0.92;

/// A second piece counts as the animal's when this share of it lies where a correction expects it.
const PIECE_EXPECTED: f64 = 0.4;

/// Empty drafts between others take over the nearest one in time, moved as the camera has
/// moved: the animal is looked for where it may be.
pub(super) fn filled(from_first: &[Matrix3<f64>], mut masks: Vec<Mask>) -> Vec<Mask> {
    let full: Vec<usize> = (0..masks.len()).filter(|&t| !masks[t].is_empty()).collect();
    for t in 0..masks.len() {
        if !masks[t].is_empty() {
            continue;
        }
        let Some(&nearest) = full.iter().min_by_key(|&&s| s.abs_diff(t)) else { break };
        let source = masks[nearest].clone();
        let Some((x, y)) = source.centre_of_mass() else { continue };
        let moved = match from_first[nearest].try_inverse() {
            Some(back) => {
                let p = from_first[t] * back * Vector3::new(x, y, 1.0);
                (p.x / p.z - x, p.y / p.z - y)
            }
            None => (0.0, 0.0),
        };
        let (w, h) = (source.width(), source.height());
        masks[t] = source.window(-moved.0.round() as i64, -moved.1.round() as i64, w, h);
    }
    masks
}

/// Drafts that lost a part for a moment take over the nearest whole one beside their own: the next
/// round looks there again.
pub(super) fn repaired(masks: Vec<Mask>) -> Vec<Mask> {
    let areas: Vec<usize> = masks.iter().map(Mask::area).collect();
    let usual = |t: usize| {
        let mut near =
            areas[t.saturating_sub(USUAL_FRAMES)..(t + USUAL_FRAMES + 1).min(areas.len())].to_vec();
        near.sort_unstable();
        near[near.len() / 2] as f64
    };
    let usual: Vec<f64> = (0..masks.len()).map(usual).collect();
    let whole = |t: &usize| areas[*t] as f64 >= WHOLE * usual[*t];
    (0..masks.len())
        .map(|t| {
            if areas[t] as f64 >= PARTLY * usual[t] {
                return masks[t].clone();
            }
            let nearby = t.saturating_sub(USUAL_FRAMES)..(t + USUAL_FRAMES + 1).min(masks.len());
            match nearby.filter(whole).min_by_key(|s| s.abs_diff(t)) {
                Some(nearest) => masks[t].or(&masks[nearest]),
                None => masks[t].clone(),
            }
        })
        .collect()
}

/// Of what was cut, the component that shares most pixels with the draft and with the silhouette of
/// the frame before, and those that a correction expects. The draft counts twice: the frame before
/// may hold another animal that touched this one there.
pub(super) fn animal(
    found: &Mask,
    draft: &Mask,
    before: Option<&Mask>,
    corrected: Option<&Mask>,
) -> Mask {
    let mut result = Mask::new(found.width(), found.height());
    let mut pieces = components(found, Connectivity::Eight);
    let mut best: Option<(usize, usize)> = None;
    for (at, piece) in pieces.iter().enumerate() {
        let common =
            2 * piece.common_area(draft) + before.map_or(0, |before| piece.common_area(before));
        if common > 0 && best.is_none_or(|(most, _)| common > most) {
            best = Some((common, at));
        }
    }
    let Some((_, main)) = best else { return result };
    pieces.swap_remove(main).draw(&mut result);
    for piece in pieces {
        let there = corrected.map_or(0, |mask| piece.common_area(mask));
        if there as f64 >= PIECE_EXPECTED * piece.area_px as f64 {
            piece.draw(&mut result);
        }
    }
    result
}
