//! A cast shadow at the feet: ground that is darker than it is without the animal, of the same hue,
//! and wider than a leg.
//!
//! A shadow multiplies the light of what it falls on, so the cube roots of luminance and the two
//! colour axes fall by one share (Prati and others, *Detecting moving shadows*, 2003, with the
//! chromaticity of CIE L*a*b*). A dark leg before light ground can do the same; but it is narrow, and
//! a shadow lies along the ground.
//!
//! How dark the shadow is hardly changes within a clip. So it is looked for twice: the wide places of
//! all frames tell how much light it leaves, and with that the narrow ones between the legs are found,
//! unless much of the animal itself looks so.

use std::ops::Range;

use rayon::prelude::*;

use super::cues::Cues;
use super::lab_image::{LIGHTNESS_STEPS, LabImage};
use super::plate::PlateDistances;
use crate::mask::{Connectivity, Mask, Run, components};

/// Share of the cube root of luminance that shadowed ground keeps: .5 is an eighth of the light. What
/// keeps more hardly stands out.
const KEPT_LIGHT: Range<f32> = 0.5..0.96;

/// Of the pixels of the wide places this share may be darker than the clip's shadow is taken to be: hooves
/// and legs. What it is taken to keep begins by so much less, for its darker core.
const DARKER: f64 = 0.2;
const CORE: f32 = 0.04;

/// Where less than this share of the animal above its feet looks like the shadow, narrow places may be
/// shadow, too.
const ALIKE: f64 = 0.15;

/// How far the colour axes may be from those of the ground times that share, units of a* and b*. A
/// shadow under a clear sky is bluer.
const SAME_A: f32 = 5.0;
const SAME_B: (f32, f32) = (-9.0, 5.0);

/// A shadow begins in this share of the silhouette's height, counted from below, and reaches as far
/// below it.
const FEET: f64 = 0.25;

// Widths and heights are shares of the root of the silhouette's area.

/// Somewhere a shadow is at least as wide as this, and the rows beside that are at least as wide as
/// the other: legs are a tenth to a fifth, hooves with the sand of their colour between them up to two
/// fifths.
const WIDE: Widths = Widths { somewhere: 0.5, beside: 0.2, least_px: 4 };

/// The same where the animal is unlike its shadow.
const NARROW: Widths = Widths { somewhere: 0.1, beside: 0.0, least_px: 3 };

/// Under what is left of the silhouette its shadow begins this much lower: a hoof on light ground is
/// darker than that and of its hue, too.
const HOOF: f64 = 0.1;

/// What is left is a leg where it goes on upwards for at least this.
const LEG: f64 = 0.15;

/// Pixels of a run that may be missing side by side: noise, and the thin edge of a hoof.
const GAP_PX: usize = 2;

/// What shadowed ground says, nats of log odds for the animal, in the place of plate, colour and place: that
/// it stands out from the ground is what a shadow does, and its colours were learnt with it.
pub(super) const AGAINST: f32 = -3.0;

/// Steps in which the kept share is counted, of 1.
const STEPS: usize = 128;

#[derive(Clone, Copy)]
struct Widths {
    somewhere: f64,
    beside: f64,
    least_px: usize,
}

/// A frame in which a shadow is looked for.
pub(super) struct Looked<'a> {
    pub(super) image: &'a LabImage,
    pub(super) plate: &'a PlateDistances,
    pub(super) draft: &'a Mask,
    /// Say which pixels are unlike the background at all.
    pub(super) cues: &'a Cues,
}

/// The pixels about the feet of each draft that look like the animal's shadow; `None` where there are
/// none. The frames are of one clip.
pub(super) fn shadows(frames: &[Looked]) -> Vec<Option<Mask>> {
    let count = |frame: &Looked| {
        let found = frame.shadow(&KEPT_LIGHT, WIDE)?;
        Some(frame.counts(&found))
    };
    let counts: Vec<Option<Counts>> = frames.par_iter().map(count).collect();
    let counts = counts.iter().flatten().fold(Counts::default(), Counts::with);
    let Some(kept) = counts.kept_light() else { return vec![None; frames.len()] };
    let widths = if counts.alike(&kept) < ALIKE { NARROW } else { WIDE };
    frames.par_iter().map(|frame| frame.shadow(&kept, widths)).collect()
}

