//! Tests of a spindle on a simulated frequency converter: its faults while the tool is in the board, and
//! the drill's reaction.
//!
//! ```text
//! annulus serve ── bytes ──▶ pty ──▶ this converter: frames of Modbus or Huanyang, a motor with inertia, faults
//! ```

use super::client::{PATIENCE, Page, Running, annulus};
use super::drill;
use super::work::{home, until_status};
use annulus_core::control::{Ending, State, Trust};
use annulus_core::geometry::Point;
use annulus_core::machine::{Machine, Value};
use annulus_core::pins::SpindleState;
use annulus_core::wire::{ArmedJob, Ask, JobEnd, RowVerdict, Tell, program};
use serialport::{SerialPort, TTYPort};
use std::cell::Cell;
use std::io::{Read, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};
use tempfile::TempDir;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Fault {
    None,
    Silence,
    Noise,
    WrongSum,
    Exception,
    Slow,
    Trip(u16),
}

/// The motor's time to reach its speed.
const SPIN_UP: Duration = Duration::from_millis(900);

struct Motor {
    is_huanyang: bool,
    fault: Fault,
    centi_hz: u32,
    runs_since: Option<Instant>,
    stops: u32,
}

impl Motor {
    fn actual(&self) -> u16 {
        let Some(since) = self.runs_since.filter(|_| !matches!(self.fault, Fault::Trip(_))) else { return 0 };
        let share = (since.elapsed().as_secs_f64() / SPIN_UP.as_secs_f64()).min(1.0);
        let slow = if self.fault == Fault::Slow { 0.5 } else { 1.0 };
        (f64::from(self.centi_hz) * share * slow) as u16
    }

    fn run(&mut self, runs: bool) {
        if runs {
            self.runs_since.get_or_insert(Instant::now());
        } else {
            self.runs_since = None;
            self.stops += 1;
        }
    }

    /// Length of the request that starts like this.
    fn length(&self, request: &[u8]) -> usize {
        match request.get(1) {
            Some(3) if self.is_huanyang => 6,
            Some(5) if self.is_huanyang => 7,
            _ => 8,
        }
    }

    fn answer(&mut self, request: &[u8]) -> Vec<u8> {
        let [high, low] = self.actual().to_be_bytes();
        if self.is_huanyang {
            return match request[1..] {
                [3, 1, what, ..] => {
                    self.run(what == 1);
                    vec![request[0], 3, 1, 0x29]
                }
                [5, 2, high, low, ..] => {
                    self.centi_hz = u32::from(u16::from_be_bytes([high, low]));
                    request[..5].to_vec()
                }
                [4, 3, 1, ..] => vec![request[0], 4, 3, 1, high, low],
                _ => panic!("no request of Huanyang: {request:x?}"),
            };
        }
        let trip = if let Fault::Trip(code) = self.fault { code as u8 } else { 0 };
        match request[1..6] {
            [6, 0x20, 0x00, 0, what] => {
                self.run(what == 0x12);
                request[..6].to_vec()
            }
            [6, 0x20, 0x01, high, low] => {
                self.centi_hz = u32::from(u16::from_be_bytes([high, low]));
                request[..6].to_vec()
            }
            [3, 0x21, 0x03, 0, 1] => vec![request[0], 3, 2, high, low],
            [3, 0x21, 0x00, 0, 1] => vec![request[0], 3, 2, 0x01, trip],
            _ => panic!("no request of this family: {request:x?}"),
        }
    }
}

fn sum(bytes: &[u8]) -> [u8; 2] {
    let mut crc = 0xFFFF_u16;
    for byte in bytes {
        crc ^= u16::from(*byte);
        for _ in 0..8 {
            crc = if crc & 1 == 1 { (crc >> 1) ^ 0xA001 } else { crc >> 1 };
        }
    }
    crc.to_le_bytes()
}

struct Converter {
    port: String,
    motor: Arc<Mutex<Motor>>,
    ends: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
    /// Held open, because the port exists only as long as its other end.
    _theirs: TTYPort,
}

impl Converter {
    fn start(is_huanyang: bool) -> Self {
        let (mut own, theirs) = TTYPort::pair().unwrap();
        own.set_timeout(Duration::from_millis(5)).unwrap();
        let mut noise = own.try_clone_native().unwrap();
        let port = theirs.name().unwrap();
        let motor = Motor { is_huanyang, fault: Fault::None, centi_hz: 0, runs_since: None, stops: 0 };
        let (motor, ends) = (Arc::new(Mutex::new(motor)), Arc::new(AtomicBool::new(false)));
        let (shared, over) = (Arc::clone(&motor), Arc::clone(&ends));
        thread::spawn(move || {
            while !over.load(Ordering::SeqCst) {
                let fault = shared.lock().unwrap().fault;
                if fault == Fault::Noise {
                    let _ = noise.write_all(&[0x55; 64]);
                } else {
                    thread::sleep(Duration::from_millis(2));
                }
            }
        });
        let (shared, over) = (Arc::clone(&motor), Arc::clone(&ends));
        let thread = thread::spawn(move || {
            let mut heard = Vec::new();
            while !over.load(Ordering::SeqCst) {
                let mut bytes = [0; 64];
                let count = own.read(&mut bytes).unwrap_or(0);
                heard.extend_from_slice(&bytes[..count]);
                if let Some(answer) = turn(&mut heard, &mut shared.lock().unwrap()) {
                    let _ = own.write_all(&answer);
                }
            }
        });
        Self { port, motor, ends, thread: Some(thread), _theirs: theirs }
    }

