//! Connections: how many, how long they may take, and what every request passes before its route.

use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use axum::body::{Body, Bytes};
use axum::extract::{Request, State};
use axum::http::header::{CONNECTION, CONTENT_LENGTH, TRANSFER_ENCODING};
use axum::http::{Method, StatusCode};
use axum::middleware::{self, Next};
use axum::response::{IntoResponse, Response};
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::net::TcpListener;
use tokio::sync::Semaphore;
use tokio_stream::StreamExt as _;

use super::guard::Passage;
use super::refusal::{Refusal, Result};
use super::state::Studio;
use super::{answer, routes};

/// Open at a time. A tab uses at most six.
const MOST_CONNECTIONS: usize = 64;

/// A request line and its headers must come within this time.
const HEADER_TIME: Duration = Duration::from_secs(10);

/// And the rest of the request within this.
const BODY_TIME: Duration = Duration::from_secs(60);

/// Room for request line and headers.
const MOST_HEADER_BYTES: usize = 64 << 10;

/// Bodies: pictures, and everything else.
const MOST_PICTURE_BYTES: u64 = 32 << 20;
const MOST_JSON_BYTES: u64 = 1 << 20;

/// What is read and thrown away of a body that is too large, so that the browser gets the answer.
const MOST_DRAINED_BYTES: u64 = 64 << 20;

/// How often files are looked at for changes made by other programs.
const LOOK_EVERY: Duration = Duration::from_secs(1);

/// Serves until the studio is stopped.
pub(super) async fn serve(studio: Arc<Studio>, listener: TcpListener) {
    let router = Router::new()
        .merge(routes::router())
        .layer(middleware::from_fn(whole_body))
        .layer(middleware::from_fn_with_state(Arc::clone(&studio), guarded))
        .with_state(Arc::clone(&studio));
    tokio::select! {
        () = accept(listener, router) => {}
        () = look_for_changes(&studio) => {}
        () = studio.stopped() => {}
    }
    for desk in studio.desks() {
        if let Some(job) = desk.job() {
            job.cancel();
        }
    }
    studio.clips.close();
}

async fn accept(listener: TcpListener, router: Router) {
    let places = Arc::new(Semaphore::new(MOST_CONNECTIONS));
    loop {
        let Ok(place) = Arc::clone(&places).acquire_owned().await else { return };
        let stream = match listener.accept().await {
            Ok((stream, _)) => stream,
            // Out of file handles, or the caller has gone: neither is a reason to end.
            Err(error) => {
                tracing::debug!(%error, "a connection was not taken");
                tokio::time::sleep(Duration::from_millis(50)).await;
                continue;
            }
        };
        let _ = stream.set_nodelay(true);
        let service = TowerToHyperService::new(router.clone());
        tokio::spawn(async move {
            let served = http1::Builder::new()
                .timer(TokioTimer::new())
                .header_read_timeout(HEADER_TIME)
                .max_buf_size(MOST_HEADER_BYTES)
                .serve_connection(TokioIo::new(stream), service)
                .await;
            if let Err(error) = served {
                tracing::debug!(%error, "a connection broke");
            }
            drop(place);
        });
    }
}

async fn look_for_changes(studio: &Arc<Studio>) {
    let mut clock = tokio::time::interval(LOOK_EVERY);
    clock.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
    loop {
        clock.tick().await;
        for desk in studio.desks().into_iter().filter(|desk| desk.has_listeners()) {
            let root = studio.root.clone();
            let looked = tokio::task::spawn_blocking(move || desk.tell_changes(&root));
            if let Err(error) = looked.await {
                tracing::error!(%error, "looking for changed files failed");
            }
        }
    }
}

async fn guarded(State(studio): State<Arc<Studio>>, request: Request, next: Next) -> Response {
    let response = match studio.guard.check(&request) {
        _ if has_two_lengths(&request) => {
            let refused = Refusal::malformed("the request gives its length in two ways");
            let mut response = refused.into_response();
            answer::header(&mut response, CONNECTION, "close");
            response
        }
        Ok(Passage::Open) => next.run(request).await,
        Ok(Passage::Enter(response)) => response,
        Err(refusal) => refusal.into_response(),
    };
    answer::with_safe_headers(response)
}

/// Where one request ends and the next begins must not be a matter of opinion (RFC 9112, 6.3).
fn has_two_lengths(request: &Request) -> bool {
    let headers = request.headers();
    headers.contains_key(CONTENT_LENGTH) && headers.contains_key(TRANSFER_ENCODING)
}

/// Reads the body before anything is done, within bounds of size and time.
async fn whole_body(request: Request, next: Next) -> Response {
    let (parts, body) = request.into_parts();
    let picture = parts.method == Method::PUT && parts.uri.path() == "/api/file";
    let most = if picture { MOST_PICTURE_BYTES } else { MOST_JSON_BYTES };
    let declared = parts
        .headers
        .get(CONTENT_LENGTH)
        .and_then(|v| v.to_str().ok())
        .and_then(|v| v.parse().ok())
        .unwrap_or(0);
    let read = tokio::time::timeout(BODY_TIME, bounded(body, declared, most)).await;
    let slow = Refusal::new(StatusCode::REQUEST_TIMEOUT, "the request took too long to arrive");
    match read.unwrap_or(Err(slow)) {
        Ok(bytes) => next.run(Request::from_parts(parts, Body::from(bytes))).await,
        Err(refusal) => refusal.into_response(),
    }
}

async fn bounded(body: Body, declared: u64, most: u64) -> Result<Bytes> {
    let too_large = || Refusal::too_large(format!("the request is larger than {most} bytes"));
    if declared > MOST_DRAINED_BYTES {
        return Err(too_large());
    }
    let mut stream = body.into_data_stream();
    let mut bytes = Vec::new();
    let mut length = 0_u64;
    while let Some(part) = stream.next().await {
        let part = part.map_err(|_| Refusal::malformed("the request broke off"))?;
        length += part.len() as u64;
        if length > MOST_DRAINED_BYTES {
            return Err(too_large());
        }
        if length <= most {
            bytes.extend_from_slice(&part);
        }
    }
    if length > most { Err(too_large()) } else { Ok(bytes.into()) }
}
