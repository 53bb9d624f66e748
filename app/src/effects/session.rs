//! Pairing: exchanges the one-time token in the address for a session key, which stays in this tab.
//!
//! ```text
//! http://127.0.0.1:PORT/#t=TOKEN ─▶ address cleared at once ─▶ POST /api/pair ─▶ session id and key
//!                                                                              └▶ sessionStorage
//! ```

use crate::browser::{request, tab_storage, window};
use annulus_core::wire::{PairBody, Paired};

const KEPT_AS: &str = "annulus.session";
/// Present while this tab claims control.
const CONTROL: &str = "annulus.control";
/// Present while this tab uses a controller.
const CONTROLLER: &str = "annulus.controller";

/// Takes the token from the address and clears it there before anything else happens.
pub(super) fn token_from_address() -> Option<String> {
    let location = window().location();
    let token = location.hash().ok()?.strip_prefix("#t=")?.to_owned();
    let rest = format!("{}{}", location.pathname().ok()?, location.search().ok()?);
    let history = window().history().ok()?;
    history.replace_state_with_url(&wasm_bindgen::JsValue::NULL, "", Some(&rest)).ok()?;
    Some(token)
}

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

/// The session of this tab, across a reload.
pub(super) fn kept() -> Option<Paired> {
    let text = tab_storage()?.get_item(KEPT_AS).ok()??;
    serde_json::from_str(&text).ok()
}

/// True if this tab had control before the reload and did not release it.
pub(super) fn had_control() -> bool {
    tab_storage().and_then(|storage| storage.get_item(CONTROL).ok().flatten()).is_some()
}

/// Remembers whether this tab has control, or lost it without releasing it.
pub(super) fn keep_control(had: bool) {
    if let Some(storage) = tab_storage() {
        let _ = if had { storage.set_item(CONTROL, "1") } else { storage.remove_item(CONTROL) };
    }
}

pub(super) fn had_controller() -> bool {
    tab_storage().and_then(|storage| storage.get_item(CONTROLLER).ok().flatten()).is_some()
}

pub(super) fn keep_controller(on: bool) {
    if let Some(storage) = tab_storage() {
        let _ = if on { storage.set_item(CONTROLLER, "1") } else { storage.remove_item(CONTROLLER) };
    }
}

/// USB identifiers of this tab's last port.
const PORT: &str = "annulus.port";
/// Identity of the controller at that port.
const BOARD: &str = "annulus.board";

pub(super) fn keep_port(usb: &str) {
    if let Some(storage) = tab_storage() {
        let _ = storage.set_item(PORT, usb);
    }
}

/// USB identifiers of this tab's last port.
pub(super) fn kept_port() -> Option<String> {
    tab_storage()?.get_item(PORT).ok()?
}

pub(super) fn keep_board(greeting: &str) {
    if let Some(storage) = tab_storage() {
        let _ = storage.set_item(BOARD, greeting);
    }
}

/// Identity of this tab's last controller.
pub(super) fn kept_board() -> Option<String> {
    tab_storage()?.get_item(BOARD).ok()?
}

pub(super) fn forget() {
    if let Some(storage) = tab_storage() {
        let _ = storage.remove_item(KEPT_AS);
    }
}

/// The Lab's setup, in this tab only.
const BENCH: &str = "annulus.lab";

pub(super) fn keep_bench(text: &str) {
    if let Some(storage) = tab_storage() {
        let _ = storage.set_item(BENCH, text);
    }
}

pub(super) fn kept_bench() -> Option<String> {
    tab_storage()?.get_item(BENCH).ok()?
}
