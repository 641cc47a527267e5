//! The built page, which is part of the program.

use axum::response::Response;

use super::answer;
use super::refusal::{Refusal, Result};

const INDEX: &[u8] = include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/studio/dist/index.html"));
const SCRIPT: &[u8] =
    include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/studio/dist/assets/studio.js"));
const STYLE: &[u8] =
    include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/studio/dist/assets/studio.css"));

/// The page itself.
pub(super) fn index() -> Response {
    answer::bytes(INDEX.to_vec(), "text/html; charset=utf-8")
}

/// What the page consists of besides.
pub(super) fn asset(name: &str) -> Result<Response> {
    match name {
        "studio.js" => Ok(answer::bytes(SCRIPT.to_vec(), "text/javascript; charset=utf-8")),
        "studio.css" => Ok(answer::bytes(STYLE.to_vec(), "text/css; charset=utf-8")),
        _ => Err(Refusal::not_found("there is no such part of the page")),
    }
}
