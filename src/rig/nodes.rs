//! Nodes, hierarchy and skins of a glTF document.

use nalgebra::{Matrix3, Matrix4, Quaternion, Rotation3, UnitQuaternion, Vector3};
use serde_json::Value;

use super::file::File;
use super::{Node, NodePose, Skeleton, Skin};
use crate::error::Result;

/// Reads the nodes and checks that they form trees.
pub(super) fn skeleton(file: &File) -> Result<Skeleton> {
    let list = file.list("nodes")?;
    let mut nodes = Vec::with_capacity(list.len());
    for (i, value) in list.iter().enumerate() {
        let name = value.get("name").and_then(Value::as_str).filter(|n| !n.is_empty());
        let name = name.map_or_else(|| format!("node {i}"), str::to_owned);
        nodes.push(Node { name, parent: None, rest: rest(file, value, &format!("node {i}"))? });
    }
    for (i, value) in list.iter().enumerate() {
        let place = format!("node {i}");
        for child in file.indices(value, "children", &place)? {
            let node = nodes
                .get_mut(child)
                .ok_or_else(|| file.fault(&place, format!("child {child} does not exist")))?;
            if let Some(other) = node.parent.replace(i) {
                let reason = format!("it is a child of both node {other} and node {i}");
                return Err(file.fault(format!("node {child}"), reason));
            }
        }
    }
    match first_in_cycle(&nodes) {
        Some(i) => Err(file.fault(format!("node {i}"), "it is its own ancestor")),
        None => Ok(Skeleton { nodes }),
    }
}

/// A node that has no root above it, if there is one.
fn first_in_cycle(nodes: &[Node]) -> Option<usize> {
    let mut reaches_root = vec![false; nodes.len()];
    for start in 0..nodes.len() {
        let mut chain = Vec::new();
        let mut at = Some(start);
        while let Some(node) = at.filter(|&n| !reaches_root[n]) {
            if chain.len() > nodes.len() {
                return Some(start);
            }
            chain.push(node);
            at = nodes[node].parent;
        }
        for node in chain {
            reaches_root[node] = true;
        }
    }
    None
}

fn rest(file: &File, value: &Value, place: &str) -> Result<NodePose> {
    if let Some(m) = file.numbers::<16>(value, "matrix", place)? {
        return Ok(decomposed(&Matrix4::from_column_slice(&m)));
    }
    let mut pose = NodePose::IDENTITY;
    if let Some(t) = file.numbers::<3>(value, "translation", place)? {
        pose.translation = t.into();
    }
    if let Some(q) = file.numbers::<4>(value, "rotation", place)? {
        pose.rotation = unit_quaternion(q)
            .ok_or_else(|| file.fault(place, "\"rotation\" is not a unit quaternion"))?;
    }
    if let Some(s) = file.numbers::<3>(value, "scale", place)? {
        pose.scale = s.into();
    }
    Ok(pose)
}

/// A quaternion in glTF order x, y, z, w, normalised; `None` when it has no direction.
pub(super) fn unit_quaternion([x, y, z, w]: [f64; 4]) -> Option<UnitQuaternion<f64>> {
    let q = Quaternion::new(w, x, y, z);
    let norm = q.norm();
    (norm.is_finite() && norm > 1e-12).then(|| UnitQuaternion::new_unchecked(q / norm))
}

/// T·R·S of a matrix without shear (glTF 2.0 §3.5.3 demands that there is none; what there is of
/// it is dropped by Gram-Schmidt). A reflection becomes a negative scale along x. Axes of scale
/// zero are completed to a right-handed frame.
pub(super) fn decomposed(m: &Matrix4<f64>) -> NodePose {
    let column = |i: usize| Vector3::new(m[(0, i)], m[(1, i)], m[(2, i)]);
    let axes = [column(0), column(1), column(2)];
    let mut scale = Vector3::from(axes.map(|a| a.norm()));
    if Matrix3::from_columns(&axes).determinant() < 0.0 {
        scale.x = -scale.x;
    }
    let unit = |i: usize| (scale[i] != 0.0).then(|| axes[i] / scale[i]);
    let x = unit(0).or_else(|| unit(1)?.cross(&unit(2)?).try_normalize(1e-12));
    let y = unit(1).or_else(|| unit(2)?.cross(&x?).try_normalize(1e-12));
    let frame = x.zip(y).and_then(|(x, y)| {
        let z = x.cross(&y).try_normalize(1e-12)?;
        Some(Matrix3::from_columns(&[x, z.cross(&x), z]))
    });
    let rotation = frame.map_or_else(UnitQuaternion::identity, |f| {
        UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(f))
    });
    NodePose { translation: column(3), rotation, scale }
}

