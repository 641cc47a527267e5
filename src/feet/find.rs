//! Feet of a rig, from its mesh, its hierarchy and how it moves.

use nalgebra::{Matrix4, Point3};

use crate::rig::{Mirror, Model, Pose, Skeleton};

/// Poses that are looked at, evenly spread over the clip.
const MOST_POSES: usize = 48;

/// A node whose lowest vertex comes nearer to the ground than this share of the animal's height may be
/// part of a foot. The hooves, paws and toes of the five rigs measured end between .00 and .03.
const NEAR_GROUND: f64 = 0.06;

/// A foot moves along the ground by at least this share of the height: the shortest stride measured, a
/// heavy walk, has .3; a tail that touches the ground swings less.
const LEAST_SWEEP: f64 = 0.12;

/// Vertices up to this share of the height above the ground count as sole.
const SOLE: f64 = 0.02;

/// Bones of one foot that hang on one parent (toes) stay nearer to each other than this share of the height.
const TOES_APART: f64 = 0.12;

/// A chain shorter than this share of the height is no leg: the foot is a node of its own, which rigs
/// made for inverse kinematics have, and the leg another chain that ends at it.
const LEAST_LEG: f64 = 0.25;

/// How far, as a share of the height, the end of such a leg may be from its foot.
const LEG_TO_FOOT: f64 = 0.2;

/// A foot and the leg that puts it in its place. Indices are nodes of the skeleton.
#[derive(Clone, Debug, PartialEq)]
pub struct Foot {
    /// The node that carries the sole.
    pub node: usize,
    /// The point of the sole that stands longest on the ground, in the node's space.
    pub sole: Point3<f64>,
    /// The joints of the leg that are turned to place the foot, the uppermost first.
    pub joints: Vec<usize>,
    /// What the joints bring to its place: a node, and a point in its space.
    pub end: (usize, Point3<f64>),
    /// The uppermost node of a foot that does not hang on its leg; it is moved with the leg's end.
    pub loose: Option<usize>,
    /// Length of the leg from its first joint to its end, rig units.
    pub leg_length: f64,
}

/// What of a clip is looked at: matrices of some poses.
struct Scene<'a> {
    skeleton: &'a Skeleton,
    worlds: Vec<Vec<Matrix4<f64>>>,
    /// Vertices as (dominant node, place in its space).
    points: Vec<(usize, Point3<f64>)>,
    /// Nodes over each node, nearest first.
    above: Vec<Vec<usize>>,
    ground: f64,
    height: f64,
}

/// The feet of a model that moves through `poses`, in the order of their nodes.
///
/// `named` lists nodes that are feet; when it is empty they are looked for: nodes whose vertices come
/// down to the ground and that sweep along it, and of a rig with two like sides their counterparts, which
/// few poses of a gallop may not show on the ground. A foot's leg is the chain above it up to the first node
/// that carries another foot as well; when that is too short to be a leg (the foot hangs on a control
/// node of its own), the chain that ends nearest to the foot.
///
/// Without meshes the ends of the chains (nodes without children) stand for the vertices.
///
/// # Panics
/// When a pose has not one entry for each node, or `named` has a node that does not exist.
#[must_use]
pub fn find_feet(model: &Model, poses: &[Pose], named: &[usize]) -> Vec<Foot> {
    let Some(scene) = Scene::new(model, poses) else { return Vec::new() };
    let groups: Vec<Vec<usize>> = if named.is_empty() {
        with_other_sides(scene.merged(scene.touching_groups()), model)
    } else {
        named.iter().map(|&n| scene.subtree(n)).collect()
    };
    let soles: Vec<(usize, Point3<f64>)> = groups.iter().filter_map(|g| scene.sole(g)).collect();
    let moving = |s: &&(usize, Point3<f64>)| {
        !named.is_empty() || scene.sweep(s) > LEAST_SWEEP * scene.height
    };
    let mut soles: Vec<(usize, Point3<f64>)> = soles.iter().filter(moving).copied().collect();
    soles.sort_by_key(|s| s.0);
    if named.is_empty() {
        scene.drop_ends_of_legs(&mut soles);
    }
    let nodes: Vec<usize> = soles.iter().map(|s| s.0).collect();
    soles.iter().map(|s| scene.foot(s, &nodes)).collect()
}

/// The way of one foot through the poses of a clip, world space.
#[derive(Clone, Debug, PartialEq)]
pub struct FootTrack {
    /// Where the sole is.
    pub soles: Vec<Point3<f64>>,
    /// Height of the middle between the sole and the joint over it: a foot that rolls over its toes has left the
    /// ground though its tip may be lower than ever.
    pub heights: Vec<f64>,
    /// Length of the leg.
    pub leg_length: f64,
}

