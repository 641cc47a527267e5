//! The GLB container (glTF 2.0 §4.4): a 12-byte header, then chunks of length, type and data,
//! all little-endian and aligned to 4 bytes.

use std::ops::Range;

const MAGIC: &[u8] = b"glTF";
const JSON: u32 = 0x4E4F_534A;
const BIN: u32 = 0x004E_4942;
const HEADER: usize = 12;
const CHUNK_HEADER: usize = 8;

/// Where the parts of a rig file are in its bytes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Container {
    /// A `.gltf` text file: all of it is JSON.
    Text,
    /// A `.glb` file.
    Binary {
        /// The data of the JSON chunk, padding included.
        json: Range<usize>,
        /// The data of the BIN chunk, padding included.
        bin: Option<Range<usize>>,
        /// Everything after the JSON and BIN chunks: chunks of unknown types, headers included.
        rest: Range<usize>,
    },
}

/// Finds the parts of a file. The error is a place and a reason.
pub(super) fn split(bytes: &[u8]) -> Result<Container, (&'static str, String)> {
    if !bytes.starts_with(MAGIC) {
        return Ok(Container::Text);
    }
    let header = "GLB header";
    let version = word(bytes, 4).ok_or((header, "the file is truncated".to_owned()))?;
    if version != 2 {
        return Err((header, format!("version {version} of the container, where 2 is read")));
    }
    let length = word(bytes, 8).ok_or((header, "the file is truncated".to_owned()))? as usize;
    if length > bytes.len() || length < HEADER {
        let reason =
            format!("it states {length} bytes and the file has {}: is it truncated?", bytes.len());
        return Err((header, reason));
    }
    let bytes = &bytes[..length];
    let (kind, json) = chunk(bytes, HEADER).ok_or(("JSON chunk", truncated()))?;
    if kind != JSON {
        return Err(("JSON chunk", "the first chunk is not JSON".to_owned()));
    }
    let mut end = json.end;
    let mut bin = None;
    if end < length {
        let (kind, data) = chunk(bytes, end).ok_or(("second chunk", truncated()))?;
        if kind == BIN {
            end = data.end;
            bin = Some(data);
        }
    }
    Ok(Container::Binary { json, bin, rest: end..length })
}

fn truncated() -> String {
    "it reaches past the end of the file: is the file truncated?".to_owned()
}

fn word(bytes: &[u8], at: usize) -> Option<u32> {
    let word = bytes.get(at..at.checked_add(4)?)?;
    Some(u32::from_le_bytes(word.try_into().ok()?))
}

/// Type and data range of the chunk whose header is at `at`.
fn chunk(bytes: &[u8], at: usize) -> Option<(u32, Range<usize>)> {
    let length = word(bytes, at)? as usize;
    let kind = word(bytes, at + 4)?;
    let start = at + CHUNK_HEADER;
    let end = start.checked_add(length)?;
    (end <= bytes.len()).then_some((kind, start..end))
}

/// Puts a GLB file together. JSON is padded with spaces and the binary chunk with zeros to
/// multiples of 4; `rest` follows as it is. The error is the size that does not fit the format.
pub(crate) fn assemble(json: &[u8], bin: Option<&[u8]>, rest: &[u8]) -> Result<Vec<u8>, u64> {
    let padded = |n: usize| n.next_multiple_of(4);
    let length = HEADER
        + CHUNK_HEADER
        + padded(json.len())
        + bin.map_or(0, |b| CHUNK_HEADER + padded(b.len()))
        + rest.len();
    let stated = u32::try_from(length).map_err(|_| length as u64)?;
    let mut out = Vec::with_capacity(length);
    out.extend_from_slice(MAGIC);
    out.extend_from_slice(&2_u32.to_le_bytes());
    out.extend_from_slice(&stated.to_le_bytes());
    let mut push = |data: &[u8], kind: u32, filler: u8| {
        // Each part is shorter than the whole, which fits.
        out.extend_from_slice(&(padded(data.len()) as u32).to_le_bytes());
        out.extend_from_slice(&kind.to_le_bytes());
        out.extend_from_slice(data);
        out.resize(out.len().next_multiple_of(4), filler);
    };
    push(json, JSON, b' ');
    if let Some(bin) = bin {
        push(bin, BIN, 0);
    }
    out.extend_from_slice(rest);
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_put_together_comes_apart() {
        let rest = [4, 0, 0, 0, b'X', b'Y', b'Z', b' ', 1, 2, 3, 4];
        let glb = assemble(b"{\"a\":1}", Some(&[1, 2, 3, 4, 5]), &rest).unwrap();
        let Container::Binary { json, bin, rest: tail } = split(&glb).unwrap() else {
            panic!("not a GLB");
        };
        assert_eq!(&glb[json], b"{\"a\":1} ");
        assert_eq!(&glb[bin.unwrap()], [1, 2, 3, 4, 5, 0, 0, 0]);
        assert_eq!(&glb[tail], rest);
    }

    #[test]
    fn every_truncation_is_an_error_and_never_a_panic() {
        let glb = assemble(b"{\"asset\":{}}", Some(&[1; 12]), &[]).unwrap();
        for n in 4..glb.len() {
            assert!(split(&glb[..n]).is_err(), "{n} bytes");
        }
    }

    #[test]
    fn other_magic_is_text_and_other_versions_are_refused() {
        assert_eq!(split(b"{}").unwrap(), Container::Text);
        let mut glb = assemble(b"{}  ", None, &[]).unwrap();
        glb[4] = 1;
        assert!(split(&glb).unwrap_err().1.contains("version 1"));
    }
}
