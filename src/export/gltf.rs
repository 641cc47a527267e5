//! One more animation in the artist's glTF file, and not one other byte changed.
//!
//! The JSON is not parsed and written again but spliced ([`super::splice`]): new elements at the
//! end of `accessors`, `bufferViews`, `animations` and, where needed, `buffers`. In a GLB file
//! whose first buffer is the binary chunk the keys follow behind the bytes that are there and that
//! buffer's `byteLength` is the one value that changes. Otherwise they get a buffer of their own
//! as a `data:` URI, so that no file of the artist's is touched and none is added.

use std::path::PathBuf;

use serde_json::{Value, json};

use super::splice::Splice;
use super::tracks::{Track, tracks};
use crate::error::{Error, Result};
use crate::rig::container::{Container, assemble};
use crate::rig::{Clip, File};

const FLOAT: u32 = 5126;

/// The artist's file with one more animation.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AppendedGltf {
    /// The whole file.
    pub bytes: Vec<u8>,
    /// Its extension, as that of the artist's file by content: `glb` or `gltf`.
    pub extension: &'static str,
    /// The name the animation got: the clip's, or with `.001`, `.002`, … when the file has an
    /// animation of that name already.
    pub animation: String,
    /// Paths, relative to the file's folder, of the buffers and images that the file refers to.
    /// When it is written to another folder than the artist's, they must be copied along.
    pub referenced_files: Vec<PathBuf>,
}

/// Appends a clip as an animation to the file whose skeleton it poses.
///
/// Key `i` is at f32(i / fps) seconds, interpolation LINEAR, quaternions of unit length and on one
/// hemisphere from key to key. Only driven channels are written, and of these only the ones that
/// leave the rest value in some frame; one that is constant but not at rest has two keys, at the
/// first and the last frame, so that every channel spans the footage. The node transforms of the
/// file are not touched.
///
/// # Errors
/// [`Error::NothingDriven`] for a clip without driven channels or frames;
/// [`Error::MatrixNodeDriven`]; [`Error::GlbTooLarge`]; [`Error::RigBroken`] for a file whose
/// JSON cannot be spliced.
///
/// # Panics
/// When the clip has not one entry for each node of the file.
pub fn append_animation(file: &File, clip: &Clip) -> Result<AppendedGltf> {
    append_animation_with_extras(file, clip, None)
}

/// The same, with `extras` on the animation: what an application wants to say about it (glTF 2.0 §3.3).
///
/// # Errors
/// As [`append_animation`].
///
/// # Panics
/// As [`append_animation`].
pub fn append_animation_with_extras(
    file: &File,
    clip: &Clip,
    extras: Option<&Value>,
) -> Result<AppendedGltf> {
    let skeleton = file.skeleton();
    assert_eq!(clip.driven.len(), skeleton.nodes.len(), "one entry a node");
    let tracks = tracks(skeleton, clip);
    if tracks.is_empty() {
        return Err(Error::NothingDriven { name: clip.name.clone() });
    }
    if let Some(track) = tracks.iter().find(|t| file.has_matrix(t.node)) {
        let node = skeleton.nodes[track.node].name.clone();
        return Err(Error::MatrixNodeDriven { path: file.path().to_owned(), node });
    }
    let animation = free_name(&file.animation_names(), &clip.name);
    let data = Keys::new(&tracks, clip);
    let bytes = write(file, (&animation, extras), &tracks, &data)?;
    let extension = if file.is_glb() { "glb" } else { "gltf" };
    Ok(AppendedGltf { bytes, extension, animation, referenced_files: file.referenced_files() })
}

/// The wished name, or with the first free number behind it in the manner of Blender.
fn free_name(taken: &[String], wished: &str) -> String {
    let free = |name: &String| !taken.contains(name);
    std::iter::once(wished.to_owned())
        .chain((1..).map(|i| format!("{wished}.{i:03}")))
        .find(free)
        .unwrap_or_default()
}

