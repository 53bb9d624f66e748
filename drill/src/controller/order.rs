//! A job in a controller's words: its program, the text that is sent, and which leg each section of that is.
//!
//! ```text
//! program   Prepare  ToolChange 0  Hole 4  Hole 17  …  Finish
//! sections           Change 0     Hole 1  Hole 2   …  Finish      a section is found by the place where its leg begins
//! ```
//!
//! Comes in: a program's bytes, the machine that it is for. Goes out: an [`Order`]. Moves nothing.

use crate::prepare::made;
use annulus_core::controller::{self, EngineStart, Routine, SectionKind, TipPlace};
use annulus_core::diagnostic::{Diagnostic, Severity};
use annulus_core::geometry::Point;
use annulus_core::job::{Briefing, Command, Mark, Program};
use annulus_core::level::{Correction, HeightMap, TOLERANCE};
use annulus_core::machine::Machine;
use annulus_core::post::{self, FileSplit, Manner};
use annulus_core::proof;
use annulus_core::units::Length;
use annulus_core::wire::program;
use std::sync::Arc;

/// How far the place of a section may be from that of its leg: the last digit of the text.
const SAME: Length = Length::from_um(1);

/// A job in a controller's words.
#[derive(Clone)]
pub(super) struct Order {
    /// SHA-256 of the program's bytes.
    pub(super) key: String,
    /// These.
    pub(super) bytes: Vec<u8>,
    /// The program.
    pub(super) program: Program,
    /// What is sent, as text.
    pub(super) text: String,
    /// The same, section by section.
    pub(super) routine: Arc<Routine>,
    /// The leg of each section.
    pub(super) legs: Vec<usize>,
}

/// A job that was compared.
pub(super) struct Armed {
    /// The job.
    pub(super) order: Order,
    /// The leg that was asked for.
    pub(super) from_leg: u32,
    /// What the engine is asked for.
    pub(super) start: EngineStart,
    /// The work zero that it was compared with, machine coordinates.
    pub(super) zero_mm: Option<[f64; 3]>,
    /// Why its depth cannot be what it should.
    pub(super) refused: Option<Diagnostic>,
}

impl Order {
    /// The program `bytes` written for a controller that is `machine`.
    pub(super) fn written(key: &str, bytes: &[u8], machine: &Machine) -> Result<Self, Diagnostic> {
        let program = program::decode(bytes)?;
        let manner = Manner { files: Some(FileSplit::Job), ..Manner::on(machine) };
        let briefing = Briefing::of(&program);
        let written =
            post::write_for("grbl", &program, &manner, &briefing, 0).unwrap_or_else(|| Ok(Vec::new()))?;
        let dialect = post::dialect("grbl").and_then(Result::ok).map(|dialect| dialect.in_manner(&manner));
        let proved = post::proved((dialect.as_ref(), false), &program, &written, &proof::differences);
        if let Some(error) = proved.into_iter().find(|diagnostic| diagnostic.severity == Severity::Error) {
            return Err(error);
        }
        let text = written.into_iter().map(|file| file.text).collect();
        Self::read(key, bytes, text)
    }

    /// The program `bytes` with the text that was made of it.
    pub(super) fn read(key: &str, bytes: &[u8], text: String) -> Result<Self, Diagnostic> {
        let program = program::decode(bytes)?;
        let file = (program.name.clone(), text);
        let routine = controller::read(&program.name, std::slice::from_ref(&file))?;
        let legs = legs(&program, &routine);
        let (key, bytes, routine) = (key.to_owned(), bytes.to_vec(), Arc::new(routine));
        Ok(Self { key, bytes, program, text: file.1, routine, legs })
    }

    /// The same, its depth following the surface of `map`, and by how much it is corrected.
    pub(super) fn following(&self, map: &HeightMap) -> Result<(Self, Correction), Diagnostic> {
        let (routine, correction) = controller::level_routine(&self.routine, map, TOLERANCE)?;
        Ok((Self { routine: Arc::new(routine), ..self.clone() }, correction))
    }

    /// The leg of section `section`; behind the last one, how many legs there are.
    pub(super) fn leg(&self, section: usize) -> usize {
        self.legs.get(section).copied().unwrap_or(self.program.legs.len())
    }

    /// Holes and toolpaths in the legs before section `section`.
    pub(super) fn made(&self, section: usize) -> (u32, u32) {
        made(self.program.legs.iter().take(self.leg(section)))
    }
}

/// The leg of each section, in order: none goes back.
pub(super) fn legs(program: &Program, routine: &Routine) -> Vec<usize> {
    let mut next = 0;
    let mut of = |section: &controller::Section| {
        let is = |leg: &usize| match (section.kind, program.legs[*leg].mark) {
            (SectionKind::Change(_), Mark::ToolChange(_)) | (SectionKind::Finish, Mark::Finish) => true,
            (SectionKind::Hole(_) | SectionKind::Toolpath(_), Mark::Hole(_) | Mark::Toolpath(_)) => {
                lies(begins(program, *leg), section.entry)
            }
            _ => false,
        };
        // A leg that is cut in two, as where a path leaves the board on its way, is that of both.
        let found = (next..program.legs.len()).find(is);
        let leg = found.unwrap_or(next.saturating_sub(1));
        next = found.map_or(next, |leg| leg + 1);
        leg
    };
    routine.sections.iter().map(&mut of).collect()
}

/// Where leg `leg` goes down first.
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
