//! Switching models: which poses a frame may draw on, when the silhouette alone cannot tell the
//! left step from the right (section 3.2 of the paper).
//!
//! The 2m poses, m keys and their m partners, stand on a cycle of 2m *slots* in the order in which
//! the motion passes them; slots s and s + m look alike. Model j of q = 4 holds the m slots from
//! j·m/2 on (equation 19, for any even m):
//!
//! ```text
//! slot      0   1   2   3   4   5   6   7        m = 4
//! model 0   x   x   x   x
//! model 1           x   x   x   x
//! model 2                   x   x   x   x
//! model 3   x   x                   x   x
//! ```
//!
//! Each frame gets a position u(t) in slots, counted on without end, from the measured phase; the
//! state of equation 17 is the number of switches passed. With [`SwitchAt::LastSilhouette`] a switch
//! is made at the frame nearest (in component space) to the silhouette at which it is due, within
//! half a slot of where the phase expects it, or, if no frame comes there, at the first frame
//! beyond. There the two models agree, since both interpolate that silhouette's pose. With
//! [`SwitchAt::Middle`] the same holds where the middle falls on a silhouette (m = 2, 6, 10, …);
//! for m = 4, 8, 12, … it falls between two, and the switch is made when the position passes it.
//!
//! Departures from the paper: the whole clip is known, so the state at each key frame is taken
//! from the key itself and the phase counts the turns between; noise cannot count a silhouette
//! twice, because the position is fitted by a sequence that never falls; a silhouette that is
//! missed does not stop the count; and the two defaults below, the middle and the cross-fade.
//! Measured on planted rings (100 frames of 12.15 a step, speed swinging by a tenth, noise .1 of
//! the unit deviation, poses of four curves with root mean square 1.6), the error of the paper's
//! rule and of the defaults: 4 keys .309 and .309, 6 keys .191 and .152, 8 keys .242 and .131; the
//! largest pop from frame to frame: .61 and .62, .71 and .44, 1.12 and .42.

use std::f64::consts::{PI, TAU};

use serde::{Deserialize, Serialize};

use crate::numeric::{Coefficients, CyclePhase, distance_sq, rising_fit, wrapped};
use crate::{Error, Result};

use super::kernel::{KernelSettings, Rbf};
use super::weights::Weights;

/// Number of models, q.
const MODELS: usize = 4;

/// Half-width of the window in which a switch may be made early or late, slots.
const WINDOW_SLOTS: f64 = 0.5;

/// Weight of a key's own position against that of a measured frame (at most 1) in the fit of
/// positions: large enough to hold it to a millionth of a slot.
const KEY_WEIGHT: f64 = 1e6;

/// Weight of a frame whose angle says nothing; the fit needs it above 0.
const LEAST_WEIGHT: f64 = 1e-3;

/// At which silhouette of a model the next model takes over.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SwitchAt {
    /// The last one of the model, as in the paper.
    LastSilhouette,
    /// The place that keeps the frames in the middle of the model, away from its two ends, whose
    /// silhouettes are neighbours on the loop though their poses are not.
    #[default]
    Middle,
}

/// Settings of the switching models.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Switching {
    /// The partner frame of each key, in the order of the keys.
    pub partners: Vec<usize>,
    /// Period of the silhouettes (one step), frames, above 2. Default: unknown, measured from the
    /// frames' median advance.
    pub step_period_frames: Option<f64>,
    /// The model that frame 0 must lie on, 0 to 3. Model 0 begins with the pose of the earliest
    /// key (not partner); the others follow half a model on each. Default: none, the key frames
    /// decide; a value that contradicts them swaps the two halves of the stride, key frames
    /// included.
    pub start_model: Option<usize>,
    /// Where one model gives way to the next. Default: the middle.
    pub switch_at: SwitchAt,
    /// Half-width of the cross-fade between two models about a switch, slots, 0 to 0.5; with 0 the
    /// switch is hard, as in the paper, and only the active model's m poses have a weight.
    /// Default: 0.5.
    pub cross_fade_slots: f64,
}

