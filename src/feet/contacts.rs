//! When each foot is down, and how fast the ground passes below an animation in place.

use nalgebra::{Matrix2, Point3, SymmetricEigen, Vector2, Vector3};
use serde::{Deserialize, Serialize};

use super::find::FootTrack;
use crate::numeric::median;

/// A foot at this share of its own range of height counts half as off the ground as one that stands
/// still in space; both together decide. Set by trial on five rigs and the built-in horse, whose
/// stances are known.
const OFF_GROUND: f64 = 0.2;

/// … or at this share of its leg's length, for feet that are hardly lifted (the husky's walk: 2 %).
const OFF_GROUND_OF_LEG: f64 = 0.02;

/// A foot whose speed differs by this share of the ground's is not carried by the ground. In the last
/// twentieth of a swing the built-in gaits differ by .7 and more.
const OFF_SPEED: f64 = 0.5;

/// Feet of many hand-made cycles slide while they are down; what is allowed of one is this many times the
/// median difference of its own low frames, up to [`MOST_OFF_SPEED`] (hind feet of the rigs' walks: .7).
const OFF_SPEED_OVER_MEDIAN: f64 = 2.2;

/// Beyond this a foot would be down while it swings.
const MOST_OFF_SPEED: f64 = 1.6;

/// Below this share of what counts as off the ground a foot is low: there the ground's speed is looked
/// for at first.
const LOW: f64 = 0.75;

/// Shortest stance, as a share of the foot's mean time from one to the next; the shortest published
/// duty factors are near .15 (cheetah at full speed).
const LEAST_DUTY: f64 = 0.08;

/// Rounds of speed and stances after one another; two change nothing any more.
const ROUNDS: usize = 4;

/// One time a foot is on the ground.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Contact {
    /// First frame on the ground.
    pub first: usize,
    /// Last frame on the ground. In a loop it may lie behind the last frame: frames go round.
    pub last: usize,
    /// The moment the foot comes down, in frames, between frames where the motion says so.
    pub down_frame: f64,
    /// The moment it leaves the ground, in frames.
    pub up_frame: f64,
    /// Whether the clip shows both its beginning and its end.
    pub whole: bool,
}

/// Contacts of all feet, and the ground.
#[derive(Clone, Debug, PartialEq)]
pub struct Footfalls {
    /// For each foot its contacts in order.
    pub contacts: Vec<Vec<Contact>>,
    /// Horizontal unit vector against which feet on the ground move: where the animal goes.
    pub forward: Vector3<f64>,
    /// Speed of the ground, rig units a second.
    pub speed: f64,
    /// Frames: of a loop without the last one, which is the first again.
    pub frames: usize,
    /// Whether the clip is a loop.
    pub looped: bool,
}

/// Stances from the ways of the feet, for an animation in place at `fps` frames a second; of a loop the last frame is the first again.
///
/// A foot is down while it is low in its own range of height and moves backwards with the ground. The
/// ground's speed is the median over the stances of their mean speed, begun with the feet that are
/// low, and refined with the stances it gives. `None` when the feet do not move or fewer than two
/// stances are found.
#[must_use]
pub fn footfalls(tracks: &[FootTrack], fps: f64, looped: bool) -> Option<Footfalls> {
    let length = tracks.first()?.soles.len();
    let frames = if looped { length.checked_sub(1)? } else { length };
    if frames < 4 {
        return None;
    }
    let mut tracks: Vec<Track> =
        tracks.iter().map(|t| Track::new(t, frames, fps, looped)).collect();
    let axis = principal(&tracks)?;
    // Feet are higher while they swing forward than while they go back.
    let rising: f64 = tracks.iter().map(|t| t.height_along(&axis)).sum();
    let forward = if rising >= 0.0 { axis } else { -axis };
    tracks.iter_mut().for_each(|t| t.level(&forward));
    let back: Vec<f64> = (tracks.iter())
        .flat_map(|t| t.height.iter().zip(&t.velocity))
        .map(|(h, v)| (*h, -v.dot(&forward)))
        .filter(|(h, back)| *h < LOW && *back > 0.0)
        .map(|(_, back)| back)
        .collect();
    let mut speed = median(&back);
    let mut contacts = Vec::new();
    for _ in 0..ROUNDS {
        if !speed.is_finite() || speed <= 0.0 {
            return None;
        }
        contacts = tracks.iter().map(|t| t.contacts(&forward, speed)).collect::<Vec<_>>();
        let speeds: Vec<f64> = (tracks.iter().zip(&contacts))
            .flat_map(|(t, all)| {
                all.iter().filter(|c| c.last > c.first).map(|c| t.mean_speed(c, &forward))
            })
            .collect();
        if speeds.len() < 2 {
            return None;
        }
        speed = median(&speeds);
    }
    let forward = Vector3::new(forward.x, 0.0, forward.y);
    Some(Footfalls { contacts, forward, speed, frames, looped })
}

