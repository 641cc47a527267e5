//! Silhouettes of a whole clip at once, at a small size, better with every round: from the drafts so
//! far follow the background plate, what its distances mean and the colours of both classes; from
//! these follow new drafts.
//!
//! Corrected frames work outwards: the frames between two of them (or one and an end of the clip)
//! are worked over with what these two say, and with nothing that any other correction says. So a
//! correction changes the frames up to the next correction on either side, and no other.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

use nalgebra::Matrix3;
use rayon::prelude::*;

use super::correction::Labels;
use super::cues::{Cues, Lessons};
use super::expected::{animal, filled, repaired};
use super::field::{Known, least_cost};
use super::lab_image::{LabImage, Region};
use super::least_sure::CARRIED_FRAMES;
use super::location::location_odds;
use super::pair_costs::Fall;
use super::plate::{Asked, FEW_OFFSETS, OFFSETS, PlateDistances, compared_frames, plate_distances};
use super::resemblance::{Resemblance, Seen};
use super::scene_evidence::Compared;
use super::scene_parts::{Stage, without_scene};
use super::shadow::{self, Looked, shadows};
use super::warp::Source;
use crate::mask::Mask;
use crate::numeric::GridCut;

/// How a round of drafting is done.
#[derive(Clone, Copy)]
struct Round {
    /// Radius by which a draft is widened before its pixels are kept out of the plate, pixels of the
    /// sketch.
    excluded_px: usize,
    /// How far from the draft a silhouette may reach, roots of the draft's area.
    reach: f64,
    /// How much the drafted place counts, and how much colour does.
    location: f32,
    colour: f32,
    /// How far before and after the frames of the plate are.
    offsets: &'static [usize],
    /// What the plate is asked for.
    asked: Asked,
}

/// On a guess by colour: there may be a trunk without neck and legs, and two rectangles do not show all
/// colours of the animal.
const ON_GUESSES: Round = Round {
    excluded_px: 4,
    reach: 2.0,
    location: 0.5,
    colour: 0.5,
    offsets: &FEW_OFFSETS,
    asked: Asked::Nothing,
};

/// On the drafts of the first round: what they lack of the legs is in the plate as yet.
const ON_DRAFTS: Round = Round {
    excluded_px: 2,
    reach: 0.7,
    location: 1.0,
    colour: 1.0,
    offsets: &OFFSETS,
    asked: Asked::Colours,
};

/// On the drafts of the second round: not much is missing.
const ON_BETTER_DRAFTS: Round = Round { reach: 0.5, ..ON_DRAFTS };

/// With corrections: the place they expect the animal at counts besides.
const WITH_CORRECTIONS: Round = Round {
    excluded_px: 2,
    reach: 1.2,
    location: 0.7,
    colour: 1.0,
    offsets: &OFFSETS,
    asked: Asked::All,
};

/// Rounds of drafting without corrections, and how often the frames beside corrections are worked over.
const ROUNDS: [Round; 3] = [ON_GUESSES, ON_DRAFTS, ON_BETTER_DRAFTS];
const CORRECTED_ROUNDS: usize = 2;

/// How much a correction says about the place of the animal beside a draft's own place; it falls to
/// 1/e in [`CARRIED_FRAMES`].
const CARRIED: f32 = 2.0;

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
    /// What a correction says of the frame beside the cues.
    pub(super) carried: Option<Carried>,
    /// What looks like the animal's shadow, as far as no correction knows better.
    pub(super) shadow: Option<Mask>,
}

/// What the nearest corrections say of a frame, less the further away they are.
#[derive(Clone, Debug)]
pub(super) struct Carried {
    /// Where the nearest expects the animal, and the weight that has.
    pub(super) expected: Mask,
    weight: f32,
    /// What the pixels about the same place of the corrected frames say.
    pub(super) resemblance: Option<Resemblance>,
}

