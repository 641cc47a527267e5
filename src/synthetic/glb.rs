//! The horse as a GLB file, with clips: the rig of the demo and of `poses/`.

use serde_json::{Value, json};

use crate::rig::{Model, Pose};

/// A clip to be written: poses on an even grid.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedClip<'a> {
    /// The animation's name.
    pub name: &'a str,
    /// Poses a second.
    pub fps: f64,
    /// The poses, the first at time 0.
    pub poses: &'a [Pose],
}

/// Component types and targets of the glTF 2.0 specification.
const FLOAT: u32 = 5126;
const UNSIGNED_SHORT: u32 = 5123;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// A rig of rigid meshes as GLB 2.0 bytes. Rotations of all nodes are animated, and the translation
/// of node 0; single precision. The same input always gives the same bytes.
#[must_use]
pub fn to_glb(model: &Model, clips: &[NamedClip], name: &str) -> Vec<u8> {
    let mut writer = Writer::default();
    let meshes: Vec<Value> = (0..model.skeleton.nodes.len())
        .filter_map(|node| mesh_of_node(model, node, &mut writer))
        .collect();
    let mut next_mesh = 0;
    let nodes: Vec<Value> =
        (0..model.skeleton.nodes.len()).map(|n| node_json(model, n, &mut next_mesh)).collect();
    let animations: Vec<Value> = clips.iter().map(|c| clip_json(model, c, &mut writer)).collect();
    let mut document = json!({
        "asset": {"version": "2.0", "generator": concat!("muybridge ", env!("CARGO_PKG_VERSION"))},
        "scene": 0,
        "scenes": [{"name": name, "nodes": [0]}],
        "nodes": nodes,
        "meshes": meshes,
        "materials": [{
            "name": "coat",
            "pbrMetallicRoughness": {"baseColorFactor": [0.36, 0.17, 0.08, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.8}
        }],
        "accessors": writer.accessors,
        "bufferViews": writer.views,
        "buffers": [{"byteLength": writer.bytes.len()}],
    });
    if !animations.is_empty() {
        document["animations"] = Value::Array(animations);
    }
    container(&document.to_string(), writer.bytes)
}

#[derive(Default)]
struct Writer {
    bytes: Vec<u8>,
    accessors: Vec<Value>,
    views: Vec<Value>,
}

impl Writer {
    fn view(&mut self, bytes: &[u8], target: Option<u32>) -> usize {
        while !self.bytes.len().is_multiple_of(4) {
            self.bytes.push(0);
        }
        let mut view =
            json!({"buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len()});
        if let Some(target) = target {
            view["target"] = target.into();
        }
        self.bytes.extend_from_slice(bytes);
        self.views.push(view);
        self.views.len() - 1
    }

    /// An accessor of `width` floats an element; with its bounds where glTF demands them.
    fn floats(
        &mut self,
        values: &[f32],
        kind: &str,
        width: usize,
        target: Option<u32>,
        bounds: bool,
    ) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        let view = self.view(&bytes, target);
        let mut accessor = json!({
            "bufferView": view, "componentType": FLOAT, "count": values.len() / width, "type": kind
        });
        if bounds {
            let extreme = |pick: fn(f32, f32) -> f32| -> Vec<f32> {
                (0..width)
                    .map(|c| {
                        values.iter().skip(c).step_by(width).copied().reduce(pick).unwrap_or(0.0)
                    })
                    .collect()
            };
            accessor["min"] = extreme(f32::min).into();
            accessor["max"] = extreme(f32::max).into();
        }
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    fn indices(&mut self, values: &[u16]) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        let view = self.view(&bytes, Some(ELEMENT_ARRAY_BUFFER));
        self.accessors.push(json!({
            "bufferView": view, "componentType": UNSIGNED_SHORT, "count": values.len(), "type": "SCALAR"
        }));
        self.accessors.len() - 1
    }
}

/// All rigid meshes of a node as one glTF mesh; `None` for a node without any.
fn mesh_of_node(model: &Model, node: usize, writer: &mut Writer) -> Option<Value> {
    let mut positions: Vec<f32> = Vec::new();
    let mut indices: Vec<u16> = Vec::new();
    for mesh in model.meshes.iter().filter(|m| m.node == node) {
        let first = positions.len() / 3;
        positions.extend(mesh.positions.iter().flat_map(|p| [p.x as f32, p.y as f32, p.z as f32]));
        indices.extend(mesh.triangles.iter().flatten().map(|v| (first + v) as u16));
    }
    if positions.is_empty() {
        return None;
    }
    let position = writer.floats(&positions, "VEC3", 3, Some(ARRAY_BUFFER), true);
    let indices = writer.indices(&indices);
    Some(json!({
        "name": model.skeleton.nodes[node].name,
        "primitives": [{"attributes": {"POSITION": position}, "indices": indices, "material": 0}]
    }))
}

fn node_json(model: &Model, node: usize, next_mesh: &mut usize) -> Value {
    let skeleton = &model.skeleton;
    let rest = skeleton.nodes[node].rest;
    let t = rest.translation;
    let mut value = json!({
        "name": skeleton.nodes[node].name,
        "translation": [t.x as f32, t.y as f32, t.z as f32],
    });
    let children: Vec<usize> =
        (0..skeleton.nodes.len()).filter(|&c| skeleton.nodes[c].parent == Some(node)).collect();
    if !children.is_empty() {
        value["children"] = children.into();
    }
    if model.meshes.iter().any(|m| m.node == node) {
        value["mesh"] = (*next_mesh).into();
        *next_mesh += 1;
    }
    value
}

fn clip_json(model: &Model, clip: &NamedClip, writer: &mut Writer) -> Value {
    let times: Vec<f32> = (0..clip.poses.len()).map(|i| (i as f64 / clip.fps) as f32).collect();
    let input = writer.floats(&times, "SCALAR", 1, None, true);
    let (mut samplers, mut channels) = (Vec::new(), Vec::new());
    let mut add = |node: usize, path: &str, output: usize| {
        channels.push(json!({"sampler": samplers.len(), "target": {"node": node, "path": path}}));
        samplers.push(json!({"input": input, "output": output, "interpolation": "LINEAR"}));
    };
    let ways: Vec<f32> = clip
        .poses
        .iter()
        .flat_map(|p| p.nodes[0].translation.iter().map(|v| *v as f32).collect::<Vec<_>>())
        .collect();
    add(0, "translation", writer.floats(&ways, "VEC3", 3, None, false));
    for node in 1..model.skeleton.nodes.len() {
        let mut turns: Vec<f32> = Vec::new();
        let mut before = nalgebra::Quaternion::identity();
        for pose in clip.poses {
            let q = pose.nodes[node].rotation.into_inner();
            let q = if q.dot(&before) < 0.0 { -q } else { q };
            turns.extend([q.i as f32, q.j as f32, q.k as f32, q.w as f32]);
            before = q;
        }
        add(node, "rotation", writer.floats(&turns, "VEC4", 4, None, false));
    }
    json!({"name": clip.name, "samplers": samplers, "channels": channels})
}

fn container(json: &str, mut binary: Vec<u8>) -> Vec<u8> {
    let mut text = json.as_bytes().to_vec();
    while !text.len().is_multiple_of(4) {
        text.push(b' ');
    }
    while !binary.len().is_multiple_of(4) {
        binary.push(0);
    }
    let total = 12 + 8 + text.len() + 8 + binary.len();
    let mut bytes = b"glTF".to_vec();
    for number in [2, total as u32, text.len() as u32] {
        bytes.extend(number.to_le_bytes());
    }
    bytes.extend(b"JSON");
    bytes.extend(text);
    bytes.extend((binary.len() as u32).to_le_bytes());
    bytes.extend(b"BIN\0");
    bytes.extend(binary);
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synthetic::{Gait, horse};

    #[test]
    fn another_reader_finds_the_horse_and_its_clip() {
        let model = horse();
        let poses: Vec<Pose> =
            (0..5).map(|i| Gait::Walk.pose(&model.skeleton, f64::from(i) / 5.0).pose).collect();
        let bytes = to_glb(&model, &[NamedClip { name: "Walk", fps: 5.0, poses: &poses }], "horse");
        let file = gltf::Gltf::from_slice(&bytes).unwrap();
        let blob = file.blob.clone().unwrap();
        assert_eq!(file.nodes().count(), 37);
        let animation = file.animations().next().unwrap();
        assert_eq!(animation.name(), Some("Walk"));
        let channel =
            animation.channels().find(|c| c.target().node().name() == Some("carpus_left")).unwrap();
        let reader = channel.reader(|_| Some(&blob));
        let Some(gltf::animation::util::ReadOutputs::Rotations(turns)) = reader.read_outputs()
        else {
            panic!("rotations expected")
        };
        for (turn, pose) in turns.into_f32().zip(&poses) {
            let [x, y, z, w] = turn.map(f64::from);
            let read =
                nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, x, y, z));
            let carpus = model.skeleton.nodes.iter().position(|n| n.name == "carpus_left").unwrap();
            assert!(read.angle_to(&pose.nodes[carpus].rotation) < 1e-3);
        }
    }
}
