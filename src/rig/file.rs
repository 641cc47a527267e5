//! The artist's glTF 2.0 file, as it is: its bytes, its JSON document and its buffers.
//!
//! The document is kept as untyped JSON. A typed reader (the `gltf` crate) refuses valid files
//! that use extensions it does not know, and panics on accessors that reach past their buffer;
//! here an unknown extension is nobody's business and every index is checked.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;

use super::container::{self, Container};
use super::uri::{self, Target};
use super::{Skeleton, nodes};
use crate::error::{Error, Result};

/// A glTF or GLB file with everything it refers to that holds numbers.
#[derive(Clone, Debug)]
pub struct File {
    path: PathBuf,
    bytes: Vec<u8>,
    container: Container,
    document: Value,
    buffers: Vec<Option<Vec<u8>>>,
    skeleton: Skeleton,
}

impl File {
    /// Reads a `.glb` or `.gltf` file (told apart by content, not by name) and its buffers, and
    /// checks its node hierarchy. Meshes and animations are read when asked for.
    ///
    /// # Errors
    /// [`Error::Io`] when the file cannot be read, and those of [`File::from_bytes`].
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = fs::read(path).map_err(Error::io(path, "read"))?;
        Self::from_bytes(path, bytes)
    }

    /// As [`File::read`], for content that is in memory already; `path` is used in messages and to
    /// find external buffers.
    ///
    /// # Errors
    /// [`Error::RigBroken`] for a truncated container, broken JSON, a version other than 2, a
    /// broken URI or a broken hierarchy (cycle, two parents, missing node, zero quaternion);
    /// [`Error::RigBuffer`] for a buffer file that cannot be read.
    pub fn from_bytes(path: &Path, bytes: Vec<u8>) -> Result<Self> {
        let container = container::split(&bytes)
            .map_err(|(place, reason)| broken(path, place.to_owned(), reason))?;
        let document = parse(path, &bytes, &container)?;
        let mut file = Self {
            path: path.to_owned(),
            bytes,
            container,
            document,
            buffers: Vec::new(),
            skeleton: Skeleton { nodes: Vec::new() },
        };
        file.check_version()?;
        file.buffers = file.read_buffers()?;
        file.skeleton = nodes::skeleton(&file)?;
        Ok(file)
    }

    /// Where the file was read from.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The whole file, byte for byte.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// The JSON text as it is in the file, padding or byte-order mark included.
    #[must_use]
    pub fn json(&self) -> &[u8] {
        json_of(&self.bytes, &self.container)
    }

    /// The JSON document, members in the order of the file.
    #[must_use]
    pub fn document(&self) -> &Value {
        &self.document
    }

    /// All nodes with their rest transforms, in the order of the file.
    #[must_use]
    pub fn skeleton(&self) -> &Skeleton {
        &self.skeleton
    }

    /// Whether the file is a GLB container rather than JSON text.
    #[must_use]
    pub fn is_glb(&self) -> bool {
        matches!(self.container, Container::Binary { .. })
    }

    pub(crate) fn container(&self) -> &Container {
        &self.container
    }

    /// Data of a buffer; `None` for one that has neither a URI nor a binary chunk (extensions use
    /// such placeholders) or that does not exist.
    pub(super) fn buffer(&self, index: usize) -> Option<&[u8]> {
        self.buffers.get(index)?.as_deref()
    }

    /// A top-level array of the document; empty when it is absent.
    pub(super) fn list(&self, member: &str) -> Result<&[Value]> {
        match self.document.get(member) {
            None => Ok(&[]),
            Some(Value::Array(list)) => Ok(list),
            Some(_) => Err(self.fault(member, "not an array")),
        }
    }

    /// An [`Error::RigBroken`] of this file.
    pub(super) fn fault(&self, place: impl Into<String>, reason: impl Into<String>) -> Error {
        broken(&self.path, place.into(), reason.into())
    }

    /// A member that holds an index or a count; `None` when it is absent.
    pub(super) fn index(&self, of: &Value, member: &str, place: &str) -> Result<Option<usize>> {
        of.get(member).map(|v| self.as_index(v, member, place)).transpose()
    }

    /// As [`File::index`], for a member that must be there.
    pub(super) fn required(&self, of: &Value, member: &str, place: &str) -> Result<usize> {
        self.index(of, member, place)?
            .ok_or_else(|| self.fault(place, format!("\"{member}\" is missing")))
    }

    /// A member that holds a list of indices; empty when it is absent.
    pub(super) fn indices(&self, of: &Value, member: &str, place: &str) -> Result<Vec<usize>> {
        match of.get(member) {
            None => Ok(Vec::new()),
            Some(Value::Array(list)) => {
                list.iter().map(|v| self.as_index(v, member, place)).collect()
            }
            Some(_) => Err(self.fault(place, format!("\"{member}\" is not an array"))),
        }
    }

    /// A member that holds exactly N numbers; `None` when it is absent.
    pub(super) fn numbers<const N: usize>(
        &self,
        of: &Value,
        member: &str,
        place: &str,
    ) -> Result<Option<[f64; N]>> {
        let Some(value) = of.get(member) else { return Ok(None) };
        let list: Option<Vec<f64>> =
            value.as_array().and_then(|list| list.iter().map(Value::as_f64).collect());
        list.and_then(|l| <[f64; N]>::try_from(l).ok())
            .map(Some)
            .ok_or_else(|| self.fault(place, format!("\"{member}\" is not {N} numbers")))
    }

    fn as_index(&self, value: &Value, member: &str, place: &str) -> Result<usize> {
        value
            .as_u64()
            // Some writers spell whole numbers "3.0", which JSON does not tell from 3.
            .or_else(|| value.as_f64().filter(|f| f.fract() == 0.0 && *f >= 0.0).map(|f| f as u64))
            .and_then(|n| usize::try_from(n).ok())
            .ok_or_else(|| self.fault(place, format!("\"{member}\" is {value}, not an index")))
    }

    fn check_version(&self) -> Result<()> {
        let version = self.document.pointer("/asset/version").and_then(Value::as_str);
        match version {
            Some(v) if v.starts_with("2.") => Ok(()),
            Some(v) => Err(self.fault("asset", format!("glTF version {v}, where 2.x is read"))),
            None => Err(self.fault("asset", "\"version\" is missing: this is not a glTF 2.0 file")),
        }
    }

    fn read_buffers(&self) -> Result<Vec<Option<Vec<u8>>>> {
        let list = self.list("buffers")?;
        list.iter().enumerate().map(|(i, buffer)| self.read_buffer(i, buffer)).collect()
    }

    fn read_buffer(&self, index: usize, buffer: &Value) -> Result<Option<Vec<u8>>> {
        let place = format!("buffer {index}");
        let length = self.required(buffer, "byteLength", &place)?;
        let data = match buffer.get("uri") {
            Some(Value::String(uri)) => self.follow(index, uri, &place)?,
            Some(_) => return Err(self.fault(place, "\"uri\" is not text")),
            None => match &self.container {
                Container::Binary { bin: Some(bin), .. } if index == 0 => {
                    self.bytes[bin.clone()].to_vec()
                }
                _ => return Ok(None),
            },
        };
        if data.len() < length {
            let reason = format!("{length} bytes are stated and there are {}", data.len());
            return Err(self.fault(place, reason));
        }
        Ok(Some(data))
    }

    fn follow(&self, index: usize, uri: &str, place: &str) -> Result<Vec<u8>> {
        match uri::resolve(uri).map_err(|reason| self.fault(place, reason))? {
            Target::Data(data) => Ok(data),
            Target::Relative(relative) => {
                let file = self.path.parent().unwrap_or(Path::new("")).join(relative);
                fs::read(&file).map_err(|source| Error::RigBuffer {
                    path: self.path.clone(),
                    buffer: index,
                    file,
                    source,
                })
            }
        }
    }

    /// Relative paths of the files this one refers to (buffers and images), in the order of the
    /// document, each once. A copy of the file in another folder needs them beside it.
    #[must_use]
    pub fn referenced_files(&self) -> Vec<PathBuf> {
        referenced_by(&self.document)
    }
}

