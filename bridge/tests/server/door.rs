//! Tests of the access checks: names, origins, tokens.

use super::client::Running;
use annulus_core::wire::{Ask, auth};
use serde_json::json;

#[test]
fn only_loopback_host_names_are_answered() {
    let bridge = Running::start();
    let port = bridge.port;
    let rows = [
        (format!("127.0.0.1:{port}"), true),
        (format!("localhost:{port}"), true),
        (format!("[::1]:{port}"), true),
        ("127.0.0.1".to_owned(), false),
        (format!("evil.example:{port}"), false),
        (format!("0.0.0.0:{port}"), false),
        (format!("[::ffff:127.0.0.1]:{port}"), false),
        (format!("[0:0:0:0:0:0:0:1]:{port}"), false),
        (format!("127.0.0.1:{port}.evil.example"), false),
        (format!("127.1:{port}"), false),
    ];
    for (host, good) in rows {
        let reply = bridge.raw("GET", "/api/nothing", &[("host", &host)], b"");
        let expected = if good { (404, "door.nothing_here") } else { (403, "door.host") };
        assert_eq!((reply.status, reply.code().as_str()), expected, "{host}");
    }
    let reply = bridge.raw("GET", "http://evil.example/", &[], b"");
    assert_eq!((reply.status, reply.code().as_str()), (403, "door.host"));
}

#[test]
fn only_loopback_addresses_listen() {
    let bridge = Running::start();
    let has_six = std::net::TcpListener::bind("[::1]:0").is_ok();
    assert_eq!(std::net::TcpStream::connect(("::1", bridge.port)).is_ok(), has_six);
    let sockets = [("/proc/net/tcp", "0100007F"), ("/proc/net/tcp6", "00000000000000000000000001000000")];
    let ours = format!(":{:04X}", bridge.port);
    for (table, loopback) in sockets {
        let Ok(text) = std::fs::read_to_string(table) else { continue };
        let listening = text.lines().filter_map(|line| {
            let mut words = line.split_whitespace().skip(1);
            let (local, _, state) = (words.next()?, words.next()?, words.next()?);
            (state == "0A").then(|| local.strip_suffix(ours.as_str())).flatten()
        });
        listening.for_each(|address| assert_eq!(address, loopback, "{table}"));
    }
}

#[test]
fn foreign_origins_are_refused() {
    let bridge = Running::start();
    let other_port = format!("http://127.0.0.1:{}", bridge.port ^ 1);
    let secure = format!("https://127.0.0.1:{}", bridge.port);
    for origin in ["", "null", "https://evil.example", "http://localhost", &other_port, &secure] {
        assert_eq!(bridge.upgrade(&[("origin", origin)]).err(), Some(403), "upgrade with origin {origin:?}");
        let headers: &[(&str, &str)] = if origin.is_empty() { &[] } else { &[("origin", origin)] };
        for (method, path) in
            [("POST", "/api/pair"), ("POST", "/api/link"), ("PUT", "/api/jobs/0"), ("OPTIONS", "/")]
        {
            let reply = bridge.raw(method, path, headers, b"{}");
            assert_eq!(
                (reply.status, reply.code().as_str()),
                (403, "door.origin"),
                "{method} {path} {origin:?}"
            );
            assert!(!reply.headers.iter().any(|(name, _)| name.starts_with("access-control-")));
        }
    }
    for (name, value) in [("origin", "localhost"), ("origin", "[::1]")] {
        let own = format!("http://{value}:{}", bridge.port);
        assert!(bridge.upgrade(&[(name, &own)]).is_ok(), "{own}");
    }
    for site in ["cross-site", "same-site"] {
        let reply = bridge.own("POST", "/api/pair", &[("sec-fetch-site", site)], b"{}");
        assert_eq!((reply.status, reply.code().as_str()), (403, "door.cross_site"));
        assert_eq!(bridge.upgrade(&[("sec-fetch-site", site)]).err(), Some(403));
    }
}

#[test]
fn token_pairs_only_once() {
    let bridge = Running::start();
    let pair =
        |token: &str| bridge.own("POST", "/api/pair", &[], json!({ "token": token }).to_string().as_bytes());
    let reply = pair("00000000000000000000000000000000");
    assert_eq!((reply.status, reply.code().as_str()), (401, "door.token"));
    let reply = pair(&bridge.token);
    assert_eq!(reply.status, 200, "{}", reply.text());
    assert_eq!(reply.header("cache-control"), "no-store");
    assert_eq!(reply.json()["key"].as_str().unwrap().len(), 64);
    let reply = pair(&bridge.token);
    assert_eq!((reply.status, reply.code().as_str()), (401, "door.token"));
}

