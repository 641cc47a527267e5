//! Poses in which a foot that is down stays where it is.

use nalgebra::{Matrix4, Point3, UnitQuaternion, Vector3};

use super::contacts::{Contact, Footfalls};
use super::find::{Foot, foot_tracks};
use super::ik::{orthonormal, reach_bending};
use crate::rig::{Clip, Skeleton, rotation_vector};

/// A foot that a leg cannot bring nearer to its place than this share of the leg's length is not held:
/// its contact is shortened to the frames in which it can. Half of what may slide.
const LEAVES_AT: f64 = 0.004;

/// … and not where that would lift or lower it by more than this: it is still coming down, or already leaves.
const FARTHEST_RISE: f64 = 0.04;

/// Longest swing over which what a foot was moved by goes straight from one contact to the next, seconds: a little
/// more than that of a walking horse's foot.
const LONGEST_SWING_S: f64 = 0.8;

/// Longest blend in and out of a contact whose swing is longer, or that has none on one side, seconds.
const LONGEST_BLEND_S: f64 = 0.25;

/// A foot is not held where that would move it by more than this share of its leg: its contact is shortened.
/// Hand-made cycles need .10 to .18; beyond, legs are torn about (angular accelerations double and treble).
const FARTHEST_SHIFT: f64 = 0.15;

/// How often a contact may lose frames to legs that are too short for it.
const SHORTENINGS: usize = 6;

/// A leg is stretched freely as far as it is anywhere in the clip, but to this share of its length at most …
const STRETCH_EASES_AT: f64 = 0.985;

/// … and beyond that by less than this share.
const STRETCH_ROOM: f64 = 0.015;

/// What planting did.
#[derive(Clone, Debug, PartialEq)]
pub struct Planted {
    /// The contacts that are held; a contact may have lost frames at its ends.
    pub contacts: Vec<Vec<Contact>>,
    /// Way of each sole over the ground from the first to any later frame of a contact, the largest, as a
    /// share of the leg's length, before and after; the contacts that are held.
    pub slide: [f64; 2],
    /// Largest angular acceleration of any joint of a leg, degrees a second squared, before and after.
    pub acceleration_deg_s2: [f64; 2],
    /// Root mean square of the same over joints and frames.
    pub rms_acceleration_deg_s2: [f64; 2],
    /// Largest way that a foot was moved, as a share of its leg's length.
    pub largest_shift: f64,
}

/// Plants the feet of a clip in place: during each contact the sole moves with the ground, that is by
/// −speed · forward, from where it was on average; over the swing what it was moved by goes from one contact's to the
/// next one's with continuous speed and as little acceleration as can be (over a long swing it fades out and in). The leg follows by inverse kinematics, the foot keeps its direction in space.
///
/// Of a loop the last pose stays the first.
///
/// # Panics
/// When the clip's poses have not one entry for each node of the skeleton.
#[must_use]
pub fn plant(skeleton: &Skeleton, clip: &mut Clip, feet: &[Foot], falls: &Footfalls) -> Planted {
    let before = clip.clone();
    let mut contacts = falls.contacts.clone();
    let tracks = foot_tracks(skeleton, &before.poses, feet);
    let mut largest_shift: f64 = 0.0;
    for (at, foot) in feet.iter().enumerate() {
        near(&mut contacts[at], &tracks[at].soles, falls, clip.fps, foot.leg_length);
        let habit = Habit::of(skeleton, &before, foot);
        // A contact that loses frames changes the blends about it: once more with what is left.
        for round in 0..=SHORTENINGS {
            let shifts = shifts(&tracks[at].soles, &contacts[at], falls, clip.fps);
            let missed = place(skeleton, clip, &before, (foot, &habit), &tracks[at].soles, &shifts);
            let shortened = round < SHORTENINGS
                && shorten(&mut contacts[at], &missed, falls, LEAVES_AT * foot.leg_length);
            if !shortened {
                let most = shifts.iter().map(Vector3::norm).fold(0.0, f64::max);
                largest_shift = largest_shift.max(most / foot.leg_length);
                break;
            }
        }
        drive(clip, foot);
    }
    if falls.looped
        && let Some(first) = clip.poses.first().cloned()
        && let Some(last) = clip.poses.last_mut()
    {
        *last = first;
    }
    let slide = [&before, &*clip].map(|c| slide(skeleton, c, feet, &contacts, falls));
    let accelerations = [&before, &*clip].map(|c| accelerations(c, feet, falls.looped));
    Planted {
        contacts,
        slide,
        acceleration_deg_s2: accelerations.map(|a| a.0),
        rms_acceleration_deg_s2: accelerations.map(|a| a.1),
        largest_shift,
    }
}

