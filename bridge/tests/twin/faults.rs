//! Tests of every fault of the virtual drill through the bytes of a card, without a record of the drill.
//! Checks the user's view and the resulting board. The manual's page "Faults on every output" has the same
//! table.

use super::changes::{of_two_tools, with_magazine};
use super::{Bench, number};
use crate::server::drill;
use annulus_core::geometry::Point;
use annulus_core::job::Program;
use annulus_core::level::ProbeGrid;
use annulus_core::machine::{Machine, Value};
use annulus_core::units::Length;
use annulus_core::virtual_drill::Faults;
use annulus_core::virtual_drill::faults::{FAULTS, read};
use annulus_core::wire::Ask;
use std::collections::BTreeSet;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Work {
    Home,
    Touch,
    Drill,
    /// The same with a contact sensor that must close in every drill cycle.
    DrillWithContact,
    /// Four holes with two tools of a magazine.
    Change,
}

/// A fault, the action, the resulting alarm, and the number of holes in the board; for successful jobs, the
/// alarm of the next homing.
struct Row {
    fault: &'static str,
    work: Work,
    seen: Option<&'static str>,
    /// `None` if it depends on how the motor is held back.
    holes: Option<usize>,
    homing: Option<&'static str>,
}

const fn row(fault: &'static str, work: Work, seen: Option<&'static str>, holes: usize) -> Row {
    Row { fault, work, seen, holes: Some(holes), homing: None }
}

/// Each fault by its name, with a strength that suits this slow machine.
const ROWS: &[Row] = &[
    Row { homing: Some("control.lost_count"), ..row("lost-step@1", Work::Drill, None, 5) },
    row("stuck-switch", Work::Home, Some("control.sensor_stuck"), 0),
    row("missing-switch", Work::Home, Some("control.sensor_not_found"), 0),
    Row { holes: None, ..row("worn-bit", Work::Drill, Some("control.end_sensor"), 0) },
    row("broken-bit@1", Work::Drill, None, 1),
    row("broken-bit@1", Work::DrillWithContact, Some("control.no_contact"), 1),
    row("spindle-stops@1", Work::Drill, None, 1),
    row("contact-missing", Work::Touch, Some("level.no_board"), 0),
    row("contact-early@1", Work::Drill, None, 5),
    row("contact-closed", Work::Home, Some("control.end_sensor"), 0),
    row("board-not-flat", Work::Drill, None, 5),
    Row { homing: Some("control.sensor_not_found"), ..row("cable-pulled@1", Work::Drill, None, 1) },
    row("cable-pulled@1", Work::DrillWithContact, Some("control.no_contact"), 1),
    row("cover-open@1", Work::Drill, Some("control.cover_open"), 1),
    row("clamp-stuck@2", Work::Change, Some("magazine.clamp_closed"), 3),
    row("tool-dropped@2", Work::Change, Some("magazine.no_tool"), 3),
    row("place-occupied", Work::Change, Some("magazine.place_taken"), 3),
    row("no-air@2", Work::Change, Some("magazine.no_air"), 3),
];

/// The fault on a machine that makes 100 steps per second.
fn faults(row: &Row) -> Faults {
    let mut faults = read([row.fault]).unwrap();
    faults.bit_life = faults.bit_life.map(|_| 1);
    faults
}

/// Five holes on alternating sides of the board: Y moves far to each.
fn to_and_fro(machine: &Machine) -> Program {
    let at = (0..5).map(|hole| Point::from_mm(f64::from(hole) * 2.0, f64::from(hole % 2) * 10.0));
    drill::holes(machine, vec![drill::spin_up(50_000)], (at, 10_000), drill::back())
}

/// Plays a row. Returns the alarm, the number of holes, and the alarm of the homing after a successful job.
fn played(row: &Row) -> (Option<String>, usize, Option<String>) {
    let mut more: Vec<(&'static str, Value)> = Vec::new();
    if row.work == Work::DrillWithContact {
        more.push(("stroke.contact_tolerance", number(0.2)));
    }
    if row.work == Work::Touch {
        // A coarse step into the board would break the tool, which then never touches.
        more.push(("z.scale", number(40.0)));
    }
    if row.work == Work::Change {
        more.extend(with_magazine().into_iter().filter(|(key, _)| *key == "rack.change"));
    }
    let mut bench = Bench::new(&more, faults(row));
    let mut seen = bench.home();
    if row.work == Work::Home || seen.is_some() {
        return (seen, 0, None);
    }
    bench.page.ask(&Ask::SetZero);
    match row.work {
        Work::Home => {}
        Work::Touch => {
            let (low, high) = (Point::from_mm(1.0, 1.0), Point::from_mm(3.0, 3.0));
            let grid = ProbeGrid { low, high, columns: 2, rows: 2, margin: Length::ZERO };
            let job = "0".repeat(64);
            bench.page.ask(&Ask::Survey { grid, job, clear_um: 600, depth_um: 1_000, now_s: 1_764_000_000 });
            bench.begins();
        }
        Work::Change => {
            bench.fill();
            let program = of_two_tools(&bench.machine);
            bench.start(&program);
        }
        Work::Drill | Work::DrillWithContact => {
            let program = to_and_fro(&bench.machine);
            bench.start(&program);
        }
    }
    if row.work != Work::Touch {
        bench.ended();
    }
    seen = bench.rests();
    let holes = bench.seen().holes().len();
    if seen.is_some() || row.homing.is_none() {
        return (seen, holes, None);
    }
    let homing = bench.home();
    (seen, holes, homing)
}

#[test]
fn every_card_fault_gives_its_expected_alarm() {
    let names: BTreeSet<&str> = ROWS.iter().filter_map(|row| row.fault.split('@').next()).collect();
    let left: Vec<_> = FAULTS.iter().map(|row| row.name).filter(|name| !names.contains(name)).collect();
    // Omitted faults: a wrong reading lasts in a file until the second look, and a dull tool is worn from
    // its first hole. Lateness of a computer is measured, not injected: see `server::card`.
    assert_eq!(left, ["bouncing-switch", "dull-bit", "late-host"]);
    if std::env::var_os("ANNULUS_LONG").is_none() {
        return;
    }
    let mut other = Vec::new();
    for row in ROWS {
        let found = played(row);
        println!("{} {:?}: {found:?}", row.fault, row.work);
        let holes = row.holes.unwrap_or(found.1);
        let wanted = (row.seen.map(str::to_owned), holes, row.homing.map(str::to_owned));
        if found != wanted {
            other.push(format!("{} {:?}: {found:?} not {wanted:?}", row.fault, row.work));
        }
    }
    assert!(other.is_empty(), "{}", other.join("\n"));
}
