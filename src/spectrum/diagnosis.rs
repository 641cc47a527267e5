//! The verdict: usable, doubtful or unusable, with what was measured and what to try.

use std::fmt;

use serde::Serialize;

use super::{Advice, ComponentLine};

/// r of PC1 and PC2 from which the seed's test sequences were usable (section 5.2).
const GOOD_R: f64 = 0.6;

/// Below this r a component has no peak at f0: in the seed's table the components that do not
/// belong to the gait are at .3 or less. Between the two a clip may work: rigs with .47 came out
/// as well as ones with .78.
const FAIR_R: f64 = 0.3;

/// A rhythm is seen to repeat only when it is seen twice.
const GOOD_CYCLES: f64 = 2.0;

/// Less than this much of a cycle is no cycle.
const LEAST_CYCLES: f64 = 0.9;

/// Frames a cycle under which neighbouring frames are so far apart that key images miss the
/// extremes; the seed's fastest gaits have more than ten.
const GOOD_FRAMES_PER_CYCLE: f64 = 6.0;

/// Frames a cycle under which the repeat itself may be an alias of a faster one.
const LEAST_FRAMES_PER_CYCLE: f64 = 3.0;

/// Share of variance of PC1 and PC2 together. The seed's weakest clip, sketched, has .257; white
/// noise on a hundred frames has about .02 to .05.
const GOOD_SHARE: f64 = 0.15;

/// PC1 and PC2 make a circle when a quarter of a cycle apart; at 45 degrees from that the circle
/// is an ellipse with axes 1 : 0.4, and points half a cycle apart come close.
const QUADRATURE_SLACK_DEG: f64 = 45.0;

/// Shares of masks that are empty or flagged from which the clip is doubted, and given up.
const DOUBTFUL_BAD_MASKS: f64 = 0.1;
const UNUSABLE_BAD_MASKS: f64 = 0.5;

/// Share of the variance of the leading components that one repeated stride explains (unknowns of
/// the fit allowed for, so that of noise it explains nothing) from which the motion is a cycle, whichever
/// components show it. In the calibration set (docs/verdict.md) every gait above it came out
/// within .02 of the motion of what the keys can give at all.
const GOOD_CYCLE_SHARE: f64 = 0.5;

/// Strides from which that share means anything: of what is seen once, one stride explains all.
const GOOD_STRIDES: f64 = 1.4;

/// Variance of the pixels that the cycle explains over the animal's area. Gaits of the calibration
/// set have .049 and more, animals that stand and breathe .007 to .043.
const LEAST_SWEEP: f64 = 0.035;

/// Whether the clip carries a gait the method can use.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// Pose the keys.
    Usable,
    /// It may work; read the reasons first.
    Doubtful,
    /// It will not work as it is.
    Unusable,
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Verdict::Usable => "usable",
            Verdict::Doubtful => "doubtful",
            Verdict::Unusable => "unusable",
        })
    }
}

/// How many masks there are, and how many of them say nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct MaskCounts {
    /// All frames.
    pub frames: usize,
    /// Frames whose mask was left out: it is empty, or flagged.
    pub bad: usize,
    /// Frames that are flagged but were used, because most of the clip is flagged.
    pub flagged: usize,
    /// Of these, the ones that are flagged for more than reaching the border.
    pub uncertain: usize,
}

