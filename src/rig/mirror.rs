//! A rig in a mirror: which nodes are each other's left and right, and what a pose looks like with the sides exchanged.
//!
//! With S the reflection at the rig's plane of symmetry, j' the other side's node of node j and B the orientations of a
//! symmetric reference pose, node j of the mirrored pose is oriented as S G(j') S C(j) in the world, where G(j') is the
//! orientation of j' and C(j) = (S B(j') S)⁻¹ B(j) makes up for how differently the bones of the two sides are rolled.
//! Between a node and its parent p that is C(p)⁻¹ (S R S) C(j), R the local rotation of j'; a translation becomes
//! C(p)⁻¹ S t.
//!
//! Sides are found by geometry: the hierarchy is followed from the roots, and the children of a pair are paired
//! where the reflection of one falls on the other. Names decide between children in the same place.

use std::fmt;

use nalgebra::{Matrix4, Quaternion, UnitQuaternion, Vector3};

use super::nodes::{decomposed, skins};
use super::sides::{other_side, side};
use super::{Driven, File, NodePose, Pose, Skeleton, Skin};
use crate::error::Result;

/// Two nodes are a pair where the reflection of one misses the other by this share of the rig's size at most.
const PAIR_MISS: f64 = 0.04;

/// … and a rig has a mirror where they miss by this much on the average.
const MEAN_MISS: f64 = 0.015;

/// Share of the nodes that may be without another side (a sword in the right hand).
const MOST_UNPAIRED: f64 = 0.1;

/// What a name decides, as a share of the rig's size: less than places do.
const NAME_COST: f64 = 0.002;

/// The plane that exchanges the sides of a rig, and which nodes are each other's.
#[derive(Clone, Debug, PartialEq)]
pub struct Mirror {
    /// Unit normal of the plane, world axes.
    normal: Vector3<f64>,
    /// Its distance from the origin along the normal, rig units.
    offset: f64,
    /// The other side of each node; itself for one in the middle, `None` for one that has no other side.
    partner: Vec<Option<usize>>,
    parent: Vec<Option<usize>>,
    /// C(j) of the equation above.
    roll: Vec<UnitQuaternion<f64>>,
}

/// Why a rig has no mirror.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NoMirror(String);

impl fmt::Display for NoMirror {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl Mirror {
    /// The mirror of a rig's file: of its bind pose or its rest pose, whichever is the more symmetric.
    ///
    /// # Errors
    /// When the file's skins cannot be read. The inner error says why a rig has no mirror.
    pub fn of_file(file: &File) -> Result<std::result::Result<Self, NoMirror>> {
        Ok(Self::of(file.skeleton(), &skins(file)?))
    }

    /// The mirror of a skeleton with the skins bound to it.
    ///
    /// # Errors
    /// [`NoMirror`] when no plane reflects the one side into the other.
    pub fn of(skeleton: &Skeleton, skins: &[Skin]) -> std::result::Result<Self, NoMirror> {
        let rest = skeleton.world_matrices(&skeleton.rest_pose());
        let mut references = vec![rest.clone()];
        references.extend(bind_pose(skeleton, skins, &rest));
        let shown: Vec<usize> = if skins.is_empty() {
            (0..skeleton.nodes.len()).collect()
        } else {
            let mut joints: Vec<usize> = skins.iter().flat_map(|s| s.joints.clone()).collect();
            joints.sort_unstable();
            joints.dedup();
            joints
        };
        let mut best: Option<(f64, Self)> = None;
        for reference in &references {
            let rig = Reference::new(skeleton, reference, &shown);
            for (normal, offset) in rig.planes() {
                let partner = rig.pairs(normal, offset);
                let miss = rig.miss(&partner, normal, offset);
                if best.as_ref().is_none_or(|b| miss < b.0) {
                    best = Some((miss, rig.mirror(partner, normal, offset)));
                }
            }
        }
        match best {
            Some((miss, mirror)) if miss <= MEAN_MISS => {
                let unpaired = shown.iter().filter(|&&n| mirror.partner[n].is_none()).count();
                if unpaired as f64 > MOST_UNPAIRED * shown.len() as f64 {
                    let what = format!("{unpaired} of {} bones have no other side", shown.len());
                    return Err(NoMirror(what));
                }
                Ok(mirror)
            }
            Some((miss, _)) => Err(NoMirror(format!(
                "its left and right miss one another by {:.1} % of its size",
                100.0 * miss
            ))),
            None => Err(NoMirror("it has no bones".to_owned())),
        }
    }

    /// The other side of a node: itself in the middle, `None` when it has none.
    ///
    /// # Panics
    /// When there is no such node.
    #[must_use]
    pub fn partner(&self, node: usize) -> Option<usize> {
        self.partner[node]
    }

