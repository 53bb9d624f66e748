//! Tests of command queues and manual outputs, on the virtual drill with and without faults.

use super::{Bench, Drill, holes};
use crate::hosted::Hosted;
use annulus_core::chance::Chance;
use annulus_core::control::{Ending, State, Trust};
use annulus_core::job::Input;
use annulus_core::machine::{Card, Machine, RackTool, StrokeEnd};
use annulus_core::queue::{Mode, RowResult, RowState};
use annulus_core::units::Length;
use annulus_core::virtual_drill::Faults;
use annulus_core::wire::{Ask, Outputs, QueuePhase, QueueStatus, Tell};
use std::time::Duration;

const FOUR: &str = "SPINDLE 20000\nREPEAT 2\nMOVE_BY 400 0\nCALL hole\nMOVE_TO 5 10\nCALL hole\nEND\nSUB hole\n\
    KMD_WIERTLO_DOL\nKMD_WIERTLO_GORA\nEND\n";

fn machine() -> Machine {
    let mut card = Card::default();
    (card.wiring.outputs, card.wiring.output_names) = (vec![25, 26], "lamp vacuum".to_owned());
    Machine { card, ..super::machine() }
}

impl Bench {
    fn load(&self, text: &str) -> Result<(), String> {
        self.drill.ask(Ask::Queue { text: text.to_owned() }).map(|_| ()).map_err(|why| why.code)
    }

    fn go(&self, mode: Mode) -> Result<(), String> {
        self.drill.ask(Ask::QueueRun { mode }).map(|_| ()).map_err(|why| why.code)
    }

    fn queue(&self) -> QueueStatus {
        let tells = self.drill.greeting().into_iter();
        tells
            .filter_map(|tell| if let Tell::Queue(status) = tell { Some(*status) } else { None })
            .next()
            .unwrap()
    }

    fn outputs(&self) -> Outputs {
        let tells = self.drill.greeting().into_iter();
        tells
            .filter_map(|tell| if let Tell::Outputs(outputs) = tell { Some(outputs) } else { None })
            .next()
            .unwrap()
    }

    fn ready(&self) {
        self.home();
        self.drill.ask(Ask::SetZero).unwrap();
    }
}

fn result(status: &QueueStatus, row: u32) -> RowResult {
    status.results.iter().find(|(at, _)| *at == row).map(|(_, result)| result.clone()).unwrap_or_default()
}

#[test]
fn queue_drills_its_holes_and_reports_every_row() {
    for machine in [machine(), Machine { stroke_end: StrokeEnd::Sensor, ..machine() }] {
        let bench = Bench::new(&machine, Faults::default());
        bench.ready();
        bench.load(FOUR).unwrap();
        assert_eq!((bench.queue().phase, bench.queue().total), (QueuePhase::Ready, 2 + 2 * 11));
        bench.go(Mode::ToEnd).unwrap();
        let status = bench.wait(|status| status.state == State::Ready);
        assert_eq!((status.trust, status.job), (Trust::Trusted, None));
        bench.wait(|status| status.spindle_rpm == 0);
        let queue = bench.queue();
        assert_eq!((queue.phase, queue.row, queue.passed), (QueuePhase::Done, None, queue.total));
        let turns: Vec<u32> = (0..11).map(|row| result(&queue, row).turns).collect();
        assert_eq!(turns, [1, 1, 2, 2, 2, 2, 2, 0, 4, 4, 4]);
        let drilled = holes(&bench.folder.path().join(super::RECORD));
        let wanted = [(6.0, 1.0), (6.0, 11.0), (11.0, 11.0), (6.0, 11.0)];
        assert_eq!(drilled.len(), 4);
        for ([x, y, depth], (right, away)) in drilled.iter().zip(wanted) {
            assert!((x - right).abs() < 0.02 && (y - away).abs() < 0.02 && *depth >= 1.6, "{x} {y} {depth}");
        }
        assert_eq!(bench.go(Mode::ToEnd), Err("control.queue_over".into()));
        bench.load(FOUR).unwrap();
        assert_eq!(bench.queue().phase, QueuePhase::Ready);
    }
}

