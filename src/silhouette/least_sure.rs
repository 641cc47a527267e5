//! Which frame a correction is worth most in.

use super::frame_report::{Flag, FrameReport};

/// An outline as sure as this is not worth a correction.
const SURE: f64 = 0.95;

/// Frames either way that a correction is felt over.
pub(super) const CARRIED_FRAMES: f64 = 12.0;

/// The frame whose correction is worth most: the one in the middle of what the outlines are least
/// sure of, the first of equals. `None` when all are sure enough.
///
/// A correction is carried to the frames around it, so the doubt about those counts too, less the
/// further they are (12 frames either way), and doubt near a frame that has been
/// corrected already counts the less the nearer it is. A frame that jumps is doubted most. Not worth
/// a correction are frames that have one, that are cut by the border (what is outside cannot be
/// drawn), and empty ones before the animal comes and after it has left.
#[must_use]
pub fn least_sure(reports: &[FrameReport]) -> Option<usize> {
    let seen = |r: &FrameReport| r.area_px > 0;
    let first = reports.iter().position(seen)?;
    let last = reports.iter().rposition(seen)?;
    let reports = &reports[first..=last];
    let jumps = |r: &FrameReport| r.flags.contains(Flag::AreaJump);
    let sureness = |r: &FrameReport| if jumps(r) { 0.5 * r.confidence } else { r.confidence };
    let corrected: Vec<usize> =
        reports.iter().filter(|r| r.flags.contains(Flag::Corrected)).map(|r| r.frame).collect();
    let doubt = |r: &FrameReport| {
        let nearest = corrected.iter().map(|c| c.abs_diff(r.frame)).min();
        let new = nearest.map_or(1.0, |frames| (frames as f64 / CARRIED_FRAMES).min(1.0));
        (1.0 - sureness(r)) * new
    };
    let doubts: Vec<(usize, f64)> = reports.iter().map(|r| (r.frame, doubt(r))).collect();
    let worth = |r: &FrameReport| -> f64 {
        let share = |frame: usize| 1.0 - frame.abs_diff(r.frame) as f64 / CARRIED_FRAMES;
        doubts.iter().map(|&(frame, doubt)| share(frame).max(0.0) * doubt).sum()
    };
    let can_be_mended =
        |r: &&FrameReport| !r.flags.contains(Flag::Corrected) && !r.flags.contains(Flag::AtBorder);
    let mut best: Option<(f64, usize)> = None;
    for report in reports.iter().filter(can_be_mended) {
        let worth = worth(report);
        if sureness(report) < SURE && best.is_none_or(|(most, _)| worth > most) {
            best = Some((worth, report.frame));
        }
    }
    best.map(|(_, frame)| frame)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::silhouette::Flags;

    #[test]
    fn the_least_sure_frame_is_one_that_can_be_mended() {
        let report = |(frame, &(confidence, flag)): (usize, &(f64, Option<Flag>))| FrameReport {
            frame,
            area_px: if confidence > 0.0 { 100 } else { 0 },
            centre_px: None,
            confidence,
            flags: flag.into_iter().collect(),
        };
        let reports = |all: &[(f64, Option<Flag>)]| -> Vec<FrameReport> {
            all.iter().enumerate().map(report).collect()
        };
        let sure = (0.96, None);
        let empty = (0.0, Some(Flag::Empty));
        assert_eq!(least_sure(&reports(&[])), None);
        assert_eq!(least_sure(&reports(&[empty, empty])), None);
        assert_eq!(least_sure(&reports(&[empty, sure, sure, empty])), None);
        assert_eq!(least_sure(&reports(&[empty, sure, empty, sure, sure])), Some(2));
        let cut = (0.2, Some(Flag::AtBorder));
        let mended = (0.1, Some(Flag::Corrected));
        assert_eq!(least_sure(&reports(&[cut, mended, (0.6, None)])), Some(2));
        // Far enough apart that neither counts for the other.
        let apart = |one, other| {
            let mut all = vec![sure; 40];
            all[2] = one;
            all[37] = other;
            reports(&all)
        };
        let jumped = (1.0, Some(Flag::AreaJump));
        assert_eq!(least_sure(&apart((0.6, None), jumped)), Some(37));
        assert_eq!(least_sure(&apart((0.4, None), jumped)), Some(2));
    }

    #[test]
    fn corrections_are_spread_and_go_to_the_middle_of_the_doubt() {
        let mut reports: Vec<FrameReport> = (0..60)
            .map(|frame| FrameReport {
                frame,
                area_px: 100,
                centre_px: None,
                confidence: if (20..31).contains(&frame) { 0.5 } else { 0.9 },
                flags: Flags::NONE,
            })
            .collect();
        assert_eq!(least_sure(&reports), Some(25));
        reports[25].flags.insert(Flag::Corrected);
        reports[25].confidence = 1.0;
        let next = least_sure(&reports).unwrap();
        assert!(next.abs_diff(25) >= 6, "{next}");
    }
}