/// All skins of the file; a skin without inverse bind matrices has identities.
pub(super) fn skins(file: &File) -> Result<Vec<Skin>> {
    let list = file.list("skins")?;
    list.iter().enumerate().map(|(i, value)| skin(file, i, value)).collect()
}

fn skin(file: &File, index: usize, value: &Value) -> Result<Skin> {
    let place = format!("skin {index}");
    let joints = joints(file, value, &place)?;
    let inverse_bind = match file.index(value, "inverseBindMatrices", &place)? {
        None => vec![Matrix4::identity(); joints.len()],
        Some(accessor) => {
            let matrices = file.accessor::<16>(accessor)?;
            if matrices.len() < joints.len() {
                let reason =
                    format!("{} inverse bind matrices for {} joints", matrices.len(), joints.len());
                return Err(file.fault(place, reason));
            }
            matrices.iter().take(joints.len()).map(|m| Matrix4::from_column_slice(m)).collect()
        }
    };
    Ok(Skin { joints, inverse_bind })
}

fn joints(file: &File, skin: &Value, place: &str) -> Result<Vec<usize>> {
    let joints = file.indices(skin, "joints", place)?;
    match joints.iter().find(|&&j| j >= file.skeleton().nodes.len()) {
        Some(j) => Err(file.fault(place, format!("joint node {j} does not exist"))),
        None => Ok(joints),
    }
}

impl File {
    /// The nodes that some skin uses as joints, ascending, each once; empty for a file without
    /// skins.
    ///
    /// # Errors
    /// [`crate::Error::RigBroken`] for a joint that is no node.
    pub fn joints(&self) -> Result<Vec<usize>> {
        let mut all = Vec::new();
        for (i, skin) in self.list("skins")?.iter().enumerate() {
            all.extend(joints(self, skin, &format!("skin {i}"))?);
        }
        all.sort_unstable();
        all.dedup();
        Ok(all)
    }

    /// Whether a node's transform is given as a matrix, so that nothing may animate it (glTF 2.0
    /// §3.5.3).
    #[must_use]
    pub fn has_matrix(&self, node: usize) -> bool {
        self.document().pointer(&format!("/nodes/{node}/matrix")).is_some()
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn a_matrix_is_what_its_parts_make(
            t in prop::array::uniform3(-9.0..9.0_f64),
            r in prop::array::uniform3(-2.0..2.0_f64),
            s in prop::array::uniform3(0.01..9.0_f64),
            mirrored in any::<bool>(),
        ) {
            let mut scale = Vector3::from(s);
            if mirrored {
                scale.y = -scale.y;
            }
            let rotation = UnitQuaternion::from_scaled_axis(Vector3::from(r));
            let m = NodePose { translation: t.into(), rotation, scale }.matrix();
            let again = decomposed(&m).matrix();
            prop_assert!((m - again).amax() < 1e-12, "{} {}", m, again);
        }
    }

    #[test]
    fn flat_matrices_keep_their_matrix() {
        for scale in [[0.0, 1.0, 2.0], [1.0, 0.0, 2.0], [3.0, 2.0, 0.0], [0.0; 3], [0.0, 0.0, 1.0]]
        {
            let m = Matrix4::new_nonuniform_scaling(&Vector3::from(scale));
            assert_relative_eq!(decomposed(&m).matrix(), m, epsilon = 1e-12);
        }
    }
}
