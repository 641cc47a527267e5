//! Masks to coefficients and verdict, in memory.

use std::ops::Range;

use super::bridge::{bridged, held};
use super::drift::{self, ShapeDrift};
use super::phase::{measure_phase, stride_basis};
use super::segments::{Segment, lengthened};
use super::view_drift::view_drift;
use crate::error::Result;
use crate::gait::{GaitPhase, Repeats};
use crate::image_pca::{CentredGram, ImagePca, MaskBands};
use crate::mask::{CroppedMask, Mask};
use crate::numeric::Coefficients;
use crate::shot::{FlaggedFrames, PhaseTable};
use crate::silhouette::{
    Flag, Flags, FrameReport, TrendRemoval, WindowSettings, Windowed, flag_area_jumps,
    report_of_mask, windowed,
};
use crate::spectrum::{self, CycleFindings, KnownRhythm, MaskCounts, SpectralAnalysis};

/// What of slow changes is removed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Trends {
    /// Of the animal's size, before the windows are cut.
    pub scale: TrendRemoval,
    /// Of its shape, before the PCA.
    pub shape: TrendRemoval,
}

/// Everything the analysis of a clip's masks gives.
#[derive(Clone, Debug)]
pub struct MaskAnalysis {
    /// The masks cut to their windows.
    pub windows: Windowed,
    /// For each frame, whether its mask entered the PCA.
    pub used: Vec<bool>,
    /// The PCA of the used masks.
    pub pca: ImagePca,
    /// The slow change of shape; `None` where it was not looked for.
    pub drift: Option<ShapeDrift>,
    /// Unit-deviation scores of all frames; those of unused masks are bridged linearly from their
    /// neighbours.
    pub scores: Coefficients,
    /// Spectra, band, band-passed scores, verdict.
    pub spectral: SpectralAnalysis,
    /// The gait phase; `None` where the clip is too short for one.
    pub gait: Option<GaitPhase>,
    /// How far the view has drifted at each frame, standard deviations; `None` where it does not.
    pub view_drift: Option<Vec<f64>>,
    /// The frames that were analysed: the whole clip, or a segment of it. Outside, scores and phase are held.
    pub frames: Range<usize>,
    /// The segments of the clip in order, without gaps; the one whole clip where nothing was looked for.
    pub segments: Vec<Segment>,
}

/// Components that the gait phase is measured with, whatever number the user keeps. The lines that
/// tell near legs from far ones are often in none of the first five.
const PHASE_COMPONENTS: usize = 16;

/// Share of what is left of the silhouettes that a phase must explain which is found only with the drift gone: of
/// animals that stand and breathe it explains up to .29, of the horses and the fox that need this .36 to .8.
const LEAST_EXPLAINED: f64 = 0.32;

impl MaskAnalysis {
    /// The windows of the masks that entered the PCA.
    #[must_use]
    pub fn analysed_masks(&self) -> Vec<&CroppedMask> {
        self.windows.masks.iter().zip(&self.used).filter(|(_, u)| **u).map(|(m, _)| m).collect()
    }

    /// How far the outline moves in the gait: variance of the pixels that the cycle explains
    /// (pixels²) over the mean area of the silhouettes (pixels). Walks of the rigs have .08 to .17,
    /// gallops and runs .13 to .23. `None` without a phase.
    #[must_use]
    pub fn sweep(&self) -> Option<f64> {
        sweep(self.gait.as_ref()?, &self.pca, &self.analysed_masks())
    }

    /// The gait phase with the drift of the view, as keys and interpolation use them.
    #[must_use]
    pub fn phase_table(&self) -> Option<PhaseTable> {
        let mut table = PhaseTable::of(self.gait.as_ref()?);
        if let Some(drift) = &self.view_drift {
            table.drift.clone_from(drift);
        }
        Some(table)
    }

    /// The scores that keys and interpolation use.
    #[must_use]
    pub fn coefficients(&self, band_pass: bool) -> &Coefficients {
        if band_pass { &self.spectral.band_passed } else { &self.scores }
    }
}