/// One finding behind the verdict; `Display` says it in words.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reason {
    /// PC1 and PC2 share one clear peak.
    PeaksShared {
        /// r of PC1.
        r1: f64,
        /// r of PC2.
        r2: f64,
    },
    /// A component has little of its motion in the band.
    WeakComponent {
        /// 1 or 2.
        component: usize,
        /// Its r.
        r: f64,
    },
    /// A later component carries the band better than PC2.
    PartnerElsewhere {
        /// Counted from 1.
        component: usize,
        /// Its r.
        r: f64,
    },
    /// One stride, repeated, explains the silhouettes of the clip.
    CycleExplains {
        /// Share of the variance, 0…1.
        share: f64,
    },
    /// The outline hardly moves in the cycle.
    LittleMotion {
        /// Variance of the pixels that the cycle explains over the animal's area.
        sweep: f64,
    },
    /// PC2 varies most at another frequency than PC1.
    PeakElsewhere {
        /// Its own peak, hertz.
        peak_hz: f64,
        /// The band about the peak of PC1, hertz.
        band_hz: (f64, f64),
    },
    /// What was seen of the gait contradicts the one that was named.
    GaitContradicted,
    /// The masks vary along one direction only.
    SingleComponent,
    /// The second component does not vary in the band at all.
    ConstantComponent {
        /// Counted from 1.
        component: usize,
    },
    /// PC1 and PC2 are not a quarter of a cycle apart.
    NotInQuadrature {
        /// Measured phase, degrees.
        phase_deg: f64,
    },
    /// The clip is too short for its rhythm.
    FewCycles {
        /// Cycles seen.
        cycles: f64,
    },
    /// The frame rate is low for the rhythm.
    FewFramesPerCycle {
        /// Frames from one repeat to the next.
        frames: f64,
    },
    /// PC1 and PC2 hold little of the variance.
    LittleVariance {
        /// Their share, 0…1.
        share: f64,
    },
    /// Most masks are flagged, so they were used all the same.
    FlaggedMasks {
        /// How many flagged masks were used.
        flagged: usize,
        /// How many of these for more than reaching the border.
        uncertain: usize,
        /// Of how many frames.
        frames: usize,
    },
    /// Masks are empty or flagged, and were left out.
    BadMasks {
        /// How many.
        bad: usize,
        /// Of how many.
        frames: usize,
    },
}

impl Reason {
    /// How bad this finding is on its own.
    #[must_use]
    pub fn verdict(&self) -> Verdict {
        let graded = |doubtful: bool| if doubtful { Verdict::Doubtful } else { Verdict::Unusable };
        match *self {
            Reason::PeaksShared { .. } | Reason::CycleExplains { .. } => Verdict::Usable,
            Reason::PeakElsewhere { .. } | Reason::GaitContradicted => Verdict::Doubtful,
            Reason::WeakComponent { r, .. } => graded(r >= FAIR_R),
            Reason::PartnerElsewhere { .. } | Reason::NotInQuadrature { .. } => Verdict::Doubtful,
            Reason::SingleComponent
            | Reason::ConstantComponent { .. }
            | Reason::LittleMotion { .. } => Verdict::Unusable,
            Reason::FewCycles { cycles } => graded(cycles >= LEAST_CYCLES),
            Reason::FewFramesPerCycle { frames } => graded(frames >= LEAST_FRAMES_PER_CYCLE),
            Reason::LittleVariance { .. } => Verdict::Doubtful,
            // A close shot cuts every silhouette alike, which is still a rhythm.
            Reason::FlaggedMasks { uncertain, frames, .. } => {
                if is_doubtful(uncertain, frames) {
                    Verdict::Doubtful
                } else {
                    Verdict::Usable
                }
            }
            Reason::BadMasks { bad, frames } => {
                graded((bad as f64) < UNUSABLE_BAD_MASKS * frames as f64)
            }
        }
    }

    /// Whether a plain cycle over all components answers this doubt: it was about what two
    /// components show of it, or about seeing it often enough. Frames a repeat are judged anew by the
    /// cycle's own repeats.
    fn is_settled_by_a_cycle(&self) -> bool {
        match self {
            Reason::WeakComponent { .. }
            | Reason::PartnerElsewhere { .. }
            | Reason::PeakElsewhere { .. }
            | Reason::NotInQuadrature { .. }
            | Reason::LittleVariance { .. }
            | Reason::FewCycles { .. }
            | Reason::FewFramesPerCycle { .. } => true,
            Reason::BadMasks { .. } => self.verdict() != Verdict::Unusable,
            _ => false,
        }
    }

