//! Tests of a machine on an I/O card with a port file: the executor's process, the wires, the clock's
//! quality, a killed bridge.
//!
//! ```text
//! bytes of the file   0 1 2 3   outputs: X, Y, Z, spindle   written by the executor
//!                     4         inputs: limit switches      written by the mechanics below from the phases
//! ```

use super::client::{PATIENCE, Page, Running, annulus, output};
use super::drill;
use super::machine_time::{self, Limits};
use super::work::{home, jog, until_status};
use annulus_core::control::{Ending, State, Trust};
use annulus_core::geometry::Point;
use annulus_core::job::{Bit, Command, Cutter, Leg, Mark, Program, Stage};
use annulus_core::machine::{Machine, Value};
use annulus_core::units::Length;
use annulus_core::wire::{ArmedJob, Ask, JobEnd, LengthKnown, RowVerdict, Status, Tell, program};
use std::fs::{self, File, OpenOptions};
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// Half steps: every column has its own windings, so that up to three missed ones can be distinguished.
const PHASES: [u8; 8] = [0x25, 0x01, 0x49, 0x08, 0x2A, 0x02, 0x46, 0x04];

/// A small slow machine: 5 steps/mm, at most 100 steps per second, 50 while homing.
fn machine(device: &Path) -> Machine {
    let number = Value::Number;
    let list = |numbers: &[i32]| Value::Numbers(numbers.iter().map(|n| f64::from(*n)).collect());
    let changes = vec![
        ("machine.output", Value::Text("card".into())),
        ("machine.card_address", number(0.0)),
        ("card.device", Value::Text(device.display().to_string())),
        ("card.inputs_at", number(4.0)),
        ("card.sensors", list(&[0, -1, 2, -1, 4, -1, -1])),
        ("card.sensors_low", list(&[0, 0, 0, 0, 1, 0, 0])),
        ("card.start_stop_rate", number(60.0)),
        ("stroke.surface", number(-8.0)),
        ("stroke.feed", number(10.0)),
        ("stroke.settle", number(5.0)),
        ("spindle.spin_up", number(50.0)),
        ("motion.down_speed", number(10.0)),
        ("motion.down_acceleration", number(50.0)),
        ("motion.down_jerk", number(1_000.0)),
    ];
    let of_axis = [
        ("scale", number(5.0)),
        ("max_speed", number(20.0)),
        ("max_acceleration", number(40.0)),
        ("max_jerk", number(2_000.0)),
        ("home_speed", number(10.0)),
        ("home_search", number(70.0)),
        ("home_offset", number(1.0)),
        ("phases", list(&PHASES.map(i32::from))),
    ];
    drill::machine(changes, [("x", 0.0, 60.0), ("y", 0.0, 60.0), ("z", -12.0, 0.0)], &of_axis)
}

pub(crate) struct Shop {
    pub(crate) machine: Machine,
    pub(crate) device: PathBuf,
}

impl Shop {
    pub(crate) fn new(home: &TempDir) -> Self {
        let device = home.path().join("card.bin");
        let made = output(home, &["machines", "--rehearsal", &device.display().to_string()]);
        assert_eq!(made.0, 0, "{}", made.2);
        // The sensor of Z is on at 0.
        OpenOptions::new().write(true).open(&device).unwrap().write_all_at(&[0b1_0000], 4).unwrap();
        let machine = machine(&device);
        fs::write(home.path().join("card.toml"), drill::file(&machine)).unwrap();
        Self { machine, device }
    }

    pub(crate) fn bridge(home: TempDir, late_us: &str) -> Running {
        let file = home.path().join("card.toml").display().to_string();
        let mut command = annulus(&home, &["serve", "--port", "0", "--no-open", "--machine", &file]);
        command.env("ANNULUS_LATENESS_US", late_us).env(machine_time::REQUEST.0, machine_time::REQUEST.1);
        Running::of(command, home)
    }

    pub(crate) fn outputs(&self) -> [u8; 4] {
        let mut bytes = [0; 4];
        File::open(&self.device).unwrap().read_exact_at(&mut bytes, 0).unwrap();
        bytes
    }

