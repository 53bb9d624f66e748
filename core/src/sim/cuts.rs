//! Converts a program to cuts: lines, arcs and helices of the tip, command by command.
//!
//! ```text
//! leg 3   Rapid ─ Plunge ─ Mill ─ MillArc ─ Retract      4 cuts: all moves in or towards the board
//! ```
//!
//! Plunges that end on a sensor are assumed to reach their limit.

use crate::geometry::{Bounds, Point};
use crate::job::{Command, Mark, Program};
use crate::units::Length;

/// One command that cuts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cut {
    pub leg: u32,
    pub command: u32,
    pub bit: u32,
    pub way: Way,
}

/// One path of the tip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Way {
    pub from_mm: [f64; 3],
    pub to_mm: [f64; 3],
    pub shape: CutShape,
}

/// Shape of a path in XY; the height changes linearly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CutShape {
    Line,
    Arc {
        /// In mm.
        center: [f64; 2],
        radius_mm: f64,
        from_rad: f64,
        /// Swept angle; positive is counter-clockwise.
        turn_rad: f64,
    },
}

impl Way {
    /// Position of the tip after a share of the path, 0 … 1.
    pub fn at(&self, share: f64) -> [f64; 3] {
        let share = share.clamp(0.0, 1.0);
        let even = |axis: usize| self.from_mm[axis] + (self.to_mm[axis] - self.from_mm[axis]) * share;
        match self.shape {
            CutShape::Arc { center, radius_mm, from_rad, turn_rad } if share > 0.0 && share < 1.0 => {
                let angle = from_rad + turn_rad * share;
                let (x, y) = (radius_mm * libm::cos(angle), radius_mm * libm::sin(angle));
                [center[0] + x, center[1] + y, even(2)]
            }
            _ if share == 1.0 => self.to_mm,
            _ => [even(0), even(1), even(2)],
        }
    }
}

/// The cuts of `program` that start or end below the surface, in order.
pub fn cuts(program: &Program) -> Vec<Cut> {
    let (mut found, mut bit) = (Vec::new(), 0);
    let mut at = [0.0, 0.0, program.safe_height.mm()];
    for (leg, steps) in (0..).zip(&program.legs) {
        if let Mark::ToolChange(next) = steps.mark {
            bit = next;
        }
        for (command, step) in (0..).zip(&steps.commands) {
            if let Command::AwaitBit { bit: next } = step {
                bit = *next;
            }
            let Some((to, shape)) = goes(step, at) else { continue };
            if at[2] < 0.0 || to[2] < 0.0 {
                found.push(Cut { leg, command, bit, way: Way { from_mm: at, to_mm: to, shape } });
            }
            at = to;
        }
    }
    found
}

/// Target and shape of a command from `at`; none if it doesn't move.
fn goes(command: &Command, at: [f64; 3]) -> Option<([f64; 3], CutShape)> {
    let place = |to: &Point, z: f64| [to.x.mm(), to.y.mm(), z];
    let straight = |to: [f64; 3]| Some((to, CutShape::Line));
    match command {
        Command::Rapid { to } => straight(place(to, at[2])),
        Command::Plunge { to, .. } | Command::Retract { to } => straight([at[0], at[1], to.mm()]),
        Command::Mill { to, height, .. } => straight(place(to, height.mm())),
        Command::MillArc { to, height, center, ccw, .. } => {
            let (to, center) = (place(to, height.mm()), [center.x.mm(), center.y.mm()]);
            Some((to, arc(at, to, center, *ccw)))
        }
        Command::Dwell { .. } | Command::Spindle { .. } | Command::AwaitBit { .. } => None,
    }
}

fn arc(from: [f64; 3], to: [f64; 3], center: [f64; 2], ccw: bool) -> CutShape {
    let angle = |at: [f64; 3]| libm::atan2(at[1] - center[1], at[0] - center[0]);
    let (x, y) = (from[0] - center[0], from[1] - center[1]);
    let (from_rad, full) = (angle(from), core::f64::consts::TAU);
    let turn = if ccw { angle(to) - from_rad } else { from_rad - angle(to) };
    let same = from[0] == to[0] && from[1] == to[1];
    let turn = if same {
        full
    } else if turn > 0.0 {
        turn
    } else {
        turn + full
    };
    let turn_rad = if ccw { turn } else { -turn };
    CutShape::Arc { center, radius_mm: libm::sqrt(x * x + y * y), from_rad, turn_rad }
}

/// Bounds of the bit centres of `program` while cutting, in work coordinates; none if nothing is cut.
pub fn reach(program: &Program) -> Option<Bounds> {
    let mut found: Option<Bounds> = None;
    for Cut { way, .. } in cuts(program) {
        let ends = [way.from_mm, way.to_mm].map(|at| (at[0], at[1], 0.0));
        let round = match way.shape {
            CutShape::Line => None,
            CutShape::Arc { center, radius_mm, .. } => Some((center[0], center[1], radius_mm)),
        };
        for (x, y, around) in ends.into_iter().chain(round) {
            for off in [-around, around] {
                let corner = Point::new(Length::from_mm(x + off), Length::from_mm(y + off));
                found = Some(found.map_or(Bounds::of(corner), |all| all.with(corner)));
            }
        }
    }
    found
}
