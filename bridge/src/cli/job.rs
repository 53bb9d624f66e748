//! Opens the JOB of the command line: a board, which is planned, or a planned program.
//!
//! ```text
//!  JOB ─┬─ program file ──────────────────────────────▶ Job (program unchanged)
//!       └─ drill files, saved project ─ files ─▶ Board ─ cam ─▶ Planned ─▶ Job (program and figures)
//! ```

use super::files::{self, ReadFiles};
use super::saving::Given;
use super::{Group, JobArgs, ReadingArgs, verbosity};
use crate::machine_file;
use crate::refusal::Refusal;
use annulus_core::board::{Board, Face, Hole};
use annulus_core::cam::figures::{Figures, figures};
use annulus_core::cam::toolpaths::{Means, lower_work, plan_work};
use annulus_core::cam::work::{Operation, Work};
use annulus_core::cam::{self, PlanOptions, PlanningProgress};
use annulus_core::diagnostic::{Diagnostic, Severity, nearest};
use annulus_core::geometry::Point;
use annulus_core::job::{Command, Mark, Program};
use annulus_core::locale;
use annulus_core::machine::{self, Machine};
use annulus_core::motion;
use annulus_core::project;
use annulus_core::proof;
use annulus_core::sim;
use annulus_core::units::Length;
use annulus_core::wire::program;
use annulus_core::{code, error};
use indicatif::ProgressBar;
use std::collections::BTreeSet;
use std::fs;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

/// Maximum diameter of a loaded tool, in mm.
const LARGEST_BIT_MM: f64 = 100.0;

/// A job ready to be exported, simulated or run.
#[derive(Debug)]
pub(crate) struct Job {
    pub(crate) machine: Machine,
    pub(crate) program: Program,
    /// Figures of the plan; `None` for a program file.
    pub(crate) figures: Option<Figures>,
    /// Messages from reading and planning, without refusals.
    pub(crate) diagnostics: Vec<Diagnostic>,
}

/// Opens a job: a program file unchanged, anything else read and planned.
pub(crate) fn open(args: &JobArgs) -> Result<Job, Refusal> {
    let machine = machine_file::named(args.on.name())?.machine;
    match program_file(&args.job)? {
        Some(program) => Ok(Job { machine, program, figures: None, diagnostics: Vec::new() }),
        None => {
            let (board, diagnostics, saved) = read_board(args)?;
            planned(args, machine, (board, saved), diagnostics)
        }
    }
}

/// Opens a job whose steps are needed: a program must be planned for this machine.
pub(crate) fn open_for_machine(args: &JobArgs) -> Result<Job, Refusal> {
    let job = open(args)?;
    if job.program.machine != job.machine.fingerprint() {
        let why = error!("job.other_machine", machine = &job.machine.name);
        return Err(Refusal::content(why));
    }
    Ok(job)
}

/// Plans the job again, even from a program file, and returns its figures.
pub(crate) fn plan(args: &JobArgs) -> Result<(Job, Figures), Refusal> {
    let machine = machine_file::named(args.on.name())?.machine;
    let (board, diagnostics, saved) = match program_file(&args.job)? {
        Some(program) => {
            let (board, diagnostics) = board_of(&program, &args.accept)?;
            (board, diagnostics, None)
        }
        None => read_board(args)?,
    };
    let mut job = planned(args, machine, (board, saved), diagnostics)?;
    let figures = job.figures.take().unwrap_or_default();
    Ok((job, figures))
}

/// Writes `bytes` to `path` atomically. A pipe or a terminal is written directly.
pub(crate) fn write_output(path: &Path, bytes: &[u8]) -> Result<(), Refusal> {
    let special = fs::metadata(path).is_ok_and(|kind| !kind.is_file() && !kind.is_dir());
    let written = std::path::absolute(path).and_then(|whole| {
        if special {
            return fs::write(path, bytes);
        }
        fs::metadata(whole.parent().unwrap_or(&whole))?;
        machine_file::write_whole(&whole, bytes)
    });
    written.map_err(|error| {
        let why = error!("job.not_written", file = path.display(), reason = error);
        Refusal::surroundings(why)
    })
}

/// The lowest X and Y of all tool centers of `program`, in work coordinates.
pub(crate) fn low_corner(program: &Program) -> Point {
    sim::reach(program).map_or(Point::default(), |reach| reach.min)
}