    /// The pose with the sides exchanged. Channels that nothing drives, and nodes without another side, stay as they are.
    ///
    /// # Panics
    /// When `pose` or `driven` has not one entry a node.
    #[must_use]
    pub fn pose(&self, pose: &Pose, driven: &[Driven]) -> Pose {
        assert_eq!(pose.nodes.len(), self.partner.len(), "one transform a node");
        assert_eq!(driven.len(), self.partner.len(), "one entry a node");
        let nodes = (0..pose.nodes.len()).map(|node| self.node(node, pose, driven[node])).collect();
        Pose { nodes }
    }

    fn node(&self, node: usize, pose: &Pose, driven: Driven) -> NodePose {
        let mut made = pose.nodes[node];
        let Some(partner) = self.partner[node] else { return made };
        let other = pose.nodes[partner];
        let above = self.parent[node].map_or_else(UnitQuaternion::identity, |p| self.roll[p]);
        if driven.rotation {
            let reflected = reflected(&other.rotation, &self.normal);
            made.rotation = above.inverse() * reflected * self.roll[node];
        }
        if driven.translation {
            let mut across =
                other.translation - 2.0 * self.normal * self.normal.dot(&other.translation);
            if self.parent[node].is_none() {
                across += 2.0 * self.offset * self.normal;
            }
            made.translation = above.inverse() * across;
        }
        if driven.scale {
            made.scale = other.scale;
        }
        made
    }
}

/// S R S: the rotation seen in a mirror with that normal. The axis of a rotation is reflected and reversed.
fn reflected(rotation: &UnitQuaternion<f64>, normal: &Vector3<f64>) -> UnitQuaternion<f64> {
    let axis = rotation.imag();
    let axis = 2.0 * normal * normal.dot(&axis) - axis;
    UnitQuaternion::new_unchecked(Quaternion::from_parts(rotation.w, axis))
}

/// World matrices of the bind pose: those of a skin's joints are its inverse bind matrices inverted, moved so that its
/// first joint is where it rests; other nodes hang on theirs as they rest. `None` without skins.
fn bind_pose(
    skeleton: &Skeleton,
    skins: &[Skin],
    rest: &[Matrix4<f64>],
) -> Option<Vec<Matrix4<f64>>> {
    let mut bound: Vec<Option<Matrix4<f64>>> = vec![None; rest.len()];
    for skin in skins {
        let (&first, first_inverse) = skin.joints.iter().zip(&skin.inverse_bind).next()?;
        let placed = rest[first] * first_inverse;
        for (&joint, inverse) in skin.joints.iter().zip(&skin.inverse_bind) {
            let bind = inverse.try_inverse()?;
            bound[joint].get_or_insert(placed * bind);
        }
    }
    let any = bound.iter().any(Option::is_some);
    any.then(|| skeleton.completed(&skeleton.rest_pose(), bound))
}

/// A pose in which the sides are looked for.
struct Reference<'a> {
    skeleton: &'a Skeleton,
    /// Nodes that count.
    shown: &'a [usize],
    places: Vec<Vector3<f64>>,
    /// Middle of each node and all below it that counts.
    middles: Vec<Vector3<f64>>,
    children: Vec<Vec<usize>>,
    orientations: Vec<UnitQuaternion<f64>>,
    size: f64,
}

impl<'a> Reference<'a> {
    fn new(skeleton: &'a Skeleton, world: &[Matrix4<f64>], shown: &'a [usize]) -> Self {
        let transforms: Vec<NodePose> = world.iter().map(decomposed).collect();
        let places: Vec<Vector3<f64>> = transforms.iter().map(|t| t.translation).collect();
        let mut children = vec![Vec::new(); places.len()];
        let mut sums = vec![(Vector3::zeros(), 0.0); places.len()];
        for (node, n) in skeleton.nodes.iter().enumerate() {
            if let Some(parent) = n.parent {
                children[parent].push(node);
            }
        }
        for &node in shown {
            let mut at = Some(node);
            while let Some(n) = at {
                sums[n].0 += places[node];
                sums[n].1 += 1.0;
                at = skeleton.nodes[n].parent;
            }
        }
        let middles = (sums.iter().zip(&places))
            .map(|((sum, count), place)| if *count > 0.0 { sum / *count } else { *place })
            .collect();
        let far = |pick: fn(f64, f64) -> f64, start: f64| {
            shown
                .iter()
                .fold(Vector3::repeat(start), |v: Vector3<f64>, &n| v.zip_map(&places[n], pick))
        };
        let size = (far(f64::max, f64::NEG_INFINITY) - far(f64::min, f64::INFINITY)).norm();
        Self {
            skeleton,
            shown,
            middles,
            children,
            orientations: transforms.iter().map(|t| t.rotation).collect(),
            size: if size.is_finite() && size > 0.0 { size } else { 1.0 },
            places,
        }
    }

