//! Scores of the frames whose silhouette was left out.

use crate::numeric::Coefficients;

/// Spreads the scores of the used frames over all frames, linear between neighbours and constant
/// beyond the ends.
pub(super) fn bridged(scores: &Coefficients, used: &[bool]) -> Coefficients {
    let frames: Vec<usize> = (0..used.len()).filter(|&t| used[t]).collect();
    let values = (0..used.len())
        .flat_map(|t| {
            let after = frames.partition_point(|&f| f < t);
            let right = after.min(frames.len() - 1);
            let left = if frames[right] <= t { right } else { right.saturating_sub(1) };
            let gap = frames[right].abs_diff(frames[left]);
            let share = if gap == 0 || frames[left] > t {
                0.0
            } else {
                (t - frames[left]) as f64 / gap as f64
            };
            let (a, b) = (scores.point(left), scores.point(right));
            a.iter().zip(b).map(|(x, y)| x + share.min(1.0) * (y - x)).collect::<Vec<_>>()
        })
        .collect();
    Coefficients::from_rows(used.len(), scores.components(), values)
        .unwrap_or_else(|| scores.clone())
}

/// The series of a stretch that begins at frame `first`, spread over `frames` frames: constant beyond
/// its ends.
pub(super) fn held(series: &Coefficients, first: usize, frames: usize) -> Coefficients {
    let last = series.frames().saturating_sub(1);
    let values = (0..frames)
        .flat_map(|t| series.point(t.saturating_sub(first).min(last)).iter().copied())
        .collect();
    Coefficients::from_rows(frames, series.components(), values).unwrap_or_else(|| series.clone())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_are_bridged_and_ends_held() {
        let scores = Coefficients::from_rows(3, 1, vec![1.0, 4.0, 10.0]).unwrap();
        let used = [false, true, false, false, true, true, false];
        let all = bridged(&scores, &used);
        assert_eq!(all.column(0), [1.0, 1.0, 2.0, 3.0, 4.0, 10.0, 10.0]);
        let same = bridged(&scores, &[true, true, true]);
        assert_eq!(same, scores);
    }

    #[test]
    fn a_stretch_is_held_at_its_ends() {
        let series = Coefficients::from_rows(2, 1, vec![5.0, 7.0]).unwrap();
        assert_eq!(held(&series, 1, 5).column(0), [5.0, 5.0, 7.0, 7.0, 7.0]);
        assert_eq!(held(&series, 0, 2), series);
    }
}
