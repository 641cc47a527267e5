//! Key frames of a motion that repeats while it slowly becomes another: an animal that turns as it walks, seen
//! ever more from behind.
//!
//! The keys must show both the cycle and its drift, so they are spread over the clip as well as over the phase:
//! the set whose best prediction ([`DriftingCycle`]) has the smallest expected square error over the frames. It is
//! reached from the keys of the phase by exchanging one key at a time, as long as that helps; the whole of
//! the sets is not searched, so no proof is given.

use super::on_phase::{PhaseKeySettings, PhaseKeys, PhasedFrames, choose_keys_on_phase};
use crate::error::Result;
use crate::numeric::DriftingCycle;

/// A frame trusted less than this is no key unless the user names it, as over the phase alone.
const LEAST_TRUST: f64 = 0.5;

/// Frames that the error is summed over: as many of the clip, evenly spread.
const MOST_PLACES: usize = 96;

/// Frames that may be keys: of a longer clip as many, evenly spread.
const MOST_CANDIDATES: usize = 240;

/// Rounds of exchanges; it settles in two to five.
const ROUNDS: usize = 8;

/// Chooses keys. `drift` says for each frame how far the motion has drifted, in the unit in which its slope is as
/// large as the cycle.
///
/// # Errors
/// As [`choose_keys_on_phase`].
pub fn choose_keys_on_drift(
    frames: PhasedFrames<'_>,
    drift: &[f64],
    settings: &PhaseKeySettings,
) -> Result<PhaseKeys> {
    let mut keys = choose_keys_on_phase(frames, settings)?.frames;
    let place = |t: usize| (frames.cycles[t], drift[t]);
    let seen: Vec<usize> = (0..drift.len()).filter(|&t| frames.trust[t] > 0.0).collect();
    let places = thinned(&seen, MOST_PLACES);
    let trusted: Vec<usize> = (seen.iter().copied())
        .filter(|t| frames.trust[*t] >= LEAST_TRUST && !settings.exclude.contains(t))
        .collect();
    let candidates = thinned(&trusted, MOST_CANDIDATES);
    let error = |keys: &[usize]| -> f64 {
        let known: Vec<(f64, f64)> = keys.iter().map(|&k| place(k)).collect();
        let Some(cycle) = DriftingCycle::new(&known, 0.0) else { return f64::INFINITY };
        let sum: f64 = places.iter().map(|&t| cycle.error_sq(place(t).0, place(t).1)).sum();
        sum / places.len() as f64
    };
    let mut least = error(&keys);
    for _ in 0..ROUNDS {
        let before = least;
        for at in
            (0..keys.len()).filter(|&at| !settings.force.contains(&keys[at])).collect::<Vec<_>>()
        {
            for &t in &candidates {
                let near = |k: &usize| k.abs_diff(t) < settings.min_spacing_frames.max(1);
                if keys.iter().enumerate().any(|(other, k)| other != at && near(k)) {
                    continue;
                }
                let old = std::mem::replace(&mut keys[at], t);
                let tried = error(&keys);
                if tried < least {
                    least = tried;
                } else {
                    keys[at] = old;
                }
            }
        }
        if least >= before {
            break;
        }
    }
    keys.sort_unstable();
    let spread = places.iter().map(|&t| drift[t].powi(2)).sum::<f64>() / places.len() as f64;
    Ok(PhaseKeys { frames: keys, expected_error_share: (least / (1.0 + spread)).sqrt() })
}

/// Every so manieth of the frames.
fn thinned(frames: &[usize], most: usize) -> Vec<usize> {
    let step = frames.len().div_ceil(most).max(1);
    frames.iter().copied().step_by(step).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::Harmonics;

    #[test]
    fn keys_are_spread_over_the_clip_as_well_as_over_the_phase() {
        let cycles: Vec<f64> = (0..90).map(|t| f64::from(t) / 30.0).collect();
        let drift: Vec<f64> = (0..90).map(|t| (f64::from(t) - 44.5) / 26.0).collect();
        let silhouette = Harmonics::from_parts(&[0.0], &[(vec![1.0], vec![0.0])]).unwrap();
        let mut trust = vec![1.0; 90];
        trust[10..20].fill(0.2);
        let frames = PhasedFrames {
            cycles: &cycles,
            deviation_cycles: &[0.0; 90],
            trust: &trust,
            silhouette: &silhouette,
        };
        let settings = PhaseKeySettings {
            keys: 6,
            exclude: vec![88, 89],
            force: vec![40],
            min_spacing_frames: 2,
        };
        let found = choose_keys_on_drift(frames, &drift, &settings).unwrap();
        let keys = &found.frames;
        assert!(keys.len() == 6 && keys.contains(&40) && keys.windows(2).all(|w| w[1] >= w[0] + 2));
        assert!(keys.iter().all(|k| !(10..20).contains(k) && *k < 88), "{keys:?}");
        // Both ends of the way are seen, where the phase alone would do with one stride.
        assert!(keys[0] < 25 && keys[5] > 70, "{keys:?}");
        // No exchange of one key is better.
        let error = |keys: &[usize]| -> f64 {
            let known: Vec<_> = keys.iter().map(|&k| (cycles[k], drift[k])).collect();
            let cycle = DriftingCycle::new(&known, 0.0).unwrap();
            (0..90).map(|t| cycle.error_sq(cycles[t], drift[t])).sum()
        };
        let least = error(keys);
        for at in (0..6).filter(|&at| keys[at] != 40) {
            for t in (0..88).filter(|t| !(10..20).contains(t) && !keys.contains(t)) {
                let mut other = keys.clone();
                other[at] = t;
                let near = (0..6).any(|k| k != at && other[k].abs_diff(t) < 2);
                assert!(near || error(&other) >= least * (1.0 - 1e-9), "{keys:?} {other:?}");
            }
        }
    }
}
