//! A job as G-code: its program, the text that is sent, and the leg of each section of that text. Moves
//! nothing.
//!
//! ```text
//! program   Prepare  ToolChange 0  Hole 4  Hole 17  …  Finish
//! sections           Change 0     Hole 1  Hole 2   …  Finish      the start of its leg identifies a section
//! ```

use crate::prepare::made;
use annulus_core::diagnostic::{Diagnostic, Severity};
use annulus_core::geometry::Point;
use annulus_core::grbl::{self, EngineStart, Routine, SectionKind, TipPlace};
use annulus_core::job::{Briefing, Command, Mark, Program};
use annulus_core::level::{Correction, HeightMap, TOLERANCE};
use annulus_core::machine::Machine;
use annulus_core::post::{self, FileSplit, Manner};
use annulus_core::proof;
use annulus_core::units::Length;
use annulus_core::wire::program;
use std::sync::Arc;

/// How far a section's start may be from the start of its leg: the last digit of the text.
const SAME: Length = Length::from_um(1);

#[derive(Clone)]
pub(super) struct Order {
    /// SHA-256 of the program's bytes.
    pub(super) key: String,
    pub(super) bytes: Vec<u8>,
    pub(super) program: Program,
    pub(super) text: String,
    pub(super) routine: Arc<Routine>,
    pub(super) legs: Vec<usize>,
}

/// A job that passed through the pre-flight check.
pub(super) struct Armed {
    pub(super) order: Order,
    pub(super) from_leg: u32,
    pub(super) start: EngineStart,
    /// The work zero at the time of the check, machine coordinates, mm.
    pub(super) zero_mm: Option<[f64; 3]>,
    /// Why the height map forbids a start, if it does.
    pub(super) refused: Option<Diagnostic>,
}

/// A program and the machine for which its G-code is to be written.
pub struct Draft {
    pub(super) key: String,
    pub(super) bytes: Vec<u8>,
    pub(super) machine: Machine,
}

/// A job as G-code, and the machine for which it was written.
pub struct Written {
    pub(super) order: Order,
    pub(super) fingerprint: String,
}

impl Draft {
    /// Writes the G-code and checks it; takes seconds for a large job.
    pub fn write(&self) -> Result<Written, Diagnostic> {
        let order = Order::written(&self.key, &self.bytes, &self.machine)?;
        Ok(Written { order, fingerprint: self.machine.fingerprint() })
    }
}

/// The G-code of `program` for the controller of `machine`, and the warnings of its comparison with the
/// program. A difference is an error.
pub fn gcode_of(program: &Program, machine: &Machine) -> Result<(String, Vec<Diagnostic>), Diagnostic> {
    let manner = Manner { files: Some(FileSplit::Job), ..Manner::on(machine) };
    let briefing = Briefing::of(program);
    let written =
        post::write_for("grbl", program, &manner, &briefing, 0).unwrap_or_else(|| Ok(Vec::new()))?;
    let dialect = post::dialect("grbl").and_then(Result::ok).map(|dialect| dialect.in_manner(&manner));
    let proved = post::proved((dialect.as_ref(), false), program, &written, &proof::differences);
    if let Some(error) = proved.iter().find(|diagnostic| diagnostic.severity == Severity::Error) {
        return Err(error.clone());
    }
    Ok((written.into_iter().map(|file| file.text).collect(), proved))
}

impl Order {
    /// Writes the program `bytes` as G-code for the controller of `machine`, and checks the result against
    /// the program.
    pub(super) fn written(key: &str, bytes: &[u8], machine: &Machine) -> Result<Self, Diagnostic> {
        let (text, _) = gcode_of(&program::decode(bytes)?, machine)?;
        Self::read(key, bytes, text)
    }

    /// Combines the program `bytes` with the text that was written for it.
    pub(super) fn read(key: &str, bytes: &[u8], text: String) -> Result<Self, Diagnostic> {
        let program = program::decode(bytes)?;
        let file = (program.name.clone(), text);
        let routine = grbl::read(&program.name, std::slice::from_ref(&file))?;
        let legs = legs(&program, &routine);
        let (key, bytes, routine) = (key.to_owned(), bytes.to_vec(), Arc::new(routine));
        Ok(Self { key, bytes, program, text: file.1, routine, legs })
    }

    pub(super) fn following(&self, map: &HeightMap) -> Result<(Self, Correction), Diagnostic> {
        let (routine, correction) = grbl::level_routine(&self.routine, map, TOLERANCE)?;
        Ok((Self { routine: Arc::new(routine), ..self.clone() }, correction))
    }

    /// The leg of section `section`; after the last section, the number of legs.
    pub(super) fn leg(&self, section: usize) -> usize {
        self.legs.get(section).copied().unwrap_or(self.program.legs.len())
    }

    pub(super) fn made(&self, section: usize) -> (u32, u32) {
        made(self.program.legs.iter().take(self.leg(section)))
    }
}

pub(super) fn legs(program: &Program, routine: &Routine) -> Vec<usize> {
    let mut next = 0;
    let mut of = |section: &grbl::Section| {
        let is = |leg: &usize| match (section.kind, program.legs[*leg].mark) {
            (SectionKind::Change(_), Mark::ToolChange(_)) | (SectionKind::Finish, Mark::Finish) => true,
            (SectionKind::Hole(_) | SectionKind::Toolpath(_), Mark::Hole(_) | Mark::Toolpath(_)) => {
                lies(begins(program, *leg), section.entry)
            }
            _ => false,
        };
        // If a path leaves the board on its way, its leg is cut in two: both sections have this leg.
        let found = (next..program.legs.len()).find(is);
        let leg = found.unwrap_or(next.saturating_sub(1));
        next = found.map_or(next, |leg| leg + 1);
        leg
    };
    routine.sections.iter().map(&mut of).collect()
}

/// XY position where leg `leg` first plunges.
fn begins(program: &Program, leg: usize) -> Point {
    let first = program.legs[leg].commands.iter().find_map(|command| match command {
        Command::Rapid { to } => Some(*to),
        _ => None,
    });
    first.unwrap_or_else(|| program.start_of_leg(leg))
}

fn lies(at: Point, entry: TipPlace) -> bool {
    (at.x - entry[0]).abs() <= SAME && (at.y - entry[1]).abs() <= SAME
}
