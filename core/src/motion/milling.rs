//! Converts consecutive mill commands to paths from rest to rest.
//!
//! ```text
//! Mill, Mill, MillArc, Mill   ─▶   one move:           /‾‾\__/‾‾‾‾‾‾‾‾\_/‾‾\
//! with backlash               ─▶   several moves:      /‾‾\ │ /‾‾‾‾\ │ /‾‾‾\     │ an axis reverses
//! ```

use super::Limits;
use super::limits::mm_per_step;
use super::path::{self, Chain, PathPoint, PathRules, PlannedPath, To, WantedPiece};
use super::timeline::{AxisMove, Motion, MotorPath};
use crate::code;
use crate::diagnostic::Diagnostic;
use crate::geometry::Point;
use crate::job::{Command, Stage};
use crate::machine::{DriveKind, Machine, Steps};

/// The piece of a mill command; none for any other command.
pub(super) fn piece(command: &Command) -> Option<WantedPiece> {
    let place = |at: Point, height: crate::units::Length| [at.x.mm(), at.y.mm(), height.mm()];
    let (to, feed_um_per_s) = match *command {
        Command::Mill { to, height, feed_um_per_s } => (To::Line(place(to, height)), feed_um_per_s),
        Command::MillArc { to, height, center, ccw, feed_um_per_s } => {
            let center = [center.x.mm(), center.y.mm()];
            (To::Arc { to: place(to, height), center, ccw }, feed_um_per_s)
        }
        _ => return None,
    };
    Some(WantedPiece { to, feed_mm_per_s: f64::from(feed_um_per_s) * 1e-3 })
}

/// A path of the axes, and for X and Y whether the motor counts down along it.
pub(super) type Turned = ([bool; 2], PlannedPath);

/// Paths that mill `pieces` from rest at `start`, after the motors of X and Y last moved `down`. One path
/// without backlash; else one between any two reversals of an axis with backlash.
///
/// Refuses table-driven axes, which can't move together, feeds of 0, and unplannable input, with the number
/// of the piece.
pub(super) fn paths(
    machine: &Machine,
    start: PathPoint,
    pieces: Vec<WantedPiece>,
    down: [bool; 2],
) -> Result<Vec<Turned>, Diagnostic> {
    let refuse = |code: &str| Err(Diagnostic::error(code));
    if machine.drive == DriveKind::Table {
        return refuse(code!("motion.path_on_table"));
    }
    if pieces.iter().any(|piece| piece.feed_mm_per_s <= 0.0) {
        return refuse(code!("motion.no_feed"));
    }
    let (limits, rules) = (Limits::of_path(machine), PathRules::of(machine));
    let mm = mm_per_step(machine);
    let play_mm = [0, 1].map(|axis: usize| {
        let settings = machine.axis(axis);
        settings.scale.steps(settings.backlash) as f64 * mm[axis]
    });
    path::turns(&Chain { start, pieces }, (play_mm, down), &limits, &rules)
}

/// The part of a move that follows `path` (in motor coordinates) with a set of spindles. From rest at `at` to
/// rest at `to`, the steps nearest to its ends.
pub(super) fn part(
    machine: &Machine,
    path: PlannedPath,
    (at, to): (Steps, Steps),
    spindles: u8,
    start_tick: u64,
) -> AxisMove {
    let [x, y, z, ..] = mm_per_step(machine);
    let motion = Motion::Path(Box::new(MotorPath { path, mm_per_step: [x, y, z], spindles }));
    AxisMove { stage: Stage::Mill, start_tick, from: at, to, motion }
}