#[test]
fn queue_holes_count_as_wear_of_the_loaded_tool() {
    let rack = vec![RackTool::drill(5, Length::from_um(800))];
    let machine = Machine { rack, ..machine() };
    let mut bench = Bench::new(&machine, Faults::default());
    let hits = |bench: &Bench| {
        let tells = bench.drill.greeting().into_iter();
        let mut reports =
            tells.filter_map(|tell| if let Tell::Tools(report) = tell { Some(report) } else { None });
        let report = reports.next().unwrap();
        report.wear.iter().map(|wear| (wear.number, wear.hits)).collect::<Vec<_>>()
    };
    let run = |bench: &Bench, text: &str, phase: QueuePhase| {
        bench.load(text).unwrap();
        bench.go(Mode::ToEnd).unwrap();
        bench.wait(|status| {
            matches!(status.state, State::Ready | State::Alarm) && bench.queue().phase == phase
        });
    };
    bench.ready();
    run(&bench, FOUR, QueuePhase::Done);
    assert_eq!(hits(&bench), [], "nobody knows which tool is in");
    bench.start_here(&super::grid(&machine, 3));
    assert_eq!(bench.ended(), (Ending::Done, 3));
    bench.wait(|status| status.state == State::Ready);
    run(&bench, FOUR, QueuePhase::Done);
    assert_eq!(hits(&bench), [(5, 3 + 4)]);
    // The wear is in the journal.
    let Bench { drill, folder, .. } = bench;
    drill.shutdown();
    let drill = Drill::open_with(folder.path(), machine, super::SPEED, Faults::default()).unwrap();
    let tells = drill.watch();
    assert_eq!(hits(&Bench { drill, folder, tells }), [(5, 7)]);
}

#[test]
fn invalid_queues_are_refused_before_any_motion() {
    let bench = Bench::new(&machine(), Faults::default());
    assert_eq!(bench.go(Mode::Step), Err("control.no_queue".into()));
    assert_eq!(bench.load("MOVE_BY 1 1"), Err("queue.not_homed".into()));
    bench.ready();
    let rows = [
        ("FLY", "queue.unknown_far"),
        ("MOVE_BY 1", "queue.missing"),
        ("WAIT 1\nMOVE_TO 300 0", "queue.outside"),
        ("DRILL_DOWN", "queue.spindle_off"),
        ("OUTPUT pump ON", "queue.no_such_output"),
        ("", "queue.empty"),
    ];
    for (text, code) in rows {
        assert_eq!(bench.load(text), Err(code.into()), "{text}");
    }
    assert_eq!(bench.queue().phase, QueuePhase::None);
    // A queue is checked again when it starts.
    bench.load("MOVE_BY 23000 0").unwrap();
    bench.drill.ask(Ask::Jog { axis: 0, distance_um: 50_000, anyway: false }).unwrap();
    let status = bench.wait(|status| status.state == State::Ready && status.steps[0] > 4_000);
    assert_eq!(bench.go(Mode::ToEnd), Err("queue.outside".into()));
    assert_eq!(bench.status().steps, status.steps);
}

