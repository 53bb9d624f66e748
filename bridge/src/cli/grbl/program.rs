//! Programs of a job for a controller: G-code files unchanged, or a board that is planned and written as
//! G-code.
//!
//! A board's G-code is saved in the data folder, with its tool counts and the key of its height map, so that
//! the job can be resumed even if the board file has changed. Two files alternate: an interrupted job keeps
//! its own until another one starts.

use crate::cli::{JobArgs, job};
use crate::grbl::{DiskFiles, Ledger};
use crate::machine_file;
use crate::refusal::Refusal;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::error;
use annulus_core::grbl::{self, Routine, WrittenLine, level_key};
use annulus_core::job::Program;
use annulus_core::level::key_of;
use annulus_core::machine::{Machine, RackTool, ToolWear};
use annulus_core::sim;
use annulus_host::grbl::{JobTools, SectionWear, gcode_of};
use serde::{Deserialize, Serialize};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Extensions of G-code files.
const ENDINGS: &[&str] = &["nc", "ngc", "gc", "gcode", "g", "tap", "cnc"];
/// Files for the G-code of a board, used alternately.
const HALVES: [&str; 2] = ["controller.nc", "controller-b.nc"];
/// Maximum size of a G-code file, in bytes.
const LARGEST: u64 = 256 * 1024 * 1024;

/// The programs to run.
pub(super) struct Programs {
    pub(super) routine: Arc<Routine>,
    /// Key of its height map.
    pub(super) level_key: String,
    /// Where to read the programs again.
    pub(super) files: Vec<PathBuf>,
    /// Tool counts, for a board.
    pub(super) counted: Option<Counted>,
    pub(super) diagnostics: Vec<Diagnostic>,
    /// The lines as in the files.
    pub(super) written: Arc<[WrittenLine]>,
}

/// Data of a board's job that its G-code lacks: the tools of the list, and the board. Saved next to the
/// G-code.
#[derive(Clone, Serialize, Deserialize)]
pub(super) struct Counted {
    /// Key of the routine.
    key: String,
    machine: String,
    /// As text lines.
    rack: Vec<String>,
    sections: SectionWear,
    /// Name of the board and key of its height map; empty if an older version wrote the file.
    #[serde(default)]
    name: String,
    #[serde(default)]
    level_key: String,
}

impl Counted {
    fn of(routine: &Routine, program: &Program, machine: &Machine) -> Self {
        let rack = machine.rack.iter().map(RackTool::to_string).collect();
        let (key, machine) = (routine.key.clone(), machine.name.clone());
        let (sections, name, level_key) =
            (SectionWear::of(program, routine), program.name.clone(), key_of(program));
        Self { key, machine, rack, sections, name, level_key }
    }

    /// The file next to the G-code file `words`.
    fn path(words: &Path) -> PathBuf {
        let stem = words.file_stem().unwrap_or_default().to_string_lossy();
        words.with_file_name(format!("{stem}-tools.json"))
    }

    /// Reads the data saved next to the G-code file `words`, if it belongs to the routine with this key.
    fn kept(words: &Path, key: &str) -> Option<Self> {
        let path = Self::path(words);
        let small = fs::metadata(&path).is_ok_and(|file| file.len() <= LARGEST);
        let kept: Self = serde_json::from_slice(&fs::read(path).ok().filter(|_| small)?).ok()?;
        (kept.key == key).then_some(kept)
    }

    /// The tools of the job, with their known wear.
    fn tools(&self, known: Vec<ToolWear>) -> JobTools {
        let rack: Vec<RackTool> = self.rack.iter().filter_map(|line| RackTool::read(line).ok()).collect();
        JobTools::new(self.sections.clone(), (&self.machine, &rack), known)
    }
}

impl Programs {
    /// Takes over name, height map key and tool counts of a board.
    fn keeps(&mut self, counted: Counted) {
        if !counted.level_key.is_empty() {
            self.level_key.clone_from(&counted.level_key);
            self.routine = Arc::new(Routine { name: counted.name.clone(), ..self.routine.as_ref().clone() });
        }
        self.counted = Some(counted);
    }

    /// The tools of the job with their `known` wear; `None` for G-code files, which don't name their tools.
    pub(super) fn tools(&self, known: &[ToolWear]) -> Option<JobTools> {
        self.counted.as_ref().map(|counted| counted.tools(known.to_vec()))
    }
}

/// Returns `true` if the file has a G-code extension.
pub(in crate::cli) fn is_gcode(path: &Path) -> bool {
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase());
    ending.is_some_and(|ending| ENDINGS.contains(&&*ending))
}