impl Default for Switching {
    fn default() -> Self {
        Self {
            partners: Vec::new(),
            step_period_frames: None,
            start_model: None,
            switch_at: SwitchAt::Middle,
            cross_fade_slots: 0.5,
        }
    }
}

/// The poses on their cycle and each frame's place there.
struct Track {
    /// Index of the pose in each of the 2m slots.
    pose_of_slot: Vec<usize>,
    /// Position of every frame, slots, never falling.
    position: Vec<f64>,
    /// Key and partner frames that the measured phase puts into the other half.
    conflicts: Vec<usize>,
}

pub(super) fn switching_weights(
    coefficients: &Coefficients,
    keys: &[usize],
    settings: &Switching,
    kernel: &KernelSettings,
) -> Result<Weights> {
    validate(coefficients, keys, settings)?;
    let m = keys.len();
    let poses: Vec<usize> = keys.iter().chain(&settings.partners).copied().collect();
    let track = Track::of(coefficients, &poses, settings);
    let models = (0..MODELS)
        .map(|j| {
            let members: Vec<usize> =
                (0..m).map(|i| track.pose_of_slot[(j * m / 2 + i) % (2 * m)]).collect();
            let frames: Vec<usize> = members.iter().map(|&pose| poses[pose]).collect();
            Ok((Rbf::new(coefficients, &frames, kernel)?, members))
        })
        .collect::<Result<Vec<_>>>()?;
    let states = track.states(coefficients, &poses, settings.switch_at);
    let model_of = |state: i64| state.rem_euclid(MODELS as i64) as usize;
    let rows = (0..coefficients.frames())
        .map(|t| {
            let mut row = vec![0.0; 2 * m];
            for (state, share) in track.shares(t, states[t], settings) {
                let (rbf, members) = &models[model_of(state)];
                for (&pose, w) in members.iter().zip(rbf.weights_at(coefficients.point(t))) {
                    row[pose] += share * w;
                }
            }
            row
        })
        .collect();
    let active = states.iter().map(|&s| Some(model_of(s))).collect();
    Ok(Weights::new(2 * m, rows, active, track.conflicts))
}

fn validate(coefficients: &Coefficients, keys: &[usize], settings: &Switching) -> Result<()> {
    coefficients.check_finite()?;
    let frames = coefficients.frames();
    if keys.is_empty() {
        return Err(Error::NoKeys);
    }
    if !keys.len().is_multiple_of(2) {
        return Err(Error::OddKeysForSwitching { keys: keys.len() });
    }
    if settings.partners.len() != keys.len() {
        let partners = settings.partners.len();
        return Err(Error::PartnerCount { keys: keys.len(), partners });
    }
    if let Some(&frame) = keys.iter().chain(&settings.partners).find(|&&k| k >= frames) {
        return Err(Error::KeyFrameOutOfRange { frame, frames });
    }
    let refuse = |name, value, allowed| Err(Error::KernelSetting { name, value, allowed });
    match settings.step_period_frames {
        Some(p) if !(p.is_finite() && p > 2.0) => {
            return refuse("step_period_frames", p, "a number above 2");
        }
        _ => {}
    }
    match settings.start_model {
        Some(s) if s >= MODELS => return refuse("start_model", s as f64, "0, 1, 2 or 3"),
        _ => {}
    }
    if !(0.0..=WINDOW_SLOTS).contains(&settings.cross_fade_slots) {
        return refuse("cross_fade_slots", settings.cross_fade_slots, "between 0 and 0.5");
    }
    Ok(())
}

