//! The final outline of one frame, at a size where thin legs have their pixels.

use super::correction::Labels;
use super::cues::Cues;
use super::drafts::Draft;
use super::expected::animal;
use super::field::{Known, least_cost};
use super::lab_image::{LabImage, Region};
use super::leg_ends::with_leg_ends;
use super::location::signed_distances;
use super::pair_costs::Fall;
use super::scale::Scale;
use super::shadow;
use crate::image::Picture;
use crate::mask::Mask;
use crate::numeric::GridCut;

/// How far from the draft's outline the final one may lie, pixels of the sketch.
const BAND_PX: f32 = 5.0;

/// Width of the strip along the outline whose pixels are asked how sure it is, as a share of the
/// root of the silhouette's area.
const ASKED: f32 = 0.12;

/// The outline of a frame at the size of `picture`, from its draft, and how sure it is: 2p − 1, with p
/// the mean probability, over a strip along the outline, that colour, plate and corrections give to the
/// labels the pixels got. 0 is a guess, 1 is certain. The picture is seen as if `light` (as of
/// [`light`](super::light::light)) were that of the first frame.
pub(super) fn outline(
    picture: &Picture,
    draft: &Draft,
    cues: &Cues,
    labels: Option<&Labels>,
    light: Option<f32>,
    cut: &mut GridCut,
) -> (Mask, f64) {
    let size = (picture.width(), picture.height());
    let Some(part) = Part::of(size, draft, labels) else {
        return (Mask::new(size.0, size.1), 0.0);
    };
    let r = part.region;
    let (w, h) = (r.width(), r.height());
    let near = match (LabImage::of_region(picture, r), light) {
        (near, Some(light)) => near.relit(light),
        (near, None) => near,
    };
    let seen = part.seen(&near, draft, cues);
    let mut odds = vec![0.0; w * h];
    let mut known = vec![Known::Background; w * h];
    for (at, &distance) in part.signed.iter().enumerate() {
        if distance.abs() <= BAND_PX {
            known[at] = Known::Free;
            odds[at] = seen[at] + part.location(distance);
        } else if distance < 0.0 {
            known[at] = Known::Animal;
        }
    }
    let window = |mask: &Mask| mask.window(r.left as i64, r.top as i64, w, h);
    if let Some(labels) = labels {
        let labels =
            Labels { animal: window(&labels.animal), background: window(&labels.background) };
        labels.mark(&mut known);
    }
    let found = least_cost(&near, &Fall::of(&near), &odds, &known, cut);
    let expected = Mask::from_fn(w, h, |x, y| part.signed[y * w + x] <= 0.0);
    // Pieces that a correction brought are in the draft.
    let corrected = draft.carried.as_ref().map(|_| &expected);
    let mask = with_leg_ends(&animal(&found, &expected, None, corrected), &found, &seen);
    let confidence = part.confidence(&mask, &seen);
    (mask.window(-(r.left as i64), -(r.top as i64), size.0, size.1), confidence)
}

/// The part of a picture that its outline can lie in, and the strip along it that is asked.
struct Part {
    region: Region,
    scale: Scale,
    /// Distance of each pixel of the part from the draft's outline, pixels of the sketch; negative
    /// inside.
    signed: Vec<f32>,
    /// Root of the draft's area, and half the width of the strip, pixels of the sketch.
    length: f32,
    asked: f32,
}

impl Part {
    /// `None` for an empty draft.
    fn of(size: (usize, usize), draft: &Draft, labels: Option<&Labels>) -> Option<Self> {
        let bounds = draft.mask.bounds()?;
        let small = (draft.mask.width(), draft.mask.height());
        let length = (draft.mask.area() as f32).sqrt();
        let asked = (ASKED * length).max(BAND_PX);
        let margin = asked.ceil() as usize + 2;
        let low = |at: usize, small: usize, large: usize| at.saturating_sub(margin) * large / small;
        let high = |at: usize, small: usize, large: usize| {
            ((at + 1 + margin) * large).div_ceil(small).min(large)
        };
        let mut region = Region {
            left: low(bounds.left, small.0, size.0),
            top: low(bounds.top, small.1, size.1),
            right: high(bounds.right, small.0, size.0),
            bottom: high(bounds.bottom, small.1, size.1),
        };
        if let Some(said) = labels.and_then(|l| l.animal.bounds()) {
            region.left = region.left.min(said.left);
            region.top = region.top.min(said.top);
            region.right = region.right.max(said.right + 1);
            region.bottom = region.bottom.max(said.bottom + 1);
        }
        let scale = Scale::new(size, small);
        let signed = signed_distances(&draft.mask, scale.part(region));
        let signed = scale.sampled(&signed, region);
        Some(Self { region, scale, signed, length, asked })
    }

