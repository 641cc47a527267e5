//! Reading, hashing and atomically writing the files of a shot.

use std::fs;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use crate::error::{Error, Result};

/// Writes a file under a temporary name beside its target and renames it: a reader sees the old
/// content or the new, never a part.
///
/// # Errors
/// When the folder cannot be made or written to.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<()> {
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    fs::create_dir_all(folder).map_err(Error::io(folder, "create the folder"))?;
    let mut file = tempfile::Builder::new()
        .prefix(".muybridge-")
        .suffix(".partial")
        .tempfile_in(folder)
        .map_err(Error::io(folder, "write in"))?;
    file.write_all(bytes).map_err(Error::io(path, "write"))?;
    set_ordinary_permissions(file.as_file()).map_err(Error::io(path, "set permissions of"))?;
    file.persist(path).map_err(|e| Error::io(path, "put in place")(e.error))?;
    Ok(())
}

/// A temporary file is readable by its owner only; what it becomes is an ordinary file.
#[cfg(unix)]
fn set_ordinary_permissions(file: &fs::File) -> std::io::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    file.set_permissions(fs::Permissions::from_mode(0o644))
}

#[cfg(not(unix))]
fn set_ordinary_permissions(_file: &fs::File) -> std::io::Result<()> {
    Ok(())
}

/// Reads a whole file.
///
/// # Errors
/// [`Error::Io`] naming it.
pub fn read(path: &Path) -> Result<Vec<u8>> {
    fs::read(path).map_err(Error::io(path, "read"))
}

/// BLAKE3 hash of a file's content, hexadecimal; the file is streamed.
///
/// # Errors
/// [`Error::Io`] naming it.
pub fn hash_file(path: &Path) -> Result<String> {
    let mut file = fs::File::open(path).map_err(Error::io(path, "read"))?;
    let mut hasher = blake3::Hasher::new();
    let mut buffer = vec![0_u8; 1 << 16];
    loop {
        let count = file.read(&mut buffer).map_err(Error::io(path, "read"))?;
        if count == 0 {
            return Ok(hasher.finalize().to_hex().to_string());
        }
        hasher.update(&buffer[..count]);
    }
}

/// One hash over the names and contents of several files, in the order given.
///
/// # Errors
/// [`Error::Io`] naming the file that cannot be read.
pub fn hash_files(files: &[PathBuf]) -> Result<String> {
    let hashes: Vec<Result<String>> = files.par_iter().map(|file| hash_file(file)).collect();
    let mut hasher = blake3::Hasher::new();
    for (file, hash) in files.iter().zip(hashes) {
        let name = file.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        hasher.update(name.as_bytes());
        hasher.update(&[0]);
        hasher.update(hash?.as_bytes());
    }
    Ok(hasher.finalize().to_hex().to_string())
}

/// Hash of a value's JSON form: how settings enter a stage's record.
///
/// # Panics
/// Never for the settings of this crate, whose JSON form always exists.
#[must_use]
pub fn hash_value<T: serde::Serialize>(value: &T) -> String {
    // A value without a JSON form would compare equal to nothing, so the stage would run again.
    let text = serde_json::to_vec(value).unwrap_or_default();
    blake3::hash(&text).to_hex().to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_atomic_write_replaces_and_leaves_nothing_beside() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("new/a.txt");
        write_atomically(&path, b"one").unwrap();
        write_atomically(&path, b"two").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"two");
        assert_eq!(fs::read_dir(path.parent().unwrap()).unwrap().count(), 1);
    }

    #[test]
    fn the_hash_of_files_depends_on_names_and_contents() {
        let dir = tempfile::tempdir().unwrap();
        let (a, b) = (dir.path().join("a"), dir.path().join("b"));
        fs::write(&a, "x").unwrap();
        fs::write(&b, "x").unwrap();
        let ab = hash_files(&[a.clone(), b.clone()]).unwrap();
        assert_ne!(ab, hash_files(&[b.clone(), a.clone()]).unwrap());
        fs::write(&b, "y").unwrap();
        assert_ne!(ab, hash_files(&[a, b]).unwrap());
    }
}
