//! Poses that were made with left and right exchanged: silhouettes look alike either way, and it is easily done.

use crate::error::Result;
use crate::numeric::MirroredCycle;
use crate::rig::{Clip, KeyPoses, Mirror, Pose, Skeleton, angle_between_rad};

use super::blend;

/// Fewest keys of which one can be judged by the others.
const LEAST_KEYS: usize = 4;

/// A pose is doubted when its mirror image misses what the others say by less than this share of what it misses itself …
const DOUBTED_SHARE: f64 = 0.5;

/// … and it misses by this much, radians: smaller differences tell nothing.
const LEAST_MISS_RAD: f64 = 0.07;

/// Keys (positions from 0, ascending) whose pose fits the others far better with left and right exchanged: each is predicted by
/// all others, as they are and in the mirror, and compared with what was posed and with its mirror image. Empty with fewer
/// than four keys. Of a whole set of exchanged poses nothing is seen, and need not be: it is a walk half a stride later.
///
/// `stride_cycles`: phase of each key's frame; `keys`: their poses, in the same order, without mirrored ones.
///
/// # Errors
/// As [`blend`].
///
/// # Panics
/// When there are not as many poses as phases, or `mirror` is of another rig.
pub fn exchanged_sides(
    stride_cycles: &[f64],
    keys: &KeyPoses,
    skeleton: &Skeleton,
    mirror: &Mirror,
) -> Result<Vec<usize>> {
    assert_eq!(stride_cycles.len(), keys.poses.len(), "one phase a pose");
    if keys.poses.len() < LEAST_KEYS {
        return Ok(Vec::new());
    }
    // One at a time, the worst first: an exchanged pose makes the others look wrong.
    let mut poses = keys.clone();
    let mut found = Vec::new();
    loop {
        let mut worst: Option<(f64, usize)> = None;
        for key in (0..poses.poses.len()).filter(|k| !found.contains(k)) {
            let gain = gain(key, stride_cycles, &poses, skeleton, mirror)?;
            if gain > worst.map_or(0.0, |w| w.0) {
                worst = Some((gain, key));
            }
        }
        let Some((_, key)) = worst.filter(|_| 2 * found.len() < poses.poses.len()) else { break };
        poses.poses[key] = mirror.pose(&poses.poses[key], &poses.driven);
        found.push(key);
    }
    found.sort_unstable();
    Ok(found)
}

/// By how much less the mirror image of a pose misses than the pose, radians; 0 where that is no reason for doubt.
fn gain(
    key: usize,
    stride_cycles: &[f64],
    keys: &KeyPoses,
    skeleton: &Skeleton,
    mirror: &Mirror,
) -> Result<f64> {
    let mut phases = stride_cycles.to_vec();
    let phase = phases.remove(key);
    let mut others = keys.clone();
    let own = others.poses.remove(key);
    others.add_mirrored(mirror);
    let Some(cycle) = MirroredCycle::new(&phases) else { return Ok(0.0) };
    let made = blend("", 1.0, skeleton, &others, &cycle.weights(phase))?;
    let misses = miss(&made, &own);
    let exchanged = miss(&made, &mirror.pose(&own, &keys.driven));
    let doubted = misses > LEAST_MISS_RAD && exchanged < DOUBTED_SHARE * misses;
    Ok(if doubted { misses - exchanged } else { 0.0 })
}

/// Mean angle over the joints that turn, radians.
fn miss(made: &Clip, pose: &Pose) -> f64 {
    let angles: Vec<f64> = (made.poses[0].nodes.iter().zip(&pose.nodes).zip(&made.driven))
        .filter(|(_, driven)| driven.rotation)
        .map(|((a, b), _)| angle_between_rad(&a.rotation, &b.rotation))
        .collect();
    angles.iter().sum::<f64>() / angles.len().max(1) as f64
}
