//! The animated rig reduced to what the page's viewer draws: a GLB file with triangles, skins, base
//! colours, small textures and one animation.
//!
//! Numbers are stored no finer than a picture shows them (glTF 2.0 §3.6.2.2 has the integer forms):
//! normals in 8 bits, weights in 16, at most four joints a vertex. Nodes keep their indices. Left out:
//! other animations, morph targets, cameras, lights and every extension.

use serde_json::{Value, json};

use crate::error::{Error, Result};
use crate::rig::{Clip, File, Look, Skin, SkinWeights, Surface};

mod glb;
pub(super) mod texture;

use glb::Glb;

/// Makes the copy. With `textures`, those that can be read are reduced to a small size; others are left
/// out, as a viewer shows the base colour then.
///
/// # Errors
/// When the rig's meshes, skins or materials cannot be understood.
pub(super) fn rig_copy(file: &File, clip: &Clip, textures: bool) -> Result<Vec<u8>> {
    let (surfaces, skins) = file.surfaces()?;
    let mut glb = Glb::default();
    let nodes = nodes(file);
    let mut document = json!({
        "asset": {"version": "2.0", "generator": concat!("muybridge ", env!("CARGO_PKG_VERSION"))},
    });
    let skins: Vec<Value> = skins.iter().map(|skin| skin_value(skin, &mut glb)).collect();
    let materials = materials(file, &surfaces, textures, &mut glb);
    let meshes: Vec<Value> = surfaces
        .iter()
        .zip(&materials.of_surface)
        .map(|(surface, material)| mesh_value(surface, *material, &mut glb))
        .collect();
    document["nodes"] = nodes;
    hang_up(&mut document, &surfaces);
    document["animations"] = json!([animation(clip, &mut glb)]);
    for (name, list) in [
        ("meshes", meshes),
        ("skins", skins),
        ("materials", materials.values),
        ("images", materials.images),
        ("textures", materials.textures),
    ] {
        // An empty array is not allowed in glTF.
        if !list.is_empty() {
            document[name] = Value::Array(list);
        }
    }
    glb.finish(document).ok_or_else(|| Error::Drawing {
        what: "the rig's copy for the page".to_owned(),
        reason: "it is too large for a GLB file".to_owned(),
    })
}

/// All nodes with their rest transforms and children.
fn nodes(file: &File) -> Value {
    let skeleton = file.skeleton();
    let nodes = skeleton.nodes.iter().enumerate().map(|(at, node)| {
        let rest = &node.rest;
        let children: Vec<usize> = (0..skeleton.nodes.len())
            .filter(|&child| skeleton.nodes[child].parent == Some(at))
            .collect();
        let mut value = json!({
            "name": node.name,
            "translation": rest.translation.as_slice(),
            "rotation": rest.rotation.coords.as_slice(),
            "scale": rest.scale.as_slice(),
        });
        if !children.is_empty() {
            value["children"] = json!(children);
        }
        value
    });
    nodes.collect()
}

/// Hangs every mesh on a node: the one it had, or, where that has one already, a new child of it.
fn hang_up(document: &mut Value, surfaces: &[Surface]) {
    let Some(nodes) = document["nodes"].as_array_mut() else { return };
    for (mesh, surface) in surfaces.iter().enumerate() {
        let mut node = surface.mesh.node;
        if nodes[node].get("mesh").is_some() {
            let child = nodes.len();
            nodes.push(json!({}));
            let parent = &mut nodes[node];
            match parent.get_mut("children").and_then(Value::as_array_mut) {
                Some(children) => children.push(json!(child)),
                None => parent["children"] = json!([child]),
            }
            node = child;
        }
        nodes[node]["mesh"] = json!(mesh);
        if let Some(weights) = &surface.mesh.skin {
            nodes[node]["skin"] = json!(weights.skin);
        }
    }
    let mut is_child = vec![false; nodes.len()];
    for child in nodes.iter().filter_map(|n| n.get("children")?.as_array()).flatten() {
        if let Some(child) = child.as_u64() {
            is_child[child as usize] = true;
        }
    }
    let roots: Vec<usize> = (0..is_child.len()).filter(|&n| !is_child[n]).collect();
    document["scenes"] = json!([{"nodes": roots}]);
    document["scene"] = json!(0);
}

fn skin_value(skin: &Skin, glb: &mut Glb) -> Value {
    let matrices: Vec<[f64; 16]> =
        skin.inverse_bind.iter().map(|m| std::array::from_fn(|i| m.as_slice()[i])).collect();
    json!({"joints": skin.joints, "inverseBindMatrices": glb.floats("MAT4", &matrices)})
}

