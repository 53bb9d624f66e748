//! HTTP responses: every refusal is one JSON object with a sentence, as on the command line.

use crate::refusal::Refusal;
use annulus_core::diagnostic::Diagnostic;
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde_json::Value;

#[derive(Debug)]
pub(crate) struct Refused {
    pub(crate) status: StatusCode,
    pub(crate) why: Diagnostic,
}

impl Refused {
    /// A refusal by code, without arguments.
    pub(crate) fn new(status: StatusCode, code: &str) -> Self {
        Self { status, why: Diagnostic::error(code) }
    }

    pub(crate) fn with(mut self, name: &str, value: impl ToString) -> Self {
        self.why = self.why.with(name, value);
        self
    }
}

impl IntoResponse for Refused {
    fn into_response(self) -> Response {
        json(self.status, &Refusal::content(self.why).object())
    }
}

/// A JSON response that must not be cached.
pub(crate) fn json(status: StatusCode, value: &Value) -> Response {
    let mut response = (status, value.to_string()).into_response();
    let headers = response.headers_mut();
    headers.insert(header::CONTENT_TYPE, HeaderValue::from_static("application/json"));
    headers.insert(header::CACHE_CONTROL, HeaderValue::from_static("no-store"));
    response
}