/// Shortens contacts until no frame of them is too far from where it would be held. The end that is farther goes
/// first, since the place is the mean of what is left.
fn near(contacts: &mut [Contact], track: &[Point3<f64>], falls: &Footfalls, fps: f64, leg: f64) {
    let ground = falls.forward * (-falls.speed / fps);
    for c in contacts {
        loop {
            let rides = |t: usize| track[t % falls.frames].coords - ground * t as f64;
            let count = (c.last - c.first + 1) as f64;
            let mean = (c.first..=c.last).map(rides).sum::<Vector3<f64>>() / count;
            // Shares of what is allowed.
            let off = |t: usize| {
                let away = (rides(t) - mean) / leg;
                (away.norm() / FARTHEST_SHIFT).max(away.y.abs() / FARTHEST_RISE)
            };
            let worst = (c.first..=c.last).map(off).fold(0.0, f64::max);
            if worst <= 1.0 || c.last <= c.first + 1 {
                break;
            }
            if off(c.last) >= off(c.first) {
                c.last -= 1;
                c.up_frame = c.last as f64 + 0.5;
            } else {
                c.first += 1;
                c.down_frame = c.first as f64 - 0.5;
            }
        }
        turned_back(c, falls.frames);
    }
}

/// A contact of a loop begins within it.
fn turned_back(c: &mut Contact, frames: usize) {
    if c.first >= frames {
        (c.first, c.last) = (c.first - frames, c.last - frames);
        (c.down_frame, c.up_frame) = (c.down_frame - frames as f64, c.up_frame - frames as f64);
    }
}

/// What each frame's sole is moved by.
fn shifts(
    track: &[Point3<f64>],
    contacts: &[Contact],
    falls: &Footfalls,
    fps: f64,
) -> Vec<Vector3<f64>> {
    let n = falls.frames;
    let ground = falls.forward * (-falls.speed / fps);
    // Extended over two rounds, so that a contact that goes on behind the end needs no special case.
    let mut fixed: Vec<Option<Vector3<f64>>> = vec![None; n];
    for contact in contacts {
        let count = contact.last - contact.first + 1;
        let rides = |i: usize| track[(contact.first + i) % n].coords - ground * i as f64;
        let mean = (0..count).map(rides).sum::<Vector3<f64>>() / count as f64;
        for i in 0..count {
            fixed[(contact.first + i) % n] = Some(mean - rides(i));
        }
    }
    let held: Vec<usize> = (0..n).filter(|&t| fixed[t].is_some()).collect();
    if held.is_empty() {
        return vec![Vector3::zeros(); n];
    }
    (0..n).map(|t| fixed[t].unwrap_or_else(|| in_swing(t, &fixed, falls.looped, fps))).collect()
}

/// What a sole is moved by in frame `t` of a swing, between the frames of contacts, whose shifts are `fixed`.
fn in_swing(t: usize, fixed: &[Option<Vector3<f64>>], looped: bool, fps: f64) -> Vector3<f64> {
    let n = fixed.len();
    let step = |from: usize, frames: usize, ahead: bool| wrapped(from, frames, n, looped, ahead);
    // The nearest frame on the ground, how far it is, and what the shift does there a frame, away from the swing.
    let edge = |ahead: bool| {
        let found =
            (1..=n).find_map(|d| Some((d, step(t, d, ahead)?)).filter(|e| fixed[e.1].is_some()));
        found.map(|(distance, frame)| {
            let value = fixed[frame].unwrap_or_default();
            let inner = step(frame, 1, ahead).and_then(|s| fixed[s]);
            (distance as f64, value, inner.map_or_else(Vector3::zeros, |i| value - i))
        })
    };
    let (back, ahead) = (edge(false), edge(true));
    let longest = (LONGEST_BLEND_S * fps).max(2.0);
    let half = back.zip(ahead).map_or(longest, |(b, a)| ((a.0 + b.0) / 2.0).min(longest));
    let still = (Vector3::zeros(), Vector3::zeros());
    let fade = |distance: f64, value: Vector3<f64>, slope: Vector3<f64>| {
        if distance < half {
            crossing((value, slope), still, distance, half)
        } else {
            Vector3::zeros()
        }
    };
    if let (Some((b, from, leaving)), Some((a, to, arriving))) = (back, ahead)
        && a + b <= LONGEST_SWING_S * fps
    {
        // What a slope leads to dies away within its half: over the whole swing it would carry the foot far off.
        let zero = Vector3::zeros();
        return crossing((from, zero), (to, zero), b, a + b)
            + fade(b, zero, leaving)
            + fade(a, zero, arriving);
    }
    // Each contact fades over its half of the swing.
    let faded = |edge: Option<(f64, Vector3<f64>, Vector3<f64>)>| {
        edge.map_or_else(Vector3::zeros, |(distance, value, slope)| fade(distance, value, slope))
    };
    faded(back) + faded(ahead)
}