/// How many pixels keep which share of the light that the ground behind them has.
#[derive(Clone)]
struct Counts {
    shadow: [u32; STEPS],
    animal: [u32; STEPS],
    /// All of the animal's pixels above the feet, whatever their hue.
    all_animal: u32,
}

impl Default for Counts {
    fn default() -> Self {
        Self { shadow: [0; STEPS], animal: [0; STEPS], all_animal: 0 }
    }
}

impl Counts {
    fn with(mut self, other: &Self) -> Self {
        let add = |to: &mut [u32; STEPS], from: &[u32; STEPS]| {
            to.iter_mut().zip(from).for_each(|(to, from)| *to += from);
        };
        add(&mut self.shadow, &other.shadow);
        add(&mut self.animal, &other.animal);
        self.all_animal += other.all_animal;
        self
    }

    /// What the clip's shadow keeps of the light; `None` where there is no shadow.
    fn kept_light(&self) -> Option<Range<f32>> {
        let all: u32 = self.shadow.iter().sum();
        let mut darker = 0;
        let darkest = self.shadow.iter().position(|pixels| {
            darker += pixels;
            f64::from(darker) > DARKER * f64::from(all)
        })?;
        let least = darkest as f32 / STEPS as f32 - CORE;
        Some(least.max(KEPT_LIGHT.start)..KEPT_LIGHT.end)
    }

    /// Share of the animal that looks like ground in a shadow which keeps so much.
    fn alike(&self, kept: &Range<f32>) -> f64 {
        let steps = self.animal.iter().enumerate();
        let within = steps.filter(|(at, _)| kept.contains(&(*at as f32 / STEPS as f32)));
        let pixels: u32 = within.map(|(_, pixels)| pixels).sum();
        f64::from(pixels) / f64::from(self.all_animal.max(1))
    }
}

fn step(kept: f32) -> usize {
    ((kept * STEPS as f32) as usize).min(STEPS - 1)
}

impl Looked<'_> {
    /// The rows that a shadow may lie in.
    fn rows(&self) -> Option<Range<usize>> {
        let bounds = self.draft.bounds()?;
        let reach = (FEET * bounds.height() as f64) as usize;
        let end = bounds.bottom + 1 + reach;
        Some(bounds.bottom.saturating_sub(reach)..end.min(self.image.height()))
    }

    /// Share of the light of the ground behind that a pixel of its hue has; `None` for one of another.
    fn kept_light(&self, x: usize, y: usize) -> Option<f32> {
        kept_light(self.image.at(y * self.image.width() + x), self.plate.colour(x, y)?)
    }

    /// What keeps so much of the light and is as wide as a shadow.
    fn shadow(&self, kept: &Range<f32>, widths: Widths) -> Option<Mask> {
        let rows = self.rows()?;
        let size = (self.image.width(), self.image.height());
        let length = (self.draft.area() as f64).sqrt();
        let px = |share: f64| (share * length) as usize;
        let least = px(widths.beside).max(widths.least_px);
        let is_dark = |x, y| self.kept_light(x, y).is_some_and(|k| kept.contains(&k));
        let mut dark = Vec::new();
        for y in rows.clone() {
            let looks = |x| self.cues.plate_odds(self.plate, x, y) > 0.0 && is_dark(x, y);
            let all = runs(self.plate.region.left..self.plate.region.right, looks);
            dark.extend(all.into_iter().filter(|run| run.len() >= least).map(|run| (y, run)));
        }
        let found = grown(&dark, px(widths.somewhere).max(widths.least_px), size);
        // Where the animal is unlike it no dark pixel is of a leg.
        let rest = if widths.beside > 0.0 {
            self.draft.and_not(&found)
        } else {
            self.draft.and_not(&Mask::from_fn(size.0, size.1, |x, y| {
                rows.contains(&y) && self.draft.get(x, y) && is_dark(x, y)
            }))
        };
        let legs = upright(&rest, px(LEG));
        let found = found.and_not(&lowered(&legs, px(HOOF)));
        (!found.is_empty()).then_some(found)
    }

    /// What a shadow and the animal above its feet keep of the light.
    fn counts(&self, shadow: &Mask) -> Counts {
        let mut counts = Counts::default();
        let (Some(rows), Some(bounds)) = (self.rows(), self.draft.bounds()) else { return counts };
        for y in bounds.top..rows.end {
            for x in self.plate.region.left..self.plate.region.right {
                let above = y < rows.start && self.draft.get(x, y);
                if above && self.plate.colour(x, y).is_some() {
                    counts.all_animal += 1;
                }
                if !(above || y >= rows.start && shadow.get(x, y)) {
                    continue;
                }
                if let Some(kept) = self.kept_light(x, y) {
                    let counted = if above { &mut counts.animal } else { &mut counts.shadow };
                    counted[step(kept)] += 1;
                }
            }
        }
        counts
    }
}

