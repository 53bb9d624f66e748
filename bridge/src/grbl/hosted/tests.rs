//! Tests of the thread that owns the port, turn by turn. The port is a pseudo-terminal; the test reads what
//! the controller would hear.

use super::*;
use annulus_core::grbl::{RESET_KEY, ResetOnOpen};
use annulus_core::machine::Value;
use annulus_core::wire::program;
use annulus_host::journal::sealed;
use annulus_host::{File, Files};
use serialport::{SerialPort, TTYPort};
use std::fs;
use std::io::{Read, Write};
use std::os::unix::fs::symlink;
use tempfile::TempDir;

/// Longest wait for a byte.
const PATIENCE: Duration = Duration::from_secs(60);

/// The state of the thread, and both ends of its port.
struct Bench {
    work: Work,
    /// The end of the controller.
    board: TTYPort,
    /// Keeps the other end open.
    end: TTYPort,
    _folder: TempDir,
}

impl Bench {
    fn new(reset: ResetOnOpen) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let mut files = DiskFiles::in_folder(folder.path());
        let settings = [(RESET_KEY.to_owned(), Value::Text(reset.word().to_owned()))];
        files.write(File::ControllerSettings, &sealed(&settings)).unwrap();
        let (board, end) = TTYPort::pair().unwrap();
        let site = Site { port: end.name().unwrap(), baud: Some(115_200), files, named: None, speed: 1.0 };
        let tickets = Arc::<Tickets>::default();
        let port = serial::open(&site.port, 115_200).unwrap();
        let machine = Connection::open(&site, port, &tickets, None).unwrap();
        let (listeners, tried) = (Listeners::default(), Instant::now());
        let work = Work {
            usb: None,
            site,
            tickets,
            listeners,
            machine,
            next: None,
            stops: false,
            tried,
            command: None,
        };
        Self { work, board, end, _folder: folder }
    }

    fn stop(&mut self) {
        self.work.take(Input::Message(Message::Stop));
    }

    /// Loses the port. The next one is not open yet.
    fn pull(&mut self) {
        self.work.machine.lose(&io::ErrorKind::BrokenPipe.into());
        (self.board, self.end) = TTYPort::pair().unwrap();
        self.work.site.port = self.end.name().unwrap();
        self.work.tried = ago(REOPEN_INTERVAL);
    }

    /// Bytes that the controller hears within this time, at most `N`.
    fn hears<const N: usize>(&mut self, within: Duration) -> Vec<u8> {
        self.board.set_timeout(within).unwrap();
        let mut bytes = [0; N];
        let count = self.board.read(&mut bytes).unwrap_or(0);
        bytes[..count].to_vec()
    }
}

fn ago(time: Duration) -> Instant {
    Instant::now().checked_sub(time).unwrap()
}

/// A handle whose thread is the test.
fn host() -> (GrblHost, Receiver<Input>) {
    let (inputs, inbox) = channel();
    let (listeners, tickets, thread) = (Listeners::default(), Arc::default(), Arc::default());
    (GrblHost { inputs, listeners, tickets, thread }, inbox)
}

#[test]
fn stop_is_the_first_byte_after_a_lost_port() {
    let rows: [fn(&mut Bench); 3] = [
        |bench| {
            bench.pull();
            bench.stop();
        },
        // The port is lost before the byte is written.
        |bench| {
            bench.stop();
            bench.pull();
        },
        // The byte is written, but no report shows a machine at rest.
        |bench| {
            bench.stop();
            bench.work.turn();
            bench.pull();
        },
    ];
    for (row, loses) in rows.into_iter().enumerate() {
        let mut bench = Bench::new(ResetOnOpen::Usual);
        loses(&mut bench);
        // Opens the port, then writes.
        bench.work.turn();
        bench.work.turn();
        assert_eq!(bench.hears::<1>(PATIENCE), b"!", "row {row}");
    }
}

