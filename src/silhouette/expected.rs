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

/// Frames over which the speed of an animal that is lost after them is taken.
const SPEED_FRAMES: usize = 5;

/// Empty drafts take over the nearest one in time, moved to where the animal may be: between others
/// on the straight line before the scene from one to the next, before the first and after the last
/// along with its speed there.
pub(super) fn filled(from_first: &[Matrix3<f64>], mut masks: Vec<Mask>) -> Vec<Mask> {
    let full: Vec<usize> = (0..masks.len()).filter(|&t| !masks[t].is_empty()).collect();
    let seen: Vec<(usize, (f64, f64))> =
        full.iter().filter_map(|&t| Some((t, masks[t].centre_of_mass()?))).collect();
    let empty: Vec<usize> = (0..masks.len()).filter(|&t| masks[t].is_empty()).collect();
    for t in empty {
        let Some(&(nearest, own)) = seen.iter().min_by_key(|(s, _)| s.abs_diff(t)) else { break };
        let (x, y) = expected_centre(from_first, &seen, t).unwrap_or(own);
        let source = &masks[nearest];
        let (w, h) = (source.width(), source.height());
        let (x, y) = (x.clamp(0.0, w as f64), y.clamp(0.0, h as f64));
        let moved = ((x - own.0).round() as i64, (y - own.1).round() as i64);
        masks[t] = source.window(-moved.0, -moved.1, w, h);
    }
    masks
}

/// Where a frame has the centre, by those seen in others, laid over it by the camera's motion.
fn expected_centre(
    from_first: &[Matrix3<f64>],
    seen: &[(usize, (f64, f64))],
    t: usize,
) -> Option<(f64, f64)> {
    let here = |(s, (x, y)): (usize, (f64, f64))| {
        let p = from_first[t] * from_first[s].try_inverse()? * Vector3::new(x, y, 1.0);
        Some((s as f64, (p.x / p.z, p.y / p.z)))
    };
    let next = seen.partition_point(|(s, _)| *s < t);
    let (from, to) = if next == 0 {
        let last = seen.partition_point(|(s, _)| *s <= seen[0].0 + SPEED_FRAMES) - 1;
        (seen[0], seen[last])
    } else if next == seen.len() {
        let last = seen[next - 1];
        let first = seen.partition_point(|(s, _)| *s + SPEED_FRAMES < last.0);
        (last, seen[first])
    } else {
        (seen[next - 1], seen[next])
    };
    let ((from_t, from), (to_t, to)) = (here(from)?, here(to)?);
    let frames = if to_t == from_t { 1.0 } else { to_t - from_t };
    let along = (t as f64 - from_t) / frames;
    Some((from.0 + along * (to.0 - from.0), from.1 + along * (to.1 - from.1)))
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

#[cfg(test)]
mod tests {
    use super::*;

    fn square(centre: (f64, f64)) -> Mask {
        Mask::from_fn(200, 60, |x, y| {
            (x as f64 - centre.0).abs() <= 4.0 && (y as f64 - centre.1).abs() <= 4.0
        })
    }

    /// Before a camera that moves by two pixels a frame.
    #[test]
    fn lost_drafts_are_put_where_the_animal_should_be_by_then() {
        let path: Vec<Matrix3<f64>> = (0..30)
            .map(|t| Matrix3::new(1.0, 0.0, -2.0 * f64::from(t), 0.0, 1.0, 0.0, 0.0, 0.0, 1.0))
            .collect();
        // It goes 5 pixels a frame before the scene and 3 in the picture.
        let centre = |t: usize| (40.0 + 3.0 * t as f64, 30.0);
        for lost in [0..6, 12..20, 24..30] {
            let masks: Vec<Mask> = (0..30)
                .map(|t| if lost.contains(&t) { Mask::new(200, 60) } else { square(centre(t)) })
                .collect();
            for (t, found) in filled(&path, masks).iter().enumerate() {
                let (x, y) = found.centre_of_mass().unwrap();
                assert!((x - centre(t).0).abs() <= 1.0 && (y - 30.0).abs() <= 1.0, "{t}: {x} {y}");
            }
        }
        assert!(filled(&path, vec![Mask::new(200, 60); 30]).iter().all(Mask::is_empty));
    }
}
