//! Key frames of a motion that repeats while it slowly becomes another: an animal that turns as it walks, seen
//! ever more from behind.
//!
//! The keys must show both the cycle and its drift, so they are spread over the clip as well as over the phase:
//! the set whose best prediction ([`DriftingCycle`]) has the smallest expected square error over the frames. It is
//! reached by exchanging one key at a time, as long as that helps, from the keys of the phase and from keys evenly spread
//! over the clip; the whole of the sets is not searched, so no proof is given.

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
    let over_the_phase = choose_keys_on_phase(frames, settings)?.frames;
    let place = |t: usize| (frames.cycles[t], drift[t]);
    let seen: Vec<usize> = (0..drift.len()).filter(|&t| frames.trust[t] > 0.0).collect();
    let trusted: Vec<usize> = (seen.iter().copied())
        .filter(|t| frames.trust[*t] >= LEAST_TRUST && !settings.exclude.contains(t))
        .collect();
    let places: Vec<(f64, f64)> = thinned(&seen, MOST_PLACES).into_iter().map(place).collect();
    let candidates = thinned(&trusted, MOST_CANDIDATES);
    let error = |keys: &[usize]| -> f64 {
        let known: Vec<(f64, f64)> = keys.iter().map(|&k| place(k)).collect();
        let Some(cycle) = DriftingCycle::new(&known, 0.0) else { return f64::INFINITY };
        places.iter().map(|at| cycle.error_sq(at.0, at.1)).sum::<f64>() / places.len() as f64
    };
    let over_the_clip = spread_over(&candidates, settings);
    let (least, keys) = std::iter::once(over_the_phase)
        .chain(over_the_clip)
        .map(|start| exchanged(start, &candidates, settings, &error))
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .unwrap_or_default();
    let spread = places.iter().map(|at| at.1.powi(2)).sum::<f64>() / places.len() as f64;
    Ok(PhaseKeys { frames: keys, expected_error_share: (least / (1.0 + spread)).sqrt() })
}

/// The error of the set that exchanging single keys leads to, and the set in order. Forced keys stay.
fn exchanged(
    mut keys: Vec<usize>,
    candidates: &[usize],
    settings: &PhaseKeySettings,
    error: &dyn Fn(&[usize]) -> f64,
) -> (f64, Vec<usize>) {
    let free: Vec<usize> =
        (0..keys.len()).filter(|&at| !settings.force.contains(&keys[at])).collect();
    let mut least = error(&keys);
    for _ in 0..ROUNDS {
        let before = least;
        for &at in &free {
            for &t in candidates {
                let others = keys.iter().enumerate().filter(|(other, _)| *other != at);
                if is_near(others.map(|(_, k)| k), t, settings) {
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
    (least, keys)
}

/// The forced keys and between them as many of the candidates as are wanted, evenly over the clip. `None` where they do
/// not find room.
fn spread_over(candidates: &[usize], settings: &PhaseKeySettings) -> Option<Vec<usize>> {
    let mut keys = settings.force.clone();
    for k in keys.len()..settings.keys {
        let wanted = (2 * k + 1) * candidates.len() / (2 * settings.keys);
        let room = |at: &usize| !is_near(keys.iter(), candidates[*at], settings);
        let at = (0..candidates.len()).filter(room).min_by_key(|at| at.abs_diff(wanted))?;
        keys.push(candidates[at]);
    }
    Some(keys)
}

/// Whether a frame lies too near to one of the keys.
fn is_near<'a>(
    mut keys: impl Iterator<Item = &'a usize>,
    frame: usize,
    settings: &PhaseKeySettings,
) -> bool {
    keys.any(|k| k.abs_diff(frame) < settings.min_spacing_frames.max(1))
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
        assert!(keys[0] < 20 && keys[5] > 70, "{keys:?}");
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
