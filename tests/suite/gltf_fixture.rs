//! Small glTF files, made in memory, with every feature that the rig reader has to know.

#![allow(clippy::print_stderr, reason = "a skipped test says so")]

use std::path::PathBuf;

use serde_json::{Value, json};

/// A glTF document and the data of its first buffer.
pub(crate) struct Fixture {
    pub(crate) json: Value,
    pub(crate) bin: Vec<u8>,
}

impl Fixture {
    /// A document with an asset and nothing else.
    pub(crate) fn empty() -> Self {
        Self { json: json!({ "asset": { "version": "2.0" } }), bin: Vec::new() }
    }

    /// A skinned strip of two bones under an armature of scale 2, with the clips `Rig|Bend`
    /// (rotation of the tip, linear), `Rig|Hop` (translation of the hip, step; scale of the tip,
    /// cubic spline) and the one-frame pose `Up`.
    pub(crate) fn two_bones() -> Self {
        let mut f = Self::empty();
        f.json["extensionsUsed"] = json!(["KHR_animation_pointer"]);
        f.json["scene"] = json!(0);
        f.json["scenes"] = json!([{ "nodes": [2, 3] }]);
        f.json["nodes"] = json!([
            { "name": "tip", "translation": [0, 1, 0] },
            { "name": "hip", "children": [0], "rotation": [0, 0, 0, 1] },
            { "name": "Rig", "children": [1], "scale": [2, 2, 2], "extras": { "keep": 1e3 } },
            { "name": "Skin", "mesh": 0, "skin": 0 },
        ]);
        let p = f.floats("VEC3", &[-0.5, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0, 3.0, 0.0]);
        let j = f.bytes("VEC4", &[0, 1, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0], false);
        let w = f.bytes("VEC4", &[255, 0, 0, 0, 255, 0, 0, 0, 255, 0, 0, 0], true);
        let ibm: Vec<f32> = [0.0, -1.0]
            .iter()
            .flat_map(|y| [0.5, 0., 0., 0., 0., 0.5, 0., 0., 0., 0., 0.5, 0., 0., *y, 0., 1.])
            .collect();
        let ibm = f.floats("MAT4", &ibm);
        f.json["skins"] = json!([{ "joints": [1, 0], "inverseBindMatrices": ibm }]);
        f.json["meshes"] = json!([{ "primitives": [
            { "attributes": { "POSITION": p, "JOINTS_0": j, "WEIGHTS_0": w } },
            { "attributes": { "POSITION": p }, "mode": 1 },
        ] }]);
        let h = std::f32::consts::FRAC_1_SQRT_2;
        let times = f.floats("SCALAR", &[0.0, 1.0]);
        let bend = f.floats("VEC4", &[0., 0., 0., 1., 0., 0., -h, -h]);
        let hop = f.floats("VEC3", &[0., 0., 0., 0., 3., 0.]);
        let swell = f.floats(
            "VEC3",
            &[0., 0., 0., 1., 1., 1., 2., 0., 0., 1., 0., 0., 3., 1., 1., 0., 0., 0.],
        );
        let zero = f.floats("SCALAR", &[0.0]);
        let up = f.floats("VEC3", &[0.0, 5.0, 0.0]);
        f.json["animations"] = json!([
            { "name": "Rig|Bend",
              "samplers": [{ "input": times, "output": bend }],
              "channels": [{ "sampler": 0, "target": { "node": 0, "path": "rotation" } }] },
            { "name": "Rig|Hop",
              "samplers": [
                  { "input": times, "output": hop, "interpolation": "STEP" },
                  { "input": times, "output": swell, "interpolation": "CUBICSPLINE" }],
              "channels": [
                  { "sampler": 0, "target": { "node": 1, "path": "translation" } },
                  { "sampler": 1, "target": { "node": 0, "path": "scale" } },
                  { "sampler": 1, "target": { "path": "pointer",
                    "extensions": { "KHR_animation_pointer": { "pointer": "/nodes/2/scale" } } } }] },
            { "name": "Up",
              "samplers": [{ "input": zero, "output": up }],
              "channels": [{ "sampler": 0, "target": { "node": 1, "path": "translation" } }] },
        ]);
        f
    }

