//! The emulated adapter at its port, with a machine at its pins: motors that follow every pulse or pattern,
//! switches that follow the motors, holes.
//!
//! In steps and cycles of the adapter.

use annulus_core::machine::phases;
use serde_json::{Value, json};
use serialport::{SerialPort, TTYPort};
use std::io::{BufRead, BufReader, Read, Write};
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

const TURN: u64 = 60_000;

const STEP_PIN: u64 = 2;
const DIRECTION_PIN: u64 = 6;

#[derive(Clone, Copy)]
pub(crate) struct Wiring {
    stop_pin: u64,
    /// Pins of the switches of X low, Y low, Z top, and of the contact sensor.
    switch_pins: [u64; 4],
    spindle_pin: u64,
    is_phases: bool,
}

pub(crate) const STEPS: Wiring =
    Wiring { stop_pin: 10, switch_pins: [11, 13, 15, 17], spindle_pin: 20, is_phases: false };

/// Windings of motors that step with every eighth of an electrical turn.
pub(crate) const PHASES: Wiring =
    Wiring { stop_pin: 18, switch_pins: [19, 20, 21, 22], spindle_pin: 26, is_phases: true };

/// Carriage position at power-on, in steps from its switches: X and Y next to them, Z below.
const START: [i64; 3] = [90, 70, -120];

#[derive(Clone, Debug)]
pub(crate) struct Record {
    pub(crate) place: [i64; 3],
    pub(crate) steps: [Vec<bool>; 3],
    pub(crate) holes: Vec<[i64; 2]>,
    /// Where the contact closed, and how many steps of Z followed before it opened again.
    pub(crate) touches: Vec<([i64; 3], u64)>,
    pub(crate) spindle: bool,
    pub(crate) latest: u64,
    pub(crate) cycle: u64,
    pub(crate) bytes: u64,
}

impl Record {
    fn new() -> Self {
        let steps = Default::default();
        let (place, holes, touches) = (START, Vec::new(), Vec::new());
        Self { place, steps, holes, touches, spindle: false, latest: 0, cycle: 0, bytes: 0 }
    }
}

/// Returns `true` if the tool touches the board at a position, in steps from the switches.
pub(crate) type Board = fn(&[i64; 3]) -> bool;

enum Do {
    Plug(bool),
    Garble(Option<u64>),
    Stop(bool),
    /// More than this many steps below the switch, the tool is in a hole.
    Bottom(i64),
    Board(Board),
    Touch(u64, u64),
    Power,
}

pub(crate) struct Bench {
    link: PathBuf,
    orders: Option<Sender<Do>>,
    record: Arc<Mutex<Record>>,
    thread: Option<JoinHandle<()>>,
}

impl Bench {
    pub(crate) fn new(link: &Path, wiring: Wiring) -> Self {
        let (orders, ordered) = channel();
        let record = Arc::new(Mutex::new(Record::new()));
        let (own, path) = (Arc::clone(&record), link.to_owned());
        let mut emulator = Emulator::new(wiring);
        let thread = thread::spawn(move || {
            let mut cable = Cable { link: path, ends: None, garble: None, count: 0 };
            cable.plug(true);
            let mut pins = Pins::new(wiring);
            while turn(&ordered, &mut emulator, &mut cable, &mut pins, &own) {}
        });
        let bench = Self { link: link.to_owned(), orders: Some(orders), record, thread: Some(thread) };
        eventually("the port", || bench.link.exists());
        bench
    }

    fn tell(&self, order: Do) {
        self.orders.as_ref().unwrap().send(order).unwrap();
    }

    pub(crate) fn plug(&self, wanted: bool) {
        self.tell(Do::Plug(wanted));
        eventually("the cable", || self.link.exists() == wanted);
    }

    pub(crate) fn garble(&self, every: Option<u64>) {
        self.tell(Do::Garble(every));
    }

    pub(crate) fn press(&self, pressed: bool) {
        self.tell(Do::Stop(!pressed));
    }

    pub(crate) fn new_board(&self) {
        self.seen().holes.clear();
    }

    pub(crate) fn bottom(&self, steps: i64) {
        self.tell(Do::Bottom(steps));
    }

    pub(crate) fn board(&self, board: Board) {
        self.tell(Do::Board(board));
    }

    pub(crate) fn touch(&self, input: u64, length_us: u64) {
        self.tell(Do::Touch(input, 120 * length_us));
    }

    pub(crate) fn power(&self) {
        self.tell(Do::Power);
    }

    fn seen(&self) -> MutexGuard<'_, Record> {
        self.record.lock().unwrap()
    }

    pub(crate) fn record(&self) -> Record {
        self.seen().clone()
    }

    /// Waits until no pulse came for 30 ms of the adapter's time.
    pub(crate) fn rests(&self) -> Record {
        eventually("rest", || {
            let record = self.seen();
            record.cycle > record.latest + 30 * 120_000
        });
        self.record()
    }
}

