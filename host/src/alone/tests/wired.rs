//! Tests of a machine on an adapter with all sensors wired: the board is touched to the step, and faults
//! show as in the manual.

use super::port::{machine, opened};
use super::touch::{THICK_MM, TOLERANCE_MM, deepened, wish};
use super::*;
use annulus_core::job::Input;
use annulus_core::machine::{Machine, apply};
use annulus_core::virtual_drill::faults::{FAULTS, read};
use annulus_core::virtual_drill::{Faults, UnevenBoard};
use std::collections::BTreeSet;

const CONTACT: u8 = 6;

/// Wires the contact sensor; it excludes overlapping moves.
fn changes() -> Vec<(String, Value)> {
    let sensors = Value::Numbers((0..7).map(f64::from).collect());
    let rows = [("adapter.sensors", sensors), ("overlap.on", Value::Text("no".to_owned()))];
    rows.map(|(key, value)| (key.to_owned(), value)).to_vec()
}

fn wired() -> Machine {
    apply(&machine(), &changes()).unwrap()
}

fn program(count: usize) -> Program {
    drilled::holes(&wired(), count, 4, |_| 800)
}

fn homed(files: &Memory, faults: Faults) -> Bench {
    let mut bench = opened(files, World::broken_by(&wired(), files, faults), 1);
    (0..50).for_each(|_| bench.turn(TURN));
    bench.ask(&Ask::Configure { changes: changes() });
    assert_eq!(bench.refused(), None);
    bench.turn(Duration::from_millis(200));
    bench.home();
    bench
}

impl Bench {
    fn moved(&mut self, axis: u8, mm: f64) {
        self.ask(&Ask::Jog { axis, distance_um: (mm * 1e3).round() as i32, anyway: false });
        self.until(|status| status.state == State::Jogging);
        while self.status().state == State::Jogging {
            self.ask(&Ask::JogOn);
            self.turn(TURN);
        }
    }

    /// Waits until nothing moves. Returns the code of the alarm, if any.
    fn rested(&mut self) -> Option<String> {
        let is_over = |state: State| matches!(state, State::Ready | State::Alarm | State::NotHomed);
        let status = self.until(|status| is_over(status.state) && status.stage.is_none());
        status.alarm.map(|why| why.code)
    }

    fn closed(&mut self) -> Vec<[i64; 3]> {
        let stops = self.world().stops.iter();
        stops.filter(|(_, input)| *input == CONTACT).map(|(at, _)| *at).collect()
    }
}

#[test]
fn adapter_survey_is_exact_to_the_step() {
    let (files, machine) = (Memory::default(), wired());
    let uneven = Some(UnevenBoard::BOWED);
    let mut bench = homed(&files, Faults { uneven, ..Faults::default() });
    bench.ask(&Ask::SetZero);
    bench.turn(Duration::from_millis(200));
    let just_through = deepened(program(12), THICK_MM + TOLERANCE_MM);
    let just_not = deepened(program(12), THICK_MM - TOLERANCE_MM);
    assert!(bench.through(&files, &just_through) < 6, "without a map");
    let report = bench.survey(&just_through);
    assert_eq!((report.goes, bench.status().alarm.clone()), (false, None));
    let (grid, zero, closed) = (report.grid.unwrap(), bench.status().zero_mm.unwrap(), bench.closed());
    assert_eq!((report.heights.len(), closed.len()), (6, 6), "{closed:?}");
    let mm = |at: &[i64; 3], axis: usize| machine.axis(axis).scale.length(at[axis]).mm();
    for (index, height) in report.heights.iter().enumerate() {
        let place = grid.nth(index);
        let [x, y] = [place.x.mm() + zero[0], place.y.mm() + zero[1]];
        let near = |at: &&[i64; 3]| (mm(at, 0) - x).abs() < 0.01 && (mm(at, 1) - y).abs() < 0.01;
        let at = closed.iter().find(near).unwrap_or_else(|| panic!("{index}: {closed:?}"));
        let found = machine.z.scale.length(at[2]) - machine.process.surface;
        assert_eq!(height.unwrap(), found, "{index}");
        assert!((found.mm() - UnevenBoard::BOWED.raised_mm(x, y)).abs() < 0.006, "{index}: {found:?}");
    }
    // The pulses stopped where the machine counts itself to be, and the tool is up again.
    let (real, status) = (bench.world().real(), bench.status().clone());
    assert_eq!(real[..], status.steps[..3]);
    assert!(status.work_mm[2] > 0.9, "{status:?}");
    let (_, levelled, codes) = bench.armed(&just_through, 0);
    assert_eq!((levelled, codes), (true, vec!["level.follows".to_owned()]));
    assert_eq!((bench.through(&files, &just_through), bench.through(&files, &just_not)), (12, 0));
}