    /// Waits until no executor holds the device.
    pub(crate) fn until_let_go(&self) {
        let since = Instant::now();
        let device = OpenOptions::new().read(true).write(true).open(&self.device).unwrap();
        while device.try_lock().is_err() {
            assert!(since.elapsed() < PATIENCE, "the executor does not end");
            thread::sleep(Duration::from_millis(5));
        }
    }
}

/// The column of the table with the windings of `byte`; `None` while nothing is on.
fn column(byte: u8) -> Option<i64> {
    PHASES.iter().position(|phases| phases & 0x0F == byte & 0x0F).map(|at| at as i64)
}

/// Rotors that follow the phases, and limit switches that follow the rotors.
pub(crate) struct Mechanics {
    limits: Arc<Limits>,
    thread: Option<JoinHandle<()>>,
}

impl Mechanics {
    pub(crate) fn start(device: &Path) -> Self {
        let limits = Arc::new(Limits::none());
        let (shared, device) = (Arc::clone(&limits), device.to_owned());
        let thread = thread::spawn(move || {
            let mut places = [15_i64, 10, -12];
            let mut columns = [None; 3];
            machine_time::keep(&device, &shared, |device, _| {
                let mut bytes = [0; 3];
                device.read_exact_at(&mut bytes, 0).unwrap();
                for axis in 0..3 {
                    let now = column(bytes[axis]);
                    if let (Some(was), Some(now)) = (columns[axis], now) {
                        let turned: i64 = now - was;
                        places[axis] += (turned + 3).rem_euclid(8) - 3;
                    }
                    columns[axis] = now.or(columns[axis]);
                }
                let sensors = [places[0] <= 0, places[1] <= 0, places[2] < 0];
                let byte = u8::from(sensors[0]) | u8::from(sensors[1]) << 2 | u8::from(sensors[2]) << 4;
                device.write_all_at(&[byte], 4).unwrap();
            });
        });
        Self { limits, thread: Some(thread) }
    }

    /// Slows motion down so that the test can act in the middle of a move.
    pub(crate) fn slow(&self) {
        self.limits.slow(20);
    }
}