/// What is known of a frame beside its cues and its draft.
#[derive(Clone, Copy)]
struct Beside<'a> {
    carried: Option<&'a Carried>,
    shadow: Option<&'a Mask>,
}

/// The drafts of all frames, and the cues they were cut with.
#[derive(Clone, Debug)]
pub(super) struct Drafted {
    pub(super) frames: Vec<Draft>,
    pub(super) cues: Vec<Cues>,
}

impl Drafted {
    /// Drafts of which nothing but the masks is remembered: corrections can work them over, but they
    /// cannot be outlined themselves.
    pub(super) fn remembered(masks: Vec<Mask>) -> Self {
        let draft = |mask| Draft {
            mask,
            plate: PlateDistances::nowhere(),
            cues: 0,
            carried: None,
            shadow: None,
        };
        Self { frames: masks.into_iter().map(draft).collect(), cues: Vec::new() }
    }
}

/// How working over with corrections ended.
pub(super) enum Corrected {
    /// All wanted frames have new drafts.
    Done(Arc<Drafted>),
    /// Some frames keep their base drafts: their corrections teach nothing.
    InPart(Arc<Drafted>),
    /// It was stopped.
    Stopped,
}

impl Clip {
    /// The base drafts; where there is nothing to learn from, no frame has one.
    pub(super) fn drafted(
        &self,
        guesses: &[Mask],
        step: &dyn Fn(usize, usize) -> bool,
    ) -> Arc<Drafted> {
        let nothing = Drafted { frames: Vec::new(), cues: Vec::new() };
        Arc::new(self.base(guesses, step).unwrap_or(nothing))
    }

    /// Drafts from first guesses, without corrections. `None` when the guesses hold too little to
    /// learn anything from, or when stopped: `step` is called before each part of the work with its
    /// number and the number of parts, and stops it by `false`.
    pub(super) fn base(
        &self,
        guesses: &[Mask],
        step: &dyn Fn(usize, usize) -> bool,
    ) -> Option<Drafted> {
        let compared = Compared::of(&self.frames, &self.from_first, self.fps);
        let mut masks = filled(&self.from_first, without_scene(&compared, guesses, Stage::Guess));
        for (at, round) in ROUNDS.iter().enumerate() {
            if !step(at, ROUNDS.len()) {
                return None;
            }
            let (frames, cues) = self.round(0..masks.len(), &masks, &[], round)?;
            if at + 1 == ROUNDS.len() {
                return Some(Drafted { frames, cues: vec![cues] });
            }
            let found: Vec<Mask> = frames.into_iter().map(|d| d.mask).collect();
            // What is of the scene goes but once: it does not come back by the drafts.
            masks = repaired(match at {
                0 => filled(&self.from_first, without_scene(&compared, &found, Stage::Draft)),
                _ => found,
            });
        }
        None
    }

