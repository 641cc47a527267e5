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

/// A spell that breaks off for at most so many frames is one: two animals of a size that pass one
/// another show as one while the nearer hides the farther.
const BREAK_FRAMES: usize = 12;

/// Rounds in which what is usual is seen without the frames that were found odd.
const ROUNDS: usize = 6;

/// Flags the frames from where the area falls under the usual one until it is the usual one again,
/// where it falls far under it or nothing is seen at all in between.
///
/// Frames with an excluding flag and corrected ones get no flag.
pub fn flag_occlusions(reports: &mut [FrameReport]) {
    let way = |share: f64| Share { odd: share < MISSING, usual: share >= WHOLE };
    flag_spells(reports, Flag::Occluded, way);
}

/// Flags the frames from where the area rises over the usual one until it is the usual one again,
/// where it rises far over it in between. Frames are judged as by [`flag_occlusions`].
pub fn flag_companions(reports: &mut [FrameReport]) {
    flag_spells(reports, Flag::Joined, |share| Share {
        odd: share > JOINED,
        usual: share <= ALONE,
    });
}

/// What a share of the usual area says.
#[derive(Clone, Copy)]
struct Share {
    odd: bool,
    usual: bool,
}

fn flag_spells(reports: &mut [FrameReport], flag: Flag, way: impl Fn(f64) -> Share) {
    let mut odd = vec![false; reports.len()];
    for _ in 0..ROUNDS {
        let shares: Vec<Option<Share>> =
            (0..reports.len()).map(|t| share(reports, &odd, t).map(&way)).collect();
        let found = spells(reports, flag, &shares);
        if found == odd {
            break;
        }
        odd = found;
    }
    for (report, _) in reports.iter_mut().zip(odd).filter(|(r, odd)| *odd && is_judged(r)) {
        report.flags.insert(flag);
    }
}

/// The frames of spells: runs of frames that are not usual, of which one is odd, between two that are
/// usual.
fn spells(reports: &[FrameReport], flag: Flag, shares: &[Option<Share>]) -> Vec<bool> {
    let n = reports.len();
    let is_usual = |t: usize| shares[t].is_some_and(|s| s.usual);
    // Where nothing is seen the animal may be covered, but no other one joins it.
    let gone = |t: usize| flag == Flag::Occluded && is_gone(&reports[t]);
    let is_odd = |t: usize| gone(t) || shares[t].is_some_and(|s| s.odd);
    let mut odd = vec![false; n];
    let mut before: Option<usize> = None;
    for after in (0..n).filter(|t| is_usual(*t)) {
        let run = before.map_or(0, |b| b + 1)..after;
        let short = run.len() <= 2 * USUAL_FRAMES;
        if before.is_some() && short && run.clone().any(is_odd) {
            odd[run].fill(true);
        }
        before = Some(after);
    }
    let mut last: Option<usize> = None;
    for t in (0..n).filter(|t| odd[*t]).collect::<Vec<_>>() {
        if let Some(last) = last.filter(|last| t - last <= BREAK_FRAMES + 1) {
            odd[last..t].fill(true);
        }
        last = Some(t);
    }
    odd
}

fn is_judged(report: &FrameReport) -> bool {
    report.area_px > 0 && !report.is_excluded() && !report.flags.contains(Flag::Corrected)
}

fn is_gone(report: &FrameReport) -> bool {
    report.flags.contains(Flag::Empty) || report.flags.contains(Flag::Lost)
}

/// The area of a frame as a share of what is usual about it, the odd frames left out.
fn share(reports: &[FrameReport], odd: &[bool], t: usize) -> Option<f64> {
    let own = reports.get(t).filter(|r| is_judged(r))?.area_px as f64;
    let near = t.saturating_sub(USUAL_FRAMES)..(t + USUAL_FRAMES + 1).min(reports.len());
    let of = |all: bool| -> Vec<f64> {
        let seen = near.clone().filter(|&s| reports[s].area_px > 0 && (all || !odd[s]));
        seen.map(|s| reports[s].area_px as f64).collect()
    };
    let areas = Some(of(false)).filter(|areas| !areas.is_empty()).unwrap_or_else(|| of(true));
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
