//! Plans all milling and drilling of a board and writes programs, one for each side (N7 N8 N9 N10 N24).
//!
//! ```text
//!  --to ─▶ target (else nothing is planned)
//!  JOB… ─▶ Board ─┐
//!  job file ──────┼─▶ Work ─ side by side: plan ─▶ program ─ proof ─▶ findings ─┬─ unread, or an error not acknowledged: none is written
//!  --set ─────────┘                                                             └─ files of all sides, then written
//! ```
//!
//! Comes in: JOBs, a job file, flags. Goes out: files, whole or not at all, and a report. Does not know how toolpaths are made.

use super::cam_files::{self, Written};
use super::cures::Curing;
use super::export::{self, Target};
use super::findings::{
    finding_lines, finding_object, groups_object, kinds_accepted, unread, whole_lines, whole_object,
};
use super::saving;
use super::{Answer, Exit, ReadingArgs, Refusal, diagnostic_lines, diagnostic_objects, rounded, tool_object};
use crate::cli::job::{self, Whole};
use crate::machine_file;
use annulus_core::board::{Board, Face};
use annulus_core::cam::toolpaths::{self, Means, PlacedBoard, Planned, PlannedOperation, lower_work};
use annulus_core::cam::work::{Operation, Work};
use annulus_core::cam::{self, PlanOptions, briefing, parameters};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::geometry::Point;
use annulus_core::job::{Command, Mark, Program, milled_mm, travel_mm};
use annulus_core::machine::Machine;
use annulus_core::post::{FileSplit, Manner};
use annulus_core::proof::{self, Verdict};
use annulus_core::wire::program;
use annulus_core::{locale, motion, project, sim};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The target that is Annulus' own form of a program.
const OWN_FORM: &str = "program";

/// Arguments of `annulus cam`.
#[derive(Debug, clap::Args)]
pub(crate) struct CamArgs {
    /// Files, folders or zips of the board, or a saved project.
    #[arg(value_name = "JOB", required = true)]
    jobs: Vec<PathBuf>,
    #[command(flatten)]
    reading: ReadingArgs,
    #[command(flatten)]
    on: super::MachineArgs,
    /// Job file: setup, bits and operations as TOML.
    #[arg(long, value_name = "FILE")]
    job: Option<PathBuf>,
    /// A parameter of the job, for example isolate.passes=3; may be given several times.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Controller, a dialect file of your own (FILE.toml), or `program` for Annulus' own programs.
    #[arg(long, value_name = "NAME|FILE")]
    to: String,
    /// Lines only: arcs become lines that are at most this far off, in mm.
    #[arg(long, value_name = "MM", num_args = 0..=1, default_missing_value = "0.005",
          value_parser = export::chord_error)]
    lines_only: Option<f64>,
    /// One file for each side, also for a controller that cannot change tools: it stops for each.
    #[arg(long)]
    one_file: bool,
    /// Folder for the output.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Write the job as planned, cures included, to this file.
    #[arg(long, value_name = "FILE")]
    save_job: Option<PathBuf>,
    /// Write the files of the board and the job as planned to this file, as the page saves a project.
    #[arg(long, value_name = "FILE")]
    save_project: Option<PathBuf>,
    /// Cure gaps that are not open, first by a lesser depth of the whole, then one by one, until nothing more opens.
    #[arg(long)]
    cure: bool,
    /// Errors and findings that were seen, by code or by the finding's name.
    #[arg(long, value_delimiter = ',', value_name = "CODE")]
    accept: Vec<String>,
    /// Seed of the search.
    #[arg(long, default_value_t = cam::SEED)]
    seed: u64,
    /// Bound of the search for the order of holes.
    #[arg(long)]
    iterations: Option<u64>,
}

/// One side, planned and proved.
struct Side {
    face: Face,
    planned: Planned,
    program: Program,
    verdict: Verdict,
    curing: Curing,
    diagnostics: Vec<Diagnostic>,
    /// How long all of it takes and each of its bits, s; none where it cannot be said.
    times_s: Option<(f64, Vec<f64>)>,
}

