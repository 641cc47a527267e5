//! What happens to a shot, as server-sent events.

use std::convert::Infallible;
use std::sync::Arc;

use axum::response::IntoResponse;
use axum::response::Response;
use axum::response::sse::{self, KeepAlive, Sse};
use serde_json::json;
use tokio_stream::StreamExt as _;
use tokio_stream::wrappers::BroadcastStream;

use super::desk::{Desk, Event};

/// A stream that begins with `hello` and ends when the page goes.
pub(super) fn stream(desk: &Arc<Desk>) -> Response {
    let listener = desk.listen();
    let status = Arc::clone(desk);
    let hello = move || {
        let job = status.job().map(|job| job.status());
        Event { name: "hello", data: json!({"job": job}).to_string().into() }
    };
    let first = tokio_stream::once(hello());
    // A page that was too slow to take everything is greeted again: it loads the shot anew.
    let rest = BroadcastStream::new(listener).map(move |event| event.unwrap_or_else(|_| hello()));
    let events = first.chain(rest).map(|event| {
        Ok::<_, Infallible>(sse::Event::default().event(event.name).data(&*event.data))
    });
    Sse::new(events).keep_alive(KeepAlive::default()).into_response()
}
