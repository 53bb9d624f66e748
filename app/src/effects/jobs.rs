//! Uploads programs to the bridge and fetches them, as bytes with their SHA-256 as the key.

use crate::browser::{HttpAnswer, request};
use crate::model::StartEvent;
use crate::page;
use crate::said::key;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::error;
use annulus_core::wire::{PROOF_HEADER, Paired, SESSION_HEADER, auth, program};
use serde::Deserialize;

#[derive(Deserialize)]
struct Refusal {
    error: Said,
}

#[derive(Deserialize)]
struct Said {
    message: String,
    advice: String,
}

fn refused(answer: &HttpAnswer) -> Diagnostic {
    match serde_json::from_slice::<Refusal>(&answer.body) {
        Ok(Refusal { error }) => Diagnostic::error(key!("page.link.said"))
            .with("message", error.message)
            .with("advice", error.advice),
        Err(_) => Diagnostic::error(key!("page.link.refused")).with("status", answer.status),
    }
}

async fn send(
    session: Option<Paired>,
    method: &str,
    key: &str,
    body: Option<&[u8]>,
) -> Result<Vec<u8>, Diagnostic> {
    let session = session.ok_or_else(|| Diagnostic::error(key!("page.link.unpaired")))?;
    let path = format!("/api/jobs/{key}");
    let proof = auth::request(&session.key, method, &path);
    let headers = [(SESSION_HEADER, session.session.as_str()), (PROOF_HEADER, proof.as_str())];
    match request(method, &path, &headers, body).await {
        None => Err(Diagnostic::error(key!("page.link.no_answer"))),
        Some(answer) if (200..300).contains(&answer.status) => Ok(answer.body),
        Some(answer) => Err(refused(&answer)),
    }
}

pub(super) fn upload(number: u32, bytes: Vec<u8>, session: Option<Paired>) {
    leptos::task::spawn_local(async move {
        let key = program::key(&bytes);
        let answer = send(session, "PUT", &key, Some(&bytes)).await.map(|_| key);
        page::send(StartEvent::Uploaded { number, answer });
    });
}

/// Fetches the program `key`, for a page that was opened later. Bytes with another hash are refused.
pub(super) fn fetch(number: u32, key: String, session: Option<Paired>) {
    leptos::task::spawn_local(async move {
        let bytes = send(session, "GET", &key, None).await;
        let same = |bytes: Vec<u8>| {
            if program::key(&bytes) == key { Ok(bytes) } else { Err(error!("program.damaged")) }
        };
        page::send(StartEvent::Fetched { number, answer: bytes.and_then(same) });
    });
}
