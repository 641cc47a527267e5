//! Partners: for each key another frame with the same silhouette but the opposite pose
//! (section 3.2 of the paper).

use serde::{Deserialize, Serialize};

use crate::numeric::{Coefficients, distance_sq};
use crate::{Error, Result};

/// How far from a key its partner may be sought.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PartnerSettings {
    /// Least distance in time between a key and its partner, frames. Default: 3, as in the paper.
    pub min_distance_frames: usize,
    /// Period T of the silhouettes (a step), frames, above 2; where it is unknown only
    /// `min_distance_frames` holds. The pose repeats every 2T, so a partner at time difference Δ
    /// must have |Δ| mod 2T within T/2 of T. Default: unknown.
    pub step_period_frames: Option<f64>,
    /// With a known period, frames at most this many steps away are preferred: an error or drift
    /// of the period adds up over the steps between until the halves can no longer be told
    /// apart. Frames further away are taken only when there is none nearer. Default: 3.
    pub horizon_steps: f64,
    /// Frames that must not be proposed: their silhouettes are not to be trusted. The user may
    /// choose them all the same. Default: none.
    pub exclude: Vec<usize>,
}

impl Default for PartnerSettings {
    fn default() -> Self {
        Self {
            min_distance_frames: 3,
            step_period_frames: None,
            horizon_steps: 3.0,
            exclude: Vec::new(),
        }
    }
}

/// A key's partner.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Partner {
    /// The key's frame, counted from 0.
    pub key_frame: usize,
    /// The partner's frame, counted from 0.
    pub frame: usize,
    /// Distance of the two in component space; two unit-deviation frames are about 2 apart.
    pub distance: f64,
    /// Whether the user chose it.
    pub chosen_by_user: bool,
}

/// Proposes a partner for every key, in the order of `keys`.
///
/// `chosen` holds the user's decisions: `(position in keys, frame)`. For the other keys it is the
/// frame nearest in component space that is neither a key nor another's partner; where two keys
/// want the same frame, the nearer gets it. A user's choice must only be another frame of the
/// clip: the distance rules do not bind the user.
///
/// # Errors
/// [`Error::NoPartner`], [`Error::PartnerRefused`], frames out of range, coefficients not finite,
/// settings out of range.
pub fn propose_partners(
    coefficients: &Coefficients,
    keys: &[usize],
    settings: &PartnerSettings,
    chosen: &[(usize, usize)],
) -> Result<Vec<Partner>> {
    validate(coefficients, keys, settings)?;
    let mut partners = vec![None; keys.len()];
    let mut taken = vec![false; coefficients.frames()];
    for &k in keys {
        taken[k] = true;
    }
    for &(at, frame) in chosen {
        take_users(coefficients.frames(), keys, at, frame, &mut taken)?;
        if let Some((earlier, _)) = partners[at].replace((frame, true)) {
            let refused = Error::PartnerRefused {
                key_frame: keys[at],
                partner: earlier,
                reason: "two partners were named for this key",
            };
            return Err(refused);
        }
    }
    while let Some(at) = partners.iter().position(Option::is_none) {
        let (_, frame, at) = (at..keys.len())
            .filter(|&i| partners[i].is_none())
            .filter_map(|i| {
                nearest(coefficients, keys[i], settings, &taken).map(|(d, f)| (d, f, i))
            })
            .min_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))))
            .ok_or(Error::NoPartner { key_frame: keys[at] })?;
        taken[frame] = true;
        partners[at] = Some((frame, false));
    }
    let partner = |(&key_frame, found): (&usize, Option<(usize, bool)>)| {
        found.map(|(frame, chosen_by_user)| Partner {
            key_frame,
            frame,
            distance: distance_sq(coefficients.point(key_frame), coefficients.point(frame)).sqrt(),
            chosen_by_user,
        })
    };
    Ok(keys.iter().zip(partners).filter_map(partner).collect())
}

fn validate(coefficients: &Coefficients, keys: &[usize], settings: &PartnerSettings) -> Result<()> {
    coefficients.check_finite()?;
    let frames = coefficients.frames();
    if let Some(&frame) = keys.iter().find(|&&k| k >= frames) {
        return Err(Error::KeyFrameOutOfRange { frame, frames });
    }
    if let Some(period) = settings.step_period_frames
        && !(period.is_finite() && period > 2.0)
    {
        return Err(Error::KernelSetting {
            name: "step_period_frames",
            value: period,
            allowed: "a number above 2",
        });
    }
    if settings.horizon_steps.is_nan() || settings.horizon_steps < 1.0 {
        return Err(Error::KernelSetting {
            name: "horizon_steps",
            value: settings.horizon_steps,
            allowed: "a number of 1 or more",
        });
    }
    Ok(())
}

fn take_users(
    frames: usize,
    keys: &[usize],
    at: usize,
    frame: usize,
    taken: &mut [bool],
) -> Result<()> {
    let Some(&key_frame) = keys.get(at) else {
        return Err(Error::PartnerForNoKey { position: at, keys: keys.len() });
    };
    if frame >= frames {
        return Err(Error::KeyFrameOutOfRange { frame, frames });
    }
    if taken[frame] {
        let reason = if keys.contains(&frame) {
            "it is a key itself"
        } else {
            "it is the partner of another key already"
        };
        return Err(Error::PartnerRefused { key_frame, partner: frame, reason });
    }
    taken[frame] = true;
    Ok(())
}

