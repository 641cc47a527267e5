//! Duty factors, limb phases and the gait's name, from contacts.
//!
//! Orders and limits follow Hildebrand 1965 (symmetric gaits by the lag of a fore foot behind the hind foot
//! of its side), Robilliard, Pfau and Wilson 2007 (canter and gallop), and Muybridge's orders of the feet.

use std::f64::consts::TAU;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::contacts::Footfalls;
use super::find::FootTrack;
use crate::numeric::median;

/// How far a limb phase may be off, as a share of the stride: the eighth that separates Hildebrand's named
/// gaits, less what a contact seen at 25 frames a second may be wrong.
const SLACK: f64 = 0.1;

/// Which limb a foot belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Limb {
    /// The left hind foot, which phases are counted from.
    LeftHind,
    /// The left fore foot.
    LeftFore,
    /// The right hind foot.
    RightHind,
    /// The right fore foot.
    RightFore,
    /// The left foot of a biped.
    Left,
    /// The right foot of a biped.
    Right,
    /// A foot of an animal with another number of feet.
    Other,
}

impl Limb {
    /// The limb in words.
    #[must_use]
    pub fn words(self) -> &'static str {
        match self {
            Limb::LeftHind => "left hind",
            Limb::LeftFore => "left fore",
            Limb::RightHind => "right hind",
            Limb::RightFore => "right fore",
            Limb::Left => "left",
            Limb::Right => "right",
            Limb::Other => "foot",
        }
    }
}

/// What one limb does in a stride.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LimbReport {
    /// Which limb.
    pub limb: Limb,
    /// Share of the stride that the foot is down; null when no stance is whole.
    pub duty_factor: Option<f64>,
    /// When it comes down, share of the stride after the first limb of the list.
    pub phase: Option<f64>,
}

/// The gait.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GaitReport {
    /// One entry a foot, in the order of the feet.
    pub limbs: Vec<LimbReport>,
    /// "walk", "amble", "pace", "trot", "canter", "transverse gallop", "rotary gallop", "bound", "pronk",
    /// "half-bound", "diagonal-sequence walk"; of bipeds "walk", "run", "hop"; null when none of them.
    pub name: Option<String>,
    /// Why the order of the feet should be looked at, in words.
    pub warning: Option<String>,
    /// Frames a stride.
    pub stride_frames: f64,
}

/// Names the gait of feet whose soles go along `tracks`. `None` when no foot comes down twice, or in a
/// loop once.
#[must_use]
pub fn gait_report(tracks: &[FootTrack], falls: &Footfalls) -> Option<GaitReport> {
    let stride = stride_frames(falls)?;
    let limbs = limbs(tracks, &falls.forward);
    let reference = (0..limbs.len()).min_by_key(|&i| limbs[i])?;
    let reports: Vec<LimbReport> = (limbs.iter().zip(&falls.contacts))
        .map(|(&limb, contacts)| {
            let whole: Vec<f64> = contacts
                .iter()
                .filter(|c| c.whole)
                .map(|c| (c.up_frame - c.down_frame) / stride)
                .collect();
            let phase =
                circular_mean(contacts.iter().filter(|c| c.whole || c.first > 0).flat_map(|c| {
                    let references =
                        falls.contacts[reference].iter().filter(|r| r.whole || r.first > 0);
                    references.map(move |r| (c.down_frame - r.down_frame) / stride)
                }));
            let duty_factor =
                (!whole.is_empty()).then(|| whole.iter().sum::<f64>() / whole.len() as f64);
            LimbReport { limb, duty_factor, phase }
        })
        .collect();
    let (name, warning) = named(&reports);
    Some(GaitReport {
        limbs: reports,
        name: name.map(str::to_owned),
        warning,
        stride_frames: stride,
    })
}

/// The median time from one contact of a foot to its next.
fn stride_frames(falls: &Footfalls) -> Option<f64> {
    let n = falls.frames as f64;
    let mut all = Vec::new();
    for contacts in &falls.contacts {
        let begun: Vec<f64> =
            contacts.iter().filter(|c| falls.looped || c.first > 0).map(|c| c.down_frame).collect();
        all.extend(begun.windows(2).map(|w| w[1] - w[0]));
        if let (true, Some(first), Some(last)) = (falls.looped, begun.first(), begun.last()) {
            all.push(first + n - last);
        }
    }
    (!all.is_empty()).then(|| median(&all)).filter(|s| *s > 1.0)
}

