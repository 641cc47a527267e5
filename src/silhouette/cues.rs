//! What a clip says about a pixel: its colour, and its distance from the background plate.
//!
//! Both are learnt from the clip itself. Where a person has drawn the truth there is a third thing
//! to learn: the colours of background that stands out from the plate all the same, which is what
//! a cast shadow, dust and ripples do.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::colour_table::ColourTable;
use super::evidence::{Counts, Evidence};
use super::lab_image::{LIGHTNESS_STEPS, LabImage};
use super::plate::{PlateDistances, UNKNOWN};
use crate::mask::Mask;

/// What counts as clear of the animal begins this far from the draft, in roots of its area.
const CLEAR: f64 = 0.35;

/// In corrected frames background is what lies this close to the animal, roots of its area.
const CLOSE: f64 = 0.12;

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

/// The most that colour may say, nats.
const STRONGEST_COLOUR: f32 = 3.0;

/// The most that the way a pixel differs from the background may say against the animal, nats: a
/// shadow darkens all it falls on by the same share, which little else does.
const STRONGEST_CHANGE: f32 = 6.0;

/// How much it counts that a pixel looks alike, or not, in frames that are all thought to have the
/// animal there: less than what the background says, since a body may be of one colour.
const COVERED: f32 = 0.8;

/// Share of what is learnt of the plate that corrected frames have, when there are any.
const TRUTH: f64 = 0.95;

/// A pixel stands out from the plate when the plate's log odds for the animal are above this.
const STANDS_OUT: f32 = 1.0;

/// Fewest pixels of background standing out in corrected frames that say what it looks like.
const LEAST_CHANGED: usize = 60;

/// What is learnt from: frames with their distances from the plate, and the silhouettes drafted so
/// far, of which some (`truths`) are known to be right.
pub(super) struct Lessons<'a> {
    pub(super) frames: &'a [LabImage],
    pub(super) plates: &'a BTreeMap<usize, PlateDistances>,
    pub(super) masks: &'a [Mask],
    pub(super) truths: &'a [usize],
    pub(super) seed: u64,
}

/// What the clip says about a pixel's colour and its distance from the plate.
#[derive(Clone, Debug)]
pub(super) struct Cues {
    colour: ColourTable,
    /// What the change from the colour behind says about a pixel that stands out from it: shadow,
    /// dust and ripples do that too. Known with corrected frames only.
    change: Option<ColourTable>,
    plate: PlateEvidence,
}

#[derive(Clone, Debug)]
struct PlateEvidence {
    shown: Evidence,
    /// Where every other frame has the animal, as far as is known: what it means that they all look
    /// alike there or not. Learnt only with corrected frames: a draft that takes background along
    /// would otherwise teach that background is the animal.
    covered: Option<Evidence>,
}

impl PlateEvidence {
    #[inline]
    fn of(&self, plate: &PlateDistances, x: usize, y: usize) -> f32 {
        match plate.shown(x, y) {
            UNKNOWN => {
                self.covered.as_ref().map_or(0.0, |covered| COVERED * covered.of(plate.any(x, y)))
            }
            shown => self.shown.of(shown),
        }
    }
}

impl Cues {
    /// Learns them; `None` when there is too little to learn from.
    pub(super) fn learnt(lessons: &Lessons) -> Option<Self> {
        let counts = lessons.counts();
        let plate = PlateEvidence {
            shown: Evidence::from_counts(&counts.shown),
            covered: (!lessons.truths.is_empty()).then(|| Evidence::from_counts(&counts.covered)),
        };
        let samples = lessons.colours(&plate);
        let colour = ColourTable::fit(&samples.animal, &samples.background, lessons.seed)?;
        let change = (samples.background_change.len() >= LEAST_CHANGED)
            .then(|| {
                ColourTable::fit(&samples.animal_change, &samples.background_change, lessons.seed)
            })
            .flatten();
        Some(Self { colour, change, plate })
    }

    /// Log odds that the plate gives a pixel to be the animal.
    #[inline]
    pub(super) fn plate_odds(&self, plate: &PlateDistances, x: usize, y: usize) -> f32 {
        self.plate.of(plate, x, y)
    }

