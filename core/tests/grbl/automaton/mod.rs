//! A simulated GRBL controller for the tests: receive buffer, parser, planner and real-time characters, in
//! simulated milliseconds. Independent of the engine, and simpler than the firmware: moves begin and end at
//! rest, arcs are approximated by their chords.

mod gcode;
mod lines;

use std::collections::{BTreeSet, VecDeque};

const RX: usize = 128;
const BLOCKS: usize = 15;
const RAPID_MM: f64 = 0.1;

#[derive(Clone, Copy, PartialEq, Debug)]
enum Lock {
    None,
    Alarm,
}

struct Block {
    to: [f64; 3],
    per_ms: f64,
    probes: bool,
    /// The block is a jog: only jogs are ended by a jog cancel.
    by_hand: bool,
}

#[derive(Clone)]
struct Modal {
    relative: bool,
    motion: u32,
    feed: f64,
    speed: f64,
    spindle: u32,
    zero: usize,
    inches: bool,
}

impl Default for Modal {
    fn default() -> Self {
        Self { relative: false, motion: 0, feed: 0.0, speed: 0.0, spindle: 5, zero: 0, inches: false }
    }
}

#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum Counts {
    Down,
    Up,
    FromThere,
}

pub(super) struct Automaton {
    rx: VecDeque<u8>,
    line: Vec<u8>,
    out: Vec<u8>,
    queue: VecDeque<Block>,
    pub(super) at: [f64; 3],
    planned: [f64; 3],
    pub(super) zeros: [[f64; 3]; 6],
    modal: Modal,
    /// Reported reason for a hold: a feed hold, or an action of the user at the machine.
    pub(super) held: Option<&'static str>,
    goes_on: bool,
    /// A hold came since the last check. A cycle start in the same check is then ignored, as in the
    /// firmware.
    hold_heard: bool,
    lock: Lock,
    check: bool,
    dwell_ms: f64,
    /// A line that waits for room in the planner, or until the planner is empty.
    pending: Option<Vec<u8>>,
    pub(super) counts: Counts,
    pub(super) homes: [bool; 3],
    /// Physical position of machine zero. Changes if the controller forgets its position.
    pub(super) origin: [f64; 3],
    pub(super) overrun: u32,
    /// Physical positions of the tool after each millisecond of a move and at its end, with or without
    /// contact with the board.
    pub(super) cuts: Vec<[f64; 3]>,
    asked: bool,
    pub(super) settings: Vec<(u16, f64)>,
    /// Physical height of the board at a physical place, for the probe.
    pub(super) surface: Option<fn(f64, f64) -> f64>,
    /// Time for which the machine moves on after the probe's contact, in ms: the firmware executes the
    /// steps it has already prepared.
    pub(super) coast_ms: u32,
    coasts: u32,
    latched: [f64; 3],
    probing: Option<bool>,
    /// A probe without contact is an alarm (G38.2).
    must_meet: bool,
    probed: String,
    pub(super) tool_mm: f64,
    pub(super) refuses_jogs: bool,
    /// A cancelled jog leaves it deaf to lines, reporting Idle, until a resume: GRBL 1.1h does so if the cancel
    /// arrives just as the jog ends.
    pub(super) deaf_after_cancel: bool,
    pub(super) checks: bool,
    pub(super) has_mist: bool,
    /// Feed, rapid and spindle override in percent. `pressed` holds characters that were received but not
    /// yet processed: two of the same kind count as one.
    pub(super) overrides: [u16; 3],
    pressed: BTreeSet<u8>,
    since_pressed: u32,
    told_overrides: [u16; 3],
    reports: u32,
    /// The probe's wires have a short. `hides_pins`: reports contain no pin states.
    pub(super) shorted: bool,
    pub(super) hides_pins: bool,
    /// Waits for a reset and accepts nothing else, as after a limit switch. `reports_waiting`: status
    /// reports are still sent.
    waits_for_reset: bool,
    pub(super) reports_waiting: bool,
    /// Sends its work offset only in some reports, as the firmware does; `zero_due` counts the reports
    /// until then.
    pub(super) rarely_tells_zero: bool,
    zero_due: u32,
    /// Changes tools by itself. `rack` gives each tool's length by number, `fetched` the numbers of all
    /// fetched tools, `fetched_turning` whether the spindle was on.
    pub(super) rack: Option<fn(u32) -> f64>,
    pub(super) fetched: Vec<u32>,
    pub(super) fetched_turning: bool,
    tool: u32,
    /// Tool length offset (G43 H) and coordinate shift (G92).
    pub(super) length: f64,
    pub(super) shift: [f64; 3],
}