/// The refusal of a job, program or postprocessor at `path`.
pub(super) fn unreadable(path: &Path, error: &io::Error) -> Refusal {
    Refusal::surroundings(error!("job.unreadable", file = path.display(), reason = error))
}

/// The program in the file `path`; `None` if the file is something else.
pub(crate) fn program_file(path: &Path) -> Result<Option<Program>, Refusal> {
    let trouble = |error: io::Error| unreadable(path, &error);
    if !fs::metadata(path).map_err(trouble)?.is_file() {
        return Ok(None);
    }
    let mut file = fs::File::open(path).map_err(trouble)?;
    let mut head = Vec::new();
    file.by_ref().take(64).read_to_end(&mut head).map_err(trouble)?;
    if !program::looks_like_one(&head) {
        return Ok(None);
    }
    let most = annulus_core::wire::PROGRAM_LIMIT as u64 + 1;
    file.take(most).read_to_end(&mut head).map_err(trouble)?;
    let name = path.display().to_string();
    program::decode(&head).map(Some).map_err(|diagnostic| Refusal::content(diagnostic.at(&name, 0, 0)))
}

/// The files at `paths`, their board, messages about it, and all messages about both. Refuses an error that is
/// not accepted.
pub(super) fn accepted_board(
    paths: &[PathBuf],
    reading: &ReadingArgs,
    accept: &[String],
    copper: bool,
) -> Result<(ReadFiles, Board, Vec<Diagnostic>, Vec<Diagnostic>), Refusal> {
    can_be_accepted(accept)?;
    let read = files::read_board(paths, reading)?;
    // A saved job may isolate copper, so the copper is needed to report the operations that are left out.
    let (board, mut diagnostics) = read.board(copper || read.job.is_some());
    diagnostics.extend(read.artwork.missing(&read.listed).cloned());
    let files = read.listed.iter().filter_map(|&index| read.artwork.files.get(index));
    let said: Vec<_> = files.flat_map(|file| &file.diagnostics).chain(&diagnostics).cloned().collect();
    unseen(&diagnostics, accept).map_err(|refusal| refusal.among(said.clone()))?;
    Ok((read, board, diagnostics, said))
}

/// The board of JOB, its messages, and the job of a saved project.
fn read_board(args: &JobArgs) -> Result<(Board, Vec<Diagnostic>, Option<String>), Refusal> {
    let paths = std::slice::from_ref(&args.job);
    let (read, board, diagnostics, said) = accepted_board(paths, &args.reading, &args.accept, false)?;
    if read.used.is_empty() {
        let why = error!("job.no_drill_file", path = args.job.display());
        said.iter().for_each(|one| super::say(Refusal::content(one.clone())));
        return Err(Refusal::content(why).among(said));
    }
    Ok((board, diagnostics, read.job))
}

/// The job of the project, or the default job for the board.
pub(crate) fn opened(board: &Board, saved: Option<&str>, machine: &Machine) -> Result<Work, Refusal> {
    let usual = Work::default_for(board, machine);
    let Some(text) = saved else { return Ok(usual) };
    project::read(project::saved::JOB, text, &usual).map_err(Refusal::content)
}

/// The drilling part of a saved job, for the side that it drills from, with its setup. The second value is an
/// error if the job does more.
fn holes_of(saved: &str, board: &Board, machine: &Machine) -> Result<(Work, Option<Diagnostic>), Refusal> {
    let mut work = opened(board, Some(saved), machine)?;
    let drills = |one: &&Operation| one.on && !one.uses_bit();
    let makes_holes = |one: &&Operation| one.on && one.action.rules().makes_holes;
    // Pin holes are drilled first, from the other side, so search from the end.
    let last_first = || work.operations.iter().rev();
    if let Some(last) = last_first().find(drills).or_else(|| last_first().find(makes_holes)) {
        work.setup.face = last.face;
    }
    let face = work.setup.face;
    let (kept, others): (Vec<Operation>, Vec<Operation>) = std::mem::take(&mut work.operations)
        .into_iter()
        .filter(|one| one.on)
        .partition(|one| one.face == face && one.action.rules().makes_holes);
    work.operations = kept;
    let why = error!("job.operations_left_out", count = others.len());
    Ok((work, (!others.is_empty()).then_some(why)))
}