/// As [`File::referenced_files`], of content whose buffers are not read: for looking at a file from
/// a stranger before anything it names is opened.
///
/// # Errors
/// [`Error::RigBroken`] for a truncated container or broken JSON.
pub fn referenced_files(path: &Path, bytes: &[u8]) -> Result<Vec<PathBuf>> {
    let container = container::split(bytes)
        .map_err(|(place, reason)| broken(path, place.to_owned(), reason))?;
    Ok(referenced_by(&parse(path, bytes, &container)?))
}

fn referenced_by(document: &Value) -> Vec<PathBuf> {
    let mut found: Vec<PathBuf> = Vec::new();
    for member in ["buffers", "images"] {
        let list = document.get(member).and_then(Value::as_array);
        for uri in list.into_iter().flatten().filter_map(|v| v.get("uri")?.as_str()) {
            if let Ok(Target::Relative(path)) = uri::resolve(uri)
                && !found.contains(&PathBuf::from(&path))
            {
                found.push(path.into());
            }
        }
    }
    found
}

fn broken(path: &Path, place: String, reason: String) -> Error {
    Error::RigBroken { path: path.to_owned(), place, reason }
}

fn json_of<'a>(bytes: &'a [u8], container: &Container) -> &'a [u8] {
    match container {
        Container::Text => bytes,
        Container::Binary { json, .. } => &bytes[json.clone()],
    }
}

fn parse(path: &Path, bytes: &[u8], container: &Container) -> Result<Value> {
    let text = json_of(bytes, container);
    let text = text.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(text);
    if *container == Container::Text && !text.trim_ascii_start().starts_with(b"{") {
        let reason = "neither a GLB file (no \"glTF\" at its start) nor JSON".to_owned();
        return Err(broken(path, "file".to_owned(), reason));
    }
    let value: Value =
        serde_json::from_slice(text).map_err(|e| broken(path, "JSON".to_owned(), e.to_string()))?;
    if value.is_object() {
        Ok(value)
    } else {
        Err(broken(path, "JSON".to_owned(), "not an object".to_owned()))
    }
}