/// One foot's way.
struct Track {
    places: Vec<Point3<f64>>,
    /// Height, of [`FootTrack::heights`]; after [`Track::level`] as a share of what is off the ground.
    height: Vec<f64>,
    /// Horizontal velocity (x, z), units a second, central differences.
    velocity: Vec<Vector2<f64>>,
    leg_length: f64,
    fps: f64,
    looped: bool,
}

impl Track {
    fn new(track: &FootTrack, frames: usize, fps: f64, looped: bool) -> Self {
        let places = &track.soles[..frames];
        let n = frames;
        let height = track.heights[..frames].to_vec();
        let velocity = (0..n)
            .map(|t| {
                let (a, b) = if looped {
                    ((t + n - 1) % n, (t + 1) % n)
                } else {
                    (t.saturating_sub(1), (t + 1).min(n - 1))
                };
                let steps = if looped || (t > 0 && t + 1 < n) { 2.0 } else { 1.0 };
                let way = places[b] - places[a];
                Vector2::new(way.x, way.z) * (fps / steps)
            })
            .collect();
        Self {
            places: places.to_vec(),
            height,
            velocity,
            leg_length: track.leg_length,
            fps,
            looped,
        }
    }

    /// Positive when the foot is higher while it moves along the axis than against it.
    fn height_along(&self, axis: &Vector2<f64>) -> f64 {
        let mean = self.height.iter().sum::<f64>() / self.height.len() as f64;
        let terms = self.height.iter().zip(&self.velocity).map(|(h, v)| (h - mean) * v.dot(axis));
        terms.sum::<f64>() / self.leg_length.powi(2).max(f64::MIN_POSITIVE)
    }

    /// Makes of the heights shares of what counts as off the ground, 0 where the foot usually is while it
    /// goes back.
    fn level(&mut self, forward: &Vector2<f64>) {
        let mut back: Vec<f64> = (self.height.iter().zip(&self.velocity))
            .filter(|(_, v)| v.dot(forward) < 0.0)
            .map(|(h, _)| *h)
            .collect();
        back.sort_by(f64::total_cmp);
        let level = back.get(back.len() / 4).copied().unwrap_or(0.0);
        let top = self.height.iter().copied().fold(level, f64::max);
        let off = (OFF_GROUND * (top - level)).max(OFF_GROUND_OF_LEG * self.leg_length);
        let off = off.max(f64::MIN_POSITIVE);
        self.height.iter_mut().for_each(|h| *h = (*h - level) / off);
    }

    /// Below 1 on the ground, above 1 off it.
    fn off(&self, t: usize, forward: &Vector2<f64>, speed: f64, allowed: f64) -> f64 {
        self.height[t].max(0.0).hypot(self.slip(t, forward, speed) / allowed)
    }

    /// Difference from the ground's velocity as a share of it.
    fn slip(&self, t: usize, forward: &Vector2<f64>, speed: f64) -> f64 {
        (self.velocity[t] + forward * speed).norm() / speed
    }

    fn allowed_slip(&self, forward: &Vector2<f64>, speed: f64) -> f64 {
        let low = |t: &usize| self.height[*t] < LOW && self.velocity[*t].dot(forward) < 0.0;
        let slips: Vec<f64> =
            (0..self.height.len()).filter(low).map(|t| self.slip(t, forward, speed)).collect();
        (OFF_SPEED_OVER_MEDIAN * median(&slips)).clamp(OFF_SPEED, MOST_OFF_SPEED)
    }