impl Drop for Mechanics {
    fn drop(&mut self) {
        self.limits.end();
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

/// Holes 30 mm apart along X: long rapids in between.
pub(crate) fn holes(machine: &Machine, count: u32) -> Program {
    let at = (0..count).map(|hole| Point::from_mm(f64::from(hole) * 30.0, 2.0));
    drill::holes(machine, vec![drill::spin_up(50_000)], (at, 10_000), drill::back())
}

/// Arms `program`. Returns its key, the digest, and the codes of failed rows.
pub(crate) fn arm(bridge: &Running, page: &mut Page, program: &Program) -> (String, String, Vec<String>) {
    let bytes = program::encode(program);
    let job = program::key(&bytes);
    assert_eq!(bridge.job((&page.session, &page.key), "PUT", &job, &bytes).status, 200);
    page.ask(&Ask::Arm { job: job.clone(), from_leg: 0 });
    let armed = page.until(|tell| matches!(tell, Tell::Armed(_) | Tell::Refused { .. }));
    let Tell::Armed(ArmedJob { stream_digest, checks, .. }) = armed else { panic!("{armed:?}") };
    let failed = checks.into_iter().filter(|row| row.verdict == RowVerdict::Fail);
    (job, stream_digest, failed.map(|row| row.finding.code).collect())
}

/// A homed machine on a card that drills two holes.
pub(crate) struct Scene {
    pub(crate) shop: Shop,
    pub(crate) bridge: Running,
    pub(crate) page: Page,
    pub(crate) mechanics: Mechanics,
    /// Status after homing and before the job, and the windings that were on then.
    pub(crate) rested: Status,
    columns: [Option<i64>; 4],
}

impl Scene {
    /// Starts the job and stops at a status that is `wanted`, compared with the one before the job.
    fn when(wanted: impl Fn(&Status, &Status) -> bool) -> Self {
        let folder = TempDir::new().unwrap();
        let shop = Shop::new(&folder);
        let bridge = Shop::bridge(folder, "100");
        let mechanics = Mechanics::start(&shop.device);
        let mut page = bridge.page();
        home(&mut page);
        let rested = until_status(&mut page, |status| status.stage.is_none());
        let columns = shop.outputs().map(column);
        page.ask(&Ask::SetZero);
        let (job, stream_digest, failed) = arm(&bridge, &mut page, &holes(&shop.machine, 2));
        assert_eq!(failed, Vec::<String>::new());
        page.ask(&Ask::Start { job, stream_digest, from_leg: 0 });
        until_status(&mut page, |status| wanted(&rested, status));
        mechanics.slow();
        Self { shop, bridge, page, mechanics, rested, columns }
    }

    /// In the middle of the long rapid to the second hole, at full speed, the spindle on.
    pub(crate) fn on_its_way() -> Self {
        let scene = Self::when(|rested, status| {
            status.stage == Some(Stage::Travel) && status.steps[0] > rested.steps[0] + 60
        });
        assert_eq!(scene.shop.outputs()[3], 1, "the spindle turns");
        scene
    }

    fn with_the_bit_down() -> Self {
        Self::when(|_, status| status.state == State::Running && status.work_mm[2] < 0.5)
    }
}

pub(crate) fn last_record(home: &Path) -> serde_json::Value {
    let text = fs::read_to_string(home.join("executor.log")).unwrap();
    serde_json::from_str(text.lines().last().unwrap()).unwrap()
}

#[test]
fn card_drills_a_board_and_pages_cannot_change_the_wiring() {
    let folder = TempDir::new().unwrap();
    let shop = Shop::new(&folder);
    let home_path = folder.path().to_owned();
    let bridge = Shop::bridge(folder, "100");
    let _mechanics = Mechanics::start(&shop.device);
    let mut page = bridge.page();
    let Tell::Timing(timing) = page.until(|tell| matches!(tell, Tell::Timing(_))) else { panic!() };
    assert_eq!((timing.lateness.worst_us, timing.safe_hz), (100.0, 2_500.0));
    assert_eq!(shop.outputs(), [0; 4], "nothing is on before something is asked");
    home(&mut page);
    assert_eq!(shop.outputs().map(|byte| byte & 0x60), [0; 4], "no forcing at rest");
    // Without a wired contact sensor, nothing would end a move down.
    page.ask(&Ask::Probe { depth_um: 1_000, plate_um: 0 });
    assert_eq!(page.refusal(), "level.no_contact");
    for (key, value) in [
        ("machine.output", Value::Text("virtual".into())),
        ("card.device", Value::Text("/dev/port".into())),
        ("card.x", Value::Numbers(vec![-1.0; 8])),
    ] {
        page.ask(&Ask::Configure { changes: vec![(key.to_owned(), value)] });
        assert_eq!(page.refusal(), "control.in_file_only", "{key}");
    }
    let status =
        jog(&mut page, 1, 1_000, |status| status.state == State::Ready && status.machine_mm[1] > 1.5);
    assert!((status.machine_mm[1] - 2.0).abs() < 0.21, "{:?}", status.machine_mm);
    page.ask(&Ask::SetZero);
    let (job, stream_digest, failed) = arm(&bridge, &mut page, &holes(&shop.machine, 1));
    assert_eq!(failed, Vec::<String>::new());
    page.ask(&Ask::Start { job, stream_digest, from_leg: 0 });
    until_status(&mut page, |status| status.spindle_rpm == 20_000 && status.stage == Some(Stage::Travel));
    assert_eq!(shop.outputs()[3], 1, "the spindle turns");
    let end = page.until_ended();
    assert!(matches!(end, Tell::Ended(JobEnd { ending: Ending::Done, holes_done: 1, .. })), "{end:?}");
    let status = until_status(&mut page, |status| status.state == State::Ready);
    assert_eq!((status.trust, shop.outputs()[3]), (Trust::Trusted, 0));
    let position = status.steps;
    // Changing a setting of an axis gives another drill: a new executor on the same device.
    let faster = vec![("x.home_speed".to_owned(), Value::Number(12.0))];
    page.ask(&Ask::Configure { changes: faster });
    until_status(&mut page, |status| status.state == State::NotHomed);
    assert_eq!(last_record(&home_path)["event"], "started");
    let text = fs::read_to_string(home_path.join("executor.log")).unwrap();
    let before: serde_json::Value = serde_json::from_str(text.lines().rev().nth(1).unwrap()).unwrap();
    assert_eq!(before["event"], "finished");
    assert_eq!(before["position"][0], position[0], "the record knows what homing found");
}

/// Two holes on a card with a tool change before the second. The user acts there after longer than any
/// timeout of a machine.
fn at_a_tool_change(answer: &Ask) -> (Tell, Status) {
    let folder = TempDir::new().unwrap();
    let shop = Shop::new(&folder);
    let bridge = Shop::bridge(folder, "100");
    let _mechanics = Mechanics::start(&shop.device);
    let mut page = bridge.page();
    home(&mut page);
    page.ask(&Ask::SetZero);
    let mut program = holes(&shop.machine, 2);
    program.bits.push(Bit {
        diameter: Length::from_um(1_000),
        name: "1.0 mm".into(),
        cutter: Cutter::Drill,
        handling: Default::default(),
    });
    let change = Leg {
        mark: Mark::ToolChange(1),
        commands: vec![
            Command::Spindle { rpm: 0 },
            Command::AwaitBit { bit: 1 },
            Command::Spindle { rpm: 20_000 },
            Command::Dwell { us: 50_000 },
        ],
    };
    program.legs.insert(2, change);
    let touch = vec![("change.lengths".to_owned(), Value::Text("touch".to_owned()))];
    page.ask(&Ask::Configure { changes: touch });
    let (job, stream_digest, failed) = arm(&bridge, &mut page, &program);
    assert_eq!(failed, Vec::<String>::new());
    page.ask(&Ask::Start { job, stream_digest, from_leg: 0 });
    for holes in [0, 1] {
        let asks = |status: &Status| status.state == State::ToolChange && status.holes_done == holes;
        let status = until_status(&mut page, asks);
        let change = status.change.unwrap();
        assert_eq!((change.bit, change.length), (holes, LengthKnown::No));
        assert!(change.is_up && change.is_at_place, "{change:?}");
        assert_eq!(shop.outputs()[3], 0, "the spindle stands");
        // A tool of unknown length does not cut.
        page.ask(&Ask::ToolChanged);
        let refused = page.until(|tell| matches!(tell, Tell::Refused { .. }));
        let Tell::Refused { why } = refused else { panic!("{refused:?}") };
        assert_eq!(why.code, "control.length_first");
        if holes == 0 {
            // Down to the board.
            let down_mm = shop.machine.process.surface.mm() - status.machine_mm[2];
            page.ask(&Ask::Jog { axis: 2, distance_um: (down_mm * 1e3) as i32, anyway: false });
            until_status(&mut page, |status| status.state == State::Jogging);
            while until_status(&mut page, |_| true).state == State::Jogging {
                page.ask(&Ask::JogOn);
            }
            page.ask(&Ask::SetHeight);
            page.ask(&Ask::ToolChanged);
        } else {
            page.ask(&Ask::SameLength);
        }
    }
    let since = Instant::now();
    while since.elapsed() < Duration::from_secs(5) {
        page.ask(&Ask::Ping { stamp: 0.0 });
        assert_eq!(until_status(&mut page, |_| true).alarm, None);
    }
    page.ask(answer);
    let end = page.until_ended();
    let status = until_status(&mut page, |status| !matches!(status.state, State::Stopping | State::Running));
    (end, status)
}

#[test]
fn tool_change_on_a_card_waits_for_an_answer() {
    let (end, status) = at_a_tool_change(&Ask::ToolChanged);
    assert!(matches!(end, Tell::Ended(JobEnd { ending: Ending::Done, holes_done: 2, .. })), "{end:?}");
    assert_eq!((status.alarm, status.trust), (None, Trust::Trusted));
    let (end, status) = at_a_tool_change(&Ask::Stop);
    assert!(matches!(end, Tell::Ended(JobEnd { ending: Ending::Stopped, holes_done: 1, .. })), "{end:?}");
    assert_eq!((status.alarm, status.trust), (None, Trust::Trusted));
}

#[test]
fn killed_bridge_stops_the_machine_and_switches_it_off() {
    let scene = Scene::on_its_way();
    let Scene { shop, mut bridge, mechanics, rested, columns, .. } = scene;
    bridge.child.kill().unwrap();
    bridge.child.wait().unwrap();
    shop.until_let_go();
    drop(mechanics);

    let outputs = shop.outputs();
    assert_eq!(outputs.map(|byte| byte & 0x60), [0; 4], "no forcing: {outputs:02x?}");
    assert_eq!(outputs[3], 0, "the spindle is off");
    assert!(outputs[..3].iter().all(|byte| column(*byte).is_some()), "the windings hold: {outputs:02x?}");
    let home = bridge.home.take().unwrap();
    let record = last_record(home.path());
    assert_eq!(record["event"], "bridge_gone");
    // The count is exact: it agrees with the phases of every axis, modulo the table length.
    for axis in 0..3 {
        let counted = record["position"][axis].as_i64().unwrap() - rested.steps[axis];
        let turned = column(outputs[axis]).unwrap() - columns[axis].unwrap();
        assert_eq!((counted - turned).rem_euclid(8), 0, "axis {axis}");
    }
    let x = record["position"][0].as_i64().unwrap() - rested.steps[0];
    assert!((61..150).contains(&x), "it stopped on its way: {x}");
    // No abrupt stop: the last intervals of X grow to several times the shortest.
    let steps = record["steps"].as_array().unwrap();
    let ticks: Vec<i64> = steps
        .iter()
        .filter(|step| step[1].as_i64().unwrap() & 1 == 1)
        .map(|step| step[0].as_i64().unwrap())
        .collect();
    let intervals: Vec<i64> = ticks.windows(2).map(|two| two[1] - two[0]).collect();
    let ramp = &intervals[intervals.len() - 12..];
    assert!(ramp.windows(2).all(|two| two[1] >= two[0]), "{ramp:?}");
    assert!(ramp[11] > 2 * ramp[0] && intervals.iter().min() < Some(&110_000), "{intervals:?}");

    // The next bridge gets the device, and has no position.
    let again = Shop::bridge(home, "100");
    let status = until_status(&mut again.page(), |_| true);
    assert_eq!((status.state, status.trust), (State::NotHomed, Trust::Lost));
}

#[test]
fn bridge_killed_during_a_plunge_lifts_the_tool() {
    let Scene { shop, mut bridge, mechanics: _mechanics, .. } = Scene::with_the_bit_down();
    bridge.child.kill().unwrap();
    bridge.child.wait().unwrap();
    shop.until_let_go();
    let home = bridge.home.take().unwrap();
    let record = last_record(home.path());
    assert_eq!(
        (record["event"].as_str(), record["position"][2].as_i64()),
        (
            Some("bridge_gone"),
            Some(shop.machine.z.scale.steps(shop.machine.z.max - shop.machine.z.home_offset))
        )
    );
    // At the end only Z moved up, and the spindle is off.
    let steps = record["steps"].as_array().unwrap();
    let last: Vec<(i64, i64)> = steps
        .iter()
        .rev()
        .take(8)
        .map(|step| (step[1].as_i64().unwrap(), step[2].as_i64().unwrap()))
        .collect();
    assert_eq!(last, [(4, 4); 8]);
    assert_eq!(shop.outputs()[3], 0);
}

#[test]
fn late_computer_refuses_faster_steps() {
    let folder = TempDir::new().unwrap();
    let shop = Shop::new(&folder);
    let bridge = Shop::bridge(folder, "50000");
    let mut page = bridge.page();
    let Tell::Timing(timing) = page.until(|tell| matches!(tell, Tell::Timing(_))) else { panic!() };
    assert_eq!(timing.safe_hz, 60.0, "the start–stop rate is safe on any computer");
    assert!(page.take_control(false));
    let (_, _, failed) = arm(&bridge, &mut page, &holes(&shop.machine, 1));
    assert!(failed.contains(&"control.faster_than_clock".to_owned()), "{failed:?}");
    // A slow move is done, a fast one is refused.
    let faster = vec![("x.home_speed".to_owned(), Value::Number(18.0))];
    page.ask(&Ask::Configure { changes: faster });
    page.until(|tell| matches!(tell, Tell::Machine { .. }));
    page.ask(&Ask::Jog { axis: 0, distance_um: 50_000, anyway: false });
    let status = until_status(&mut page, |status| status.state == State::Alarm);
    assert_eq!(status.alarm.unwrap().code, "control.faster_than_clock");
    assert_eq!(shop.outputs(), [0; 4]);
}

#[test]
fn killed_executor_raises_an_alarm_and_restarts() {
    let folder = TempDir::new().unwrap();
    let shop = Shop::new(&folder);
    let bridge = Shop::bridge(folder, "100");
    let _mechanics = Mechanics::start(&shop.device);
    let mut page = bridge.page();
    assert!(page.take_control(false));
    jog(&mut page, 0, 50_000, |status| status.steps[0] > 10);
    // The executor is the bridge's only child.
    let found =
        fs::read_dir(format!("/proc/{}/task", bridge.child.id())).unwrap().flatten().find_map(|task| {
            let text = fs::read_to_string(task.path().join("children")).unwrap_or_default();
            text.split_whitespace().next().map(str::to_owned)
        });
    let pid = found.unwrap();
    assert!(std::process::Command::new("kill").args(["-9", &pid]).status().unwrap().success());
    let status = until_status(&mut page, |status| status.state == State::Alarm);
    assert_eq!((status.trust, status.alarm.unwrap().code.as_str()), (Trust::Lost, "output.executor_gone"));
    page.ask(&Ask::AcknowledgeAlarm);
    until_status(&mut page, |status| status.state == State::NotHomed);
    assert_eq!(shop.outputs(), [0; 4], "a fresh start: everything off");
    jog(&mut page, 0, 1_000, |status| status.state == State::NotHomed && status.steps[0] == 5);
}

#[test]
fn unusable_card_device_is_refused_before_listening() {
    let folder = TempDir::new().unwrap();
    let shop = Shop::new(&folder);
    // Another file in its place is not opened as a card.
    fs::write(&shop.device, b"Dear Sir, I have the honour").unwrap();
    let named = folder.path().join("card.toml").display().to_string();
    let (code, object, _) =
        output(&folder, &["serve", "--port", "0", "--no-open", "--machine", &named, "--json"]);
    assert_eq!((code, object["error"]["code"].as_str()), (3, Some("output.not_a_rehearsal")), "{object}");
    assert_eq!(fs::read(&shop.device).unwrap(), b"Dear Sir, I have the honour");
    fs::remove_file(&shop.device).unwrap();
    let file = folder.path().join("card.toml").display().to_string();
    let (code, object, _) =
        super::client::output(&folder, &["serve", "--port", "0", "--no-open", "--machine", &file, "--json"]);
    assert_eq!((code, object["error"]["code"].as_str()), (3, Some("output.no_device")), "{object}");
    let (code, object, _) = super::client::output(
        &folder,
        &["serve", "--port", "0", "--no-open", "--machine", &file, "--time-scale", "3", "--json"],
    );
    assert_eq!((code, object["error"]["code"].as_str()), (2, Some("control.speed_is_real")), "{object}");
    fs::write(folder.path().join("board.drl"), "M48\nMETRIC\nT1C0.8\n%\nT1\nX5.0Y5.0\nM30\n").unwrap();
    let board = folder.path().join("board.drl").display().to_string();
    let (code, object, _) =
        super::client::output(&folder, &["queue", "run", &board, "--machine", &file, "--json"]);
    assert_eq!((code, object["error"]["code"].as_str()), (2, Some("run.needs_yes")), "{object}");
    let words = ["run", &board, "--machine", &file, "--port", "nowhere", "--json"];
    let (code, object, _) = super::client::output(&folder, &words);
    assert_eq!((code, object["error"]["code"].as_str()), (2, Some("run.port_of_output")), "{object}");
}