impl Track {
    /// `poses`: the m key frames, then their partners.
    fn of(coefficients: &Coefficients, poses: &[usize], settings: &Switching) -> Self {
        let m = poses.len() / 2;
        let phase = CyclePhase::measure(coefficients, settings.step_period_frames);
        let angles = phase.unwrapped_rad();
        let (pairs, knots) = cycle_of_pairs(angles, poses);
        let mut position: Vec<f64> = angles.iter().map(|&a| slot_position(a, &knots)).collect();
        // The slot of a frame whose place in the single cycle is known: the nearest such slot.
        let slot_near = |u: f64, place: usize| {
            place as i64 + m as i64 * ((u - place as f64) / m as f64).round() as i64
        };
        let mut pose_of_slot = vec![0; 2 * m];
        let mut anchors = Vec::new();
        for (place, &pair) in pairs.iter().enumerate() {
            let slot = slot_near(position[poses[pair]], place);
            let own = slot.rem_euclid(2 * m as i64) as usize;
            pose_of_slot[own] = pair;
            pose_of_slot[(own + m) % (2 * m)] = m + pair;
            anchors.push((poses[pair], slot, false));
            let slot = slot_near(position[poses[m + pair]], place);
            let agrees = (slot - own as i64 - m as i64).rem_euclid(2 * m as i64) == 0;
            anchors.push((poses[m + pair], slot, !agrees));
        }
        anchors.sort_unstable();
        let turns = half_turns(&anchors, angles);
        let mut weight: Vec<f64> = phase.weight().iter().map(|w| w.max(LEAST_WEIGHT)).collect();
        for &(frame, slot, _) in &anchors {
            position[frame] = slot as f64;
            weight[frame] = KEY_WEIGHT;
        }
        for (u, turn) in position.iter_mut().zip(&turns) {
            *u += (turn * m) as f64;
        }
        let conflicts = anchors.iter().filter(|a| a.2).map(|a| a.0).collect();
        let mut track = Self { pose_of_slot, position: rising_fit(&position, &weight), conflicts };
        if let Some(model) = settings.start_model {
            track.start_with(model);
        }
        track
    }

    /// Shifts all positions by half a stride if frame 0 would otherwise not lie on `model`.
    fn start_with(&mut self, model: usize) {
        let m = self.pose_of_slot.len() / 2;
        let Some(&first) = self.position.first() else { return };
        let from_start = (first.round() as i64 - (model * m / 2) as i64).rem_euclid(2 * m as i64);
        if from_start >= m as i64 {
            self.position.iter_mut().for_each(|u| *u += m as f64);
        }
    }

    /// The position, in slots, at which state `state` begins.
    fn switch_slot(&self, state: i64, at: SwitchAt) -> f64 {
        let m = (self.pose_of_slot.len() / 2) as f64;
        let within = match at {
            SwitchAt::LastSilhouette => m / 2.0 - 1.0,
            SwitchAt::Middle => (m / 2.0 - 1.0) / 2.0,
        };
        state as f64 * (m / 2.0) + within
    }

    /// The state of every frame: the model index, counted on without end.
    fn states(&self, coefficients: &Coefficients, poses: &[usize], at: SwitchAt) -> Vec<i64> {
        let Some(&first) = self.position.first() else { return Vec::new() };
        let half = (self.pose_of_slot.len() / 4) as f64;
        let mut state = ((first - self.switch_slot(0, at)) / half).floor() as i64;
        let mut states = vec![state; self.position.len()];
        let mut from = 1;
        while let Some(frame) = self.switch_frame(coefficients, poses, state + 1, at, from) {
            state += 1;
            states[frame..].fill(state);
            from = frame;
        }
        states
    }

    /// The frame, `from` or later, at which `state` begins; `None` when the clip ends before.
    fn switch_frame(
        &self,
        coefficients: &Coefficients,
        poses: &[usize],
        state: i64,
        at: SwitchAt,
        from: usize,
    ) -> Option<usize> {
        let due = self.switch_slot(state, at);
        let late = (from..self.position.len()).find(|&t| self.position[t] >= due)?;
        if due.fract() != 0.0 {
            return Some(late);
        }
        let slot = (due as i64).rem_euclid(self.pose_of_slot.len() as i64) as usize;
        let silhouette = coefficients.point(poses[self.pose_of_slot[slot]]);
        let distance = |t: usize| distance_sq(coefficients.point(t), silhouette);
        (from..self.position.len())
            .skip_while(|&t| self.position[t] <= due - WINDOW_SLOTS)
            .take_while(|&t| self.position[t] < due + WINDOW_SLOTS)
            .min_by(|&a, &b| distance(a).total_cmp(&distance(b)).then(a.cmp(&b)))
            .or(Some(late))
    }

