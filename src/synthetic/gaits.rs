//! Walk, trot, canter and gallop of the horse.
//!
//! Footfall order, duty factors and limb phases follow the published literature; bodies and legs
//! are posed so that the feet keep to them. Phases are shares of the stride after the reference
//! hind foot's contact.
//!
//! Sources: Robilliard, Pfau, Wilson 2007, *Gait characterisation and classification in horses*, J.
//! Exp. Biol. 210, 187–197 (duty factors and phases over speed for all gaits); Hildebrand 1965
//! (advanced placements of walk and trot); Muybridge, *Descriptive Zoopraxography* (order of the
//! feet, transverse gallop); Serra Bragança et al. 2020 (footfall diagrams, stride durations).
//! Heights of the hooves, pitch of the body and the nod of the neck were set by eye within what
//! side views of horses show.

use std::f64::consts::TAU;
use std::fmt;
use std::str::FromStr;

use nalgebra::{UnitQuaternion, Vector3};

use super::horse::{
    FORE_LEFT, FORE_RIGHT, HIND_LEFT, HIND_RIGHT, IN_PLANE_ANGLES, leg_chain, rest_place,
};
use super::legs::{LegTask, rotated, solve};
use crate::rig::{NodePose, Pose, Skeleton};

/// A gait of the horse.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Gait {
    /// Four beats, lateral sequence, at least two feet down.
    Walk,
    /// Two beats, diagonal pairs, suspension between.
    Trot,
    /// Three beats on the left lead, then suspension.
    Canter,
    /// Transverse, four beats on the left lead, then suspension.
    Gallop,
}

/// A foot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Foot {
    /// Left hind.
    LeftHind,
    /// Left fore.
    LeftFore,
    /// Right hind.
    RightHind,
    /// Right fore.
    RightFore,
}

impl Foot {
    /// All feet, in the order of a lateral-sequence walk.
    pub const ALL: [Foot; 4] = [Foot::LeftHind, Foot::LeftFore, Foot::RightHind, Foot::RightFore];

    pub(super) fn first_joint(self) -> usize {
        match self {
            Foot::LeftHind => HIND_LEFT,
            Foot::LeftFore => FORE_LEFT,
            Foot::RightHind => HIND_RIGHT,
            Foot::RightFore => FORE_RIGHT,
        }
    }

    fn is_fore(self) -> bool {
        matches!(self, Foot::LeftFore | Foot::RightFore)
    }
}

/// A moment of a stride.
#[derive(Clone, Debug, PartialEq)]
pub struct StridePose {
    /// The local transform of every node of [`horse`](super::horse).
    pub pose: Pose,
    /// The in-plane angle of each joint, radians.
    pub angles_rad: [f64; IN_PLANE_ANGLES],
}

/// What makes a gait.
struct Plan {
    /// Stride duration, seconds.
    stride_s: f64,
    /// Contact of each foot (order of [`Foot::ALL`]), share of the stride.
    contact: [f64; 4],
    /// Share of the stride each fore and hind foot is down.
    duty_fore: f64,
    duty_hind: f64,
    /// Way of the body while a foot is down, metres.
    stance_m: f64,
    /// Highest point of the toe's way in swing, metres.
    lift_fore: f64,
    lift_hind: f64,
    /// How far the legs are folded in swing, as a share of a galloping horse's.
    fold: f64,
    /// Mean and first two harmonics of body height (metres), pitch, lumbar and thorax flexion, and
    /// neck (radians): mean, (amplitude, phase) of once and twice a stride.
    height: Curve,
    pitch: Curve,
    lumbar: Curve,
    neck: Curve,
}

/// mean + a₁ cos τ(φ − φ₁) + a₂ cos 2τ(φ − φ₂).
struct Curve {
    mean: f64,
    once: (f64, f64),
    twice: (f64, f64),
}

impl Curve {
    fn at(&self, phase: f64) -> f64 {
        self.mean
            + self.once.0 * (TAU * (phase - self.once.1)).cos()
            + self.twice.0 * (2.0 * TAU * (phase - self.twice.1)).cos()
    }
}

impl Gait {
    /// All gaits, slowest first.
    pub const ALL: [Gait; 4] = [Gait::Walk, Gait::Trot, Gait::Canter, Gait::Gallop];

