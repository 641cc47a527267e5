//! Silhouettes of a whole clip at once, at a small size, better with every round: from the drafts so
//! far follow the background plate, what its distances mean and the colours of both classes; from
//! these follow new drafts.
//!
//! Corrected frames work outwards: the frames between two of them (or one and an end of the clip)
//! are worked over with what these two say, and with nothing that any other correction says. So a
//! correction changes the frames up to the next correction on either side, and no other.

use std::collections::BTreeMap;
use std::ops::Range;

use nalgebra::Matrix3;
use rayon::prelude::*;

use super::colour_table::ColourTable;
use super::correction::Labels;
use super::evidence::{Counts, Evidence};
use super::field::{Known, least_cost};
use super::lab_image::LabImage;
use super::location::location_odds;
use super::plate::{PlateDistances, Region, compared_frames, plate_distances};
use crate::mask::{Connectivity, Mask, components};
use crate::numeric::GridCut;

/// Rounds of drafting: the first builds on a guess by colour, the second on the first.
const ROUNDS: usize = 2;

/// Radius by which a draft is widened before its pixels are kept out of the plate, pixels of the
/// sketch: the first draft is a guess, later ones are not.
const EXCLUDED_AT_FIRST_PX: usize = 4;
const EXCLUDED_PX: usize = 2;

/// What counts as clear of the animal begins this far from the draft, in roots of its area.
const CLEAR: f64 = 0.35;

/// Colours of background are taken up to this far beyond that, roots of the area: what is near the
/// animal is what it has to be told from.
const NEAR: f64 = 0.5;

/// What counts as inside begins this far from the draft's outline, as a share of the diagonal.
const INSIDE: f64 = 0.004;

/// Frames that colours are sampled from, and the most pixels of each and of each class.
const COLOUR_FRAMES: usize = 12;
const COLOUR_SAMPLES: usize = 1500;

/// How many times the samples of an ordinary frame a corrected one gives: it is known, not guessed.
const CORRECTED_SAMPLES: usize = 6;

/// How far from the draft a silhouette may reach, roots of the draft's area: at first there may be
/// a trunk without neck and legs, later not much is missing.
const REACH_AT_FIRST: f64 = 2.0;
const REACH: f64 = 1.2;

/// The most that colour may say, nats.
const STRONGEST_COLOUR: f32 = 3.0;

/// How much the drafted place counts while the draft is a first guess, and how much colour does:
/// two rectangles do not show all colours of the animal.
const FIRST_TRUST: Trust = Trust { location: 0.5, colour: 0.5 };
const LATER_TRUST: Trust = Trust { location: 1.0, colour: 1.0 };

/// Frames over which what a correction says about the place of the animal falls to 1/e, and how
/// much it says beside a draft's own place.
const CARRIED_FRAMES: f32 = 12.0;
const CARRIED: f32 = 2.0;

/// A draft is taken for a part of the animal when its area is under this share of the median of as
/// many frames before and after, and for the whole when it is over that.
const USUAL_FRAMES: usize = 5;
const PARTLY: f64 = 0.85;
const WHOLE: f64 = 0.92;

/// A second piece counts as the animal's when this share of it lies where a correction expects it.
const PIECE_EXPECTED: f64 = 0.4;

#[derive(Clone, Copy)]
struct Trust {
    location: f32,
    colour: f32,
}

/// A clip at sketch size.
pub(super) struct Clip {
    pub(super) frames: Vec<LabImage>,
    /// Takes coordinates of the first frame to those of each frame, pixels of the sketch.
    pub(super) from_first: Vec<Matrix3<f64>>,
    /// What a person said of some frames, at sketch size.
    pub(super) labels: BTreeMap<usize, Labels>,
    pub(super) fps: f64,
    pub(super) seed: u64,
}

/// What is known of one frame after drafting.
#[derive(Clone, Debug)]
pub(super) struct Draft {
    pub(super) mask: Mask,
    pub(super) plate: PlateDistances,
    /// Which of the clip's cues it was cut with.
    pub(super) cues: usize,
    /// Where a correction expects the animal, with the weight that has.
    pub(super) carried: Option<(Mask, f32)>,
}

/// What the clip says about a pixel's colour and its distance from the plate.
#[derive(Clone, Debug)]
pub(super) struct Cues {
    pub(super) colour: ColourTable,
    pub(super) plate: Evidence,
}

/// The drafts of all frames, and the cues they were cut with.
#[derive(Clone, Debug)]
pub(super) struct Drafted {
    pub(super) frames: Vec<Draft>,
    pub(super) cues: Vec<Cues>,
}

