//! The socket: challenge, hello, then asks and tells.
//!
//! ```text
//!            ┌─ read ── Ping, control ──▶ watchers
//! frames ──▶ │       ── Stop ───────────▶ drill, at once, past everything that waits
//!            │       ── all others ─────▶ drill, in the order in which they come; their answers: queue ─ work
//!            └─ write ◀── watchers: tells in order, latest status
//! ```
//!
//! Comes in: text frames of at most [`FRAME_LIMIT`] bytes, at most [`RATE_PER_S`] a second. Goes out: the same way. A frame
//! that cannot be understood moves nothing. Does not know HTTP.

use super::Bridge;
use super::pairing::{self, Session};
use super::watchers::Seat;
use crate::drill::Begun;
use annulus_core::control::lease::{LeaseEvent, Viewer};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::wire::{Ask, FRAME_LIMIT, OLDEST_PROTOCOL, PROTOCOL, Scope, Tell, auth, understand};
use axum::extract::ws::{CloseFrame, Message, WebSocket, close_code};
use futures_util::stream::{SplitSink, SplitStream};
use futures_util::{SinkExt, StreamExt};
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::mpsc;
use tokio::time::{Instant, interval, sleep, timeout};

/// Time from challenge to hello.
const HELLO_TIME: Duration = Duration::from_secs(2);
/// Time for one frame to leave.
const SEND_TIME: Duration = Duration::from_secs(10);
/// Time between two signs of life asked of the browser.
const PULSE: Duration = Duration::from_secs(15);
/// A page that gives none for this long is gone.
const SILENCE: Duration = Duration::from_secs(45);
/// Time for a page to answer the goodbye.
const LINGER: Duration = Duration::from_secs(2);
/// Frames a page may send in a second, on the long run.
pub(crate) const RATE_PER_S: f64 = 100.0;
/// Frames it may send at once.
const BURST_FRAMES: f64 = 200.0;
/// Asks of one page that may wait for the drill.
const WAITING: usize = 32;
/// What the transport lets through; longer than [`FRAME_LIMIT`], so that a frame a little too long is answered with a
/// sentence before the end.
pub(crate) const TRANSPORT_LIMIT: usize = 4 * FRAME_LIMIT;

/// A refusal by code.
fn no(code: &str) -> Diagnostic {
    Diagnostic::error(code)
}

/// One page from challenge to goodbye.
pub(crate) async fn serve(bridge: Arc<Bridge>, mut socket: WebSocket, known: bool) {
    let Some((session, seat)) = let_in(&bridge, &mut socket, known).await else { return };
    let (viewer, scope) = (seat.viewer, session.scope);
    tracing::info!(viewer, ?scope, "page joined");
    // Not waited for: the first thing this page says may be STOP.
    tokio::task::spawn_blocking({
        let bridge = Arc::clone(&bridge);
        move || bridge.drill.greeting().iter().for_each(|tell| bridge.tell(viewer, tell))
    });
    converse(&bridge, socket, seat, scope).await;
    bridge.leave(viewer);
    tracing::info!(viewer, "page left");
}

/// From the challenge to a seat. Until hello it waits in the hall, where others may push it out.
async fn let_in(bridge: &Bridge, socket: &mut WebSocket, known: bool) -> Option<(Session, Seat)> {
    let hall = if known { &bridge.known_callers } else { &bridge.callers };
    let (_place, leaves) = hall.enter();
    let greeted = tokio::select! {
        greeted = timeout(HELLO_TIME + SEND_TIME, greet(bridge, socket)) => greeted.unwrap_or(Err(None)),
        _ = leaves => {
            tracing::warn!("too many callers: one that did not say who it is was let go");
            return None;
        }
    };
    let seated = greeted.and_then(|session| {
        let seat = bridge.watchers().join(session.id()).ok_or_else(|| Some(no("door.full")))?;
        Ok((session, seat))
    });
    match seated {
        Ok(seated) => Some(seated),
        Err(why) => {
            if let Some(why) = why {
                tracing::warn!(code = why.code, "page turned away");
                refuse(socket, why, close_code::POLICY).await;
            }
            None
        }
    }
}