/// Cuts, analyses and judges the masks of a clip of which nothing else is known. An empty mask says
/// nothing, one that the border of the picture cuts says something else than the gait, and one whose
/// area jumps is broken: all are left out of the PCA and bridged, unless most of the clip is cut (a close shot), when the cut
/// masks are all there is.
///
/// # Errors
/// As [`ImagePca::fit`] and [`spectrum::analyse`].
pub fn analyse_masks(
    masks: &[Mask],
    fps: f64,
    components: usize,
    trends: Trends,
    settings: &spectrum::Settings,
) -> Result<MaskAnalysis> {
    let mut reports: Vec<FrameReport> =
        masks.iter().enumerate().map(|(t, m)| report_of_mask(t, m)).collect();
    flag_area_jumps(&mut reports);
    let masks: Vec<CroppedMask> = masks.iter().map(CroppedMask::from).collect();
    let usable = Usable::of(&masks, &reports, FlaggedFrames::LeaveOut);
    let (found, _) = analyse_usable(&masks, usable, fps, components, trends, settings)?;
    Ok(found)
}

/// The same with the choice of frames given, and with the scores of all the components that the phase is
/// measured with. A mask that is not used changes nothing: neither the window's size nor the trend of scale.
fn analyse_usable(
    masks: &[CroppedMask],
    usable: Usable,
    fps: f64,
    components: usize,
    trends: Trends,
    settings: &spectrum::Settings,
) -> Result<(MaskAnalysis, ImagePca)> {
    let Usable { used, frames, flagged, uncertain } = usable;
    let blank = masks.first().map(|first| CroppedMask::empty(first.width(), first.height()));
    let kept: Vec<&CroppedMask> = masks
        .iter()
        .zip(&used)
        .map(|(mask, used)| if *used { mask } else { blank.as_ref().unwrap_or(mask) })
        .collect();
    let windows = windowed(&kept, WindowSettings { scale_trend: trends.scale });
    let good: Vec<&CroppedMask> =
        windows.masks.iter().zip(&used).filter(|(_, used)| **used).map(|(m, _)| m).collect();
    if good.is_empty() {
        // Says that all masks are empty, or that there is none.
        MaskBands::of(&windows.masks.iter().collect::<Vec<_>>())?;
    }
    let seen = Seen::of(&used);
    let back = windows.back_rows_px(&used);
    let phase = |pca: &ImagePca, removed| {
        measure_phase(pca, &used, &frames, settings.gait, removed, back.as_ref())
    };
    let (all, drift, gait) = components_and_phase(&good, &seen.times, components, trends, &phase)?;
    let removed = drift.filter(|d| d.removed);
    let pca = all.leading(components);
    let bad = frames.len() - good.len();
    let counts = MaskCounts { frames: frames.len(), bad, flagged, uncertain };
    let span_scores = bridged(&pca.scores, &used[seen.first..seen.first + seen.span()]);
    let shares = pca.variance_shares();
    let rhythm = KnownRhythm {
        repeats_hz: removed.map(|d| d.repeats_a_frame * fps),
        stride_hz: gait
            .as_ref()
            .filter(|gait| gait.stride.outweighs_the_step())
            .map(|gait| fps / gait.stride_frames()),
    };
    let mut spectral = spectrum::analyse(&span_scores, &shares, fps, counts, settings, rhythm)?;
    spectral.band_passed = held(&spectral.band_passed, seen.first, masks.len());
    if let Some(gait) = &gait {
        let frames = (gait.stride.repeats != Repeats::Unknown).then(|| gait.stride_frames());
        let basis = stride_basis(settings.gait, gait.stride.repeats);
        spectral.rhythm = spectral.rhythm.with_stride(frames, basis);
        spectral.diagnosis = spectral.diagnosis.with_cycle(CycleFindings {
            explained_share: gait.explained_share,
            strides: seen.span() as f64 / gait.stride_frames(),
            repeat_frames: gait.repeat_frames,
            sweep: sweep(gait, &pca, &good),
            contradicts_gait: gait.stride.contradicts_gait,
        });
    }
    let view_drift = gait.as_ref().and_then(|gait| {
        let scores = bridged(&all.scores, &used);
        view_drift(&scores, &all.variance_shares(), &used, &frames, gait, drift)
    });
    let gait = gait.map(|gait| {
        // Where the view turns the outline changes for other reasons.
        let reach = if view_drift.is_none() { windows.reach_px(&used) } else { None };
        let gait = match reach {
            Some(reach) => gait.with_amplitude(&reach.rows(frames.clone())),
            None => gait,
        };
        lengthened(gait, frames.start, masks.len())
    });
    let scores = bridged(&pca.scores, &used);
    let segments = vec![Segment::of(frames.clone(), &spectral, gait.as_ref())];
    let found = MaskAnalysis {
        windows,
        used,
        pca,
        drift,
        scores,
        spectral,
        gait,
        view_drift,
        frames,
        segments,
    };
    Ok((found, all))
}

