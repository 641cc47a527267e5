//! The final outline of one frame, at a size where thin legs have their pixels.

use super::correction::Labels;
use super::cues::Cues;
use super::drafts::Draft;
use super::expected::animal;
use super::field::{Known, least_cost};
use super::lab_image::LabImage;
use super::location::distances;
use crate::mask::Mask;
use crate::numeric::GridCut;

/// How far from the draft's outline the final one may lie, pixels of the sketch.
const BAND_PX: f32 = 5.0;

/// Width of the strip along the outline whose pixels are asked how sure it is, as a share of the
/// root of the silhouette's area.
const ASKED: f32 = 0.12;

/// The outline of a frame at the size of `image`, from its draft, and how sure it is: 2p − 1, with p
/// the mean probability, over a strip along the outline, that colour and plate give to the labels
/// the pixels got. 0 is a guess, 1 is certain.
pub(super) fn outline(
    image: &LabImage,
    draft: &Draft,
    cues: &Cues,
    labels: Option<&Labels>,
    cut: &mut GridCut,
) -> (Mask, f64) {
    let (w, h) = (image.width(), image.height());
    if draft.mask.is_empty() {
        return (Mask::new(w, h), 0.0);
    }
    let (sw, sh) = (draft.mask.width(), draft.mask.height());
    let to_draft = Scale::new((w, h), (sw, sh));
    let signed: Vec<f32> = distances(&draft.mask)
        .iter()
        .zip(distances(&draft.mask.not()))
        .map(|(outside, inside)| outside - inside)
        .collect();
    let length = (draft.mask.area() as f32).sqrt();
    let asked = (ASKED * length).max(BAND_PX);
    let plate: Vec<f32> =
        (0..sw * sh).map(|at| cues.plate_odds(&draft.plate, at % sw, at / sw)).collect();
    let colour: Vec<f32> = (0..w * h)
        .map(|at| {
            cues.colour_odds(
                image.at(at),
                to_draft.sample(&plate, at % w, at / w),
                draft.plate.colour(at % w * sw / w, at / w * sh / h),
            )
        })
        .collect();
    let colour = blurred(&colour, w, h);
    let mut seen = vec![0.0; w * h];
    let mut odds = vec![0.0; w * h];
    let mut known = vec![Known::Background; w * h];
    for y in 0..h {
        for x in 0..w {
            let at = y * w + x;
            let distance = to_draft.sample(&signed, x, y);
            if distance.abs() > asked {
                if distance < 0.0 {
                    known[at] = Known::Animal;
                }
                continue;
            }
            seen[at] = colour[at] + to_draft.sample(&plate, x, y);
            if distance.abs() <= BAND_PX {
                known[at] = Known::Free;
                let location = if distance > 0.0 {
                    -(3.0 * distance / length).min(3.0)
                } else {
                    (-20.0 * distance / length).min(1.0)
                };
                odds[at] = seen[at] + location;
            } else if distance < 0.0 {
                known[at] = Known::Animal;
            }
        }
    }
    if let Some(labels) = labels {
        labels.mark(&mut known);
    }
    let found = least_cost(image, &odds, &known, cut);
    let expected = Mask::from_fn(w, h, |x, y| to_draft.sample(&signed, x, y) <= 0.0);
    // Pieces that a correction brought are in the draft.
    let corrected = draft.carried.as_ref().map(|_| &expected);
    let mask = animal(&found, &expected, corrected);
    let (mut sum, mut asked_pixels) = (0.0, 0_usize);
    for y in 0..h {
        for x in 0..w {
            let at = y * w + x;
            if to_draft.sample(&signed, x, y).abs() <= asked {
                let sign = if mask.get(x, y) { 1.0 } else { -1.0 };
                sum += 1.0 / (1.0 + f64::from(-sign * seen[at]).exp());
                asked_pixels += 1;
            }
        }
    }
    let mean = if asked_pixels == 0 { 0.5 } else { sum / asked_pixels as f64 };
    (mask, (2.0 * mean - 1.0).clamp(0.0, 1.0))
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

/// Samples a small grid at the pixels of a larger one that shows the same picture.
pub(super) struct Scale {
    small: (usize, usize),
    columns: Vec<(usize, f32)>,
    rows: Vec<(usize, f32)>,
}

impl Scale {
    pub(super) fn new(large: (usize, usize), small: (usize, usize)) -> Self {
        let axis = |large: usize, small: usize| {
            (0..large)
                .map(|x| {
                    let at = (x as f32 + 0.5) * small as f32 / large as f32 - 0.5;
                    let at = at.clamp(0.0, (small - 1) as f32);
                    let low = (at as usize).min(small.saturating_sub(2));
                    (low, at - low as f32)
                })
                .collect()
        };
        Self { small, columns: axis(large.0, small.0), rows: axis(large.1, small.1) }
    }

    /// Bilinear between the pixels' centres.
    #[inline]
    pub(super) fn sample(&self, values: &[f32], x: usize, y: usize) -> f32 {
        let w = self.small.0;
        let ((x0, fx), (y0, fy)) = (self.columns[x], self.rows[y]);
        let (x1, y1) = ((x0 + 1).min(w - 1), (y0 + 1).min(self.small.1 - 1));
        let top = values[y0 * w + x0] * (1.0 - fx) + values[y0 * w + x1] * fx;
        let bottom = values[y1 * w + x0] * (1.0 - fx) + values[y1 * w + x1] * fx;
        top * (1.0 - fy) + bottom * fy
    }
}
