//! Which request is answered by what.

use std::num::NonZeroU32;
use std::sync::Arc;

use axum::Router;
use axum::body::Bytes;
use axum::extract::{Path, Query, State};
use axum::http::header::{CACHE_CONTROL, ETAG};
use axum::http::{HeaderMap, StatusCode, Uri};
use axum::response::Response;
use axum::routing::get;
use axum::routing::post;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::json;

use super::jobs::{self, Order};
use super::refusal::{Refusal, Result};
use super::settings::{self, Change};
use super::state::Studio;
use super::{answer, events, files, folders, new_shot, page, rigs, shot_state};

type Shared = State<Arc<Studio>>;

/// Narrowest picture that is made, pixels.
const LEAST_WIDTH: u32 = 16;

/// The routes, all behind the guard.
pub(super) fn router() -> Router<Arc<Studio>> {
    Router::new()
        .route("/", get(async || page::index()))
        .route("/assets/{name}", get(asset))
        .route("/api/session", get(session))
        .route("/api/browse", get(browse))
        .route("/api/shots", post(make_shot))
        .route("/api/shot", get(shot).patch(change_settings))
        .route("/api/file", get(get_file).put(put_file).delete(delete_file))
        .route("/api/frame", get(frame))
        .route("/api/run", post(run))
        .route("/api/cancel", post(cancel))
        .route("/api/events", get(listen))
        .route("/api/rig", get(rig))
        .route("/api/rig/clips", get(rig_clips))
        .route("/api/invitation", post(invitation))
        .route("/api/shutdown", post(shutdown))
        .fallback(async || Refusal::not_found("there is nothing at this address"))
        .method_not_allowed_fallback(async || {
            Refusal::new(StatusCode::METHOD_NOT_ALLOWED, "this address does not take this method")
        })
}

/// Does the work on a thread that may wait, and takes the root's path out of what goes wrong.
async fn working<T: Send + 'static>(
    studio: Arc<Studio>,
    work: impl FnOnce(&Arc<Studio>) -> Result<T> + Send + 'static,
) -> Result<T> {
    let root = studio.root.clone();
    let done = tokio::task::spawn_blocking(move || work(&studio)).await;
    done.unwrap_or_else(|_| Err(Refusal::defect()))
        .map_err(|refusal| refusal.map_text(|text| root.without_path(text)))
}

fn query<T: DeserializeOwned>(uri: &Uri) -> Result<T> {
    let parsed = Query::<T>::try_from_uri(uri);
    parsed.map(|q| q.0).map_err(|e| Refusal::malformed(e.body_text()))
}

fn document<T: DeserializeOwned>(body: &[u8]) -> Result<T> {
    serde_json::from_slice(body).map_err(|e| Refusal::malformed(format!("the request: {e}")))
}

#[derive(Deserialize)]
struct OfShot {
    shot: String,
}

#[derive(Deserialize)]
struct OfPath {
    #[serde(default)]
    path: String,
}

#[derive(Deserialize)]
struct OfFile {
    shot: String,
    name: String,
    #[serde(default)]
    download: Option<String>,
}

#[derive(Deserialize)]
struct OfFrame {
    shot: String,
    frame: usize,
    width: Option<u32>,
    v: Option<String>,
}

#[derive(Deserialize)]
struct OfJob {
    job: String,
}

async fn asset(Path(name): Path<String>) -> Result<Response> {
    page::asset(&name)
}

async fn session(State(studio): Shared) -> Response {
    let session = json!({
        "version": env!("CARGO_PKG_VERSION"), "root": studio.root.title(),
        "shot": studio.first,
    });
    answer::json(StatusCode::OK, &session)
}

async fn browse(State(studio): Shared, uri: Uri) -> Result<Response> {
    let asked: OfPath = query(&uri)?;
    let listing = working(studio, move |s| folders::browse(&s.root, &asked.path)).await?;
    Ok(answer::json(StatusCode::OK, &listing))
}

async fn make_shot(State(studio): Shared, body: Bytes) -> Result<Response> {
    let wanted = document(&body)?;
    let report = working(studio, move |s| new_shot::make(&s.root, &wanted)).await?;
    Ok(answer::json(StatusCode::CREATED, &report))
}

async fn shot(State(studio): Shared, uri: Uri) -> Result<Response> {
    let asked: OfShot = query(&uri)?;
    working(studio, move |s| state_of(s, &asked.shot)).await
}

fn state_of(studio: &Arc<Studio>, shot: &str) -> Result<Response> {
    let desk = studio.desk(shot)?;
    let pages = Arc::downgrade(&desk);
    let ended = move || {
        if let Some(desk) = pages.upgrade() {
            // The length is known now.
            desk.tell("changed", &json!({"files": {}, "footage": true}));
        }
    };
    let state = shot_state::state(&studio.root, &desk, &studio.clips, ended)?;
    Ok(answer::json(StatusCode::OK, &state))
}

