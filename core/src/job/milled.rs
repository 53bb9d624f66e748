//! Milled distance: length of the tip's path at feed, at or below the surface.
//!
//! ```text
//!        ╲  above the board: not counted
//!   ──────╲───────╭──╮────────────  surface, Z = 0
//!          ╲______│  │______╱       ramps, helices and rises over tabs at true length; plunges don't count
//! ```

use super::{Command, Program};
use crate::geometry::{Point, chords};
use crate::units::Length;

/// Distance travelled above the board in the whole program, from its zero on, mm: everything that isn't
/// milled.
pub fn travel_mm(program: &Program) -> f64 {
    let mut here = Point::default();
    let mut travel_mm = 0.0;
    for command in program.legs.iter().flat_map(|leg| &leg.commands) {
        match *command {
            Command::Rapid { to } => {
                travel_mm += here.distance_mm(to);
                here = to;
            }
            Command::Mill { to, .. } | Command::MillArc { to, .. } => here = to,
            _ => {}
        }
    }
    travel_mm
}

/// Greatest depth of any tip below the surface; 0 if none cuts. Plunges that end on a sensor don't count.
pub fn deepest(program: &Program) -> Length {
    let heights = program.legs.iter().flat_map(|leg| &leg.commands).filter_map(|command| match *command {
        Command::Plunge { to, gate: None, .. } => Some(to),
        Command::Mill { height, .. } | Command::MillArc { height, .. } => Some(height),
        _ => None,
    });
    -heights.min().unwrap_or_default().min(Length::ZERO)
}

/// Milled distance of each leg, mm.
pub fn milled_mm(program: &Program) -> Vec<f64> {
    let (mut at, mut height) = (Point::default(), program.safe_height);
    let mut milled = Vec::with_capacity(program.legs.len());
    for leg in &program.legs {
        let mut sum = 0.0;
        for command in &leg.commands {
            match *command {
                Command::Rapid { to } => at = to,
                Command::Plunge { to, .. } | Command::Retract { to } => height = to,
                Command::Mill { to, height: end, .. } => {
                    sum += in_board(at.distance_mm(to), height, end);
                    (at, height) = (to, end);
                }
                Command::MillArc { to, height: end, center, ccw, .. } => {
                    let turn = chords::turn(at, to, center, !ccw);
                    sum += in_board(at.distance_mm(center) * turn, height, end);
                    (at, height) = (to, end);
                }
                Command::Spindle { .. } | Command::Dwell { .. } | Command::AwaitBit { .. } => {}
            }
        }
        milled.push(sum);
    }
    milled
}

/// Length of the part at or below the surface, of a move over `flat` mm with linearly changing height.
fn in_board(flat: f64, from: Length, to: Length) -> f64 {
    let whole = libm::hypot(flat, (to - from).mm());
    let (low, high) = (from.min(to), from.max(to));
    if high <= Length::ZERO {
        return whole;
    }
    if low >= Length::ZERO {
        return 0.0;
    }
    whole * -low.mm() / (high - low).mm()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job::{Gate, Input, Leg, Mark, Otherwise};
    use std::f64::consts::TAU;

    fn mm(value: f64) -> Length {
        Length::from_mm(value)
    }

    #[test]
    fn ramps_helices_and_lifts_count_at_their_true_length() {
        let mill = |x: f64, y: f64, height: f64| Command::Mill {
            to: Point::from_mm(x, y),
            height: mm(height),
            feed_um_per_s: 1,
        };
        let down = |to: f64| Command::Plunge { to: mm(to), feed_um_per_s: 1, gate: None };
        let around = |height: f64| Command::MillArc {
            to: Point::from_mm(10.0, 0.0),
            height: mm(height),
            center: Point::from_mm(9.0, 0.0),
            ccw: true,
            feed_um_per_s: 1,
        };
        let start = Command::Rapid { to: Point::from_mm(10.0, 0.0) };
        let up = Command::Retract { to: mm(2.0) };
        let rows: [(Vec<Command>, f64); 5] = [
            (vec![start, down(-1.0), mill(13.0, 4.0, -1.0), up], 5.0),
            // A ramp, and a rise straight up over a tab.
            (vec![start, down(0.0), mill(13.0, 0.0, -4.0), mill(13.0, 0.0, -1.0), up], 5.0 + 3.0),
            (vec![start, down(0.0), around(-0.5), around(-0.5), up], libm::hypot(TAU, 0.5) + TAU),
            // Half of it is above the board.
            (vec![start, mill(14.0, 0.0, -2.0), up], libm::hypot(4.0, 4.0) / 2.0),
            (vec![start, down(1.0), mill(14.0, 0.0, 1.0), down(-3.0), up], 0.0),
        ];
        let legs =
            rows.iter().map(|(commands, _)| Leg { mark: Mark::Toolpath(0), commands: commands.clone() });
        let program = Program::of_legs(legs.collect());
        for ((commands, wanted), found) in rows.iter().zip(milled_mm(&program)) {
            assert!((found - wanted).abs() < 1e-9, "{found} not {wanted}: {commands:?}");
        }
        assert_eq!(deepest(&program), mm(4.0));
    }

    #[test]
    fn deepest_depth_ignores_sensor_plunges() {
        let down = |to: f64, gate| Command::Plunge { to: mm(to), feed_um_per_s: 1, gate };
        let gate = Gate { input: Input::ZBottom, deadline_us: 1, otherwise: Otherwise::Alarm };
        let rows = [
            (vec![], 0.0),
            (vec![down(1.0, None), Command::Retract { to: mm(2.0) }], 0.0),
            (vec![down(-2.1, None), down(-0.5, None)], 2.1),
            // The depth of a plunge that ends on a sensor is unknown.
            (vec![down(-2.1, None), down(-20.0, Some(gate))], 2.1),
        ];
        for (commands, wanted) in rows {
            let program = Program::of_legs(vec![Leg { mark: Mark::Hole(0), commands: commands.clone() }]);
            assert_eq!(deepest(&program), mm(wanted), "{commands:?}");
        }
    }
}
