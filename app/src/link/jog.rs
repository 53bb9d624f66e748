//! Moving by hand: the bridge goes only as long as this page says again and again that it is still there.
//!
//! ```text
//! step    Jog ─▶ JogOn, every 50 ms ─▶ … ─▶ the machine is at rest, or this page is hidden, stuck or gone: no more
//! hold    Jog as far as it goes ─▶ JogOn, every 50 ms ─▶ … ─▶ let go: no more, and the machine comes to rest
//! ```
//!
//! Comes in: one wish of a distance, or of a direction until it is let go. Goes out: that wish, and its renewals. Knows no
//! buttons.

use super::browser::now_ms;
use super::{link, socket};
use annulus_core::control::State;
use annulus_core::wire::{Ask, JOG_GRANT_MS};
use leptos::leptos_dom::helpers::IntervalHandle;
use leptos::prelude::*;
use std::cell::Cell;
use std::time::Duration;

/// Often enough that two renewals may be late.
const EVERY: Duration = Duration::from_millis(JOG_GRANT_MS / 3);

/// So long after the wish the machine may still be told to be at rest from before.
const BEGINS_MS: f64 = 500.0;

/// Further than any machine goes, in µm: the bridge ends it at the travel's end.
const FAR_UM: i32 = 2_000_000;

thread_local! {
    static RENEWS: Cell<Option<IntervalHandle>> = const { Cell::new(None) };
    static ASKED_MS: Cell<f64> = const { Cell::new(0.0) };
}

/// Moves `axis` by `distance_um`.
pub fn jog(axis: u8, distance_um: i32) {
    socket::ask(&Ask::Jog { axis, distance_um });
    ASKED_MS.set(now_ms());
    if RENEWS.get().is_none() {
        RENEWS.set(set_interval_with_handle(renew, EVERY).ok());
    }
}

/// Moves `axis` upwards or downwards until [`let_go`].
pub fn hold(axis: u8, up: bool) {
    jog(axis, if up { FAR_UM } else { -FAR_UM });
}

/// Nothing is renewed any more: what moves by hand comes to rest.
pub fn let_go() {
    if let Some(handle) = RENEWS.take() {
        handle.clear();
    }
}

/// Says that the page is still there, while something moves by hand.
fn renew() {
    let line = link();
    let jogs = line
        .status
        .with_untracked(|status| status.as_ref().is_some_and(|status| status.state == State::Jogging));
    let begins = now_ms() - ASKED_MS.get() < BEGINS_MS;
    let hidden = leptos::prelude::document().hidden();
    if socket::is_open() && !hidden && (jogs || begins) {
        return socket::ask(&Ask::JogOn);
    }
    let_go();
}
