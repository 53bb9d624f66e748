//! The socket itself: opens, proves who we are, pings, and tries again with growing patience.
//!
//! Comes in: wishes to send. Goes out: messages heard. Does not know what they mean.

use super::browser::{now_ms, window};
use super::heard::heard;
use super::session;
use super::{Control, Phase, link, noted, stop};
use crate::health::{Claim, freshness, retry_ms};
use crate::lab::log::Event;
use annulus_core::wire::{Ask, FRAME_LIMIT, OLDEST_PROTOCOL, PROTOCOL, Paired, auth};
use leptos::prelude::*;
use std::cell::{Cell, RefCell};
use std::time::Duration;
use wasm_bindgen::prelude::*;
use web_sys::{CloseEvent, MessageEvent, WebSocket};

/// One socket with the closures it calls; dropping them together keeps a late event from a dead socket silent.
struct Line {
    socket: WebSocket,
    _message: Closure<dyn FnMut(MessageEvent)>,
    _close: Closure<dyn FnMut(CloseEvent)>,
}

impl Drop for Line {
    fn drop(&mut self) {
        self.socket.set_onmessage(None);
        self.socket.set_onclose(None);
    }
}

thread_local! {
    static LINE: RefCell<Option<Line>> = const { RefCell::new(None) };
    static SESSION: RefCell<Option<Paired>> = const { RefCell::new(None) };
    static ATTEMPT: Cell<u32> = const { Cell::new(0) };
    static HEARD_MS: Cell<f64> = const { Cell::new(0.0) };
    static PINGED_MS: Cell<f64> = const { Cell::new(0.0) };
    /// The bridge said that it does not know this page.
    static UNKNOWN: Cell<bool> = const { Cell::new(false) };
    /// Whether this page holds on to control.
    static CLAIM: Cell<Claim> = const { Cell::new(Claim { had: false }) };
    /// Of asking for control and giving it back, the last was giving it back.
    static RELEASED: Cell<bool> = const { Cell::new(false) };
}

const TICK: Duration = Duration::from_millis(250);
const PING_EVERY_MS: f64 = 800.0;

/// Pairs if the address says so, else takes up the session of this tab; then connects and keeps connected.
pub(super) fn begin() {
    set_interval(tick, TICK);
    CLAIM.set(Claim { had: session::had_control() });
    let token = session::token_from_address();
    if let Some(kept) = session::kept().filter(|_| token.is_none()) {
        SESSION.set(Some(kept));
        connect();
    }
    if let Some(token) = token {
        link().phase.set(Phase::Connecting);
        leptos::task::spawn_local(async move {
            match session::pair(token).await {
                Some(session) => {
                    SESSION.set(Some(session));
                    connect();
                }
                None => link().phase.set(Phase::Unpaired),
            }
        });
    }
}

/// The session, for requests beside the socket.
pub(super) fn current_session() -> Option<Paired> {
    SESSION.with_borrow(Clone::clone)
}

/// Whether a message can go out and be taken seriously.
pub(super) fn is_open() -> bool {
    link().phase.get_untracked() == Phase::Open
        && LINE.with_borrow(|line| {
            line.as_ref().is_some_and(|line| line.socket.ready_state() == WebSocket::OPEN)
        })
}

/// Tries at once instead of waiting.
pub fn reconnect_now() {
    ATTEMPT.set(0);
    connect();
}

fn connect() {
    let line = link();
    if line.phase.get_untracked() == Phase::Open {
        return;
    }
    if line.phase.get_untracked() == Phase::Unpaired {
        line.phase.set(Phase::Connecting);
    }
    UNKNOWN.set(false);
    match open() {
        Some(line) => {
            LINE.replace(Some(line));
        }
        None => closed(),
    }
}

fn open() -> Option<Line> {
    let host = window().location().host().ok()?;
    let socket = WebSocket::new(&format!("ws://{host}/api/socket")).ok()?;
    let message = Closure::<dyn FnMut(MessageEvent)>::new(|event: MessageEvent| {
        if let Some(text) = event.data().as_string() {
            taken_in(&text);
        }
    });
    let close = Closure::<dyn FnMut(CloseEvent)>::new(|_| closed());
    socket.set_onmessage(Some(message.as_ref().unchecked_ref()));
    socket.set_onclose(Some(close.as_ref().unchecked_ref()));
    Some(Line { socket, _message: message, _close: close })
}