impl Clip {
    /// Drafts from first guesses, without corrections. `None` when the guesses hold too little to
    /// learn anything from, or when stopped: `step` is called before each part of the work with its
    /// number and the number of parts, and stops it by `false`.
    pub(super) fn base(
        &self,
        guesses: &[Mask],
        step: &dyn Fn(usize, usize) -> bool,
    ) -> Option<Drafted> {
        let mut masks = self.filled(guesses.to_vec());
        let mut drafted = None;
        for round in 0..ROUNDS {
            if !step(round, ROUNDS) {
                return None;
            }
            let (found, cues) = self.round(0..masks.len(), &masks, &[], round == 0)?;
            masks = repaired(self.filled(found.iter().map(|d| d.mask.clone()).collect()));
            drafted = Some(Drafted { frames: found, cues: vec![cues] });
        }
        drafted
    }

    /// The base drafts worked over with the corrections; `None` when stopped.
    pub(super) fn corrected(
        &self,
        base: &Drafted,
        step: &dyn Fn(usize, usize) -> bool,
    ) -> Option<Drafted> {
        let spans = self.spans();
        let parts = spans.len();
        let mut drafted = base.clone();
        let masks = repaired(self.filled(base.frames.iter().map(|d| d.mask.clone()).collect()));
        for (at, (span, truths)) in spans.into_iter().enumerate() {
            if !step(at, parts) {
                return None;
            }
            self.correct(&mut drafted, &masks, span, &truths);
        }
        Some(drafted)
    }

    /// The stretches between corrected frames, each with the corrections at its ends, which it
    /// includes.
    fn spans(&self) -> Vec<(Range<usize>, Vec<usize>)> {
        let corrected: Vec<usize> = self.labels.keys().copied().collect();
        let (Some(&first), Some(&last)) = (corrected.first(), corrected.last()) else {
            return Vec::new();
        };
        let mut spans = vec![(0..first + 1, vec![first])];
        spans.extend(corrected.windows(2).map(|c| (c[0] + 1..c[1] + 1, c.to_vec())));
        spans.push((last + 1..self.frames.len(), vec![last]));
        spans.retain(|(span, _)| !span.is_empty());
        spans
    }

    /// Works a stretch over with what the corrections at its ends say.
    fn correct(&self, drafted: &mut Drafted, base: &[Mask], span: Range<usize>, truths: &[usize]) {
        let mut masks = base.to_vec();
        for &t in truths {
            masks[t] = self.labels[&t].applied_to(&masks[t]);
        }
        for _ in 0..ROUNDS {
            let Some((found, cues)) = self.round(span.clone(), &masks, truths, false) else {
                return;
            };
            for (t, mut draft) in span.clone().zip(found) {
                draft.cues = drafted.cues.len();
                masks[t] = draft.mask.clone();
                drafted.frames[t] = draft;
            }
            drafted.cues.push(cues);
        }
    }

    /// One round over the frames of `span`: plates, cues, cuts.
    fn round(
        &self,
        span: Range<usize>,
        masks: &[Mask],
        truths: &[usize],
        first: bool,
    ) -> Option<(Vec<Draft>, Cues)> {
        let mut looked_at: Vec<usize> = span.clone().collect();
        looked_at.extend(truths.iter().filter(|t| !span.contains(t)));
        let plates: BTreeMap<usize, PlateDistances> = looked_at
            .iter()
            .copied()
            .zip(self.compare_with_plates(&looked_at, masks, first))
            .collect();
        let plate = Evidence::from_counts(&self.counts(&plates, masks, truths));
        let colour = self.colours(&plates, masks, truths, &plate)?;
        let cues = Cues { colour, plate };
        let trust = if first { FIRST_TRUST } else { LATER_TRUST };
        let cuts: Vec<(Mask, Option<(Mask, f32)>)> = span
            .clone()
            .into_par_iter()
            .map_init(GridCut::new, |cut, t| {
                let carried = self.carried(t, masks, truths);
                (self.cut(t, masks, &plates[&t], &cues, carried.as_ref(), trust, cut), carried)
            })
            .collect();
        let mut last: Option<Mask> = None;
        let mut drafts = Vec::with_capacity(span.len());
        for (t, (found, carried)) in span.zip(cuts) {
            let expected = match &last {
                Some(last) => masks[t].or(last),
                None => masks[t].clone(),
            };
            let mask = animal(&found, &expected, carried.as_ref().map(|(mask, _)| mask));
            last = Some(mask.clone());
            drafts.push(Draft { mask, plate: plates[&t].clone(), cues: 0, carried });
        }
        Some((drafts, cues))
    }

