//! Every fault of the virtual drill behind the bytes of a card, which has no record of the board to compare with: what a person sees
//! there, and what the board is like (N20). The page "Faults on every output" of the manual says the same.

use super::changes::{of_two_tools, with_magazine};
use super::{Bench, number};
use crate::server::client::in_peace;
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

/// What is done with the machine.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Work {
    Home,
    /// The board is touched.
    Touch,
    /// Five holes are drilled.
    Drill,
    /// The same with a contact that has to close in every stroke.
    DrillWithContact,
    /// Four holes with two tools out of a magazine.
    Change,
}

/// A fault, what is done, the alarm that comes of it, and how many holes are in the board then; for jobs that end well the alarm of the
/// next homing.
struct Row {
    fault: &'static str,
    work: Work,
    seen: Option<&'static str>,
    /// None where it depends on how the motor is held back.
    holes: Option<usize>,
    homing: Option<&'static str>,
}

const fn row(fault: &'static str, work: Work, seen: Option<&'static str>, holes: usize) -> Row {
    Row { fault, work, seen, holes: Some(holes), homing: None }
}

/// What a fault is called by its words, and how strong it is on a machine this slow.
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

/// The fault as it is on a machine that makes 100 steps a second.
fn faults(row: &Row) -> Faults {
    let mut faults = read([row.fault]).unwrap();
    faults.bit_life = faults.bit_life.map(|_| 1);
    faults
}

/// Five holes, each on the other side of the board: Y has a long way to each.
fn to_and_fro(machine: &Machine) -> Program {
    let at = (0..5).map(|hole| Point::from_mm(f64::from(hole) * 2.0, f64::from(hole % 2) * 10.0));
    drill::holes(machine, vec![drill::spin_up(50_000)], (at, 10_000), drill::back())
}

/// Does it: the alarm that came, how many holes the board has, and the alarm of the homing after a job that ended well.
fn played(row: &Row) -> (Option<String>, usize, Option<String>) {
    let mut more: Vec<(&'static str, Value)> = Vec::new();
    if row.work == Work::DrillWithContact {
        more.push(("stroke.contact_tolerance", number(0.2)));
    }
    if row.work == Work::Change {
        more.extend(with_magazine().into_iter().filter(|(key, _)| *key == "rack.change"));
    }
    let mut bench = Bench::new(&more, faults(row)).expecting(row.seen);
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
    bench.expected = row.homing;
    let homing = bench.home();
    (seen, holes, homing)
}

#[test]
fn every_fault_on_a_card_is_what_the_manual_says_of_it() {
    let names: BTreeSet<&str> = ROWS.iter().filter_map(|row| row.fault.split('@').next()).collect();
    let left: Vec<_> = FAULTS.iter().map(|row| row.name).filter(|name| !names.contains(name)).collect();
    // A wrong reading is as long in a file as it takes to look at it again; a dull bit is a worn one from its first hole on; how late a
    // computer is is measured, not provoked: `server::card`.
    assert_eq!(left, ["bouncing-switch", "dull-bit", "late-host"]);
    if std::env::var_os("ANNULUS_LONG").is_none() {
        return;
    }
    let mut other = Vec::new();
    for row in ROWS {
        let found = in_peace(|| {
            let found = played(row);
            println!("{} {:?}: {found:?}", row.fault, row.work);
            found
        });
        let holes = row.holes.unwrap_or(found.1);
        let wanted = (row.seen.map(str::to_owned), holes, row.homing.map(str::to_owned));
        if found != wanted {
            other.push(format!("{} {:?}: {found:?} not {wanted:?}", row.fault, row.work));
        }
    }
    assert!(other.is_empty(), "{}", other.join("\n"));
}
