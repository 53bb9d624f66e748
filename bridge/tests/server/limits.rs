//! Tests of clients that waste resources: incomplete requests, endless ones, too many.

use super::client::{Reply, Running};
use std::io::Write;
use std::net::TcpStream;

#[test]
fn incomplete_requests_time_out() {
    let bridge = Running::start();
    let mut head = bridge.connect();
    head.write_all(b"GET / HTTP/1.1\r\nhost: 127").unwrap();
    let mut body = bridge.connect();
    let (port, origin) = (bridge.port, bridge.origin());
    write!(body, "POST /api/pair HTTP/1.1\r\nhost: 127.0.0.1:{port}\r\norigin: {origin}\r\ncontent-length: 40\r\n\r\n{{")
        .unwrap();
    let mut idle = bridge.connect();
    let reply = Reply::read(&mut body);
    assert_eq!((reply.status, reply.code().as_str()), (408, "door.too_slow"));
    assert!(matches!(Reply::read(&mut head).status, 0 | 408));
    assert_eq!(Reply::read(&mut idle).status, 0);
}

#[test]
fn request_heads_are_limited() {
    let bridge = Running::start();
    let long = "x".repeat(40_000);
    assert!(matches!(bridge.raw("GET", "/", &[("x-long", &long)], b"").status, 0 | 431));
    let many: Vec<_> = (0..200).map(|_| ("x-one", "1")).collect();
    assert!(matches!(bridge.raw("GET", "/", &many, b"").status, 0 | 431));
    assert!(matches!(bridge.raw("GET", &format!("/{long}"), &[], b"").status, 0 | 414 | 431));
    let mut nonsense = bridge.connect();
    nonsense.write_all(b"\x16\x03\x01 this is not HTTP\r\n\r\n").unwrap();
    assert!(matches!(Reply::read(&mut nonsense).status, 0 | 400));
    assert_eq!(bridge.raw("GET", "/nothing", &[], b"").status, 404);
}

#[test]
fn idle_connections_make_room_for_new_clients() {
    let bridge = Running::start();
    let mut page = bridge.page();
    let mut crowd: Vec<TcpStream> = (0..400).map(|_| bridge.connect()).collect();
    // A new client gets in; a silent one is dropped for it.
    assert_eq!(bridge.raw("GET", "/nothing", &[], b"").status, 404);
    assert!(page.take_control(false), "a page that is in stays in");
    assert_eq!(Reply::read(&mut crowd[0]).status, 0, "the first of the crowd was closed");
}