fn taken_in(text: &str) {
    HEARD_MS.set(now_ms());
    if text.len() > FRAME_LIMIT {
        return;
    }
    if let Ok(tell) = serde_json::from_str(text) {
        heard(tell);
    }
    ping_if_due();
}

/// Answers the bridge's first frame: who is speaking, with the proof.
pub(super) fn answer_challenge(nonce: &str) {
    let Some(session) = current_session() else { return };
    ask(&Ask::Hello {
        proto: PROTOCOL,
        min: OLDEST_PROTOCOL,
        app: env!("CARGO_PKG_VERSION").to_owned(),
        session: session.session.clone(),
        proof: auth::hello(&session.key, nonce),
    });
}

/// Hello was accepted: patience starts anew, and control is taken if nobody has it.
pub(super) fn welcomed() {
    ATTEMPT.set(0);
    ask(&Ask::TakeControl { force: false });
}

/// Sends `wish`; without a socket nothing happens (STOP is kept by its own file).
pub fn ask(wish: &Ask) {
    let Ok(text) = serde_json::to_string(wish) else { return };
    LINE.with_borrow(|line| {
        if let Some(line) = line {
            let _ = line.socket.send_with_str(&text);
        }
    });
    match wish {
        Ask::ReleaseControl => {
            RELEASED.set(true);
            claim(Claim::default());
        }
        Ask::TakeControl { .. } => RELEASED.set(false),
        _ => {}
    }
    if !matches!(wish, Ask::Hello { .. } | Ask::Ping { .. } | Ask::JogOn)
        && let Some(name) = text.split('"').nth(3)
    {
        noted(Event::Asked(name.to_owned()));
    }
}

/// The bridge said who has control. What this page had and did not give away it asks for again, once nobody has it.
pub(super) fn control_told(before: bool, yours: bool, taken: bool) {
    let mut now = CLAIM.get();
    let wants = now.told(before, yours, taken);
    claim(now);
    if wants {
        ask(&Ask::TakeControl { force: false });
    }
}

/// Keeps the claim, over a reload too.
fn claim(now: Claim) {
    if CLAIM.replace(now) != now {
        session::keep_control(now.had);
    }
}

/// Whether this page gave its control back on purpose.
pub(super) fn released() -> bool {
    RELEASED.get()
}

/// The bridge refused something. After hello it may be that it was restarted and does not know this page any more.
pub(super) fn refused(code: &str) {
    if matches!(code, "socket.session" | "socket.proof") && link().phase.get_untracked() != Phase::Open {
        UNKNOWN.set(true);
    }
}

/// The socket is gone.
fn closed() {
    let line = link();
    let was_open = line.phase.get_untracked() == Phase::Open;
    stop::broke();
    // Whoever has control from now on, it is not this connection.
    line.control.set(Control::default());
    if was_open {
        noted(Event::Link(false));
    }
    if UNKNOWN.get() {
        session::forget();
        SESSION.set(None);
        line.phase.set(Phase::Unpaired);
        return;
    }
    line.phase.set(if was_open || line.ever.get_untracked() { Phase::Lost } else { Phase::Connecting });
    let attempt = ATTEMPT.get();
    ATTEMPT.set(attempt.saturating_add(1));
    set_timeout(connect, Duration::from_millis(u64::from(retry_ms(attempt))));
}

fn ping_if_due() {
    let now = now_ms();
    if is_open() && now - PINGED_MS.get() >= PING_EVERY_MS {
        PINGED_MS.set(now);
        ask(&Ask::Ping { stamp: now });
    }
}

fn tick() {
    let line = link();
    ping_if_due();
    if !line.ever.get_untracked() {
        return;
    }
    let verdict = freshness(now_ms() - HEARD_MS.get());
    if line.freshness.get_untracked() != verdict {
        line.freshness.set(verdict);
    }
}