    /// The name in commands and files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Gait::Walk => "walk",
            Gait::Trot => "trot",
            Gait::Canter => "canter",
            Gait::Gallop => "gallop",
        }
    }

    /// Stride duration, seconds.
    #[must_use]
    pub fn stride_s(self) -> f64 {
        self.plan().stride_s
    }

    /// Ground speed, metres a second: the way of a stance over its time.
    #[must_use]
    pub fn speed_m_s(self) -> f64 {
        let plan = self.plan();
        plan.stance_m / (plan.duty_hind * plan.stride_s)
    }

    /// Whether left and right do the same half a stride apart.
    #[must_use]
    pub fn is_symmetric(self) -> bool {
        matches!(self, Gait::Walk | Gait::Trot)
    }

    /// When a foot comes down, and for what share of the stride it stays.
    #[must_use]
    pub fn stance(self, foot: Foot) -> (f64, f64) {
        let plan = self.plan();
        let at = Foot::ALL.iter().position(|f| *f == foot).unwrap_or(0);
        (plan.contact[at], if foot.is_fore() { plan.duty_fore } else { plan.duty_hind })
    }

    fn plan(self) -> Plan {
        let curve = |mean, once, twice| Curve { mean, once, twice };
        let none = (0.0, 0.0);
        match self {
            Gait::Walk => Plan {
                stride_s: 1.12,
                contact: [0.0, 0.25, 0.5, 0.75],
                duty_fore: 0.62,
                duty_hind: 0.62,
                stance_m: 1.02,
                lift_fore: 0.11,
                lift_hind: 0.09,
                fold: 0.62,
                height: curve(-0.035, none, (0.012, 0.06)),
                pitch: curve(0.0, none, (0.010, 0.2)),
                lumbar: curve(0.0, none, (0.010, 0.1)),
                neck: curve(0.05, none, (0.07, 0.32)),
            },
            Gait::Trot => Plan {
                stride_s: 0.74,
                contact: [0.0, 0.5, 0.5, 0.0],
                duty_fore: 0.42,
                duty_hind: 0.42,
                stance_m: 1.02,
                lift_fore: 0.28,
                lift_hind: 0.22,
                fold: 0.8,
                height: curve(-0.03, none, (0.035, 0.46)),
                pitch: curve(0.0, none, (0.008, 0.2)),
                lumbar: curve(0.0, none, (0.012, 0.1)),
                neck: curve(-0.05, none, (0.03, 0.2)),
            },
            // Left lead: right hind, left hind with right fore, left fore.
            Gait::Canter => Plan {
                stride_s: 0.60,
                contact: [0.22, 0.46, 0.0, 0.22],
                duty_fore: 0.36,
                duty_hind: 0.38,
                stance_m: 1.10,
                lift_fore: 0.30,
                lift_hind: 0.22,
                fold: 0.78,
                height: curve(-0.03, (0.055, 0.90), none),
                pitch: curve(0.0, (0.10, 0.52), none),
                lumbar: curve(0.0, (0.09, 0.86), none),
                neck: curve(0.0, (0.12, 0.48), none),
            },
            // Left lead: right hind, left hind, right fore, left fore, suspension.
            Gait::Gallop => Plan {
                stride_s: 0.45,
                contact: [0.12, 0.50, 0.0, 0.38],
                duty_fore: 0.24,
                duty_hind: 0.25,
                stance_m: 1.22,
                lift_fore: 0.40,
                lift_hind: 0.34,
                fold: 1.0,
                height: curve(-0.05, (0.055, 0.87), none),
                pitch: curve(0.0, (0.085, 0.50), none),
                lumbar: curve(0.0, (0.15, 0.86), none),
                neck: curve(0.22, (0.17, 0.48), none),
            },
        }
    }

    /// The horse at a phase of the stride (cycles; whole numbers are the contact of the reference
    /// hind foot).
    #[must_use]
    pub fn pose(self, skeleton: &Skeleton, phase_cycles: f64) -> StridePose {
        let phase = phase_cycles.rem_euclid(1.0);
        let plan = self.plan();
        let mut angles = [0.0; IN_PLANE_ANGLES];
        self.set_trunk(&plan, phase, &mut angles);
        let height = plan.height.at(phase);
        for foot in Foot::ALL {
            let first = foot.first_joint();
            let solved = self.leg(&plan, foot, phase, height, &angles);
            angles[first..first + solved.len()].copy_from_slice(&solved);
        }
        let mut pose = skeleton.rest_pose();
        pose.nodes[0].translation.y += height;
        for (joint, angle) in angles.iter().enumerate() {
            let rotation = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), *angle);
            pose.nodes[joint + 1] = NodePose { rotation, ..pose.nodes[joint + 1] };
        }
        StridePose { pose, angles_rad: angles }
    }

    fn set_trunk(self, plan: &Plan, phase: f64, angles: &mut [f64; IN_PLANE_ANGLES]) {
        let (pitch, lumbar) = (plan.pitch.at(phase), plan.lumbar.at(phase));
        let neck = plan.neck.at(phase);
        // Flexion of the back is shared: the pelvis tucks under, the loin bends, the chest turns back
        // to carry the fore legs.
        angles[0] = pitch - 0.5 * lumbar;
        angles[1] = 0.8 * lumbar;
        angles[2] = 0.2 * lumbar;
        let carried = angles[0] + angles[1] + angles[2];
        angles[3] = 0.55 * neck - 0.5 * carried;
        angles[4] = 0.25 * neck;
        angles[5] = 0.2 * neck;
        // The head stays steadier in space than the neck that carries it.
        angles[6] = -0.6 * neck - 0.3 * carried;
        angles[7] = 0.02 + 0.02 * (TAU * phase).cos();
        angles[8] = -0.15 + 0.05 * (TAU * phase).sin();
        angles[9] = -0.15 + 0.05 * (TAU * phase).cos();
        let speed = self.speed_m_s() / 12.0;
        for (segment, share) in [0.5, 0.25, 0.15, 0.1].into_iter().enumerate() {
            // The faster, the higher the tail streams; each piece follows the one before it late.
            let swing = 0.10 * (TAU * (phase - 0.08 * segment as f64)).cos() * (0.3 + speed);
            angles[10 + segment] = share * 1.1 * speed + swing * (0.5 + 0.3 * segment as f64);
        }
    }

    fn leg(
        self,
        plan: &Plan,
        foot: Foot,
        phase: f64,
        height: f64,
        angles: &[f64; IN_PLANE_ANGLES],
    ) -> Vec<f64> {
        let first = foot.first_joint();
        let chain = leg_chain(first);
        let (root, root_angle) = carried_place(first, height, angles);
        let (contact, duty) = self.stance(foot);
        let since = (phase - contact).rem_euclid(1.0);
        let step = ToeWay { plan, duty, fore: foot.is_fore() };
        let rest_toe = chain[chain.len() - 1].0;
        let (toe, pitch, flexed) = step.at(since, rest_toe);
        let style = leg_style(foot.is_fore(), since, duty, plan.fold * flexed);
        let (stiffness, limits) = leg_nature(foot.is_fore());
        solve(&LegTask {
            chain: &chain,
            root,
            root_angle,
            toe,
            pitch,
            style: &style,
            stiffness: &stiffness,
            limits: &limits,
        })
    }
}

