//! The local server behind the page.
//!
//! ```text
//! 127.0.0.1, [::1] ─▶ connection (limits, deadlines) ─▶ guard ─▶ routes ─┬─ page     embedded files
//!                                                                        ├─ pairing  token → session
//!                                                                        ├─ jobs     programs in and out
//!                                                                        └─ socket   requests ─▶ watchers ─▶ machine
//! ```
//!
//! No failure here affects the machine.

mod guard;
mod hall;
mod jobs;
mod page;
mod pairing;
mod reply;
pub(crate) mod runtime;
mod socket;
mod watchers;

use crate::hosted::{Begun, Hosted};
use annulus_core::code;
use annulus_core::control::lease::{LeaseEvent, LeaseOutcome, Viewer};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::wire::{LinkBody, PROOF_HEADER, PairBody, Scope, Tell, auth};
use annulus_host::Ticket;
use axum::Router;
use axum::extract::ws::rejection::WebSocketUpgradeRejection;
use axum::extract::{Request, State, WebSocketUpgrade};
use axum::http::request::Parts;
use axum::http::{HeaderMap, HeaderValue, StatusCode, Uri, header};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use hall::Hall;
use hyper::body::Incoming;
use hyper::server::conn::http1;
use hyper::service::{Service, service_fn};
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use pairing::{Pairing, Rejection};
use reply::{Refused, json};
use serde_json::json;
use std::convert::Infallible;
use std::future::Future;
use std::net::IpAddr;
use std::pin::pin;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::Semaphore;
use tokio::time::{interval, sleep, timeout};
use watchers::Watchers;

/// Most HTTP connections; one more drops the most silent one.
const CONNECTIONS: usize = 256;
/// Most sockets before their hello, with the same rule. Sockets that name a known session wait separately,
/// so that strangers cannot push them out.
const CALLERS: usize = 32;
/// Most sockets, waiting and seated: more than both can be, so that the shutdown can wait for all.
const SOCKETS: usize = 512;
const HEAD_TIME: Duration = Duration::from_secs(10);
const SMALL_TIME: Duration = Duration::from_secs(5);
const SMALL_LIMIT: usize = 1024;
const HEAD_LIMIT: usize = 16 * 1024;
const CONNECTION_LIFE: Duration = Duration::from_secs(120);
const GRACE: Duration = Duration::from_secs(10);
const LEASE_CHECK: Duration = Duration::from_millis(250);

/// Shared by all connections.
pub(crate) struct Bridge {
    machine: Arc<dyn Hosted>,
    port: u16,
    names: guard::Names,
    policy: HeaderValue,
    secret: String,
    pairing: Mutex<Pairing>,
    watchers: Mutex<Watchers>,
    connections: Hall,
    callers: Hall,
    known_callers: Hall,
    /// Counts open sockets, so that the shutdown can wait for them.
    sockets: Arc<Semaphore>,
    began: Instant,
}

impl Bridge {
    /// A bridge on `port` in front of `machine`; creates the secret for `annulus link`.
    pub(crate) fn new(machine: Arc<dyn Hosted>, port: u16) -> Result<Arc<Self>, Diagnostic> {
        let policy = guard::policy(port);
        Ok(Arc::new(Self {
            machine,
            port,
            names: guard::Names::new(port),
            policy: HeaderValue::from_str(&policy).unwrap_or(HeaderValue::from_static("default-src 'none'")),
            secret: pairing::secret::<32>()?,
            pairing: Mutex::default(),
            watchers: Mutex::new(Watchers::new()),
            connections: Hall::new(CONNECTIONS),
            callers: Hall::new(CALLERS),
            known_callers: Hall::new(CALLERS),
            sockets: Arc::new(Semaphore::new(SOCKETS)),
            began: Instant::now(),
        }))
    }

    pub(crate) fn note(&self) -> runtime::Note {
        runtime::Note { port: self.port, secret: self.secret.clone() }
    }

    /// A fresh single-use address for a page with the rights of `scope`.
    pub(crate) fn address(&self, scope: Scope) -> Result<String, Diagnostic> {
        let token = self.pairing().token(scope, self.now_ms())?;
        Ok(format!("http://127.0.0.1:{}/#t={token}", self.port))
    }

    fn now_ms(&self) -> u64 {
        u64::try_from(self.began.elapsed().as_millis()).unwrap_or(u64::MAX)
    }

    fn pairing(&self) -> MutexGuard<'_, Pairing> {
        self.pairing.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn watchers(&self) -> MutexGuard<'_, Watchers> {
        self.watchers.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn leave(&self, viewer: Viewer) {
        let mut watchers = self.watchers();
        let outcome = watchers.leave(viewer, self.now_ms());
        self.after_control(&watchers, &outcome);
    }

    fn control(&self, viewer: Viewer, event: LeaseEvent) {
        let mut watchers = self.watchers();
        let outcome = watchers.control(event, self.now_ms());
        self.after_control(&watchers, &outcome);
        drop(watchers);
        if let Some(why) = outcome.refused {
            self.refuse(viewer, why);
        }
    }

