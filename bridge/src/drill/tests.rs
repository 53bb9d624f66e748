//! Tests of the drill in one process, on the virtual drill with and without faults, in a temporary folder.

mod board;
mod disk;
mod feed_override;
mod lab;
mod late;
mod magazine;
mod milling;
mod play;
mod rack;
mod starting;
mod zero;

use super::*;
use annulus_core::chance::Chance;
use annulus_core::control::{Ending, State, Trust};
use annulus_core::geometry::Point;
use annulus_core::job::{Bit, Command, Cutter, Gate, Input, Leg, Mark, Otherwise, Program};
use annulus_core::machine::{StrokeEnd, ToolChange, Value, six_spindles, virtual_drill};
use annulus_core::units::Length;
use annulus_core::wire::{ArmedJob, InterruptedJob, JobEnd, RowVerdict, Status, program};
use annulus_host::Keeper;
use std::time::{Duration, Instant};

const SPEED: f64 = 2_000.0;

fn machine() -> Machine {
    Machine { tool_change: ToolChange::Unattended, ..virtual_drill() }
}

fn grid(machine: &Machine, count: u32) -> Program {
    let process = &machine.process;
    let to = -(process.board_thickness + process.breakthrough);
    let gate = (machine.stroke_end == StrokeEnd::Sensor).then_some(Gate {
        input: Input::ZBottom,
        deadline_us: (machine.longest_drilling_s * 1e6) as u32,
        otherwise: Otherwise::Alarm,
    });
    let mut legs = vec![
        Leg { mark: Mark::ToolChange(0), commands: vec![Command::AwaitBit { bit: 0 }] },
        Leg {
            mark: Mark::Prepare,
            commands: vec![
                Command::Spindle { rpm: 20_000 },
                Command::Dwell { us: (process.spin_up_ms * 1e3) as u32 },
            ],
        },
    ];
    legs.extend((0..count).map(|hole| Leg {
        mark: Mark::Hole(hole),
        commands: vec![
            Command::Rapid { to: place(hole) },
            Command::Plunge { to, feed_um_per_s: (process.feed_mm_per_s * 1e3) as u32, gate },
            Command::Retract { to: process.safe_height },
        ],
    }));
    legs.push(Leg {
        mark: Mark::Finish,
        commands: vec![Command::Spindle { rpm: 0 }, Command::Rapid { to: Point::default() }],
    });
    Program {
        name: "grid".to_owned(),
        machine: machine.fingerprint(),
        origin: Point::default(),
        bits: vec![Bit {
            diameter: Length::from_um(800),
            name: "0.8 mm".to_owned(),
            cutter: Cutter::Drill,
            handling: Default::default(),
        }],
        spindles: 1,
        safe_height: process.safe_height,
        legs,
        accepted: Vec::new(),
    }
}

fn place(hole: u32) -> Point {
    Point::from_mm(f64::from(hole % 10) * 2.5 + 1.0, f64::from(hole / 10) * 2.5 + 1.0)
}

struct Bench {
    drill: Drill,
    folder: tempfile::TempDir,
    tells: mpsc::Receiver<Tell>,
}

