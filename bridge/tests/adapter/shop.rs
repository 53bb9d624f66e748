//! A small fast drill on an adapter, its bridge, and a page.

use super::bench::{Bench, Board, PHASES, Record, STEPS, eventually};
use super::client::{Page, Running, annulus};
use super::drill;
use annulus_core::control::{Ending, State};
use annulus_core::geometry::Point;
use annulus_core::job::Program;
use annulus_core::machine::phases::preset;
use annulus_core::machine::{Machine, Value, apply};
use annulus_core::wire::{ArmedJob, Ask, InterruptedJob, JobEnd, RowVerdict, Status, Tell, program};
use std::fs;
use std::path::Path;
use tempfile::TempDir;

const APART: f64 = 3.0;

/// 100 steps/mm, 12 × 12 × 6 mm, 300 mm/s and 10 m/s².
pub(crate) fn machine(port: &Path) -> Machine {
    let number = Value::Number;
    let changes = vec![
        ("machine.output", Value::Text("adapter".into())),
        ("adapter.port", Value::Text(port.display().to_string())),
        ("stroke.surface", number(-3.0)),
        ("stroke.board_thickness", number(0.5)),
        ("stroke.breakthrough", number(0.2)),
        ("stroke.safe_height", number(0.8)),
        ("stroke.feed_height", number(0.1)),
        ("stroke.feed", number(20.0)),
        ("stroke.touch_speed", number(10.0)),
        ("stroke.settle", number(0.0)),
        ("spindle.spin_up", number(5.0)),
        ("motion.down_speed", number(50.0)),
        ("motion.down_acceleration", number(10_000.0)),
        ("motion.down_jerk", number(1e7)),
    ];
    let of_axis = [
        ("scale", 100.0),
        ("max_speed", 300.0),
        ("max_acceleration", 10_000.0),
        ("max_jerk", 1e7),
        ("home_speed", 300.0),
        ("home_search", 15.0),
        ("home_offset", 0.2),
    ];
    let axes = [("x", 0.0, 12.0), ("y", 0.0, 12.0), ("z", -6.0, 0.0)];
    drill::machine(changes, axes, &of_axis.map(|(name, value)| (name, number(value))))
}

/// The drill with its motors on a phase board: half steps, 80 mm/s.
fn phases(port: &Path) -> Machine {
    let numbers = |numbers: &[f64]| Value::Numbers(numbers.to_vec());
    let half = preset("half").unwrap().columns.iter().map(|column| f64::from(*column)).collect::<Vec<_>>();
    let mut changes = vec![
        ("drive.max_step_rate".to_owned(), Value::Number(10_000.0)),
        ("adapter.outputs".to_owned(), Value::Text("phases".into())),
        ("adapter.sensors".to_owned(), numbers(&[0.0, -1.0, 1.0, -1.0, 2.0, -1.0, -1.0])),
    ];
    for axis in ["x", "y", "z"] {
        changes.push((format!("{axis}.phases"), numbers(&half)));
        for name in ["max_speed", "home_speed"] {
            changes.push((format!("{axis}.{name}"), Value::Number(80.0)));
        }
    }
    apply(&machine(port), &changes).unwrap()
}

/// The drill with a contact sensor, which excludes overlapping moves.
fn with_contact(port: &Path) -> Machine {
    let sensors = [0.0, -1.0, 2.0, -1.0, 4.0, -1.0, 6.0].to_vec();
    let changes =
        [("adapter.sensors", Value::Numbers(sensors)), ("overlap.on", Value::Text("no".to_owned()))];
    apply(&machine(port), &changes.map(|(key, value)| (key.to_owned(), value))).unwrap()
}

pub(crate) fn write_file(machine: &Machine, path: &Path) {
    fs::write(path, drill::file(machine)).unwrap();
}

fn holes(machine: &Machine, count: u32) -> Program {
    let feed_um_per_s = (machine.process.feed_mm_per_s * 1e3) as u32;
    let at = (0..count).map(|hole| Point::from_mm(f64::from(hole) * APART, f64::from(hole % 2)));
    drill::holes(machine, vec![drill::spin_up(5_000)], (at, feed_um_per_s), drill::back())
}

pub(crate) struct Shop {
    pub(crate) bench: Bench,
    pub(crate) machine: Machine,
    pub(crate) page: Page,
    pub(crate) program: Program,
    pub(crate) job: String,
    /// Offset from machine steps to steps from the switches, and the stop position before the job.
    pub(crate) offset: [i64; 3],
    pub(crate) rested: [i64; 3],
    bridge: Running,
}

impl Shop {
    /// A homed drill with the work zero at its position, and `count` holes to drill.
    pub(crate) fn homed(count: u32) -> Self {
        let home = TempDir::new().unwrap();
        let port = home.path().join("port");
        let (bench, machine) = (Bench::new(&port, STEPS), machine(&port));
        Self::open(count, home, bench, machine)
    }

    pub(crate) fn homed_by_phases(count: u32) -> Self {
        let home = TempDir::new().unwrap();
        let port = home.path().join("port");
        let (bench, machine) = (Bench::new(&port, PHASES), phases(&port));
        Self::open(count, home, bench, machine)
    }

    pub(crate) fn homed_over(board: Board) -> Self {
        let home = TempDir::new().unwrap();
        let port = home.path().join("port");
        let (bench, machine) = (Bench::new(&port, STEPS), with_contact(&port));
        bench.board(board);
        Self::open(1, home, bench, machine)
    }