    /// Log odds that its colour gives a pixel, beside those of the plate there. Where the background
    /// behind it is known and the pixel stands out from it, the way it does may speak against the
    /// animal.
    #[inline]
    pub(super) fn colour_odds(
        &self,
        colour: [u8; 3],
        plate_odds: f32,
        behind: Option<[u8; 3]>,
    ) -> f32 {
        let own = self.colour.of(colour).clamp(-STRONGEST_COLOUR, STRONGEST_COLOUR);
        match (&self.change, behind) {
            (Some(table), Some(behind)) if plate_odds > STANDS_OUT => {
                own.min(table.of(change(colour, behind)).max(-STRONGEST_CHANGE))
            }
            _ => own,
        }
    }
}

/// How a colour differs from the one behind it, as bytes that a colour table takes: the ratio of
/// the cube roots of luminance (which L* + 16 is proportional to) in units of 1/128, and the
/// differences of a* and b*. A shadow has the same ratio on light and on dark ground.
fn change(colour: [u8; 3], behind: [u8; 3]) -> [u8; 3] {
    let root = |byte: u8| f32::from(byte) / LIGHTNESS_STEPS + 16.0;
    let ratio = 128.0 * root(colour[0]) / root(behind[0]);
    let d = |c: usize| (i32::from(colour[c]) - i32::from(behind[c]) + 128).clamp(0, 255) as u8;
    [ratio.min(255.0) as u8, d(1), d(2)]
}

/// Counts of distances from what shows the background, and, where nothing does, from whatever is
/// there.
#[derive(Default)]
struct Distances {
    shown: Counts,
    covered: Counts,
}

impl Distances {
    fn merged(self, other: &Self) -> Self {
        Self {
            shown: self.shown.merged(&other.shown),
            covered: self.covered.merged(&other.covered),
        }
    }
}

/// Samples of each class: colours, and, of pixels that stand out in corrected frames, the change
/// from the colour behind them.
#[derive(Default)]
struct Samples {
    animal: Vec<[u8; 3]>,
    background: Vec<[u8; 3]>,
    animal_change: Vec<[u8; 3]>,
    background_change: Vec<[u8; 3]>,
}

