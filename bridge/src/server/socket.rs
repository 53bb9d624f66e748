//! The socket of a page: challenge, hello, then requests and reports.
//!
//! ```text
//!            ┌─ read ── Ping, control ──▶ watchers
//! frames ──▶ │       ── Stop ───────────▶ drill, at once, before everything that waits
//!            │       ── all others ─────▶ drill, in order of arrival; their answers: queue ─ work
//!            └─ write ◀── watchers: reports in order, latest status
//! ```
//!
//! A frame that cannot be understood moves nothing.

use super::Bridge;
use super::pairing::{self, Session};
use super::watchers::Seat;
use crate::hosted::Begun;
use annulus_core::control::lease::{LeaseEvent, Viewer};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::error;
use annulus_core::wire::{Ask, FRAME_LIMIT, OLDEST_PROTOCOL, PROTOCOL, Scope, Tell, auth, understand};
use axum::extract::ws::{CloseFrame, Message, WebSocket, close_code};
use futures_util::stream::{SplitSink, SplitStream};
use futures_util::{SinkExt, StreamExt};
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::mpsc;
use tokio::time::{Instant, interval, sleep, timeout};

const HELLO_TIME: Duration = Duration::from_secs(2);
const SEND_TIME: Duration = Duration::from_secs(10);
/// Interval of keep-alive pings to the browser.
const PULSE: Duration = Duration::from_secs(15);
const SILENCE: Duration = Duration::from_secs(45);
/// Time for a page to answer the close frame.
const LINGER: Duration = Duration::from_secs(2);
pub(crate) const RATE_PER_S: f64 = 100.0;
const BURST_FRAMES: f64 = 200.0;
const WAITING: usize = 32;
/// Transport limit; larger than [`FRAME_LIMIT`], so that a slightly too long frame gets an explanation
/// before the end.
pub(crate) const TRANSPORT_LIMIT: usize = 4 * FRAME_LIMIT;

pub(crate) async fn serve(bridge: Arc<Bridge>, mut socket: WebSocket, known: bool) {
    let Some((session, seat)) = let_in(&bridge, &mut socket, known).await else { return };
    let (viewer, scope) = (seat.viewer, session.scope);
    tracing::info!(viewer, ?scope, "page joined");
    // Do not wait for it: the page's first frame may be STOP.
    tokio::task::spawn_blocking({
        let bridge = Arc::clone(&bridge);
        move || bridge.machine.greeting().iter().for_each(|tell| bridge.tell(viewer, tell))
    });
    converse(&bridge, socket, seat, scope).await;
    bridge.leave(viewer);
    tracing::info!(viewer, "page left");
}

/// From the challenge to a seat. Until its hello the page waits in the hall, from where others may displace
/// it.
async fn let_in(bridge: &Bridge, socket: &mut WebSocket, known: bool) -> Option<(Session, Seat)> {
    let hall = if known { &bridge.known_callers } else { &bridge.callers };
    let (_place, leaves) = hall.enter();
    let greeted = tokio::select! {
        greeted = timeout(HELLO_TIME + SEND_TIME, greet(bridge, socket)) => greeted.unwrap_or(Err(None)),
        _ = leaves => {
            tracing::warn!("too many connections: one that did not identify itself was closed");
            return None;
        }
    };
    let seated = greeted.and_then(|session| {
        let seat = bridge.watchers().join(session.id()).ok_or_else(|| Some(error!("door.full")))?;
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

/// Sends the challenge and checks the hello. Returns the session; `Err(None)` if the page disappeared.
async fn greet(bridge: &Bridge, socket: &mut WebSocket) -> Result<Session, Option<Diagnostic>> {
    let nonce = pairing::secret::<32>().map_err(Some)?;
    let challenge = Tell::Challenge {
        proto: PROTOCOL,
        min: OLDEST_PROTOCOL,
        bridge: env!("CARGO_PKG_VERSION").to_owned(),
        nonce: nonce.clone(),
    };
    socket.send(message(&challenge)).await.map_err(|_| None)?;
    let first = timeout(HELLO_TIME, socket.recv()).await.map_err(|_| Some(error!("socket.late")))?;
    let text = match first {
        Some(Ok(Message::Text(text))) => text,
        Some(Ok(Message::Close(_)) | Err(_)) | None => return Err(None),
        Some(Ok(_)) => return Err(Some(error!("socket.first_frame"))),
    };
    let Ask::Hello { proto, min, session, proof, .. } = understand(&text).map_err(Some)? else {
        return Err(Some(error!("socket.first_frame")));
    };
    if proto < OLDEST_PROTOCOL || min > PROTOCOL {
        return Err(Some(error!("socket.other_version", page = proto, bridge = PROTOCOL)));
    }
    let session = bridge.pairing().session(&session).ok_or_else(|| Some(error!("socket.session")))?;
    let expected = auth::hello(&session.key, &nonce);
    if auth::same(expected.as_bytes(), proof.as_bytes()) {
        Ok(session)
    } else {
        Err(Some(error!("socket.proof")))
    }
}

/// Reads, works and writes until one of them ends.
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

/// Listens, and gives a page that broke a rule time to receive the reason.
async fn read(
    bridge: &Arc<Bridge>,
    viewer: Viewer,
    scope: Scope,
    mut frames: SplitStream<WebSocket>,
    queue: mpsc::Sender<Begun>,
) {
    if let Some(why) = listen(bridge, viewer, scope, &mut frames, &queue).await {
        bridge.dismiss(viewer, why);
        // Keep reading: closing a connection with unread frames would discard the last frames sent.
        // STOP counts all the same, once.
        let mut stopped = false;
        while let Some(Ok(frame)) = frames.next().await {
            if is_stop(&frame) && !std::mem::replace(&mut stopped, true) {
                bridge.stop(viewer);
            }
        }
    }
}

/// Listens until the page leaves or falls silent (`None`), or breaks a rule.
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
            _ if allowance < 0.0 => {
                // STOP works even from a page that sends too fast.
                if is_stop(&frame) {
                    bridge.stop(viewer);
                }
                return Some(error!("socket.too_fast"));
            }
            Message::Text(text) if text.len() > FRAME_LIMIT => {
                return Some(error!("socket.too_large", limit = FRAME_LIMIT));
            }
            Message::Text(text) => text,
            Message::Binary(_) => return Some(error!("socket.not_text")),
            Message::Close(_) => return None,
            Message::Ping(_) | Message::Pong(_) => continue,
        };
        bridge.control(viewer, LeaseEvent::Heard(viewer));
        match understand(&text) {
            Ok(ask) if ask.scope() > scope => bridge.refuse(viewer, error!("control.scope")),
            Ok(ask) => take(bridge, viewer, ask, queue),
            Err(why) => bridge.refuse(viewer, why),
        }
    }
    None
}