/// `at` frames into a way of `length` from one value and slope (a frame) to another: of all such ways the cubic has the
/// smallest mean square acceleration.
fn crossing(
    (from, leaving): (Vector3<f64>, Vector3<f64>),
    (to, arriving): (Vector3<f64>, Vector3<f64>),
    at: f64,
    length: f64,
) -> Vector3<f64> {
    let u = at / length;
    let v = 1.0 - u;
    from * (v * v * (1.0 + 2.0 * u))
        + to * (u * u * (1.0 + 2.0 * v))
        + (leaving * (u * v * v) - arriving * (u * u * v)) * length
}

/// The frame `steps` after (or before) a frame; `None` behind the ends of a clip that is no loop.
fn wrapped(t: usize, steps: usize, n: usize, looped: bool, forwards: bool) -> Option<usize> {
    if looped {
        return Some(if forwards { (t + steps) % n } else { (t + n - steps % n) % n });
    }
    if forwards { Some(t + steps).filter(|s| *s < n) } else { t.checked_sub(steps) }
}

/// Moves one foot in every frame; how far each sole is from where it should be then.
fn place(
    skeleton: &Skeleton,
    clip: &mut Clip,
    before: &Clip,
    (foot, habit): (&Foot, &Habit),
    track: &[Point3<f64>],
    shifts: &[Vector3<f64>],
) -> Vec<f64> {
    let mut missed = Vec::with_capacity(shifts.len());
    for (t, shift) in shifts.iter().enumerate() {
        let pose = &mut clip.poses[t];
        for &node in foot.joints.iter().chain([&foot.node]).chain(&foot.loose) {
            pose.nodes[node] = before.poses[t].nodes[node];
        }
        // Nothing of the other legs is above this one, so the matrices before hold.
        let world = skeleton.world_matrices(pose);
        let end = world[foot.end.0].transform_point(&foot.end.1);
        let top = foot.joints.first().map_or(end, |&j| world[j].transform_point(&Point3::origin()));
        let length = chain_length(&places(&world, foot));
        let target = eased(top, end, end + shift, length, habit.longest);
        let bow = above(skeleton, &world, foot) * habit.bow;
        reach_bending(skeleton, pose, &foot.joints, foot.end, target, &bow);
        if let Some(loose) = foot.loose {
            let parent = skeleton.nodes[loose].parent;
            let linear = parent.map_or_else(nalgebra::Matrix3::identity, |p| {
                world[p].fixed_view::<3, 3>(0, 0).into_owned()
            });
            if let Some(inverse) = linear.try_inverse() {
                pose.nodes[loose].translation += inverse * shift;
            }
        } else if !foot.joints.contains(&foot.node) {
            let turned = skeleton.world_matrices(pose);
            let rotation = |m: &Matrix4<f64>| orthonormal(&m.fixed_view::<3, 3>(0, 0).into_owned());
            let parent = skeleton.nodes[foot.node].parent;
            if let Some(p) = parent {
                let local = rotation(&turned[p]).inverse() * rotation(&world[p]);
                let q = &mut pose.nodes[foot.node].rotation;
                *q = UnitQuaternion::new_normalize(*(local * *q));
            }
        }
        let now = skeleton.world_matrices(pose)[foot.node].transform_point(&foot.sole);
        missed.push((now - (track[t] + shift)).norm());
    }
    missed
}

/// World rotation of what the leg hangs on.
fn above(skeleton: &Skeleton, world: &[Matrix4<f64>], foot: &Foot) -> UnitQuaternion<f64> {
    let parent = foot.joints.first().and_then(|&j| skeleton.nodes[j].parent);
    parent.map_or_else(UnitQuaternion::identity, |p| {
        orthonormal(&world[p].fixed_view::<3, 3>(0, 0).into_owned())
    })
}

/// What a leg does over the clip, before it is moved.
struct Habit {
    /// The axis about which it is bent, seen from what it hangs on; its length says how much.
    bow: Vector3<f64>,
    /// How far it is stretched freely, as a share of its length.
    longest: f64,
}

impl Habit {
    fn of(skeleton: &Skeleton, clip: &Clip, foot: &Foot) -> Self {
        let (mut bow, mut longest) = (Vector3::zeros(), 0.0_f64);
        for pose in &clip.poses {
            let world = skeleton.world_matrices(pose);
            let places = places(&world, foot);
            let bones: Vec<Vector3<f64>> = places.windows(2).map(|w| w[1] - w[0]).collect();
            let turn: Vector3<f64> = bones.windows(2).map(|b| b[0].cross(&b[1])).sum();
            bow += above(skeleton, &world, foot).inverse() * turn;
            let reach = (places[places.len() - 1] - places[0]).norm();
            longest = longest.max(reach / chain_length(&places));
        }
        Self { bow, longest: longest.min(STRETCH_EASES_AT) }
    }
}