/// The components of the masks, whether a drift was removed from them, and the phase by them.
///
/// Where no phase is found it may be a drift that hides it, whether PC1 is that drift or not: a cycle as long as the
/// clip explains every clip. So it is looked for once more with the drift gone, if there is a rhythm beside it.
fn components_and_phase(
    masks: &[&CroppedMask],
    times: &[usize],
    components: usize,
    trends: Trends,
    phase: &dyn Fn(&ImagePca, Option<ShapeDrift>) -> Option<GaitPhase>,
) -> Result<(ImagePca, Option<ShapeDrift>, Option<GaitPhase>)> {
    let components = components.max(PHASE_COMPONENTS);
    // The largest thing there is of a long clip: gone when this returns.
    let gram = CentredGram::of_bands(&MaskBands::of(masks)?);
    let (plain, drift) = drift::fit(&gram, times, components, trends.shape)?;
    let gait = phase(&plain, drift.filter(|d| d.removed));
    if gait.is_none()
        && trends.shape == TrendRemoval::Auto
        && let Some((left, drift)) = drift::fit_rhythm(&gram, &plain, times, components)
        && let Some(gait) = phase(&left, Some(drift))
        && gait.explained_share >= LEAST_EXPLAINED
    {
        return Ok((left, Some(drift), Some(gait)));
    }
    Ok((plain, drift, gait))
}

/// A clip's masks and what is wanted of them.
#[derive(Clone, Copy, Debug)]
pub struct MaskClip<'a> {
    /// The masks, one a frame.
    pub masks: &'a [CroppedMask],
    /// What was noticed of each; none of a clip of which nothing else is known.
    pub reports: &'a [FrameReport],
    /// What becomes of flagged frames.
    pub flagged: FlaggedFrames,
    /// Frames a second.
    pub fps: f64,
    /// Principal components that are kept.
    pub components: usize,
    /// What of slow changes is removed.
    pub trends: Trends,
}

impl MaskClip<'_> {
    /// Analyses some of its frames, or all.
    pub(super) fn analysed(
        &self,
        frames: Range<usize>,
        settings: &spectrum::Settings,
    ) -> Result<(MaskAnalysis, ImagePca)> {
        let usable = Usable::within(self.masks, self.reports, self.flagged, frames);
        analyse_usable(self.masks, usable, self.fps, self.components, self.trends, settings)
    }
}

/// The stretch from the first used frame to the last: what lies outside is held, not measured, and
/// would look like a step to a spectrum.
struct Seen {
    /// The first used frame.
    first: usize,
    /// All used frames, counted from the first.
    times: Vec<usize>,
}

impl Seen {
    fn of(used: &[bool]) -> Self {
        let first = used.iter().position(|u| *u).unwrap_or(0);
        Self { first, times: (first..used.len()).filter(|&t| used[t]).map(|t| t - first).collect() }
    }

    fn span(&self) -> usize {
        self.times.last().map_or(0, |t| t + 1)
    }
}

/// Variance of the pixels that the cycle explains over the mean area of the analysed masks.
fn sweep(gait: &GaitPhase, pca: &ImagePca, masks: &[&CroppedMask]) -> Option<f64> {
    let share: f64 = (1..=gait.cycle.order()).map(|h| gait.cycle.power(h)).sum();
    let area = masks.iter().map(|m| m.area() as f64).sum::<f64>() / masks.len().max(1) as f64;
    (area > 0.0).then(|| pca.total_variance * share / area)
}

/// Which masks enter the PCA.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Usable {
    /// For each frame, whether it does.
    used: Vec<bool>,
    /// The frames that are looked at; of the others none is used.
    frames: Range<usize>,
    /// Flagged frames that are used because most of the clip is flagged.
    flagged: usize,
    /// Of these, the ones with another flag than that they reach the border.
    uncertain: usize,
}

impl Usable {
    /// A frame is used when its mask is not empty and carries no excluding flag. When that leaves
    /// half of the masks or less (a close shot, a veiled one), or when the user says so, all that
    /// are not empty are used.
    pub(super) fn of(
        masks: &[CroppedMask],
        reports: &[FrameReport],
        flagged: FlaggedFrames,
    ) -> Self {
        let filled: Vec<bool> = masks.iter().map(|m| !m.is_empty()).collect();
        if flagged == FlaggedFrames::Use {
            return Self { frames: 0..filled.len(), used: filled, flagged: 0, uncertain: 0 };
        }
        let flags = |t: usize| reports.get(t).map_or(Flags::NONE, |r| r.flags);
        let sound: Vec<bool> =
            filled.iter().enumerate().map(|(t, f)| *f && !flags(t).exclude()).collect();
        let count = |frames: &[bool]| frames.iter().filter(|f| **f).count();
        if 2 * count(&sound) > count(&filled) {
            return Self { frames: 0..sound.len(), used: sound, flagged: 0, uncertain: 0 };
        }
        let uncertain = |t: &usize| {
            let mut other = flags(*t);
            other.remove(Flag::AtBorder);
            filled[*t] && other.exclude()
        };
        Self {
            flagged: count(&filled) - count(&sound),
            uncertain: (0..filled.len()).filter(uncertain).count(),
            frames: 0..filled.len(),
            used: filled,
        }
    }