    /// After a loss of control, jogs end and queued requests are dropped; a job continues. The caller holds
    /// the lock of the watchers, so that no ticket is issued in between.
    fn after_control(&self, watchers: &Watchers, outcome: &LeaseOutcome) {
        if outcome.changed {
            tracing::info!(holder = watchers.holder(), lost = ?outcome.lost, "control");
            self.machine.control_changed();
        }
    }

    /// A ticket for `viewer`; `None` if it does not have control.
    fn ticket(&self, viewer: Viewer) -> Option<Ticket> {
        let watchers = self.watchers();
        watchers.has_control(viewer).then(|| self.machine.ticket())
    }

    fn tell(&self, viewer: Viewer, tell: &Tell) {
        self.watchers().tell(viewer, tell);
    }

    fn refuse(&self, viewer: Viewer, why: Diagnostic) {
        tracing::warn!(viewer, code = why.code, "ask refused");
        self.tell(viewer, &Tell::Refused { why });
    }

    fn dismiss(&self, viewer: Viewer, why: Diagnostic) {
        self.refuse(viewer, why);
        self.watchers().dismiss(viewer);
    }

    /// Stops at once; any page may do that.
    fn stop(&self, viewer: Viewer) {
        // Before the log: writing it may block.
        self.machine.stop();
        tracing::info!(viewer, "stop");
    }

    /// Waits for the result of a request and reports it to the page. Blocks.
    fn finish(&self, viewer: Viewer, begun: Begun) {
        match begun.finish() {
            Ok(tells) => tells.iter().for_each(|tell| self.tell(viewer, tell)),
            Err(why) => self.refuse(viewer, why),
        }
    }
}

/// Serves until `end`, then stops the machine and closes the pages.
pub(crate) async fn run(bridge: Arc<Bridge>, listeners: Vec<TcpListener>, end: impl Future<Output = ()>) {
    let routes = routes(Arc::clone(&bridge));
    let doors: Vec<_> = listeners
        .into_iter()
        .map(|listener| tokio::spawn(accept(Arc::clone(&bridge), listener, routes.clone())))
        .collect();
    let pump = tokio::spawn(pump(Arc::clone(&bridge)));
    end.await;
    doors.iter().for_each(tokio::task::JoinHandle::abort);
    let machine = Arc::clone(&bridge.machine);
    let _ = tokio::task::spawn_blocking(move || machine.shutdown()).await;
    bridge.watchers().close();
    let all = u32::try_from(SOCKETS).unwrap_or(u32::MAX);
    // All permits are back once every socket has closed.
    let _ = timeout(Duration::from_secs(2), bridge.sockets.acquire_many(all)).await;
    pump.abort();
}

/// Passes the machine's reports to the watchers, and checks for silent pages.
async fn pump(bridge: Arc<Bridge>) {
    let mut tells = bridge.machine.watch();
    let mut check = interval(LEASE_CHECK);
    loop {
        tokio::select! {
            tell = tells.recv() => match tell {
                Some(tell) => bridge.watchers().tell_all(&tell),
                None => return,
            },
            _ = check.tick() => bridge.control(0, LeaseEvent::Tick),
        }
    }
}

async fn accept(bridge: Arc<Bridge>, listener: TcpListener, routes: Router) {
    loop {
        let Ok((stream, peer)) = listener.accept().await else {
            // Usually out of file descriptors; without a pause this would spin.
            sleep(Duration::from_millis(50)).await;
            continue;
        };
        let _ = stream.set_nodelay(true);
        let (bridge, routes) = (Arc::clone(&bridge), routes.clone());
        tokio::spawn(async move {
            let (place, leaves) = bridge.connections.enter();
            tokio::select! {
                _ = leaves => tracing::warn!("too many connections: one that waited is closed"),
                () = connection(&bridge, stream, peer.ip(), routes, &place) => {}
            }
        });
    }
}

/// One connection with limits on everything: head, number of headers, idle time, life. A refusal ends it.
async fn connection(
    bridge: &Arc<Bridge>,
    stream: TcpStream,
    peer: IpAddr,
    routes: Router,
    place: &hall::Place<'_>,
) {
    let routes = TowerToHyperService::new(routes);
    let service = service_fn(move |mut request: hyper::Request<Incoming>| {
        let routes = routes.clone();
        async move {
            let mut response = match guard::check(&bridge.names, &request) {
                Ok(()) => {
                    place.polite();
                    request.extensions_mut().insert(Peer(peer));
                    routes.call(request).await.unwrap_or_else(|never: Infallible| match never {})
                }
                Err(refused) => {
                    tracing::warn!(code = refused.why.code, path = request.uri().path(), "request refused");
                    refused.into_response()
                }
            };
            // A refused client must not keep its connection slot.
            if response.status().is_client_error() || response.status().is_server_error() {
                response.headers_mut().insert(header::CONNECTION, HeaderValue::from_static("close"));
            }
            guard::dress(response.headers_mut(), &bridge.policy);
            Ok::<_, Infallible>(response)
        }
    });
    let mut server = http1::Builder::new();
    server.timer(TokioTimer::new()).header_read_timeout(HEAD_TIME).max_buf_size(HEAD_LIMIT).max_headers(64);
    let mut life = pin!(server.serve_connection(TokioIo::new(stream), service).with_upgrades());
    if timeout(CONNECTION_LIFE, life.as_mut()).await.is_err() {
        life.as_mut().graceful_shutdown();
        let _ = timeout(GRACE, life).await;
    }
}

