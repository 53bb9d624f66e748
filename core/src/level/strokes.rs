//! Touching a board as a job of the machine's own: each place is a stroke that ends on the contact sensor, the spindle still. It is
//! held, stopped and taken up as any job is.
//!
//! Comes in: a survey, the heights of a machine. Goes out: a program. Does not know who reads where the strokes ended.

use super::Survey;
use crate::geometry::Point;
use crate::job::{Command, Gate, Input, Leg, Mark, Otherwise, Program};
use crate::units::Length;

/// How fast the tip goes down to the board, µm/s.
const FEED_UM_PER_S: u32 = 1_000;

/// The strokes that are still to be made, for a job planned as `program`: from its safe height to at most `below` under the work zero.
/// A stroke's mark is a hole with the number of its place in the order of touching.
pub fn strokes(survey: &Survey, program: &Program, below: Length) -> Program {
    let way_um = (program.safe_height + below).nm() / 1_000;
    let deadline_us =
        u32::try_from(way_um * 1_000_000 / i64::from(FEED_UM_PER_S) + 5_000_000).unwrap_or(u32::MAX);
    let gate = Some(Gate { input: Input::Contact, deadline_us, otherwise: Otherwise::Alarm });
    let stroke = |(number, to): (usize, Point)| {
        let commands = vec![
            Command::Rapid { to },
            Command::Plunge { to: -below, feed_um_per_s: FEED_UM_PER_S, gate },
            Command::Retract { to: program.safe_height },
        ];
        Leg { mark: Mark::Hole(u32::try_from(number).unwrap_or(u32::MAX)), commands }
    };
    let prepare = Leg { mark: Mark::Prepare, commands: vec![Command::Spindle { rpm: 0 }] };
    let finish = Leg { mark: Mark::Finish, commands: vec![Command::Rapid { to: Point::default() }] };
    let strokes = survey.to_do().enumerate().map(stroke);
    Program {
        legs: std::iter::once(prepare).chain(strokes).chain([finish]).collect(),
        bits: program.bits.iter().take(1).cloned().collect(),
        ..program.clone()
    }
}
