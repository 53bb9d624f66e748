//! Tests that strangers cannot lock out a known page or its STOP: callers without a key, refused requests,
//! wrong tokens and a full house. Everything runs on 127.0.0.1, in an amount that a small computer can
//! bear.

use super::pause::drilling;
use crate::server::client::{PATIENCE, Page, Reply, Running};
use crate::server::work::until_status;
use annulus_core::control::{Ending, State};
use annulus_core::wire::{Ask, Control, JobEnd, Tell, auth};
use serde_json::json;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};
use tempfile::TempDir;
use tungstenite::Message;

const HELLO_AFTER: Duration = Duration::from_millis(20);

/// 99 of 100 STOPs under attack must be faster than this, on any computer; the times are printed.
const STOP_P99: Duration = Duration::from_millis(500);

/// A known page that returns, as after a reload: its hello is accepted.
fn reloaded(bridge: &Running, session: &str, key: &str) -> Page {
    let socket = bridge.upgrade_of(session);
    let mut page = Page { session: session.to_owned(), key: key.to_owned(), socket };
    let nonce = page.nonce();
    thread::sleep(HELLO_AFTER);
    page.hello(session, &auth::hello(key, &nonce));
    page.until(|tell| matches!(tell, Tell::Welcome { .. }));
    page
}

/// A refused request, on a connection that its sender would keep open.
fn refused(port: u16) -> TcpStream {
    let mut stream = TcpStream::connect(("127.0.0.1", port)).unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    let _ = write!(stream, "GET / HTTP/1.1\r\nhost: evil.example:{port}\r\n\r\n");
    stream
}

fn token(bridge: &Running, token: &str) -> Reply {
    bridge.own("POST", "/api/pair", &[], json!({ "token": token }).to_string().as_bytes())
}

#[test]
fn sockets_without_a_key_do_not_block_a_page() {
    let bridge = Running::start();
    let (session, key) = bridge.pair("run");
    let strangers: Vec<_> = (0..100).map(|_| bridge.upgrade(&[]).unwrap()).collect();
    let mut page = reloaded(&bridge, &session, &key);
    assert!(page.take_control(false));
    drop(strangers);
}

#[test]
fn refused_connections_are_closed_and_idle_ones_make_room() {
    let bridge = Running::start();
    let mut crowd: Vec<TcpStream> = (0..300).map(|_| refused(bridge.port)).collect();
    let idle: Vec<TcpStream> = (0..300).map(|_| bridge.connect()).collect();
    assert_eq!(bridge.raw("GET", "/nothing", &[], b"").status, 404);
    let since = Instant::now();
    for stream in &mut crowd {
        let reply = Reply::read(stream);
        // The server closes the connection at once; an open one would wait for a request for ten seconds.
        let _ = stream.read_to_end(&mut Vec::new());
        // The first of them may have been dropped before it was read.
        assert!(
            reply.status == 0 || (reply.status, reply.header("connection")) == (403, "close"),
            "{reply:?}"
        );
    }
    assert!(since.elapsed() < Duration::from_secs(5), "closed after {:?}", since.elapsed());
    assert_eq!(bridge.raw("GET", "/nothing", &[], b"").status, 404);
    drop(idle);
}

#[test]
fn wrong_tokens_are_slowed_down_and_the_right_one_works() {
    let bridge = Running::start();
    let replies: Vec<_> = (0..50).map(|_| token(&bridge, "guess")).collect();
    assert_eq!(replies[0].status, 401);
    let slowed = replies.iter().filter(|reply| reply.status == 429).count();
    assert!(slowed >= 40, "{slowed} of 50 were told to wait");
    assert_eq!(token(&bridge, &bridge.token).status, 200, "the right one is right all the same");
    assert_eq!(token(&bridge, &bridge.link("view")).status, 200);
}

#[test]
fn reloaded_page_gets_in_when_all_64_seats_are_taken() {
    let bridge = Running::start();
    let (session, key) = bridge.pair("run");
    let mut first = reloaded(&bridge, &session, &key);
    let many: Vec<Page> = {
        let (session, key) = bridge.pair("view");
        (0..63).map(|_| reloaded(&bridge, &session, &key)).collect()
    };
    first.until(|tell| matches!(tell, Tell::Control(Control { viewers: 64, .. })));
    let mut again = reloaded(&bridge, &session, &key);
    assert!(again.take_control(false));
    drop((first, many));
}

#[test]
fn stop_above_the_frame_limit_stops_the_drill() {
    // A page may send 200 frames at once: STOP breaks the limit, or comes after the frame that does.
    for frames in [200, 400] {
        let bridge = Running::start_at(TempDir::new().unwrap(), "5");
        let mut worker = drilling(&bridge, 1_000);
        let mut viewer = bridge.page_that_may("view");
        for _ in 0..frames {
            viewer.socket.write(Message::Ping(Default::default())).unwrap();
        }
        viewer.ask(&Ask::Stop);
        let ended = worker.until_ended();
        assert!(matches!(ended, Tell::Ended(JobEnd { ending: Ending::Stopped, .. })), "{frames}: {ended:?}");
    }
}