/// The ways of all feet.
///
/// # Panics
/// When a pose has not one entry for each node.
#[must_use]
pub fn foot_tracks(skeleton: &Skeleton, poses: &[Pose], feet: &[Foot]) -> Vec<FootTrack> {
    let empty =
        |f: &Foot| FootTrack { soles: Vec::new(), heights: Vec::new(), leg_length: f.leg_length };
    let mut tracks: Vec<FootTrack> = feet.iter().map(empty).collect();
    for pose in poses {
        let world = skeleton.world_matrices(pose);
        for (track, foot) in tracks.iter_mut().zip(feet) {
            let sole = world[foot.node].transform_point(&foot.sole);
            let joint = world[foot.node].transform_point(&Point3::origin());
            track.soles.push(sole);
            track.heights.push((sole.y + joint.y) / 2.0);
        }
    }
    tracks
}

impl<'a> Scene<'a> {
    fn new(model: &'a Model, poses: &[Pose]) -> Option<Self> {
        let skeleton = &model.skeleton;
        let step = poses.len().div_ceil(MOST_POSES).max(1);
        let worlds: Vec<_> =
            poses.iter().step_by(step).map(|p| skeleton.world_matrices(p)).collect();
        let points = points(model);
        if worlds.is_empty() || points.is_empty() {
            return None;
        }
        let above = (0..skeleton.nodes.len()).map(|n| ancestors(skeleton, n)).collect();
        let mut scene = Self { skeleton, worlds, points, above, ground: 0.0, height: 0.0 };
        // Of the lowest points of all poses a low one: in a suspension nothing is on the ground.
        let mut low = Vec::new();
        let mut high = Vec::new();
        for t in 0..scene.worlds.len() {
            let heights = scene.points.iter().map(|p| scene.place(t, p).y);
            let (a, b) =
                heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), y| (a.min(y), b.max(y)));
            low.push(a);
            high.push(b);
        }
        low.sort_by(f64::total_cmp);
        scene.ground = low[low.len() / 5];
        scene.height = crate::numeric::median(&high) - scene.ground;
        (scene.height > 0.0).then_some(scene)
    }

    fn place(&self, t: usize, (node, at): &(usize, Point3<f64>)) -> Point3<f64> {
        self.worlds[t][*node].transform_point(at)
    }

    fn origin(&self, t: usize, node: usize) -> Point3<f64> {
        self.place(t, &(node, Point3::origin()))
    }

    /// Nodes near the ground, grouped where one hangs on another.
    fn touching_groups(&self) -> Vec<Vec<usize>> {
        let mut touches = vec![false; self.skeleton.nodes.len()];
        for point in &self.points {
            touches[point.0] |= (0..self.worlds.len())
                .any(|t| self.place(t, point).y < self.ground + NEAR_GROUND * self.height);
        }
        let mut groups: Vec<(usize, Vec<usize>)> = Vec::new();
        for node in (0..touches.len()).filter(|&n| touches[n]) {
            let root =
                self.above[node].iter().copied().take_while(|&a| touches[a]).last().unwrap_or(node);
            match groups.iter_mut().find(|g| g.0 == root) {
                Some(group) => group.1.push(node),
                None => groups.push((root, vec![node])),
            }
        }
        groups.into_iter().map(|g| g.1).collect()
    }

    /// Groups that hang on one parent and stay together are the toes of one foot.
    fn merged(&self, groups: Vec<Vec<usize>>) -> Vec<Vec<usize>> {
        let mut out: Vec<Vec<usize>> = Vec::new();
        for group in groups {
            let parent = |g: &[usize]| g.first().and_then(|&n| self.skeleton.nodes[n].parent);
            let together = |other: &[usize]| {
                parent(other) == parent(&group)
                    && (0..self.worlds.len()).all(|t| {
                        let apart = self.origin(t, other[0]) - self.origin(t, group[0]);
                        apart.norm() < TOES_APART * self.height
                    })
            };
            match out.iter().position(|g| together(g)) {
                Some(at) => out[at].extend(group),
                None => out.push(group),
            }
        }
        out
    }

    fn subtree(&self, top: usize) -> Vec<usize> {
        (0..self.above.len()).filter(|&n| n == top || self.above[n].contains(&top)).collect()
    }

    /// The middle of the vertices that are on the ground longest, of the node that has most of them.
    fn sole(&self, group: &[usize]) -> Option<(usize, Point3<f64>)> {
        let own: Vec<&(usize, Point3<f64>)> =
            self.points.iter().filter(|p| group.contains(&p.0)).collect();
        // Each foot has a ground of its own: blended poses float or sink a little.
        let heights: Vec<Vec<f64>> = own
            .iter()
            .map(|p| (0..self.worlds.len()).map(|t| self.place(t, p).y).collect())
            .collect();
        let mut lows: Vec<f64> = (0..self.worlds.len())
            .map(|t| heights.iter().map(|h| h[t]).fold(f64::INFINITY, f64::min))
            .collect();
        lows.sort_by(f64::total_cmp);
        let level = *lows.get(lows.len() / 10)?;
        let score = |h: &Vec<f64>| -> f64 {
            h.iter().map(|y| (1.0 - (y - level).max(0.0) / (SOLE * self.height)).max(0.0)).sum()
        };
        let scores: Vec<f64> = heights.iter().map(score).collect();
        let best = scores.iter().copied().fold(0.0, f64::max);
        let longest = || own.iter().zip(&scores).filter(|(_, s)| **s >= 0.8 * best);
        let node = longest().max_by(|a, b| a.1.total_cmp(b.1)).map(|(p, _)| p.0)?;
        let (sum, count) = longest()
            .filter(|(p, _)| p.0 == node)
            .fold((nalgebra::Vector3::zeros(), 0.0), |(s, c), (p, _)| (s + p.1.coords, c + 1.0));
        Some((node, Point3::from(sum / count)))
    }

    /// Where a foot is a node of its own, the end of its leg may come near the ground as well: the
    /// foot counts, its leg's end does not.
    fn drop_ends_of_legs(&self, soles: &mut Vec<(usize, Point3<f64>)>) {
        let nodes: Vec<usize> = soles.iter().map(|s| s.0).collect();
        let hangs = |s: &(usize, Point3<f64>)| self.hangs(s, &self.own_chain(s.0, &nodes));
        let (legs, loose): (Vec<_>, Vec<_>) = soles.iter().copied().partition(hangs);
        let mut dropped = Vec::new();
        for foot in &loose {
            let apart = |leg: &(usize, Point3<f64>)| {
                let distances = (0..self.worlds.len())
                    .map(|t| (self.place(t, foot) - self.place(t, leg)).norm());
                distances.fold(0.0, f64::max)
            };
            let nearest = legs.iter().map(|l| (l.0, apart(l))).min_by(|a, b| a.1.total_cmp(&b.1));
            dropped.extend(nearest.filter(|n| n.1 < LEG_TO_FOOT * self.height).map(|n| n.0));
        }
        soles.retain(|s| !dropped.contains(&s.0));
    }

    /// Diagonal of what a point covers of the ground.
    fn sweep(&self, sole: &(usize, Point3<f64>)) -> f64 {
        let places: Vec<Point3<f64>> =
            (0..self.worlds.len()).map(|t| self.place(t, sole)).collect();
        let range = |axis: usize| {
            let values = places.iter().map(|p| p[axis]);
            values.clone().fold(f64::NEG_INFINITY, f64::max) - values.fold(f64::INFINITY, f64::min)
        };
        range(0).hypot(range(2))
    }

    /// The nodes from `node` up that carry none of the others, uppermost first.
    fn own_chain(&self, node: usize, others: &[usize]) -> Vec<usize> {
        let shared =
            |a: usize| others.iter().any(|&o| o != node && (o == a || self.above[o].contains(&a)));
        let mut chain = vec![node];
        chain.extend(self.above[node].iter().copied().take_while(|&a| !shared(a)));
        // A node above the whole animal may carry a single foot; the leg begins below it.
        chain.reverse();
        chain
    }

    /// Mean length of a chain of nodes.
    fn length(&self, chain: &[usize]) -> f64 {
        let total: f64 = (0..self.worlds.len())
            .flat_map(|t| {
                chain.windows(2).map(move |w| (self.origin(t, w[1]) - self.origin(t, w[0])).norm())
            })
            .sum();
        total / self.worlds.len() as f64
    }

    /// Mean distance of a sole from its node's origin.
    fn tip(&self, sole: &(usize, Point3<f64>)) -> f64 {
        let total: f64 = (0..self.worlds.len())
            .map(|t| (self.place(t, sole) - self.origin(t, sole.0)).norm())
            .sum();
        total / self.worlds.len() as f64
    }

    /// Whether the chain down to a sole is long enough for a leg.
    fn hangs(&self, sole: &(usize, Point3<f64>), chain: &[usize]) -> bool {
        self.length(chain) + self.tip(sole) >= LEAST_LEG * self.height
    }

    fn foot(&self, sole: &(usize, Point3<f64>), all: &[usize]) -> Foot {
        let (node, sole) = *sole;
        let chain = self.own_chain(node, all);
        let leg = if self.hangs(&(node, sole), &chain) {
            None
        } else {
            self.separate_leg(node, &chain, all)
        };
        let (joints, end, loose, length) = match leg {
            Some(leg) => {
                let (end, joints) = (leg[leg.len() - 1], leg[..leg.len() - 1].to_vec());
                (joints, (end, Point3::origin()), Some(chain[0]), self.length(&leg))
            }
            // With two joints above it the foot keeps its direction in space.
            None if chain.len() > 2 => {
                let joints = chain[..chain.len() - 1].to_vec();
                (joints, (node, Point3::origin()), None, self.length(&chain))
            }
            None => {
                let length = self.length(&chain) + self.tip(&(node, sole));
                (chain.clone(), (node, sole), None, length)
            }
        };
        Foot { node, sole, joints, end, loose, leg_length: length }
    }

    /// The chain that ends nearest to a foot which does not hang on its leg.
    fn separate_leg(&self, node: usize, own: &[usize], all: &[usize]) -> Option<Vec<usize>> {
        let has_child = |n: usize| self.above.iter().any(|a| a.first() == Some(&n));
        let apart = |n: usize, foot: usize| -> f64 {
            let own = self.subtree(foot);
            (0..self.worlds.len())
                .map(|t| {
                    let near = own.iter().map(|&o| (self.origin(t, n) - self.origin(t, o)).norm());
                    near.fold(f64::INFINITY, f64::min)
                })
                .fold(0.0, f64::max)
        };
        let leaf = |n: &usize| {
            !has_child(*n)
                && !all.iter().any(|&f| {
                    f == *n
                        || self.above[*n].contains(&f)
                        || self.above[f]
                            .first()
                            .is_some_and(|p| self.above[*n].contains(p) && own.contains(p))
                })
        };
        let leaves: Vec<usize> = (0..self.above.len()).filter(leaf).collect();
        let nearest = |foot: usize| {
            let best =
                leaves.iter().map(|&n| (n, apart(n, foot))).min_by(|a, b| a.1.total_cmp(&b.1))?;
            (best.1 < LEG_TO_FOOT * self.height).then_some(best.0)
        };
        let end = nearest(own.first().copied().unwrap_or(node))?;
        // Where another leg branches off, the trunk begins.
        let mut others: Vec<usize> = all
            .iter()
            .filter(|&&f| f != node)
            .filter_map(|&f| nearest(self.own_chain(f, all)[0]))
            .collect();
        others.push(end);
        let chain = self.own_chain(end, &others);
        (chain.len() > 2 && self.length(&chain) >= LEAST_LEG * self.height).then_some(chain)
    }
}

