//! Removes speeds from a program: the proof doesn't depend on them.
//!
//! ```text
//!   Plunge −0.1 mm at 500 µm/s · Spindle 12,000 rpm   and   Plunge −0.1 mm at 900 µm/s · Spindle 30,000 rpm
//!   leave equal copper, as long as the spindle turns: one proof is valid for both
//! ```
//!
//! Legs keep their numbers.

use crate::job::{Command, Leg, Program};

/// `program` without speeds and machine: programs that are then equal have one proof.
pub fn unhurried(program: &Program) -> Program {
    let leg = |leg: &Leg| Leg { mark: leg.mark, commands: leg.commands.iter().filter_map(slow).collect() };
    Program {
        name: String::new(),
        machine: String::new(),
        accepted: Vec::new(),
        legs: program.legs.iter().map(leg).collect(),
        bits: program.bits.clone(),
        ..*program
    }
}

/// A command without its speed; `None` if it only waits.
fn slow(command: &Command) -> Option<Command> {
    let feed_um_per_s = 0;
    Some(match *command {
        Command::Dwell { .. } => return None,
        Command::Plunge { to, gate, .. } => Command::Plunge { to, feed_um_per_s, gate },
        Command::Mill { to, height, .. } => Command::Mill { to, height, feed_um_per_s },
        Command::MillArc { to, height, center, ccw, .. } => {
            Command::MillArc { to, height, center, ccw, feed_um_per_s }
        }
        Command::Spindle { rpm } => Command::Spindle { rpm: rpm.min(1) },
        Command::Rapid { .. } | Command::Retract { .. } | Command::AwaitBit { .. } => *command,
    })
}
