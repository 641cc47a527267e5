//! A GLB file under construction: one buffer, tightly packed accessors.

use serde_json::{Value, json};

use crate::rig::container::assemble;

const BYTE: u32 = 5120;
const UNSIGNED_BYTE: u32 = 5121;
const UNSIGNED_SHORT: u32 = 5123;
const UNSIGNED_INT: u32 = 5125;
const FLOAT: u32 = 5126;

/// The binary chunk and what describes it.
#[derive(Default)]
pub(super) struct Glb {
    bin: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Glb {
    /// Stores bytes as a buffer view of their own and gives its index.
    pub(super) fn view(&mut self, bytes: &[u8]) -> usize {
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        let offset = self.bin.len();
        self.bin.extend_from_slice(bytes);
        self.views.push(json!({"buffer": 0, "byteOffset": offset, "byteLength": bytes.len()}));
        self.views.len() - 1
    }

    fn accessor(&mut self, bytes: &[u8], component: u32, kind: &str, count: usize) -> usize {
        let view = self.view(bytes);
        self.accessors.push(json!({
            "bufferView": view, "componentType": component, "count": count, "type": kind,
        }));
        self.accessors.len() - 1
    }

    /// Numbers in single precision; `kind` is the glTF type of N components.
    pub(super) fn floats<const N: usize>(&mut self, kind: &str, values: &[[f64; N]]) -> usize {
        let bytes: Vec<u8> =
            values.iter().flatten().flat_map(|&v| (v as f32).to_le_bytes()).collect();
        self.accessor(&bytes, FLOAT, kind, values.len())
    }

    /// [`Glb::floats`] with the least and the largest value, which glTF demands of some accessors.
    fn bounded<const N: usize>(&mut self, kind: &str, values: &[[f64; N]]) -> usize {
        let index = self.floats(kind, values);
        let bound = |of: fn(f32, f32) -> f32| -> Vec<f32> {
            let column = |c: usize| values.iter().map(move |v| v[c] as f32).reduce(of);
            (0..N).map(|c| column(c).unwrap_or(0.0)).collect()
        };
        self.accessors[index]["min"] = json!(bound(f32::min));
        self.accessors[index]["max"] = json!(bound(f32::max));
        index
    }

    pub(super) fn positions(&mut self, values: &[[f64; 3]]) -> usize {
        self.bounded("VEC3", values)
    }

    pub(super) fn times(&mut self, values: &[[f64; 1]]) -> usize {
        self.bounded("SCALAR", values)
    }

    /// Unit vectors in 8 bits a component, four bytes apart as glTF aligns vertices.
    pub(super) fn normals(&mut self, values: &[[f64; 3]]) -> usize {
        let bytes: Vec<u8> = values
            .iter()
            .flat_map(|n| {
                let byte = |v: f64| ((v.clamp(-1.0, 1.0) * 127.0).round() as i8).to_le_bytes()[0];
                [byte(n[0]), byte(n[1]), byte(n[2]), 0]
            })
            .collect();
        let index = self.accessor(&bytes, BYTE, "VEC3", values.len());
        self.accessors[index]["normalized"] = json!(true);
        self.stride(4);
        index
    }

    /// Four joints a vertex, in one byte each where that is enough.
    pub(super) fn joints(&mut self, values: &[[usize; 4]]) -> usize {
        let all = values.iter().flatten();
        let narrow = all.clone().all(|&j| j < 256);
        let (bytes, component): (Vec<u8>, u32) = if narrow {
            (all.map(|&j| j as u8).collect(), UNSIGNED_BYTE)
        } else {
            (all.flat_map(|&j| (j as u16).to_le_bytes()).collect(), UNSIGNED_SHORT)
        };
        let index = self.accessor(&bytes, component, "VEC4", values.len());
        self.stride(if narrow { 4 } else { 8 });
        index
    }

    /// Four weights a vertex in 16 bits each; the first takes what rounding leaves of the sum 1.
    pub(super) fn weights(&mut self, values: &[[f64; 4]]) -> usize {
        let bytes: Vec<u8> = values
            .iter()
            .flat_map(|w| {
                let mut coded = w.map(|v| (v.clamp(0.0, 1.0) * 65535.0).round() as u16);
                let rest: u32 = coded[1..].iter().map(|&v| u32::from(v)).sum();
                coded[0] = 65535_u32.saturating_sub(rest) as u16;
                coded.into_iter().flat_map(u16::to_le_bytes)
            })
            .collect();
        let index = self.accessor(&bytes, UNSIGNED_SHORT, "VEC4", values.len());
        self.accessors[index]["normalized"] = json!(true);
        self.stride(8);
        index
    }

    /// Corners of triangles, in two bytes each where that is enough for `vertices`.
    pub(super) fn indices(&mut self, corners: &[usize], vertices: usize) -> usize {
        // 65535 itself restarts a primitive.
        if vertices < 65535 {
            let bytes: Vec<u8> = corners.iter().flat_map(|&c| (c as u16).to_le_bytes()).collect();
            self.accessor(&bytes, UNSIGNED_SHORT, "SCALAR", corners.len())
        } else {
            let bytes: Vec<u8> = corners.iter().flat_map(|&c| (c as u32).to_le_bytes()).collect();
            self.accessor(&bytes, UNSIGNED_INT, "SCALAR", corners.len())
        }
    }

    fn stride(&mut self, bytes: usize) {
        if let Some(view) = self.views.last_mut() {
            view["byteStride"] = json!(bytes);
        }
    }

    /// The file; `None` when it would be longer than GLB can say.
    pub(super) fn finish(self, mut document: Value) -> Option<Vec<u8>> {
        document["accessors"] = Value::Array(self.accessors);
        document["bufferViews"] = Value::Array(self.views);
        document["buffers"] = json!([{"byteLength": self.bin.len()}]);
        assemble(document.to_string().as_bytes(), Some(&self.bin), &[]).ok()
    }
}