/// The groups, and for each that is of one side of the rig those nodes of the other side, unless they are in a group
/// already.
fn with_other_sides(mut groups: Vec<Vec<usize>>, model: &Model) -> Vec<Vec<usize>> {
    let Ok(mirror) = Mirror::of(&model.skeleton, &model.skins) else { return groups };
    for at in 0..groups.len() {
        let mut other: Vec<usize> = groups[at].iter().filter_map(|&n| mirror.partner(n)).collect();
        other.sort_unstable();
        if !other.is_empty() && !groups.iter().flatten().any(|n| other.contains(n)) {
            groups.push(other);
        }
    }
    groups
}

fn ancestors(skeleton: &Skeleton, node: usize) -> Vec<usize> {
    std::iter::successors(skeleton.nodes[node].parent, |&n| skeleton.nodes[n].parent).collect()
}

/// Vertices in the space of the node that moves them most; ends of chains where there is no mesh.
fn points(model: &Model) -> Vec<(usize, Point3<f64>)> {
    let mut points = Vec::new();
    for mesh in &model.meshes {
        let Some(weights) = &mesh.skin else {
            points.extend(mesh.positions.iter().map(|p| (mesh.node, *p)));
            continue;
        };
        let skin = &model.skins[weights.skin];
        for (at, influences) in mesh.positions.iter().zip(&weights.influences) {
            if let Some(&(joint, _)) = influences.iter().max_by(|a, b| a.1.total_cmp(&b.1)) {
                points.push((skin.joints[joint], skin.inverse_bind[joint].transform_point(at)));
            }
        }
    }
    if points.is_empty() {
        let nodes = &model.skeleton.nodes;
        let ends = (0..nodes.len()).filter(|n| nodes.iter().all(|o| o.parent != Some(*n)));
        points.extend(ends.map(|n| (n, Point3::origin())));
    }
    points
}