    /// Planes that may be the rig's: across what names call left and right, across the two level axes. (+Y is up in
    /// glTF.) Each through the middle between the named sides, the origin, or the middle of all nodes.
    fn planes(&self) -> Vec<(Vector3<f64>, f64)> {
        let mut planes = Vec::new();
        let named = self.named_pairs();
        let across: Vector3<f64> =
            named.iter().map(|&(l, r)| self.places[l] - self.places[r]).sum();
        let count = named.len() as f64;
        if let Some(normal) = across.try_normalize(1e-6 * self.size) {
            let between: f64 = named
                .iter()
                .map(|&(l, r)| normal.dot(&(self.places[l] + self.places[r])) / 2.0)
                .sum();
            planes.push((normal, between / count));
        }
        let middle: Vector3<f64> = self.shown.iter().map(|&n| self.places[n]).sum();
        let middle = middle / self.shown.len().max(1) as f64;
        for normal in [Vector3::x(), Vector3::z()] {
            planes.extend([(normal, 0.0), (normal, normal.dot(&middle))]);
        }
        planes
    }

    fn named_pairs(&self) -> Vec<(usize, usize)> {
        let name = |n: usize| self.skeleton.nodes[n].name.as_str();
        let left = self.shown.iter().filter(|&&n| side(name(n)) == Some(true));
        left.filter_map(|&l| {
            let other = other_side(name(l))?;
            let r = self.shown.iter().find(|&&r| name(r) == other)?;
            Some((l, *r))
        })
        .collect()
    }

    fn pairs(&self, normal: Vector3<f64>, offset: f64) -> Vec<Option<usize>> {
        let mut partner = vec![None; self.places.len()];
        let roots: Vec<usize> =
            (0..self.places.len()).filter(|&n| self.skeleton.nodes[n].parent.is_none()).collect();
        let across = Across { normal, offset };
        let mut open = self.matched(&roots, &roots, &across);
        while let Some((a, b)) = open.pop() {
            partner[a] = Some(b);
            partner[b] = Some(a);
            open.extend(self.matched(&self.children[a], &self.children[b], &across));
        }
        partner
    }

    /// Pairs between two lists of siblings, the best first; a list against itself gives each pair once.
    fn matched(&self, a: &[usize], b: &[usize], across: &Across) -> Vec<(usize, usize)> {
        let same = a == b;
        let mut all: Vec<(f64, usize, usize)> = Vec::new();
        for &i in a {
            for &j in b.iter().filter(|&&j| !same || j >= i) {
                let miss = |of: &[Vector3<f64>]| (across.of(&of[i]) - of[j]).norm();
                let place = miss(&self.places).max(miss(&self.middles)) / self.size;
                if place <= PAIR_MISS {
                    let (own, other) = (&self.skeleton.nodes[i].name, &self.skeleton.nodes[j].name);
                    let named = other_side(own).map_or(own == other, |o| o == *other);
                    let cost = miss(&self.places) / self.size + miss(&self.middles) / self.size;
                    all.push((cost + if named { 0.0 } else { NAME_COST }, i, j));
                }
            }
        }
        all.sort_by(|x, y| x.0.total_cmp(&y.0).then((x.1, x.2).cmp(&(y.1, y.2))));
        let mut taken: Vec<usize> = Vec::new();
        let mut pairs = Vec::new();
        for (_, i, j) in all {
            if !taken.contains(&i) && !taken.contains(&j) {
                taken.extend([i, j]);
                pairs.push((i, j));
            }
        }
        pairs
    }

    /// Mean distance of the reflected nodes from their partners as a share of the size; one without a partner
    /// counts as the farthest that a partner may be.
    fn miss(&self, partner: &[Option<usize>], normal: Vector3<f64>, offset: f64) -> f64 {
        let across = Across { normal, offset };
        let sum: f64 = (self.shown.iter())
            .map(|&n| match partner[n] {
                Some(p) => (across.of(&self.places[n]) - self.places[p]).norm() / self.size,
                None => PAIR_MISS,
            })
            .sum();
        sum / self.shown.len().max(1) as f64
    }

    fn mirror(&self, partner: Vec<Option<usize>>, normal: Vector3<f64>, offset: f64) -> Mirror {
        let roll = (self.orientations.iter().enumerate())
            .map(|(n, own)| {
                let other = self.orientations[partner[n].unwrap_or(n)];
                reflected(&other, &normal).inverse() * own
            })
            .collect();
        let parent = self.skeleton.nodes.iter().map(|n| n.parent).collect();
        Mirror { normal, offset, partner, parent, roll }
    }
}

/// The reflection of places.
struct Across {
    normal: Vector3<f64>,
    offset: f64,
}

impl Across {
    fn of(&self, place: &Vector3<f64>) -> Vector3<f64> {
        place - 2.0 * self.normal * (self.normal.dot(place) - self.offset)
    }
}