fn is_stop(frame: &Message) -> bool {
    matches!(frame, Message::Text(text) if text.len() <= FRAME_LIMIT && matches!(understand(text), Ok(Ask::Stop)))
}

/// Never blocks: the drill has every request before the next frame is read. Answers and plans are finished
/// in order, but pauses and slower feeds do not wait for a plan.
fn take(bridge: &Arc<Bridge>, viewer: Viewer, ask: Ask, queue: &mpsc::Sender<Begun>) {
    match ask {
        Ask::Hello { .. } => return bridge.refuse(viewer, error!("socket.hello_again")),
        Ask::Ping { stamp } => return bridge.tell(viewer, &Tell::Pong { stamp }),
        Ask::TakeControl { force } => return bridge.control(viewer, LeaseEvent::Take { viewer, force }),
        Ask::ReleaseControl => return bridge.control(viewer, LeaseEvent::Release(viewer)),
        Ask::Stop => return bridge.stop(viewer),
        _ => {}
    }
    let Some(ticket) = bridge.ticket(viewer) else { return bridge.refuse(viewer, error!("control.needed")) };
    match ask {
        // Sent twenty times per second; its answer is ignored.
        Ask::JogOn => drop(bridge.machine.begin(ask, Some(ticket))),
        // These must not wait in the queue behind a long request.
        Ask::Pause | Ask::LiftTool | Ask::StopAfterHole | Ask::FeedOverride { percent: ..=100 } => {
            tracing::info!(viewer, ?ask, "ask");
            let begun = bridge.machine.begin(ask, Some(ticket));
            let bridge = Arc::clone(bridge);
            tokio::task::spawn_blocking(move || bridge.finish(viewer, begun));
        }
        // First the place, then the start: a started request must also be finished.
        ask => match queue.try_reserve() {
            Ok(place) => {
                tracing::info!(viewer, ?ask, "ask");
                place.send(bridge.machine.begin(ask, Some(ticket)));
            }
            Err(_) => bridge.refuse(viewer, error!("socket.too_much")),
        },
    }
}

/// Finishes started requests in order.
async fn work(bridge: &Arc<Bridge>, viewer: Viewer, mut waiting: mpsc::Receiver<Begun>) {
    while let Some(begun) = waiting.recv().await {
        let done = tokio::task::spawn_blocking({
            let bridge = Arc::clone(bridge);
            move || bridge.finish(viewer, begun)
        });
        let _ = done.await;
    }
}

/// Writes reports in order, and the latest status.
async fn write(mut seat: Seat, mut sink: SplitSink<WebSocket, Message>) {
    let mut pulse = interval(PULSE);
    loop {
        let message = tokio::select! {
            // Reports first: the status is replaced by a newer one, a report is not.
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
    // So that the last frames arrive before the connection closes.
    sleep(LINGER).await;
}

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
