//! The programs of a job for a controller: files of G-code as they stand, or a board that is planned and written in its words.
//!
//! Comes in: paths. Goes out: a routine, and the files from which it can be read again. A board is written into the folder of data, so
//! that the job can be resumed though the board has changed, with what its tools are counted by. Does not know ports.

use crate::cli::{JobArgs, job};
use crate::machine_file;
use crate::refusal::Refusal;
use annulus_core::controller::{self, Routine};
use annulus_core::diagnostic::{Diagnostic, Severity};
use annulus_core::geometry::Point;
use annulus_core::job::{Briefing, Program};
use annulus_core::level;
use annulus_core::machine::{Machine, RackTool, ToolWear};
use annulus_core::post::{self, FileSplit, Manner};
use annulus_drill::controller::{JobTools, SectionWear};
use serde::{Deserialize, Serialize};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Endings of files of G-code.
const ENDINGS: &[&str] = &["nc", "ngc", "gc", "gcode", "g", "tap", "cnc"];
/// Largest file of G-code.
const LARGEST: u64 = 256 * 1024 * 1024;

/// What is run.
pub(super) struct Programs {
    /// The job.
    pub(super) routine: Arc<Routine>,
    /// What a height map of it is for.
    pub(super) level_key: String,
    /// Where it can be read again.
    pub(super) files: Vec<PathBuf>,
    /// What its tools are counted by, where it is a board.
    pub(super) counted: Option<Counted>,
    /// What there is to say of it.
    pub(super) diagnostics: Vec<Diagnostic>,
}

/// What the tools of a board's job are counted by: kept beside its words, which do not say of which tool of the rack they are.
#[derive(Clone, Serialize, Deserialize)]
pub(super) struct Counted {
    /// That of the routine.
    key: String,
    machine: String,
    /// As lines.
    rack: Vec<String>,
    sections: SectionWear,
}

impl Counted {
    fn of(routine: &Routine, program: &Program, machine: &Machine) -> Self {
        let rack = machine.rack.iter().map(RackTool::to_string).collect();
        let (key, machine) = (routine.key.clone(), machine.name.clone());
        Self { key, machine, rack, sections: SectionWear::of(program, routine) }
    }

    fn path() -> PathBuf {
        machine_file::data_folder().join("controller-tools.json")
    }

    /// What was kept for the routine with this key.
    fn kept(key: &str) -> Option<Self> {
        let path = Self::path();
        let small = fs::metadata(&path).is_ok_and(|file| file.len() <= LARGEST);
        let kept: Self = serde_json::from_slice(&fs::read(path).ok().filter(|_| small)?).ok()?;
        (kept.key == key).then_some(kept)
    }

    /// The tools of the job, which have done what is `known`.
    pub(super) fn tools(&self, known: Vec<ToolWear>) -> JobTools {
        let rack: Vec<RackTool> = self.rack.iter().filter_map(|line| RackTool::read(line).ok()).collect();
        JobTools::new(self.sections.clone(), (&self.machine, &rack), known)
    }
}

fn is_gcode(path: &Path) -> bool {
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase());
    ending.is_some_and(|ending| ENDINGS.contains(&&*ending))
}

/// Reads the job of the command line.
pub(super) fn read(args: &JobArgs, more: &[PathBuf]) -> Result<Programs, Refusal> {
    if is_gcode(&args.job) {
        let all: Vec<PathBuf> = std::iter::once(&args.job).chain(more).cloned().collect();
        return read_again(&all);
    }
    let opened = job::open(args)?;
    let manner = Manner { files: Some(FileSplit::Job), ..Manner::on(&opened.machine) };
    let briefing = Briefing::of(&opened.program);
    let written =
        post::write_for("grbl", &opened.program, &manner, &briefing, 0).unwrap_or_else(|| Ok(Vec::new()));
    let written = written.map_err(Refusal::content)?;
    let dialect = post::dialect("grbl").and_then(Result::ok).map(|dialect| dialect.in_manner(&manner));
    let proved =
        post::proved((dialect.as_ref(), false), &opened.program, &written, &annulus_core::proof::differences);
    if let Some(error) = proved.iter().find(|diagnostic| diagnostic.severity == Severity::Error) {
        return Err(Refusal::content(error.clone()));
    }
    let write = |path: PathBuf, bytes: &[u8]| match machine_file::write_own(&path, bytes) {
        Ok(()) => Ok(path),
        Err(error) => {
            let why = Diagnostic::error("job.not_written").with("file", path.display());
            Err(Refusal::surroundings(why.with("reason", error)))
        }
    };
    let mut files = Vec::new();
    for file in written {
        files.push(write(machine_file::data_folder().join("controller.nc"), file.text.as_bytes())?);
    }
    let mut programs = read_again(&files)?;
    let counted = Counted::of(&programs.routine, &opened.program, &opened.machine);
    write(Counted::path(), &serde_json::to_vec(&counted).unwrap_or_default())?;
    programs.counted = Some(counted);
    programs.level_key = level::key_of(&opened.program);
    programs.diagnostics = [opened.diagnostics, proved].concat();
    Ok(programs)
}

/// Reads files of G-code.
pub(super) fn read_again(paths: &[PathBuf]) -> Result<Programs, Refusal> {
    let mut texts = Vec::new();
    let mut files = Vec::new();
    for path in paths {
        let cannot = |reason: &dyn std::fmt::Display| {
            let why = Diagnostic::error("job.unreadable").with("file", path.display());
            Refusal::surroundings(why.with("reason", reason))
        };
        let size = fs::metadata(path).map_err(|error| cannot(&error))?.len();
        if size > LARGEST {
            return Err(Refusal::content(Diagnostic::error("grbl.too_long").at(
                &path.display().to_string(),
                0,
                0,
            )));
        }
        let bytes = fs::read(path).map_err(|error| cannot(&error))?;
        texts.push((path.display().to_string(), String::from_utf8_lossy(&bytes).into_owned()));
        files.push(std::path::absolute(path).map_err(|error| cannot(&error))?);
    }
    let name = paths.first().map_or_else(String::new, |path| job::stem(path).display().to_string());
    let routine = controller::read(&name, &texts).map_err(Refusal::content)?;
    let level_key = level::job_key(&routine.name, Point::default());
    let counted = Counted::kept(&routine.key);
    Ok(Programs { routine: Arc::new(routine), level_key, files, counted, diagnostics: Vec::new() })
}
