//! A clip in which the motion changes: cut into segments, each judged for itself, one chosen.

use std::ops::Range;

use super::analysis::{MaskAnalysis, MaskClip};
use super::bridge::bridged;
use crate::error::{Error, Result};
use crate::gait::{GaitPhase, Repeats, stretches};
use crate::shot::{SegmentChoice, StoredSegment, number, table};
use crate::spectrum::{self, SpectralAnalysis, Verdict};

/// A stretch of the clip and what can be said of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Segment {
    /// Its frames.
    pub frames: Range<usize>,
    /// What was found when it was analysed by itself; `None` where nothing repeats.
    pub gait: Option<SegmentGait>,
}

/// The gait of a segment.
#[derive(Clone, Debug, PartialEq)]
pub struct SegmentGait {
    /// The verdict.
    pub verdict: Verdict,
    /// Repeats of the silhouette.
    pub cycles: f64,
    /// Frames from one repeat to the next.
    pub step_frames: f64,
    /// Frames a stride; `None` while it is not known.
    pub stride_frames: Option<f64>,
    /// Share of the variance that the cycle explains; `None` without a phase.
    pub explained_share: Option<f64>,
}

impl Segment {
    pub(super) fn of(
        frames: Range<usize>,
        spectral: &SpectralAnalysis,
        gait: Option<&GaitPhase>,
    ) -> Self {
        let gait = SegmentGait {
            verdict: spectral.diagnosis.verdict,
            cycles: spectral.diagnosis.cycles,
            step_frames: spectral.rhythm.step_frames,
            stride_frames: gait
                .filter(|g| g.stride.repeats != Repeats::Unknown)
                .and(spectral.rhythm.stride_frames),
            explained_share: gait.map(|g| g.explained_share),
        };
        Self { frames, gait: Some(gait) }
    }
}

/// Cuts a clip into segments, analyses each in which a gait repeats, and gives the analysis of the chosen one, with
/// all segments. By default that is the one with the best verdict, of equal ones the one that lasts longest.
///
/// # Errors
/// As [`analyse_masks`](super::analyse_masks); [`Error::Setting`] for a segment that is not there or in which nothing
/// repeats.
pub fn analyse_segments(
    clip: &MaskClip,
    settings: &spectrum::Settings,
    choice: SegmentChoice,
) -> Result<MaskAnalysis> {
    let (whole, all) = clip.analysed(0..clip.masks.len(), settings)?;
    if choice == SegmentChoice::Whole {
        return Ok(whole);
    }
    let scores = bridged(&all.scores, &whole.used);
    let parts = stretches(&scores, &all.variance_shares(), &whole.used);
    if parts.len() < 2 {
        return match choice {
            SegmentChoice::Number(number) if number > 1 => Err(absent(number, 1)),
            _ => Ok(whole),
        };
    }
    let mut found: Vec<Option<MaskAnalysis>> = Vec::new();
    for part in &parts {
        // Too few frames of a steady stretch may be seen for an analysis of its own.
        let analysed = part.steady.then(|| clip.analysed(part.frames.clone(), settings).ok());
        found.push(analysed.flatten().map(|(analysis, _)| analysis));
    }
    let segments: Vec<Segment> = (parts.iter().zip(&found))
        .map(|(part, analysis)| Segment {
            frames: part.frames.clone(),
            gait: analysis.as_ref().and_then(|a| a.segments.first()?.gait.clone()),
        })
        .collect();
    let at = match choice {
        SegmentChoice::Number(number) if number > segments.len() => {
            return Err(absent(number, segments.len()));
        }
        SegmentChoice::Number(number) => Some(number.saturating_sub(1)),
        _ => best(&segments),
    };
    match at.map(|at| (at, found.swap_remove(at))) {
        Some((_, Some(analysis))) => Ok(MaskAnalysis { segments, ..analysis }),
        Some((at, None)) => Err(Error::setting(
            "analysis.segment",
            &format!("is a segment in which a gait repeats; in segment {} nothing does", at + 1),
        )),
        None => Ok(whole),
    }
}

fn absent(number: usize, there: usize) -> Error {
    Error::setting("analysis.segment", &format!("is 1 to {there} for this clip, not {number}"))
}