    fn compare_with_plates(
        &self,
        at: &[usize],
        masks: &[Mask],
        first: bool,
    ) -> Vec<PlateDistances> {
        let radius = if first { EXCLUDED_AT_FIRST_PX } else { EXCLUDED_PX };
        let reach = if first { REACH_AT_FIRST } else { REACH };
        let excluded: Vec<Vec<u8>> =
            masks.par_iter().map(|mask| bytes(&mask.dilated(radius))).collect();
        let n = self.frames.len();
        at.par_iter()
            .map(|&t| {
                let back = self.from_first[t].try_inverse();
                let others = compared_frames(t, n, self.fps).into_iter().filter_map(|s| {
                    let to_other = self.from_first[s] * back?;
                    Some((&self.frames[s], excluded[s].as_slice(), to_other))
                });
                plate_distances(&self.frames[t], region(&masks[t], reach), others)
            })
            .collect()
    }

    /// How often each distance occurs inside the animal and clear of it. A corrected frame is known
    /// up to its outline and counts several times.
    fn counts(
        &self,
        plates: &BTreeMap<usize, PlateDistances>,
        masks: &[Mask],
        truths: &[usize],
    ) -> Counts {
        let around = self.around();
        let plates: Vec<(&usize, &PlateDistances)> = plates.iter().collect();
        plates
            .par_iter()
            .map(|&(&t, plate)| {
                let mask = &masks[t];
                let truth = truths.contains(&t);
                let weight = if truth { CORRECTED_SAMPLES as u64 } else { 1 };
                let clear = if truth { 1 } else { (CLEAR * (mask.area() as f64).sqrt()) as usize };
                let inside = mask.eroded(if truth { 1 } else { around });
                let outside = mask.dilated(clear).not();
                let mut counts = Counts::new();
                let r = plate.region;
                for y in r.top..r.bottom {
                    for x in r.left..r.right {
                        let distance = usize::from(plate.at(x, y));
                        if inside.get(x, y) {
                            counts.inside[distance] += weight;
                        } else if outside.get(x, y) {
                            counts.outside[distance] += weight;
                        }
                    }
                }
                counts
            })
            .reduce(Counts::new, |a, b| a.merged(&b))
    }

    fn around(&self) -> usize {
        let diagonal =
            self.frames.first().map_or(1.0, |f| (f.width() as f64).hypot(f.height() as f64));
        ((INSIDE * diagonal).round() as usize).max(1)
    }

    /// Colours of what the drafts and the plate agree on, and of all that is known in corrected
    /// frames.
    fn colours(
        &self,
        plates: &BTreeMap<usize, PlateDistances>,
        masks: &[Mask],
        truths: &[usize],
        evidence: &Evidence,
    ) -> Option<ColourTable> {
        let step = (plates.len() / COLOUR_FRAMES).max(1);
        let around = self.around();
        let (mut animal, mut background) = (Vec::new(), Vec::new());
        let sampled =
            plates.iter().enumerate().filter(|(at, (t, _))| at % step == 0 || truths.contains(t));
        for (_, (&t, plate)) in sampled {
            let mask = &masks[t];
            let truth = truths.contains(&t);
            let length = (mask.area() as f64).sqrt();
            let inside = mask.eroded(if truth { 1 } else { around });
            let outside = mask.dilated(if truth { 1 } else { around }).not();
            let wide = mask.dilated((CLEAR * length) as usize);
            let near = mask.dilated(((CLEAR + NEAR) * length) as usize);
            let (mut a, mut b) = (Vec::new(), Vec::new());
            let image = &self.frames[t];
            for at in 0..image.width() * image.height() {
                let (x, y) = (at % image.width(), at / image.width());
                if !near.get(x, y) {
                    continue;
                }
                let odds = evidence.of(plate.at(x, y));
                let (is_animal, is_background) = if truth {
                    (inside.get(x, y), outside.get(x, y))
                } else {
                    (
                        (inside.get(x, y) && odds > -1.0) || (odds > 2.5 && wide.get(x, y)),
                        outside.get(x, y) && odds < 0.5,
                    )
                };
                if is_animal {
                    a.push(image.at(at));
                }
                if is_background {
                    b.push(image.at(at));
                }
            }
            let most = COLOUR_SAMPLES * if truth { CORRECTED_SAMPLES } else { 1 };
            let thin = |from: Vec<[u8; 3]>, to: &mut Vec<[u8; 3]>| {
                let step = from.len().div_ceil(most).max(1);
                to.extend(from.into_iter().step_by(step));
            };
            thin(a, &mut animal);
            thin(b, &mut background);
        }
        ColourTable::fit(&animal, &background, self.seed)
    }