/// Fore and hind by where the feet are along the way, left and right by where they are across it.
fn limbs(tracks: &[FootTrack], forward: &Vector3<f64>) -> Vec<Limb> {
    let left = Vector3::y().cross(forward);
    let middle = |t: &FootTrack| {
        t.soles.iter().map(|p| p.coords).sum::<Vector3<f64>>() / t.soles.len().max(1) as f64
    };
    let places: Vec<Vector3<f64>> = tracks.iter().map(middle).collect();
    let mut found = vec![Limb::Other; places.len()];
    let order = |axis: &Vector3<f64>, of: &[usize]| {
        let mut sorted = of.to_vec();
        sorted.sort_by(|&a, &b| places[a].dot(axis).total_cmp(&places[b].dot(axis)));
        sorted
    };
    let all: Vec<usize> = (0..places.len()).collect();
    match places.len() {
        2 => {
            let across = order(&left, &all);
            (found[across[0]], found[across[1]]) = (Limb::Right, Limb::Left);
        }
        4 => {
            let along = order(forward, &all);
            for (pair, names) in [
                (&along[..2], [Limb::RightHind, Limb::LeftHind]),
                (&along[2..], [Limb::RightFore, Limb::LeftFore]),
            ] {
                for (foot, name) in order(&left, pair).into_iter().zip(names) {
                    found[foot] = name;
                }
            }
        }
        _ => {}
    }
    found
}

/// Mean of numbers of which whole ones are the same, 0 to 1; `None` of an empty list.
fn circular_mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (mut sin, mut cos, mut count) = (0.0, 0.0, 0_usize);
    for v in values {
        sin += (TAU * v).sin();
        cos += (TAU * v).cos();
        count += 1;
    }
    // Rounding must not make one of nothing.
    (count > 0).then(|| (sin.atan2(cos) / TAU + 1e-12).rem_euclid(1.0))
}

/// Distance of two phases on the circle.
fn apart(a: f64, b: f64) -> f64 {
    let d = (a - b).rem_euclid(1.0);
    d.min(1.0 - d)
}

fn named(limbs: &[LimbReport]) -> (Option<&'static str>, Option<String>) {
    let phase = |limb: Limb| limbs.iter().find(|l| l.limb == limb).and_then(|l| l.phase);
    let duties: Vec<f64> = limbs.iter().filter_map(|l| l.duty_factor).collect();
    let duty =
        if duties.is_empty() { 0.5 } else { duties.iter().sum::<f64>() / duties.len() as f64 };
    if let (Some(left), Some(right)) = (phase(Limb::Left), phase(Limb::Right)) {
        let gap = apart(left, right);
        return match gap {
            g if g < SLACK => (Some("hop"), None),
            g if g > 0.5 - 1.5 * SLACK => (Some(if duty >= 0.5 { "walk" } else { "run" }), None),
            _ => (None, Some(unusual("the feet are neither together nor half a stride apart"))),
        };
    }
    let all = [Limb::LeftHind, Limb::LeftFore, Limb::RightHind, Limb::RightFore].map(phase);
    let [Some(lh), Some(lf), Some(rh), Some(rf)] = all else {
        let lacking = limbs.iter().any(|l| l.phase.is_none());
        return (None, lacking.then(|| "a foot never comes down".to_owned()));
    };
    quadruped(lh, lf, rh, rf, duty)
}

