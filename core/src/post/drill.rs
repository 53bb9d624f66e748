//! A drilling program in a dialect's words: one template for each leg.
//!
//! Comes in: a program, a dialect. Goes out: text in work coordinates, shifted as the dialect says. Does not know which
//! dialects there are.

use super::dialect::Dialect;
use super::names::Field;
use super::template::decimal;
use crate::geometry::Point;
use crate::job::{Command, Leg, Mark, Program};
use crate::remark::{Remark, Weight};
use crate::units::Length;

/// Largest output, in bytes: a template cannot be made to fill the memory.
const LARGEST: usize = 256 * 1024 * 1024;

/// Block numbers count by tens, as people do who may want to put a line between.
const BLOCK_STEP: u64 = 10;

/// What a leg says, and what stays true from legs before it.
#[derive(Clone, Copy, Default)]
struct Values {
    at: Point,
    depth: Length,
    feed_um_per_s: u32,
    pause_us: u32,
    rpm: u32,
    spin_up_us: u32,
    bit: u32,
    diameter: Length,
}

/// The program in the words of `dialect`.
pub fn drill(program: &Program, dialect: &Dialect) -> Result<String, Remark> {
    let mut out = String::new();
    let mut values = Values::default();
    let mut block = 0;
    for leg in &program.legs {
        values = values.after(leg, program);
        let field = match leg.mark {
            Mark::Prepare => Field::Start,
            Mark::ChangeBit(_) => Field::Change,
            Mark::Hole(_) => Field::Hole,
            Mark::Way(_) => continue,
            Mark::Finish => Field::End,
        };
        dialect.drill.of(field).fill(&mut out, |name| {
            block += u64::from(name == "N") * BLOCK_STEP;
            values.text(name, block, program, dialect)
        });
        if out.len() > LARGEST {
            return Err(Remark::new(Weight::Loss, "post.too_large"));
        }
    }
    Ok(out)
}

impl Values {
    fn after(mut self, leg: &Leg, program: &Program) -> Self {
        if let Mark::ChangeBit(bit) = leg.mark {
            self.bit = bit;
            self.diameter = program.bits.get(bit as usize).map_or(Length::ZERO, |bit| bit.diameter);
        }
        self.pause_us = 0;
        for command in &leg.commands {
            match *command {
                Command::Rapid { to } => self.at = to,
                Command::Plunge { to, feed_um_per_s, .. } => {
                    (self.depth, self.feed_um_per_s) = (to, feed_um_per_s);
                }
                Command::Dwell { us } if matches!(leg.mark, Mark::Hole(_)) => self.pause_us = us,
                Command::Dwell { us } => self.spin_up_us = us,
                Command::Spindle { rpm } => self.rpm = rpm,
                Command::Retract { .. }
                | Command::AwaitBit { .. }
                | Command::Mill { .. }
                | Command::MillArc { .. } => {}
            }
        }
        self
    }

    fn text(&self, name: &str, block: u64, program: &Program, dialect: &Dialect) -> String {
        let length = |length: Length| decimal(length.nm(), 6, dialect.decimals, dialect.trailing_zeros);
        let shifted = |at: Length, shift_mm: f64| length(at + Length::from_mm(shift_mm));
        let seconds = |us: u32| decimal(i64::from(us), 6, 3, false);
        match name {
            "X" => shifted(self.at.x, dialect.shift_mm[0]),
            "Y" => shifted(self.at.y, dialect.shift_mm[1]),
            "Z" => length(self.depth),
            "H" => length(program.safe_height),
            "D" => length(self.diameter),
            "F" => decimal(i64::from(self.feed_um_per_s) * 60, 3, 1, false),
            "P" => seconds(self.pause_us),
            "W" => seconds(self.spin_up_us),
            "S" => self.rpm.to_string(),
            "T" => (self.bit + 1).to_string(),
            "N" => block.to_string(),
            _ => String::new(),
        }
    }
}
