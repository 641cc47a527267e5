//! An animal that walks away from the camera shrinks. A slow trend of scale is no motion of the
//! gait; it is fitted to the silhouettes' sizes and removed.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

/// Least change of scale over the clip that is worth removing: 5 %, about one row of pixels a leg.
const LEAST_CHANGE: f64 = 0.05;

/// … and it must be this many times the scatter about the trend, or it is the gait's own change
/// of area.
const CHANGE_OVER_SCATTER: f64 = 2.0;

/// From this change on the trend is bent as a camera sees a steady retreat (size ∝ 1/distance),
/// and a quadratic is fitted; a smaller one is a straight line within a percent.
const BENT_CHANGE: f64 = 0.25;

/// Fewest whole silhouettes a trend is fitted to.
const LEAST_FRAMES: usize = 8;

/// Whether a trend is removed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TrendRemoval {
    /// When it is significant.
    #[default]
    Auto,
    /// Always.
    On,
    /// Never.
    Off,
}

/// The fitted trend: ln(scale) = a + b·u + c·u², with u from −1 at the first frame to 1 at the
/// last.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ScaleTrend {
    coefficients: [f64; 3],
    frames: usize,
    /// Scale of the last frame over that of the first.
    pub change: f64,
    /// Standard deviation of ln(scale) about the trend.
    pub scatter: f64,
    /// Whether it was removed.
    pub removed: bool,
}

impl ScaleTrend {
    /// Fits the trend to the areas of the whole silhouettes: `areas_px[t]` is `None` where the mask
    /// is empty or cut by the border, which would look like shrinking. `None` when there are too
    /// few.
    #[must_use]
    pub fn fit(areas_px: &[Option<usize>], removal: TrendRemoval) -> Option<Self> {
        let frames = areas_px.len();
        let points: Vec<(f64, f64)> = areas_px
            .iter()
            .enumerate()
            .filter_map(|(t, area)| area.filter(|a| *a > 0).map(|a| (t, a)))
            .map(|(t, area)| (position(t, frames), 0.5 * (area as f64).ln()))
            .collect();
        if points.len() < LEAST_FRAMES {
            return None;
        }
        let straight = robust_fit(&points, false);
        let bent = (2.0 * straight[1]).abs() > BENT_CHANGE;
        let coefficients = if bent { robust_fit(&points, true) } else { straight };
        let value = |u: f64| coefficients[0] + u * (coefficients[1] + u * coefficients[2]);
        let residuals: Vec<f64> = points.iter().map(|&(u, y)| y - value(u)).collect();
        let scatter =
            (residuals.iter().map(|r| r * r).sum::<f64>() / residuals.len() as f64).sqrt();
        let change = value(1.0) - value(-1.0);
        let significant = change.abs() > LEAST_CHANGE.max(CHANGE_OVER_SCATTER * scatter);
        let removed = match removal {
            TrendRemoval::On => true,
            TrendRemoval::Off => false,
            TrendRemoval::Auto => significant,
        };
        Some(Self { coefficients, frames, change: change.exp(), scatter, removed })
    }

    /// The factor by which frame `t` is to be scaled so that all have the scale of the clip's
    /// middle; 1 when the trend is not removed. The parabola is not followed outside the clip.
    #[must_use]
    pub fn correction(&self, t: usize) -> f64 {
        if !self.removed {
            return 1.0;
        }
        let u = position(t, self.frames);
        (-(u * (self.coefficients[1] + u * self.coefficients[2]))).exp()
    }
}

fn position(t: usize, frames: usize) -> f64 {
    2.0 * t as f64 / (frames.max(2) - 1) as f64 - 1.0
}

/// Least squares with Huber's weights (tuning constant 1.345 robust deviations), twenty rounds:
/// single bad masks do not bend the trend.
fn robust_fit(points: &[(f64, f64)], quadratic: bool) -> [f64; 3] {
    let mut weights = vec![1.0; points.len()];
    let mut solution = Vector3::zeros();
    for _ in 0..20 {
        let mut normal = Matrix3::zeros();
        let mut right = Vector3::zeros();
        for (&(u, y), w) in points.iter().zip(&weights) {
            let row = Vector3::new(1.0, u, if quadratic { u * u } else { 0.0 });
            normal += row * row.transpose() * *w;
            right += row * (y * w);
        }
        if !quadratic {
            normal[(2, 2)] = 1.0;
        }
        let Some(next) = normal.lu().solve(&right) else { break };
        solution = next;
        let residual =
            |&(u, y): &(f64, f64)| (y - solution[0] - u * (solution[1] + u * solution[2])).abs();
        let mut sizes: Vec<f64> = points.iter().map(residual).collect();
        sizes.sort_by(f64::total_cmp);
        let limit = 1.345 * 1.4826 * sizes[sizes.len() / 2];
        for (weight, point) in weights.iter_mut().zip(points) {
            let size = residual(point);
            *weight = if size <= limit || size == 0.0 { 1.0 } else { limit / size };
        }
    }
    solution.into()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Areas of an animal that goes from scale 1 to `last` at steady speed, with a gait that
    /// changes its area by a few percent.
    fn areas(frames: usize, last: f64) -> Vec<Option<usize>> {
        (0..frames)
            .map(|t| {
                let along = t as f64 / (frames - 1) as f64;
                let scale = 1.0 / (1.0 + along * (1.0 / last - 1.0));
                let gait = 1.0 + 0.04 * (t as f64 * 0.5).sin();
                Some((20_000.0 * scale * scale * gait) as usize)
            })
            .collect()
    }

    #[test]
    fn a_retreat_to_half_size_is_removed_within_two_percent() {
        let mut seen = areas(64, 0.5);
        seen[10] = Some(900);
        seen[40] = None;
        let trend = ScaleTrend::fit(&seen, TrendRemoval::Auto).unwrap();
        assert!(trend.removed && (trend.change - 0.5).abs() < 0.03, "{trend:?}");
        let corrected: Vec<f64> = (0..64)
            .filter_map(|t| areas(64, 0.5)[t].map(|a| (a as f64).sqrt() * trend.correction(t)))
            .collect();
        let mean = corrected.iter().sum::<f64>() / 64.0;
        // Two percent of the gait's own change of size remain, and two of misfit.
        assert!(corrected.iter().all(|c| (c / mean - 1.0).abs() < 0.045), "{corrected:?}");
    }

    #[test]
    fn the_gait_alone_is_no_trend() {
        let trend = ScaleTrend::fit(&areas(64, 1.0), TrendRemoval::Auto).unwrap();
        assert!(!trend.removed, "{trend:?}");
        assert_eq!(trend.correction(5), 1.0);
        assert!(ScaleTrend::fit(&areas(64, 1.0), TrendRemoval::On).unwrap().removed);
        assert!(ScaleTrend::fit(&areas(7, 0.5), TrendRemoval::Auto).is_none());
    }
}
