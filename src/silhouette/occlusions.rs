//! Frames in which a part of the animal is missing for a while (a tree it walks behind, another animal
//! in front of it) or in which something more is taken for it (another animal that touches it).

use super::frame_report::{Flag, FrameReport};
use crate::numeric::median;

/// What is usual is the median over this many frames before and after: what lasts for less than as many
/// frames is seen against it.
const USUAL_FRAMES: usize = 36;

/// Under this share of the usual area a part is missing, and above the other something is taken
/// along. A gait changes the area by a tenth or so: true masks of a camel, a flamingo, a rhino and a
/// jumping horse stay between .80 and 1.19 of it.
const MISSING: f64 = 0.7;
const JOINED: f64 = 1.4;

/// Between these shares it is the usual animal again: one that shrinks, or turns away for good, never
/// is.
const WHOLE: f64 = 0.85;
const ALONE: f64 = 1.15;

/// Flags the frames whose area is far under the usual one, where it was whole before and is after.
///
/// Frames with an excluding flag and corrected ones say nothing and are not judged.
pub fn flag_occlusions(reports: &mut [FrameReport]) {
    flag_spells(reports, Flag::Occluded, |share| share < MISSING, |share| share >= WHOLE);
}

/// Flags the frames whose area is far over the usual one, where it was the animal's own before and is
/// after. Frames are judged as by [`flag_occlusions`].
pub fn flag_companions(reports: &mut [FrameReport]) {
    flag_spells(reports, Flag::Joined, |share| share > JOINED, |share| share <= ALONE);
}

/// Flags the frames whose share of the usual area is `odd`, where it was `usual` before and is after.
fn flag_spells(
    reports: &mut [FrameReport],
    flag: Flag,
    odd: impl Fn(f64) -> bool,
    usual: impl Fn(f64) -> bool,
) {
    let shares: Vec<Option<f64>> = (0..reports.len()).map(|t| share(reports, t)).collect();
    let is_usual = |t: usize| shares[t].is_some_and(&usual);
    for t in 0..reports.len() {
        let near = t.saturating_sub(USUAL_FRAMES)..(t + USUAL_FRAMES + 1).min(reports.len());
        let passes = (near.start..t).any(is_usual) && (t + 1..near.end).any(is_usual);
        if passes && shares[t].is_some_and(&odd) {
            reports[t].flags.insert(flag);
        }
    }
}

/// The area of a frame as a share of what is usual about it.
fn share(reports: &[FrameReport], t: usize) -> Option<f64> {
    let judged =
        |r: &FrameReport| r.area_px > 0 && !r.is_excluded() && !r.flags.contains(Flag::Corrected);
    let own = reports.get(t).filter(|r| judged(r))?.area_px as f64;
    let near = t.saturating_sub(USUAL_FRAMES)..(t + USUAL_FRAMES + 1).min(reports.len());
    let areas: Vec<f64> =
        reports[near].iter().filter(|r| r.area_px > 0).map(|r| r.area_px as f64).collect();
    Some(own / median(&areas))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::silhouette::Flags;

    /// A walk of 120 frames whose area swings by a tenth, times `factor`.
    fn clip(factor: impl Fn(usize) -> f64) -> Vec<FrameReport> {
        (0..120)
            .map(|frame| {
                let swing = 1.0 + 0.1 * (std::f64::consts::TAU * frame as f64 / 12.0).sin();
                FrameReport {
                    frame,
                    area_px: (8000.0 * swing * factor(frame)).round() as usize,
                    centre_px: None,
                    confidence: 1.0,
                    flags: Flags::NONE,
                }
            })
            .collect()
    }

    fn flagged(mut reports: Vec<FrameReport>, flag: Flag) -> Vec<usize> {
        flag_occlusions(&mut reports);
        flag_companions(&mut reports);
        reports.iter().filter(|r| r.flags.contains(flag)).map(|r| r.frame).collect()
    }

    #[test]
    fn a_tree_that_hides_half_of_it_is_seen_for_as_long_as_it_does() {
        for (from, to) in [(40, 45), (40, 65), (3, 20)] {
            let behind = |t: usize| if (from..to).contains(&t) { 0.5 } else { 1.0 };
            assert_eq!(flagged(clip(behind), Flag::Occluded), (from..to).collect::<Vec<_>>());
        }
    }

    #[test]
    fn another_animal_that_touches_it_is_seen_for_as_long_as_it_does() {
        for (from, to) in [(40, 45), (40, 65), (3, 20)] {
            let beside = |t: usize| if (from..to).contains(&t) { 1.7 } else { 1.0 };
            assert_eq!(flagged(clip(beside), Flag::Joined), (from..to).collect::<Vec<_>>());
        }
    }

    #[test]
    fn a_gait_a_retreat_and_a_lasting_change_are_not_taken_for_one() {
        for flag in [Flag::Occluded, Flag::Joined] {
            assert!(flagged(clip(|_| 1.0), flag).is_empty());
            assert!(flagged(clip(|t| 1.0 - 0.006 * t as f64), flag).is_empty());
            assert!(flagged(clip(|t| 1.0 + 0.012 * t as f64), flag).is_empty());
            for lasting in [0.5, 2.0] {
                let change = |t: usize| if t < 60 { 1.0 } else { lasting };
                assert!(flagged(clip(change), flag).is_empty());
            }
        }
    }

    #[test]
    fn frames_that_are_excluded_already_or_corrected_are_left_alone() {
        let mut reports = clip(|t| if (50..60).contains(&t) { 0.5 } else { 1.0 });
        reports[52].flags.insert(Flag::AtBorder);
        reports[53].flags.insert(Flag::Corrected);
        assert_eq!(flagged(reports, Flag::Occluded), [50, 51, 54, 55, 56, 57, 58, 59]);
    }
}
