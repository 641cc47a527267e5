//! `muybridge analyze`.

use muybridge::shot::{FlaggedFrames, StoredDiagnosis, StoredSegment};
use muybridge::spectrum::Gait;
use muybridge::work;

use super::{open, options};
use crate::Ending;
use crate::args::{Analyze, Flagged, GaitSymmetry};
use crate::output::Output;
use crate::terminal::Bars;
use crate::usage;

pub(crate) fn execute(args: &Analyze, output: &Output, bars: &Bars) -> anyhow::Result<Ending> {
    let (mut shot, _lock) = open(&args.stage)?;
    if let Some(gait) = args.gait {
        shot.settings.analysis.gait = named_gait(gait);
        shot.save_settings()?;
    }
    if let Some(flagged) = args.flagged {
        shot.settings.analysis.flagged_frames = match flagged {
            Flagged::LeaveOut => FlaggedFrames::LeaveOut,
            Flagged::Use => FlaggedFrames::Use,
        };
        shot.save_settings()?;
    }
    if let Some(segment) = &args.segment {
        shot.settings.analysis.segment = segment
            .parse()
            .map_err(|_| usage::wrong("--segment", segment, "auto, whole, or a number from 1"))?;
        shot.save_settings()?;
    }
    let result = work::analyze(&shot, options(bars, args.stage.force))?;
    bars.finish();
    output.kept(&result.outcome.kept);
    output.result(&result.diagnosis, &text(&result.diagnosis))?;
    Ok(ending(&result.diagnosis, args.strict))
}

/// A range of amplitudes wider than this is told.
const TOLD_AMPLITUDE: f64 = 0.05;

/// The library's word for a gait.
pub(crate) fn named_gait(gait: GaitSymmetry) -> Gait {
    match gait {
        GaitSymmetry::Unknown => Gait::Unknown,
        GaitSymmetry::Symmetric => Gait::Symmetric,
        GaitSymmetry::Asymmetric => Gait::Asymmetric,
        GaitSymmetry::Walk => Gait::Walk,
        GaitSymmetry::Trot => Gait::Trot,
        GaitSymmetry::Pace => Gait::Pace,
        GaitSymmetry::Amble => Gait::Amble,
        GaitSymmetry::Canter => Gait::Canter,
        GaitSymmetry::Gallop => Gait::Gallop,
        GaitSymmetry::Bound => Gait::Bound,
    }
}

/// An unusable clip is an answer; under `--strict` it has an exit code of its own.
pub(crate) fn ending(diagnosis: &StoredDiagnosis, strict: bool) -> Ending {
    if strict && diagnosis.verdict == "unusable" { Ending::Unusable } else { Ending::Done }
}

/// The segments of a clip that has more than one.
fn segments_text(segments: &[StoredSegment]) -> String {
    if segments.len() < 2 {
        return String::new();
    }
    let mut text = String::from("the motion changes: segments of the clip\n");
    for s in segments {
        let found = match (&s.verdict, s.cycles, s.step_frames) {
            (Some(verdict), Some(cycles), Some(step)) => {
                format!("{verdict}, repeats every {step:.2} frames, {cycles:.1} times")
            }
            _ => "nothing repeats".to_owned(),
        };
        let mark = if s.chosen { "  <- what follows is of this one" } else { "" };
        text.push_str(&format!(
            "  {}  frames {} to {}: {found}{mark}\n",
            s.segment, s.first_frame, s.last_frame
        ));
    }
    text.push_str("--segment K takes another, --segment whole the clip as it is\n");
    text
}

pub(crate) fn text(d: &StoredDiagnosis) -> String {
    let mut text = segments_text(&d.segments);
    text.push_str(&format!("verdict: {}\n", d.verdict));
    for reason in &d.reasons {
        text.push_str(&format!("  - {reason}\n"));
    }
    if !d.advice.is_empty() {
        text.push_str("what to try:\n");
        for advice in &d.advice {
            text.push_str(&format!("  - {advice}\n"));
        }
    }
    text.push_str(&format!(
        "silhouette repeats: {:.3} Hz, every {:.2} frames, {:.1} times in {} frames\n",
        d.step_hz,
        d.step_frames,
        d.cycles,
        d.animated_frames().len()
    ));
    text.push_str(&match (d.stride_hz, d.stride_frames) {
        (Some(hz), Some(frames)) => {
            let how = match d.stride_basis.as_str() {
                "given" => "as the gait was named",
                "two_steps_seen" => "the back goes up and down twice in it",
                _ => "seen in the spectrum",
            };
            format!("stride: {hz:.3} Hz, {frames:.2} frames ({how})\n")
        }
        _ => format!(
            "stride: {:.3} Hz if left and right do the same half a stride apart (walk, trot), {:.3} Hz if not (canter, gallop); --gait says which\n",
            d.stride_candidates_hz[0], d.stride_candidates_hz[1]
        ),
    });
    if let Some([least, most]) = d.stride.as_ref().map(|s| s.amplitude_range)
        && most - least > TOLD_AMPLITUDE
    {
        text.push_str(&format!(
            "strides are of unlike size, {least:.2} to {most:.2} of the mean: the poses follow (animation.amplitude)\n"
        ));
    }
    text.push_str("component  variance  r      peak\n");
    for (c, line) in d.components.iter().enumerate() {
        text.push_str(&format!(
            "PC{:<8} {:>6.1} %  {:<5.2}  {:.3} Hz\n",
            c + 1,
            100.0 * line.variance_share,
            line.r,
            line.peak_hz
        ));
    }
    if let Some(trend) = d.scale_trend.filter(|t| t.removed) {
        text.push_str(&format!(
            "a slow change of size by a factor of {:.2} was removed\n",
            trend.change
        ));
    }
    if let Some(drift) = d.shape_drift.filter(|d| d.removed) {
        text.push_str(&format!(
            "slow changes of shape, {:.0} % of the silhouettes' variation, were removed\n",
            100.0 * drift.share
        ));
    }
    text
}