/// The free frame nearest to `key` that the rules allow, with its squared distance.
fn nearest(
    coefficients: &Coefficients,
    key: usize,
    settings: &PartnerSettings,
    taken: &[bool],
) -> Option<(f64, usize)> {
    let among = |horizon_steps: f64| {
        (0..coefficients.frames())
            .filter(|f| !settings.exclude.contains(f))
            .filter(|&f| !taken[f] && in_other_half(key, f, settings, horizon_steps))
            .map(|f| (distance_sq(coefficients.point(key), coefficients.point(f)), f))
            .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))
    };
    among(settings.horizon_steps).or_else(|| among(f64::INFINITY))
}

fn in_other_half(key: usize, frame: usize, settings: &PartnerSettings, horizon_steps: f64) -> bool {
    let apart = key.abs_diff(frame);
    if apart < settings.min_distance_frames.max(1) {
        return false;
    }
    let Some(period) = settings.step_period_frames else { return true };
    let apart = apart as f64;
    apart <= (horizon_steps + 0.5) * period
        && (apart.rem_euclid(2.0 * period) - period).abs() <= period / 2.0
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    const PERIOD: f64 = 12.15;

    fn ring() -> Coefficients {
        let values = (0..100)
            .flat_map(|t| {
                let a = TAU * f64::from(t) / PERIOD;
                [a.cos(), a.sin()]
            })
            .collect();
        Coefficients::from_rows(100, 2, values).unwrap()
    }

    fn settings() -> PartnerSettings {
        PartnerSettings { step_period_frames: Some(PERIOD), ..PartnerSettings::default() }
    }

    #[test]
    fn a_partner_is_an_odd_number_of_steps_away_and_looks_the_same() {
        let found = propose_partners(&ring(), &[50, 53, 56, 59], &settings(), &[]).unwrap();
        for p in &found {
            let steps = (p.key_frame.abs_diff(p.frame) as f64 / PERIOD).round() as usize;
            assert_eq!(steps % 2, 1, "{p:?}");
            assert!(p.distance < TAU / PERIOD / 2.0 + 1e-9, "{p:?}");
        }
        let mut all: Vec<usize> = found.iter().flat_map(|p| [p.key_frame, p.frame]).collect();
        all.sort_unstable();
        all.dedup();
        assert_eq!(all.len(), 8);
    }

    #[test]
    fn without_a_period_the_nearest_frame_three_away_is_taken() {
        // 85 frames are 7 steps less .05 frames, nearer than 73, which are 6 steps and .1 frames.
        let found = propose_partners(&ring(), &[5], &PartnerSettings::default(), &[]).unwrap();
        assert_eq!(found[0].frame, 90);
        let close = Coefficients::from_rows(5, 1, vec![0.0, 0.1, 0.2, 0.3, 0.4]).unwrap();
        let found = propose_partners(&close, &[0], &PartnerSettings::default(), &[]).unwrap();
        assert_eq!(found[0].frame, 3);
    }

    #[test]
    fn the_user_is_obeyed_and_others_keep_off_the_frame() {
        let free = propose_partners(&ring(), &[50, 53], &settings(), &[]).unwrap();
        let user =
            propose_partners(&ring(), &[50, 53], &settings(), &[(1, free[0].frame)]).unwrap();
        assert_eq!(user[1].frame, free[0].frame);
        assert!(user[1].chosen_by_user && !user[0].chosen_by_user);
        assert_ne!(user[0].frame, user[1].frame);
    }

    #[test]
    fn excluded_frames_are_not_proposed_but_the_user_may_name_them() {
        let free = propose_partners(&ring(), &[10], &settings(), &[]).unwrap()[0].frame;
        let without = PartnerSettings { exclude: vec![free], ..settings() };
        assert_ne!(propose_partners(&ring(), &[10], &without, &[]).unwrap()[0].frame, free);
        let named = propose_partners(&ring(), &[10], &without, &[(0, free)]).unwrap();
        assert_eq!((named[0].frame, named[0].chosen_by_user), (free, true));
    }

    #[test]
    fn bad_choices_are_named() {
        let refuse = |chosen: &[(usize, usize)]| {
            propose_partners(&ring(), &[50, 53], &settings(), chosen).unwrap_err()
        };
        assert!(matches!(refuse(&[(0, 53)]), Error::PartnerRefused { partner: 53, .. }));
        assert!(matches!(refuse(&[(0, 62), (1, 62)]), Error::PartnerRefused { partner: 62, .. }));
        assert!(matches!(refuse(&[(0, 62), (0, 63)]), Error::PartnerRefused { .. }));
        assert!(matches!(refuse(&[(0, 100)]), Error::KeyFrameOutOfRange { frame: 100, .. }));
        assert!(matches!(refuse(&[(2, 62)]), Error::PartnerForNoKey { position: 2, .. }));
        let short = Coefficients::from_rows(3, 1, vec![0.0, 1.0, 2.0]).unwrap();
        let none = propose_partners(&short, &[1], &PartnerSettings::default(), &[]);
        assert!(matches!(none, Err(Error::NoPartner { key_frame: 1 })));
    }
}
