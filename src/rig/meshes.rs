//! The triangle meshes of a glTF document.

use nalgebra::Point3;
use serde_json::Value;

use super::file::File;
use super::{Mesh, Model, Skin, SkinWeights, nodes};
use crate::error::{Error, Result};

/// `mode` of a primitive made of triangles, which is also the default.
const TRIANGLES: usize = 4;

/// A mesh and the primitive of the document that it was read from.
pub(super) type ReadMesh<'a> = (Mesh, &'a Value);

impl File {
    /// Reads skeleton, skins and the triangle meshes of the default scene (of all nodes when the
    /// file has no scene). Each primitive is a mesh of its own; points, lines, strips and fans are
    /// left out, morph targets stay at zero.
    ///
    /// # Errors
    /// [`Error::RigBroken`] naming the part that is wrong; [`Error::RigUnsupported`] for
    /// compressed meshes.
    pub fn model(&self) -> Result<Model> {
        let (skins, primitives) = self.drawn_primitives()?;
        let meshes = primitives.into_iter().map(|(mesh, _)| mesh).collect();
        Ok(Model { skeleton: self.skeleton().clone(), meshes, skins })
    }

    /// The skins, and the triangle meshes of the scene with the primitives they were read from.
    pub(super) fn drawn_primitives(&self) -> Result<(Vec<Skin>, Vec<ReadMesh<'_>>)> {
        let skins = nodes::skins(self)?;
        let mut primitives = Vec::new();
        for node in self.drawn_nodes()? {
            self.node_meshes(node, &skins, &mut primitives)?;
        }
        Ok((skins, primitives))
    }

    /// Nodes of the default scene, ascending.
    fn drawn_nodes(&self) -> Result<Vec<usize>> {
        let nodes = &self.skeleton().nodes;
        let scenes = self.list("scenes")?;
        if scenes.is_empty() {
            return Ok((0..nodes.len()).collect());
        }
        let index = self.index(self.document(), "scene", "document")?.unwrap_or(0);
        let place = format!("scene {index}");
        let scene = scenes.get(index).ok_or_else(|| self.fault(&place, "it does not exist"))?;
        let roots = self.indices(scene, "nodes", &place)?;
        if let Some(missing) = roots.iter().find(|&&r| r >= nodes.len()) {
            return Err(self.fault(place, format!("node {missing} does not exist")));
        }
        let mut drawn = vec![false; nodes.len()];
        for root in roots {
            drawn[root] = true;
        }
        let above = |node: usize| std::iter::successors(Some(node), |&n| nodes[n].parent);
        Ok((0..nodes.len()).filter(|&n| above(n).any(|a| drawn[a])).collect())
    }

    fn node_meshes<'a>(
        &'a self,
        node: usize,
        skins: &[Skin],
        out: &mut Vec<ReadMesh<'a>>,
    ) -> Result<()> {
        let place = format!("node {node}");
        let value = &self.list("nodes")?[node];
        let Some(index) = self.index(value, "mesh", &place)? else { return Ok(()) };
        let skin = self.index(value, "skin", &place)?;
        if let Some(skin) = skin.filter(|&s| s >= skins.len()) {
            return Err(self.fault(place, format!("skin {skin} does not exist")));
        }
        let mesh = self
            .list("meshes")?
            .get(index)
            .ok_or_else(|| self.fault(&place, format!("mesh {index} does not exist")))?;
        let primitives = mesh.get("primitives").and_then(Value::as_array);
        for (i, primitive) in primitives.into_iter().flatten().enumerate() {
            let place = format!("mesh {index}, primitive {i}");
            let skin = skin.map(|s| (s, &skins[s]));
            out.extend(self.primitive(primitive, node, skin, &place)?.map(|m| (m, primitive)));
        }
        Ok(())
    }

    fn primitive(
        &self,
        primitive: &Value,
        node: usize,
        skin: Option<(usize, &Skin)>,
        place: &str,
    ) -> Result<Option<Mesh>> {
        if self.index(primitive, "mode", place)?.unwrap_or(TRIANGLES) != TRIANGLES {
            return Ok(None);
        }
        if primitive.pointer("/extensions/KHR_draco_mesh_compression").is_some() {
            return Err(Error::RigUnsupported {
                path: self.path().to_owned(),
                what: format!("{place}, compressed with KHR_draco_mesh_compression,"),
                remedy: "export the rig without Draco mesh compression",
            });
        }
        let Some(attributes) = primitive.get("attributes") else { return Ok(None) };
        let Some(accessor) = self.index(attributes, "POSITION", place)? else { return Ok(None) };
        let positions: Vec<Point3<f64>> =
            self.accessor::<3>(accessor)?.into_iter().map(Point3::from).collect();
        let corners: Vec<usize> = match self.index(primitive, "indices", place)? {
            None => (0..positions.len()).collect(),
            Some(a) => self.index_accessor::<1>(a)?.into_iter().map(|[i]| i).collect(),
        };
        if let Some(i) = corners.iter().find(|&&i| i >= positions.len()) {
            return Err(self.fault(place, format!("vertex {i} does not exist")));
        }
        let triangles = corners.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect();
        let skin = match skin {
            Some((index, skin)) => {
                self.skin_weights(attributes, index, skin.joints.len(), positions.len(), place)?
            }
            None => None,
        };
        Ok(Some(Mesh { node, positions, triangles, skin }))
    }

    /// Influences of every vertex over all sets `JOINTS_n`, `WEIGHTS_n`; `None` without a set.
    fn skin_weights(
        &self,
        attributes: &Value,
        skin: usize,
        joint_count: usize,
        vertices: usize,
        place: &str,
    ) -> Result<Option<SkinWeights>> {
        let mut all: Option<Vec<Vec<(usize, f64)>>> = None;
        for set in 0.. {
            let Some(joints) = self.index(attributes, &format!("JOINTS_{set}"), place)? else {
                break;
            };
            let weights = self.required(attributes, &format!("WEIGHTS_{set}"), place)?;
            let joints = self.index_accessor::<4>(joints)?;
            let weights = self.accessor::<4>(weights)?;
            if joints.len() != vertices || weights.len() != vertices {
                return Err(self.fault(place, format!("set {set} of joints has another length")));
            }
            let all = all.get_or_insert_with(|| vec![Vec::new(); vertices]);
            for ((influences, j), w) in all.iter_mut().zip(joints).zip(weights) {
                influences.extend(j.into_iter().zip(w).filter(|&(_, w)| w > 0.0));
            }
        }
        let Some(mut influences) = all else { return Ok(None) };
        for influences in &mut influences {
            if let Some((joint, _)) = influences.iter().find(|(j, _)| *j >= joint_count) {
                return Err(self.fault(place, format!("joint {joint} is not in the skin")));
            }
            normalize(influences);
        }
        Ok(Some(SkinWeights { skin, influences }))
    }
}

/// Scales weights to the sum 1. A vertex without any weight goes with the first joint, as in most
/// viewers; glTF leaves it undefined.
fn normalize(influences: &mut Vec<(usize, f64)>) {
    let sum: f64 = influences.iter().map(|(_, w)| w).sum();
    if sum > 0.0 {
        influences.iter_mut().for_each(|(_, w)| *w /= sum);
    } else {
        *influences = vec![(0, 1.0)];
    }
}