#[test]
fn adapter_finds_height_and_edge_of_a_board() {
    let (files, machine) = (Memory::default(), wired());
    let mut bench = homed(&files, Faults::default());
    bench.ask(&Ask::Probe { depth_um: 45_000, plate_um: 1_500 });
    bench.until(|status| status.state == State::Running);
    assert_eq!(bench.rested(), None);
    let closed = bench.closed();
    let told = bench.heard.iter().rev().find_map(|tell| match tell {
        Tell::Machine { settings, .. } => {
            settings.iter().find(|(key, _)| key == "stroke.surface").map(|(_, value)| value.clone())
        }
        _ => None,
    });
    let surface = machine.z.scale.length(closed[0][2]) - Length::from_um(1_500);
    assert_eq!((closed.len(), told), (1, Some(Value::Number(surface.mm()))));
    // Off the board and below its surface; the tool went up by itself.
    bench.moved(1, 5.0);
    let [x, _, z] = bench.status().machine_mm;
    bench.moved(0, -x);
    bench.moved(2, machine.z.scale.length(closed[0][2]).mm() - 1.0 - z);
    bench.ask(&Ask::Edge { axis: 0, up: true, reach_um: 5_000, tool_um: 800 });
    bench.until(|status| status.state == State::Running);
    let ends = bench.rested();
    let broken = bench.world().broken();
    assert_eq!((ends, broken), (None, None), "{:?}", bench.status());
    let (closed, status) = (bench.closed(), bench.status().clone());
    let zero = machine.x.scale.length(closed[1][0] + machine.x.scale.steps(Length::from_um(400))).mm();
    assert_eq!((closed.len(), status.zero_mm.map(|zero| zero[0])), (2, Some(zero)));
    assert!(status.machine_mm[0] < zero - 0.4, "it stands off the edge: {status:?}");
}