    fn advice(&self) -> &'static [Advice] {
        match self {
            Reason::PeaksShared { .. } | Reason::CycleExplains { .. } => &[],
            Reason::PeakElsewhere { .. } => &[Advice::CheckMasks, Advice::CropToGait],
            Reason::GaitContradicted => &[Advice::NameGait],
            Reason::WeakComponent { .. } => {
                &[Advice::CheckMasks, Advice::CropToGait, Advice::DrawStrokes, Advice::OtherClip]
            }
            Reason::PartnerElsewhere { .. } => &[Advice::MoreComponents, Advice::DrawStrokes],
            Reason::SingleComponent
            | Reason::ConstantComponent { .. }
            | Reason::LittleMotion { .. } => &[Advice::CheckMasks, Advice::OtherClip],
            Reason::NotInQuadrature { .. } => &[Advice::CheckMasks, Advice::CropToGait],
            Reason::FewCycles { .. } => &[Advice::MoreFrames],
            Reason::FewFramesPerCycle { .. } => &[Advice::HigherFrameRate],
            Reason::LittleVariance { .. } => &[Advice::CheckMasks, Advice::DrawStrokes],
            Reason::FlaggedMasks { .. } if self.verdict() == Verdict::Usable => &[],
            Reason::FlaggedMasks { .. } => &[Advice::CheckMasks, Advice::DrawStrokes],
            Reason::BadMasks { .. } => &[Advice::CheckMasks, Advice::DrawStrokes],
        }
    }
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Reason::PeaksShared { r1, r2 } => write!(
                f,
                "PC1 and PC2 share one rhythm: r = {r1:.2} and {r2:.2} (usable from {GOOD_R})"
            ),
            Reason::WeakComponent { component, r } => write!(
                f,
                "PC{component} follows the rhythm only in part: r = {r:.2} (usable from {GOOD_R}, hopeless under {FAIR_R})"
            ),
            Reason::PartnerElsewhere { component, r } => write!(
                f,
                "PC{component} follows the rhythm better than PC2 (r = {r:.2}): the view may hide the motion that should come second"
            ),
            Reason::CycleExplains { share } => write!(
                f,
                "one stride, repeated, explains {:.0} % of what the leading components show (usable from {:.0} %)",
                100.0 * share,
                100.0 * GOOD_CYCLE_SHARE
            ),
            Reason::LittleMotion { sweep } => write!(
                f,
                "the outline hardly moves: its cycle sweeps over {:.1} % of the body (gaits: {:.1} % and more); the animal may only be breathing",
                100.0 * sweep,
                100.0 * LEAST_SWEEP
            ),
            Reason::PeakElsewhere { peak_hz, band_hz } => write!(
                f,
                "PC2 varies most at {peak_hz:.2} Hz, outside the rhythm of PC1 ({:.2} to {:.2} Hz)",
                band_hz.0, band_hz.1
            ),
            Reason::GaitContradicted => write!(
                f,
                "every second repeat of the silhouette differs, as of a symmetric gait, but the gait was named asymmetric"
            ),
            Reason::SingleComponent => {
                write!(f, "the silhouettes vary along one direction only, so no cycle can be seen")
            }
            Reason::ConstantComponent { component } => {
                write!(f, "PC{component} does not vary at the rhythm of PC1 at all")
            }
            Reason::NotInQuadrature { phase_deg } => write!(
                f,
                "PC1 and PC2 are {:.0} degrees apart instead of 90: their curve is not a circle",
                phase_deg.abs()
            ),
            Reason::FewCycles { cycles } => write!(
                f,
                "the clip holds {cycles:.1} cycles; a rhythm is seen to repeat from {GOOD_CYCLES} on"
            ),
            Reason::FewFramesPerCycle { frames } => write!(
                f,
                "only {frames:.1} frames a cycle; {GOOD_FRAMES_PER_CYCLE} or more are wanted"
            ),
            Reason::LittleVariance { share } => write!(
                f,
                "PC1 and PC2 hold {:.0} % of the silhouettes' variation; the rest is noise or other motion",
                100.0 * share
            ),
            Reason::FlaggedMasks { flagged, frames, .. } => write!(
                f,
                "{flagged} of {frames} masks are flagged, too many to leave them out: they were used as they are"
            ),
            Reason::BadMasks { bad, frames } => {
                write!(f, "{bad} of {frames} masks are empty or flagged and were left out")
            }
        }
    }
}