fn mesh_value(surface: &Surface, material: usize, glb: &mut Glb) -> Value {
    let mesh = &surface.mesh;
    let positions: Vec<[f64; 3]> = mesh.positions.iter().map(|p| [p.x, p.y, p.z]).collect();
    let mut attributes = json!({"POSITION": glb.positions(&positions)});
    if !surface.normals.is_empty() {
        attributes["NORMAL"] = json!(glb.normals(&surface.normals));
    }
    if surface.look.image.is_some() && !surface.texture_coordinates.is_empty() {
        attributes["TEXCOORD_0"] = json!(glb.floats("VEC2", &surface.texture_coordinates));
    }
    if let Some(weights) = &mesh.skin {
        let (joints, shares) = four_largest(weights);
        attributes["JOINTS_0"] = json!(glb.joints(&joints));
        attributes["WEIGHTS_0"] = json!(glb.weights(&shares));
    }
    let corners: Vec<usize> = mesh.triangles.iter().flatten().copied().collect();
    let indices = glb.indices(&corners, positions.len());
    let primitive = json!({"attributes": attributes, "indices": indices, "material": material});
    json!({"primitives": [primitive]})
}

/// The four largest influences of every vertex, their weights brought to the sum 1.
fn four_largest(weights: &SkinWeights) -> (Vec<[usize; 4]>, Vec<[f64; 4]>) {
    weights
        .influences
        .iter()
        .map(|all| {
            let mut sorted = all.clone();
            sorted.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
            sorted.resize(4, (0, 0.0));
            let sum: f64 = sorted.iter().map(|(_, w)| w).sum();
            let share = |i: usize| if sum > 0.0 { sorted[i].1 / sum } else { 0.0 };
            (std::array::from_fn(|i| sorted[i].0), std::array::from_fn(share))
        })
        .unzip()
}

/// Materials of the copy, one for each look that occurs.
#[derive(Default)]
struct Materials {
    values: Vec<Value>,
    images: Vec<Value>,
    textures: Vec<Value>,
    /// For each surface the index into `values`.
    of_surface: Vec<usize>,
}

fn materials(file: &File, surfaces: &[Surface], textures: bool, glb: &mut Glb) -> Materials {
    let mut made = Materials::default();
    let mut looks: Vec<Look> = Vec::new();
    // For each image of the file that was tried, its texture in the copy.
    let mut tried: Vec<(usize, Option<usize>)> = Vec::new();
    for surface in surfaces {
        let look = surface.look;
        let known = looks.iter().position(|l| *l == look);
        made.of_surface.push(known.unwrap_or(looks.len()));
        if known.is_some() {
            continue;
        }
        looks.push(look);
        let mut metallic = json!({"baseColorFactor": look.base_colour});
        if let Some(image) = look.image.filter(|_| textures) {
            let known = tried.iter().find(|(i, _)| *i == image).map(|(_, t)| *t);
            let texture = known.unwrap_or_else(|| {
                let texture = texture::reduced(file, image).map(|(bytes, kind)| {
                    let view = glb.view(&bytes);
                    made.images.push(json!({"bufferView": view, "mimeType": kind}));
                    made.textures.push(json!({"source": made.images.len() - 1}));
                    made.textures.len() - 1
                });
                tried.push((image, texture));
                texture
            });
            if let Some(texture) = texture {
                metallic["baseColorTexture"] = json!({"index": texture});
            }
        }
        let mut value = json!({"pbrMetallicRoughness": metallic, "doubleSided": true});
        if let Some(cutoff) = look.cutoff {
            value["alphaMode"] = json!("MASK");
            value["alphaCutoff"] = json!(cutoff);
        }
        made.values.push(value);
    }
    made
}

/// The clip as one linear key a frame.
fn animation(clip: &Clip, glb: &mut Glb) -> Value {
    let times: Vec<[f64; 1]> = (0..clip.poses.len()).map(|i| [i as f64 / clip.fps]).collect();
    let input = glb.times(&times);
    let (mut samplers, mut channels) = (Vec::new(), Vec::new());
    let mut channel = |node: usize, path: &str, output: usize| {
        samplers.push(json!({"input": input, "output": output, "interpolation": "LINEAR"}));
        let sampler = samplers.len() - 1;
        channels.push(json!({"sampler": sampler, "target": {"node": node, "path": path}}));
    };
    for (node, driven) in clip.driven.iter().enumerate() {
        let poses = || clip.poses.iter().map(move |pose| &pose.nodes[node]);
        if driven.translation {
            let values: Vec<[f64; 3]> = poses().map(|p| p.translation.into()).collect();
            channel(node, "translation", glb.floats("VEC3", &values));
        }
        if driven.rotation {
            let values: Vec<[f64; 4]> = poses().map(|p| p.rotation.coords.into()).collect();
            channel(node, "rotation", glb.floats("VEC4", &values));
        }
        if driven.scale {
            let values: Vec<[f64; 3]> = poses().map(|p| p.scale.into()).collect();
            channel(node, "scale", glb.floats("VEC3", &values));
        }
    }
    json!({"name": clip.name, "samplers": samplers, "channels": channels})
}

#[cfg(test)]
mod tests;