#[derive(Debug)]
pub(crate) struct Whole {
    /// With copper and outline.
    pub(crate) board: Board,
    /// Messages about its files.
    pub(crate) diagnostics: Vec<Diagnostic>,
    pub(crate) given: Given,
    /// Job file of a saved project.
    pub(crate) job: Option<String>,
}

/// Reads the whole board of the files at `jobs`, with copper and outline.
pub(crate) fn read_whole(
    jobs: &[PathBuf],
    reading: &ReadingArgs,
    accept: &[String],
) -> Result<Whole, Refusal> {
    let (read, mut board, diagnostics, said) = accepted_board(jobs, reading, accept, true)?;
    if board.extent().is_none() {
        let path = jobs.first().map(|path| path.display().to_string()).unwrap_or_default();
        return Err(Refusal::content(error!("job.no_board", path = path)).among(said));
    }
    if board.name.is_empty() {
        board.name = jobs.first().map(|path| stem(path).display().to_string()).unwrap_or_default();
    }
    let ReadFiles { artwork, used, given, asked_for, said, job, .. } = read;
    let used = used.iter().filter_map(|&index| Some(artwork.files.get(index)?.name.clone())).collect();
    Ok(Whole { board, diagnostics, given: Given { files: given, asked_for, said, used }, job })
}

/// Checks the words of `--accept`: a code, the last word of a problem's code, or a problem's name.
pub(crate) fn can_be_accepted(accept: &[String]) -> Result<(), Refusal> {
    let codes = locale::entries("en").iter().filter_map(|(key, _)| key.strip_suffix(".message"));
    let kinds = proof::FindingKind::ALL.iter().map(|kind| kind.code().rsplit('.').next().unwrap_or_default());
    let known: BTreeSet<&str> = codes.chain(kinds).collect();
    let is_name = |word: &str| word.len() == 8 && word.bytes().all(|byte| byte.is_ascii_hexdigit());
    let Some(word) = accept.iter().find(|word| !known.contains(word.as_str()) && !is_name(word)) else {
        return Ok(());
    };
    let why = error!("cli.unknown_accept", found = word, ..);
    Err(Refusal::usage(why.with("nearest", nearest(word, known))))
}

fn unseen(diagnostics: &[Diagnostic], accept: &[String]) -> Result<(), Refusal> {
    let mut errors = diagnostics.iter().filter(|diagnostic| diagnostic.is_unacknowledged(accept));
    let Some(first) = errors.next() else { return Ok(()) };
    errors.for_each(|error| super::say(Refusal::content(error.clone())));
    Err(Refusal::content(first.clone()).among(diagnostics.to_vec()))
}

fn planned(
    args: &JobArgs,
    machine: Machine,
    (board, saved): (Board, Option<String>),
    mut diagnostics: Vec<Diagnostic>,
) -> Result<Job, Refusal> {
    let options = PlanOptions { lost: lost(&diagnostics), ..options(args)? };
    let (mut work, left_out) = match saved {
        Some(saved) => holes_of(&saved, &board, &machine)?,
        None => (Work::drilling(&board, &machine, args.order.into()), None),
    };
    diagnostics.extend(left_out);
    unseen(&diagnostics, &args.accept)?;
    if args.no_mill {
        work.operations.retain(|operation| !operation.uses_bit());
    }
    diagnostics.extend(machine::warnings(&machine));
    let bar = if verbosity::is_quiet() { ProgressBar::hidden() } else { ProgressBar::new(0) };
    let mut tell = |at: PlanningProgress| {
        bar.set_length(at.total);
        bar.set_position(at.done);
        true
    };
    let rapid_time = |from: Point, to: Point| motion::rapid_time_s(&machine, from, to);
    let means = Means { options: &options, rapid_time: &rapid_time };
    let planned = plan_work(&board, &work, &machine, &means, &mut tell);
    bar.finish_and_clear();
    let (planned, said) = planned.map_err(|errors| nothing(errors, &args.accept))?;
    unseen(&said, &args.accept)?;
    let program = lower_work(&planned, &work, &machine);
    let figures = Some(figures(&planned, &rapid_time));
    diagnostics.extend(said);
    Ok(Job { machine, program, figures, diagnostics })
}

