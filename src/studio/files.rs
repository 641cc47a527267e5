//! Reading, replacing and deleting files of a shot. Every change names the version it is based on,
//! so that two tabs, or a tab and a paint program, do not overwrite each other.

use std::path::Path;

use axum::http::header::IF_MATCH;
use axum::http::{HeaderMap, StatusCode};
use axum::response::Response;

use super::desk::Desk;
use super::names::{self, Kind};
use super::refusal::{Refusal, Result};
use super::root::Root;
use super::{answer, pictures, versions};
use crate::error::Error;
use crate::shot::{self, Shot, StoredKeys, WeightTable, write_atomically};

/// One file.
pub(super) fn get(
    root: &Root,
    desk: &Desk,
    name: &str,
    download: bool,
    asked: &HeaderMap,
) -> Result<Response> {
    let shot = desk.shot()?;
    let path = names::path_of(root, &shot, name)?;
    let version = desk.versions.of(&path)?;
    if version.is_empty() {
        return Err(Refusal::not_found(format!("{name}: there is no such file yet")));
    }
    let mut response = answer::file(name, &version, asked, || Ok(shot::read(&path)?))?;
    if download {
        answer::as_download(&mut response, name);
    }
    Ok(response)
}

/// Replaces a file; the new version.
pub(super) fn put(
    root: &Root,
    desk: &Desk,
    name: &str,
    asked: &HeaderMap,
    body: &[u8],
    size: impl FnOnce(&Shot) -> Result<(usize, usize)>,
) -> Result<String> {
    let based_on = based_on(asked)?;
    let shot = desk.shot()?;
    let path = names::path_of(root, &shot, name)?;
    let bytes = match Kind::of(name) {
        Kind::Mask(_) => pictures::mask(body, size(&shot)?)?,
        Kind::Stroke(_) => pictures::strokes(body, size(&shot)?)?,
        Kind::Keys => keys(&shot, &path, body)?,
        Kind::Weights => weights(&shot, &path, body)?,
        Kind::ReadOnly => return Err(read_only(name)),
    };
    let writing = desk.write()?;
    unchanged(&path, &based_on)?;
    write_atomically(&path, &bytes)?;
    let version = versions::now(&path)?;
    drop(writing);
    desk.tell_changes(root);
    Ok(version)
}

/// Deletes strokes, or a mask, which `segment` then makes again.
pub(super) fn delete(root: &Root, desk: &Desk, name: &str, asked: &HeaderMap) -> Result<()> {
    let based_on = based_on(asked)?;
    let shot = desk.shot()?;
    let path = names::path_of(root, &shot, name)?;
    if !matches!(Kind::of(name), Kind::Mask(_) | Kind::Stroke(_)) {
        return Err(read_only(name));
    }
    let writing = desk.write()?;
    unchanged(&path, &based_on)?;
    if path.is_file() {
        std::fs::remove_file(&path).map_err(Error::io(&path, "delete"))?;
    }
    drop(writing);
    desk.tell_changes(root);
    Ok(())
}

fn unchanged(path: &Path, based_on: &str) -> Result<()> {
    let now = versions::now(path)?;
    if now == based_on { Ok(()) } else { Err(Refusal::changed(now)) }
}

fn based_on(asked: &HeaderMap) -> Result<String> {
    let given = asked.get(IF_MATCH).and_then(|v| v.to_str().ok()).ok_or_else(|| {
        let sentence = "a change must say which version it is based on, in the header If-Match";
        Refusal::new(StatusCode::PRECONDITION_REQUIRED, sentence)
    })?;
    Ok(given.trim().trim_matches('"').to_owned())
}

fn read_only(name: &str) -> Refusal {
    let refusal = Refusal::forbidden(format!("{name} cannot be changed here"));
    let hint = "its stage makes it; settings are changed by themselves".to_owned();
    Refusal { hint: Some(hint), ..refusal }
}

/// Keys as the pipeline reads them, in the form it writes them.
fn keys(shot: &Shot, path: &Path, body: &[u8]) -> Result<Vec<u8>> {
    is_json(body)?;
    let frames = shot.projections()?.used.len();
    let keys = StoredKeys::from_json(path, body, frames)?;
    let mut text = serde_json::to_vec_pretty(&keys).map_err(|_| Refusal::defect())?;
    text.push(b'\n');
    Ok(text)
}

fn is_json(body: &[u8]) -> Result<()> {
    let parsed = serde_json::from_slice::<serde::de::IgnoredAny>(body);
    parsed.map(|_| ()).map_err(|e| Refusal::malformed(format!("this is not JSON: {e}")))
}

fn weights(shot: &Shot, path: &Path, body: &[u8]) -> Result<Vec<u8>> {
    let table = WeightTable::from_csv(path, body)?;
    let frames = shot.projections()?.used.len();
    if table.frames() != frames {
        let rows = table.frames();
        return Err(Refusal::unusable(format!("{rows} rows of weights for {frames} frames")));
    }
    Ok(body.to_vec())
}
