//! Frames whose area is another one than that of the frames around them: a leg lost in the grass,
//! a shadow or a neighbour caught for some frames.

use super::frame_report::{Flag, FrameReport};
use crate::numeric::{median, robust_deviation};

/// Smallest jump that counts: a second difference of ln(area) of .15 is an area 7.5 % off the
/// middle of its neighbours. True masks of a camel, a flamingo, a rhino and a jumping horse at 24
/// frames a second stay at .054 or less; the thirteen plates of Muybridge's gallop reach .152, which
/// the clip's own range forgives.
const LEAST_JUMP: f64 = 0.15;

/// And in robust deviations of the clip's own second differences: a shot whose areas are all noisy
/// has a wider range.
const LEAST_DEVIATIONS: f64 = 4.0;

/// How far a neighbour may be, frames: over a longer gap the animal may have changed its shape.
const FARTHEST: usize = 4;

/// A spread of the second differences needs so many of them.
const LEAST_FRAMES: usize = 8;

/// Frames whose area jumps, ascending.
///
/// With a_t = ln(area) the second difference of frame t is 2 (a_t − b_t), where b_t is the line from
/// the nearest sound frame before to the nearest one after, at most four frames away; with
/// both neighbours at hand that is −(a_{t−1} − 2 a_t + a_{t+1}). A frame jumps when this is over
/// .15 and over 4 robust deviations of the clip (1.4826 times the median distance from the
/// median). Jumps are taken one after the other, first the one farthest from the median area of the
/// frames about it: without it, its sound neighbours jump no more, and a run of up to four odd
/// frames is found as a whole.
///
/// Frames with an excluding flag and corrected ones are left out, as if they were not there: of the
/// first the area says nothing, and the second are as they are because a person said so.
#[must_use]
pub fn area_jumps(reports: &[FrameReport]) -> Vec<usize> {
    let mut log_areas: Vec<Option<f64>> =
        reports.iter().map(|r| is_judged(r).then(|| (r.area_px as f64).ln())).collect();
    let differences: Vec<f64> =
        (0..log_areas.len()).filter_map(|t| second_difference(&log_areas, t)).collect();
    if differences.len() < LEAST_FRAMES {
        return Vec::new();
    }
    let least = LEAST_JUMP.max(LEAST_DEVIATIONS * robust_deviation(&differences));
    let mut jumps = Vec::new();
    while let Some(t) = farthest_jump(&log_areas, least) {
        log_areas[t] = None;
        jumps.push(t);
    }
    jumps.sort_unstable();
    jumps
}

/// Flags the frames that [`area_jumps`] finds.
pub fn flag_area_jumps(reports: &mut [FrameReport]) {
    for t in area_jumps(reports) {
        reports[t].flags.insert(Flag::AreaJump);
    }
}

fn is_judged(report: &FrameReport) -> bool {
    report.area_px > 0 && !report.is_excluded() && !report.flags.contains(Flag::Corrected)
}

fn farthest_jump(log_areas: &[Option<f64>], least: f64) -> Option<usize> {
    (0..log_areas.len())
        .filter(|&t| second_difference(log_areas, t).is_some_and(|d| d.abs() > least))
        .map(|t| (t, from_median(log_areas, t)))
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .map(|(t, _)| t)
}

/// Twice the distance of frame `t` from the line between its neighbours.
fn second_difference(log_areas: &[Option<f64>], t: usize) -> Option<f64> {
    let own = log_areas[t]?;
    let reach = 1..=FARTHEST;
    let (before, left) =
        reach.clone().filter(|d| *d <= t).find_map(|d| log_areas[t - d].map(|a| (d as f64, a)))?;
    let (after, right) = reach
        .filter(|d| t + d < log_areas.len())
        .find_map(|d| log_areas[t + d].map(|a| (d as f64, a)))?;
    Some(2.0 * (own - (left * after + right * before) / (before + after)))
}

/// Distance of frame `t` from the median of the frames about it.
fn from_median(log_areas: &[Option<f64>], t: usize) -> f64 {
    let first = t.saturating_sub(FARTHEST);
    let last = (t + FARTHEST).min(log_areas.len() - 1);
    let about: Vec<f64> = log_areas[first..=last].iter().copied().flatten().collect();
    log_areas[t].map_or(0.0, |own| (own - median(&about)).abs())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::silhouette::Flags;

    /// A gallop's area: 8 % up and down, twelve frames a stride, some noise.
    fn clip(factor: impl Fn(usize) -> f64) -> Vec<FrameReport> {
        (0..60)
            .map(|frame| {
                let phase = std::f64::consts::TAU * frame as f64 / 12.0;
                let noise = ((frame * 7919) % 13) as f64 / 13.0 - 0.5;
                let area = 9000.0 * (1.0 + 0.08 * phase.sin() + 0.01 * noise) * factor(frame);
                FrameReport {
                    frame,
                    area_px: area.round() as usize,
                    centre_px: None,
                    confidence: 1.0,
                    flags: Flags::NONE,
                }
            })
            .collect()
    }

    fn among(frames: &[usize], factor: f64) -> Vec<FrameReport> {
        clip(|t| if frames.contains(&t) { factor } else { 1.0 })
    }

    #[test]
    fn a_plain_gallop_does_not_jump() {
        assert!(area_jumps(&clip(|_| 1.0)).is_empty());
        assert!(area_jumps(&[]).is_empty());
        assert!(area_jumps(&clip(|_| 1.0)[..3]).is_empty());
    }

    #[test]
    fn single_frames_and_short_runs_are_found_without_their_neighbours() {
        for factor in [0.7, 1.4] {
            for odd in [&[20][..], &[20, 21], &[20, 21, 22], &[5, 31, 32, 33, 34]] {
                assert_eq!(area_jumps(&among(odd, factor)), odd, "{factor}");
            }
        }
    }

    #[test]
    fn a_change_that_stays_marks_a_few_frames_only() {
        let found = area_jumps(&clip(|t| if t < 30 { 1.0 } else { 1.5 }));
        assert!(!found.is_empty() && found.len() <= 2 * FARTHEST, "{found:?}");
        assert!(found.iter().all(|t| t.abs_diff(30) <= 2 * FARTHEST), "{found:?}");
    }

    #[test]
    fn a_noisy_clip_has_a_wider_range() {
        let noisy = clip(|t| if t % 2 == 0 { 1.0 } else { 1.12 });
        assert!(area_jumps(&noisy).is_empty());
    }

    #[test]
    fn flagged_and_corrected_frames_are_left_out() {
        let mut reports = among(&[20, 40], 0.5);
        reports[20].flags.insert(Flag::AtBorder);
        reports[40].flags.insert(Flag::Corrected);
        assert!(area_jumps(&reports).is_empty());
        let mut reports = among(&[20], 0.5);
        flag_area_jumps(&mut reports);
        let flagged: Vec<usize> =
            reports.iter().filter(|r| r.is_excluded()).map(|r| r.frame).collect();
        assert_eq!(flagged, [20]);
    }
}