impl Drop for Bench {
    fn drop(&mut self) {
        self.orders = None;
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

/// Waits until `so` holds; panics after a time limit.
pub(crate) fn eventually(what: &str, mut so: impl FnMut() -> bool) {
    let since = Instant::now();
    while !so() {
        assert!(since.elapsed() < Duration::from_secs(60), "{what}: not within a minute");
        thread::sleep(Duration::from_millis(2));
    }
}

/// The emulated chip; orders and answers are single lines.
struct Emulator {
    node: Child,
    orders: ChildStdin,
    answers: BufReader<ChildStdout>,
    wiring: Wiring,
}

impl Emulator {
    fn new(wiring: Wiring) -> Self {
        let firmware = Path::new(env!("CARGO_MANIFEST_DIR")).join("firmware");
        let program = std::env::var_os("ANNULUS_FIRMWARE").map_or_else(
            || firmware.join("../../target/firmware/thumbv6m-none-eabi/release/annulus-firmware"),
            PathBuf::from,
        );
        assert!(program.exists(), "no firmware at {}: `cargo xtask firmware` builds it", program.display());
        let mut node = Command::new("node")
            .arg(firmware.join("emulator/serve.mjs"))
            .arg(program)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("node is there");
        let orders = node.stdin.take().unwrap();
        let answers = BufReader::new(node.stdout.take().unwrap());
        let mut emulator = Self { node, orders, answers, wiring };
        emulator.order(&json!({"do": "run", "cycles": 4_800_000, "until": "connected"}));
        emulator.order(&json!({"do": "pin", "pin": wiring.stop_pin, "level": true}));
        emulator
    }

    fn switch(&mut self, now: [bool; 4], before: [bool; 4]) {
        for (input, on) in now.into_iter().enumerate().filter(|(input, on)| before[*input] != *on) {
            let pin = self.wiring.switch_pins[input];
            self.order(&json!({"do": "pin", "pin": pin, "level": on}));
        }
    }

    fn order(&mut self, order: &Value) -> Value {
        writeln!(self.orders, "{order}").unwrap();
        let mut line = String::new();
        self.answers.read_line(&mut line).unwrap();
        serde_json::from_str(&line).expect("an answer")
    }
}

impl Drop for Emulator {
    fn drop(&mut self) {
        let _ = self.node.kill();
        let _ = self.node.wait();
    }
}

struct Cable {
    link: PathBuf,
    /// Our end, and the bridge's, held open so that the port survives.
    ends: Option<(TTYPort, TTYPort)>,
    garble: Option<u64>,
    count: u64,
}

impl Cable {
    fn plug(&mut self, wanted: bool) {
        let _ = std::fs::remove_file(&self.link);
        self.ends = None;
        if wanted {
            let (mut own, theirs) = TTYPort::pair().unwrap();
            own.set_timeout(Duration::from_millis(20)).unwrap();
            symlink(theirs.name().unwrap(), &self.link).unwrap();
            self.ends = Some((own, theirs));
        }
    }

    fn spoil(&mut self, bytes: &mut [u8]) {
        let Some(every) = self.garble else { return };
        for byte in bytes {
            self.count += 1;
            if self.count.is_multiple_of(every) {
                *byte ^= 1 << (self.count / every % 8);
            }
        }
    }

    fn read(&mut self) -> Vec<u8> {
        let Some((own, _)) = &mut self.ends else { return Vec::new() };
        let there = own.bytes_to_read().unwrap_or(0) as usize;
        let mut bytes = vec![0; there.min(2048)];
        let read = if there > 0 { own.read(&mut bytes).unwrap_or(0) } else { 0 };
        bytes.truncate(read);
        self.spoil(&mut bytes);
        bytes
    }

    fn write(&mut self, mut bytes: Vec<u8>) {
        self.spoil(&mut bytes);
        if let Some((own, _)) = &mut self.ends {
            let _ = own.write_all(&bytes);
        }
    }
}

struct Pins {
    directions: [bool; 3],
    bottom: i64,
    is_in: bool,
    board: Board,
    switches: [bool; 4],
    wiring: Wiring,
    /// Winding halves that are on, and rotor positions in the electrical turn, in eighths.
    halves: [u8; 3],
    angles: [i64; 3],
}

impl Pins {
    fn new(wiring: Wiring) -> Self {
        // The rotor position for the last column of the table.
        let (directions, halves, angles) = ([false; 3], [0; 3], [6; 3]);
        let (bottom, is_in, board, switches): (_, _, Board, _) = (i64::MIN, false, |_| false, [false; 4]);
        Self { directions, bottom, is_in, board, switches, wiring, halves, angles }
    }

    /// Handles the edges of one cycle: the rotors follow after all of them.
    fn edges(&mut self, record: &mut Record, cycle: u64, edges: &[(u64, bool)]) {
        for (pin, level) in edges {
            self.edge(record, cycle, *pin, *level);
        }
        for axis in 0..3 {
            let Some(now) = phases::angle(self.halves[axis]).map(i64::from) else { continue };
            let turn = phases::turn(self.angles[axis], now);
            assert!(turn.abs() < 2, "axis {axis}: a pattern was left out");
            if turn != 0 {
                self.angles[axis] = now;
                self.step(record, cycle, axis, turn > 0);
            }
        }
    }

    fn step(&mut self, record: &mut Record, cycle: u64, axis: usize, forward: bool) {
        record.place[axis] += if forward { 1 } else { -1 };
        record.steps[axis].push(forward);
        record.latest = cycle;
        let is_in = record.place[2] <= self.bottom;
        if is_in && !self.is_in {
            record.holes.push([record.place[0], record.place[1]]);
        }
        self.is_in = is_in;
        if axis == 2
            && self.switches[3]
            && let Some((_, further)) = record.touches.last_mut()
        {
            *further += 1;
        }
    }

    fn switched(&mut self, record: &mut Record) -> ([bool; 4], [bool; 4]) {
        let place = &record.place;
        let now = [place[0] <= 0, place[1] <= 0, place[2] >= 0, (self.board)(place)];
        let before = std::mem::replace(&mut self.switches, now);
        if now[3] && !before[3] {
            record.touches.push((record.place, 0));
        }
        (now, before)
    }

    fn edge(&mut self, record: &mut Record, cycle: u64, pin: u64, level: bool) {
        if pin == self.wiring.spindle_pin {
            record.spindle = level;
        }
        match pin {
            0..18 if self.wiring.is_phases => {
                let bit = 1 << (pin % 6) & 0b1111;
                let halves = &mut self.halves[(pin / 6) as usize];
                *halves = *halves & !bit | if level { bit } else { 0 };
            }
            _ if self.wiring.is_phases => {}
            DIRECTION_PIN..=8 => self.directions[(pin - DIRECTION_PIN) as usize] = level,
            STEP_PIN..=4 if level => {
                let axis = (pin - STEP_PIN) as usize;
                self.step(record, cycle, axis, self.directions[axis]);
            }
            _ => {}
        }
    }
}

fn turn(
    ordered: &Receiver<Do>,
    emulator: &mut Emulator,
    cable: &mut Cable,
    pins: &mut Pins,
    record: &Mutex<Record>,
) -> bool {
    loop {
        match ordered.try_recv() {
            Ok(Do::Plug(wanted)) => cable.plug(wanted),
            Ok(Do::Garble(every)) => cable.garble = every,
            Ok(Do::Bottom(steps)) => pins.bottom = steps,
            Ok(Do::Board(board)) => pins.board = board,
            Ok(Do::Stop(level)) => {
                emulator.order(&json!({"do": "pin", "pin": pins.wiring.stop_pin, "level": level}));
            }
            Ok(Do::Touch(input, cycles)) => {
                // The inputs follow the emergency stop pin.
                let pin = pins.wiring.stop_pin + 1 + input;
                for (level, then) in [(true, cycles), (false, TURN)] {
                    emulator.order(&json!({"do": "pin", "pin": pin, "level": level}));
                    emulator.order(&json!({"do": "run", "cycles": then}));
                }
            }
            Ok(Do::Power) => {
                *emulator = Emulator::new(pins.wiring);
                let mut record = record.lock().unwrap();
                (record.latest, record.cycle, record.spindle, pins.directions) = (0, 0, false, [false; 3]);
                emulator.switch(pins.switched(&mut record).0, [false; 4]);
            }
            Err(std::sync::mpsc::TryRecvError::Empty) => break,
            Err(std::sync::mpsc::TryRecvError::Disconnected) => return false,
        }
    }
    let bytes = cable.read();
    let count = bytes.len() as u64;
    if count > 0 {
        emulator.order(&json!({"do": "send", "bytes": bytes}));
    }
    let answer = emulator.order(&json!({"do": "run", "cycles": TURN}));
    let numbers = |key: &str| -> Vec<u64> {
        answer[key].as_array().unwrap().iter().filter_map(Value::as_u64).collect()
    };
    cable.write(numbers("bytes").into_iter().map(|byte| byte as u8).collect());
    let mut record = record.lock().unwrap();
    let edges: Vec<_> =
        numbers("edges").chunks(2).map(|pair| (pair[0], pair[1] >> 1, pair[1] & 1 == 1)).collect();
    for together in edges.chunk_by(|one, next| one.0 == next.0) {
        let edges: Vec<_> = together.iter().map(|(_, pin, level)| (*pin, *level)).collect();
        pins.edges(&mut record, together[0].0, &edges);
    }
    record.cycle = answer["cycle"].as_u64().unwrap();
    record.bytes += count;
    let (now, were) = pins.switched(&mut record);
    emulator.switch(now, were);
    true
}