    /// The same of some of the frames.
    fn within(
        masks: &[CroppedMask],
        reports: &[FrameReport],
        flagged: FlaggedFrames,
        frames: Range<usize>,
    ) -> Self {
        let reports = reports.get(frames.clone()).unwrap_or_default();
        let own = Self::of(&masks[frames.clone()], reports, flagged);
        let mut used = vec![false; masks.len()];
        used[frames.clone()].copy_from_slice(&own.used);
        Self { used, frames, ..own }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn clip(pattern: &str) -> (Vec<Mask>, Vec<FrameReport>) {
        let masks: Vec<Mask> = pattern
            .chars()
            .map(|c| match c {
                'e' => Mask::new(9, 9),
                'b' => Mask::from_fn(9, 9, |x, y| x < 3 && (3..6).contains(&y)),
                _ => Mask::from_fn(9, 9, |x, y| (3..6).contains(&x) && (3..6).contains(&y)),
            })
            .collect();
        let mut reports: Vec<FrameReport> =
            masks.iter().enumerate().map(|(t, m)| report_of_mask(t, m)).collect();
        for (report, c) in reports.iter_mut().zip(pattern.chars()) {
            match c {
                'o' => report.flags.insert(Flag::Occluded),
                'p' => report.flags.insert(Flag::SeveralPieces),
                _ => {}
            }
        }
        (masks, reports)
    }

    fn cropped(masks: &[Mask]) -> Vec<CroppedMask> {
        masks.iter().map(CroppedMask::from).collect()
    }

    fn usable(pattern: &str, flagged: FlaggedFrames) -> (String, usize, usize) {
        let (masks, reports) = clip(pattern);
        let found = Usable::of(&cropped(&masks), &reports, flagged);
        let used = found.used.iter().map(|u| if *u { '1' } else { '0' }).collect();
        (used, found.flagged, found.uncertain)
    }

    #[test]
    fn flagged_and_empty_masks_are_left_out_unless_most_are() {
        let leave = FlaggedFrames::LeaveOut;
        assert_eq!(usable("wbpeo..", leave), ("1010011".to_owned(), 0, 0));
        assert_eq!(usable("wbbe", leave), ("1110".to_owned(), 2, 0));
        assert_eq!(usable("wbooe", leave), ("11110".to_owned(), 3, 2));
        assert_eq!(usable("wbpeo..", FlaggedFrames::Use), ("1110111".to_owned(), 0, 0));
        assert_eq!(usable("", leave), (String::new(), 0, 0));
    }

    #[test]
    fn a_mask_that_is_left_out_changes_nothing() {
        let disc = |t: usize, radius: f64| {
            let radius = radius + 2.0 * (0.5 * t as f64).sin();
            Mask::from_fn(80, 80, |x, y| (x as f64 - 40.0).hypot(y as f64 - 40.0) < radius)
        };
        let mut masks: Vec<Mask> = (0..40).map(|t| disc(t, 12.0)).collect();
        let mut reports: Vec<FrameReport> =
            masks.iter().enumerate().map(|(t, m)| report_of_mask(t, m)).collect();
        masks[17] = disc(17, 30.0);
        reports[17].flags.insert(Flag::AreaJump);
        let settings = spectrum::Settings::default();
        let analysed = |masks: &[Mask]| {
            let masks = cropped(masks);
            let usable = Usable::of(&masks, &reports, FlaggedFrames::LeaveOut);
            analyse_usable(&masks, usable, 25.0, 2, Trends::default(), &settings).unwrap().0
        };
        let found = analysed(&masks);
        assert!(!found.used[17] && found.used[16]);
        masks[17] = disc(17, 35.0);
        let other = analysed(&masks);
        assert_eq!(found.scores, other.scores);
        assert_eq!(found.windows, other.windows);
        let middle = (found.scores.point(16)[0] + found.scores.point(18)[0]) / 2.0;
        assert!((found.scores.point(17)[0] - middle).abs() < 1e-12);
    }
}
