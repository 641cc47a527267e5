//! What there is to draw: meshes, rigid on a node or bound to joints by a skin.

use nalgebra::{Matrix4, Point3};

use super::{Pose, Skeleton};

/// The joints a mesh may be bound to.
#[derive(Clone, Debug, PartialEq)]
pub struct Skin {
    /// Node index of each joint.
    pub joints: Vec<usize>,
    /// For each joint, the matrix from mesh space to the joint's space in the bind pose.
    pub inverse_bind: Vec<Matrix4<f64>>,
}

/// The binding of a mesh's vertices to the joints of a skin.
#[derive(Clone, Debug, PartialEq)]
pub struct SkinWeights {
    /// Index into [`Model::skins`].
    pub skin: usize,
    /// For each vertex its influences: (index into [`Skin::joints`], weight); weights sum to 1.
    pub influences: Vec<Vec<(usize, f64)>>,
}

/// A triangle mesh hung on a node.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    /// The node that carries the mesh; its transform is ignored when the mesh is skinned, as glTF
    /// demands.
    pub node: usize,
    /// Vertices in mesh space, rig units.
    pub positions: Vec<Point3<f64>>,
    /// Vertex indices, three a triangle.
    pub triangles: Vec<[usize; 3]>,
    /// The binding to joints, `None` for a rigid mesh.
    pub skin: Option<SkinWeights>,
}

/// A rig that can be posed and drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct Model {
    /// The node hierarchy.
    pub skeleton: Skeleton,
    /// All meshes of the scene.
    pub meshes: Vec<Mesh>,
    /// All skins.
    pub skins: Vec<Skin>,
}

impl Model {
    /// World positions of every mesh's vertices in a pose, by linear blend skinning where there is
    /// a skin; one list a mesh, in the order of [`Model::meshes`].
    ///
    /// # Panics
    /// When `pose` has not one entry for each node of the skeleton.
    #[must_use]
    pub fn posed_vertices(&self, pose: &Pose) -> Vec<Vec<Point3<f64>>> {
        let world = self.skeleton.world_matrices(pose);
        self.meshes
            .iter()
            .map(|mesh| match &mesh.skin {
                None => {
                    mesh.positions.iter().map(|p| world[mesh.node].transform_point(p)).collect()
                }
                Some(weights) => self.skinned_vertices(mesh, weights, &world),
            })
            .collect()
    }

    fn skinned_vertices(
        &self,
        mesh: &Mesh,
        weights: &SkinWeights,
        world: &[Matrix4<f64>],
    ) -> Vec<Point3<f64>> {
        let skin = &self.skins[weights.skin];
        let joint_matrices: Vec<Matrix4<f64>> = skin
            .joints
            .iter()
            .zip(&skin.inverse_bind)
            .map(|(&j, inverse)| world[j] * inverse)
            .collect();
        mesh.positions
            .iter()
            .zip(&weights.influences)
            .map(|(p, influences)| {
                let blended = influences
                    .iter()
                    .fold(Matrix4::zeros(), |sum, &(joint, w)| sum + joint_matrices[joint] * w);
                blended.transform_point(p)
            })
            .collect()
    }
}

impl Skeleton {
    /// The matrix from each node's space to world space in a pose.
    ///
    /// # Panics
    /// When `pose` has not one entry for each node, or the hierarchy has a cycle (the readers of
    /// rig files refuse both).
    #[must_use]
    pub fn world_matrices(&self, pose: &Pose) -> Vec<Matrix4<f64>> {
        assert_eq!(pose.nodes.len(), self.nodes.len(), "one transform a node");
        self.completed(pose, vec![None; self.nodes.len()])
    }

    /// World matrices of which some are known; the other nodes hang on theirs as they are posed.
    ///
    /// # Panics
    /// When the hierarchy has a cycle.
    pub(super) fn completed(
        &self,
        pose: &Pose,
        mut world: Vec<Option<Matrix4<f64>>>,
    ) -> Vec<Matrix4<f64>> {
        for start in 0..self.nodes.len() {
            // Parents may come after their children in a file: walk up to the first known
            // ancestor, then come back down.
            let mut chain = Vec::new();
            let mut at = Some(start);
            while let Some(node) = at.filter(|&n| world[n].is_none()) {
                assert!(chain.len() <= self.nodes.len(), "the hierarchy has a cycle");
                chain.push(node);
                at = self.nodes[node].parent;
            }
            let mut matrix = at.and_then(|n| world[n]).unwrap_or_else(Matrix4::identity);
            for &node in chain.iter().rev() {
                matrix *= pose.nodes[node].matrix();
                world[node] = Some(matrix);
            }
        }
        world.into_iter().map(|m| m.unwrap_or_else(Matrix4::identity)).collect()
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{UnitQuaternion, Vector3};

    use super::*;
    use crate::rig::{Node, NodePose};

    #[test]
    fn a_child_listed_before_its_parent_is_carried_along() {
        let moved = NodePose { translation: Vector3::new(1.0, 0.0, 0.0), ..NodePose::IDENTITY };
        let turned = NodePose {
            rotation: UnitQuaternion::from_axis_angle(
                &Vector3::z_axis(),
                std::f64::consts::FRAC_PI_2,
            ),
            ..NodePose::IDENTITY
        };
        let skeleton = Skeleton {
            nodes: vec![
                Node { name: "child".into(), parent: Some(1), rest: moved },
                Node { name: "parent".into(), parent: None, rest: turned },
            ],
        };
        let world = skeleton.world_matrices(&skeleton.rest_pose());
        let tip = world[0].transform_point(&Point3::origin());
        assert!((tip - Point3::new(0.0, 1.0, 0.0)).norm() < 1e-12, "{tip}");
    }
}