/// The binary data of the animation and the accessors that describe it.
struct Keys {
    bytes: Vec<u8>,
    /// Accessors without `bufferView`, which is not known yet; the order of [`Keys::inputs`].
    accessors: Vec<Value>,
    /// For each track the numbers of its input and output accessor among the new ones.
    inputs: Vec<(usize, usize)>,
}

impl Keys {
    fn new(tracks: &[Track], clip: &Clip) -> Self {
        let mut keys = Self { bytes: Vec::new(), accessors: Vec::new(), inputs: Vec::new() };
        let time = |frame: usize| (frame as f64 / clip.fps) as f32;
        let last = clip.poses.len() - 1;
        let all: Vec<f32> = (0..=last).map(time).collect();
        let ends: Vec<f32> = if last == 0 { vec![0.0] } else { vec![0.0, time(last)] };
        let mut whole = None;
        let mut constant = None;
        for track in tracks {
            let input = if track.keys.len() == 1 {
                *constant.get_or_insert_with(|| keys.push_times(&ends))
            } else {
                *whole.get_or_insert_with(|| keys.push_times(&all))
            };
            let repeats = if track.keys.len() == 1 { ends.len() } else { 1 };
            let values = vec![track.keys.concat(); repeats].concat();
            let kind = if track.property.width() == 4 { "VEC4" } else { "VEC3" };
            let output = keys.push(&values, track.property.width(), kind);
            keys.inputs.push((input, output));
        }
        keys
    }

    fn push_times(&mut self, times: &[f32]) -> usize {
        let index = self.push(times, 1, "SCALAR");
        // An f64 spells an f32 exactly, however the reader rounds.
        let bounds = |x: f32| json!([f64::from(x)]);
        self.accessors[index]["min"] = bounds(times[0]);
        self.accessors[index]["max"] = bounds(times[times.len() - 1]);
        index
    }

    fn push(&mut self, values: &[f32], width: usize, kind: &str) -> usize {
        self.accessors.push(json!({
            "byteOffset": self.bytes.len(),
            "componentType": FLOAT,
            "count": values.len() / width,
            "type": kind,
        }));
        self.bytes.extend(values.iter().flat_map(|x| x.to_le_bytes()));
        self.accessors.len() - 1
    }
}

fn write(
    file: &File,
    named: (&str, Option<&Value>),
    tracks: &[Track],
    keys: &Keys,
) -> Result<Vec<u8>> {
    let length =
        |member: &str| file.document().get(member).and_then(Value::as_array).map_or(0, Vec::len);
    let mut splice = Splice::new(file.json());
    let bin = place_data(file, keys, &mut splice);
    let view = json!({
        "buffer": bin.buffer,
        "byteOffset": bin.offset,
        "byteLength": keys.bytes.len(),
    });
    let first = length("accessors");
    let accessors: Vec<String> = (keys.accessors.iter())
        .map(|accessor| {
            let mut accessor = accessor.clone();
            accessor["bufferView"] = json!(length("bufferViews"));
            accessor.to_string()
        })
        .collect();
    splice.append("accessors", &accessors);
    splice.append("bufferViews", &[view.to_string()]);
    splice.append("animations", &[animation(named, tracks, keys, first).to_string()]);
    let json = splice.finish();
    check(file, &json, &bin)?;
    match file.container() {
        Container::Text => Ok(json),
        Container::Binary { rest, .. } => {
            assemble(&json, bin.chunk.as_deref(), &file.bytes()[rest.clone()])
                .map_err(|bytes| Error::GlbTooLarge { path: file.path().to_owned(), bytes })
        }
    }
}

/// Where the keys went.
struct Placed {
    /// Index of the buffer.
    buffer: usize,
    /// First byte in the buffer.
    offset: usize,
    /// The binary chunk of the new file.
    chunk: Option<Vec<u8>>,
}

