//! Tests of the moves of a tool change with the independent checker.

use annulus_core::check;
use annulus_core::machine::{HandChange, Lengths, Steps, presets};
use annulus_core::queue::{from_change, to_change};
use annulus_core::steps::Segment;
use annulus_core::units::Length;

/// `pieces` relative to work zero, as in a program's stream.
fn relative(pieces: &[Segment], zero: &Steps) -> Vec<Segment> {
    let from = |at: &Steps| std::array::from_fn(|axis| at[axis] - zero[axis]);
    pieces.iter().map(|piece| Segment { end: from(&piece.end), ..piece.clone() }).collect()
}

#[test]
fn tool_change_moves_pass_the_check() {
    for (name, base) in presets() {
        for lengths in [Lengths::Touch, Lengths::Equal] {
            let mut machine = base.clone();
            machine.change = HandChange { lengths, ..HandChange::default() };
            let mut zero = machine.on_surface();
            zero[0] = machine.x.scale.steps(Length::from_mm(20.0));
            zero[1] = machine.y.scale.steps(Length::from_mm(30.0));
            let mut over = zero;
            machine
                .spindle_axes()
                .for_each(|axis| over[axis] += machine.z.scale.steps(machine.process.safe_height));
            let there = to_change(&machine, over, [zero[0], zero[1]], lengths == Lengths::Equal).unwrap();
            let changed = there.last().unwrap().end;
            let back = from_change(&machine, changed, [zero[0] - 3, zero[1] - 3], over).unwrap();
            let all: Vec<Segment> = there.iter().chain(&back).cloned().collect();
            let stream = relative(&all, &zero);
            let start: Steps = std::array::from_fn(|axis| over[axis] - zero[axis]);
            let found = check::verify_each(&start, || stream.iter(), &machine, zero);
            assert!(found.is_ok(), "{name}: {found:?}");
        }
    }
}