async fn change_settings(State(studio): Shared, uri: Uri, body: Bytes) -> Result<Response> {
    let asked: OfShot = query(&uri)?;
    let change: Change = document(&body)?;
    working(studio, move |s| {
        let desk = s.desk(&asked.shot)?;
        settings::change(&s.root, &desk, &change)?;
        desk.tell_changes(&s.root);
        state_of(s, &asked.shot)
    })
    .await
}

async fn get_file(State(studio): Shared, uri: Uri, headers: HeaderMap) -> Result<Response> {
    let asked: OfFile = query(&uri)?;
    working(studio, move |s| {
        let desk = s.desk(&asked.shot)?;
        files::get(&s.root, &desk, &asked.name, asked.download.is_some(), &headers)
    })
    .await
}

async fn put_file(
    State(studio): Shared,
    uri: Uri,
    headers: HeaderMap,
    body: Bytes,
) -> Result<Response> {
    let asked: OfFile = query(&uri)?;
    let version = working(studio, move |s| {
        let desk = s.desk(&asked.shot)?;
        let size = |shot: &crate::shot::Shot| {
            let extent = shot_state::extent(shot, &s.clips, || {});
            let known = extent.size.0 > 0;
            known.then_some(extent.size).ok_or_else(|| {
                Refusal::unusable(
                    "the size of the footage is not known, so nothing can be drawn on it",
                )
            })
        };
        files::put(&s.root, &desk, &asked.name, &headers, &body, size)
    })
    .await?;
    Ok(answer::json(StatusCode::OK, &json!({"version": version})))
}

async fn delete_file(State(studio): Shared, uri: Uri, headers: HeaderMap) -> Result<Response> {
    let asked: OfFile = query(&uri)?;
    working(studio, move |s| {
        let desk = s.desk(&asked.shot)?;
        files::delete(&s.root, &desk, &asked.name, &headers)
    })
    .await?;
    Ok(answer::json(StatusCode::OK, &json!({"version": ""})))
}

async fn frame(State(studio): Shared, uri: Uri, headers: HeaderMap) -> Result<Response> {
    let asked: OfFrame = query(&uri)?;
    let width = asked.width.map(|w| w.max(LEAST_WIDTH)).and_then(NonZeroU32::new);
    working(studio, move |s| {
        let desk = s.desk(&asked.shot)?;
        let known = asked.v.as_deref().and_then(|v| s.clips.find(v));
        let clip = match known {
            Some(clip) => Some(clip),
            None => s.clips.of(&desk.shot()?, || {})?,
        };
        let Some(clip) = clip else { return Err(Refusal::not_found("the shot has no footage")) };
        let shown = width.map_or_else(String::new, |w| format!("-{w}"));
        let tag = format!("\"{}-{}{shown}\"", clip.version, asked.frame);
        let mut response = match answer::matches_tag(&headers, &tag) {
            true => answer::empty(StatusCode::NOT_MODIFIED),
            false => answer::bytes(clip.picture(asked.frame, width)?, "image/jpeg"),
        };
        answer::header(&mut response, ETAG, &tag);
        // Only an address that names the version always means the same picture.
        let kept = match asked.v.as_deref() == Some(&clip.version) {
            true => "private, max-age=31536000, immutable",
            false => "no-cache",
        };
        answer::header(&mut response, CACHE_CONTROL, kept);
        Ok(response)
    })
    .await
}

async fn run(State(studio): Shared, body: Bytes) -> Result<Response> {
    let order: Order = document(&body)?;
    let job = working(studio, move |s| {
        let desk = s.desk(&order.shot)?;
        jobs::start(&s.numbers, &s.root, &desk, &order)
    })
    .await?;
    Ok(answer::json(StatusCode::ACCEPTED, &json!({"job": job})))
}

async fn cancel(State(studio): Shared, body: Bytes) -> Result<Response> {
    let asked: OfJob = document(&body)?;
    studio.cancel(&asked.job)?;
    Ok(answer::json(StatusCode::ACCEPTED, &json!({"job": asked.job})))
}

/// An address for another browser.
async fn invitation(State(studio): Shared) -> Result<Response> {
    let url = studio.guard.invitation().map_err(|_| Refusal::defect())?;
    Ok(answer::json(StatusCode::CREATED, &json!({"url": url})))
}

async fn listen(State(studio): Shared, uri: Uri) -> Result<Response> {
    let asked: OfShot = query(&uri)?;
    working(studio, move |s| {
        let desk = s.desk(&asked.shot)?;
        // From here on changes are told.
        desk.tell_changes(&s.root);
        Ok(events::stream(&desk))
    })
    .await
}

async fn rig(State(studio): Shared, uri: Uri) -> Result<Response> {
    let asked: OfPath = query(&uri)?;
    working(studio, move |s| s.rigs.bytes(&s.root, &asked.path)).await
}

async fn rig_clips(State(studio): Shared, uri: Uri) -> Result<Response> {
    let asked: OfPath = query(&uri)?;
    let clips = working(studio, move |s| rigs::clips(&s.root, &asked.path)).await?;
    Ok(answer::json(StatusCode::OK, &clips))
}

async fn shutdown(State(studio): Shared) -> Response {
    studio.stop();
    answer::json(StatusCode::ACCEPTED, &json!({}))
}
