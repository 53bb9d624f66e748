//! STOP: on the wire before anything else happens, and shouted about when nobody answers.
//!
//! Comes in: the press. Goes out: `Ask::Stop` and, after 250 ms of silence, the alert. Knows no buttons.

use super::browser::now_ms;
use super::{link, socket};
use crate::health::{STOP_PATIENCE_MS, StopWay};
use annulus_core::control::State;
use annulus_core::wire::Ask;
use leptos::prelude::*;
use std::cell::Cell;
use std::time::Duration;

/// A job that ends so soon after STOP was pressed ended by it.
const BY_THIS_MS: f64 = 60_000.0;

thread_local! {
    static WAY: Cell<StopWay> = const { Cell::new(StopWay::Idle) };
    static PRESSED_MS: Cell<f64> = const { Cell::new(f64::NEG_INFINITY) };
}

/// Whether STOP was pressed in this page just now.
pub(super) fn pressed_here() -> bool {
    now_ms() - PRESSED_MS.get() <= BY_THIS_MS
}

/// Stops the machine. With no link the wish is kept and goes out first on the next one.
pub fn stop() {
    PRESSED_MS.set(now_ms());
    if !socket::is_open() {
        WAY.set(StopWay::Latched);
        link().stop_unconfirmed.set(true);
        return;
    }
    send();
}

fn send() {
    let at_ms = now_ms();
    socket::ask(&Ask::Stop);
    socket::ask(&Ask::Ping { stamp: at_ms });
    WAY.set(StopWay::Sent(at_ms));
    set_timeout(look, Duration::from_millis(STOP_PATIENCE_MS as u64 + 5));
}

/// Shouts if it is time to.
fn look() {
    if WAY.get().overdue(now_ms()) {
        link().stop_unconfirmed.set(true);
    }
}

/// The link is open again: a kept STOP goes out before anything else.
pub(super) fn opened() {
    if WAY.get() == StopWay::Latched {
        send();
    }
}

/// The link broke: a STOP that was not answered is kept.
pub(super) fn broke() {
    if matches!(WAY.get(), StopWay::Sent(_)) {
        WAY.set(StopWay::Latched);
        link().stop_unconfirmed.set(true);
    }
}

/// A pong came back.
pub(super) fn pong(stamp_ms: f64) {
    if WAY.get().heard_by_pong(stamp_ms) {
        heard();
    }
}

/// A status came in.
pub(super) fn status(state: State) {
    if WAY.get().heard_by(state) {
        heard();
    }
}

fn heard() {
    WAY.set(StopWay::Idle);
    if link().stop_unconfirmed.get_untracked() {
        link().stop_unconfirmed.set(false);
    }
}