/// Sends the challenge and judges the hello: who it is. `Err(None)` is a page that went away.
async fn greet(bridge: &Bridge, socket: &mut WebSocket) -> Result<Session, Option<Diagnostic>> {
    let nonce = pairing::secret::<32>().map_err(Some)?;
    let challenge = Tell::Challenge {
        proto: PROTOCOL,
        min: OLDEST_PROTOCOL,
        bridge: env!("CARGO_PKG_VERSION").to_owned(),
        nonce: nonce.clone(),
    };
    socket.send(message(&challenge)).await.map_err(|_| None)?;
    let first = timeout(HELLO_TIME, socket.recv()).await.map_err(|_| Some(no("socket.late")))?;
    let text = match first {
        Some(Ok(Message::Text(text))) => text,
        Some(Ok(Message::Close(_)) | Err(_)) | None => return Err(None),
        Some(Ok(_)) => return Err(Some(no("socket.first_frame"))),
    };
    let Ask::Hello { proto, min, session, proof, .. } = understand(&text).map_err(Some)? else {
        return Err(Some(no("socket.first_frame")));
    };
    if proto < OLDEST_PROTOCOL || min > PROTOCOL {
        return Err(Some(no("socket.other_version").with("page", proto).with("bridge", PROTOCOL)));
    }
    let session = bridge.pairing().session(&session).ok_or_else(|| Some(no("socket.session")))?;
    let expected = auth::hello(&session.key, &nonce);
    if auth::same(expected.as_bytes(), proof.as_bytes()) {
        Ok(session)
    } else {
        Err(Some(no("socket.proof")))
    }
}

/// Both ways until one side has had enough.
async fn converse(bridge: &Arc<Bridge>, socket: WebSocket, seat: Seat, scope: Scope) {
    let viewer = seat.viewer;
    let (sink, frames) = socket.split();
    let (queue, waiting) = mpsc::channel(WAITING);
    tokio::select! {
        () = read(bridge, viewer, scope, frames, queue) => {}
        () = work(bridge, viewer, waiting) => {}
        () = write(seat, sink) => {}
    }
}

/// Listens, and gives a page that broke a rule the time to hear why.
async fn read(
    bridge: &Arc<Bridge>,
    viewer: Viewer,
    scope: Scope,
    mut frames: SplitStream<WebSocket>,
    queue: mpsc::Sender<Begun>,
) {
    if let Some(why) = listen(bridge, viewer, scope, &mut frames, &queue).await {
        bridge.dismiss(viewer, why);
        // Read on without listening: a connection closed over unread frames would take the last words with it.
        while let Some(Ok(_)) = frames.next().await {}
    }
}

/// Listens until the page goes or falls silent (`None`), or breaks a rule.
async fn listen(
    bridge: &Arc<Bridge>,
    viewer: Viewer,
    scope: Scope,
    frames: &mut SplitStream<WebSocket>,
    queue: &mpsc::Sender<Begun>,
) -> Option<Diagnostic> {
    let mut allowance = BURST_FRAMES;
    let mut last = Instant::now();
    while let Ok(Some(Ok(frame))) = timeout(SILENCE, frames.next()).await {
        let now = Instant::now();
        allowance = (allowance + (now - last).as_secs_f64() * RATE_PER_S).min(BURST_FRAMES) - 1.0;
        last = now;
        let text = match frame {
            _ if allowance < 0.0 => return Some(no("socket.too_fast")),
            Message::Text(text) if text.len() > FRAME_LIMIT => {
                return Some(no("socket.too_large").with("limit", FRAME_LIMIT));
            }
            Message::Text(text) => text,
            Message::Binary(_) => return Some(no("socket.not_text")),
            Message::Close(_) => return None,
            Message::Ping(_) | Message::Pong(_) => continue,
        };
        bridge.control(viewer, LeaseEvent::Heard(viewer));
        match understand(&text) {
            Ok(ask) if ask.scope() > scope => bridge.refuse(viewer, no("control.scope")),
            Ok(ask) => take(bridge, viewer, ask, queue),
            Err(why) => bridge.refuse(viewer, why),
        }
    }
    None
}