/// What the gait phase found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CycleFindings {
    /// Share of the leading components' variance that one stride, repeated, explains, 0…1.
    pub explained_share: f64,
    /// Strides seen.
    pub strides: f64,
    /// Frames from one repeat of the silhouette to the next.
    pub repeat_frames: f64,
    /// Variance of the pixels that the cycle explains over the animal's area; `None` when unknown.
    pub sweep: Option<f64>,
    /// Whether the evidence contradicts the gait that was named.
    pub contradicts_gait: bool,
}

/// The verdict with everything behind it.
#[derive(Clone, Debug, PartialEq)]
pub struct Diagnosis {
    /// The worst of the reasons' own verdicts.
    pub verdict: Verdict,
    /// Repeats of the silhouette in the clip.
    pub cycles: f64,
    /// What was found, worst first.
    pub reasons: Vec<Reason>,
    /// What to try, most promising first; empty when the clip is usable.
    pub advice: Vec<Advice>,
}

impl Diagnosis {
    /// Judges the measurements.
    #[must_use]
    pub fn of(
        components: &[ComponentLine],
        quadrature_deg: Option<f64>,
        cycles: f64,
        frames_per_cycle: f64,
        masks: MaskCounts,
        band_hz: (f64, f64),
    ) -> Self {
        let mut reasons = component_reasons(components, quadrature_deg);
        if let Some(second) = components.get(1)
            && second.r >= FAIR_R
            && !(band_hz.0..=band_hz.1).contains(&second.peak_hz)
        {
            reasons.push(Reason::PeakElsewhere { peak_hz: second.peak_hz, band_hz });
        }
        if cycles < GOOD_CYCLES {
            reasons.push(Reason::FewCycles { cycles });
        }
        if frames_per_cycle < GOOD_FRAMES_PER_CYCLE {
            reasons.push(Reason::FewFramesPerCycle { frames: frames_per_cycle });
        }
        let share: f64 = components.iter().take(2).map(|c| c.variance_share).sum();
        if share < GOOD_SHARE {
            reasons.push(Reason::LittleVariance { share });
        }
        let MaskCounts { frames, flagged, uncertain, .. } = masks;
        if flagged > 0 {
            reasons.push(Reason::FlaggedMasks { flagged, uncertain, frames });
        }
        if is_doubtful(masks.bad, masks.frames) {
            reasons.push(Reason::BadMasks { bad: masks.bad, frames: masks.frames });
        }
        Self::from_reasons(reasons, cycles)
    }

    /// The same with what the gait phase adds. Where the cycle is plain, it does not matter which
    /// components show it, how often, and whether some masks are missing: over the calibration set
    /// (docs/verdict.md) none of this says anything of the error any more.
    #[must_use]
    pub fn with_cycle(self, cycle: CycleFindings) -> Self {
        let Self { cycles, mut reasons, .. } = self;
        let share = cycle.explained_share;
        if share >= GOOD_CYCLE_SHARE && cycle.strides >= GOOD_STRIDES {
            reasons.retain(|r| !r.is_settled_by_a_cycle());
            reasons.push(Reason::CycleExplains { share });
            if cycle.repeat_frames < GOOD_FRAMES_PER_CYCLE {
                reasons.push(Reason::FewFramesPerCycle { frames: cycle.repeat_frames });
            }
            if let Some(sweep) = cycle.sweep.filter(|s| *s < LEAST_SWEEP) {
                reasons.push(Reason::LittleMotion { sweep });
            }
        }
        if cycle.contradicts_gait {
            reasons.push(Reason::GaitContradicted);
        }
        Self::from_reasons(reasons, cycles)
    }

    fn from_reasons(mut reasons: Vec<Reason>, cycles: f64) -> Self {
        reasons.sort_by_key(|r| std::cmp::Reverse(r.verdict()));
        let verdict = reasons.iter().map(Reason::verdict).max().unwrap_or(Verdict::Usable);
        let mut advice = Vec::new();
        for item in reasons.iter().flat_map(|r| r.advice()) {
            if !advice.contains(item) {
                advice.push(*item);
            }
        }
        Self { verdict, cycles, reasons, advice }
    }
}