impl Lessons<'_> {
    /// How often each distance occurs inside the animal and clear of it, with the corrected frames
    /// making up [`TRUTH`] of either class.
    fn counts(&self) -> Distances {
        let counted = |truth: bool| -> Distances {
            let frames: Vec<usize> = self.of_kind(truth);
            frames
                .par_iter()
                .map(|&t| self.counts_of(t, truth))
                .reduce(Distances::default, |a, b| a.merged(&b))
        };
        let (drafted, known) = (counted(false), counted(true));
        Distances {
            shown: drafted.shown.mixed(&known.shown, TRUTH),
            covered: drafted.covered.mixed(&known.covered, TRUTH),
        }
    }

    fn of_kind(&self, truth: bool) -> Vec<usize> {
        self.plates.keys().copied().filter(|t| self.truths.contains(t) == truth).collect()
    }

    /// The distances of one frame. A corrected one is known up to its outline, and what counts as
    /// background there is what lies close by: that is what the animal has to be told from.
    fn counts_of(&self, t: usize, truth: bool) -> Distances {
        let (mask, plate) = (&self.masks[t], &self.plates[&t]);
        let length = (mask.area() as f64).sqrt();
        let inside = mask.eroded(if truth { 1 } else { self.around() });
        let clear = mask.dilated(if truth { 1 } else { (CLEAR * length) as usize }).not();
        let close = truth.then(|| mask.dilated((CLOSE * length) as usize));
        let mut counts = Distances::default();
        let r = plate.region;
        for y in r.top..r.bottom {
            for x in r.left..r.right {
                let (shown, any) = (plate.shown(x, y), plate.any(x, y));
                if inside.get(x, y) {
                    counts.shown.inside[usize::from(shown)] += 1.0;
                    if shown == UNKNOWN {
                        counts.covered.inside[usize::from(any)] += 1.0;
                    }
                } else if clear.get(x, y) {
                    if shown == UNKNOWN {
                        counts.covered.outside[usize::from(any)] += 1.0;
                    }
                    if close.as_ref().is_none_or(|close| close.get(x, y)) {
                        counts.shown.outside[usize::from(shown)] += 1.0;
                    }
                }
            }
        }
        counts
    }

    fn around(&self) -> usize {
        let diagonal =
            self.frames.first().map_or(1.0, |f| (f.width() as f64).hypot(f.height() as f64));
        ((INSIDE * diagonal).round() as usize).max(1)
    }

    /// Colours of what the drafts and the plate agree on, and of all that is known in corrected
    /// frames.
    fn colours(&self, evidence: &PlateEvidence) -> Samples {
        let step = (self.plates.len() / COLOUR_FRAMES).max(1);
        let is_truth = |t: usize| self.truths.contains(&t);
        let asked: Vec<(usize, &PlateDistances)> = (self.plates.iter().enumerate())
            .filter(|(at, (t, _))| is_truth(**t) || at % step == 0)
            .map(|(_, (t, plate))| (*t, plate))
            .collect();
        let sampled: Vec<Samples> = asked
            .par_iter()
            .map(|&(t, plate)| {
                if is_truth(t) {
                    self.known(t, plate, evidence)
                } else {
                    self.agreed(t, plate, evidence)
                }
            })
            .collect();
        let mut samples = Samples::default();
        for ((t, _), of_frame) in asked.into_iter().zip(sampled) {
            let truth = is_truth(t);
            let most = COLOUR_SAMPLES * if truth { CORRECTED_SAMPLES } else { 1 };
            let thin = |from: Vec<[u8; 3]>, to: &mut Vec<[u8; 3]>| {
                let step = from.len().div_ceil(most).max(1);
                to.extend(from.into_iter().step_by(step));
            };
            thin(of_frame.animal, &mut samples.animal);
            thin(of_frame.background, &mut samples.background);
            thin(of_frame.background_change, &mut samples.background_change);
            thin(of_frame.animal_change, &mut samples.animal_change);
        }
        samples
    }

    /// Samples of a frame that is a draft.
    fn agreed(&self, t: usize, plate: &PlateDistances, evidence: &PlateEvidence) -> Samples {
        let around = self.around();
        let (image, mask) = (&self.frames[t], &self.masks[t]);
        let length = (mask.area() as f64).sqrt();
        let inside = mask.eroded(around);
        let outside = mask.dilated(around).not();
        let wide = mask.dilated((CLEAR * length) as usize);
        let near = mask.dilated(((CLEAR + NEAR) * length) as usize);
        let mut samples = Samples::default();
        for at in 0..image.width() * image.height() {
            let (x, y) = (at % image.width(), at / image.width());
            if !near.get(x, y) {
                continue;
            }
            let odds = evidence.of(plate, x, y);
            if (inside.get(x, y) && odds > -1.0) || (odds > 2.5 && wide.get(x, y)) {
                samples.animal.push(image.at(at));
            }
            if outside.get(x, y) && odds < 0.5 {
                samples.background.push(image.at(at));
            }
        }
        samples
    }

    /// Samples of a frame that is known.
    fn known(&self, t: usize, plate: &PlateDistances, evidence: &PlateEvidence) -> Samples {
        let (image, mask) = (&self.frames[t], &self.masks[t]);
        let length = (mask.area() as f64).sqrt();
        let inside = mask.eroded(1);
        let outside = mask.dilated(1).not();
        let near = mask.dilated(((CLEAR + NEAR) * length) as usize);
        let mut samples = Samples::default();
        for at in 0..image.width() * image.height() {
            let (x, y) = (at % image.width(), at / image.width());
            let (colours, changes) = if inside.get(x, y) {
                (&mut samples.animal, &mut samples.animal_change)
            } else if outside.get(x, y) && near.get(x, y) {
                (&mut samples.background, &mut samples.background_change)
            } else {
                continue;
            };
            let colour = image.at(at);
            colours.push(colour);
            if let Some(behind) = plate.colour(x, y)
                && evidence.of(plate, x, y) > STANDS_OUT
            {
                changes.push(change(colour, behind));
            }
        }
        samples
    }
}
