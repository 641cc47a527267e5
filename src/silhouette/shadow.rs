//! A cast shadow at the feet: ground that is darker than it is without the animal, of the same hue,
//! and wider than a leg.
//!
//! A shadow multiplies the light of what it falls on, so the cube roots of luminance and the two
//! colour axes fall by one share (Prati and others, *Detecting moving shadows*, 2003, with the
//! chromaticity of CIE L*a*b*). A dark leg before light ground can do the same; but it is narrow, and
//! a shadow lies along the ground.

use std::ops::Range;

use super::lab_image::{LIGHTNESS_STEPS, LabImage};
use super::plate::PlateDistances;
use crate::mask::Mask;

/// Share of the cube root of luminance that shadowed ground keeps: .5 is an eighth of the light. What
/// keeps more hardly stands out.
const KEPT_LIGHT: (f32, f32) = (0.5, 0.9);

/// How far the colour axes may be from those of the ground times that share, units of a* and b*. A
/// shadow under a clear sky is bluer.
const SAME_A: f32 = 5.0;
const SAME_B: (f32, f32) = (-9.0, 5.0);

/// A shadow begins in this share of the silhouette's height, counted from below, and reaches as far
/// below it.
const FEET: f64 = 0.25;

/// Somewhere it is at least as wide as this, roots of the silhouette's area, and the rows beside that
/// are at least as wide as the other: legs are a tenth to a fifth, hooves with the sand of their
/// colour between them up to two fifths.
const WIDTH: f64 = 0.5;
const BESIDE: f64 = 0.2;

/// Under what is left of the silhouette its shadow begins this much lower, roots of the area: a hoof
/// on light ground is darker than that and of its hue, too.
const HOOF: f64 = 0.1;

/// What is left is a leg where it goes on upwards for at least this, roots of the area.
const LEG: f64 = 0.15;

/// Pixels of a run that may be missing side by side: noise, and the thin edge of a hoof.
const GAP_PX: usize = 2;

/// What shadowed ground says, nats of log odds for the animal, in the place of all else: that it
/// stands out from the ground is what a shadow does, and its colours were learnt with it.
pub(super) const AGAINST: f32 = -3.0;

/// The pixels about the feet of a draft that look like its shadow; `None` where there are none.
/// `stands_out` says which pixels are unlike the background at all.
pub(super) fn shadow(
    image: &LabImage,
    plate: &PlateDistances,
    draft: &Mask,
    stands_out: impl Fn(usize, usize) -> bool,
) -> Option<Mask> {
    let bounds = draft.bounds()?;
    let (w, h) = (image.width(), image.height());
    let reach = (FEET * bounds.height() as f64) as usize;
    let rows = bounds.bottom.saturating_sub(reach)..(bounds.bottom + 1 + reach).min(h);
    let length = (draft.area() as f64).sqrt();
    let width = ((WIDTH * length) as usize).max(4);
    let least = ((BESIDE * length) as usize).max(4);
    let mut wide = Vec::new();
    for y in rows {
        let looks = |x: usize| {
            let darker = |behind| is_darker(image.at(y * w + x), behind);
            stands_out(x, y) && plate.colour(x, y).is_some_and(darker)
        };
        let all = runs(plate.region.left..plate.region.right, looks);
        wide.extend(all.into_iter().filter(|run| run.len() >= least).map(|run| (y, run)));
    }
    let found = grown(&wide, width, (w, h));
    let legs = upright(&draft.and_not(&found), (LEG * length) as usize);
    let found = found.and_not(&lowered(&legs, (HOOF * length) as usize));
    (!found.is_empty()).then_some(found)
}

/// The runs of at least `width` pixels, and those that touch them from row to row. `runs` are in the
/// order of their rows.
fn grown(runs: &[(usize, Range<usize>)], width: usize, (w, h): (usize, usize)) -> Mask {
    let mut taken: Vec<bool> = runs.iter().map(|(_, run)| run.len() >= width).collect();
    let touches = |a: usize, b: usize| {
        let ((y, run), (other_y, other)) = (&runs[a], &runs[b]);
        y.abs_diff(*other_y) == 1 && run.start < other.end && other.start < run.end
    };
    // Down and up again, until nothing is added.
    loop {
        let before = taken.iter().filter(|t| **t).count();
        for at in (0..runs.len()).chain((0..runs.len()).rev()) {
            taken[at] = taken[at] || (0..runs.len()).any(|near| taken[near] && touches(at, near));
        }
        if taken.iter().filter(|t| **t).count() == before {
            break;
        }
    }
    let mut found = Mask::new(w, h);
    for (y, run) in runs.iter().zip(taken).filter(|(_, taken)| *taken).map(|(run, _)| run) {
        run.clone().for_each(|x| found.set(x, *y, true));
    }
    found
}

