//! A program as a drill file: Excellon, metric, with decimal points, X and Y on every hit, in the coordinates of the
//! files the board came from.
//!
//! Comes in: a program. Goes out: text that every reader of drill files takes. Does not know templates.

use super::template::decimal;
use crate::geometry::Point;
use crate::job::{Command, Leg, Mark, Program};
use crate::units::Length;

/// A length in mm: three digits after the point, or six where three would not be exact.
fn number(length: Length) -> String {
    decimal(length.nm(), 6, if length.nm() % 1_000 == 0 { 3 } else { 6 }, true)
}

/// The program as a drill file.
pub fn excellon(program: &Program) -> String {
    let mut out = String::from("M48\n;FORMAT={-:-/ absolute / metric / decimal}\nFMAT,2\nMETRIC\n");
    for (code, bit) in (1_u32..).zip(&program.bits) {
        out.push_str(&format!("T{code}C{}\n", number(bit.diameter)));
    }
    out.push_str("%\nG90\nG05\n");
    for leg in &program.legs {
        match leg.mark {
            Mark::ChangeBit(bit) => out.push_str(&format!("T{}\n", u64::from(bit) + 1)),
            Mark::Hole(_) => {
                let at = place(leg, program.origin);
                out.push_str(&format!("X{}Y{}\n", number(at.x), number(at.y)));
            }
            Mark::Prepare | Mark::Way(_) | Mark::Finish => {}
        }
    }
    out.push_str("T0\nM30\n");
    out
}

/// Where a leg drills, in the files' coordinates.
fn place(leg: &Leg, origin: Point) -> Point {
    let rapid = leg.commands.iter().find_map(|command| match command {
        Command::Rapid { to } => Some(*to),
        _ => None,
    });
    let at = rapid.unwrap_or_default();
    Point::new(at.x + origin.x, at.y + origin.y)
}
