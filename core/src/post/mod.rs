//! Programs in other controllers' words.
//!
//! ```text
//!  dialects/grbl.toml ─ dialect ─▶ Dialect (templates) ─┐
//!                                  Program ─────────────┴─ drill ─▶ text
//!                                  Program ─ excellon ────────────▶ text
//! ```
//!
//! Comes in: a [`Program`]. Goes out: text. Does not know boards, plans or motion.

mod dialect;
mod drill;
mod excellon;
mod names;
mod template;

pub use dialect::{Dialect, DrillTemplates, shipped};
pub use drill::drill;
pub use excellon::excellon;
pub use names::{Field, PARAMETERS, Parameter};

use crate::job::{Command, Program};
use crate::remark::{Remark, Weight};

/// What a program can be written for: `excellon`, and the dialects that ship.
pub fn targets() -> Vec<&'static str> {
    std::iter::once("excellon").chain(shipped().map(|(name, _)| name)).collect()
}

/// The program in the words of `target`, with the file extension that goes with it. None for an unknown target.
pub fn write(target: &str, program: &Program) -> Option<Result<(String, String), Remark>> {
    if program.legs.iter().flat_map(|leg| &leg.commands).any(mills) {
        return Some(Err(Remark::new(Weight::Loss, "post.milling")));
    }
    if target == "excellon" {
        return Some(Ok((excellon(program), "drl".to_owned())));
    }
    let (name, text) = shipped().find(|(name, _)| *name == target)?;
    let written = Dialect::parse(&format!("{name}.toml"), text).and_then(|dialect| {
        let text = drill(program, &dialect)?;
        Ok((text, dialect.extension))
    });
    Some(written)
}

/// Templates know drilling only.
fn mills(command: &Command) -> bool {
    matches!(command, Command::Mill { .. } | Command::MillArc { .. })
}