    fn open(count: u32, home: TempDir, bench: Bench, machine: Machine) -> Self {
        let file = home.path().join("drill.toml");
        write_file(&machine, &file);
        let named = file.display().to_string();
        let command = annulus(&home, &["serve", "--port", "0", "--no-open", "--machine", &named]);
        let bridge = Running::of(command, home);
        let mut page = bridge.page();
        assert!(page.take_control(false));
        let program = holes(&machine, count);
        let job = String::new();
        let mut shop = Self { bench, machine, page, program, job, offset: [0; 3], rested: [0; 3], bridge };
        shop.home();
        shop.take_control();
        shop.page.ask(&Ask::SetZero);
        shop
    }

    pub(crate) fn home(&mut self) {
        self.take_control();
        self.page.ask(&Ask::Home);
        let status = self.until(|status| status.state == State::Ready);
        let place = self.bench.rests().place;
        self.offset = std::array::from_fn(|axis| place[axis] - status.steps[axis]);
        // Homing always ends at the same step.
        self.rested = std::array::from_fn(|axis| status.steps[axis]);
        let bottom = self.machine.z.scale.steps(self.machine.process.surface) - 60;
        self.bench.bottom(bottom + self.offset[2]);
    }

    pub(crate) fn until(&mut self, wanted: impl Fn(&Status) -> bool) -> Status {
        let tell = self.page.until(|tell| matches!(tell, Tell::Status(status) if wanted(status)));
        let Tell::Status(status) = tell else { panic!("{tell:?}") };
        *status
    }

    /// Inserts a new board and starts the job at `leg`. Returns the digest of its stream.
    pub(crate) fn begin(&mut self, leg: u32) -> String {
        self.bench.new_board();
        self.start(leg)
    }

    /// Watching the pins takes long, so control may have lapsed. If it has not, there is no answer.
    fn take_control(&mut self) {
        self.page.ask(&Ask::TakeControl { force: true });
    }

    pub(crate) fn acknowledge(&mut self) {
        self.take_control();
        self.page.ask(&Ask::AcknowledgeAlarm);
    }

    pub(crate) fn acknowledged(&mut self) -> State {
        // The alarm's safety moves come first.
        self.until(|status| status.state == State::Alarm && status.stage.is_none());
        self.bench.rests();
        self.acknowledge();
        self.until(|status| status.state != State::Alarm || status.alarm.is_none()).state
    }

    /// Arms the job and starts it at `leg`. Returns the digest of its stream.
    pub(crate) fn start(&mut self, leg: u32) -> String {
        let bytes = program::encode(&self.program);
        self.job = program::key(&bytes);
        let keys = (self.page.session.as_str(), self.page.key.as_str());
        assert_eq!(self.bridge.job(keys, "PUT", &self.job, &bytes).status, 200);
        self.take_control();
        self.page.ask(&Ask::Arm { job: self.job.clone(), from_leg: leg });
        let armed = self.page.until(|tell| matches!(tell, Tell::Armed(_) | Tell::Refused { .. }));
        let Tell::Armed(ArmedJob { stream_digest, checks, .. }) = armed else { panic!("{armed:?}") };
        assert!(checks.iter().all(|row| row.verdict != RowVerdict::Fail), "{checks:?}");
        let (job, digest) = (self.job.clone(), stream_digest.clone());
        self.page.ask(&Ask::Start { job, stream_digest, from_leg: leg });
        digest
    }

    pub(crate) fn ended(&mut self) -> (Ending, u32) {
        match self.page.until(|tell| matches!(tell, Tell::Ended(_))) {
            Tell::Ended(JobEnd { ending, holes_done, .. }) => (ending, holes_done),
            other => panic!("{other:?}"),
        }
    }

    /// The leg that a new page is offered for the interrupted job.
    pub(crate) fn offered(&self) -> u32 {
        let mut page = self.bridge.page();
        match page.until(|tell| matches!(tell, Tell::Interrupted(_))) {
            Tell::Interrupted(InterruptedJob { next_leg, .. }) => next_leg,
            other => panic!("{other:?}"),
        }
    }

    /// Checks, after a stop, that the pins agree with the bridge's position.
    pub(crate) fn agrees(&mut self) -> Record {
        let record = self.bench.rests();
        let status = self.until(|status| status.stage.is_none());
        let place: [i64; 3] = std::array::from_fn(|axis| status.steps[axis] + self.offset[axis]);
        assert_eq!(record.place, place, "{:?}", status.steps);
        record
    }

    /// Checks that every hole is in its position, and that at most this many are drilled twice.
    pub(crate) fn judge(&self, count: u32, most_twice: usize) {
        let record = self.bench.record();
        let at = |hole: u32| {
            let far = [f64::from(hole) * APART, f64::from(hole % 2)];
            [0, 1].map(|axis| self.rested[axis] + self.offset[axis] + (far[axis] * 100.0) as i64)
        };
        // A switch is found within a step or two.
        let is_at =
            |hole: &[i64; 2], place: &[i64; 2]| (0..2).all(|axis| hole[axis].abs_diff(place[axis]) <= 2);
        let wanted: Vec<[i64; 2]> = (0..count).map(at).collect();
        let is_wanted = |hole: &[i64; 2]| wanted.iter().any(|place| is_at(hole, place));
        assert!(record.holes.iter().all(is_wanted), "{:?} {wanted:?}", record.holes);
        let is_made = |place: &[i64; 2]| record.holes.iter().any(|hole| is_at(hole, place));
        assert!(wanted.iter().all(is_made), "{:?} {wanted:?}", record.holes);
        let twice = record.holes.len() - wanted.len();
        println!("{count} holes, {twice} of them twice");
        assert!(twice <= most_twice, "{:?}", record.holes);
    }

    pub(crate) fn kill(&mut self) {
        self.bridge.child.kill().unwrap();
        self.bridge.child.wait().unwrap();
    }

    pub(crate) fn spindle(&self, on: bool) {
        eventually("the spindle", || self.bench.record().spindle == on);
    }
}