fn quadruped(
    lh: f64,
    lf: f64,
    rh: f64,
    rf: f64,
    duty: f64,
) -> (Option<&'static str>, Option<String>) {
    let (hind, fore) = (apart(lh, rh), apart(lf, rf));
    let alternate = |gap: f64| gap > 0.5 - SLACK;
    if alternate(hind) && alternate(fore) {
        // Lag of the fore foot behind the hind foot of its side, mean of both sides.
        let lag = circular_mean([lf - lh, rf - rh].into_iter()).unwrap_or(0.0);
        return match lag {
            l if !(0.125..0.875).contains(&l) => (Some("pace"), None),
            l if l < 0.375 => (Some(if duty >= 0.5 { "walk" } else { "amble" }), None),
            l if l < 0.625 => (Some("trot"), None),
            _ => (Some("diagonal-sequence walk"), None),
        };
    }
    if alternate(hind) || alternate(fore) {
        let which = if alternate(hind) {
            "hind feet alternate while the fore feet do not"
        } else {
            "fore feet alternate while the hind feet do not"
        };
        return (None, Some(unusual(&format!("the {which}"))));
    }
    if hind < 0.5 * SLACK && fore < 0.5 * SLACK {
        return (Some(if apart(lh, lf) < SLACK { "pronk" } else { "bound" }), None);
    }
    if hind < 0.5 * SLACK {
        return (Some("half-bound"), None);
    }
    // The trailing foot of a pair comes down shortly before the leading one.
    let trails = |a: f64, b: f64| (b - a).rem_euclid(1.0) < 0.5;
    let left_hind_trails = trails(lh, rh);
    let left_fore_trails = trails(lf, rf);
    let (trailing_hind, leading_hind) = if left_hind_trails { (lh, rh) } else { (rh, lh) };
    let (first_fore, last_fore) = if left_fore_trails { (lf, rf) } else { (rf, lf) };
    let after = |p: f64| (p - trailing_hind).rem_euclid(1.0);
    let same_lead = left_hind_trails == left_fore_trails;
    if same_lead
        && apart(leading_hind, first_fore) < SLACK
        && after(last_fore) > after(leading_hind)
    {
        return (Some("canter"), None);
    }
    if after(leading_hind) < after(first_fore) && after(first_fore) < after(last_fore) {
        return (Some(if same_lead { "transverse gallop" } else { "rotary gallop" }), None);
    }
    (None, Some(unusual("a fore foot comes down between the hind feet")))
}

fn unusual(what: &str) -> String {
    format!(
        "no animal is known to order its feet so: {what}; look at the poses of the keys and their partners"
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::feet::Contact;

    /// A stride of 40 frames with contacts at the given phases (left hind, left fore, right hind, right
    /// fore) as a loop, the animal going along +Z.
    fn report(contact: [f64; 4], duty: f64) -> GaitReport {
        let contacts = contact
            .map(|p| {
                let (down, up) = (40.0 * p, 40.0 * (p + duty));
                vec![Contact {
                    first: down.ceil() as usize,
                    last: up as usize,
                    down_frame: down,
                    up_frame: up,
                    whole: true,
                }]
            })
            .to_vec();
        let falls =
            Footfalls { contacts, forward: Vector3::z(), speed: 1.0, frames: 40, looped: true };
        let at = |x: f64, z: f64| FootTrack {
            soles: vec![nalgebra::Point3::new(x, 0.0, z)],
            heights: vec![0.0],
            leg_length: 1.0,
        };
        gait_report(&[at(0.1, -0.5), at(0.1, 0.5), at(-0.1, -0.5), at(-0.1, 0.5)], &falls).unwrap()
    }

    #[test]
    fn the_published_orders_have_their_names() {
        for (contact, duty, name) in [
            ([0.0, 0.25, 0.5, 0.75], 0.62, "walk"),
            ([0.0, 0.22, 0.5, 0.72], 0.4, "amble"),
            ([0.0, 0.5, 0.5, 0.0], 0.42, "trot"),
            ([0.0, 0.04, 0.5, 0.54], 0.42, "pace"),
            ([0.22, 0.46, 0.0, 0.22], 0.37, "canter"),
            ([0.0, 0.22, 0.22, 0.46], 0.37, "canter"),
            ([0.12, 0.50, 0.0, 0.38], 0.24, "transverse gallop"),
            ([0.0, 0.38, 0.12, 0.50], 0.24, "transverse gallop"),
            ([0.12, 0.38, 0.0, 0.50], 0.2, "rotary gallop"),
            ([0.0, 0.5, 0.02, 0.52], 0.3, "bound"),
            ([0.0, 0.4, 0.02, 0.55], 0.3, "half-bound"),
            ([0.0, 0.75, 0.5, 0.25], 0.62, "diagonal-sequence walk"),
        ] {
            let found = report(contact, duty);
            assert_eq!(found.name.as_deref(), Some(name), "{contact:?}");
            assert_eq!(found.warning, None);
            assert!((found.stride_frames - 40.0).abs() < 1e-9);
            for (limb, wanted) in found.limbs.iter().zip(contact) {
                assert!(apart(limb.phase.unwrap(), wanted - contact[0]) < 1e-9);
                assert!((limb.duty_factor.unwrap() - duty).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn orders_that_no_animal_uses_are_warned_of() {
        for contact in [[0.0, 0.5, 0.5, 0.52], [0.0, 0.0, 0.02, 0.5], [0.0, 0.1, 0.25, 0.4]] {
            let found = report(contact, 0.3);
            assert_eq!(found.name, None, "{contact:?}");
            assert!(found.warning.unwrap().contains("no animal"));
        }
    }
}