impl Bench {
    fn new(machine: &Machine, faults: Faults) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let drill = Drill::open_with(folder.path(), machine.clone(), SPEED, faults).unwrap();
        let tells = drill.watch();
        Self { drill, folder, tells }
    }

    fn status(&self) -> Status {
        let tells = self.drill.greeting();
        tells
            .into_iter()
            .find_map(|tell| if let Tell::Status(status) = tell { Some(*status) } else { None })
            .unwrap()
    }

    fn wait(&self, what: impl Fn(&Status) -> bool) -> Status {
        let since = Instant::now();
        loop {
            let status = self.status();
            if what(&status) {
                return status;
            }
            assert!(since.elapsed() < Duration::from_secs(60), "waited in vain: {status:?}");
            std::thread::sleep(Duration::from_millis(2));
        }
    }

    fn home(&self) {
        self.drill.ask(Ask::Home).unwrap();
        self.wait(|status| status.state == State::Ready || status.state == State::Alarm);
    }

    fn arm(&self, program: &Program) -> (String, String, Vec<annulus_core::wire::PreflightRow>) {
        let bytes = program::encode(program);
        let key = program::key(&bytes);
        self.drill.upload(&key, &bytes).unwrap();
        let tells = self.drill.ask(Ask::Arm { job: key.clone(), from_leg: 0 }).unwrap();
        let Some(Tell::Armed(ArmedJob { stream_digest, checks, .. })) = tells.into_iter().next() else {
            panic!("no verdict")
        };
        (key, stream_digest, checks)
    }

    fn start(&self, program: &Program) {
        self.home();
        self.start_here(program);
    }

    fn start_here(&self, program: &Program) {
        self.drill.ask(Ask::SetZero).unwrap();
        let (job, stream_digest, checks) = self.arm(program);
        assert!(checks.iter().all(|row| row.verdict != RowVerdict::Fail), "{checks:?}");
        self.drill.ask(Ask::Start { job, stream_digest, from_leg: 0 }).unwrap();
    }

    fn offer(&self) -> Option<u32> {
        self.drill.greeting().into_iter().find_map(|tell| match tell {
            Tell::Interrupted(InterruptedJob { next_leg, .. }) => Some(next_leg),
            _ => None,
        })
    }

    fn take_up(&self, program: &Program) {
        let from_leg = self.offer().unwrap();
        let (job, stream_digest, _) = self.arm(program);
        self.drill.ask(Ask::Start { job, stream_digest, from_leg }).unwrap();
    }

    fn ended(&mut self) -> (Ending, u32) {
        let since = Instant::now();
        loop {
            match self.tells.try_recv() {
                Ok(Tell::Ended(JobEnd { ending, holes_done, .. })) => return (ending, holes_done),
                Ok(_) => {}
                Err(mpsc::error::TryRecvError::Empty) => std::thread::sleep(Duration::from_millis(1)),
                Err(mpsc::error::TryRecvError::Disconnected) => panic!("the drill is gone"),
            }
            assert!(since.elapsed() < Duration::from_secs(300), "no end: {:?}", self.status());
        }
    }

    fn record(&self) -> Vec<[f64; 3]> {
        holes(&self.folder.path().join(RECORD))
    }
}

fn holes(path: &Path) -> Vec<[f64; 3]> {
    let text = fs::read_to_string(path).unwrap();
    let rows = text.lines().map(|line| {
        let numbers: Vec<f64> = line.split(' ').map(|word| word.parse().unwrap()).collect();
        [numbers[0], numbers[1], numbers[2]]
    });
    rows.collect()
}

/// How often each hole of the grid is in the record; panics at any other hole.
fn counts(record: &[[f64; 3]], count: u32) -> Vec<u32> {
    let mut counts = vec![0; count as usize];
    for [x, y, depth] in record {
        let hole = (0..count).find(|hole| {
            let at = place(*hole);
            // After homing the head is 1 mm from the sensors; that is the work zero here.
            (at.x.mm() + 1.0 - x).abs() < 0.03 && (at.y.mm() + 1.0 - y).abs() < 0.03
        });
        counts[hole.unwrap_or_else(|| panic!("a hole where none should be: {x} {y}")) as usize] += 1;
        assert!(*depth >= 1.6, "{depth}");
    }
    counts
}

#[test]
fn every_hole_of_a_board_is_drilled_once() {
    let mut bench = Bench::new(&machine(), Faults::default());
    bench.start(&grid(&machine(), 30));
    assert_eq!(bench.ended(), (Ending::Done, 30));
    assert_eq!(counts(&bench.record(), 30), [1; 30]);
    let status = bench.wait(|status| status.state == State::Ready);
    assert_eq!((status.trust, status.spindle_rpm), (Trust::Trusted, 0));
    assert!(bench.drill.greeting().iter().all(|tell| !matches!(tell, Tell::Interrupted(_))));
}

#[test]
fn stop_at_any_time_keeps_the_position_and_the_job_resumes() {
    let program = grid(&machine(), 20);
    let mut chance = Chance::new(99);
    for round in 0..12 {
        let mut bench = Bench::new(&machine(), Faults::default());
        bench.start(&program);
        let mut stops = 0;
        loop {
            std::thread::sleep(Duration::from_micros(chance.bits() % 6_000));
            bench.drill.ask(Ask::Stop).unwrap();
            let status = bench.wait(|status| status.state == State::Ready);
            assert_eq!((status.trust, status.spindle_rpm), (Trust::Trusted, 0), "round {round}");
            let (ending, _) = bench.ended();
            // A stop during the final lift leaves it where it is, out of the board.
            let up =
                if ending == Ending::Done { status.work_mm[2] > 0.0 } else { status.machine_mm[2] > -1.01 };
            assert!(up, "the tip is up: {status:?}");
            if ending == Ending::Done {
                break;
            }
            assert_eq!(ending, Ending::Stopped);
            stops += 1;
            bench.take_up(&program);
            if stops > 4 {
                assert_eq!(bench.ended().0, Ending::Done);
                break;
            }
        }
        let counts = counts(&bench.record(), 20);
        let repeated: u32 = counts.iter().map(|count| count - 1).sum();
        assert!(counts.iter().all(|count| *count >= 1), "round {round}: {counts:?}");
        assert!(repeated <= stops, "round {round}, {stops} stops: {counts:?}");
    }
}

