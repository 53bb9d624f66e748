//! Moves of a manual tool change: up, spindle off, to the change position, and back to the job.
//!
//! ```text
//! to     Z up to the change height ─▶ foot up, spindle off ─▶ X and Y
//! back   Z up to the change height ─▶ X and Y ─▶ Z down to the job's position
//! ```
//!
//! X and Y move only at the change height or above.

use super::work::{foot, rest, segments, travel};
use crate::diagnostic::Diagnostic;
use crate::job::Switching;
use crate::machine::{ChangeAt, Machine, Steps};
use crate::motion::cycles;
use crate::steps::Segment;

/// Machine steps of X and Y for tool changes, with the work zero at `zero`.
pub fn change_place(machine: &Machine, zero: [i64; 2]) -> [i64; 2] {
    match machine.change.at {
        ChangeAt::Park => cycles::park_place(machine),
        ChangeAt::Zero => zero,
    }
}

/// Height of Z for moves in a change. If the length of the tool isn't known, only the top is safe.
fn clear(machine: &Machine, is_known: bool) -> i64 {
    if is_known { machine.change_steps(&machine.on_surface()) } else { cycles::top(machine) }
}

/// Raises every spindle to at least `z`.
fn lifted(machine: &Machine, from: Steps, z: i64) -> Steps {
    let mut above = from;
    machine.spindle_axes().for_each(|axis| above[axis] = from[axis].max(z));
    above
}

/// From any position to the change position. `is_known`: the length of the tool is known.
pub fn to_change(
    machine: &Machine,
    from: Steps,
    zero: [i64; 2],
    is_known: bool,
) -> Result<Vec<Segment>, Diagnostic> {
    let above = lifted(machine, from, clear(machine, is_known));
    let mut to = above;
    to[..2].copy_from_slice(&change_place(machine, zero));
    let mut pieces = segments(&cycles::go_to(machine, from, above)?, machine);
    pieces.extend(foot(machine, above, false));
    pieces.push(rest(above, 0, Switching::Spindle { rpm: 0 }));
    pieces.extend(travel(machine, above, to)?);
    Ok(pieces)
}

/// From any position to `to`, at or above the board, with a tool of known length. X and Y arrive from
/// `beside`, to remove the backlash.
pub fn from_change(
    machine: &Machine,
    from: Steps,
    beside: [i64; 2],
    to: Steps,
) -> Result<Vec<Segment>, Diagnostic> {
    let above = lifted(machine, from, clear(machine, true));
    let mut there = above;
    there[..2].copy_from_slice(&beside);
    let ways = [
        cycles::go_to(machine, from, above)?,
        cycles::go_to(machine, above, there)?,
        cycles::go_to(machine, there, to)?,
    ];
    Ok(ways.iter().flat_map(|way| segments(way, machine)).collect())
}

/// True if the tip is up for a change; true if X and Y are at the change position.
pub fn at_change(machine: &Machine, at: &Steps, zero: [i64; 2], is_known: bool) -> [bool; 2] {
    let place = change_place(machine, zero);
    // After a move down, a motor with backlash rests off the position by the backlash.
    let is_near = |axis: usize| {
        let play = machine.axis(axis).scale.steps(machine.axis(axis).backlash);
        (at[axis] - place[axis]).abs() <= play
    };
    [machine.lowest(at) >= clear(machine, is_known), (0..2).all(is_near)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::{HandChange, presets};
    use crate::units::Length;

    /// Lowest Z while X or Y moves, and the end of `pieces`.
    fn played(pieces: &[Segment], from: Steps) -> (i64, Steps) {
        let (mut at, mut lowest) = (from, i64::MAX);
        for piece in pieces {
            let moves = (0..2).any(|axis| piece.end[axis] != at[axis]);
            if moves {
                lowest = lowest.min(at[2]).min(piece.end[2]);
            }
            at = piece.end;
        }
        (lowest, at)
    }

    #[test]
    fn xy_moves_only_at_the_change_height() {
        for (name, base) in presets() {
            for (at, is_known) in [(ChangeAt::Park, true), (ChangeAt::Park, false), (ChangeAt::Zero, true)] {
                let mut machine = base.clone();
                machine.change = HandChange { at, ..HandChange::default() };
                let zero = [
                    machine.x.scale.steps(Length::from_mm(20.0)),
                    machine.y.scale.steps(Length::from_mm(30.0)),
                ];
                let mut from = machine.on_surface();
                from[..2].copy_from_slice(&zero);
                // Start with the tip in the board.
                machine
                    .spindle_axes()
                    .for_each(|axis| from[axis] -= machine.z.scale.steps(Length::from_mm(1.0)));
                let there = to_change(&machine, from, zero, is_known).unwrap();
                let (lowest, end) = played(&there, from);
                let height = clear(&machine, is_known);
                assert!(lowest >= height, "{name} {at:?}: {lowest} below {height}");
                assert_eq!(end[..2], change_place(&machine, zero), "{name}");
                assert_eq!(at_change(&machine, &end, zero, is_known), [true, true], "{name}");
                assert_eq!(
                    at_change(&machine, &from, zero, is_known),
                    [false, at == ChangeAt::Zero],
                    "{name}"
                );
                // Off the change position with the tip on the board, and back to the job.
                let mut touched = machine.on_surface();
                touched[..2].copy_from_slice(&[zero[0] + 40, zero[1]]);
                let mut to = touched;
                to[..2].copy_from_slice(&zero);
                machine
                    .spindle_axes()
                    .for_each(|axis| to[axis] += machine.z.scale.steps(machine.process.safe_height));
                let back = from_change(&machine, touched, [zero[0] - 5, zero[1] - 5], to).unwrap();
                let (lowest, end) = played(&back, touched);
                assert!(lowest >= clear(&machine, true), "{name} {at:?} back: {lowest}");
                assert_eq!(end, to, "{name}");
            }
        }
    }
}