#[test]
fn queue_steps_pauses_and_resumes_with_the_spindle_on() {
    let bench = Bench::new(&machine(), Faults::default());
    bench.ready();
    bench.load("SPINDLE 9000\nMOVE_BY 10 0\n* DRILL_DOWN\nDRILL_UP\n* WAIT 5\nWAIT 100000\nWAIT 1").unwrap();
    let held = |row| {
        bench.wait(|status| status.state == State::Paused);
        assert_eq!((bench.queue().phase, bench.queue().row), (QueuePhase::Held, Some(row)));
    };
    bench.go(Mode::Step).unwrap();
    held(1);
    bench.go(Mode::ToBreakpoint).unwrap();
    held(2);
    bench.wait(|status| status.spindle_rpm == 9_000);
    assert_eq!(bench.load("WAIT 1"), Err("control.busy".into()));
    assert_eq!(bench.drill.ask(Ask::Home).unwrap_err().code, "control.busy");
    bench.go(Mode::Step).unwrap();
    bench.wait(|status| status.state == State::Paused && status.work_mm[2] < -1.6);
    held(3);
    bench.drill.ask(Ask::Resume).unwrap();
    held(4);
    bench.go(Mode::ToBreakpoint).unwrap();
    bench.wait(|_| result(&bench.queue(), 5).state == RowState::Working);
    bench.drill.ask(Ask::Pause).unwrap();
    let status = bench.wait(|status| status.state == State::Paused);
    assert_eq!((status.spindle_rpm, bench.queue().row), (9_000, Some(6)));
    assert_eq!(result(&bench.queue(), 5).ms, 100_000.0);
    bench.drill.ask(Ask::Stop).unwrap();
    bench.wait(|status| status.state == State::Ready && status.spindle_rpm == 0);
    assert_eq!(bench.queue().phase, QueuePhase::Stopped);
    assert_eq!(bench.status().trust, Trust::Trusted);
}

#[test]
fn queue_is_trusted_after_it_has_homed_all_axes() {
    let bench = Bench::new(&machine(), Faults::default());
    bench.load("HOME Z\nHOME X\nHOME Y\nMOVE_BY 40 40\n* WAIT 1\nHOME X").unwrap();
    bench.go(Mode::Step).unwrap();
    bench.wait(|status| status.state == State::Paused);
    assert_eq!(bench.status().trust, Trust::Lost, "two axes are not known");
    bench.go(Mode::ToBreakpoint).unwrap();
    let status = bench.wait(|status| status.state == State::Paused && status.trust == Trust::Trusted);
    assert_eq!((status.steps[0], status.steps[1]), (79 + 40, 79 + 40));
    bench.go(Mode::ToEnd).unwrap();
    let status = bench.wait(|status| status.state == State::Ready);
    assert_eq!((status.trust, status.steps[0]), (Trust::Trusted, 79));
}

#[test]
fn stop_in_any_queue_row_keeps_position_and_lifts_the_tool() {
    let mut chance = Chance::new(11);
    let mut stopped = 0;
    let bench = Bench::new(&machine(), Faults::default());
    bench.ready();
    for round in 0..25 {
        // First straight back to the start, so that the same queue fits again.
        bench.load(&format!("MOVE_TO 0 0\nOUTPUT lamp ON\n{FOUR}")).unwrap();
        bench.go(Mode::ToEnd).unwrap();
        std::thread::sleep(Duration::from_micros(chance.bits() % 9_000));
        bench.drill.ask(Ask::Stop).unwrap();
        let status = bench.wait(|status| status.state == State::Ready && status.spindle_rpm == 0);
        assert_eq!(status.trust, Trust::Trusted, "round {round}");
        let queue = bench.queue();
        // A stop during the final lift leaves it where it is.
        assert!(queue.phase == QueuePhase::Done || status.machine_mm[2] > -1.01, "the tip is up: {status:?}");
        let here: Vec<u32> = queue
            .results
            .iter()
            .filter(|(_, result)| matches!(result.state, RowState::StoppedHere | RowState::Working))
            .map(|(row, _)| *row)
            .collect();
        match queue.phase {
            QueuePhase::Stopped => {
                assert_eq!((here.len(), Some(here[0])), (1, queue.row), "round {round}: {queue:?}");
                stopped += 1;
            }
            QueuePhase::Done => assert!(here.is_empty()),
            other => panic!("round {round}: {other:?}"),
        }
    }
    assert!(stopped > 5, "{stopped} of 25 were stopped");
    bench.drill.ask(Ask::Home).unwrap();
    let status = bench.wait(|status| status.state == State::Ready || status.state == State::Alarm);
    assert_eq!(status.alarm, None, "no step was lost");
}

