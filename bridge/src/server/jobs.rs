//! Programs in and out: `PUT` and `GET /api/jobs/SHA256`.

use super::Bridge;
use super::reply::{Refused, json};
use annulus_core::code;
use annulus_core::wire::{PROGRAM_LIMIT, PROOF_HEADER, SESSION_HEADER, Scope, auth};
use axum::body::{Body, Bytes};
use axum::extract::{Path, Request, State};
use axum::http::{HeaderMap, HeaderValue, Method, StatusCode, Uri, header};
use axum::response::{IntoResponse, Response};
use futures_util::StreamExt;
use serde_json::json;
use std::sync::Arc;
use std::time::Duration;
use tokio::time::timeout;

const UPLOAD_TIME: Duration = Duration::from_secs(60);

pub(crate) async fn put(
    State(bridge): State<Arc<Bridge>>,
    Path(key): Path<String>,
    request: Request,
) -> Result<Response, Refused> {
    let (parts, body) = request.into_parts();
    authorise(&bridge, Scope::Run, &parts.method, &parts.uri, &parts.headers)?;
    check_key(&key)?;
    let bytes = read_body(body, &parts.headers, PROGRAM_LIMIT, UPLOAD_TIME).await?;
    let machine = Arc::clone(&bridge.machine);
    let size = bytes.len();
    let job = key.clone();
    let stored = tokio::task::spawn_blocking(move || {
        // Hashing a large program takes time, hence not on the async thread.
        if auth::sha256(&bytes) != key {
            return Err(Refused::new(StatusCode::UNPROCESSABLE_ENTITY, code!("upload.other_hash")));
        }
        machine.upload(&key, &bytes).map_err(|why| {
            let content = why.code.starts_with("program.");
            let status =
                if content { StatusCode::UNPROCESSABLE_ENTITY } else { StatusCode::INSUFFICIENT_STORAGE };
            Refused { status, why }
        })
    });
    stored
        .await
        .unwrap_or_else(|_| Err(Refused::new(StatusCode::INTERNAL_SERVER_ERROR, code!("door.broken"))))?;
    tracing::info!(job, size, "program uploaded");
    Ok(json(StatusCode::OK, &json!({ "ok": true, "job": job })))
}

pub(crate) async fn get(
    State(bridge): State<Arc<Bridge>>,
    Path(key): Path<String>,
    method: Method,
    uri: Uri,
    headers: HeaderMap,
) -> Result<Response, Refused> {
    authorise(&bridge, Scope::View, &method, &uri, &headers)?;
    check_key(&key)?;
    let machine = Arc::clone(&bridge.machine);
    let found = tokio::task::spawn_blocking(move || machine.job(&key)).await.ok().flatten();
    let bytes = found.ok_or_else(|| Refused::new(StatusCode::NOT_FOUND, code!("upload.no_such_job")))?;
    let mut response = bytes.into_response();
    response.headers_mut().insert(header::CACHE_CONTROL, HeaderValue::from_static("no-store"));
    Ok(response)
}

/// Checks that the request belongs to a session with the rights of `scope`.
fn authorise(
    bridge: &Bridge,
    scope: Scope,
    method: &Method,
    uri: &Uri,
    headers: &HeaderMap,
) -> Result<(), Refused> {
    let text = |name: &str| headers.get(name).and_then(|value| value.to_str().ok()).unwrap_or_default();
    let refused = |code| Refused::new(StatusCode::UNAUTHORIZED, code);
    let session =
        bridge.pairing().session(text(SESSION_HEADER)).ok_or_else(|| refused(code!("door.session")))?;
    let expected = auth::request(&session.key, method.as_str(), uri.path());
    if !auth::same(expected.as_bytes(), text(PROOF_HEADER).as_bytes()) {
        return Err(refused(code!("door.proof")));
    }
    if session.scope < scope {
        Err(Refused::new(StatusCode::FORBIDDEN, code!("control.scope")))
    } else {
        Ok(())
    }
}

fn check_key(key: &str) -> Result<(), Refused> {
    let digits = key.len() == 64 && key.bytes().all(|byte| matches!(byte, b'0'..=b'9' | b'a'..=b'f'));
    if digits { Ok(()) } else { Err(Refused::new(StatusCode::BAD_REQUEST, code!("upload.key"))) }
}

/// Reads the whole body; an error if it exceeds `limit` or `time`, or is interrupted.
pub(crate) async fn read_body(
    body: Body,
    headers: &HeaderMap,
    limit: usize,
    time: Duration,
) -> Result<Bytes, Refused> {
    let too_large =
        || Refused::new(StatusCode::PAYLOAD_TOO_LARGE, code!("door.too_large")).with("limit", limit);
    let announced =
        headers.get(header::CONTENT_LENGTH).and_then(|value| value.to_str().ok()?.parse::<u64>().ok());
    if announced.is_some_and(|length| length > limit as u64) {
        return Err(too_large());
    }
    let collect = async {
        let mut bytes = Vec::new();
        let mut chunks = body.into_data_stream();
        while let Some(chunk) = chunks.next().await {
            let chunk = chunk.map_err(|_| Refused::new(StatusCode::BAD_REQUEST, code!("door.broken_off")))?;
            // The announced length may be missing or wrong.
            if bytes.len() + chunk.len() > limit {
                return Err(too_large());
            }
            bytes.extend_from_slice(&chunk);
        }
        Ok(bytes.into())
    };
    let in_time = timeout(time, collect).await;
    in_time.unwrap_or_else(|_| Err(Refused::new(StatusCode::REQUEST_TIMEOUT, code!("door.too_slow"))))
}