/// Whether so many masks make a clip doubtful.
fn is_doubtful(bad: usize, frames: usize) -> bool {
    bad as f64 > DOUBTFUL_BAD_MASKS * frames as f64
}

fn component_reasons(components: &[ComponentLine], quadrature_deg: Option<f64>) -> Vec<Reason> {
    let [first, second, later @ ..] = components else {
        return vec![Reason::SingleComponent];
    };
    let mut reasons = Vec::new();
    if first.r >= GOOD_R && second.r >= GOOD_R {
        reasons.push(Reason::PeaksShared { r1: first.r, r2: second.r });
    }
    if first.r < GOOD_R {
        reasons.push(Reason::WeakComponent { component: 1, r: first.r });
    }
    let better = later.iter().enumerate().find(|(_, c)| c.r >= GOOD_R && c.r > second.r);
    if second.r == 0.0 {
        reasons.push(Reason::ConstantComponent { component: 2 });
    } else if second.r < GOOD_R {
        match better {
            Some((at, line)) => {
                reasons.push(Reason::PartnerElsewhere { component: at + 3, r: line.r });
            }
            None => reasons.push(Reason::WeakComponent { component: 2, r: second.r }),
        }
    }
    if let Some(phase_deg) = quadrature_deg
        && second.r >= FAIR_R
        && (phase_deg.abs() - 90.0).abs() > QUADRATURE_SLACK_DEG
    {
        reasons.push(Reason::NotInQuadrature { phase_deg });
    }
    reasons
}

#[cfg(test)]
mod tests {
    use super::*;

    fn doubted() -> Diagnosis {
        let line = |r: f64| ComponentLine { variance_share: 0.05, r, peak_hz: 9.0 };
        let masks = MaskCounts { frames: 100, bad: 20, ..MaskCounts::default() };
        Diagnosis::of(&[line(0.7), line(0.2)], Some(5.0), 1.6, 24.0, masks, (0.5, 1.5))
    }

    fn cycle() -> CycleFindings {
        CycleFindings {
            explained_share: 0.9,
            strides: 1.6,
            repeat_frames: 15.0,
            sweep: Some(0.1),
            contradicts_gait: false,
        }
    }

    #[test]
    fn a_plain_cycle_settles_what_two_components_leave_in_doubt() {
        assert_eq!(doubted().verdict, Verdict::Unusable);
        let settled = doubted().with_cycle(cycle());
        assert_eq!(settled.reasons, [Reason::CycleExplains { share: 0.9 }]);
        assert_eq!(settled.verdict, Verdict::Usable);
        assert!(settled.advice.is_empty());
        for weak in [
            CycleFindings { explained_share: 0.4, ..cycle() },
            CycleFindings { strides: 1.0, ..cycle() },
        ] {
            assert_eq!(doubted().with_cycle(weak).reasons, doubted().reasons);
        }
    }

    #[test]
    fn a_cycle_does_not_settle_low_rates_lost_masks_or_a_still_animal() {
        let lines = [ComponentLine { variance_share: 0.3, r: 0.9, peak_hz: 1.0 }; 2];
        let masks = MaskCounts { frames: 100, bad: 60, ..MaskCounts::default() };
        let lost = Diagnosis::of(&lines, Some(90.0), 4.0, 2.5, masks, (0.5, 1.5));
        let judged = lost.with_cycle(CycleFindings { repeat_frames: 2.5, ..cycle() });
        assert!(judged.reasons.contains(&Reason::FewFramesPerCycle { frames: 2.5 }));
        assert!(judged.reasons.contains(&Reason::BadMasks { bad: 60, frames: 100 }));
        assert_eq!(judged.verdict, Verdict::Unusable);
        let still = doubted().with_cycle(CycleFindings { sweep: Some(0.01), ..cycle() });
        assert_eq!(still.reasons[0], Reason::LittleMotion { sweep: 0.01 });
        assert_eq!(still.verdict, Verdict::Unusable);
    }
}