#[test]
fn guessing_tokens_is_slowed_down() {
    let bridge = Running::start();
    let guess = || bridge.own("POST", "/api/pair", &[], br#"{"token":"guess"}"#);
    let replies: Vec<_> = (0..8).map(|_| guess()).collect();
    assert_eq!(replies[0].status, 401);
    let slowed = replies.iter().find(|reply| reply.status == 429).expect("slowed down");
    assert_eq!(slowed.code(), "door.wait");
    assert!(slowed.header("retry-after").parse::<u64>().unwrap() >= 1);
}

#[test]
fn malformed_pairing_requests_are_refused() {
    let bridge = Running::start();
    let rows: [(&[u8], u16, &str); 5] = [
        (b"", 400, "door.not_understood"),
        (b"{", 400, "door.not_understood"),
        (b"{\"token\":7}", 400, "door.not_understood"),
        (b"{\"token\":\"a\",\"path\":\"/etc\"}", 400, "door.not_understood"),
        (&[b' '; 2000], 413, "door.too_large"),
    ];
    for (body, status, code) in rows {
        let reply = bridge.own("POST", "/api/pair", &[], body);
        assert_eq!((reply.status, reply.code().as_str()), (status, code));
    }
    for (method, path) in
        [("DELETE", "/api/pair"), ("GET", "/api/link"), ("POST", "/"), ("PATCH", "/api/jobs/0")]
    {
        let reply = bridge.own(method, path, &[], b"");
        assert_eq!((reply.status, reply.code().as_str()), (405, "door.method"), "{method} {path}");
    }
    let reply = bridge.own("GET", "/api/socket", &[], b"");
    assert_eq!((reply.status, reply.code().as_str()), (400, "door.no_upgrade"));
    let reply = bridge.own("POST", "/api/link", &[("x-annulus-proof", "00")], b"");
    assert_eq!((reply.status, reply.code().as_str()), (401, "door.proof"));
}

#[test]
fn every_response_has_the_security_headers() {
    let bridge = Running::start();
    let port = bridge.port;
    let policy = format!(
        "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self'; img-src 'self' data: blob:; \
         connect-src 'self' ws://127.0.0.1:{port} ws://localhost:{port}; worker-src 'self'; \
         manifest-src 'self'; frame-ancestors 'none'; base-uri 'none'; form-action 'none'; \
         require-trusted-types-for 'script'; trusted-types annulus"
    );
    let replies = [
        bridge.raw("GET", "/", &[], b""),
        bridge.raw("GET", "/nothing.js", &[], b""),
        bridge.raw("GET", "/", &[("host", "evil.example")], b""),
        bridge.own("POST", "/api/pair", &[], b"{}"),
    ];
    let rows = [
        ("content-security-policy", policy.as_str()),
        ("cross-origin-opener-policy", "same-origin"),
        ("cross-origin-embedder-policy", "require-corp"),
        ("cross-origin-resource-policy", "same-origin"),
        ("x-content-type-options", "nosniff"),
        ("referrer-policy", "no-referrer"),
        ("permissions-policy", "serial=(self), usb=()"),
    ];
    for reply in &replies {
        for (name, value) in rows {
            assert_eq!(reply.header(name), value, "{name} at status {}", reply.status);
        }
        assert_eq!(reply.header("access-control-allow-origin"), "");
    }
}

#[test]
fn socket_requires_a_valid_hello_first() {
    let bridge = Running::start();
    let (session, key) = bridge.pair("run");
    let connect = || bridge.stranger();

    let mut silent = connect();
    silent.nonce();
    assert_eq!(silent.last_words(), ["socket.late"]);

    let rows = [
        (r#"{"t":"stop"}"#, "socket.first_frame"),
        (r#"{"t":"home"}"#, "socket.first_frame"),
        ("nonsense", "socket.malformed"),
        (r#"{"t":"hello"}"#, "socket.unknown"),
        (r#"{"t":"hello","proto":9,"min":9,"app":"","session":"","proof":""}"#, "socket.other_version"),
        (r#"{"t":"hello","proto":0,"min":0,"app":"","session":"","proof":""}"#, "socket.other_version"),
        (r#"{"t":"hello","proto":1,"min":1,"app":"","session":"","proof":""}"#, "socket.session"),
    ];
    for (frame, code) in rows {
        let mut page = connect();
        page.nonce();
        page.say(frame);
        assert_eq!(page.last_words(), [code], "{frame}");
    }

    let mut good = connect();
    let nonce = good.nonce();
    let proof = auth::hello(&key, &nonce);
    good.hello(&session, &proof);
    good.until(|tell| matches!(tell, annulus_core::wire::Tell::Welcome { .. }));
    good.hello(&session, &proof);
    assert_eq!(good.refusal(), "socket.hello_again");

    let mut replayed = connect();
    assert_ne!(replayed.nonce(), nonce);
    replayed.hello(&session, &proof);
    assert_eq!(replayed.last_words(), ["socket.proof"]);

    let mut other_key = connect();
    let nonce = other_key.nonce();
    other_key.hello(&session, &auth::hello(&"00".repeat(32), &nonce));
    assert_eq!(other_key.last_words(), ["socket.proof"]);
}

#[test]
fn session_ends_with_its_bridge() {
    let mut bridge = Running::start();
    let (session, key) = bridge.pair("run");
    let home = bridge.home.take().unwrap();
    drop(bridge);
    let bridge = Running::start_in(home);
    let mut page = bridge.stranger();
    let nonce = page.nonce();
    page.hello(&session, &auth::hello(&key, &nonce));
    page.ask(&Ask::Stop);
    assert_eq!(page.last_words(), ["socket.session"]);
}