    /// What colour, plate and corrections say of the pixels of the strip, log odds; 0 elsewhere.
    fn seen(&self, near: &LabImage, draft: &Draft, cues: &Cues) -> Vec<f32> {
        let r = self.region;
        let (w, h) = (r.width(), r.height());
        let (sw, sh) = (draft.mask.width(), draft.mask.height());
        let part = self.scale.part(r);
        let of_part = |odds: &dyn Fn(usize, usize) -> f32| -> Vec<f32> {
            let row = |y| (part.left..part.right).map(move |x| odds(x, y));
            (part.top..part.bottom).flat_map(row).collect()
        };
        let plate = of_part(&|x, y| cues.plate_odds(&draft.plate, x, y));
        let plate = self.scale.sampled(&plate, r);
        // Where the colours behind are known is coarser.
        let columns: Vec<usize> = (r.left..r.right).map(|x| x * sw / self.scale.size().0).collect();
        let mut colour = vec![0.0; w * h];
        for y in 0..h {
            let behind_row = (y + r.top) * sh / self.scale.size().1;
            for (x, &behind_column) in columns.iter().enumerate() {
                let at = y * w + x;
                // One more than asked, for the blur.
                if self.signed[at].abs() <= self.asked + 1.5 {
                    let behind = draft.plate.colour(behind_column, behind_row);
                    colour[at] = cues.colour_odds(near.at(at), plate[at], behind);
                }
            }
        }
        let mut seen = blurred(&colour, w, h);
        for ((seen, plate), distance) in seen.iter_mut().zip(&plate).zip(&self.signed) {
            *seen = if distance.abs() <= self.asked { *seen + plate } else { 0.0 };
        }
        if let Some(shadow) = &draft.shadow {
            let there = of_part(&|x, y| f32::from(u8::from(shadow.get(x, y))));
            for (seen, share) in seen.iter_mut().zip(self.scale.sampled(&there, r)) {
                *seen += share * (shadow::AGAINST - *seen);
            }
        }
        if let Some(resemblance) = draft.carried.as_ref().and_then(|c| c.resemblance.as_ref()) {
            let odds = of_part(&|x, y| resemblance.log_odds(x, y));
            let odds = self.scale.sampled(&odds, r);
            for ((seen, odds), distance) in seen.iter_mut().zip(odds).zip(&self.signed) {
                *seen += if distance.abs() <= self.asked { odds } else { 0.0 };
            }
        }
        seen
    }

    /// Log odds of the place at a distance from the draft's outline.
    fn location(&self, distance: f32) -> f32 {
        if distance > 0.0 {
            -(3.0 * distance / self.length).min(3.0)
        } else {
            (-20.0 * distance / self.length).min(1.0)
        }
    }

    fn confidence(&self, mask: &Mask, seen: &[f32]) -> f64 {
        let w = mask.width();
        let (mut sum, mut pixels) = (0.0, 0_usize);
        for (at, seen) in seen.iter().enumerate() {
            if self.signed[at].abs() <= self.asked {
                let sign = if mask.get(at % w, at / w) { 1.0 } else { -1.0 };
                sum += 1.0 / (1.0 + f64::from(-sign * seen).exp());
                pixels += 1;
            }
        }
        let mean = if pixels == 0 { 0.5 } else { sum / pixels as f64 };
        (2.0 * mean - 1.0).clamp(0.0, 1.0)
    }
}

/// Mean over 3 × 3 pixels, those past the border left out.
fn blurred(values: &[f32], w: usize, h: usize) -> Vec<f32> {
    let mut across = vec![0.0; w * h];
    for y in 0..h {
        let row = &values[y * w..(y + 1) * w];
        let out = &mut across[y * w..(y + 1) * w];
        for x in 0..w {
            let (a, b) = (x.saturating_sub(1), (x + 1).min(w - 1));
            out[x] = (row[a] + row[x] + row[b]) / 3.0;
        }
    }
    let mut result = vec![0.0; w * h];
    for y in 0..h {
        let (a, b) = (y.saturating_sub(1), (y + 1).min(h - 1));
        for x in 0..w {
            result[y * w + x] = (across[a * w + x] + across[y * w + x] + across[b * w + x]) / 3.0;
        }
    }
    result
}
