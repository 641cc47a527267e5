//! Key frames of a gait whose left does what its right does half a stride later, so that every pose counts twice: once as
//! it is and once, half a stride on, with the sides exchanged ([`MirroredCycle`]).
//!
//! Two sets are found, each the best of its circle: the keys spread over the stride, and the keys spread over the step with
//! the halves of the stride in turns. Odd numbers of keys evenly over the stride are evenly over the step too; of even
//! numbers the images fall on the keys themselves. Of the two that one is taken of which the prediction expects
//! the smaller error.
//!
//! On the walks of five rigs (true phases, mean of eight offsets, `examples/mirror_table.rs`) the error of poses that count
//! twice over that of as many that count once, evenly over the stride, is .41 to .70 with 2 keys, .32 to .77 with 3, .43 to .95
//! with 4, .76 to 1.10 with 5, and the same within a tenth from 6 on. The largest shares are those of a fox whose left and
//! right hardly have more than the rhythm in common, and of a triceratops.

use super::circle::{Circle, Turn};
use super::expected::Motion;
use super::on_phase::{PhaseKeySettings, PhaseKeys, PhasedFrames};
use crate::numeric::MirroredCycle;
use crate::{Error, Result};

/// Places of the stride at which the expected error is taken.
const PLACES: usize = 64;

/// Both circles of a clip.
pub(super) struct Circles<'a> {
    frames: PhasedFrames<'a>,
    circles: [Circle; 2],
    speed_sq: f64,
}

impl<'a> Circles<'a> {
    pub(super) fn new(frames: PhasedFrames<'a>, settings: &PhaseKeySettings) -> Result<Self> {
        let circle = |turn| Circle::new(frames, settings, turn);
        let circles = [circle(Turn::Stride)?, circle(Turn::Step)?];
        Ok(Self { frames, circles, speed_sq: Motion::new(frames.silhouette).speed_sq })
    }

    /// The better of the two best sets; `None` when the constraints allow none.
    pub(super) fn best(&self, keys: usize) -> Option<PhaseKeys> {
        let of = |circle: &Circle| {
            let (_, frames) = circle.shortest(keys)?;
            let expected_error_share = self.expected_error_sq(&frames)?.sqrt();
            Some(PhaseKeys { frames, expected_error_share })
        };
        let found = self.circles.iter().filter_map(of);
        found.min_by(|a, b| a.expected_error_share.total_cmp(&b.expected_error_share))
    }

    fn expected_error_sq(&self, keys: &[usize]) -> Option<f64> {
        let phases: Vec<f64> = keys.iter().map(|&k| self.frames.cycles[k]).collect();
        let cycle = MirroredCycle::new(&phases)?;
        let between = (0..PLACES).map(|p| cycle.error_sq(p as f64 / PLACES as f64)).sum::<f64>();
        let off = keys.iter().map(|&k| self.frames.deviation_cycles[k].powi(2)).sum::<f64>();
        Some(between / PLACES as f64 + self.speed_sq * off / keys.len() as f64)
    }
}

/// Chooses keys of a gait whose left and right are alike: of the best set over the stride and the best over the step the
/// one with the smaller expected error.
///
/// # Errors
/// As [`choose_keys_on_phase`](super::choose_keys_on_phase).
pub fn choose_keys_on_mirror(
    frames: PhasedFrames<'_>,
    settings: &PhaseKeySettings,
) -> Result<PhaseKeys> {
    let circles = Circles::new(frames, settings)?;
    circles.best(settings.keys).ok_or(Error::NoRegularKeys { keys: settings.keys })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::Harmonics;

    fn chosen(keys: usize, force: Vec<usize>) -> (Vec<f64>, PhaseKeys) {
        let cycles: Vec<f64> =
            (0..100).map(|t| f64::from(t) * 0.0411 + 0.002 * (f64::from(t) * 1.7).sin()).collect();
        let silhouette =
            Harmonics::from_parts(&[0.0], &[(vec![0.2], vec![0.1]), (vec![1.0], vec![0.0])]);
        let found = choose_keys_on_mirror(
            PhasedFrames {
                cycles: &cycles,
                deviation_cycles: &[0.002; 100],
                trust: &[1.0; 100],
                silhouette: &silhouette.unwrap(),
            },
            &PhaseKeySettings { keys, force, min_spacing_frames: 1, exclude: vec![5] },
        )
        .unwrap();
        let phases = found.frames.iter().map(|&f| cycles[f].rem_euclid(1.0)).collect();
        (phases, found)
    }

    /// Gaps between neighbours, of moments or of moments and their images.
    fn gaps(phases: &[f64], turn: f64) -> Vec<f64> {
        let mut places: Vec<f64> = phases.iter().map(|p| p.rem_euclid(turn)).collect();
        places.sort_by(f64::total_cmp);
        let next = |k: usize| places.get(k + 1).copied().unwrap_or(places[0] + turn);
        (0..places.len()).map(|k| next(k) - places[k]).collect()
    }

    #[test]
    fn few_keys_are_even_over_the_step_and_many_over_the_stride() {
        for keys in [2, 3, 4, 5] {
            let (phases, _) = chosen(keys, Vec::new());
            let even = 0.5 / keys as f64;
            assert!(
                gaps(&phases, 0.5).iter().all(|g| (g - even).abs() < 0.35 * even),
                "{phases:?}"
            );
            // Both halves are seen.
            let second = phases.iter().filter(|p| **p >= 0.5).count();
            assert!(keys == 2 || (second > 0 && second < keys), "{phases:?}");
        }
        for keys in [8, 10, 12] {
            let (phases, _) = chosen(keys, Vec::new());
            let even = 1.0 / keys as f64;
            assert!(gaps(&phases, 1.0).iter().all(|g| (g - even).abs() < 0.5 * even), "{phases:?}");
        }
    }

    #[test]
    fn more_keys_promise_less_and_constraints_hold() {
        let mut last = f64::INFINITY;
        for keys in 1..=12 {
            let (_, found) = chosen(keys, Vec::new());
            assert!(found.expected_error_share < last, "{keys}: {found:?}");
            last = found.expected_error_share;
            assert!(!found.frames.contains(&5));
        }
        let (_, found) = chosen(4, vec![17, 40]);
        assert!(found.frames.contains(&17) && found.frames.contains(&40));
    }
}