/// Runs the command.
pub(crate) fn run(args: &CamArgs) -> Result<Answer, Refusal> {
    let target = target(args)?;
    let machine = machine_file::named(args.on.name())?.machine;
    let whole = job::read_whole(&args.jobs, &args.reading, &args.accept)?;
    let Whole { board, diagnostics: mut read, given, job } = whole;
    read.extend(target.iter().flat_map(Target::warnings));
    read.extend(args.on.assumed(&machine).filter(|_| target.is_some()));
    let mut work = chosen(args, &board, job.as_deref(), &machine)?;
    let mut sides = Vec::new();
    for face in work.faces() {
        sides.push(side(args, (&board, job::lost(&read)), &mut work, &machine, face)?);
    }
    if sides.is_empty() {
        return Err(Refusal::content(Diagnostic::error("cam.nothing_to_do")));
    }
    if let Some(path) = &args.save_job {
        job::write_output(path, project::write(&work).as_bytes())?;
    }
    if let Some(path) = &args.save_project {
        let project = saving::project(&args.jobs, given, &board, &work);
        let bytes = project::saved::write(&project).map_err(Refusal::content)?;
        job::write_output(path, &bytes)?;
    }
    let unread: usize = sides.iter().map(|side| unread(&side.verdict.groups, &args.accept)).sum();
    let why = unready(args, &sides, unread);
    let written = match &why {
        None => written(args, target.as_ref(), &sides, (&work, &machine))?,
        Some(_) => Written::default(),
    };
    let why = why.or_else(|| written.why.clone());
    read.extend(written.diagnostics.iter().cloned());
    let mut reports = Vec::new();
    let mut text = String::new();
    for (at, side) in sides.iter().enumerate() {
        let files = written.files.get(at).map(Vec::as_slice).unwrap_or_default();
        text += &sentences(side, files, &args.accept);
        reports.push(report(side, files, &args.accept));
    }
    if let Some(sheet) = &written.run_sheet {
        text += &locale::text("en", "cam.report.run_sheet", &[("file".to_owned(), sheet.clone())]);
        text.push('\n');
    }
    text += &diagnostic_lines(&read);
    let object = json!({
        "to": args.to,
        "machine": args.on.name(),
        "files": written.files.concat(),
        "run_sheet": written.run_sheet,
        "programs": reports,
        "findings_unread": unread,
        "errors_unacknowledged": unseen(args, &sides).count(),
        "diagnostics": diagnostic_objects(&read),
    });
    let Some(why) = why else { return Ok(Answer { object, text, exit: Exit::Done }) };
    Ok(Answer::refused(object, &text, why))
}

/// The errors of all sides that nobody has accepted.
fn unseen<'a>(args: &'a CamArgs, sides: &'a [Side]) -> impl Iterator<Item = &'a Diagnostic> {
    sides
        .iter()
        .flat_map(|side| &side.diagnostics)
        .filter(|diagnostic| diagnostic.is_unacknowledged(&args.accept))
}

/// Why nothing may be written yet: findings that nobody has read, else errors that nobody has seen.
fn unready(args: &CamArgs, sides: &[Side], unread: usize) -> Option<Diagnostic> {
    if unread > 0 {
        return Some(Diagnostic::error("cam.unread_findings").with("count", unread));
    }
    let mut codes: Vec<&str> = unseen(args, sides).map(|error| error.code.as_str()).collect();
    codes.sort_unstable();
    codes.dedup();
    let why = Diagnostic::error("cam.unacknowledged_errors").with("codes", codes.join(", "));
    (!codes.is_empty()).then_some(why)
}

/// The controller that is written for; none for Annulus' own form.
fn target(args: &CamArgs) -> Result<Option<Target>, Refusal> {
    match (args.to.as_str(), args.lines_only) {
        (OWN_FORM, None) => Ok(None),
        (OWN_FORM, Some(_)) => Err(Refusal::usage(Diagnostic::error("cam.own_form_has_arcs"))),
        (name, _) => Target::named(name).map(Some),
    }
}

/// The work: as the board opens, changed by the job `saved` in its project, by the job file and then by flags.
fn chosen(args: &CamArgs, board: &Board, saved: Option<&str>, machine: &Machine) -> Result<Work, Refusal> {
    let mut work = job::opened(board, saved, machine)?;
    if let Some(path) = &args.job {
        work = job_file(path, &work, machine)?;
    }
    for pair in &args.set {
        let Some((key, value)) = pair.split_once('=') else {
            return Err(Refusal::usage(Diagnostic::error("cam.bad_set").with("found", pair)));
        };
        parameters::assign(&mut work, key.trim(), value.trim()).map_err(Refusal::usage)?;
    }
    Ok(work)
}

