//! The phase of a cyclic motion, measured in the plane of its first two components.

use std::f64::consts::{PI, TAU};

use super::{Coefficients, median};

/// Share of a phase error that the tracker takes over at once, for a point at the median radius.
/// With this and [`RATE_GAIN`] the loop follows a speed that drifts by a tenth within two cycles.
const PHASE_GAIN: f64 = 0.5;

/// Share of a phase error by which the tracker corrects its speed.
const RATE_GAIN: f64 = 0.05;

/// How far the tracked speed may leave the expected one, as a factor either way.
const RATE_RANGE: f64 = 1.6;

/// The phase of every frame along the loop that the points run through, in the direction of
/// motion.
///
/// One turn, 2π, is one silhouette cycle: a step in a symmetric walk, a stride in a gallop. The
/// angle is that of (component 1, component 2) about their mean, its sign chosen so that it grows
/// with time. With a single component, its central difference scaled to the same deviation stands
/// in for the second.
///
/// The turns are counted by a phase-locked loop that predicts each frame from the speed so far and
/// trusts a point by its squared distance from the centre, where angles are noise. A few lost
/// frames or a pass near the centre therefore cost no turn, which plain unwrapping would lose.
#[derive(Clone, Debug, PartialEq)]
pub struct CyclePhase {
    unwrapped_rad: Vec<f64>,
    weight: Vec<f64>,
    anticlockwise: bool,
}

impl CyclePhase {
    /// Measures the phase; `period_frames` is the length of one turn where it is known (from the
    /// spectrum), otherwise the median advance from frame to frame is used.
    #[must_use]
    pub fn measure(coefficients: &Coefficients, period_frames: Option<f64>) -> Self {
        let plane = plane(coefficients);
        let turning: f64 = plane.windows(2).map(|w| w[0][0] * w[1][1] - w[0][1] * w[1][0]).sum();
        let anticlockwise = turning >= 0.0;
        let sign = if anticlockwise { 1.0 } else { -1.0 };
        let angles: Vec<f64> = plane.iter().map(|p| sign * p[1].atan2(p[0])).collect();
        let radii_sq: Vec<f64> = plane.iter().map(|p| p[0] * p[0] + p[1] * p[1]).collect();
        let typical = median(&radii_sq);
        let weight: Vec<f64> = radii_sq
            .iter()
            .map(|r| if typical > 0.0 { (r / typical).min(1.0) } else { 0.0 })
            .collect();
        let rate = match period_frames {
            Some(period) => TAU / period,
            None => {
                let steps: Vec<f64> = angles.windows(2).map(|w| wrapped(w[1] - w[0])).collect();
                median(&steps).max(0.0)
            }
        };
        Self { unwrapped_rad: track(&angles, &weight, rate), weight, anticlockwise }
    }

    /// Phase of each frame, radians, unwrapped; the zero is arbitrary.
    #[must_use]
    pub fn unwrapped_rad(&self) -> &[f64] {
        &self.unwrapped_rad
    }

    /// How far each frame's angle can be trusted, 0 (at the centre) to 1 (median radius or more).
    #[must_use]
    pub fn weight(&self) -> &[f64] {
        &self.weight
    }

    /// Whether the motion turns from component 1 towards component 2.
    #[must_use]
    pub fn is_anticlockwise(&self) -> bool {
        self.anticlockwise
    }
}

/// An angle brought to (−π, π], radians.
#[must_use]
pub fn wrapped(angle_rad: f64) -> f64 {
    let turned = angle_rad.rem_euclid(TAU);
    if turned > PI { turned - TAU } else { turned }
}

/// The two coordinates of each frame, about their mean.
fn plane(coefficients: &Coefficients) -> Vec<[f64; 2]> {
    let frames = coefficients.frames();
    if frames == 0 || coefficients.components() == 0 {
        return vec![[0.0; 2]; frames];
    }
    let x = centred(coefficients.column(0));
    let y = if coefficients.components() > 1 {
        centred(coefficients.column(1))
    } else {
        let slope: Vec<f64> =
            (0..frames).map(|t| x[(t + 1).min(frames - 1)] - x[t.saturating_sub(1)]).collect();
        let power = |v: &[f64]| v.iter().map(|a| a * a).sum::<f64>();
        let (px, ps) = (power(&x), power(&slope));
        let scale = if ps > 0.0 { (px / ps).sqrt() } else { 0.0 };
        slope.iter().map(|s| s * scale).collect()
    };
    x.into_iter().zip(y).map(|(x, y)| [x, y]).collect()
}

fn centred(mut column: Vec<f64>) -> Vec<f64> {
    let mean = column.iter().sum::<f64>() / column.len() as f64;
    column.iter_mut().for_each(|v| *v -= mean);
    column
}

/// Measured angles with the whole turns that a phase-locked loop gives them.
fn track(angles: &[f64], weight: &[f64], expected_rate: f64) -> Vec<f64> {
    let Some(&first) = angles.first() else { return Vec::new() };
    let mut phase = first - expected_rate;
    let mut rate = expected_rate;
    angles
        .iter()
        .zip(weight)
        .map(|(&angle, &w)| {
            phase += rate;
            let error = wrapped(angle - phase);
            let measured = phase + error;
            phase += PHASE_GAIN * w * error;
            rate = (rate + RATE_GAIN * w * error)
                .clamp(expected_rate / RATE_RANGE, expected_rate * RATE_RANGE);
            measured
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ring(frames: usize, period: f64, direction: f64) -> Coefficients {
        let values = (0..frames)
            .flat_map(|t| {
                let a = direction * TAU * t as f64 / period;
                [a.cos() + 0.3, a.sin()]
            })
            .collect();
        Coefficients::from_rows(frames, 2, values).unwrap()
    }

    #[test]
    fn a_ring_advances_by_its_period_in_either_direction() {
        for direction in [1.0, -1.0] {
            for period in [Some(12.5), None] {
                let c = ring(100, 12.5, direction);
                let phase = CyclePhase::measure(&c, period);
                assert_eq!(phase.is_anticlockwise(), direction > 0.0);
                let turns = (phase.unwrapped_rad()[99] - phase.unwrapped_rad()[0]) / TAU;
                assert!((turns - 99.0 / 12.5).abs() < 1e-6, "{turns}");
            }
        }
    }

    #[test]
    fn frames_at_the_centre_or_opposite_cost_no_turn() {
        let mut values: Vec<f64> =
            (0..100).flat_map(|t| ring(100, 12.5, 1.0).point(t).to_vec()).collect();
        for t in [20, 21, 22, 50] {
            values[2 * t] = 0.3 - 0.05 * (values[2 * t] - 0.3);
            values[2 * t + 1] *= -0.05;
        }
        let c = Coefficients::from_rows(100, 2, values).unwrap();
        let phase = CyclePhase::measure(&c, Some(12.5));
        let turns = (phase.unwrapped_rad()[99] - phase.unwrapped_rad()[0]) / TAU;
        assert!((turns - 99.0 / 12.5).abs() < 0.05, "{turns}");
    }

    #[test]
    fn one_component_turns_by_its_slope() {
        let x: Vec<f64> = (0..100).map(|t| (TAU * f64::from(t) / 20.0).cos()).collect();
        let phase = CyclePhase::measure(&Coefficients::from_columns(&[x]).unwrap(), None);
        let turns = (phase.unwrapped_rad()[90] - phase.unwrapped_rad()[10]) / TAU;
        assert!((turns - 4.0).abs() < 0.02, "{turns}");
    }
}