impl Automaton {
    pub(super) fn new(at: [f64; 3]) -> Self {
        let mut settings = vec![(11, 0.01), (12, 0.002), (22, 1.0), (32, 0.0), (13, 0.0), (30, 20_000.0)];
        for axis in 0..3 {
            settings.extend([
                (100 + axis, 100.0),
                (110 + axis, 6000.0),
                (120 + axis, 1_000_000.0),
                (130 + axis, 300.0),
            ]);
        }
        let mut new = Self {
            rx: VecDeque::new(),
            line: Vec::new(),
            out: Vec::new(),
            queue: VecDeque::new(),
            at: [0.0; 3],
            planned: [0.0; 3],
            zeros: [[0.0; 3]; 6],
            modal: Modal::default(),
            held: None,
            goes_on: false,
            hold_heard: false,
            lock: Lock::Alarm,
            check: false,
            dwell_ms: 0.0,
            pending: None,
            counts: Counts::Down,
            homes: [true; 3],
            origin: at,
            overrun: 0,
            cuts: Vec::new(),
            asked: false,
            settings,
            surface: None,
            coast_ms: 0,
            coasts: 0,
            latched: [0.0; 3],
            probing: None,
            must_meet: false,
            probed: "[PRB:0.000,0.000,0.000:0]".to_owned(),
            tool_mm: 0.0,
            refuses_jogs: false,
            deaf_after_cancel: false,
            checks: true,
            has_mist: true,
            overrides: [100; 3],
            pressed: BTreeSet::new(),
            since_pressed: 0,
            told_overrides: [0; 3],
            reports: 0,
            shorted: false,
            hides_pins: false,
            waits_for_reset: false,
            reports_waiting: false,
            rarely_tells_zero: false,
            zero_due: 0,
            rack: None,
            fetched: Vec::new(),
            fetched_turning: false,
            tool: 0,
            length: 0.0,
            shift: [0.0; 3],
        };
        new.greet();
        new
    }

    fn say(&mut self, text: &str) {
        self.out.extend(text.as_bytes());
        self.out.extend(b"\r\n");
    }

    fn greet(&mut self) {
        self.say("");
        self.say("Grbl 1.1h ['$' for help]");
        if self.lock == Lock::Alarm {
            self.say("[MSG:'$H'|'$X' to unlock]");
        }
    }

    /// Simulates a loss of power or a pulled reset pin: the position is forgotten.
    pub(super) fn power_up(&mut self) {
        let physical = self.carriage();
        self.begin_anew();
        (self.origin, self.at, self.planned) = (physical, [0.0; 3], [0.0; 3]);
        self.lock = Lock::Alarm;
        self.out.clear();
        self.greet();
    }

    /// The same for a controller without switches, and with its greeting lost.
    pub(super) fn power_up_unheard(&mut self) {
        self.power_up();
        self.lock = Lock::None;
        self.out.clear();
    }

    /// Simulates another program that left this coordinate system active, 1 for G54.
    pub(super) fn leaves_in_force(&mut self, place: usize) {
        self.modal.zero = place - 1;
    }

    fn begin_anew(&mut self) {
        self.rx.clear();
        self.line.clear();
        self.queue.clear();
        (self.planned, self.modal) = (self.at, Modal::default());
        (self.held, self.check, self.dwell_ms, self.pending) = (None, false, 0.0, None);
        (self.probing, self.goes_on) = (None, false);
        (self.waits_for_reset, self.zero_due) = (false, 0);
        self.pressed.clear();
        self.length = 0.0;
        (self.overrides, self.told_overrides) = ([100; 3], [0; 3]);
    }

    fn soft_reset(&mut self) {
        let moves = !self.queue.is_empty() && self.held.is_none();
        let sleeps = self.held == Some("Sleep");
        self.begin_anew();
        if sleeps {
            self.lock = Lock::Alarm;
        }
        if moves {
            self.lock = Lock::Alarm;
            self.say("ALARM:3");
        }
        self.greet();
    }