fn place_data(file: &File, keys: &Keys, splice: &mut Splice<'_>) -> Placed {
    let chunk = match file.container() {
        Container::Binary { bin, .. } => bin.clone().map(|range| file.bytes()[range].to_vec()),
        Container::Text => None,
    };
    let buffers = file.document().get("buffers").and_then(Value::as_array);
    let buffers = buffers.map_or(&[][..], Vec::as_slice);
    // The binary chunk is the first buffer when that has no URI (glTF 2.0 §3.6.1.2).
    let first_is_chunk = buffers.first().is_some_and(|b| b.get("uri").is_none()) && chunk.is_some();
    let none_yet = buffers.is_empty() && file.is_glb();
    if !first_is_chunk && !none_yet {
        let uri = format!("data:application/octet-stream;base64,{}", base64(&keys.bytes));
        let buffer = json!({ "byteLength": keys.bytes.len(), "uri": uri });
        splice.append("buffers", &[buffer.to_string()]);
        return Placed { buffer: buffers.len(), offset: 0, chunk };
    }
    let mut chunk = chunk.unwrap_or_default();
    chunk.resize(chunk.len().next_multiple_of(4), 0);
    let offset = chunk.len();
    chunk.extend_from_slice(&keys.bytes);
    if first_is_chunk {
        splice.replace("buffers", 0, "byteLength", &chunk.len().to_string());
    } else {
        splice.append("buffers", &[json!({ "byteLength": chunk.len() }).to_string()]);
    }
    Placed { buffer: 0, offset, chunk: Some(chunk) }
}

fn animation(
    (name, extras): (&str, Option<&Value>),
    tracks: &[Track],
    keys: &Keys,
    first: usize,
) -> Value {
    let samplers: Vec<Value> = (keys.inputs.iter())
        .map(|(input, output)| {
            json!({ "input": first + input, "interpolation": "LINEAR", "output": first + output })
        })
        .collect();
    let channels: Vec<Value> = (tracks.iter().enumerate())
        .map(|(i, track)| {
            json!({
                "sampler": i,
                "target": { "node": track.node, "path": track.property.name() },
            })
        })
        .collect();
    let mut made = json!({ "name": name, "samplers": samplers, "channels": channels });
    if let Some(extras) = extras {
        made["extras"] = extras.clone();
    }
    made
}

/// Guards the artist's file against a fault of the splicing: without what was added, the new
/// document must be the old one.
fn check(file: &File, json: &[u8], bin: &Placed) -> Result<()> {
    let text = json.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(json);
    let old = file.document();
    let mut new: Value = serde_json::from_slice(text).unwrap_or_default();
    if let Some(members) = new.as_object_mut() {
        for name in ["accessors", "bufferViews", "animations", "buffers"] {
            match (old.get(name).and_then(Value::as_array), members.get_mut(name)) {
                (Some(before), Some(Value::Array(after))) => after.truncate(before.len()),
                _ => drop(members.remove(name)),
            }
        }
    }
    let length = format!("/buffers/{}/byteLength", bin.buffer);
    if let (Some(before), Some(after)) = (old.pointer(&length), new.pointer_mut(&length)) {
        after.clone_from(before);
    }
    if new == *old {
        return Ok(());
    }
    Err(Error::RigBroken {
        path: file.path().to_owned(),
        place: "JSON".to_owned(),
        reason: "an animation cannot be added to it".to_owned(),
    })
}

/// RFC 4648 §4, with padding.
fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut out = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for group in bytes.chunks(3) {
        let word =
            group.iter().fold(0_u32, |w, &b| w << 8 | u32::from(b)) << (8 * (3 - group.len()));
        for i in 0..4 {
            let digit = DIGITS[(word >> (18 - 6 * i)) as usize & 63];
            out.push(if i <= group.len() { char::from(digit) } else { '=' });
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_vectors_of_rfc_4648() {
        for (bytes, text) in
            [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foobar", "Zm9vYmFy")]
        {
            assert_eq!(base64(bytes.as_bytes()), text);
        }
    }

    #[test]
    fn a_taken_name_gets_a_number() {
        let taken = ["run".to_owned(), "run.001".to_owned()];
        assert_eq!(free_name(&taken, "walk"), "walk");
        assert_eq!(free_name(&taken, "run"), "run.002");
    }
}