    fn contacts(&self, forward: &Vector2<f64>, speed: f64) -> Vec<Contact> {
        let n = self.places.len();
        let allowed = self.allowed_slip(forward, speed);
        let off: Vec<f64> = (0..n).map(|t| self.off(t, forward, speed, allowed)).collect();
        let mut runs = runs(&off.iter().map(|o| *o < 1.0).collect::<Vec<_>>(), self.looped);
        join(&mut runs, n, self.looped);
        let cycle = n as f64 / runs.len().max(1) as f64;
        runs.retain(|&(first, last)| (last - first + 1) as f64 >= (LEAST_DUTY * cycle).min(2.0));
        runs.iter().map(|&(first, last)| self.contact(first, last, &off)).collect()
    }

    /// Moments between frames where the measure passes 1.
    fn contact(&self, first: usize, last: usize, off: &[f64]) -> Contact {
        let n = off.len();
        let at = |t: usize| off[t % n];
        let crossing = |inside: f64, outside: f64| {
            if outside > inside {
                ((1.0 - inside) / (outside - inside)).clamp(0.0, 1.0)
            } else {
                0.5
            }
        };
        let (open_start, open_end) = (!self.looped && first == 0, !self.looped && last + 1 >= n);
        let down =
            if open_start { 0.0 } else { first as f64 - crossing(at(first), at(first + n - 1)) };
        let up =
            if open_end { last as f64 } else { last as f64 + crossing(at(last), at(last + 1)) };
        Contact { first, last, down_frame: down, up_frame: up, whole: !open_start && !open_end }
    }

    fn mean_speed(&self, contact: &Contact, forward: &Vector2<f64>) -> f64 {
        let n = self.places.len();
        let way = self.places[contact.last % n] - self.places[contact.first];
        let frames = (contact.last - contact.first) as f64;
        -Vector2::new(way.x, way.z).dot(forward) * self.fps / frames
    }
}

/// Runs of true frames, both ends included; in a loop the last may go on behind the last frame.
fn runs(down: &[bool], looped: bool) -> Vec<(usize, usize)> {
    let n = down.len();
    let mut found: Vec<(usize, usize)> = Vec::new();
    for t in (0..n).filter(|&t| down[t]) {
        match found.last_mut() {
            Some(run) if run.1 + 1 == t => run.1 = t,
            _ => found.push((t, t)),
        }
    }
    if looped && found.len() > 1 && found[0].0 == 0 && found[found.len() - 1].1 == n - 1 {
        let head = found.remove(0);
        if let Some(tail) = found.last_mut() {
            tail.1 = n + head.1;
        }
    }
    found
}

/// Joins runs over gaps much shorter than the swings: a foot that for a frame or two passes the limit.
fn join(runs: &mut Vec<(usize, usize)>, n: usize, looped: bool) {
    let mut gaps: Vec<usize> = runs.windows(2).map(|w| w[1].0 - w[0].1 - 1).collect();
    if looped && let (Some(first), Some(last)) = (runs.first(), runs.last()) {
        gaps.push((first.0 + n).saturating_sub(last.1 + 1));
    }
    let Some(&longest) = gaps.iter().max() else { return };
    let short = |gap: usize| 5 * gap <= 2 * longest;
    let mut joined: Vec<(usize, usize)> = Vec::new();
    for &run in runs.iter() {
        match joined.last_mut() {
            Some(before) if short(run.0 - before.1 - 1) => before.1 = run.1,
            _ => joined.push(run),
        }
    }
    if looped && joined.len() > 1 {
        let (first, last) = (joined[0], joined[joined.len() - 1]);
        if short((first.0 + n).saturating_sub(last.1 + 1)) {
            joined.remove(0);
            if let Some(tail) = joined.last_mut() {
                tail.1 = n + first.1;
            }
        }
    }
    *runs = joined;
}

/// The horizontal direction in which the feet move most.
fn principal(tracks: &[Track]) -> Option<Vector2<f64>> {
    let scatter: Matrix2<f64> =
        tracks.iter().flat_map(|t| &t.velocity).map(|v| v * v.transpose()).sum();
    let eigen = SymmetricEigen::new(scatter);
    let at = eigen.eigenvalues.imax();
    (eigen.eigenvalues[at] > 0.0).then(|| eigen.eigenvectors.column(at).into_owned())
}