#[test]
fn unplugging_during_a_survey_leaves_no_wrong_map() {
    // On the long way down to the first point, and between two points, where no touch is due.
    for (done, turns, seen) in [(0, 250, Some("adapter.ran_dry")), (2, 0, None)] {
        let mut bench = homed(&Memory::default(), Faults::default());
        bench.ask(&Ask::SetZero);
        bench.turn(Duration::from_millis(200));
        bench.ask(&wish(&program(12)));
        while bench.report().done < done {
            bench.turn(TURN);
        }
        (0..turns).for_each(|_| bench.turn(TURN));
        bench.world().plug(false);
        (0..250).for_each(|_| bench.turn(TURN));
        bench.world().plug(true);
        assert_eq!(bench.rested().as_deref(), seen);
        let report = bench.report();
        let heights: Vec<f64> = report.heights.iter().flatten().map(|height| height.mm()).collect();
        assert_eq!((report.goes, heights.len()), (false, if seen.is_some() { 0 } else { 6 }));
        assert!(heights.iter().all(|mm| mm.abs() < 0.006), "{heights:?}");
        let (real, status) = (bench.world().real(), bench.status().clone());
        assert_eq!((real[..] == status.steps[..3], status.trust), (true, Trust::Trusted));
        assert!(status.work_mm[2] > 0.5, "the tip is up: {status:?}");
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Work {
    Home,
    Touch,
    /// Drill eight holes: how many go through, and the result of the next homing.
    Drill(usize, Option<&'static str>),
}

const ROWS: &[(&str, Work, Option<&str>)] = &[
    ("lost-step@1", Work::Drill(8, Some("control.lost_count")), None),
    ("stuck-switch", Work::Home, Some("control.sensor_stuck")),
    ("missing-switch", Work::Home, Some("control.sensor_not_found")),
    ("dull-bit@2", Work::Drill(2, None), Some("control.end_sensor")),
    ("worn-bit", Work::Drill(4, None), Some("control.end_sensor")),
    ("broken-bit@2", Work::Drill(2, None), None),
    ("spindle-stops@2", Work::Drill(2, None), None),
    ("contact-missing", Work::Touch, Some("level.no_board")),
    ("contact-early@2", Work::Drill(8, None), None),
    ("contact-closed", Work::Home, Some("control.end_sensor")),
    ("board-not-flat", Work::Drill(8, None), None),
    ("cable-pulled@2", Work::Drill(2, Some("control.sensor_not_found")), None),
];

/// Faults that cannot occur on an adapter, or that other tests cover.
const ELSEWHERE: [&str; 7] = [
    // The chip watches the inputs: `link/tests/adapter/touches.rs`.
    "bouncing-switch",
    // A late host: `rarely_called_page_runs_dry_and_loses_nothing`.
    "late-host",
    // The adapter has no cover input: a cover switch belongs in the emergency stop circuit.
    "cover-open",
    // An adapter cannot have a magazine: `machine.magazine_beside_adapter`.
    "clamp-stuck",
    "tool-dropped",
    "place-occupied",
    "no-air",
];

#[test]
fn every_adapter_fault_acts_as_documented() {
    let mut known: BTreeSet<&str> = ROWS.iter().filter_map(|row| row.0.split('@').next()).collect();
    known.extend(ELSEWHERE);
    assert_eq!(known, FAULTS.iter().map(|row| row.name).collect());
    let mut other = Vec::new();
    for (fault, work, seen) in ROWS {
        let files = Memory::default();
        let mut bench = homed(&files, read([*fault]).unwrap());
        let mut found = bench.rested();
        let (mut through, mut homing) = (0, None);
        match work {
            Work::Home => {}
            Work::Touch => {
                bench.ask(&Ask::SetZero);
                bench.turn(Duration::from_millis(200));
                bench.survey(&program(8));
                found = bench.rested();
            }
            Work::Drill(..) => {
                bench.ask(&Ask::SetZero);
                bench.turn(Duration::from_millis(200));
                bench.start(&program(8), 0);
                bench.finish();
                found = bench.rested();
                through =
                    String::from_utf8(files.clone().read(File::Drilled).unwrap()).unwrap().lines().count();
                if found.is_none() {
                    bench.home();
                    homing = bench.rested();
                }
            }
        }
        let (holes, homing_alarm) =
            if let Work::Drill(holes, homing) = work { (*holes, *homing) } else { (0, None) };
        let wanted = (seen.map(str::to_owned), holes, homing_alarm.map(str::to_owned));
        let all = (found, through, homing);
        println!("{fault} {work:?}: {all:?}");
        if all != wanted {
            other.push(format!("{fault} {work:?}: {all:?} not {wanted:?}"));
        }
    }
    assert!(other.is_empty(), "{}", other.join("\n"));
    // Settings that need a missing wire are refused before anything moves.
    let refused = |key: &str, value: Value| {
        let changes = [changes(), vec![(key.to_owned(), value)]].concat();
        apply(&machine(), &changes).err().and_then(|why| why.into_iter().next()).map(|why| why.code)
    };
    let word = |word: &str| Value::Text(word.to_owned());
    for (key, value, code) in [
        ("rack.change", word("magazine"), "machine.magazine_beside_adapter"),
        ("foot.on", word("yes"), "machine.foot_beside_adapter"),
        ("stroke.contact_tolerance", Value::Number(0.1), "machine.no_contact"),
    ] {
        assert_eq!(refused(key, value).as_deref(), Some(code));
    }
    assert_eq!(wired().adapter.sensor(Input::Contact), Some(CONTACT));
}