/// The work of the job file at `path`; what it leaves out is as in `base`.
pub(super) fn job_file(path: &Path, base: &Work, machine: &Machine) -> Result<Work, Refusal> {
    let text = export::read(path)?;
    project::read(&path.display().to_string(), &text, base, machine).map_err(Refusal::content)
}

/// Plans and proves one side; with `--cure` again with cures, which stay in `work`.
fn side(
    args: &CamArgs,
    (board, lost): (&Board, Vec<String>),
    work: &mut Work,
    machine: &Machine,
    face: Face,
) -> Result<Side, Refusal> {
    work.setup.face = face;
    let options = PlanOptions {
        seed: args.seed,
        iterations: args.iterations,
        accept: args.accept.clone(),
        lost,
        ..PlanOptions::default()
    };
    let rapid_time = |from: Point, to: Point| motion::rapid_time_s(machine, from, to);
    let means = Means { options: &options, rapid_time: &rapid_time };
    let (mut curing, mut known) = (Curing::default(), BTreeMap::new());
    loop {
        let planned = planned(board, work, machine, &means, &mut known);
        let (planned, diagnostics) = planned.map_err(|errors| {
            let first = errors.first().cloned();
            errors.into_iter().skip(1).for_each(|error| super::say(Refusal::content(error)));
            Refusal::content(first.unwrap_or_else(|| Diagnostic::error("cam.nothing_to_do")))
        })?;
        let mut program = lower_work(&planned, work, machine);
        let usual = proof::ProofOptions::of(face, work.promised(face));
        let asked = proof::ProofOptions { most: if args.cure { usize::MAX } else { usual.most }, ..usual };
        let mut verdict = proof::prove(&planned.board, std::slice::from_ref(&program), &asked);
        for finding in &mut verdict.findings {
            let index = finding.leg.and_then(|(_, leg)| planned.operation_at(&program, leg));
            let operation = index.and_then(|index| work.operations.get(index as usize));
            finding.operation = operation.map(Operation::title);
        }
        if args.cure && curing.go_on(work, face, &verdict) {
            continue;
        }
        program.accepted.extend(kinds_accepted(&verdict.groups, &args.accept).into_iter().map(str::to_owned));
        program.accepted.sort();
        program.accepted.dedup();
        let timed = motion::timeline(&program, machine);
        let times_s = timed.as_ref().ok().map(|timed| (timed.total_s(), sim::time_by_bit_s(timed)));
        let diagnostics = diagnostics.into_iter().chain(curing.left(&verdict)).chain(timed.err()).collect();
        return Ok(Side { face, planned, program, verdict, curing, diagnostics, times_s });
    }
}

/// Plans all operations of the side that is up; those that a cure did not change are taken from `known`.
fn planned(
    board: &Board,
    work: &Work,
    machine: &Machine,
    means: &Means<'_>,
    known: &mut BTreeMap<String, PlannedOperation>,
) -> Result<(Planned, Vec<Diagnostic>), Vec<Diagnostic>> {
    let scene = PlacedBoard::of(board, work);
    let mut parts = Vec::new();
    for (index, _) in toolpaths::planned_operations(work) {
        let key = toolpaths::key(work, index, machine);
        if !known.contains_key(&key) {
            let part = toolpaths::plan_operation(&scene, work, index, machine, means, &mut |_| true);
            known.insert(key.clone(), part.map_err(|why| vec![why])?);
        }
        parts.extend(known.get(&key).cloned());
    }
    toolpaths::assemble(scene, work, machine, means, parts)
}

/// Writes the files of all sides.
fn written(
    args: &CamArgs,
    target: Option<&Target>,
    sides: &[Side],
    (work, machine): (&Work, &Machine),
) -> Result<Written, Refusal> {
    let stem = job::stem(args.jobs.first().unwrap_or(&args.output)).display().to_string();
    let name = sides.iter().map(|side| side.planned.board.name.as_str()).find(|name| !name.is_empty());
    let mut briefed = briefing::briefing(name.unwrap_or(&stem), work, machine);
    for side in sides {
        let times_s = side.times_s.as_ref().map_or(&[][..], |(_, by_bit)| by_bit);
        let planned = (&side.planned, &side.program);
        briefing::add_side(&mut briefed, side.face, work, planned, times_s);
    }
    let programs: Vec<&Program> = sides.iter().map(|side| &side.program).collect();
    let files = args.one_file.then_some(FileSplit::Job);
    let manner = Manner { lines_only_mm: args.lines_only, files, ..Manner::on(machine) };
    cam_files::write(target, &manner, (&args.output, &stem), &programs, (&briefed, &args.accept))
}

