//! Programs to the bridge and back, as bytes, keyed by their SHA-256.
//!
//! Comes in: bytes of a program. Goes out: its key. Does not know what it does.

use super::browser::{Answer, request};
use super::socket::current_session;
use crate::i18n::key;
use annulus_core::remark::{Remark, Weight};
use annulus_core::wire::{PROOF_HEADER, SESSION_HEADER, auth, program};
use serde::Deserialize;

fn failed(code: &str) -> Remark {
    Remark::new(Weight::Loss, code)
}

#[derive(Deserialize)]
struct Refusal {
    error: Said,
}

#[derive(Deserialize)]
struct Said {
    message: String,
    advice: String,
}

fn refused(answer: &Answer) -> Remark {
    match serde_json::from_slice::<Refusal>(&answer.body) {
        Ok(Refusal { error }) => {
            failed(key!("page.link.said")).with("message", error.message).with("advice", error.advice)
        }
        Err(_) => failed(key!("page.link.refused")).with("status", answer.status),
    }
}

async fn send(method: &str, key: &str, body: Option<&[u8]>) -> Result<Vec<u8>, Remark> {
    let session = current_session().ok_or_else(|| failed(key!("page.link.unpaired")))?;
    let path = format!("/api/jobs/{key}");
    let proof = auth::request(&session.key, method, &path);
    let headers = [(SESSION_HEADER, session.session.as_str()), (PROOF_HEADER, proof.as_str())];
    match request(method, &path, &headers, body).await {
        None => Err(failed(key!("page.link.no_answer"))),
        Some(answer) if (200..300).contains(&answer.status) => Ok(answer.body),
        Some(answer) => Err(refused(&answer)),
    }
}

/// Uploads a program; answers with its key.
pub async fn upload(bytes: &[u8]) -> Result<String, Remark> {
    let key = program::key(bytes);
    send("PUT", &key, Some(bytes)).await.map(|_| key)
}

/// The bytes of the program `key`, for a page that opened later. Bytes that are not what the key says are refused.
pub async fn fetch(key: &str) -> Result<Vec<u8>, Remark> {
    let bytes = send("GET", key, None).await?;
    if program::key(&bytes) == key { Ok(bytes) } else { Err(failed("program.damaged")) }
}