    fn motor(&self) -> MutexGuard<'_, Motor> {
        self.motor.lock().unwrap()
    }
}

impl Drop for Converter {
    fn drop(&mut self) {
        self.ends.store(true, Ordering::SeqCst);
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

fn turn(heard: &mut Vec<u8>, motor: &mut Motor) -> Option<Vec<u8>> {
    let length = motor.length(heard);
    if heard.len() < length {
        return None;
    }
    let request: Vec<u8> = heard.drain(..length).collect();
    assert_eq!(request[length - 2..], sum(&request[..length - 2]), "{request:x?}");
    if motor.fault == Fault::Silence {
        return None;
    }
    let mut answer = motor.answer(&request);
    if motor.fault == Fault::Noise {
        return None;
    }
    if motor.fault == Fault::Exception {
        answer = vec![request[0], request[1] | 0x80, 4];
    }
    let mut sum = sum(&answer);
    sum[0] ^= u8::from(motor.fault == Fault::WrongSum);
    answer.extend(sum);
    Some(answer)
}

/// A drill that stays in the board for four seconds, with its spindle at `port`.
fn machine(profile: &str, port: &str) -> Machine {
    let (number, text) = (Value::Number, |text: &str| Value::Text(text.to_owned()));
    let changes = vec![
        ("converter.profile", text(profile)),
        ("converter.port", text(port)),
        ("stroke.surface", number(-8.0)),
        ("spindle.speed", number(20_000.0)),
        ("spindle.spin_up", number(50.0)),
        ("stroke.longest_drilling", number(20.0)),
    ];
    drill::machine(
        changes,
        [("x", 0.0, 60.0), ("y", 0.0, 60.0), ("z", -12.0, 0.0)],
        &[("home_search", number(70.0))],
    )
}

fn bridge(machine: &Machine) -> (Running, Page) {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("mill.toml");
    std::fs::write(&path, drill::file(machine)).unwrap();
    let file = path.display().to_string();
    let command = annulus(&folder, &["serve", "--port", "0", "--no-open", "--machine", &file]);
    let running = Running::of(command, folder);
    let mut page = running.page();
    home(&mut page);
    page.ask(&Ask::SetZero);
    (running, page)
}

/// Waits until `so` holds; panics after a time limit.
fn eventually(what: &str, so: impl Fn() -> bool) {
    let since = Instant::now();
    while !so() {
        assert!(since.elapsed() < PATIENCE, "{what}");
        thread::sleep(Duration::from_millis(5));
    }
}

/// Attempts per hole: a late computer stops it, correctly, and the user starts again.
const ATTEMPTS: usize = 6;

/// Starts one slow hole once the converter answers.
fn start(bridge: &Running, page: &mut Page, machine: &Machine) {
    let at = [Point::from_mm(2.0, 2.0)].into_iter();
    let bytes =
        program::encode(&drill::holes(machine, vec![drill::spin_up(50_000)], (at, 500), drill::back()));
    let job = program::key(&bytes);
    assert_eq!(bridge.job((&page.session, &page.key), "PUT", &job, &bytes).status, 200);
    for left in (0..ATTEMPTS).rev() {
        // Reports of an earlier attempt must not count for this one.
        let mark = left as f64 + 0.5;
        page.ask(&Ask::Ping { stamp: mark });
        page.until(|tell| matches!(tell, Tell::Pong { stamp, .. } if *stamp == mark));
        page.ask(&Ask::Arm { job: job.clone(), from_leg: 0 });
        let armed = page.until(|tell| matches!(tell, Tell::Armed(_) | Tell::Refused { .. }));
        let Tell::Armed(ArmedJob { stream_digest, checks, .. }) = armed else { panic!("{armed:?}") };
        if checks.iter().all(|row| row.verdict != RowVerdict::Fail) {
            return page.ask(&Ask::Start { job, stream_digest, from_leg: 0 });
        }
        assert!(left > 0, "{checks:?}");
        thread::sleep(Duration::from_millis(300));
    }
}

/// Waits until the tool is in the board. Returns `false` on an alarm. Checks that the spindle was at speed
/// first.
fn until_in_the_board(page: &mut Page) -> bool {
    let reached = Cell::new(false);
    let status = until_status(page, |status| {
        reached.set(reached.get() || matches!(status.spindle, SpindleState::AtSpeed { .. }));
        let is_early = status.work_mm[2] <= -0.05 && !reached.get();
        assert!(!is_early, "in the board before its speed: {:?}", status.spindle);
        status.work_mm[2] < -0.4 || status.state == State::Alarm
    });
    status.state != State::Alarm
}

/// Returns `true` for alarms that a late computer causes: no answer in time, or a late one.
fn is_late(code: &Option<String>) -> bool {
    matches!(code.as_deref(), Some("spindle.silent" | "spindle.garbled"))
}

fn acknowledged(page: &mut Page, converter: &Converter) -> Option<String> {
    let alarmed = until_status(page, |status| status.state == State::Alarm);
    assert_eq!(alarmed.trust, Trust::Trusted, "every step is counted");
    until_status(page, |status| status.work_mm[2] > 5.0);
    converter.motor().fault = Fault::None;
    eventually("it is told to stand", || converter.motor().runs_since.is_none());
    page.ask(&Ask::AcknowledgeAlarm);
    until_status(page, |status| status.state == State::Ready);
    alarmed.alarm.map(|why| why.code)
}

/// One hole during which `fault` occurs. Returns the code of the alarm.
fn provoked(bridge: &Running, page: &mut Page, converter: &Converter, fault: Fault) -> Option<String> {
    start(bridge, page, &machine("delta", &converter.port));
    if !until_in_the_board(page) {
        return acknowledged(page, converter);
    }
    assert_eq!(converter.motor().centi_hz, 33_333, "20,000 rpm");
    let (begun, stops) = (Instant::now(), converter.motor().stops);
    converter.motor().fault = fault;
    let deepest = Cell::new(0.0);
    let rising = until_status(page, |status| {
        let rises = status.work_mm[2] > deepest.get() + 0.05;
        deepest.set(status.work_mm[2].min(deepest.get()));
        rises
    });
    println!("{fault:?}: rises after {:?}", begun.elapsed());
    let is_amid = rising.work_mm[2] > -2.1 && deepest.get() > -2.0;
    assert!(is_amid, "not at the end of its stroke: {}", deepest.get());
    let code = acknowledged(page, converter);
    assert!(converter.motor().stops > stops, "it is told to stand");
    code
}

#[test]
fn lost_spindle_lifts_the_tool_and_raises_its_alarm() {
    let converter = Converter::start(false);
    let (bridge, mut page) = bridge(&machine("delta", &converter.port));
    let rows = [
        (Fault::Silence, "spindle.silent"),
        (Fault::Noise, "spindle.garbled"),
        (Fault::WrongSum, "spindle.garbled"),
        (Fault::Exception, "spindle.refused"),
        (Fault::Slow, "spindle.slow"),
        (Fault::Trip(7), "spindle.tripped"),
    ];
    for (fault, code) in rows {
        let codes: Vec<_> = (0..ATTEMPTS)
            .map(|_| provoked(&bridge, &mut page, &converter, fault))
            .take_while(|found| found.as_deref() != Some(code))
            .collect();
        assert!(codes.len() < ATTEMPTS, "{fault:?}: {codes:?}");
        // Earlier alarms may only come from a late computer: no answer in time, or a late one.
        let is_late =
            |code: &Option<String>| matches!(code.as_deref(), Some("spindle.silent" | "spindle.garbled"));
        assert!(codes.iter().all(is_late), "{fault:?}: {codes:?}");
    }
}

#[test]
fn hole_is_drilled_with_huanyang_frames() {
    let converter = Converter::start(true);
    let machine = machine("huanyang", &converter.port);
    let (bridge, mut page) = bridge(&machine);
    for left in (0..ATTEMPTS).rev() {
        start(&bridge, &mut page, &machine);
        let end = page.until(|tell| matches!(tell, Tell::Ended(_)));
        if matches!(end, Tell::Ended(JobEnd { ending: Ending::Done, holes_done: 1, .. })) {
            break;
        }
        let code = acknowledged(&mut page, &converter);
        assert!(left > 0 && is_late(&code), "{end:?} {code:?}");
    }
    assert_eq!(converter.motor().centi_hz, 33_333);
    eventually("it stands", || converter.motor().runs_since.is_none());
}

#[test]
fn invalid_converter_settings_are_refused_at_start() {
    let folder = TempDir::new().unwrap();
    let serve = |machine: &Machine, more: &[&str]| {
        let path = folder.path().join("mill.toml");
        std::fs::write(&path, drill::file(machine)).unwrap();
        let file = path.display().to_string();
        let arguments = ["serve", "--port", "0", "--no-open", "--machine", &file, "--json"];
        super::client::output(&folder, &[&arguments[..], more].concat())
    };
    let (exit, object, _) = serve(&machine("nobody's", "/dev/null"), &[]);
    assert_eq!((exit != 0, &object["error"]["code"]), (true, &"spindle.no_profile".into()), "{object}");
    let (exit, object, _) = serve(&machine("delta", "/dev/null"), &["--time-scale", "5"]);
    assert_eq!((exit != 0, &object["error"]["code"]), (true, &"spindle.in_life".into()), "{object}");
}