    /// Where the nearest corrected frame expects the animal: its silhouette, moved as the drafts
    /// have moved since, with a weight that falls with time.
    fn carried(&self, t: usize, masks: &[Mask], truths: &[usize]) -> Option<(Mask, f32)> {
        let &nearest = truths.iter().min_by_key(|&&c| c.abs_diff(t))?;
        let (from, to) = (masks[nearest].centre_of_mass()?, masks[t].centre_of_mass()?);
        let (w, h) = (masks[t].width(), masks[t].height());
        let left = (from.0 - to.0).round() as i64;
        let top = (from.1 - to.1).round() as i64;
        let weight = (-(nearest.abs_diff(t) as f32) / CARRIED_FRAMES).exp();
        Some((masks[nearest].window(left, top, w, h), weight))
    }

    /// The silhouette of least cost in the part of a frame that the plate was looked at in.
    #[expect(
        clippy::too_many_arguments,
        reason = "what is known of a frame comes from as many sides"
    )]
    fn cut(
        &self,
        t: usize,
        masks: &[Mask],
        plate: &PlateDistances,
        cues: &Cues,
        carried: Option<&(Mask, f32)>,
        trust: Trust,
        cut: &mut GridCut,
    ) -> Mask {
        let draft = &masks[t];
        let image = &self.frames[t];
        let (w, h) = (image.width(), image.height());
        if draft.is_empty() {
            return Mask::new(w, h);
        }
        let mut location = location_odds(draft);
        for odds in &mut location {
            *odds *= trust.location;
        }
        if let Some((expected, weight)) = carried.filter(|(mask, _)| !mask.is_empty()) {
            for (odds, there) in location.iter_mut().zip(location_odds(expected)) {
                *odds += CARRIED * weight * there;
            }
        }
        let mut odds = vec![0.0; w * h];
        let mut known = vec![Known::Background; w * h];
        let r = plate.region;
        for y in r.top..r.bottom {
            for x in r.left..r.right {
                let at = y * w + x;
                let colour =
                    cues.colour.of(image.at(at)).clamp(-STRONGEST_COLOUR, STRONGEST_COLOUR);
                odds[at] = trust.colour * colour + cues.plate.of(plate.at(x, y)) + location[at];
                known[at] = Known::Free;
            }
        }
        if let Some(labels) = self.labels.get(&t).filter(|_| carried.is_some()) {
            labels.mark(&mut known);
        }
        least_cost(image, &odds, &known, cut)
    }

    /// Empty drafts between others take over the nearest one in time, moved as the camera has
    /// moved: the animal is looked for where it may be.
    fn filled(&self, mut masks: Vec<Mask>) -> Vec<Mask> {
        let full: Vec<usize> = (0..masks.len()).filter(|&t| !masks[t].is_empty()).collect();
        for t in 0..masks.len() {
            if !masks[t].is_empty() {
                continue;
            }
            let Some(&nearest) = full.iter().min_by_key(|&&s| s.abs_diff(t)) else { break };
            let source = masks[nearest].clone();
            let Some((x, y)) = source.centre_of_mass() else { continue };
            let moved = match self.from_first[nearest].try_inverse() {
                Some(back) => {
                    let p = self.from_first[t] * back * nalgebra::Vector3::new(x, y, 1.0);
                    (p.x / p.z - x, p.y / p.z - y)
                }
                None => (0.0, 0.0),
            };
            let (w, h) = (source.width(), source.height());
            masks[t] = source.window(-moved.0.round() as i64, -moved.1.round() as i64, w, h);
        }
        masks
    }
}

/// Drafts that lost a part for a moment take over the nearest whole one beside their own: the next
/// round looks there again.
fn repaired(masks: Vec<Mask>) -> Vec<Mask> {
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

/// The draft's bounding box, grown by `reach` roots of its area on all sides.
fn region(draft: &Mask, reach: f64) -> Region {
    let (w, h) = (draft.width(), draft.height());
    let Some(b) = draft.bounds() else {
        return Region { left: 0, top: 0, right: 0, bottom: 0 };
    };
    let by = (reach * (draft.area() as f64).sqrt()) as usize;
    Region {
        left: b.left.saturating_sub(by),
        top: b.top.saturating_sub(by),
        right: (b.right + 1 + by).min(w),
        bottom: (b.bottom + 1 + by).min(h),
    }
}

/// One byte a pixel, 1 where the mask is set.
pub(super) fn bytes(mask: &Mask) -> Vec<u8> {
    (0..mask.width() * mask.height())
        .map(|at| u8::from(mask.get(at % mask.width(), at / mask.width())))
        .collect()
}

/// Of what was cut, the component that shares most pixels with what is expected, and those that a
/// correction expects.
pub(super) fn animal(found: &Mask, expected: &Mask, corrected: Option<&Mask>) -> Mask {
    let mut result = Mask::new(found.width(), found.height());
    let mut pieces = components(found, Connectivity::Eight);
    let mut best: Option<(usize, usize)> = None;
    for (at, piece) in pieces.iter().enumerate() {
        let common = piece.common_area(expected);
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
