//! Answers: JSON, files, and the headers every answer carries.

use axum::body::Body;
use axum::http::header::{
    CACHE_CONTROL, CONTENT_DISPOSITION, CONTENT_SECURITY_POLICY, CONTENT_TYPE, ETAG, HeaderName,
};
use axum::http::{HeaderMap, HeaderValue, StatusCode};
use axum::response::Response;
use serde::Serialize;

/// The page may load what this server sends and nothing else.
const PAGE_POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; \
     connect-src 'self' blob:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// The report brings its own scripts and pictures. It may not speak to this server, not even as the
/// user: the sandbox gives it an origin of its own.
const REPORT_POLICY: &str = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; \
     img-src data: blob:; media-src data: blob:; font-src data:; connect-src data: blob:; base-uri 'none'; \
     form-action 'none'; frame-ancestors 'none'; sandbox allow-scripts allow-downloads";

/// Every other file of a shot is data, also when it is opened by itself.
const FILE_POLICY: &str = "default-src 'none'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; \
     form-action 'none'; frame-ancestors 'none'; sandbox";

/// A JSON answer.
pub(super) fn json<T: Serialize>(status: StatusCode, document: &T) -> Response {
    let body = serde_json::to_vec(document).unwrap_or_else(|_| b"{}".to_vec());
    let mut response = bytes(body, "application/json; charset=utf-8");
    *response.status_mut() = status;
    response
}

/// An answer of bytes.
pub(super) fn bytes(body: Vec<u8>, kind: &'static str) -> Response {
    let mut response = Response::new(Body::from(body));
    response.headers_mut().insert(CONTENT_TYPE, HeaderValue::from_static(kind));
    response
}

/// An answer without content.
pub(super) fn empty(status: StatusCode) -> Response {
    let mut response = Response::new(Body::empty());
    *response.status_mut() = status;
    response
}

/// Sets one header; a value that no header can hold is left out.
pub(super) fn header(response: &mut Response, name: HeaderName, value: &str) {
    if let Ok(value) = HeaderValue::from_str(value) {
        response.headers_mut().insert(name, value);
    }
}

/// A file of a shot with its version as ETag; 304 when the browser has that version already.
pub(super) fn file(
    name: &str,
    version: &str,
    asked: &HeaderMap,
    read: impl FnOnce() -> super::refusal::Result<Vec<u8>>,
) -> super::refusal::Result<Response> {
    let tag = format!("\"{version}\"");
    let mut response = match matches_tag(asked, &tag) {
        true => empty(StatusCode::NOT_MODIFIED),
        false => bytes(read()?, content_type(name)),
    };
    header(&mut response, ETAG, &tag);
    header(&mut response, CACHE_CONTROL, "no-cache");
    let policy = if name == "report.html" { REPORT_POLICY } else { FILE_POLICY };
    header(&mut response, CONTENT_SECURITY_POLICY, policy);
    Ok(response)
}

/// Lets the browser save the answer under a name.
pub(super) fn as_download(response: &mut Response, name: &str) {
    let name = name.rsplit('/').next().unwrap_or(name);
    let plain: String =
        name.chars().filter(|c| c.is_ascii_graphic() && !matches!(c, '"' | '\\')).collect();
    header(response, CONTENT_DISPOSITION, &format!("attachment; filename=\"{plain}\""));
}

/// Whether `If-None-Match` names this tag.
pub(super) fn matches_tag(asked: &HeaderMap, tag: &str) -> bool {
    asked
        .get(axum::http::header::IF_NONE_MATCH)
        .and_then(|v| v.to_str().ok())
        .is_some_and(|tags| tags.split(',').any(|t| t.trim().trim_start_matches("W/") == tag))
}

/// The media type of a file by its name.
pub(super) fn content_type(name: &str) -> &'static str {
    match name.rsplit('.').next().unwrap_or_default().to_ascii_lowercase().as_str() {
        "png" => "image/png",
        "jpg" | "jpeg" => "image/jpeg",
        "gif" => "image/gif",
        "svg" => "image/svg+xml",
        "webp" => "image/webp",
        "json" => "application/json",
        "csv" => "text/csv; charset=utf-8",
        "html" => "text/html; charset=utf-8",
        "toml" | "bvh" => "text/plain; charset=utf-8",
        "glb" => "model/gltf-binary",
        "gltf" => "model/gltf+json",
        "mp4" => "video/mp4",
        _ => "application/octet-stream",
    }
}

/// The headers that no answer goes without; what an answer has set itself stays.
pub(super) fn with_safe_headers(mut response: Response) -> Response {
    let always = [
        (CONTENT_SECURITY_POLICY, PAGE_POLICY),
        (HeaderName::from_static("x-content-type-options"), "nosniff"),
        (HeaderName::from_static("referrer-policy"), "no-referrer"),
        (HeaderName::from_static("cross-origin-opener-policy"), "same-origin"),
        (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
        (CACHE_CONTROL, "no-store"),
    ];
    for (name, value) in always {
        response.headers_mut().entry(name).or_insert(HeaderValue::from_static(value));
    }
    response
}