/// Where a joint is carried by the trunk: its place (z, y) and the sum of its ancestors' angles.
fn carried_place(joint: usize, height: f64, angles: &[f64; IN_PLANE_ANGLES]) -> ((f64, f64), f64) {
    let (at, ancestors) = rest_place(joint);
    let mut place = at;
    let mut turned = 0.0;
    // From the nearest ancestor up: what hangs on a joint is turned about it.
    for &ancestor in &ancestors {
        let (pivot, _) = rest_place(ancestor);
        let arm = (place.0 - pivot.0, place.1 - pivot.1);
        let moved = rotated(arm, angles[ancestor]);
        place = (pivot.0 + moved.0, pivot.1 + moved.1);
        turned += angles[ancestor];
    }
    ((place.0, place.1 + height), turned)
}

/// The way of a toe relative to the body.
struct ToeWay<'a> {
    plan: &'a Plan,
    duty: f64,
    fore: bool,
}

impl ToeWay<'_> {
    /// Toe (z, y), pitch of the hoof, and how far the leg is folded (0…1), `since` a share of the
    /// stride after contact.
    fn at(&self, since: f64, rest_z: f64) -> ((f64, f64), f64, f64) {
        let half = self.plan.stance_m / 2.0;
        let middle = rest_z + if self.fore { -0.06 } else { 0.04 };
        if since < self.duty {
            let along = since / self.duty;
            let z = middle + half - 2.0 * half * along;
            // In the last fifth of the stance the heel rises over the toe.
            let lift = ((along - 0.8) / 0.2).max(0.0);
            return ((z, 0.0), 0.5 * lift * lift, 0.0);
        }
        let along = (since - self.duty) / (1.0 - self.duty);
        // A cubic from lift-off to contact with the ground's speed at both ends, so that the toe
        // neither jerks off the ground nor skids onto it.
        let slope = -2.0 * half * (1.0 - self.duty) / self.duty;
        let (s2, s3) = (along * along, along.powi(3));
        let z = middle - half * (2.0 * s3 - 3.0 * s2 + 1.0)
            + half * (3.0 * s2 - 2.0 * s3)
            + 0.5 * slope * ((s3 - 2.0 * s2 + along) + (s3 - s2));
        let lift = if self.fore { self.plan.lift_fore } else { self.plan.lift_hind };
        // sin² leaves and meets the ground without a vertical jump of speed; the bend of the phase
        // puts the highest point into the first half of the swing.
        let bent = along.powf(0.8);
        let folded = (std::f64::consts::PI * bent).sin().powi(2);
        let pitch =
            0.5 * (1.0 - along).powi(2) + 0.9 * folded - 0.12 * along * along * (1.0 - along) * 4.0;
        ((z, lift * folded), pitch, folded)
    }
}