/// Codes of the errors in `diagnostics`.
pub(crate) fn lost(diagnostics: &[Diagnostic]) -> Vec<String> {
    let errors = diagnostics.iter().filter(|diagnostic| diagnostic.severity == Severity::Error);
    errors.map(|error| error.code.clone()).collect()
}

/// Why nothing was planned: the errors that are not accepted, or that there is nothing to plan.
fn nothing(mut errors: Vec<Diagnostic>, accept: &[String]) -> Refusal {
    for error in errors.iter_mut().filter(|error| error.code == code!("cam.nothing_to_do")) {
        *error = error!("plan.nothing_to_drill");
    }
    let why = unseen(&errors, accept).err();
    why.unwrap_or_else(|| Refusal::content(error!("plan.nothing_to_drill")))
}

fn options(args: &JobArgs) -> Result<PlanOptions, Refusal> {
    if let Some(loaded) = args.loaded_mm.filter(|loaded| !(0.0..=LARGEST_BIT_MM).contains(loaded)) {
        let why = error!("job.bad_loaded", found = loaded, largest = LARGEST_BIT_MM);
        return Err(Refusal::usage(why));
    }
    Ok(PlanOptions {
        group: match args.group {
            Group::Ascending => cam::BitOrder::Ascending,
            Group::LoadedFirst => cam::BitOrder::LoadedFirst,
        },
        loaded: args.loaded_mm.map(Length::from_mm),
        spindles: spindles(&args.spindles)?,
        seed: args.seed,
        iterations: args.iterations,
        accept: args.accept.clone(),
        lost: Vec::new(),
    })
}

/// The numbered spindles as a bit set; `None` if no numbers are given.
fn spindles(numbers: &[u8]) -> Result<Option<u8>, Refusal> {
    if let Some(wrong) = numbers.iter().find(|number| !(1..=6).contains(*number)) {
        let why = error!("job.bad_spindle", found = wrong);
        return Err(Refusal::usage(why));
    }
    let set = numbers.iter().fold(0, |set, number| set | 1 << (number - 1));
    Ok((set != 0).then_some(set))
}

/// The holes of a program as a board, in the coordinates of its files. Its milling can't be planned again: an
/// error that must be accepted.
pub(super) fn board_of(program: &Program, accept: &[String]) -> Result<(Board, Vec<Diagnostic>), Refusal> {
    let mut holes = Vec::new();
    let mut bit = 0;
    for (line, leg) in (1..).zip(&program.legs) {
        if let Mark::ToolChange(next) = leg.mark {
            bit = next;
        }
        for command in &leg.commands {
            if let (Mark::Hole(_), Command::Rapid { to }) = (leg.mark, *command) {
                let at = Point::new(to.x + program.origin.x, to.y + program.origin.y);
                let diameter = program.bits.get(bit as usize).map(|bit| bit.diameter);
                holes.push(Hole { at, diameter, plated: None, source: 0, tool_code: bit + 1, line });
            }
        }
    }
    let toolpaths = program.legs.iter().filter(|leg| matches!(leg.mark, Mark::Toolpath(_))).count();
    let error = (toolpaths > 0).then(|| error!("job.toolpaths_left_out", toolpaths = toolpaths));
    let diagnostics: Vec<Diagnostic> = error.into_iter().collect();
    unseen(&diagnostics, accept)?;
    // A program is named after board and side; planned again, it has the same name.
    let side = format!("-{}", Face::Top.name());
    let name = program.name.strip_suffix(&side).unwrap_or(&program.name).to_owned();
    Ok((Board { sources: vec![program.name.clone()], name, holes, ..Board::default() }, diagnostics))
}

/// The file name without folder and extension, reduced to letters, digits, `-` and `_`: for names of output
/// files.
pub(crate) fn stem(path: &Path) -> PathBuf {
    let last = if path.is_dir() { path.file_name() } else { path.file_stem() };
    let stem = last.unwrap_or(path.as_os_str()).to_string_lossy();
    let plain = |c: char| if c.is_alphanumeric() || c == '-' || c == '_' { c } else { '_' };
    let name: String = stem.chars().map(plain).collect();
    PathBuf::from(if name.is_empty() { "board".to_owned() } else { name })
}
