//! Reads files back: the motion of the controller as a program. Supports the shipped dialects and foreign
//! G-code.
//!
//! ```text
//!   G-code (GRBL, LinuxCNC, Mach3, Marlin, Fanuc, Sinumerik, others) ─ gcode ────┐
//!   Heidenhain Klartext ──────────────────────────────────────────── klartext ───┼─ hand ─▶ Program
//!   KUKA KRL, ABB RAPID, Fanuc TP ────────────────────────────────── robots ─────┤
//!   Excellon ─────────────────────────────────────────────────────── drill_file ─┘
//! ```

mod cycles;
mod drill_file;
mod gcode;
mod hand;
mod klartext;
mod robots;
mod titles;
mod words;

use crate::error;
pub use titles::titled;

use crate::diagnostic::Diagnostic;
use crate::gcode::Interpreter;
use crate::job::{Bit, Program};
use crate::units::Length;
use hand::Hand;
use std::collections::BTreeMap;

const MOST_DIAGNOSTICS: usize = 50;

#[derive(Clone, Debug, PartialEq)]
pub struct ReadBack {
    /// Its program, in the file's coordinates: its zero is the program's.
    pub program: Program,
    /// Side from its header: `top` or `bottom`.
    pub side: Option<String>,
    /// Thickness of the board from its header.
    pub thickness: Option<Length>,
    /// Its coordinates are those of the design files: a drill file.
    pub of_files: bool,
    pub diagnostics: Vec<Diagnostic>,
    /// The first line that each known controller would refuse. Empty for files from Annulus and files read
    /// for one controller.
    pub others: Vec<Diagnostic>,
}

impl ReadBack {
    /// Largest file that is read, in bytes.
    pub const LARGEST: usize = 64 << 20;
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Gcode,
    Klartext,
    Krl,
    Rapid,
    Tp,
    Drill,
}

/// Reads `text`; `file` names it in diagnostics, `tools` are the user's tools by number.
pub fn read_back(file: &str, text: &str, tools: &BTreeMap<u32, Bit>) -> Result<ReadBack, Diagnostic> {
    read_back_for(file, text, tools, Interpreter::Any)
}

/// As [`read_back`], for one controller: a line of G-code that it refuses is refused here.
pub fn read_back_for(
    file: &str,
    text: &str,
    tools: &BTreeMap<u32, Bit>,
    of: Interpreter,
) -> Result<ReadBack, Diagnostic> {
    if text.len() > ReadBack::LARGEST {
        return Err(error!("readback.too_large").at(file, 0, 0));
    }
    let Some(kind) = kind(text) else {
        return Err(error!("readback.unknown", path = file).at(file, first_line(text), 0));
    };
    let mut hand = Hand::new(file, tools);
    match kind {
        Kind::Gcode => gcode::read(&mut hand, text, of)?,
        Kind::Klartext => klartext::read(&mut hand, text)?,
        Kind::Krl => robots::krl(&mut hand, text)?,
        Kind::Rapid => robots::rapid(&mut hand, text)?,
        Kind::Tp => robots::tp(&mut hand, text)?,
        Kind::Drill => drill_file::read(&mut hand, text)?,
    }
    hand.finish(kind == Kind::Drill)
}

/// Number of the first line that is not only a comment.
fn first_line(text: &str) -> u32 {
    (1..).zip(text.lines()).find(|(_, line)| !words::bare(line).is_empty()).map_or(1, |(number, _)| number)
}

/// Format of a text; `None` if it is no program.
fn kind(text: &str) -> Option<Kind> {
    let head: Vec<&str> = text.lines().take(400).map(str::trim).filter(|line| !line.is_empty()).collect();
    let begins = |word: &str| {
        head.iter()
            .take(40)
            .any(|line| line.trim_start_matches(|c: char| c.is_ascii_digit() || c == ' ').starts_with(word))
    };
    if begins("BEGIN PGM") {
        return Some(Kind::Klartext);
    }
    if begins("MODULE ") {
        return Some(Kind::Rapid);
    }
    if begins("/PROG") {
        return Some(Kind::Tp);
    }
    if begins("DEF ") || begins("&ACCESS") {
        return Some(Kind::Krl);
    }
    let sizes = |line: &&str| line.starts_with('T') && line.contains('C');
    if begins("M48") && head.iter().any(sizes) {
        return Some(Kind::Drill);
    }
    let moves = |line: &&str| {
        let bare = words::bare(line);
        bare.starts_with(['G', 'X', 'Y', 'Z', 'M', 'T', 'S', 'N', 'F'])
            && words::of(&bare).is_ok_and(|found| !found.is_empty())
    };
    // One line that moves is enough: the reader then reports the first line that it can't read.
    head.iter().any(moves).then_some(Kind::Gcode)
}

#[cfg(test)]
mod tests;
