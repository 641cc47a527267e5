//! A cast shadow at the feet: ground that is darker than it is without the animal, of the same hue,
//! and wider than a leg.
//!
//! A shadow multiplies the light of what it falls on, so the cube roots of luminance and the two
//! colour axes fall by one share (Prati and others, *Detecting moving shadows*, 2003, with the
//! chromaticity of CIE L*a*b*). A dark leg before light ground can do the same; but it is narrow, and
//! a shadow lies along the ground.

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

/// It is at least as wide as this, roots of the silhouette's area: legs are a tenth to a fifth.
const WIDTH: f64 = 0.3;

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
    let width = (WIDTH * (draft.area() as f64).sqrt()) as usize;
    let mut found = Mask::new(w, h);
    for y in rows {
        let looks = |x: usize| {
            let darker = |behind| is_darker(image.at(y * w + x), behind);
            stands_out(x, y) && plate.colour(x, y).is_some_and(darker)
        };
        for run in runs(plate.region.left..plate.region.right, looks) {
            if run.len() >= width.max(4) {
                run.for_each(|x| found.set(x, y, true));
            }
        }
    }
    (!found.is_empty()).then_some(found)
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
fn runs(
    columns: std::ops::Range<usize>,
    is_so: impl Fn(usize) -> bool,
) -> Vec<std::ops::Range<usize>> {
    let mut runs: Vec<std::ops::Range<usize>> = Vec::new();
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
    fn runs_bridge_what_noise_takes_out() {
        let so = [1, 2, 3, 5, 6, 12, 13];
        let found = runs(0..20, |x| so.contains(&x));
        assert_eq!(found, [1..7, 12..14]);
        assert!(runs(0..20, |_| false).is_empty());
    }
}