    /// The base drafts worked over with the corrections, but for stretches of which no frame is
    /// `wanted`.
    pub(super) fn corrected(
        &self,
        base: &Arc<Drafted>,
        wanted: &dyn Fn(usize) -> bool,
        step: &dyn Fn(usize, usize) -> bool,
    ) -> Corrected {
        let mut spans = self.spans();
        spans.retain(|(span, _)| span.clone().any(wanted));
        let parts = spans.len();
        if parts == 0 {
            return Corrected::Done(Arc::clone(base));
        }
        let mut drafted = if base.frames.is_empty() {
            // Two rectangles found no animal; what a person drew may.
            let nothing = |f: &LabImage| Mask::new(f.width(), f.height());
            Drafted::remembered(self.frames.iter().map(nothing).collect())
        } else {
            Drafted::clone(base)
        };
        let masks = repaired(filled(
            &self.from_first,
            drafted.frames.iter().map(|d| d.mask.clone()).collect(),
        ));
        let mut whole = true;
        for (at, (span, truths)) in spans.into_iter().enumerate() {
            if !step(at, parts) {
                return Corrected::Stopped;
            }
            whole &= self.correct(&mut drafted, &masks, span, &truths);
        }
        let drafted = Arc::new(drafted);
        if whole { Corrected::Done(drafted) } else { Corrected::InPart(drafted) }
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

    /// Works a stretch over with what the corrections at its ends say; `false` when they do not teach
    /// enough for it.
    fn correct(
        &self,
        drafted: &mut Drafted,
        base: &[Mask],
        span: Range<usize>,
        truths: &[usize],
    ) -> bool {
        let mut masks = base.to_vec();
        for &t in truths {
            masks[t] = self.labels[&t].applied_to(&masks[t]);
        }
        for at in 0..CORRECTED_ROUNDS {
            let Some((found, cues)) = self.round(span.clone(), &masks, truths, &WITH_CORRECTIONS)
            else {
                return at > 0;
            };
            for (t, mut draft) in span.clone().zip(found) {
                draft.cues = drafted.cues.len();
                masks[t] = draft.mask.clone();
                drafted.frames[t] = draft;
            }
            drafted.cues.push(cues);
        }
        true
    }

    /// One round over the frames of `span`: plates, cues, cuts.
    fn round(
        &self,
        span: Range<usize>,
        masks: &[Mask],
        truths: &[usize],
        round: &Round,
    ) -> Option<(Vec<Draft>, Cues)> {
        let mut looked_at: Vec<usize> = span.clone().collect();
        looked_at.extend(truths.iter().filter(|t| !span.contains(t)));
        let mut plates: BTreeMap<usize, PlateDistances> = looked_at
            .iter()
            .copied()
            .zip(self.compare_with_plates(&looked_at, masks, round))
            .collect();
        let cues = Cues::learnt(&Lessons {
            frames: &self.frames,
            plates: &plates,
            masks,
            truths,
            seed: self.seed,
        })?;
        let shadows = match round.asked {
            Asked::Colours | Asked::All => self.shadows(span.clone(), masks, &plates, &cues),
            Asked::Nothing => vec![None; span.len()],
        };
        let cuts: Vec<(Mask, Option<Carried>)> = span
            .clone()
            .into_par_iter()
            .zip(&shadows)
            .map_init(GridCut::new, |cut, (t, shadow)| {
                let carried = self.carried(t, masks, truths, &plates);
                let plate = &plates[&t];
                let beside = Beside { carried: carried.as_ref(), shadow: shadow.as_ref() };
                let found = self.cut(t, masks, plate, &cues, beside, round, cut);
                (found, carried)
            })
            .collect();
        let mut last: Option<Mask> = None;
        let mut drafts = Vec::with_capacity(span.len());
        for ((t, (found, carried)), shadow) in span.zip(cuts).zip(shadows) {
            let expected = carried.as_ref().map(|c| &c.expected);
            let mask = animal(&found, &masks[t], last.as_ref(), expected);
            last = Some(mask.clone());
            let plate = plates.remove(&t)?;
            drafts.push(Draft { mask, plate, cues: 0, carried, shadow });
        }
        Some((drafts, cues))
    }

    /// The animal's shadow in each frame of `span`.
    fn shadows(
        &self,
        span: Range<usize>,
        masks: &[Mask],
        plates: &BTreeMap<usize, PlateDistances>,
        cues: &Cues,
    ) -> Vec<Option<Mask>> {
        let looked = |t: usize| Looked {
            image: &self.frames[t],
            plate: &plates[&t],
            draft: &masks[t],
            cues,
        };
        shadows(&span.map(looked).collect::<Vec<_>>())
    }

    fn compare_with_plates(
        &self,
        at: &[usize],
        masks: &[Mask],
        round: &Round,
    ) -> Vec<PlateDistances> {
        let sources: Vec<Source> = (self.frames.par_iter().zip(masks))
            .map(|(frame, mask)| Source::of(frame, &mask.dilated(round.excluded_px)))
            .collect();
        let n = self.frames.len();
        at.par_iter()
            .map(|&t| {
                let back = self.from_first[t].try_inverse();
                let others =
                    compared_frames(t, n, self.fps, round.offsets).into_iter().filter_map(|s| {
                        let to_other = self.from_first[s] * back?;
                        Some((&sources[s], to_other))
                    });
                plate_distances(
                    &self.frames[t],
                    region(&masks[t], round.reach),
                    others,
                    round.asked,
                )
            })
            .collect()
    }

    /// What the corrected frames say of another: where the nearest expects the animal (its
    /// silhouette, moved as the drafts have moved since), and what resembles which of its pixels.
    fn carried(
        &self,
        t: usize,
        masks: &[Mask],
        truths: &[usize],
        plates: &BTreeMap<usize, PlateDistances>,
    ) -> Option<Carried> {
        let &nearest = truths.iter().min_by_key(|&&c| c.abs_diff(t))?;
        let (from, to) = (masks[nearest].centre_of_mass()?, masks[t].centre_of_mass()?);
        let (w, h) = (masks[t].width(), masks[t].height());
        let left = (from.0 - to.0).round() as i64;
        let top = (from.1 - to.1).round() as i64;
        let weight = |c: usize| (-(c.abs_diff(t) as f32) / CARRIED_FRAMES as f32).exp();
        let seen = |t: usize| {
            Some(Seen { image: &self.frames[t], plate: plates.get(&t)?, mask: &masks[t] })
        };
        let corrected: Vec<(Seen, f32)> =
            truths.iter().filter_map(|&c| Some((seen(c)?, weight(c)))).collect();
        Some(Carried {
            expected: masks[nearest].window(left, top, w, h),
            weight: weight(nearest),
            resemblance: Resemblance::of(seen(t)?, &corrected),
        })
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
        beside: Beside,
        round: &Round,
        cut: &mut GridCut,
    ) -> Mask {
        let Beside { carried, shadow } = beside;
        let draft = &masks[t];
        let image = &self.frames[t];
        let (w, h) = (image.width(), image.height());
        if draft.is_empty() {
            return Mask::new(w, h);
        }
        let r = plate.region;
        let mut location = location_odds(draft, r);
        for odds in &mut location {
            *odds *= round.location;
        }
        if let Some(carried) = carried.filter(|c| !c.expected.is_empty()) {
            for (odds, there) in location.iter_mut().zip(location_odds(&carried.expected, r)) {
                *odds += CARRIED * carried.weight * there;
            }
        }
        let resemblance = carried.and_then(|c| c.resemblance.as_ref());
        let mut odds = vec![0.0; w * h];
        let mut known = vec![Known::Background; w * h];
        let places = (r.top..r.bottom).flat_map(|y| (r.left..r.right).map(move |x| (x, y)));
        for ((x, y), location) in places.zip(location) {
            let at = y * w + x;
            let seen = cues.plate_odds(plate, x, y);
            let colour = cues.colour_odds(image.at(at), seen, plate.colour(x, y));
            let resembles = resemblance.map_or(0.0, |r| r.log_odds(x, y));
            let shadowed = shadow.is_some_and(|shadow| shadow.get(x, y));
            let own =
                if shadowed { shadow::AGAINST } else { seen + round.colour * colour + location };
            odds[at] = own + resembles;
            known[at] = Known::Free;
        }
        if let Some(labels) = self.labels.get(&t).filter(|_| carried.is_some()) {
            labels.mark(&mut known);
        }
        least_cost(image, &Fall::of(image), &odds, &known, cut)
    }
}

/// The draft's bounding box, grown by `reach` roots of its area on all sides.
fn region(draft: &Mask, reach: f64) -> Region {
    Region::about(draft, (reach * (draft.area() as f64).sqrt()) as usize)
}