    /// Stops with this alarm of a limit switch or soft limit, and waits for a reset.
    pub(super) fn is_stopped(&mut self, alarm: u16) {
        self.begin_anew();
        (self.lock, self.waits_for_reset) = (Lock::Alarm, true);
        self.say(&format!("ALARM:{alarm}"));
        self.say("[MSG:Reset to continue]");
    }

    pub(super) fn lock_unheard(&mut self) {
        self.begin_anew();
        self.lock = Lock::Alarm;
    }

    pub(super) fn leaves_check_mode(&mut self) {
        self.check = false;
    }

    fn jogs(&self) -> bool {
        self.queue.front().is_some_and(|block| block.by_hand)
    }

    /// Physically the travel extends from minus its length to the origin. A switch leaves each axis a
    /// millimetre from one of the ends.
    fn home(&mut self) {
        let setting = |number: u16| {
            self.settings.iter().find(|(known, _)| *known == number).map_or(0.0, |(_, value)| *value)
        };
        let (low, travel) = (setting(23) as u32, setting(130));
        for axis in (0..3).filter(|axis| self.homes[*axis]) {
            let physical = if low >> axis & 1 == 1 { 1.0 - travel } else { -1.0 };
            self.at[axis] = match self.counts {
                Counts::Down => physical,
                Counts::Up => physical + travel,
                Counts::FromThere => 0.0,
            };
            self.origin[axis] = physical - self.at[axis];
        }
        self.planned = self.at;
    }

    fn carriage(&self) -> [f64; 3] {
        std::array::from_fn(|axis| self.origin[axis] + self.at[axis])
    }

    pub(super) fn place(&self) -> [f64; 3] {
        let [x, y, z] = self.carriage();
        [x, y, z - self.tool_mm]
    }