    /// Appends data as an accessor and returns its index.
    pub(crate) fn floats(&mut self, kind: &str, values: &[f32]) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|x| x.to_le_bytes()).collect();
        let accessor = json!({ "componentType": 5126, "type": kind });
        let index = self.push(&bytes, accessor, values.len() / width(kind));
        if kind != "MAT4" && kind != "VEC4" {
            let column = |i: usize| values.iter().skip(i).step_by(width(kind)).copied();
            let bound = |f: fn(f32, f32) -> f32| -> Vec<f32> {
                (0..width(kind)).map(|i| column(i).reduce(f).unwrap()).collect()
            };
            self.json["accessors"][index]["min"] = json!(bound(f32::min));
            self.json["accessors"][index]["max"] = json!(bound(f32::max));
        }
        index
    }

    pub(crate) fn bytes(&mut self, kind: &str, values: &[u8], normalized: bool) -> usize {
        let accessor = json!({ "componentType": 5121, "type": kind, "normalized": normalized });
        self.push(values, accessor, values.len() / width(kind))
    }

    pub(crate) fn push(&mut self, bytes: &[u8], mut accessor: Value, count: usize) -> usize {
        let view = self.view(bytes);
        accessor["bufferView"] = json!(view);
        accessor["count"] = json!(count);
        self.add("accessors", accessor)
    }

    /// Appends bytes as a buffer view and returns its index.
    pub(crate) fn view(&mut self, bytes: &[u8]) -> usize {
        let offset = self.bin.len();
        self.bin.extend_from_slice(bytes);
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        self.add(
            "bufferViews",
            json!({ "buffer": 0, "byteOffset": offset, "byteLength": bytes.len() }),
        )
    }

    pub(crate) fn add(&mut self, list: &str, element: Value) -> usize {
        let list = self.json.as_object_mut().unwrap().entry(list).or_insert(json!([]));
        let list = list.as_array_mut().unwrap();
        list.push(element);
        list.len() - 1
    }

    /// The file as GLB, with the data as its binary chunk.
    pub(crate) fn glb(&self) -> Vec<u8> {
        let mut json = self.json.clone();
        if !self.bin.is_empty() {
            json["buffers"] = json!([{ "byteLength": self.bin.len() }]);
        }
        glb(json.to_string().as_bytes(), (!self.bin.is_empty()).then_some(&self.bin))
    }

    /// The file as pretty-printed text, its buffer at a URI.
    pub(crate) fn text(&self, uri: &str) -> Vec<u8> {
        let mut json = self.json.clone();
        json["buffers"] = json!([{ "byteLength": self.bin.len(), "uri": uri }]);
        serde_json::to_string_pretty(&json).unwrap().into_bytes()
    }

    /// The data as percent-escaped data URI.
    pub(crate) fn data_uri(&self) -> String {
        let escaped: String = self.bin.iter().map(|b| format!("%{b:02X}")).collect();
        format!("data:application/octet-stream,{escaped}")
    }
}

fn width(kind: &str) -> usize {
    match kind {
        "SCALAR" => 1,
        "VEC3" => 3,
        "VEC4" => 4,
        "MAT4" => 16,
        other => panic!("no such type here: {other}"),
    }
}

/// A GLB file of a JSON text and a binary chunk.
pub(crate) fn glb(json: &[u8], bin: Option<&Vec<u8>>) -> Vec<u8> {
    let mut json = json.to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut chunks = Vec::new();
    chunks.extend((json.len() as u32).to_le_bytes());
    chunks.extend(b"JSON");
    chunks.extend(json);
    if let Some(bin) = bin {
        let mut bin = bin.clone();
        bin.resize(bin.len().next_multiple_of(4), 0);
        chunks.extend((bin.len() as u32).to_le_bytes());
        chunks.extend(b"BIN\0");
        chunks.extend(bin);
    }
    let mut out = b"glTF\x02\0\0\0".to_vec();
    out.extend((chunks.len() as u32 + 12).to_le_bytes());
    out.extend(chunks);
    out
}

/// The real rigs, or nothing (with a message) where the data is absent.
pub(crate) fn real_rigs() -> Vec<PathBuf> {
    let data = std::env::var_os("MUYBRIDGE_DATA").map_or_else(
        || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/data"),
        PathBuf::from,
    );
    let Ok(folder) = std::fs::read_dir(data.join("rigs")) else {
        eprintln!("skipped: no rigs in {} (set MUYBRIDGE_DATA)", data.display());
        return Vec::new();
    };
    let mut rigs: Vec<PathBuf> = folder.map(|e| e.unwrap().path()).collect();
    rigs.retain(|p| p.extension().is_some_and(|e| e == "glb"));
    rigs.sort();
    rigs
}