/// The pixels over which the mask is set for at least so many rows.
fn upright(mask: &Mask, rows: usize) -> Mask {
    let (w, h) = (mask.width(), mask.height());
    (1..=rows as i64).fold(mask.clone(), |all, row| all.and(&mask.window(0, -row, w, h)))
}

/// What lies at most so many rows under a set pixel.
fn lowered(mask: &Mask, rows: usize) -> Mask {
    let (w, h) = (mask.width(), mask.height());
    (1..=rows as i64).fold(mask.clone(), |all, row| all.or(&mask.window(0, -row, w, h)))
}

/// Whether a colour is that behind it with less light.
fn is_darker(colour: [u8; 3], behind: [u8; 3]) -> bool {
    let root = |byte: u8| f32::from(byte) / LIGHTNESS_STEPS + 16.0;
    let kept = root(colour[0]) / root(behind[0]);
    let off = |c: usize| (f32::from(colour[c]) - 128.0) - kept * (f32::from(behind[c]) - 128.0);
    let (a, b) = (off(1), off(2));
    (KEPT_LIGHT.0..=KEPT_LIGHT.1).contains(&kept)
        && a.abs() <= SAME_A
        && (SAME_B.0..=SAME_B.1).contains(&b)
}

/// Runs of columns that are so, with gaps of at most [`GAP_PX`] in them.
fn runs(columns: Range<usize>, is_so: impl Fn(usize) -> bool) -> Vec<Range<usize>> {
    let mut runs: Vec<Range<usize>> = Vec::new();
    for x in columns.filter(|x| is_so(*x)) {
        match runs.last_mut() {
            Some(run) if x <= run.end + GAP_PX => run.end = x + 1,
            _ => runs.push(x..x + 1),
        }
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn less_light_of_the_same_hue_is_shadow_and_another_hue_is_not() {
        let grass = [140, 118, 150];
        // Half the light: L* + 16 by .79, and a*, b* too.
        assert!(is_darker([103, 120, 145], grass));
        assert!(!is_darker([103, 140, 145], grass), "a brown leg");
        assert!(!is_darker([139, 118, 150], grass), "the grass itself");
        assert!(!is_darker([180, 118, 150], grass), "lighter");
    }

    #[test]
    fn a_wide_run_takes_the_narrow_ones_that_touch_it_along() {
        let runs = [(3, 0..4), (4, 2..6), (5, 5..17), (6, 15..19), (8, 15..19), (9, 0..4)];
        let found = grown(&runs, 10, (20, 12));
        assert_eq!(found.area(), 4 + 4 + 12 + 4);
        assert!(found.get(0, 3) && found.get(18, 6) && !found.get(15, 8) && !found.get(0, 9));
        assert!(grown(&runs, 13, (20, 12)).is_empty());
    }

    #[test]
    fn a_hoof_under_a_leg_is_kept_and_a_flat_rest_of_shadow_protects_nothing() {
        let leg = Mask::from_fn(30, 30, |x, y| (5..8).contains(&x) && (10..20).contains(&y));
        let flat = Mask::from_fn(30, 30, |x, y| (15..25).contains(&x) && (17..20).contains(&y));
        let kept = lowered(&upright(&leg.or(&flat), 5), 2);
        let wanted = Mask::from_fn(30, 30, |x, y| (5..8).contains(&x) && (15..22).contains(&y));
        assert_eq!(kept, wanted);
    }

    #[test]
    fn runs_bridge_what_noise_takes_out() {
        let so = [1, 2, 3, 5, 6, 12, 13];
        let found = runs(0..20, |x| so.contains(&x));
        assert_eq!(found, [1..7, 12..14]);
        assert!(runs(0..20, |_| false).is_empty());
    }
}
