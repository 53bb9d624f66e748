//! Tests of ports without an adapter, or with another device: an error before the bridge listens.

use super::client::output;
use super::shop::{machine, write_file};
use annulus_link::bytes::Writer;
use annulus_link::cobs::Unstuffer;
use annulus_link::frame::{FRAME, Header, ON_LINE, open, seal};
use annulus_link::message::{Refused, Tell};
use serialport::{SerialPort, TTYPort};
use std::io::{Read, Write};
use std::os::unix::fs::symlink;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;
use tempfile::TempDir;

/// A device that answers everything with a fixed text.
struct Stranger {
    ends: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
    _theirs: TTYPort,
}

impl Stranger {
    fn at(home: &TempDir, mut answer: impl FnMut(&[u8]) -> Vec<u8> + Send + 'static) -> Self {
        let (mut own, theirs) = TTYPort::pair().unwrap();
        symlink(theirs.name().unwrap(), home.path().join("port")).unwrap();
        own.set_timeout(Duration::from_millis(20)).unwrap();
        let ends = Arc::new(AtomicBool::new(false));
        let over = Arc::clone(&ends);
        let thread = thread::spawn(move || {
            while !over.load(Ordering::SeqCst) {
                let mut bytes = [0; 1024];
                let Ok(count) = own.read(&mut bytes) else { continue };
                let _ = own.write_all(&answer(&bytes[..count]));
            }
        });
        Self { ends, thread: Some(thread), _theirs: theirs }
    }
}

impl Drop for Stranger {
    fn drop(&mut self) {
        self.ends.store(true, Ordering::SeqCst);
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

/// The code of the failed start; checks that the message names the port.
fn refused(home: &TempDir) -> String {
    let port = home.path().join("port");
    let file = home.path().join("drill.toml");
    write_file(&machine(&port), &file);
    let named = file.display().to_string();
    let (code, object, said) =
        output(home, &["serve", "--port", "0", "--no-open", "--machine", &named, "--json"]);
    assert_eq!(code, 3, "{object} {said}");
    let message = object["error"]["message"].as_str().unwrap();
    assert!(message.contains(&port.display().to_string()) && !message.contains('{'), "{message}");
    object["error"]["code"].as_str().unwrap().to_owned()
}

#[test]
fn missing_port_is_refused() {
    assert_eq!(refused(&TempDir::new().unwrap()), "adapter.port_unopened");
}

#[test]
fn silent_port_is_refused() {
    let home = TempDir::new().unwrap();
    let _stranger = Stranger::at(&home, |_| Vec::new());
    assert_eq!(refused(&home), "adapter.no_answer");
}

#[test]
fn port_with_another_firmware_is_refused() {
    let home = TempDir::new().unwrap();
    let _stranger = Stranger::at(&home, |_| b"\r\nGrbl 1.1h ['$' for help]\r\nerror:2\r\n".to_vec());
    assert_eq!(refused(&home), "adapter.another_program");
}

#[test]
fn adapter_of_another_version_is_refused() {
    let home = TempDir::new().unwrap();
    let mut frames = Unstuffer::<FRAME>::new();
    let _stranger = Stranger::at(&home, move |bytes| {
        let mut answer = Vec::new();
        for byte in bytes {
            let Some((header, _)) = frames.take(*byte).and_then(open) else { continue };
            let tell = Tell::from(Refused { oldest: 7, newest: 9 });
            let mut payload = [0; 16];
            let mut out = Writer::new(&mut payload);
            tell.put(&mut out);
            let length = out.end().unwrap();
            let mut line = [0; ON_LINE];
            let header = Header { number: 0, kind: tell.kind(), ..header };
            let length = seal(header, &payload[..length], &mut line).unwrap();
            answer.extend_from_slice(&line[..length]);
        }
        answer
    });
    assert_eq!(refused(&home), "adapter.other_version");
}