/// A repeated attack, and the number of its repetitions.
struct Flood {
    over: Arc<AtomicBool>,
    times: Arc<AtomicUsize>,
    threads: Vec<JoinHandle<()>>,
}

impl Flood {
    fn begin(bridge: &Running) -> Self {
        let (over, times) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicUsize::new(0)));
        let (port, origin) = (bridge.port, bridge.origin());
        let kinds: [Box<dyn FnMut() -> TcpStream + Send>; 4] = [
            // Sockets without a key.
            Box::new({
                let origin = origin.clone();
                move || {
                    let mut stream = TcpStream::connect(("127.0.0.1", port)).unwrap();
                    let _ = write!(
                        stream,
                        "GET /api/socket HTTP/1.1\r\nhost: 127.0.0.1:{port}\r\norigin: {origin}\r\nconnection: upgrade\r\n\
                         upgrade: websocket\r\nsec-websocket-version: 13\r\nsec-websocket-key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n"
                    );
                    stream
                }
            }),
            Box::new(move || refused(port)),
            // Wrong tokens.
            Box::new(move || {
                let mut stream = TcpStream::connect(("127.0.0.1", port)).unwrap();
                let _ = write!(
                    stream,
                    "POST /api/pair HTTP/1.1\r\nhost: 127.0.0.1:{port}\r\norigin: {origin}\r\ncontent-length: 17\r\n\r\n\
                     {{\"token\":\"guess\"}}"
                );
                stream
            }),
            // Silent connections.
            Box::new(move || TcpStream::connect(("127.0.0.1", port)).unwrap()),
        ];
        let threads = kinds.into_iter().map(|mut attack| {
            let (over, times) = (Arc::clone(&over), Arc::clone(&times));
            thread::spawn(move || {
                // Each thread holds 100 connections, and opens the next at once.
                let mut held = std::collections::VecDeque::new();
                while !over.load(Ordering::SeqCst) {
                    held.push_back(attack());
                    if held.len() > 100 {
                        held.pop_front();
                    }
                    times.fetch_add(1, Ordering::SeqCst);
                    thread::sleep(Duration::from_millis(1));
                }
            })
        });
        let threads = threads.collect();
        Self { over, times, threads }
    }

    fn end(self) -> usize {
        self.over.store(true, Ordering::SeqCst);
        self.threads.into_iter().for_each(|thread| thread.join().unwrap());
        self.times.load(Ordering::SeqCst)
    }
}

/// Median, 99th percentile and maximum, in ms.
fn spread(times: &mut [Duration]) -> String {
    times.sort();
    let at = |share: f64| times[((times.len() - 1) as f64 * share).ceil() as usize].as_secs_f64() * 1e3;
    format!("p50 {:.1} ms, p99 {:.1} ms, worst {:.1} ms", at(0.5), at(0.99), at(1.0))
}

#[test]
fn stop_of_a_reloaded_page_works_during_floods() {
    let rounds = if std::env::var_os("ANNULUS_LONG").is_some() { 2_000 } else { 200 };
    let bridge = Running::start();
    let (session, key) = bridge.pair("run");
    let (many, many_key) = bridge.pair("view");
    let crowd: Vec<Page> = (0..63).map(|_| reloaded(&bridge, &many, &many_key)).collect();
    let flood = Flood::begin(&bridge);
    let mut worker = reloaded(&bridge, &session, &key);
    let (mut stops, mut reloads) = (Vec::new(), Vec::new());
    for _ in 0..rounds {
        assert!(worker.take_control(true));
        worker.ask(&Ask::Home);
        until_status(&mut worker, |status| status.state == State::Homing);
        let came = Instant::now();
        let mut page = reloaded(&bridge, &session, &key);
        reloads.push(came.elapsed());
        let pressed = Instant::now();
        page.ask(&Ask::Stop);
        until_status(&mut page, |status| !matches!(status.state, State::Homing));
        stops.push(pressed.elapsed());
        until_status(&mut page, |status| matches!(status.state, State::NotHomed | State::Ready));
        worker = page;
    }
    let attacks = flood.end();
    println!(
        "{rounds} STOPs under {attacks} attacks: {}; to come in again: {}",
        spread(&mut stops),
        spread(&mut reloads)
    );
    let p99 = stops[(stops.len() - 1) * 99 / 100];
    assert!(p99 <= STOP_P99, "99 of 100 STOPs within {p99:?}");
    drop(crowd);
}
