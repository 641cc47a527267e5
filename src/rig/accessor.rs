//! glTF accessors (glTF 2.0 §3.6.2): typed elements in a buffer, strided, normalised or sparse.

use serde_json::Value;

use super::file::File;
use crate::error::{Error, Result};

/// Elements an accessor without data of its own (all zeros) may have; a larger count is a
/// corrupted file, not a rig, and must not be allocated.
const MOST_ZEROS: usize = 1 << 26;

#[derive(Clone, Copy)]
enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn from_code(code: usize) -> Option<Self> {
        Some(match code {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => return None,
        })
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    /// The value of the component in the first bytes of a slice that is long enough; normalised
    /// integers by the equations of glTF 2.0 §3.6.2.2.
    fn read(self, b: &[u8], normalized: bool) -> f64 {
        let (value, full) = match self {
            Self::I8 => (f64::from(b[0] as i8), 127.0),
            Self::U8 => (f64::from(b[0]), 255.0),
            Self::I16 => (f64::from(i16::from_le_bytes([b[0], b[1]])), 32767.0),
            Self::U16 => (f64::from(u16::from_le_bytes([b[0], b[1]])), 65535.0),
            Self::U32 => {
                (f64::from(u32::from_le_bytes([b[0], b[1], b[2], b[3]])), f64::from(u32::MAX))
            }
            Self::F32 => return f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]])),
        };
        if normalized { (value / full).max(-1.0) } else { value }
    }
}

/// How the elements of an accessor lie in memory.
#[derive(Clone, Copy)]
struct Layout {
    component: Component,
    normalized: bool,
    /// Rows of one column: 1 to 4.
    rows: usize,
    columns: usize,
}

impl Layout {
    /// Bytes from one column to the next: columns of matrices begin on multiples of 4.
    fn column_bytes(&self) -> usize {
        let packed = self.rows * self.component.size();
        if self.columns > 1 { packed.next_multiple_of(4) } else { packed }
    }

    fn element_bytes(&self) -> usize {
        self.column_bytes() * self.columns
    }

    fn read<const N: usize>(&self, bytes: &[u8]) -> [f64; N] {
        std::array::from_fn(|i| {
            let at = i / self.rows * self.column_bytes() + i % self.rows * self.component.size();
            self.component.read(&bytes[at..], self.normalized)
        })
    }
}

fn shape(kind: &str) -> Option<(usize, usize)> {
    Some(match kind {
        "SCALAR" => (1, 1),
        "VEC2" => (2, 1),
        "VEC3" => (3, 1),
        "VEC4" => (4, 1),
        "MAT2" => (2, 2),
        "MAT3" => (3, 3),
        "MAT4" => (4, 4),
        _ => return None,
    })
}

impl File {
    /// The elements of an accessor with N components each (matrices column by column). Integers
    /// become floats, normalised ones in [−1, 1]; sparse elements are put in place.
    pub(super) fn accessor<const N: usize>(&self, index: usize) -> Result<Vec<[f64; N]>> {
        let place = format!("accessor {index}");
        let accessor = self
            .list("accessors")?
            .get(index)
            .ok_or_else(|| self.fault(&place, "it does not exist"))?;
        let layout = self.layout(accessor, &place)?;
        if layout.rows * layout.columns != N {
            let reason = format!(
                "{} components an element, where {N} are needed",
                layout.rows * layout.columns
            );
            return Err(self.fault(place, reason));
        }
        let count = self.required(accessor, "count", &place)?;
        let mut elements = match self.index(accessor, "bufferView", &place)? {
            Some(view) => {
                let offset = self.index(accessor, "byteOffset", &place)?.unwrap_or(0);
                self.elements(view, offset, count, &layout, &place)?
            }
            None if count <= MOST_ZEROS => vec![[0.0; N]; count],
            None => return Err(self.fault(place, format!("{count} elements without data"))),
        };
        if let Some(sparse) = accessor.get("sparse") {
            self.put_sparse(sparse, &layout, &place, &mut elements)?;
        }
        if let Some(i) = elements.iter().position(|e| e.iter().any(|x| !x.is_finite())) {
            return Err(self.fault(place, format!("element {i} is not a finite number")));
        }
        Ok(elements)
    }

    /// The elements of a scalar accessor that holds indices.
    pub(super) fn index_accessor<const N: usize>(&self, index: usize) -> Result<Vec<[usize; N]>> {
        let elements = self.accessor::<N>(index)?;
        let whole = |x: &f64| x.fract() == 0.0 && *x >= 0.0;
        match elements.iter().position(|e| !e.iter().all(whole)) {
            Some(i) => {
                Err(self.fault(format!("accessor {index}"), format!("element {i} is no index")))
            }
            None => Ok(elements.iter().map(|e| e.map(|x| x as usize)).collect()),
        }
    }

