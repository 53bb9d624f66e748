//! Checks during a tool change.

use super::line;
use crate::model::link::rest::{ChangeCheck, change_rows};
use annulus_core::control::State;
use annulus_core::geometry::Point;
use annulus_core::job::{Command, Leg, Mark, Program};
use annulus_core::pins::{SpindleState, SpindleTrouble};
use annulus_core::wire::{ChangeReport, LengthKnown};

fn program(commands: Vec<Command>) -> Program {
    Program { legs: vec![Leg { mark: Mark::ToolChange(0), commands }], ..line::empty() }
}

#[test]
fn tool_change_rows_match_the_machine_report() {
    let (off, up, place) = (ChangeCheck::SpindleOff, ChangeCheck::Up, ChangeCheck::AtPlace);
    let goes = Command::Rapid { to: Point::default() };
    let usual = program(vec![Command::Spindle { rpm: 0 }, goes, Command::AwaitBit { bit: 0 }, goes]);
    let anywhere = program(vec![Command::Spindle { rpm: 0 }, Command::AwaitBit { bit: 0 }, goes]);
    let trouble = SpindleTrouble::Silent;
    let rows = [
        // commanded rpm, reported spindle state, work position, program, expected checks
        (0, SpindleState::Untold, [0.0, 0.0, 2.0], &usual, vec![(off, true), (up, true), (place, true)]),
        (
            9_000,
            SpindleState::Untold,
            [0.0, 0.0, 1.9],
            &usual,
            vec![(off, false), (up, false), (place, true)],
        ),
        // Spindle stopped by command, still running down.
        (
            0,
            SpindleState::Off { rpm: 400 },
            [0.0, 0.0, 2.0],
            &usual,
            vec![(off, false), (up, true), (place, true)],
        ),
        (
            0,
            SpindleState::Off { rpm: 0 },
            [0.0, 0.0, 18.0],
            &usual,
            vec![(off, true), (up, true), (place, true)],
        ),
        (
            0,
            SpindleState::Lost { trouble },
            [0.0, 0.0, 2.0],
            &usual,
            vec![(off, false), (up, true), (place, true)],
        ),
        (0, SpindleState::Untold, [0.0, 3.0, 2.0], &usual, vec![(off, true), (up, true), (place, false)]),
        (0, SpindleState::Untold, [7.0, 3.0, 2.0], &anywhere, vec![(off, true), (up, true)]),
    ];
    for (rpm, spindle, work_mm, program, wanted) in rows {
        let mut status = line::status(State::ToolChange, Some("a"));
        (status.spindle_rpm, status.spindle, status.work_mm, status.leg) = (rpm, spindle, work_mm, Some(0));
        assert_eq!(change_rows(&status, Some(program)), wanted, "{rpm} {spindle:?} {work_mm:?}");
    }
    // Our own drill reports its position, independent of the program.
    for (is_up, is_at_place) in [(true, true), (false, true), (true, false)] {
        let mut status = line::status(State::ToolChange, Some("a"));
        status.change = Some(ChangeReport { bit: 0, is_up, is_at_place, length: LengthKnown::No });
        let wanted = vec![(off, true), (ChangeCheck::AtHeight, is_up), (place, is_at_place)];
        assert_eq!(change_rows(&status, Some(&usual)), wanted);
    }
    // For an unknown job only the spindle is checked.
    let status = line::status(State::ToolChange, Some("a"));
    assert_eq!(change_rows(&status, None), vec![(off, true)]);
}