/// The runs of at least `width` pixels, and those that touch them from row to row.
fn grown(runs: &[(usize, Range<usize>)], width: usize, (w, h): (usize, usize)) -> Mask {
    let mut all = Mask::new(w, h);
    runs.iter().for_each(|(y, run)| all.fill(Run { y: *y, start: run.start, end: run.end }));
    let mut found = Mask::new(w, h);
    for piece in components(&all, Connectivity::Four) {
        if piece.runs().iter().any(|run| run.end - run.start >= width) {
            piece.draw(&mut found);
        }
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

/// Share of the cube root of luminance that a colour has of that behind it, if it may be that colour with
/// less light.
fn kept_light(colour: [u8; 3], behind: [u8; 3]) -> Option<f32> {
    let root = |byte: u8| f32::from(byte) / LIGHTNESS_STEPS + 16.0;
    let kept = root(colour[0]) / root(behind[0]);
    let off = |c: usize| (f32::from(colour[c]) - 128.0) - kept * (f32::from(behind[c]) - 128.0);
    let (a, b) = (off(1), off(2));
    let same =
        KEPT_LIGHT.contains(&kept) && a.abs() <= SAME_A && (SAME_B.0..=SAME_B.1).contains(&b);
    same.then_some(kept)
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
        let half = kept_light([103, 120, 145], grass).unwrap();
        assert!((half - 0.5_f32.cbrt()).abs() < 0.01, "{half}");
        assert_eq!(kept_light([103, 140, 145], grass), None, "a brown leg");
        assert_eq!(kept_light([139, 118, 150], grass), None, "the grass itself");
        assert_eq!(kept_light([180, 118, 150], grass), None, "lighter");
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
    fn the_clips_shadow_is_what_most_wide_places_keep_without_the_darkest() {
        assert_eq!(Counts::default().kept_light(), None);
        let mut counts = Counts::default();
        // A sixth of hooves that keep .55, shadow that keeps .75 to .85.
        counts.shadow[step(0.55)] = 20;
        (0..10).for_each(|n| counts.shadow[step(0.75 + 0.01 * n as f32)] = 10);
        let both = counts.clone().with(&counts);
        for counts in [counts, both] {
            let kept = counts.kept_light().unwrap();
            assert!(kept.start > 0.68 && kept.start < 0.75, "{kept:?}");
            assert_eq!(kept.end, KEPT_LIGHT.end);
        }
    }

    #[test]
    fn an_animal_is_like_its_shadow_by_the_share_of_all_its_pixels() {
        let mut counts = Counts { all_animal: 200, ..Counts::default() };
        counts.animal[step(0.8)] = 50;
        counts.animal[step(0.55)] = 70;
        assert!((counts.alike(&(0.7..0.96)) - 0.25).abs() < 1e-9);
        assert!((counts.alike(&(0.5..0.96)) - 0.6).abs() < 1e-9);
        assert_eq!(Counts::default().alike(&(0.5..0.96)), 0.0);
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
