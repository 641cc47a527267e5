//! Clips in which the motion changes: acts of a rig's (or the built-in horse's) clips, one after the
//! other, rendered as masks.

use std::path::Path;

use muybridge::mask::{CroppedMask, Mask};
use muybridge::pipeline::{MaskAnalysis, MaskClip, Trends, analyse_segments};
use muybridge::rig::{Driven, File, Pose};
use muybridge::shot::{FlaggedFrames, SegmentChoice};
use muybridge::silhouette::{flag_area_jumps, report_of_mask};
use muybridge::spectrum::Settings;
use muybridge::synthetic::{Gait, horse};
use muybridge::validate::{Shooting, Truth};

/// One stretch of the motion.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Act<'a> {
    /// A clip that repeats: name, frames, frames a cycle.
    Cycle(&'a str, usize, f64),
    /// The same, from where the last one that repeats was.
    Onward(&'a str, usize, f64),
    /// The pose of the frame before, held.
    Hold(usize),
    /// A clip from its beginning to its end in so many frames.
    Once(&'a str, usize),
}

#[allow(dead_code, reason = "each of those who use this file needs a part of it")]
impl Act<'_> {
    /// How long it is.
    pub(crate) fn frames(&self) -> usize {
        match *self {
            Act::Cycle(_, frames, _)
            | Act::Onward(_, frames, _)
            | Act::Hold(frames)
            | Act::Once(_, frames) => frames,
        }
    }
}

/// The motion of `acts` on a rig, or on the built-in horse where `rig` is `None` (clips are then its
/// gaits, and nothing is played once).
pub(crate) fn truth(rig: Option<&Path>, acts: &[Act]) -> anyhow::Result<Truth> {
    let mut poses: Vec<Pose> = Vec::new();
    let mut phases = Vec::new();
    let (model, driven) = match rig {
        Some(path) => {
            let file = File::read(path)?;
            let mut driven = Vec::new();
            for act in acts {
                match *act {
                    Act::Hold(frames) => hold(&mut poses, &mut phases, frames),
                    Act::Cycle(clip, frames, period) | Act::Onward(clip, frames, period) => {
                        let animation = file.animation(clip)?;
                        driven = animation.driven(file.skeleton());
                        let start = beginning(*act, &phases);
                        for t in 0..frames {
                            let at = start + t as f64 / period;
                            let s = at.fract() * animation.duration_s();
                            poses.push(animation.sample(file.skeleton(), s));
                            phases.push(at);
                        }
                    }
                    Act::Once(clip, frames) => {
                        let animation = file.animation(clip)?;
                        for t in 0..frames {
                            let at = t as f64 / frames as f64;
                            poses.push(
                                animation.sample(file.skeleton(), at * animation.duration_s()),
                            );
                            phases.push(f64::NAN);
                        }
                    }
                }
            }
            (file.model()?, driven)
        }
        None => {
            let model = horse();
            for act in acts {
                match *act {
                    Act::Cycle(gait, frames, period) | Act::Onward(gait, frames, period) => {
                        let gait: Gait = gait.parse()?;
                        let start = beginning(*act, &phases);
                        for t in 0..frames {
                            let at = start + t as f64 / period;
                            poses.push(gait.pose(&model.skeleton, at).pose);
                            phases.push(at);
                        }
                    }
                    Act::Hold(frames) | Act::Once(_, frames) => {
                        hold(&mut poses, &mut phases, frames);
                    }
                }
            }
            let driven = (0..model.skeleton.nodes.len())
                .map(|n| Driven { translation: n == 0, rotation: n > 0, scale: false })
                .collect();
            (model, driven)
        }
    };
    Ok(Truth { model, driven, poses, phases_cycles: phases, in_plane_rad: None })
}

/// Cycles at an act's first frame.
fn beginning(act: Act, phases: &[f64]) -> f64 {
    let Act::Onward(_, _, period) = act else { return 0.0 };
    phases.iter().rfind(|p| p.is_finite()).map_or(0.0, |last| last + 1.0 / period)
}

fn hold(poses: &mut Vec<Pose>, phases: &mut Vec<f64>, frames: usize) {
    let Some(last) = poses.last().cloned() else { return };
    poses.extend(std::iter::repeat_n(last, frames));
    phases.extend(std::iter::repeat_n(f64::NAN, frames));
}

/// The masks of a motion.
pub(crate) fn masks(truth: &Truth, shooting: &Shooting) -> Vec<Mask> {
    truth.masks(&Shooting { frames: truth.poses.len(), ..shooting.clone() })
}

/// Masks at 25 frames a second, cut into segments as the pipeline does it by default.
pub(crate) fn segmented(masks: &[Mask], choice: SegmentChoice) -> muybridge::Result<MaskAnalysis> {
    let mut reports: Vec<_> =
        masks.iter().enumerate().map(|(t, mask)| report_of_mask(t, mask)).collect();
    flag_area_jumps(&mut reports);
    let cropped: Vec<CroppedMask> = masks.iter().map(CroppedMask::from).collect();
    let clip = MaskClip {
        masks: &cropped,
        reports: &reports,
        flagged: FlaggedFrames::LeaveOut,
        fps: 25.0,
        components: 5,
        trends: Trends::default(),
    };
    analyse_segments(&clip, &Settings::default(), choice)
}