/// Reads the job of the command line. Leaves the files of a job that the `ledger` lists as interrupted
/// unchanged.
pub(super) fn read(args: &JobArgs, more: &[PathBuf], ledger: &Ledger) -> Result<Programs, Refusal> {
    if is_gcode(&args.job) {
        let all: Vec<PathBuf> = std::iter::once(&args.job).chain(more).cloned().collect();
        return read_again(&all);
    }
    let opened = job::open(args)?;
    let (text, proved) = gcode_of(&opened.program, &opened.machine).map_err(Refusal::content)?;
    let write = |path: PathBuf, bytes: &[u8]| match machine_file::write_own(&path, bytes) {
        Ok(()) => Ok(path),
        Err(error) => {
            let why = error!("job.not_written", file = path.display(), ..);
            Err(Refusal::surroundings(why.with("reason", error)))
        }
    };
    let words = write(free_half(ledger), text.as_bytes())?;
    let mut programs = read_again(std::slice::from_ref(&words))?;
    let counted = Counted::of(&programs.routine, &opened.program, &opened.machine);
    write(Counted::path(&words), &serde_json::to_vec(&counted).unwrap_or_default())?;
    programs.keeps(counted);
    programs.diagnostics.splice(0..0, [opened.diagnostics, proved].concat());
    Ok(programs)
}

/// A job as a run reads it, without saving its G-code.
pub(super) struct Preview {
    pub(super) routine: Arc<Routine>,
    /// Time of a board on its machine, s, without tool changes.
    pub(super) time_s: Option<f64>,
    pub(super) diagnostics: Vec<Diagnostic>,
}

/// Reads the job of the command line, and writes nothing.
pub(super) fn preview(args: &JobArgs, more: &[PathBuf]) -> Result<Preview, Refusal> {
    if is_gcode(&args.job) {
        let all: Vec<PathBuf> = std::iter::once(&args.job).chain(more).cloned().collect();
        let Programs { routine, diagnostics, .. } = read_again(&all)?;
        return Ok(Preview { routine, time_s: None, diagnostics });
    }
    let opened = job::open(args)?;
    let (text, proved) = gcode_of(&opened.program, &opened.machine).map_err(Refusal::content)?;
    let name = opened.program.name.clone();
    let (routine, _) = grbl::read_written(&name, &[(name.clone(), text)]).map_err(Refusal::content)?;
    let time_s = sim::times_s(&opened.program, &opened.machine).ok().map(|(total_s, _)| total_s);
    let diagnostics = [opened.diagnostics, proved, routine.warnings.clone()].concat();
    Ok(Preview { routine: Arc::new(routine), time_s, diagnostics })
}

/// The G-code file that the interrupted job does not use.
fn free_half(ledger: &Ledger) -> PathBuf {
    let taken = ledger.interrupted().map(|entry| entry.files.as_slice()).unwrap_or_default();
    let is_taken = |path: &PathBuf| std::path::absolute(path).is_ok_and(|path| taken.contains(&path));
    let [first, second] = HALVES.map(|name| machine_file::data_folder().join(name));
    if is_taken(&first) { second } else { first }
}

/// The G-code files of the last job. A job from a page has one file, written by the ledger.
pub(super) fn files_of(ledger: &Ledger, files: &DiskFiles) -> Vec<PathBuf> {
    let own = ledger.interrupted().map(|entry| entry.files.clone()).unwrap_or_default();
    if own.is_empty() { ledger.sent().map(|file| files.path(file)).into_iter().collect() } else { own }
}

pub(super) fn read_again(paths: &[PathBuf]) -> Result<Programs, Refusal> {
    let mut texts = Vec::new();
    let mut files = Vec::new();
    for path in paths {
        let cannot = |reason: &dyn std::fmt::Display| {
            let why = error!("job.unreadable", file = path.display(), ..);
            Refusal::surroundings(why.with("reason", reason))
        };
        let size = fs::metadata(path).map_err(|error| cannot(&error))?.len();
        if size > LARGEST {
            return Err(Refusal::content(error!("grbl.too_long").at(&path.display().to_string(), 0, 0)));
        }
        let bytes = fs::read(path).map_err(|error| cannot(&error))?;
        texts.push((path.display().to_string(), String::from_utf8_lossy(&bytes).into_owned()));
        files.push(std::path::absolute(path).map_err(|error| cannot(&error))?);
    }
    let name = paths.first().map_or_else(String::new, |path| job::stem(path).display().to_string());
    let (routine, written) = grbl::read_written(&name, &texts).map_err(Refusal::content)?;
    let counted = paths.first().and_then(|words| Counted::kept(words, &routine.key));
    let level_key = level_key(&routine);
    let (diagnostics, written) = (routine.warnings.clone(), written.into());
    let routine = Arc::new(routine);
    let mut programs = Programs { routine, level_key, files, counted: None, diagnostics, written };
    if let Some(counted) = counted {
        programs.keeps(counted);
    }
    Ok(programs)
}
