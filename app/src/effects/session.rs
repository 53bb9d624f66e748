//! Pairing: the one-time token of the address becomes a session key, kept for this tab alone.
//!
//! ```text
//! http://127.0.0.1:PORT/#t=TOKEN ─▶ address cleared at once ─▶ POST /api/pair ─▶ session id and key
//!                                                                              └▶ sessionStorage
//! ```
//!
//! Comes in: the address. Goes out: a session: id and key. Knows no socket.

use crate::browser::{request, tab_storage, window};
use annulus_core::wire::{PairBody, Paired};

const KEPT_AS: &str = "annulus.session";
/// Stands there while this tab holds on to control.
const CONTROL: &str = "annulus.control";
/// Stands there while this tab has a controller.
const CONTROLLER: &str = "annulus.controller";

/// Takes the token out of the address and clears it there before anything else happens.
pub(super) fn token_from_address() -> Option<String> {
    let location = window().location();
    let token = location.hash().ok()?.strip_prefix("#t=")?.to_owned();
    let rest = format!("{}{}", location.pathname().ok()?, location.search().ok()?);
    let history = window().history().ok()?;
    history.replace_state_with_url(&wasm_bindgen::JsValue::NULL, "", Some(&rest)).ok()?;
    Some(token)
}

/// Exchanges `token` for a session.
pub(super) async fn pair(token: String) -> Option<Paired> {
    let body = serde_json::to_vec(&PairBody { token }).ok()?;
    let headers = [("content-type", "application/json")];
    let answer = request("POST", "/api/pair", &headers, Some(&body)).await?;
    if answer.status != 200 {
        return None;
    }
    let paired = serde_json::from_slice(&answer.body).ok()?;
    keep(&paired);
    Some(paired)
}

fn keep(paired: &Paired) {
    if let (Some(storage), Ok(text)) = (tab_storage(), serde_json::to_string(paired)) {
        let _ = storage.set_item(KEPT_AS, &text);
    }
}

/// The session of this tab, over a reload.
pub(super) fn kept() -> Option<Paired> {
    let text = tab_storage()?.get_item(KEPT_AS).ok()??;
    serde_json::from_str(&text).ok()
}

/// Whether this tab had control when it was loaded last, and did not give it away.
pub(super) fn had_control() -> bool {
    tab_storage().and_then(|storage| storage.get_item(CONTROL).ok().flatten()).is_some()
}

/// Keeps that this tab has control, or had it and did not give it away.
pub(super) fn keep_control(had: bool) {
    if let Some(storage) = tab_storage() {
        let _ = if had { storage.set_item(CONTROL, "1") } else { storage.remove_item(CONTROL) };
    }
}

/// Whether this tab had a controller when it was loaded last, and did not let go of it.
pub(super) fn had_controller() -> bool {
    tab_storage().and_then(|storage| storage.get_item(CONTROLLER).ok().flatten()).is_some()
}

/// Keeps that this tab has a controller, or that it let go of it.
pub(super) fn keep_controller(on: bool) {
    if let Some(storage) = tab_storage() {
        let _ = if on { storage.set_item(CONTROLLER, "1") } else { storage.remove_item(CONTROLLER) };
    }
}

/// The USB number of the port that this tab had last.
const PORT: &str = "annulus.port";
/// How the board behind it greeted.
const BOARD: &str = "annulus.board";

/// Keeps which port this tab has, by its USB number.
pub(super) fn keep_port(usb: &str) {
    if let Some(storage) = tab_storage() {
        let _ = storage.set_item(PORT, usb);
    }
}

/// The USB number of the port that this tab had last.
pub(super) fn kept_port() -> Option<String> {
    tab_storage()?.get_item(PORT).ok()?
}

/// Keeps how the board greeted that this tab has.
pub(super) fn keep_board(greeting: &str) {
    if let Some(storage) = tab_storage() {
        let _ = storage.set_item(BOARD, greeting);
    }
}

/// How the board greeted that this tab had last.
pub(super) fn kept_board() -> Option<String> {
    tab_storage()?.get_item(BOARD).ok()?
}

/// Forgets it: the bridge does not know it any more.
pub(super) fn forget() {
    if let Some(storage) = tab_storage() {
        let _ = storage.remove_item(KEPT_AS);
    }
}

/// The bench of the Lab, kept for this tab alone.
const BENCH: &str = "annulus.lab";

/// Keeps the bench of the Lab.
pub(super) fn keep_bench(text: &str) {
    if let Some(storage) = tab_storage() {
        let _ = storage.set_item(BENCH, text);
    }
}

/// The bench of the Lab as it was kept.
pub(super) fn kept_bench() -> Option<String> {
    tab_storage()?.get_item(BENCH).ok()?
}