    pub(super) fn said(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.out)
    }

    pub(super) fn hear(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            match byte {
                b'?' => self.asked = true,
                // In check mode there is nothing to hold.
                b'!' => {
                    self.hold_heard = true;
                    if !self.check && self.held.is_none() {
                        self.held = Some("Hold:0");
                    }
                }
                b'~' => self.goes_on = self.held != Some("Sleep"),
                0x18 => self.soft_reset(),
                _ if self.waits_for_reset => {}
                0x85 if self.jogs() => {
                    self.queue.clear();
                    self.planned = self.at;
                    self.held = self.deaf_after_cancel.then_some("Idle");
                }
                0x90..=0x9d => drop(self.pressed.insert(byte)),
                0x80.. => {}
                _ if self.rx.len() >= RX => self.overrun += 1,
                _ => self.rx.push_back(byte),
            }
        }
    }

    pub(super) fn tick(&mut self) {
        self.see_to_overrides();
        if std::mem::take(&mut self.asked) && (!self.waits_for_reset || self.reports_waiting) {
            self.report();
        }
        // After the report, in the same order as GRBL.
        let hold_heard = std::mem::take(&mut self.hold_heard);
        if std::mem::take(&mut self.goes_on) && !hold_heard {
            self.held = None;
        }
        if self.waits_for_reset {
            return;
        }
        self.go();
        if self.dwell_ms > 0.0 {
            self.dwell_ms -= 1.0;
            if self.dwell_ms <= 0.0 {
                self.say("ok");
            }
            return;
        }
        if self.held.is_some_and(|why| why != "Hold:0") {
            return;
        }
        // About ten bytes are parsed per millisecond.
        for _ in 0..12 {
            if self.pending.is_some() {
                self.try_pending();
                return;
            }
            let Some(byte) = self.rx.pop_front() else { return };
            match byte {
                b'\n' | b'\r' => {
                    let line = std::mem::take(&mut self.line);
                    self.pending = Some(line);
                    self.try_pending();
                    if self.dwell_ms > 0.0 {
                        return;
                    }
                }
                _ if byte > b' ' && self.line.len() < 80 => self.line.push(byte.to_ascii_uppercase()),
                _ => {}
            }
        }
    }

    /// Processes override characters every few milliseconds, between two lines.
    fn see_to_overrides(&mut self) {
        self.since_pressed += 1;
        if self.pressed.is_empty() || self.since_pressed < 5 {
            return;
        }
        self.since_pressed = 0;
        for sign in std::mem::take(&mut self.pressed) {
            let of = if sign < 0x95 {
                0
            } else if sign < 0x99 {
                1
            } else {
                2
            };
            let by = |step: i16| self.overrides[of].saturating_add_signed(step).clamp(10, 200);
            self.overrides[of] = match sign {
                0x91 | 0x9a => by(10),
                0x92 | 0x9b => by(-10),
                0x93 | 0x9c => by(1),
                0x94 | 0x9d => by(-1),
                0x96 => 50,
                0x97 => 25,
                _ => 100,
            };
        }
    }

    fn go(&mut self) {
        if self.probing == Some(true) && !self.queue.is_empty() {
            self.coast();
        }
        let mut left = 1.0;
        while self.held.is_none() && left > 0.0 {
            let Some(block) = self.queue.front() else { return };
            let probes = block.probes;
            let way: [f64; 3] = std::array::from_fn(|axis| block.to[axis] - self.at[axis]);
            let length = way.iter().map(|part| part * part).sum::<f64>().sqrt();
            let reach = block.per_ms * left;
            if length <= reach {
                self.at = block.to;
                left -= length / block.per_ms;
                self.queue.pop_front();
            } else {
                self.at = std::array::from_fn(|axis| self.at[axis] + way[axis] * reach / length);
                left = 0.0;
            }
            self.cuts.push(self.place());
            if probes {
                self.probe();
            }
        }
    }

    fn touches(&self) -> bool {
        let [x, y, z] = self.place();
        self.shorted || self.surface.is_some_and(|height| z <= height(x, y))
    }

    /// A probing move ends at the contact, or coasts to rest shortly after it.
    fn probe(&mut self) {
        if self.probing == Some(false) && self.touches() {
            (self.latched, self.probing, self.coasts) = (self.at, Some(true), self.coast_ms);
            self.coast();
        }
    }

    fn coast(&mut self) {
        if self.coasts == 0 {
            self.queue.clear();
            self.planned = self.at;
        }
        self.coasts = self.coasts.saturating_sub(1);
    }

    pub(super) fn zero(&self) -> [f64; 3] {
        let [x, y, z] = self.zeros[self.modal.zero];
        let [dx, dy, dz] = self.shift;
        [x + dx, y + dy, z + dz + self.length]
    }

    fn report(&mut self) {
        let doing = match () {
            () if self.lock == Lock::Alarm => "Alarm",
            () if self.held.is_some() => self.held.unwrap_or_default(),
            () if self.check => "Check",
            () if self.jogs() => "Jog",
            () if !self.queue.is_empty() => "Run",
            () => "Idle",
        };
        let feed = self.queue.front().map_or(0.0, |block| block.per_ms * 60_000.0);
        let (at, zero) = (self.words(self.at), self.words(self.zero()));
        let feed = self.rate(feed);
        let pins = if self.touches() && !self.hides_pins { "|Pn:P" } else { "" };
        let tells_zero = !self.rarely_tells_zero || self.zero_due == 0;
        self.zero_due = if tells_zero { 9 } else { self.zero_due - 1 };
        let zero = if tells_zero { format!("|WCO:{zero}") } else { String::new() };
        self.reports += 1;
        let told = self.told_overrides != self.overrides || self.reports.is_multiple_of(10);
        let [feeds, rapids, spindle] = self.overrides;
        let overrides = if told { format!("|Ov:{feeds},{rapids},{spindle}") } else { String::new() };
        self.told_overrides = self.overrides;
        self.say(&format!("<{doing}|MPos:{at}|FS:{feed},0{pins}{zero}{overrides}>"));
    }

    fn tells_inches(&self) -> bool {
        self.settings.iter().any(|(number, value)| *number == 13 && *value != 0.0)
    }

    fn words(&self, place: [f64; 3]) -> String {
        let words = if self.tells_inches() {
            place.map(|value| format!("{:.4}", value / 25.4))
        } else {
            place.map(|value| format!("{value:.3}"))
        };
        words.join(",")
    }

    fn rate(&self, feed: f64) -> String {
        if self.tells_inches() { format!("{:.1}", feed / 25.4) } else { format!("{feed:.0}") }
    }
}