/// Wanted joint angles: straight in stance, folded in swing.
fn leg_style(fore: bool, since: f64, duty: f64, folded: f64) -> Vec<f64> {
    // −1 reaching forward at contact, 1 pushing back at lift-off, and back in swing.
    let swing = if since < duty {
        2.0 * since / duty - 1.0
    } else {
        (std::f64::consts::PI * (since - duty) / (1.0 - duty)).cos()
    };
    if fore {
        vec![
            0.14 * swing,
            0.10 * swing + 0.10 * folded,
            0.12 * swing - 0.55 * folded,
            1.15 * folded,
            0.10 + 0.75 * folded - 0.15 * (1.0 - folded),
            0.2 * folded,
        ]
    } else {
        vec![
            0.30 * swing - 0.25 * folded,
            0.60 * folded,
            -0.65 * folded,
            0.55 * folded,
            0.2 * folded,
        ]
    }
}

/// Stiffness of each joint against its style, and its limits. The scapula slides little; stifle and
/// tarsus move together (the reciprocal apparatus), which equal stiffness and opposite signs of
/// their styles imitate; the carpus does not bend forward past straight.
#[allow(clippy::type_complexity, reason = "two lists, taken apart at once by the one caller")]
fn leg_nature(fore: bool) -> (Vec<f64>, Vec<(f64, f64)>) {
    if fore {
        (
            vec![3.0, 1.5, 1.0, 1.2, 1.0, 1.0],
            vec![(-0.3, 0.3), (-0.7, 0.7), (-1.2, 0.8), (-0.06, 1.9), (-0.75, 1.3), (-0.5, 0.9)],
        )
    } else {
        (
            vec![1.0, 1.2, 1.2, 1.0, 1.0],
            vec![(-1.0, 0.8), (-0.5, 1.5), (-1.5, 0.5), (-0.7, 1.3), (-0.5, 0.9)],
        )
    }
}

impl fmt::Display for Gait {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Says which gaits there are.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnknownGait(String);

impl fmt::Display for UnknownGait {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "no gait «{}»; there are walk, trot, canter and gallop", self.0)
    }
}

impl std::error::Error for UnknownGait {}

impl FromStr for Gait {
    type Err = UnknownGait;

    fn from_str(name: &str) -> Result<Self, UnknownGait> {
        let found = Gait::ALL.into_iter().find(|g| g.name().eq_ignore_ascii_case(name));
        found.ok_or_else(|| UnknownGait(name.to_owned()))
    }
}

#[cfg(test)]
mod tests;