/// Places of the joints and of the end.
fn places(world: &[Matrix4<f64>], foot: &Foot) -> Vec<Point3<f64>> {
    let mut places: Vec<Point3<f64>> =
        foot.joints.iter().map(|&j| world[j].transform_point(&Point3::origin())).collect();
    places.push(world[foot.end.0].transform_point(&foot.end.1));
    places
}

/// Length of the chain from place to place.
fn chain_length(places: &[Point3<f64>]) -> f64 {
    places.windows(2).map(|w| (w[1] - w[0]).norm()).sum()
}

/// A target is drawn in where the leg would be stretched beyond the share `longest` of its `length`: many legs never
/// are straight, and would look broken; and a knee's angle goes with the root of what is left of the reach, so that
/// a leg that becomes straight snaps. A target where the end is already stays.
fn eased(
    top: Point3<f64>,
    end: Point3<f64>,
    target: Point3<f64>,
    length: f64,
    longest: f64,
) -> Point3<f64> {
    let (from, room) = (longest * length, STRETCH_ROOM * length);
    let soft =
        |r: f64| if r <= from { r } else { from + room * (1.0 - (-(r - from) / room).exp()) };
    let (before, wanted) = ((end - top).norm(), (target - top).norm());
    if wanted <= from.max(before) || wanted == 0.0 {
        return target;
    }
    let eased = before.max(from) + soft(wanted) - soft(before.max(from));
    top + (target - top) * (eased / wanted)
}

/// Takes frames from the ends of contacts in which the foot missed its place; whether any was taken.
fn shorten(contacts: &mut Vec<Contact>, missed: &[f64], falls: &Footfalls, limit: f64) -> bool {
    let n = falls.frames;
    let mut changed = false;
    for c in contacts.iter_mut() {
        while c.last > c.first && missed[c.last % n] > limit {
            c.last -= 1;
            c.up_frame = c.last as f64 + 0.5;
            changed = true;
        }
        while c.last > c.first && missed[c.first % n] > limit {
            c.first += 1;
            c.down_frame = c.first as f64 - 0.5;
            changed = true;
        }
        turned_back(c, n);
    }
    let all = contacts.len();
    contacts.retain(|c| c.last > c.first);
    changed || contacts.len() < all
}

/// The channels that planting moves are written.
fn drive(clip: &mut Clip, foot: &Foot) {
    for &joint in &foot.joints {
        clip.driven[joint].rotation = true;
    }
    match foot.loose {
        Some(loose) => clip.driven[loose].translation = true,
        None => clip.driven[foot.node].rotation = true,
    }
}

/// Largest way over the ground within a contact, in leg lengths.
fn slide(
    skeleton: &Skeleton,
    clip: &Clip,
    feet: &[Foot],
    contacts: &[Vec<Contact>],
    falls: &Footfalls,
) -> f64 {
    let tracks = foot_tracks(skeleton, &clip.poses, feet);
    let ground = falls.forward * (-falls.speed / clip.fps);
    let mut most: f64 = 0.0;
    for ((track, contacts), foot) in tracks.iter().zip(contacts).zip(feet) {
        for c in contacts {
            let rides =
                |t: usize| track.soles[t % falls.frames].coords - ground * (t - c.first) as f64;
            let ways = (c.first..=c.last).map(|t| (rides(t) - rides(c.first)).norm());
            most = most.max(ways.fold(0.0, f64::max) / foot.leg_length);
        }
    }
    most
}

/// Largest and root mean square angular acceleration of the legs' joints, degrees a second squared.
fn accelerations(clip: &Clip, feet: &[Foot], looped: bool) -> (f64, f64) {
    let n = clip.poses.len();
    let (mut most, mut squares, mut count) = (0.0_f64, 0.0, 0.0_f64);
    for foot in feet {
        for &node in foot.joints.iter().chain([&foot.node]) {
            let turn = |t: usize| {
                let (a, b) = (&clip.poses[t].nodes[node], &clip.poses[t + 1].nodes[node]);
                rotation_vector(&(a.rotation.inverse() * b.rotation))
            };
            let turns: Vec<Vector3<f64>> = (0..n.saturating_sub(1)).map(turn).collect();
            let wrap =
                turns.last().zip(turns.first()).filter(|_| looped).map(|(a, b)| (b - a).norm());
            for change in turns.windows(2).map(|w| (w[1] - w[0]).norm()).chain(wrap) {
                let a = change.to_degrees() * clip.fps * clip.fps;
                most = most.max(a);
                squares += a * a;
                count += 1.0;
            }
        }
    }
    (most, if count > 0.0 { (squares / count).sqrt() } else { 0.0 })
}