/// Nothing here waits: the drill has every ask before the next frame is read. Its answers, and what has to be planned, wait
/// their turn behind each other; a page that holds the machine back does not wait behind a plan.
fn take(bridge: &Arc<Bridge>, viewer: Viewer, ask: Ask, queue: &mpsc::Sender<Begun>) {
    match ask {
        Ask::Hello { .. } => return bridge.refuse(viewer, no("socket.hello_again")),
        Ask::Ping { stamp } => return bridge.tell(viewer, &Tell::Pong { stamp }),
        Ask::TakeControl { force } => return bridge.control(viewer, LeaseEvent::Take { viewer, force }),
        Ask::ReleaseControl => return bridge.control(viewer, LeaseEvent::Release(viewer)),
        Ask::Stop => return bridge.stop(viewer),
        _ => {}
    }
    let Some(ticket) = bridge.ticket(viewer) else { return bridge.refuse(viewer, no("control.needed")) };
    match ask {
        // Nobody waits for an answer: it is said twenty times a second.
        Ask::JogOn => drop(bridge.drill.begin(ask, Some(ticket))),
        Ask::Pause | Ask::StopAfterHole | Ask::FeedOverride { percent: ..=100 } => {
            tracing::info!(viewer, ?ask, "ask");
            let begun = bridge.drill.begin(ask, Some(ticket));
            let bridge = Arc::clone(bridge);
            tokio::task::spawn_blocking(move || bridge.finish(viewer, begun));
        }
        ask => match queue.try_reserve() {
            Ok(place) => {
                tracing::info!(viewer, ?ask, "ask");
                place.send(bridge.drill.begin(ask, Some(ticket)));
            }
            Err(_) => bridge.refuse(viewer, no("socket.too_much")),
        },
    }
}

/// Finishes what was begun, one after the other.
async fn work(bridge: &Arc<Bridge>, viewer: Viewer, mut waiting: mpsc::Receiver<Begun>) {
    while let Some(begun) = waiting.recv().await {
        let done = tokio::task::spawn_blocking({
            let bridge = Arc::clone(bridge);
            move || bridge.finish(viewer, begun)
        });
        let _ = done.await;
    }
}

/// Writes what there is to tell; of the status only the latest.
async fn write(mut seat: Seat, mut sink: SplitSink<WebSocket, Message>) {
    let mut pulse = interval(PULSE);
    loop {
        let message = tokio::select! {
            biased;
            tell = seat.tells.recv() => match tell {
                Some(text) => Message::Text(text),
                None => break,
            },
            changed = seat.status.changed() => match changed {
                Ok(()) => Message::Text(seat.status.borrow_and_update().clone()),
                Err(_) => break,
            },
            _ = pulse.tick() => Message::Ping(Default::default()),
        };
        if !matches!(timeout(SEND_TIME, sink.send(message)).await, Ok(Ok(()))) {
            return;
        }
    }
    let _ = timeout(SEND_TIME, sink.send(goodbye(close_code::AWAY))).await;
    sleep(LINGER).await;
}

/// Says why and closes, before a page has a seat.
async fn refuse(socket: &mut WebSocket, why: Diagnostic, code: u16) {
    let both = async {
        let _ = socket.send(message(&Tell::Refused { why })).await;
        let _ = socket.send(goodbye(code)).await;
    };
    let _ = timeout(SEND_TIME, both).await;
}

fn message(tell: &Tell) -> Message {
    Message::Text(serde_json::to_string(tell).unwrap_or_default().into())
}

fn goodbye(code: u16) -> Message {
    Message::Close(Some(CloseFrame { code, reason: Default::default() }))
}
