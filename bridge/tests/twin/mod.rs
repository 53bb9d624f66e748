//! A machine on an I/O card with a port file, and the virtual drill at its wires. The executor's output
//! turns its rotors and switches its cylinders; its sensors are the executor's input.
//!
//! ```text
//! bytes of the file   0 1 2    phases: steps ─┐                        ┌─ 4   end sensors, contact
//!                     3        spindle, foot, ├─▶ virtual drill ──▶ ───┤
//!                              clamp ─────────┘   and its faults       └─ 5   foot, clamp, magazine, cover, air
//! ```

mod changes;
#[cfg(target_os = "linux")]
mod command;
mod faults;
mod foot;

use crate::server::card::arm;
use crate::server::client::{PATIENCE, Page, Running, annulus, output};
use crate::server::drill;
use crate::server::machine_time::{self, Limits};
use annulus_core::control::{Ending, State};
use annulus_core::job::{Input, Program};
use annulus_core::machine::phases::preset;
use annulus_core::machine::{Machine, Output, Value, apply};
use annulus_core::magazine::ToolStock;
use annulus_core::pins::Pins;
use annulus_core::steps::TICK_HZ;
use annulus_core::virtual_drill::{Faults, VirtualDrill, VirtualHole};
use annulus_core::wire::{Ask, JobEnd, Status, Tell};
use std::fs::{self, File};
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Arc, Mutex, MutexGuard};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};
use tempfile::TempDir;

const SURFACE_MM: f64 = -8.0;
const SPINDLE: u8 = 1;
const FOOT: u8 = 2;
const CLAMP: u8 = 4;
const RPM: u32 = 20_000;
/// How far the machine may run ahead of the test.
const AHEAD: Duration = Duration::from_millis(300);
/// Assumed distance of steps found in one reading of the file, in ticks.
const APART_TICKS: u64 = TICK_HZ / 10_000;
/// Strong motors, because steps are noticed late.
const STRONG_MM_PER_S2: f64 = 1e9;
const STRONG_HZ: u32 = 1_000_000;

fn number(number: f64) -> Value {
    Value::Number(number)
}

fn text(text: &str) -> Value {
    Value::Text(text.to_owned())
}

fn list(numbers: &[i32]) -> Value {
    Value::Numbers(numbers.iter().map(|number| f64::from(*number)).collect())
}

