//! The emulated adapter on a cable, with a bridge at the other end.

use crate::card::Shown;
use crate::support::{PULSE, SETUP};
use annulus_core::chance::Chance;
use annulus_link::chunk::stopping;
use annulus_link::cobs::Unstuffer;
use annulus_link::cutter::{ChunkCutter, Piece, Rule};
use annulus_link::frame::{FRAME, ON_LINE, open};
use annulus_link::message::{
    Ask, Begin, Configure, CountTouches, Place, Refusal, State, Status, Tell, Touches, Welcome, Windings,
};
use annulus_link::phases::{MOTORS, tables_crc};
use annulus_link::run::Run;
use annulus_link::sender::Sender;
use annulus_link::{AXES, CYCLES_PER_TICK};
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

pub(crate) const SETTINGS: Configure = Configure {
    pulse: PULSE as u8,
    setup: SETUP as u16,
    limits: 0b1111,
    low_inputs: 0,
    low_steps: 0,
    low_forward: 0,
    phases: 0,
};

pub(crate) const MICRO: u64 = 120;
pub(crate) const MILLI: u64 = 1000 * MICRO;

pub(crate) const STOP_PIN: u8 = 10;
pub(crate) const RUN_PIN: u8 = 19;
pub(crate) const ALIVE_PIN: u8 = 21;
pub(crate) const INPUT_PIN: u8 = 11;
pub(crate) const SPINDLE_PIN: u8 = 20;
const USB_POWER_PIN: u8 = 24;
pub(crate) const PHASES_STOP_PIN: u8 = 18;
pub(crate) const PHASES_INPUT_PIN: u8 = 19;
pub(crate) const PHASES_SPINDLE_PIN: u8 = 26;
const STEP_PIN: u8 = 2;
const DIRECTION_PIN: u8 = 6;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Edge {
    pub(crate) cycle: u64,
    pub(crate) pin: u8,
    pub(crate) level: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Pulse {
    pub(crate) cycle: u64,
    pub(crate) width: u64,
    pub(crate) forward: bool,
}

pub(crate) struct Rig {
    node: Child,
    orders: ChildStdin,
    answers: BufReader<ChildStdout>,
    pub(crate) sender: Sender,
    unstuffer: Unstuffer<FRAME>,
    pub(crate) welcome: Option<Welcome>,
    pub(crate) status: Option<Status>,
    touches: Option<Touches>,
    pub(crate) edges: Vec<Edge>,
    pub(crate) cycle: u64,
    pub(crate) reset: Option<u64>,
    /// Bytes that wait for room in the adapter; the level that drives each pin, 2 if none.
    pub(crate) waiting: u64,
    pub(crate) driven: Vec<u64>,
    connected: bool,
    pub(crate) boots: bool,
    pub(crate) busy: u64,
    /// Most bytes of stack since the reset, at the last request.
    pub(crate) stack: u64,
    /// Number of packets that still arrive; all later ones are lost.
    pub(crate) packets: Option<u64>,
    pub(crate) said: u64,
    /// Flips a bit in one of this many bytes on their way.
    pub(crate) garble: Option<(Chance, usize)>,
}

impl Drop for Rig {
    fn drop(&mut self) {
        let _ = self.node.kill();
        let _ = self.node.wait();
    }
}

impl Rig {
    pub(crate) fn new() -> Self {
        let firmware = Path::new(env!("CARGO_MANIFEST_DIR")).join("../bridge/firmware");
        let program = std::env::var_os("ANNULUS_FIRMWARE").map_or_else(
            || firmware.join("../../target/firmware/thumbv6m-none-eabi/release/annulus-firmware"),
            std::path::PathBuf::from,
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
        let mut rig = Self {
            node,
            orders,
            answers,
            sender: Sender::new(0x1234_5678),
            unstuffer: Unstuffer::new(),
            welcome: None,
            status: None,
            touches: None,
            edges: Vec::new(),
            cycle: 0,
            reset: None,
            waiting: 0,
            driven: Vec::new(),
            connected: false,
            boots: false,
            busy: 0,
            stack: 0,
            packets: None,
            said: 0,
            garble: None,
        };
        rig.connect();
        rig
    }

    /// Waits for USB, and releases the emergency stop.
    pub(crate) fn connect(&mut self) {
        self.order(json!({"do": "run", "cycles": 40 * MILLI, "until": "connected"}));
        assert!(self.connected, "it never came up");
        self.pin(STOP_PIN, true);
        self.order(json!({"do": "run", "cycles": MILLI}));
    }

    fn order(&mut self, order: Value) {
        writeln!(self.orders, "{order}").unwrap();
        let mut line = String::new();
        self.answers.read_line(&mut line).unwrap();
        let answer: Value = serde_json::from_str(&line).expect("an answer");
        let numbers = |key: &str| -> Vec<u64> {
            answer[key].as_array().unwrap().iter().map(|number| number.as_u64().unwrap_or(2)).collect()
        };
        self.cycle = answer["cycle"].as_u64().unwrap();
        self.connected = answer["connected"].as_bool().unwrap();
        self.waiting = answer["waiting"].as_u64().unwrap();
        self.reset = answer["reset"].as_u64();
        self.busy = answer["busy"].as_u64().unwrap();
        self.stack = answer["stack"].as_u64().unwrap_or(self.stack);
        self.boots = answer["boots"].as_bool().unwrap();
        self.driven = numbers("driven");
        for pair in numbers("edges").chunks(2) {
            let edge = Edge { cycle: pair[0], pin: (pair[1] >> 1) as u8, level: pair[1] & 1 == 1 };
            self.edges.push(edge);
        }
        for byte in numbers("bytes") {
            self.hear(byte as u8);
        }
    }

    fn hear(&mut self, byte: u8) {
        let Some((header, payload)) = self.unstuffer.take(byte).and_then(open) else { return };
        if header.session != self.sender.session() {
            return;
        }
        match Tell::take(header.kind, payload) {
            Some((Tell::Welcome(welcome), [])) => self.welcome = Some(welcome),
            Some((Tell::Status(status), [])) => {
                self.sender.hear(&status);
                self.status = Some(status);
            }
            Some((Tell::Touches(touches), [])) => self.touches = Some(touches),
            other => panic!("{other:?}"),
        }
    }

    pub(crate) fn pin(&mut self, pin: u8, level: bool) {
        self.order(json!({"do": "pin", "pin": pin, "level": level}));
    }

    pub(crate) fn look_at_stack(&mut self) {
        self.order(json!({"do": "stack"}));
    }

    pub(crate) fn hang(&mut self) {
        self.order(json!({"do": "hang"}));
    }

    pub(crate) fn unplug(&mut self) {
        self.order(json!({"do": "unplug"}));
    }

    pub(crate) fn touch(&mut self, bits: u32) {
        self.order(json!({"do": "touch", "bits": bits}));
    }

    pub(crate) fn pass(&mut self, cycles: u64) {
        self.order(json!({"do": "run", "cycles": cycles}));
    }

    pub(crate) fn put(&mut self, bytes: &[u8]) {
        let mut bytes = bytes.to_vec();
        if let Some(left) = &mut self.packets {
            // A USB packet has 64 bytes.
            let whole = 64 * usize::try_from(*left).unwrap();
            *left = left.saturating_sub(bytes.len().div_ceil(64) as u64);
            bytes.truncate(whole);
        }
        self.said += bytes.len() as u64;
        if let Some((chance, every)) = &mut self.garble {
            for byte in &mut bytes {
                if chance.below(*every) == 0 {
                    *byte ^= 1 << chance.below(8);
                }
            }
        }
        self.order(json!({"do": "send", "bytes": bytes}));
    }

    /// Sends what is due, and lets cycles pass.
    pub(crate) fn turn(&mut self, cycles: u64) {
        let mut line = [0; ON_LINE];
        let now = self.cycle / MICRO;
        if self.welcome.is_none() {
            let length = self.sender.hello(&mut line).unwrap();
            self.put(&line[..length]);
        }
        while let Some(length) = self.sender.due(now, &mut line) {
            self.put(&line[..length]);
        }
        self.pass(cycles);
    }

    pub(crate) fn until(&mut self, what: &str, done: impl Fn(&Self) -> bool) {
        for _ in 0..4000 {
            if done(self) {
                return;
            }
            self.turn(MILLI / 4);
        }
        panic!("{what}: {:?}", self.status);
    }

    pub(crate) fn state(&self) -> State {
        self.status.map_or(State::Unset, |status| status.state)
    }

    pub(crate) fn say(&mut self, ask: impl Into<Ask>) -> Status {
        let ask = ask.into();
        self.until("no welcome", |rig| rig.welcome.is_some());
        assert!(self.sender.offer(&ask).is_some(), "the window is full");
        self.turn(MILLI / 4);
        self.until("not taken", |rig| rig.sender.pending() == 0);
        self.status.unwrap()
    }

    pub(crate) fn count_touches(&mut self) -> Touches {
        self.touches = None;
        let mut line = [0; ON_LINE];
        let length = self.sender.unnumbered(&CountTouches {}.into(), &mut line).unwrap();
        self.put(&line[..length]);
        self.until("no counts", |rig| rig.touches.is_some());
        self.touches.unwrap()
    }

    pub(crate) fn ready() -> Self {
        let mut rig = Self::new();
        assert_eq!(rig.say(SETTINGS).state, State::Ready);
        rig.say(Place { index: [0; AXES] });
        rig
    }

    pub(crate) fn with_phases(tables: &[Windings; MOTORS]) -> Self {
        let mut rig = Self::new();
        rig.pin(PHASES_STOP_PIN, true);
        rig.pin(USB_POWER_PIN, true);
        for table in tables {
            assert_eq!(rig.say(*table).refusal, Refusal::None);
        }
        rig.drive(tables);
        rig.say(Place { index: [0; AXES] });
        rig
    }

    pub(crate) fn drive(&mut self, tables: &[Windings; MOTORS]) {
        let phases = tables_crc(tables);
        let settings = Configure { pulse: 2, setup: 0, phases, ..SETTINGS };
        assert_eq!(self.say(settings).state, State::Ready);
    }

    pub(crate) fn offer(&mut self, piece: &Piece) -> bool {
        self.sender.offer_chunk(&piece.head, piece.slices()).is_some()
    }

    /// Plays a path with at most `ahead` ticks of it in the adapter. Calls `each` between turns; ends if
    /// that returns `true`, or if the adapter is stopped with nothing left.
    pub(crate) fn play(
        &mut self,
        runs: &[Vec<Run>; AXES],
        ticks: u32,
        rule: &Rule,
        ahead: u32,
        mut each: impl FnMut(&mut Self) -> bool,
    ) {
        let status = self.status.unwrap();
        let lists = runs.each_ref().map(Vec::as_slice);
        let mut cutter = ChunkCutter::new(lists, ticks.into(), status.chunk, status.index);
        let (mut next, mut begun) = (cutter.cut(rule), false);
        for _ in 0..100_000 {
            while self.status.unwrap().resident < ahead && self.sender.pending() < 3 {
                let Some(piece) = &next else { break };
                if !self.offer(piece) {
                    break;
                }
                next = cutter.cut(rule);
            }
            let here = self.status.unwrap().resident;
            let is_enough = here >= ahead.min(rule.ticks + stopping(rule.fall))
                || next.is_none() && self.sender.pending() == 0;
            if !begun && is_enough && here > 0 {
                begun = self.sender.offer(&Begin {}.into()).is_some();
            }
            self.turn(MILLI / 4);
            if each(self) {
                return;
            }
            let status = self.status.unwrap();
            let is_done = status.state == State::Ready && next.is_none() && status.resident == 0;
            if begun
                && self.sender.pending() == 0
                && (is_done || !matches!(status.state, State::Ready | State::Running))
            {
                return;
            }
        }
        panic!("it never ended: {:?}", self.status);
    }

    pub(crate) fn pulses(&self, axis: usize) -> Vec<Pulse> {
        let (step, direction) = (STEP_PIN + axis as u8, DIRECTION_PIN + axis as u8);
        let (mut pulses, mut forward, mut since) = (Vec::new(), false, None);
        for edge in &self.edges {
            if edge.pin == direction {
                forward = edge.level;
            } else if edge.pin == step && edge.level {
                since = Some(edge.cycle);
            } else if edge.pin == step {
                let Some(cycle) = since.take() else { continue };
                pulses.push(Pulse { cycle, width: edge.cycle - cycle, forward });
            }
        }
        pulses
    }

    pub(crate) fn shown(&self) -> [Shown; MOTORS] {
        std::array::from_fn(|axis| {
            let (mut shown, mut pattern): (Shown, u8) = (Vec::new(), 0);
            let first = 6 * axis as u8;
            for edge in self.edges.iter().filter(|edge| (first..first + 6).contains(&edge.pin)) {
                pattern = pattern & !(1 << (edge.pin - first)) | u8::from(edge.level) << (edge.pin - first);
                shown.pop_if(|last| last.0 == edge.cycle);
                shown.push((edge.cycle, pattern));
            }
            shown
        })
    }

    /// Drops the recorded edges, but not the levels of the direction pins.
    pub(crate) fn forget(&mut self) {
        let last = |pin: u8| self.edges.iter().rfind(|edge| edge.pin == pin).copied();
        self.edges = (0..AXES as u8).filter_map(|axis| last(DIRECTION_PIN + axis)).collect();
    }

    pub(crate) fn are_steps_low(&self) -> bool {
        (0..AXES).all(|axis| self.driven[usize::from(STEP_PIN) + axis] == 0)
    }

    /// Checks that the pins followed the path, that every step was counted, and that all axes stopped at
    /// the same moment of it. Returns the number of steps.
    pub(crate) fn is_on_path(&self, runs: &[Vec<Run>; AXES], ticks: u32) -> usize {
        let wanted = crate::support::meant(runs, ticks);
        let made: [Vec<Pulse>; AXES] = std::array::from_fn(|axis| self.pulses(axis));
        let status = self.status.unwrap();
        for axis in 0..AXES {
            let same = made[axis].iter().zip(&wanted[axis]).all(|(made, wanted)| made.forward == wanted.1);
            assert!(same && made[axis].len() <= wanted[axis].len(), "axis {axis} left the path");
            let counted: i32 = made[axis].iter().map(|pulse| if pulse.forward { 1 } else { -1 }).sum();
            assert_eq!(
                status.index[axis], counted,
                "axis {axis}: the adapter counted otherwise than the pins"
            );
        }
        made.iter().map(Vec::len).sum()
    }

    /// Checks that all axes stopped at the same moment of the path.
    pub(crate) fn rests_at_one_moment(&self, runs: &[Vec<Run>; AXES], ticks: u32) {
        let wanted = crate::support::meant(runs, ticks);
        let made: [usize; AXES] = std::array::from_fn(|axis| self.pulses(axis).len());
        let last = (0..AXES)
            .filter_map(|axis| wanted[axis].get(made[axis].wrapping_sub(1)))
            .map(|step| step.0)
            .max();
        let next = (0..AXES).filter_map(|axis| wanted[axis].get(made[axis])).map(|step| step.0).min();
        assert!(last.unwrap_or(0) < next.unwrap_or(u64::MAX), "{last:?} {next:?}");
    }

    /// Checks that every pulse has its exact cycle, relative to a start common to all axes, and its exact
    /// length. Returns the number of pulses.
    pub(crate) fn is_exact(&self, runs: &[Vec<Run>; AXES], ticks: u32) -> usize {
        let wanted = crate::support::meant(runs, ticks);
        let tick = u64::from(CYCLES_PER_TICK);
        let first = (0..AXES).find(|axis| !wanted[*axis].is_empty()).expect("a step");
        let start = self.pulses(first)[0].cycle - wanted[first][0].0 * tick;
        let mut count = 0;
        for axis in 0..AXES {
            let made = self.pulses(axis);
            assert_eq!(made.len(), wanted[axis].len(), "axis {axis}: pulses");
            for (index, (made, wanted)) in made.iter().zip(&wanted[axis]).enumerate() {
                let right = Pulse {
                    cycle: start + wanted.0 * tick,
                    width: u64::from(PULSE) * tick,
                    forward: wanted.1,
                };
                assert_eq!(*made, right, "axis {axis}, step {index}");
            }
            count += made.len();
        }
        count
    }
}
