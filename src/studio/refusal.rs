//! What the server answers when it does not do as asked: a status, a sentence and what to do.
//! Never a stack, never a path from outside the root folder.

use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use serde_json::json;

use super::answer;
use crate::error::Error;

/// A request that was not fulfilled.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Refusal {
    pub(super) status: StatusCode,
    pub(super) sentence: String,
    pub(super) hint: Option<String>,
    /// With 409: the version that is there now.
    pub(super) version: Option<String>,
}

pub(super) type Result<T> = std::result::Result<T, Refusal>;

impl Refusal {
    pub(super) fn new(status: StatusCode, sentence: impl Into<String>) -> Self {
        Self { status, sentence: sentence.into(), hint: None, version: None }
    }

    pub(super) fn malformed(sentence: impl Into<String>) -> Self {
        Self::new(StatusCode::BAD_REQUEST, sentence)
    }

    pub(super) fn forbidden(sentence: impl Into<String>) -> Self {
        Self::new(StatusCode::FORBIDDEN, sentence)
    }

    pub(super) fn not_found(sentence: impl Into<String>) -> Self {
        Self::new(StatusCode::NOT_FOUND, sentence)
    }

    pub(super) fn unusable(sentence: impl Into<String>) -> Self {
        Self::new(StatusCode::UNPROCESSABLE_ENTITY, sentence)
    }

    pub(super) fn too_large(sentence: impl Into<String>) -> Self {
        Self::new(StatusCode::PAYLOAD_TOO_LARGE, sentence)
    }

    pub(super) fn busy() -> Self {
        let hint = "wait for it to end, or cancel it".to_owned();
        let refusal = Self::new(StatusCode::LOCKED, "a job is running on this shot");
        Self { hint: Some(hint), ..refusal }
    }

    /// What was asked builds on a version that is no longer there.
    pub(super) fn changed(version: String) -> Self {
        let refusal = Self::new(StatusCode::CONFLICT, "the file was changed meanwhile");
        let hint = Some("load it again and repeat the change".to_owned());
        Self { version: Some(version), hint, ..refusal }
    }

    /// A defect of the program; what it was goes to the log, not to the page.
    pub(super) fn defect() -> Self {
        let sentence = "the program failed at this; the terminal it runs in says more";
        Self::new(StatusCode::INTERNAL_SERVER_ERROR, sentence)
    }

    /// The same with every text passed through `plain`.
    pub(super) fn map_text(mut self, plain: impl Fn(&str) -> String) -> Self {
        self.sentence = plain(&self.sentence);
        self.hint = self.hint.as_deref().map(plain);
        self
    }
}

impl From<Error> for Refusal {
    fn from(error: Error) -> Self {
        let status = match &error {
            Error::ShotBusy { .. } => StatusCode::LOCKED,
            Error::NoShot { .. } => StatusCode::NOT_FOUND,
            _ => StatusCode::UNPROCESSABLE_ENTITY,
        };
        Self { hint: error.remedy(), ..Self::new(status, error.to_string()) }
    }
}

impl IntoResponse for Refusal {
    fn into_response(self) -> Response {
        let mut body = json!({"error": self.sentence, "hint": self.hint});
        if let (Some(version), Some(members)) = (self.version, body.as_object_mut()) {
            members.insert("version".to_owned(), version.into());
        }
        answer::json(self.status, &body)
    }
}