#[test]
fn slow_listener_misses_statuses_but_no_other_report() {
    let bench = Bench::new(&machine(), Faults::default());
    let (status, listeners) = (Tell::Status(Box::new(bench.status())), Listeners::default());
    let (mut slow, gone) = (listeners.add(), listeners.add());
    drop(gone);
    for report in 0..1_000 {
        listeners.tell(&status);
        if report % 100 == 0 {
            listeners.tell(&Tell::Welcome { viewer: report });
        }
    }
    let (mut statuses, mut others) = (0, Vec::new());
    while let Ok(tell) = slow.try_recv() {
        match tell {
            Tell::Welcome { viewer } => others.push(viewer),
            _ => statuses += 1,
        }
    }
    assert!((200..=256).contains(&statuses), "{statuses}");
    assert_eq!(others, (0..10).map(|turn| turn * 100).collect::<Vec<_>>());
}

#[test]
fn pause_and_stop_after_hole_act_between_two_holes() {
    let mut bench = Bench::new(&machine(), Faults::default());
    bench.start(&grid(&machine(), 60));
    bench.drill.ask(Ask::Pause).unwrap();
    // The status shows the request at once; the spindle follows a moment later.
    let status = bench.wait(|status| status.state == State::Paused && status.spindle_rpm == 0);
    let before = status.holes_done;
    assert!(status.work_mm[2] > 0.0, "the bit is out of the board: {:?}", status.work_mm);
    bench.drill.ask(Ask::Resume).unwrap();
    bench.wait(|status| status.holes_done > before + 2);
    bench.drill.ask(Ask::StopAfterHole).unwrap();
    let (ending, done) = bench.ended();
    assert_eq!(ending, Ending::StoppedAfterHole);
    assert_eq!(bench.record().len() as u32, done, "whole holes only");
}

#[test]
fn tool_change_waits_for_confirmation_without_motion() {
    let machine = virtual_drill();
    let mut bench = Bench::new(&machine, Faults::default());
    bench.start(&grid(&machine, 3));
    let status = bench.wait(|status| status.state == State::ToolChange);
    std::thread::sleep(Duration::from_millis(30));
    assert_eq!(bench.status().machine_mm, status.machine_mm);
    bench.drill.ask(Ask::ToolChanged).unwrap();
    assert_eq!(bench.ended(), (Ending::Done, 3));
}

#[test]
fn jog_before_homing_is_limited_to_the_travel() {
    let blind = Faults { stuck_off: Input::XMin.bit() | Input::XMax.bit(), ..Faults::default() };
    let travel = machine().x.scale.steps(machine().x.max - machine().x.min);
    for distance_um in [5_000_000, -5_000_000] {
        let bench = Bench::new(&machine(), blind.clone());
        bench.drill.ask(Ask::Jog { axis: 0, distance_um, anyway: false }).unwrap();
        // Renewed like a held button; a slow computer would end it sooner.
        let status = bench.wait(|status| {
            let _ = bench.drill.ask(Ask::JogOn);
            status.state != State::Jogging
        });
        assert_eq!(status.steps[0].abs(), travel);
    }
}

fn homing_alarm(faults: Faults) -> String {
    let bench = Bench::new(&machine(), faults);
    bench.home();
    let status = bench.status();
    assert_eq!((status.state, status.trust), (State::Alarm, Trust::Lost));
    assert_eq!(bench.drill.ask(Ask::Home).unwrap_err().code, "control.alarm_unread");
    bench.wait(|_| bench.drill.ask(Ask::AcknowledgeAlarm).is_ok());
    assert_eq!(bench.status().state, State::NotHomed);
    status.alarm.unwrap().code
}

#[test]
fn stuck_sensors_raise_homing_alarms() {
    let stuck_on = |input: Input| Faults { stuck_on: input.bit(), ..Faults::default() };
    let stuck_off = |input: Input| Faults { stuck_off: input.bit(), ..Faults::default() };
    assert_eq!(homing_alarm(stuck_on(Input::XMin)), "control.sensor_stuck");
    assert_eq!(homing_alarm(stuck_on(Input::ZTop)), "control.sensor_stuck");
    assert_eq!(homing_alarm(stuck_off(Input::YMin)), "control.sensor_not_found");
    assert_eq!(homing_alarm(stuck_off(Input::ZTop)), "control.sensor_not_found");
}

