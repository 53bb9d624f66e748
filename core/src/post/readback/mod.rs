//! Written files read back: what a controller will do, as a program again (N8). Dialects that ship, and G-code of others.
//!
//! ```text
//!   G-code (GRBL, LinuxCNC, Mach3, Marlin, Fanuc, Sinumerik, others) ─ gcode ─────┐
//!   Heidenhain Klartext ───────────────────────────────────────────── klartext ──┼─ hand ─▶ Program, work coordinates
//!   KUKA KRL, ABB RAPID, Fanuc TP ─────────────────────────────────── robots ────┤
//!   Excellon ──────────────────────────────────────────────────────── drill_file ┘
//! ```
//!
//! Comes in: the text of a file, and the tools a person says it uses. Goes out: a [`ReadBack`], or what cannot be followed, with its
//! line. Does not know templates nor boards: it reads what stands in the file, not what was meant.

mod cycles;
mod drill_file;
mod gcode;
mod hand;
mod klartext;
mod robots;
mod titles;
mod words;

pub use titles::titled;

use crate::diagnostic::Diagnostic;
use crate::job::{Bit, Program};
use crate::units::Length;
use hand::Hand;
use std::collections::BTreeMap;

/// At most so many diagnostics are kept.
const MOST_DIAGNOSTICS: usize = 50;

/// A file read back.
#[derive(Clone, Debug, PartialEq)]
pub struct ReadBack {
    /// What it does, in its own coordinates: its zero is the program's.
    pub program: Program,
    /// The side that its head says it is for: `top` or `bottom`.
    pub side: Option<String>,
    /// How thick its head says the board is.
    pub thickness: Option<Length>,
    /// Its coordinates are those of the design files: a drill file.
    pub of_files: bool,
    /// What was read otherwise than it may have been meant.
    pub diagnostics: Vec<Diagnostic>,
}

impl ReadBack {
    /// Largest file that is read, in bytes.
    pub const LARGEST: usize = 64 << 20;
}

/// What kind of words a file is written in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Gcode,
    Klartext,
    Krl,
    Rapid,
    Tp,
    Drill,
}

/// Reads `text`; `file` names it in diagnostics, `tools` are those that a person says have these numbers.
pub fn read_back(file: &str, text: &str, tools: &BTreeMap<u32, Bit>) -> Result<ReadBack, Diagnostic> {
    if text.len() > ReadBack::LARGEST {
        return Err(Diagnostic::error("readback.too_large").at(file, 0, 0));
    }
    let Some(kind) = kind(text) else {
        return Err(Diagnostic::error("readback.unknown").with("path", file).at(file, 0, 0));
    };
    let mut hand = Hand::new(file, tools);
    match kind {
        Kind::Gcode => gcode::read(&mut hand, text)?,
        Kind::Klartext => klartext::read(&mut hand, text)?,
        Kind::Krl => robots::krl(&mut hand, text)?,
        Kind::Rapid => robots::rapid(&mut hand, text)?,
        Kind::Tp => robots::tp(&mut hand, text)?,
        Kind::Drill => drill_file::read(&mut hand, text)?,
    }
    hand.finish(kind == Kind::Drill)
}

/// What a text is written in; none for what is no program at all.
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
    let moves = |line: &&&str| {
        let bare = words::bare(line);
        bare.starts_with(['G', 'X', 'Y', 'Z', 'M', 'T', 'S', 'N', 'F'])
            && words::of(&bare).is_ok_and(|found| !found.is_empty())
    };
    (head.iter().filter(moves).count() >= 2).then_some(Kind::Gcode)
}

#[cfg(test)]
mod tests;