/// A small slow machine: 14 × 14 × 12 mm, 10 steps/mm, at most 100 steps per second; with all sensors.
fn machine(device: &Path, more: &[(&'static str, Value)]) -> Machine {
    let changes = vec![
        ("machine.output", text("card")),
        ("machine.card_address", number(0.0)),
        ("card.device", text(&device.display().to_string())),
        ("card.inputs_at", number(4.0)),
        ("card.sensors", list(&[0, -1, 2, -1, 4, -1, 6, 8, 9, 10, 11, 12, 13])),
        ("card.sensors_low", list(&[0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0])),
        ("card.output_names", text("foot clamp")),
        ("card.outputs", list(&[25, 26])),
        ("card.start_stop_rate", number(60.0)),
        ("overlap.on", text("no")),
        ("stroke.surface", number(SURFACE_MM)),
        ("stroke.feed", number(10.0)),
        ("stroke.contact_tolerance", number(0.0)),
        ("stroke.settle", number(5.0)),
        ("spindle.spin_up", number(50.0)),
        ("motion.down_speed", number(10.0)),
        ("motion.down_acceleration", number(50.0)),
        ("motion.down_jerk", number(1_000.0)),
        ("magazine.x", Value::Numbers(vec![4.0, 8.0, 12.0])),
        ("magazine.y", Value::Numbers(vec![12.0; 3])),
        ("magazine.height", number(-5.0)),
        ("magazine.pause_x", number(2.0)),
        ("magazine.pause_y", number(8.0)),
        ("magazine.clamp_time", number(200.0)),
        ("magazine.spin_down", number(50.0)),
    ];
    let half = preset("half").unwrap().columns.iter().map(|column| i32::from(*column)).collect::<Vec<_>>();
    let of_axis = [
        ("scale", number(10.0)),
        ("max_speed", number(10.0)),
        ("max_acceleration", number(40.0)),
        ("max_jerk", number(2_000.0)),
        ("home_speed", number(5.0)),
        ("home_search", number(20.0)),
        ("home_offset", number(1.0)),
        ("phases", list(&half)),
    ];
    let base = drill::machine(changes, [("x", 0.0, 14.0), ("y", 0.0, 14.0), ("z", -12.0, 0.0)], &of_axis);
    let more: Vec<_> = more.iter().map(|(key, value)| ((*key).to_owned(), value.clone())).collect();
    apply(&base, &more).unwrap()
}

pub(crate) struct Seen {
    pub(crate) drill: VirtualDrill,
    /// Holes, recorded by the simulated board.
    pub(crate) holes: Arc<Mutex<Vec<VirtualHole>>>,
    /// Every switch of the foot: whether it is down, and the height of the tool.
    pub(crate) foot: Vec<(bool, i64)>,
    pub(crate) forced: u32,
    bytes: [u8; 4],
    columns: [Option<i64>; 3],
    tick: u64,
}

impl Seen {
    fn of(machine: &Machine, faults: Faults) -> Self {
        let mut twin = Machine { output: Output::Virtual, max_step_hz: STRONG_HZ, ..machine.clone() };
        for axis in [&mut twin.x, &mut twin.y, &mut twin.z] {
            axis.max_acceleration_mm_per_s2 = STRONG_MM_PER_S2;
        }
        let holes = Arc::new(Mutex::new(Vec::new()));
        let made = Arc::clone(&holes);
        let drilled = Box::new(move |hole: &VirtualHole| made.lock().unwrap().push(*hole));
        Self {
            drill: VirtualDrill::new(&twin, 1, faults, drilled),
            holes,
            foot: Vec::new(),
            forced: 0,
            bytes: [0; 4],
            // The rotor position for the last column of the table.
            columns: [Some(7); 3],
            tick: 0,
        }
    }

    fn look(&mut self, machine: &Machine, bytes: [u8; 4], tick: u64) -> [u8; 2] {
        self.tick = self.tick.max(tick);
        let changed = self.bytes[3] ^ bytes[3];
        self.bytes = bytes;
        if changed & SPINDLE != 0 {
            self.drill.spindle(self.tick, if bytes[3] & SPINDLE != 0 { RPM } else { 0 });
        }
        for (bit, place) in [(FOOT, 0), (CLAMP, 1)] {
            if changed & bit != 0 {
                self.drill.output(self.tick, place, bytes[3] & bit != 0);
            }
        }
        if changed & FOOT != 0 {
            self.foot.push((bytes[3] & FOOT != 0, self.drill.real()[2]));
        }
        for (axis, byte) in bytes.iter().enumerate().take(3) {
            let now = column(machine, axis, *byte);
            if let (Some(was), Some(now)) = (self.columns[axis], now) {
                let turned = (now - was + 3).rem_euclid(8) - 3;
                (0..turned.abs()).for_each(|_| self.step(axis, turned > 0));
            }
            self.columns[axis] = now.or(self.columns[axis]);
        }
        let inputs = self.drill.inputs(self.tick) | self.forced;
        let mut read = [0; 2];
        for input in Input::ALL {
            let bit = machine.card.wiring.sensor(input);
            let low = machine.card.wiring.sensors_low[input as usize] == 1;
            if bit >= 0 && (inputs & input.bit() != 0) != low {
                read[bit as usize / 8] |= 1 << (bit % 8);
            }
        }
        read
    }

    fn step(&mut self, axis: usize, forward: bool) {
        self.tick += APART_TICKS;
        self.drill.step(self.tick, 1 << axis, u8::from(forward) << axis);
    }

    fn lay(&mut self, stock: &ToolStock) {
        self.drill.stock(self.tick, stock);
    }

    pub(crate) fn holes(&self) -> Vec<VirtualHole> {
        self.holes.lock().unwrap().clone()
    }
}

/// The column of the table of `axis` with the windings of `byte`; `None` while nothing is on.
fn column(machine: &Machine, axis: usize, byte: u8) -> Option<i64> {
    let columns = &machine.axis(axis).phases.columns;
    columns.iter().position(|phases| phases & 0x0F == byte & 0x0F).map(|at| at as i64)
}

struct Twin {
    seen: Arc<Mutex<Seen>>,
    limits: Arc<Limits>,
    thread: Option<JoinHandle<()>>,
}

impl Twin {
    fn start(machine: &Machine, device: &Path, faults: Faults) -> Self {
        let seen = Arc::new(Mutex::new(Seen::of(machine, faults)));
        let limits = Arc::new(Limits::none());
        let (own, shared, machine) = (Arc::clone(&seen), Arc::clone(&limits), machine.clone());
        let device = device.to_owned();
        let thread = thread::spawn(move || {
            let mut before = None;
            machine_time::keep(&device, &shared, |device, tick| {
                let mut bytes = [0; 4];
                device.read_exact_at(&mut bytes, 0).unwrap();
                let read = own.lock().unwrap().look(&machine, bytes, tick);
                if before != Some(read) {
                    device.write_all_at(&read, 4).unwrap();
                    before = Some(read);
                }
            });
        });
        Self { seen, limits, thread: Some(thread) }
    }
}

impl Drop for Twin {
    fn drop(&mut self) {
        self.limits.end();
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

/// A folder with the file `card.toml` of a machine with `more` settings, its device, and a twin with these
/// faults.
fn wired(more: &[(&'static str, Value)], faults: Faults) -> (TempDir, Machine, PathBuf, Twin) {
    let home = TempDir::new().unwrap();
    let device = home.path().join("card.bin");
    let made = output(&home, &["machines", "--rehearsal", &device.display().to_string()]);
    assert_eq!(made.0, 0, "{}", made.2);
    let machine = machine(&device, more);
    fs::write(home.path().join("card.toml"), drill::file(&machine)).unwrap();
    let twin = Twin::start(&machine, &device, faults);
    (home, machine, device, twin)
}

/// The command `annulus`, whose executor takes its time from the twin.
fn driven(home: &TempDir, arguments: &[&str]) -> Command {
    let mut command = annulus(home, arguments);
    command.env("ANNULUS_LATENESS_US", "100").env(machine_time::REQUEST.0, machine_time::REQUEST.1);
    command
}

/// A machine on a card, its twin, its bridge, and a page.
pub(crate) struct Bench {
    pub(crate) machine: Machine,
    pub(crate) page: Page,
    pub(crate) bridge: Running,
    pub(crate) heard: Vec<Tell>,
    pub(crate) status: Option<Status>,
    device: PathBuf,
    twin: Twin,
}

impl Bench {
    pub(crate) fn new(more: &[(&'static str, Value)], faults: Faults) -> Self {
        let (home, machine, device, twin) = wired(more, faults);
        let named = home.path().join("card.toml");
        let command =
            driven(&home, &["serve", "--port", "0", "--no-open", "--machine", &named.display().to_string()]);
        let bridge = Running::of(command, home);
        let mut page = bridge.page();
        assert!(page.take_control(false));
        Self { machine, page, bridge, heard: Vec::new(), status: None, device, twin }
    }

    pub(crate) fn seen(&self) -> MutexGuard<'_, Seen> {
        self.twin.seen.lock().unwrap()
    }

    fn let_run(&self) {
        self.twin.limits.free();
    }

    /// Receives reports until one is `wanted`, and keeps control alive. The machine never runs far ahead.
    fn hear(&mut self, wanted: impl Fn(&Tell) -> bool) -> Tell {
        let since = Instant::now();
        loop {
            self.twin.limits.allow(AHEAD);
            assert!(since.elapsed() < 2 * PATIENCE, "waited in vain: {:?} {:?}", self.status, self.heard);
            let tell = self.page.next().expect("the bridge is there");
            if let Tell::Status(status) = &tell {
                self.status = Some(status.as_ref().clone());
                self.page.ask(&Ask::Ping { stamp: 0.0 });
            }
            if !matches!(tell, Tell::Status(_) | Tell::Pong { .. }) {
                self.heard.push(tell.clone());
            }
            if wanted(&tell) {
                return tell;
            }
        }
    }

    pub(crate) fn until(&mut self, wanted: impl Fn(&Status) -> bool) -> Status {
        self.hear(|tell| matches!(tell, Tell::Status(status) if wanted(status)));
        self.status.clone().unwrap()
    }

    /// Waits until nothing moves. Returns the code of the alarm, if any.
    pub(crate) fn rests(&mut self) -> Option<String> {
        let is_over = |state: State| matches!(state, State::Ready | State::Alarm | State::NotHomed);
        self.until(|status| is_over(status.state) && status.stage.is_none());
        self.rested()
    }

    fn rested(&self) -> Option<String> {
        self.status.as_ref().and_then(|status| status.alarm.as_ref()).map(|why| why.code.clone())
    }

    pub(crate) fn home(&mut self) -> Option<String> {
        self.page.ask(&Ask::Home);
        self.begins();
        self.until(|status| matches!(status.state, State::Ready | State::Alarm) && status.stage.is_none());
        self.rested()
    }

    /// Waits until something moves: an old status may arrive late.
    pub(crate) fn begins(&mut self) {
        self.until(|status| status.stage.is_some());
    }

    /// Homes, and sets the work zero at this distance from the position after homing.
    pub(crate) fn ready(&mut self, zero_um: [i32; 2]) {
        assert_eq!(self.home(), None);
        self.by_hand(0, zero_um[0]);
        self.by_hand(1, zero_um[1]);
        self.page.ask(&Ask::SetZero);
    }

    pub(crate) fn by_hand(&mut self, axis: u8, distance_um: i32) {
        if distance_um == 0 {
            return;
        }
        self.page.ask(&Ask::Jog { axis, distance_um, anyway: false });
        self.until(|status| status.state == State::Jogging);
        while self.status.as_ref().is_some_and(|status| status.state == State::Jogging) {
            self.page.ask(&Ask::JogOn);
            self.until(|_| true);
        }
        self.rests();
    }

    pub(crate) fn start(&mut self, program: &Program) {
        let (job, stream_digest, failed) = arm(&self.bridge, &mut self.page, program);
        assert_eq!(failed, Vec::<String>::new());
        self.page.ask(&Ask::Start { job, stream_digest, from_leg: 0 });
    }

    pub(crate) fn ended(&mut self) -> (Ending, u32) {
        match self.hear(|tell| matches!(tell, Tell::Ended(_))) {
            Tell::Ended(JobEnd { ending, holes_done, .. }) => (ending, holes_done),
            other => panic!("{other:?}"),
        }
    }

    /// Waits until no executor holds the device.
    pub(crate) fn until_let_go(&self) {
        self.let_run();
        let since = Instant::now();
        let device = File::options().read(true).write(true).open(&self.device).unwrap();
        while device.try_lock().is_err() {
            assert!(since.elapsed() < PATIENCE, "the executor does not end");
            thread::sleep(Duration::from_millis(5));
        }
    }
}
