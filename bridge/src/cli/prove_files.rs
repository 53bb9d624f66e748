//! Reads back the programs and files to prove, and lays them on the board, side by side.
//!
//! ```text
//!   FILE… ─ read back ─▶ programs, by the side in their headers ─┬─ top ─▶ board unchanged
//!   JOB, job file ─▶ position of the board and its zero ─────────┴─ bottom ─ flipped
//! ```

use super::Refusal;
use crate::cli::job;
use annulus_core::board::{Board, Face};
use annulus_core::cam::toolpaths::PlacedBoard;
use annulus_core::cam::work::Work;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::error;
use annulus_core::gcode::Interpreter;
use annulus_core::geometry::Point;
use annulus_core::job::{Bit, Program};
use annulus_core::post::{self, ReadBack};
use annulus_core::units::Length;
use std::collections::BTreeMap;
use std::fs;
use std::io::{self, Read};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// A program, or a file read back.
pub(super) enum Given {
    /// A program in Annulus' own format, which contains its zero.
    Own(Program),
    /// A file for a controller.
    File(Box<ReadBack>),
}

impl Given {
    /// Board thickness in the header.
    pub(super) fn thickness(&self) -> Option<Length> {
        if let Self::File(written) = self { written.thickness } else { None }
    }
}

/// Returns `true` if the file at `path` is an HTML page, such as the run sheet.
pub(super) fn is_page(path: &Path) -> bool {
    let mut head = Vec::new();
    // Bytes read from a pipe can't be read again.
    if !path.is_file() {
        return false;
    }
    let read = fs::File::open(path).and_then(|file| file.take(64).read_to_end(&mut head));
    let head = head.trim_ascii_start().to_ascii_lowercase();
    read.is_ok() && (head.starts_with(b"<!doctype html") || head.starts_with(b"<html"))
}

/// Reads the file at `path`.
pub(super) fn given(path: &Path, tools: &Tools, of: Interpreter) -> Result<Given, Refusal> {
    if let Some(program) = job::program_file(path)? {
        return Ok(Given::Own(program));
    }
    let trouble = |error: io::Error| job::unreadable(path, &error);
    let name = path.display().to_string();
    let mut bytes = Vec::new();
    let file = fs::File::open(path).map_err(trouble)?;
    // One byte over the limit: the file may grow meanwhile, and a pipe has no length.
    file.take(ReadBack::LARGEST as u64 + 1).read_to_end(&mut bytes).map_err(trouble)?;
    if bytes.len() > ReadBack::LARGEST {
        return Err(Refusal::content(error!("readback.too_large").at(&name, 0, 0)));
    }
    let text = String::from_utf8_lossy(&bytes);
    let read = post::read_back_for(&name, &text, &tools.for_file(path), of);
    let mut written = read.map_err(Refusal::content)?;
    written.diagnostics.append(&mut written.others);
    Ok(Given::File(Box::new(written)))
}

/// Tools named by the user: their file, `None` for all files, and their numbers.
#[derive(Default)]
pub(super) struct Tools {
    said: Vec<(Option<String>, u32, Bit)>,
}

impl Tools {
    /// Parses `--tools`: `N=TOOL`, or `FILE:N=TOOL`.
    pub(super) fn of(said: &[String]) -> Result<Self, Refusal> {
        let tool = |text: &String| {
            let (number, title) = text.split_once('=')?;
            let (file, number) = number.rsplit_once(':').map_or((None, number), |(file, n)| (Some(file), n));
            Some((file.map(str::to_owned), number.trim().parse().ok()?, post::titled(title)?))
        };
        let faulty = |text: &String| Refusal::usage(error!("prove.bad_tool", found = text));
        let said =
            said.iter().map(|text| tool(text).ok_or_else(|| faulty(text))).collect::<Result<_, _>>()?;
        Ok(Self { said })
    }

    /// Tools of the file at `path`. A tool named for one file overrides one for all.
    fn for_file(&self, path: &Path) -> BTreeMap<u32, Bit> {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let is_it = |file: &str| file.trim() == name || Path::new(file.trim()) == path;
        let of_all = self.said.iter().filter(|(file, ..)| file.is_none());
        let own = self.said.iter().filter(|(file, ..)| file.as_deref().is_some_and(is_it));
        of_all.chain(own).map(|(_, number, bit)| (*number, bit.clone())).collect()
    }

    /// Refuses a tool for a file that is not given.
    pub(super) fn all_given(&self, paths: &[PathBuf]) -> Result<(), Refusal> {
        let mut named = self.said.iter().filter_map(|(file, ..)| file.as_deref());
        let is_given = |file: &str| {
            let file = Path::new(file.trim());
            paths.iter().any(|path| path == file || path.file_name() == Some(file.as_os_str()))
        };
        let stray = named.find(|file| !is_given(file));
        stray.map_or(Ok(()), |file| Err(Refusal::usage(error!("prove.stray_tool", file = file))))
    }
}

/// The side in the name of one of Annulus' own programs, as `cam` writes it; `None` without one.
pub(super) fn own_side(program: &Program) -> Option<Face> {
    [Face::Top, Face::Bottom].into_iter().find(|side| program.name.ends_with(&format!("-{}", side.name())))
}

/// The programs for one side, and the board in their position.
pub(super) struct Laid {
    pub(super) face: Face,
    pub(super) board: Board,
    /// Indices of the pin holes among its holes.
    pub(super) pins: Range<u32>,
    pub(super) programs: Vec<Program>,
    pub(super) diagnostics: Vec<Diagnostic>,
}

impl Laid {
    pub(super) fn has_copper(&self) -> bool {
        self.board.copper.iter().any(|copper| copper.face == self.face)
    }
}

/// Lays the board for every side of the programs: the side in their headers; otherwise `face`; otherwise the
/// job's upper side.
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