    fn layout(&self, accessor: &Value, place: &str) -> Result<Layout> {
        let kind = accessor.get("type").and_then(Value::as_str).unwrap_or("");
        let (rows, columns) = shape(kind)
            .ok_or_else(|| self.fault(place, format!("\"{kind}\" is not a type of elements")))?;
        let component = self.component(accessor, place)?;
        let normalized = accessor.get("normalized").and_then(Value::as_bool).unwrap_or(false);
        Ok(Layout { component, normalized, rows, columns })
    }

    fn component(&self, of: &Value, place: &str) -> Result<Component> {
        let code = self.required(of, "componentType", place)?;
        Component::from_code(code)
            .ok_or_else(|| self.fault(place, format!("{code} is not a component type")))
    }

    fn elements<const N: usize>(
        &self,
        view: usize,
        offset: usize,
        count: usize,
        layout: &Layout,
        place: &str,
    ) -> Result<Vec<[f64; N]>> {
        let (data, stride) = self.view(view, place)?;
        let size = layout.element_bytes();
        let stride = stride.unwrap_or(size);
        let end = count
            .checked_sub(1)
            .map_or(Some(0), |last| last.checked_mul(stride)?.checked_add(size))
            .and_then(|n| n.checked_add(offset));
        if stride < size || end.is_none_or(|end| end > data.len()) {
            let reason = format!(
                "{count} elements of {size} bytes from byte {offset} do not fit into bufferView \
                 {view} of {} bytes",
                data.len()
            );
            return Err(self.fault(place, reason));
        }
        Ok((0..count).map(|i| layout.read(&data[offset + i * stride..])).collect())
    }

    /// The bytes of a buffer view and its stride.
    pub(super) fn view(&self, index: usize, user: &str) -> Result<(&[u8], Option<usize>)> {
        let place = format!("bufferView {index}");
        let view = self
            .list("bufferViews")?
            .get(index)
            .ok_or_else(|| self.fault(user, format!("{place} does not exist")))?;
        let compression = ["EXT_meshopt_compression", "KHR_meshopt_compression"];
        if let Some(name) =
            compression.iter().find(|e| view.pointer(&format!("/extensions/{e}")).is_some())
        {
            return Err(Error::RigUnsupported {
                path: self.path().to_owned(),
                what: format!("{place}, compressed with {name},"),
                remedy: "save the rig without meshopt compression",
            });
        }
        let buffer = self.required(view, "buffer", &place)?;
        let offset = self.index(view, "byteOffset", &place)?.unwrap_or(0);
        let length = self.required(view, "byteLength", &place)?;
        let stride = self.index(view, "byteStride", &place)?.filter(|&s| s != 0);
        let data = self
            .buffer(buffer)
            .ok_or_else(|| self.fault(&place, format!("buffer {buffer} has no data")))?;
        offset
            .checked_add(length)
            .and_then(|end| data.get(offset..end))
            .map(|slice| (slice, stride))
            .ok_or_else(|| self.fault(place, format!("it reaches past the end of buffer {buffer}")))
    }

    fn put_sparse<const N: usize>(
        &self,
        sparse: &Value,
        layout: &Layout,
        place: &str,
        elements: &mut [[f64; N]],
    ) -> Result<()> {
        let place = format!("{place}, sparse");
        let count = self.required(sparse, "count", &place)?;
        let part = |name: &str| -> Result<(&Value, usize, usize)> {
            let part = sparse
                .get(name)
                .ok_or_else(|| self.fault(&place, format!("\"{name}\" is missing")))?;
            let view = self.required(part, "bufferView", &place)?;
            Ok((part, view, self.index(part, "byteOffset", &place)?.unwrap_or(0)))
        };
        let (indices, view, offset) = part("indices")?;
        let component = self.component(indices, &place)?;
        let index_layout = Layout { component, normalized: false, rows: 1, columns: 1 };
        let at: Vec<[f64; 1]> = self.elements(view, offset, count, &index_layout, &place)?;
        let (_, view, offset) = part("values")?;
        let values = self.elements::<N>(view, offset, count, layout, &place)?;
        for ([i], value) in at.into_iter().zip(values) {
            *elements
                .get_mut(i as usize)
                .ok_or_else(|| self.fault(&place, format!("element {i} does not exist")))? = value;
        }
        Ok(())
    }
}
