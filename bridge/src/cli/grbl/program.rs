//! The programs of a job for a controller: files of G-code as they stand, or a board that is planned and written in its words.
//!
//! Comes in: paths. Goes out: a routine, and the files from which it can be read again. A board is written into the folder of data, so
//! that the job can be resumed though the board has changed, with what its tools are counted by and what its height map is for: into one
//! of two places, by turns, so that the job that was broken off keeps its own until another one has begun. Does not know ports.

use crate::cli::{JobArgs, job};
use crate::controller::ledger::Ledger;
use crate::machine_file;
use crate::refusal::Refusal;
use annulus_core::controller::{self, Routine, level_key};
use annulus_core::diagnostic::{Diagnostic, Severity};
use annulus_core::job::{Briefing, Program};
use annulus_core::level::key_of;
use annulus_core::machine::{Machine, RackTool, ToolWear};
use annulus_core::post::{self, FileSplit, Manner};
use annulus_drill::controller::{JobTools, SectionWear};
use serde::{Deserialize, Serialize};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Endings of files of G-code.
const ENDINGS: &[&str] = &["nc", "ngc", "gc", "gcode", "g", "tap", "cnc"];
/// Where the words of a board are written, by turns.
const HALVES: [&str; 2] = ["controller.nc", "controller-b.nc"];
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

/// What of a board's job is kept beside its words, which do not say of which tool of the rack they are, nor which board they are of.
#[derive(Clone, Serialize, Deserialize)]
pub(super) struct Counted {
    /// That of the routine.
    key: String,
    machine: String,
    /// As lines.
    rack: Vec<String>,
    sections: SectionWear,
    /// The name of the board, and what its height map is for; empty where an older version wrote this.
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

    /// Beside the words in the file `words`.
    fn path(words: &Path) -> PathBuf {
        let stem = words.file_stem().unwrap_or_default().to_string_lossy();
        words.with_file_name(format!("{stem}-tools.json"))
    }

    /// What was kept beside the words in the file `words`, of the routine with this key.
    fn kept(words: &Path, key: &str) -> Option<Self> {
        let path = Self::path(words);
        let small = fs::metadata(&path).is_ok_and(|file| file.len() <= LARGEST);
        let kept: Self = serde_json::from_slice(&fs::read(path).ok().filter(|_| small)?).ok()?;
        (kept.key == key).then_some(kept)
    }

    /// The tools of the job, which have done what is `known`.
    fn tools(&self, known: Vec<ToolWear>) -> JobTools {
        let rack: Vec<RackTool> = self.rack.iter().filter_map(|line| RackTool::read(line).ok()).collect();
        JobTools::new(self.sections.clone(), (&self.machine, &rack), known)
    }
}

impl Programs {
    /// It is the board that `counted` is of.
    fn keeps(&mut self, counted: Counted) {
        if !counted.level_key.is_empty() {
            self.level_key.clone_from(&counted.level_key);
            self.routine = Arc::new(Routine { name: counted.name.clone(), ..self.routine.as_ref().clone() });
        }
        self.counted = Some(counted);
    }

    /// The tools of the job, by what is kept in the `ledger`; none of finished programs, which do not say which they are.
    pub(super) fn tools(&self, ledger: &Ledger) -> Option<JobTools> {
        self.counted.as_ref().map(|counted| counted.tools(ledger.wear()))
    }
}

fn is_gcode(path: &Path) -> bool {
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase());
    ending.is_some_and(|ending| ENDINGS.contains(&&*ending))
}

/// Reads the job of the command line. What the `ledger` says was broken off stays as it is.
pub(super) fn read(args: &JobArgs, more: &[PathBuf], ledger: &Ledger) -> Result<Programs, Refusal> {
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
        files.push(write(free_half(ledger), file.text.as_bytes())?);
    }
    let mut programs = read_again(&files)?;
    let counted = Counted::of(&programs.routine, &opened.program, &opened.machine);
    for words in &files {
        write(Counted::path(words), &serde_json::to_vec(&counted).unwrap_or_default())?;
    }
    programs.keeps(counted);
    programs.diagnostics = [opened.diagnostics, proved].concat();
    Ok(programs)
}

/// The place for a board's words that the job that was broken off does not lie in.
fn free_half(ledger: &Ledger) -> PathBuf {
    let taken = ledger.interrupted().map(|entry| entry.files).unwrap_or_default();
    let is_taken = |path: &PathBuf| std::path::absolute(path).is_ok_and(|path| taken.contains(&path));
    let [first, second] = HALVES.map(|name| machine_file::data_folder().join(name));
    if is_taken(&first) { second } else { first }
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
    let counted = paths.first().and_then(|words| Counted::kept(words, &routine.key));
    let level_key = level_key(&routine);
    let mut programs =
        Programs { routine: Arc::new(routine), level_key, files, counted: None, diagnostics: Vec::new() };
    if let Some(counted) = counted {
        programs.keeps(counted);
    }
    Ok(programs)
}
