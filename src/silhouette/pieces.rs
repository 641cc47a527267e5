//! Pieces of the animal that something thin has cut off: a leg behind a rail, a hoof below a pastern
//! of the ground's colour.
//!
//! They are looked for where the camera stands still, and with it the plate that vouches for them: under
//! a moving one it stands out along every edge, and joining cost the clips that were measured a little.

use super::location::distances;
use crate::mask::{Component, Connectivity, Mask, components};

/// A piece is the animal's when the evidence for its pixels is at least this on the average, nats: by
/// chance a patch of background is not as sure.
const SURE: f64 = 2.0;

/// … when it lies this close, roots of the animal's area: the gap is a pastern or a strap.
const GAP: f32 = 0.08;

/// … and when its area is between these shares of the animal's: not a speck, and not another animal.
const SMALLEST: f64 = 0.002;
const LARGEST: f64 = 0.25;

/// `animal` with the pieces of `found` that were cut off it, each joined to it over the shortest way.
/// `evidence` is what is seen of a pixel, log odds to be the animal without what is only expected.
pub(super) fn joined(animal: Mask, found: &Mask, evidence: impl Fn(usize, usize) -> f32) -> Mask {
    let rest = found.and_not(&animal);
    if animal.is_empty() || rest.is_empty() {
        return animal;
    }
    let area = animal.area() as f64;
    let away = distances(&animal);
    let farthest = GAP * (area as f32).sqrt();
    let mut result = animal.clone();
    for piece in components(&rest, Connectivity::Eight) {
        let pixels = piece.area_px as f64;
        if pixels < SMALLEST * area || pixels > LARGEST * area {
            continue;
        }
        if let Some((start, end)) = bridge(&piece, &animal, &away, farthest, &evidence) {
            piece.draw(&mut result);
            // As wide as a third of a square of the piece's area.
            result.draw_stroke(&[start, end], (pixels.sqrt() / 6.0).max(1.0));
        }
    }
    result
}

/// The shortest way from the animal to a piece that is sure and close enough to be its own.
fn bridge(
    piece: &Component,
    animal: &Mask,
    away: &[f32],
    farthest: f32,
    evidence: &impl Fn(usize, usize) -> f32,
) -> Option<((f64, f64), (f64, f64))> {
    let (w, h) = (animal.width(), animal.height());
    let alone = piece.to_mask(w, h);
    let bounds = alone.bounds()?;
    let mut sum = 0.0;
    let mut nearest: Option<(f32, usize, usize)> = None;
    for y in bounds.top..=bounds.bottom {
        for x in (bounds.left..=bounds.right).filter(|&x| alone.get(x, y)) {
            sum += f64::from(evidence(x, y));
            let gap = away[y * w + x];
            if nearest.is_none_or(|(least, ..)| gap < least) {
                nearest = Some((gap, x, y));
            }
        }
    }
    let (gap, x, y) = nearest?;
    if gap > farthest || sum < SURE * piece.area_px as f64 {
        return None;
    }
    let reach = gap.ceil() as usize;
    let span = |at: usize, size: usize| at.saturating_sub(reach)..(at + reach + 1).min(size);
    let (_, sx, sy) = span(y, h)
        .flat_map(|sy| span(x, w).map(move |sx| (sx, sy)))
        .filter(|&(sx, sy)| animal.get(sx, sy))
        .map(|(sx, sy)| (sx.abs_diff(x).pow(2) + sy.abs_diff(y).pow(2), sx, sy))
        .min()?;
    let point = |x: usize, y: usize| (x as f64, y as f64);
    Some((point(sx, sy), point(x, y)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A trunk with a leg, of which a gap of `gap` rows cuts the lower end off.
    fn cut(gap: usize) -> (Mask, Mask) {
        let trunk = |x: usize, y: usize| (10..90).contains(&x) && (10..50).contains(&y);
        let leg = |x: usize, y: usize| (20..28).contains(&x) && (50..80).contains(&y);
        let all = Mask::from_fn(100, 100, |x, y| {
            (trunk(x, y) || leg(x, y)) && !(65..65 + gap).contains(&y)
        });
        let upper = Mask::from_fn(100, 100, |x, y| y < 65 && all.get(x, y));
        (upper, all)
    }

    #[test]
    fn a_sure_piece_close_by_is_joined_in_one_component() {
        let (upper, all) = cut(3);
        let whole = joined(upper.clone(), &all, |_, _| 3.0);
        assert_eq!(components(&whole, Connectivity::Eight).len(), 1);
        assert_eq!(whole.common_area(&all), all.area());
        // The bridge is hardly more than the gap.
        assert!(whole.area() < all.area() + 60, "{} {}", whole.area(), all.area());
        assert_eq!(joined(upper.clone(), &all, |_, _| 1.9), upper);
    }

    #[test]
    fn what_is_far_small_or_as_large_as_another_animal_is_left() {
        let (upper, all) = cut(6);
        assert_eq!(joined(upper.clone(), &all, |_, _| 3.0), upper, "seven pixels are too far");
        let (upper, _) = cut(1);
        let speck = Mask::from_fn(100, 100, |x, y| upper.get(x, y) || (y == 52 && x == 50));
        assert_eq!(joined(upper.clone(), &speck, |_, _| 3.0), upper);
        let other = Mask::from_fn(100, 100, |x, y| upper.get(x, y) || (y > 53 && x > 40));
        assert_eq!(joined(upper.clone(), &other, |_, _| 3.0), upper);
        let nothing = Mask::new(100, 100);
        assert_eq!(joined(nothing.clone(), &all, |_, _| 3.0), nothing);
    }
}
