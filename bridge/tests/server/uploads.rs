//! Tests of programs in and out.

use super::client::{Reply, Running};
use annulus_core::geometry::Point;
use annulus_core::job::Program;
use annulus_core::units::Length;
use annulus_core::wire::{PROGRAM_LIMIT, auth, program};
use std::io::Write;

fn example() -> Vec<u8> {
    program::encode(&Program {
        name: "nothing to drill".into(),
        machine: "00".into(),
        origin: Point::default(),
        bits: vec![],
        spindles: 1,
        safe_height: Length::from_um(2000),
        legs: vec![],
        accepted: vec![],
    })
}

struct Paired {
    bridge: Running,
    session: String,
    key: String,
}

impl Paired {
    fn new() -> Self {
        let bridge = Running::start();
        let (session, key) = bridge.pair("run");
        Self { bridge, session, key }
    }

    fn job(&self, method: &str, name: &str, body: &[u8]) -> Reply {
        self.bridge.job((&self.session, &self.key), method, name, body)
    }
}

#[test]
fn page_with_jog_scope_cannot_upload() {
    let bridge = Running::start();
    let (session, key) = bridge.pair("jog");
    let page = Paired { bridge, session, key };
    let bytes = example();
    let reply = page.job("PUT", &program::key(&bytes), &bytes);
    assert_eq!((reply.status, reply.code().as_str()), (403, "control.scope"));
    assert_eq!(page.job("GET", &program::key(&bytes), b"").code(), "upload.no_such_job");
}

#[test]
fn uploaded_program_is_downloaded_unchanged() {
    let page = Paired::new();
    let bytes = example();
    let key = program::key(&bytes);
    assert_eq!(page.job("GET", &key, b"").code(), "upload.no_such_job");
    let reply = page.job("PUT", &key, &bytes);
    assert_eq!(reply.status, 200, "{}", reply.text());
    assert_eq!(reply.json()["job"], key);
    let reply = page.job("GET", &key, b"");
    assert_eq!((reply.status, reply.body), (200, bytes));
}

#[test]
fn invalid_uploads_are_refused_and_not_stored() {
    let page = Paired::new();
    let bytes = example();
    let key = program::key(&bytes);
    let junk = b"not a program".as_slice();
    let rows: [(&str, &[u8], u16, &str); 5] = [
        (&key, &bytes[1..], 422, "upload.other_hash"),
        (&auth::sha256(junk), junk, 422, "program.not_one"),
        ("abc", &bytes, 400, "upload.key"),
        ("..%2f..%2fetc%2fpasswd", &bytes, 400, "upload.key"),
        (&key.to_uppercase(), &bytes, 400, "upload.key"),
    ];
    for (name, body, status, code) in rows {
        let reply = page.job("PUT", name, body);
        assert_eq!((reply.status, reply.code().as_str()), (status, code), "{name}");
    }
    assert_eq!(page.job("GET", &key, b"").status, 404);
}

#[test]
fn uploads_and_downloads_need_session_and_proof() {
    let page = Paired::new();
    let bytes = example();
    let path = format!("/api/jobs/{}", program::key(&bytes));
    let (session, proof) = (page.session.as_str(), auth::request(&page.key, "PUT", &path));
    let other_method = auth::request(&page.key, "GET", &path);
    let other_path = auth::request(&page.key, "PUT", "/api/jobs/0");
    let rows = [
        ("", "", "door.session"),
        ("0123", proof.as_str(), "door.session"),
        (session, "", "door.proof"),
        (session, "00", "door.proof"),
        (session, &other_method, "door.proof"),
        (session, &other_path, "door.proof"),
    ];
    for (session, proof, code) in rows {
        let headers = [("x-annulus-session", session), ("x-annulus-proof", proof)];
        let reply = page.bridge.own("PUT", &path, &headers, &bytes);
        assert_eq!((reply.status, reply.code().as_str()), (401, code), "{session} {proof}");
        assert_eq!(
            page.bridge.own("GET", &path, &headers, b"").status,
            if proof == other_method { 404 } else { 401 }
        );
    }
}

#[test]
fn oversized_programs_are_refused() {
    let page = Paired::new();
    let path = format!("/api/jobs/{}", "0".repeat(64));
    let proof = auth::request(&page.key, "PUT", &path);
    let head = format!(
        "PUT {path} HTTP/1.1\r\nhost: 127.0.0.1:{}\r\norigin: {}\r\nconnection: close\r\nx-annulus-session: {}\r\n\
         x-annulus-proof: {proof}\r\n",
        page.bridge.port,
        page.bridge.origin(),
        page.session
    );
    let mut announced = page.bridge.connect();
    write!(announced, "{head}content-length: {}\r\n\r\n", PROGRAM_LIMIT + 1).unwrap();
    let reply = Reply::read(&mut announced);
    assert_eq!((reply.status, reply.code().as_str()), (413, "door.too_large"));

    let mut unannounced = page.bridge.connect();
    write!(unannounced, "{head}transfer-encoding: chunked\r\n\r\n{:x}\r\n", PROGRAM_LIMIT + 1).unwrap();
    unannounced.write_all(&vec![0; PROGRAM_LIMIT + 1]).unwrap();
    let reply = Reply::read(&mut unannounced);
    assert_eq!((reply.status, reply.code().as_str()), (413, "door.too_large"));
}