#[test]
fn port_that_takes_no_bytes_for_4_s_is_lost() {
    let mut bench = Bench::new(ResetOnOpen::Usual);
    // Another writer fills the port; the other end reads nothing. Byte by byte, because a longer write would
    // wait for room.
    bench.end.set_timeout(Duration::from_millis(500)).unwrap();
    while matches!(bench.end.write(b" "), Ok(1)) {}
    bench.stop();
    bench.work.turn();
    assert!(bench.work.machine.port.is_some(), "full for a moment only");
    *bench.work.machine.full.as_mut().unwrap() = ago(FULL);
    bench.work.turn();
    let machine = &bench.work.machine;
    let alarm = machine.station.alarm().map(|why| why.code.as_str());
    assert_eq!((machine.port.is_none(), alarm), (true, Some("grbl.cable_pulled")));
}

#[test]
fn ended_bridge_leaves_a_never_identified_controller_running() {
    let mut bench = Bench::new(ResetOnOpen::Never);
    let report = b"<Run|MPos:0.000,0.000,0.000|FS:500,0>\r\n";
    bench.work.machine.station.bytes(report.to_vec());
    bench.work.rest();
    let heard = bench.hears::<64>(Duration::from_millis(200));
    assert!(heard.iter().all(|byte| *byte == b'?'), "{heard:?}");
}

#[test]
fn jog_older_than_a_second_is_refused() {
    let (host, inbox) = host();
    for ask in [Ask::Jog { axis: 0, distance_um: 1, anyway: false }, Ask::JogOn] {
        drop(host.begin(ask, None));
        assert!(matches!(inbox.recv(), Ok(Input::Jog(..))));
    }
    let mut bench = Bench::new(ResetOnOpen::Usual);
    // The first one is new on a slow computer, too.
    let rows = [(clock::now() + PATIENCE, None), (clock::now() - 2 * STALE, Some("grbl.not_now"))];
    for (asked, code) in rows {
        let (reply, answer) = channel();
        bench.work.take(Input::Jog(asked, Message::Ask { ask: Ask::JogOn, ticket: None, reply }));
        let refused = answer.recv().unwrap().err().map(|why| why.code);
        assert_eq!(refused.as_deref(), code);
    }
}

#[test]
fn upload_is_checked_without_the_thread() {
    let (host, inbox) = host();
    drop(inbox);
    let junk = b"not a program";
    let key = program::key(junk);
    for (key, code) in [("abc", "control.wrong_key"), (key.as_str(), "program.not_one")] {
        assert_eq!(host.upload(key, junk).unwrap_err().code, code);
    }
}

#[test]
fn usb_id_is_found_by_the_name_of_a_port_and_by_links() {
    let folder = tempfile::tempdir().unwrap();
    let root = fs::canonicalize(folder.path()).unwrap();
    let at = |name: &str| root.join(name).display().to_string();
    for name in ["ttyS0", "ttyUSB0", "ttyUSB1"] {
        fs::write(at(name), "").unwrap();
    }
    symlink(at("ttyUSB1"), at("by-id")).unwrap();
    symlink(at("ttyS0"), at("by-path")).unwrap();
    let (ch340, uno) = (Some((0x1a86, 0x7523)), Some((0x2341, 0x0043)));
    let listed = |name: &str, usb| Listed { name: at(name), what: String::new(), usb };
    let ports = [listed("ttyUSB0", ch340), listed("ttyUSB1", uno), listed("ttyS0", None)];
    let rows = [
        ("ttyUSB0", ch340),
        ("ttyUSB1", uno),
        ("by-id", uno),
        ("ttyS0", None),
        ("by-path", None),
        ("unplugged", None),
    ];
    for (name, usb) in rows {
        assert_eq!(usb_at(&at(name), &ports), usb, "{name}");
    }
}

#[test]
fn lost_port_is_opened_again_only_with_its_usb_id() {
    let mut bench = Bench::new(ResetOnOpen::Usual);
    bench.pull();
    // A pseudo-terminal has no USB ID.
    for (usb, is_opened) in [(Some((0x1a86, 0x7523)), false), (None, true)] {
        bench.work.usb = usb;
        assert_eq!(bench.work.open_again().is_some(), is_opened, "{usb:?}");
    }
}