/// Counts of a program.
#[derive(Default)]
struct Counts {
    plunges: usize,
    retracts: usize,
}

fn counts(program: &Program) -> Counts {
    let mut counts = Counts::default();
    for command in program.legs.iter().flat_map(|leg| &leg.commands) {
        match command {
            Command::Plunge { .. } => counts.plunges += 1,
            Command::Retract { .. } => counts.retracts += 1,
            _ => {}
        }
    }
    counts
}

fn report(side: &Side, files: &[Value], accept: &[String]) -> Value {
    let counts = counts(&side.program);
    let by_leg = milled_mm(&side.program);
    // Toolpaths are legs of their own, in the order of the tasks.
    let legs = side.program.legs.iter().zip(&by_leg);
    let mut by_way = legs.filter(|(leg, _)| matches!(leg.mark, Mark::Toolpath(_))).map(|(_, mm)| *mm);
    let tasks = side.planned.parts.iter().flat_map(|part| part.tasks.iter().map(move |task| (part, task)));
    let tools: Vec<Value> = tasks
        .map(|(part, task)| {
            let milled: f64 = by_way.by_ref().take(task.toolpaths.len()).sum();
            let tool = tool_object(&task.bit);
            json!({ "operation": part.operation, "bit": task.bit.name, "form": tool["form"],
                "diameter_mm": tool["diameter_mm"], "tip_mm": tool["tip_mm"], "angle_deg": tool["angle_deg"],
                "tool": tool, "holes": task.drill_cycles.len(), "toolpaths": task.toolpaths.len(), "milled_mm": rounded(milled) })
        })
        .collect();
    let verdict = &side.verdict;
    let findings: Vec<Value> =
        verdict.findings.iter().map(|finding| finding_object(finding, accept)).collect();
    json!({
        "face": side.face.name(),
        "files": files,
        "program_sha256": program::key(&program::encode(&side.program)),
        "total_time_s": side.times_s.as_ref().map(|(total_s, _)| rounded(*total_s)),
        "milled_mm": rounded(by_leg.iter().sum()),
        "travel_mm": rounded(travel_mm(&side.program)),
        "plunges": counts.plunges,
        "retracts": counts.retracts,
        "holes": side.program.hole_count(),
        "toolpaths": side.program.legs.iter().filter(|leg| matches!(leg.mark, Mark::Toolpath(_))).count(),
        "tool_changes": side.program.bits.len(),
        "tools": tools,
        "groups": groups_object(&verdict.groups, accept),
        "whole": verdict.whole.as_ref().map(whole_object),
        "cured": side.curing.object(),
        "findings": findings,
        "more": verdict.more,
        "diagnostics": diagnostic_objects(&side.diagnostics),
    })
}

fn sentences(side: &Side, files: &[Value], accept: &[String]) -> String {
    let counts = counts(&side.program);
    let say = |key: &str, args: &[(&str, String)]| {
        let args: Vec<_> = args.iter().map(|(name, value)| ((*name).to_owned(), value.clone())).collect();
        locale::text("en", key, &args) + "\n"
    };
    let mut out = say(
        "cam.report.side",
        &[
            ("side", side.face.name().to_owned()),
            ("toolpaths", side.planned.toolpaths().count().to_string()),
            ("milled", format!("{:.1}", milled_mm(&side.program).iter().sum::<f64>())),
            ("holes", side.program.hole_count().to_string()),
            ("bits", side.program.bits.len().to_string()),
            ("retracts", counts.retracts.to_string()),
        ],
    );
    for file in files {
        out += &say("cam.report.file", &[("file", file["file"].as_str().unwrap_or_default().to_owned())]);
    }
    let verdict = &side.verdict;
    out += &finding_lines(&verdict.groups, &verdict.findings, accept);
    out + &whole_lines(verdict.whole.as_ref()) + &diagnostic_lines(&side.diagnostics)
}