    /// The states that frame `t` mixes, with their shares.
    fn shares(&self, t: usize, state: i64, settings: &Switching) -> Vec<(i64, f64)> {
        let fade = settings.cross_fade_slots;
        let u = self.position[t];
        for next in [state, state + 1] {
            let x = u - self.switch_slot(next, settings.switch_at);
            if fade > 0.0 && x.abs() < fade {
                let s = (x + fade) / (2.0 * fade);
                let share = s * s * (3.0 - 2.0 * s);
                return vec![(next - 1, 1.0 - share), (next, share)];
            }
        }
        vec![(state, 1.0)]
    }
}

/// The pairs (key, partner) in cycle order, from the earliest key on, and the angle of each past
/// that of the first, radians in [0, 2π), with the absolute angle of the first.
fn cycle_of_pairs(angles: &[f64], poses: &[usize]) -> (Vec<usize>, (f64, Vec<f64>)) {
    let m = poses.len() / 2;
    // Key and partner look alike up to noise: the middle of the two is the better estimate.
    let middle = |i: usize| {
        let (key, partner) = (angles[poses[i]], angles[poses[m + i]]);
        key + wrapped(partner - key) / 2.0
    };
    let first = (0..m).min_by_key(|&i| poses[i]).unwrap_or(0);
    let origin = middle(first);
    let mut placed: Vec<(f64, usize)> = (0..m)
        .map(|i| (if i == first { 0.0 } else { (middle(i) - origin).rem_euclid(TAU) }, i))
        .collect();
    placed.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1 != first, a.1).cmp(&(b.1 != first, b.1))));
    let (knots, pairs) = placed.into_iter().unzip();
    (pairs, (origin, knots))
}

/// The position in slots of an unwrapped angle: linear between the keys' angles, m slots a turn.
fn slot_position(angle: f64, (origin, knots): &(f64, Vec<f64>)) -> f64 {
    let m = knots.len();
    let turn = ((angle - origin) / TAU).floor();
    let rest = angle - origin - turn * TAU;
    let place = knots.partition_point(|&k| k <= rest).max(1) - 1;
    let end = knots.get(place + 1).copied().unwrap_or(TAU);
    let width = end - knots[place];
    let share = if width > 0.0 { ((rest - knots[place]) / width).clamp(0.0, 1.0) } else { 0.0 };
    turn * m as f64 + place as f64 + share
}

/// How many half strides are to be added to each frame's position so that every anchor
/// (frame, slot, whether the phase is in conflict there) stands in its own half.
///
/// About an anchor in conflict the count rises by one half a turn before it and once more half a
/// turn after it, or midway to the next anchor where that is nearer: elsewhere the phase is
/// believed, since on planted clips it loses no turn in eighty while a partner is easily misnamed.
fn half_turns(anchors: &[(usize, i64, bool)], angles: &[f64]) -> Vec<usize> {
    let mut turns = vec![0; angles.len()];
    for (i, &(frame, _, conflict)) in anchors.iter().enumerate() {
        if !conflict {
            continue;
        }
        let earliest = if i > 0 { (anchors[i - 1].0 + frame).div_ceil(2) } else { 0 };
        let latest = anchors.get(i + 1).map_or(angles.len(), |next| (frame + next.0).div_ceil(2));
        let near = |t: &usize| (angles[*t] - angles[frame]).abs() < PI;
        let start = (earliest..frame).rev().take_while(near).last().unwrap_or(frame);
        let end = (frame..latest).take_while(near).last().unwrap_or(frame) + 1;
        turns[start..].iter_mut().for_each(|n| *n += 1);
        turns[end..].iter_mut().for_each(|n| *n += 1);
    }
    turns
}

#[cfg(test)]
mod tests;