/// Address of a request's sender.
#[derive(Clone, Copy)]
struct Peer(IpAddr);

fn routes(bridge: Arc<Bridge>) -> Router {
    Router::new()
        .route("/api/pair", post(pair))
        .route("/api/link", post(link))
        .route(guard::SOCKET_PATH, get(socket))
        .route("/api/jobs/{key}", get(jobs::get).put(jobs::put))
        .route("/", get(file))
        .route("/{*path}", get(file))
        .method_not_allowed_fallback(async || {
            Refused::new(StatusCode::METHOD_NOT_ALLOWED, code!("door.method"))
        })
        .with_state(bridge)
}

async fn file(uri: Uri, headers: HeaderMap) -> Response {
    page::answer(uri.path(), &headers)
}

/// `POST /api/pair`: exchanges a token for a session.
async fn pair(State(bridge): State<Arc<Bridge>>, request: Request) -> Result<Response, Refused> {
    let (parts, body) = request.into_parts();
    let bytes = jobs::read_body(body, &parts.headers, SMALL_LIMIT, SMALL_TIME).await?;
    let asked: PairBody = serde_json::from_slice(&bytes)
        .map_err(|_| Refused::new(StatusCode::BAD_REQUEST, code!("door.not_understood")))?;
    let peer = parts.extensions.get::<Peer>().map_or(IpAddr::from([127, 0, 0, 1]), |peer| peer.0);
    let paired = bridge.pairing().pair(&asked.token, peer, bridge.now_ms());
    match paired {
        Ok(paired) => {
            tracing::info!("page paired");
            Ok(json(StatusCode::OK, &json!(paired)))
        }
        Err(Rejection::Token) => {
            tracing::warn!("wrong token");
            Err(Refused::new(StatusCode::UNAUTHORIZED, code!("door.token")))
        }
        Err(Rejection::Wait(seconds)) => {
            tracing::warn!(seconds, "too many wrong tokens");
            let refused =
                Refused::new(StatusCode::TOO_MANY_REQUESTS, code!("door.wait")).with("seconds", seconds);
            let mut response = refused.into_response();
            response.headers_mut().insert(header::RETRY_AFTER, HeaderValue::from(seconds));
            Ok(response)
        }
        Err(Rejection::NoSecret(why)) => Err(Refused { status: StatusCode::INTERNAL_SERVER_ERROR, why }),
    }
}

/// `POST /api/link`: a fresh address for a process that can read this user's note.
async fn link(State(bridge): State<Arc<Bridge>>, request: Request) -> Result<Response, Refused> {
    let (Parts { headers, .. }, body) = request.into_parts();
    let claimed = headers.get(PROOF_HEADER).and_then(|value| value.to_str().ok()).unwrap_or_default();
    let expected = auth::request(&bridge.secret, "POST", "/api/link");
    if !auth::same(expected.as_bytes(), claimed.as_bytes()) {
        return Err(Refused::new(StatusCode::UNAUTHORIZED, code!("door.proof")));
    }
    let bytes = jobs::read_body(body, &headers, SMALL_LIMIT, SMALL_TIME).await?;
    let asked: LinkBody = serde_json::from_slice(&bytes)
        .map_err(|_| Refused::new(StatusCode::BAD_REQUEST, code!("door.not_understood")))?;
    let url = bridge
        .address(asked.scope)
        .map_err(|why| Refused { status: StatusCode::INTERNAL_SERVER_ERROR, why })?;
    tracing::info!(scope = ?asked.scope, "fresh address given");
    Ok(json(StatusCode::OK, &json!({ "ok": true, "url": url })))
}

/// `GET /api/socket[?session=ID]`.
async fn socket(
    State(bridge): State<Arc<Bridge>>,
    uri: Uri,
    upgrade: Result<WebSocketUpgrade, WebSocketUpgradeRejection>,
) -> Result<Response, Refused> {
    let upgrade = upgrade.map_err(|_| Refused::new(StatusCode::BAD_REQUEST, code!("door.no_upgrade")))?;
    let session = uri.query().and_then(|query| query.strip_prefix("session="));
    let known = session.is_some_and(|session| bridge.pairing().session(session).is_some());
    let seat = Arc::clone(&bridge.sockets).try_acquire_owned();
    let seat = seat.map_err(|_| Refused::new(StatusCode::SERVICE_UNAVAILABLE, code!("door.full")))?;
    let upgrade = upgrade
        .max_message_size(socket::TRANSPORT_LIMIT)
        .max_frame_size(socket::TRANSPORT_LIMIT)
        // A frame must leave at once, not when the buffer is full.
        .write_buffer_size(0)
        .max_write_buffer_size(socket::TRANSPORT_LIMIT);
    Ok(upgrade.on_upgrade(async move |socket| {
        socket::serve(bridge, socket, known).await;
        drop(seat);
    }))
}