#[test]
fn stalling_motor_raises_an_alarm_and_homing_reports_the_slip() {
    // The motor stalls above 9 kHz; rapids of this program exceed that, homing does not.
    let weak = Faults { weak_motors_hz: [Some(9_000.0), None, None], ..Faults::default() };
    let mut bench = Bench::new(&machine(), weak);
    let mut program = grid(&machine(), 2);
    let far = Command::Rapid { to: Point::from_mm(200.0, 10.0) };
    program.legs[3].commands[0] = far;
    bench.start(&program);
    let (ending, _) = bench.ended();
    let code = bench.wait(|status| status.state == State::Alarm).alarm.unwrap().code;
    assert_eq!(code, if ending == Ending::Alarm { "control.end_sensor" } else { "control.board_differs" });
    bench.wait(|_| bench.drill.ask(Ask::AcknowledgeAlarm).is_ok());
    assert_eq!(bench.status().state, State::NotHomed);
    bench.home();
    let status = bench.status();
    let alarm = status.alarm.expect("homing finds what is missing");
    assert_eq!((status.state, alarm.code.as_str()), (State::Alarm, "control.lost_count"));
    let slip = status.slips.first().expect("and the drill knows where");
    assert_eq!((slip.axis, slip.cause.as_str()), (0, "too_fast"));
    assert!(slip.lost >= 4 && (0.0..300.0).contains(&slip.place_mm), "{slip:?}");
}

#[test]
fn lost_step_is_reported_by_the_next_homing() {
    let faults = Faults { lost_steps: vec![(1, 25_000)], ..Faults::default() };
    let mut bench = Bench::new(&machine(), faults);
    let mut program = grid(&machine(), 2);
    program.legs[3].commands[0] = Command::Rapid { to: Point::from_mm(10.0, 180.0) };
    bench.start(&program);
    bench.ended();
    let told = bench.wait(|status| status.state == State::Alarm);
    assert_eq!((told.alarm.unwrap().code.as_str(), told.trust), ("control.board_differs", Trust::Suspect));
    bench.wait(|_| bench.drill.ask(Ask::AcknowledgeAlarm).is_ok());
    bench.home();
    let status = bench.status();
    assert_eq!(status.slips.len(), 1, "{:?}", status.slips);
    assert_eq!(status.alarm.unwrap().code, "control.lost_count");
}

#[test]
fn one_percent_sensor_glitches_do_not_disturb_a_job() {
    let sensed = Machine { stroke_end: StrokeEnd::Sensor, longest_drilling_s: 1.0, ..machine() };
    for machine in [machine(), sensed] {
        let mut bench = Bench::new(&machine, Faults { glitches: 0.01, ..Faults::default() });
        bench.start(&grid(&machine, 10));
        assert_eq!(bench.ended(), (Ending::Done, 10));
        assert_eq!(bench.record().len(), 10);
    }
}

#[test]
fn worn_tool_raises_the_drilling_time_alarm() {
    let sensed = Machine { stroke_end: StrokeEnd::Sensor, longest_drilling_s: 1.0, ..machine() };
    let mut bench = Bench::new(&sensed, Faults { bit_life: Some(10), ..Faults::default() });
    bench.start(&grid(&sensed, 40));
    let (ending, holes) = bench.ended();
    assert_eq!(ending, Ending::Alarm);
    assert!((10..20).contains(&holes), "{holes} holes");
    assert_eq!(bench.status().alarm.unwrap().code, "control.drilling_too_long");
    assert_eq!(bench.status().slips[0].cause, "held");
}

#[test]
fn dull_tool_raises_the_drilling_time_alarm_and_is_lifted() {
    let sharp = Machine { stroke_end: StrokeEnd::Sensor, longest_drilling_s: 1.0, ..machine() };
    let mut bench = Bench::new(&sharp, Faults::default());
    bench.start(&grid(&sharp, 5));
    assert_eq!(bench.ended(), (Ending::Done, 5));
    assert_eq!(bench.record().len(), 5, "strokes ended by the lower sensor");

    let dull = Faults { dull_bit_hz: Some(300.0), ..Faults::default() };
    let mut bench = Bench::new(&sharp, dull);
    bench.start(&grid(&sharp, 5));
    assert_eq!(bench.ended(), (Ending::Alarm, 0));
    let status = bench.wait(|status| status.state == State::Alarm && status.spindle_rpm == 0);
    assert_eq!(status.alarm.unwrap().code, "control.drilling_too_long");
    let status = bench.wait(|status| status.work_mm[2] >= sharp.process.safe_height.mm());
    assert_eq!(status.state, State::Alarm, "the bit was lifted");
}