#[test]
fn faults_stop_the_queue_with_their_alarm() {
    let stuck = Faults { stuck_off: Input::XMin.bit(), ..Faults::default() };
    let bench = Bench::new(&machine(), stuck);
    bench.load("HOME ALL\nWAIT 1").unwrap();
    bench.go(Mode::ToEnd).unwrap();
    let status = bench.wait(|status| status.state == State::Alarm);
    let queue = bench.queue();
    assert_eq!(status.alarm.as_ref().map(|why| why.code.as_str()), Some("control.sensor_not_found"));
    assert_eq!(
        (status.trust, queue.phase, queue.why.clone()),
        (Trust::Lost, QueuePhase::Failed, status.alarm)
    );
    assert_eq!(result(&queue, 0).state, RowState::Refused);

    let dull = Faults { dull_bit_hz: Some(300.0), ..Faults::default() };
    let sensor = Machine { stroke_end: StrokeEnd::Sensor, longest_drilling_s: 1.0, ..machine() };
    let bench = Bench::new(&sensor, dull);
    bench.ready();
    bench.load("SPINDLE 20000\nDRILL_DOWN\nDRILL_UP").unwrap();
    bench.go(Mode::ToEnd).unwrap();
    let status = bench.wait(|status| status.state == State::Alarm && status.spindle_rpm == 0);
    assert_eq!(status.alarm.map(|why| why.code), Some("control.drilling_too_long".into()));
    bench.wait(|status| status.work_mm[2] >= sensor.process.safe_height.mm());
    assert_eq!(result(&bench.queue(), 2).state, RowState::Waiting);

    let bench = Bench::new(&machine(), Faults::default());
    bench.load("WAIT_INPUT CONTACT ON 50").unwrap();
    bench.go(Mode::ToEnd).unwrap();
    let status = bench.wait(|status| status.state == State::Alarm);
    assert_eq!(status.alarm.map(|why| why.code), Some("queue.input_timeout".into()));
    bench.wait(|_| bench.drill.ask(Ask::AcknowledgeAlarm).is_ok());
    bench.load("HOME ALL").unwrap();
    bench.go(Mode::ToEnd).unwrap();
    bench.wait(|status| status.state == State::Ready);
}

#[test]
fn outputs_need_a_lease_and_any_motion_locks_them() {
    let bench = Bench::new(&machine(), Faults::default());
    let output = |name: &str, on, pulse_ms| {
        bench.drill.ask(Ask::Output { name: name.to_owned(), on, pulse_ms }).map_err(|why| why.code)
    };
    let lease = |minutes| bench.drill.ask(Ask::OutputLease { minutes }).map_err(|why| why.code);
    assert_eq!(bench.outputs().names, ["spindle", "lamp", "vacuum"]);
    assert_eq!(
        (bench.outputs().left_s, output("lamp", true, None)),
        (None, Err("control.outputs_locked".into()))
    );
    assert_eq!(lease(6), Err("control.lease_range".into()));
    lease(5).unwrap();
    assert!(bench.outputs().left_s.unwrap() > 290.0);
    assert_eq!(output("pump", true, None), Err("control.no_such_output".into()));
    assert_eq!(output("lamp", true, Some(0)), Err("control.pulse_range".into()));
    output("lamp", true, None).unwrap();
    output("vacuum", true, Some(20)).unwrap();
    assert_eq!(bench.outputs().on & 0b010, 0b010);
    bench.wait(|_| bench.outputs().on == 0b010);
    output("spindle", true, None).unwrap();
    bench.wait(|status| status.spindle_rpm == machine().process.spindle_rpm);
    bench.home();
    let outputs = bench.outputs();
    assert_eq!((outputs.on, outputs.left_s), (0, None), "locked by the motion");
    assert_eq!(bench.status().spindle_rpm, 0);
    lease(1).unwrap();
    output("lamp", true, None).unwrap();
    bench.drill.ask(Ask::Stop).unwrap();
    assert_eq!((bench.outputs().on, bench.outputs().left_s), (0, None), "locked by STOP");
    bench.load("WAIT 1\nWAIT 1").unwrap();
    bench.go(Mode::Step).unwrap();
    bench.wait(|status| status.state == State::Paused);
    assert_eq!(lease(5), Err("control.busy".into()), "not in the middle of a queue");
}
