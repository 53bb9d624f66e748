//! Programs and written files that are to be proved: read back, and laid on the board side by side (N8, C6).
//!
//! ```text
//!   FILE… ─ read back ─▶ programs, by the side of their heads ─┬─ top ─▶ board as it lies
//!   JOB, job file ─▶ how the board lies, where its zero is ────┴─ bottom ─ turned
//! ```
//!
//! Comes in: the board, the job that lays it, programs and files with the tools that they state. Goes out: the sides as they lie.
//! Does not know what is proved of them.

use super::Refusal;
use crate::cli::job;
use annulus_core::board::{Board, Face};
use annulus_core::cam::toolpaths::PlacedBoard;
use annulus_core::cam::work::Work;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::geometry::Point;
use annulus_core::job::{Bit, Program};
use annulus_core::post::{self, ReadBack};
use annulus_core::units::Length;
use std::collections::BTreeMap;
use std::fs;
use std::io::Read;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// A program, or a file read back.
pub(super) enum Given {
    /// One of Annulus' own: it knows where its zero is.
    Own(Program),
    /// A file in the words of a controller.
    File(Box<ReadBack>),
}

impl Given {
    /// How thick its head says the board is.
    pub(super) fn thickness(&self) -> Option<Length> {
        if let Self::File(written) = self { written.thickness } else { None }
    }
}

/// What stands in the file at `path`.
pub(super) fn given(path: &Path, tools: &Tools) -> Result<Given, Refusal> {
    if let Some(program) = job::program_file(path)? {
        return Ok(Given::Own(program));
    }
    let trouble = |error: std::io::Error| {
        let why = Diagnostic::error("job.unreadable").with("file", path.display());
        Refusal::surroundings(why.with("reason", error))
    };
    let name = path.display().to_string();
    let mut bytes = Vec::new();
    let file = fs::File::open(path).map_err(trouble)?;
    // One byte more than may be read: the file may grow meanwhile, or be a pipe that has no length.
    file.take(ReadBack::LARGEST as u64 + 1).read_to_end(&mut bytes).map_err(trouble)?;
    if bytes.len() > ReadBack::LARGEST {
        return Err(Refusal::content(Diagnostic::error("readback.too_large").at(&name, 0, 0)));
    }
    let text = String::from_utf8_lossy(&bytes);
    let written = post::read_back(&name, &text, &tools.for_file(path)).map_err(Refusal::content)?;
    Ok(Given::File(Box::new(written)))
}

/// Tools that a person names: by the file that they are for, none for all, and their numbers.
#[derive(Default)]
pub(super) struct Tools {
    said: Vec<(Option<String>, u32, Bit)>,
}

impl Tools {
    /// Those of `--tools`: `N=TOOL`, or `FILE:N=TOOL`.
    pub(super) fn of(said: &[String]) -> Result<Self, Refusal> {
        let tool = |text: &String| {
            let (number, title) = text.split_once('=')?;
            let (file, number) = number.rsplit_once(':').map_or((None, number), |(file, n)| (Some(file), n));
            Some((file.map(str::to_owned), number.trim().parse().ok()?, post::titled(title)?))
        };
        let faulty = |text: &String| Refusal::usage(Diagnostic::error("prove.bad_tool").with("found", text));
        let said =
            said.iter().map(|text| tool(text).ok_or_else(|| faulty(text))).collect::<Result<_, _>>()?;
        Ok(Self { said })
    }

    /// Those of the file at `path`; what is said of it alone goes before what is said of all.
    fn for_file(&self, path: &Path) -> BTreeMap<u32, Bit> {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let is_it = |file: &str| file.trim() == name || Path::new(file.trim()) == path;
        let of_all = self.said.iter().filter(|(file, ..)| file.is_none());
        let own = self.said.iter().filter(|(file, ..)| file.as_deref().is_some_and(is_it));
        of_all.chain(own).map(|(_, number, bit)| (*number, bit.clone())).collect()
    }

    /// Refuses a tool of a file that is not given.
    pub(super) fn all_given(&self, paths: &[PathBuf]) -> Result<(), Refusal> {
        let mut named = self.said.iter().filter_map(|(file, ..)| file.as_deref());
        let is_given = |file: &str| {
            let file = Path::new(file.trim());
            paths.iter().any(|path| path == file || path.file_name() == Some(file.as_os_str()))
        };
        let stray = named.find(|file| !is_given(file));
        stray.map_or(Ok(()), |file| {
            Err(Refusal::usage(Diagnostic::error("prove.stray_tool").with("file", file)))
        })
    }
}

/// The side that one of Annulus' own programs is for, as `cam` names it; none where its name does not say.
pub(super) fn own_side(program: &Program) -> Option<Face> {
    [Face::Top, Face::Bottom].into_iter().find(|side| program.name.ends_with(&format!("-{}", side.name())))
}

/// The programs for one side, and the board as it lies for them.
pub(super) struct Laid {
    pub(super) face: Face,
    pub(super) board: Board,
    /// The holes for pins among its holes.
    pub(super) pins: Range<u32>,
    pub(super) programs: Vec<Program>,
    pub(super) diagnostics: Vec<Diagnostic>,
}

impl Laid {
    pub(super) fn has_copper(&self) -> bool {
        self.board.copper.iter().any(|copper| copper.face == self.face)
    }
}

/// Lays the board for every side that programs are for: as their heads say, else `face`, else the side that the job has up.
pub(super) fn laid(board: &Board, work: &Work, face: Option<Face>, given: Vec<Given>) -> Vec<Laid> {
    let mut sides: Vec<Laid> = Vec::new();
    for one in given {
        let (mut program, side, of_files, diagnostics) = match one {
            Given::Own(program) => {
                let side = if face.is_none() { own_side(&program) } else { None };
                (program, side.map(|side| side.name().to_owned()), None, Vec::new())
            }
            Given::File(written) => {
                let ReadBack { program, side, of_files, diagnostics, .. } = *written;
                (program, side, Some(of_files), diagnostics)
            }
        };
        let said = side.as_deref().map(|side| if side == "bottom" { Face::Bottom } else { Face::Top });
        let face = said.or(face).unwrap_or(work.setup.face);
        let known = sides.iter().position(|side| side.face == face);
        let mut work = work.clone();
        work.setup.face = face;
        let scene = PlacedBoard::of(board, &work);
        match of_files {
            Some(true) => program.origin = Point::default(),
            Some(false) => program.origin = scene.origin,
            None => {}
        }
        match known.and_then(|at| sides.get_mut(at)) {
            Some(side) => {
                side.programs.push(program);
                side.diagnostics.extend(diagnostics);
            }
            None => {
                let (pins, programs) = (scene.pins, vec![program]);
                sides.push(Laid { face, board: scene.board, pins, programs, diagnostics });
            }
        }
    }
    sides
}
