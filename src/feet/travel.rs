//! Root motion: an animation in place that goes where its feet push it.

use nalgebra::Matrix3;

use super::contacts::Footfalls;
use super::find::Foot;
use crate::rig::{Clip, Skeleton};

/// The lowest node that carries all feet and legs, which is what travels; `None` without feet or when
/// they share no node.
#[must_use]
pub fn common_root(skeleton: &Skeleton, feet: &[Foot]) -> Option<usize> {
    let line = |node: usize| -> Vec<usize> {
        std::iter::successors(skeleton.nodes[node].parent, |&n| skeleton.nodes[n].parent).collect()
    };
    let parts: Vec<Vec<usize>> = (feet.iter())
        .flat_map(|f| f.joints.first().copied().into_iter().chain(f.loose))
        .map(line)
        .collect();
    parts.first()?.iter().copied().find(|n| parts.iter().all(|p| p.contains(n)))
}

/// Lets node `root` travel forward at the speed of the ground, from where it is in the first pose.
///
/// # Panics
/// When `root` is no node of the skeleton.
pub fn travel(skeleton: &Skeleton, clip: &mut Clip, root: usize, falls: &Footfalls) {
    let way = falls.forward * (falls.speed / clip.fps);
    clip.driven[root].translation = true;
    for (t, pose) in clip.poses.iter_mut().enumerate() {
        let parent = skeleton.nodes[root].parent;
        let world = parent.map(|p| skeleton.world_matrices(pose)[p]);
        let linear =
            world.map_or_else(Matrix3::identity, |w| w.fixed_view::<3, 3>(0, 0).into_owned());
        if let Some(inverse) = linear.try_inverse() {
            pose.nodes[root].translation += inverse * way * t as f64;
        }
    }
}