/// The segment to work with.
fn best(segments: &[Segment]) -> Option<usize> {
    let rank = |at: &usize| {
        let gait = segments[*at].gait.as_ref();
        gait.map(|g| (std::cmp::Reverse(g.verdict), segments[*at].frames.len()))
    };
    (0..segments.len())
        .filter(|at| segments[*at].gait.is_some())
        // The first of equal ones.
        .rev()
        .max_by_key(rank)
}

/// The phase of a clip's frames from `first` on, spread over a clip of `frames` frames: held outside, and not
/// trusted there.
pub(super) fn lengthened(gait: GaitPhase, first: usize, frames: usize) -> GaitPhase {
    let last = gait.stride_cycles.len().saturating_sub(1);
    let spread = |own: &[f64]| -> Vec<f64> {
        (0..frames).map(|t| own[t.saturating_sub(first).min(last)]).collect()
    };
    let inside = |t: usize| t >= first && t - first <= last;
    GaitPhase {
        stride_cycles: spread(&gait.stride_cycles),
        deviation_cycles: spread(&gait.deviation_cycles),
        amplitude: spread(&gait.amplitude),
        trust: (0..frames).map(|t| if inside(t) { gait.trust[t - first] } else { 0.0 }).collect(),
        ..gait
    }
}

/// The segments as `diagnosis.json` has them.
pub(super) fn stored_segments(found: &MaskAnalysis) -> Vec<StoredSegment> {
    let line = |(at, segment): (usize, &Segment)| {
        let gait = segment.gait.as_ref();
        StoredSegment {
            segment: at + 1,
            first_frame: segment.frames.start,
            last_frame: segment.frames.end - 1,
            chosen: segment.frames == found.frames,
            verdict: gait.map(|g| g.verdict.to_string()),
            cycles: gait.map(|g| g.cycles),
            step_frames: gait.map(|g| g.step_frames),
            stride_frames: gait.and_then(|g| g.stride_frames),
            explained_share: gait.and_then(|g| g.explained_share),
        }
    };
    found.segments.iter().enumerate().map(line).collect()
}

/// `analysis/segments.csv`.
pub(super) fn segments_csv(segments: &[StoredSegment]) -> String {
    let header = [
        "segment",
        "first_frame",
        "last_frame",
        "chosen",
        "verdict",
        "cycles",
        "step_frames",
        "stride_frames",
        "explained_share",
    ];
    let cell = |value: Option<f64>| value.map(number).unwrap_or_default();
    let rows = segments.iter().map(|s| {
        vec![
            s.segment.to_string(),
            s.first_frame.to_string(),
            s.last_frame.to_string(),
            u8::from(s.chosen).to_string(),
            s.verdict.clone().unwrap_or_else(|| "no gait".to_owned()),
            cell(s.cycles),
            cell(s.step_frames),
            cell(s.stride_frames),
            cell(s.explained_share),
        ]
    });
    table(&header.map(str::to_owned), rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn segment(frames: Range<usize>, verdict: Option<Verdict>) -> Segment {
        let gait = verdict.map(|verdict| SegmentGait {
            verdict,
            cycles: 3.0,
            step_frames: 10.0,
            stride_frames: None,
            explained_share: None,
        });
        Segment { frames, gait }
    }

    #[test]
    fn the_best_verdict_comes_before_length_and_length_before_order() {
        use Verdict::{Doubtful, Unusable, Usable};
        let clip = |verdicts: [(usize, Option<Verdict>); 4]| {
            let mut at = 0;
            let all: Vec<Segment> = verdicts
                .map(|(length, verdict)| {
                    at += length;
                    segment(at - length..at, verdict)
                })
                .to_vec();
            best(&all)
        };
        let (usable, doubtful, unusable) = (Some(Usable), Some(Doubtful), Some(Unusable));
        assert_eq!(clip([(90, doubtful), (40, usable), (99, None), (50, usable)]), Some(3));
        assert_eq!(clip([(90, doubtful), (99, None), (90, doubtful), (10, unusable)]), Some(0));
        assert_eq!(clip([(9, None); 4]), None);
    }
}
