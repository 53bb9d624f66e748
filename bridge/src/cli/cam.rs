//! Plans all milling and drilling of a board and writes one program per side.
//!
//! ```text
//!  --to ─▶ target (without it nothing is planned)
//!  JOB… ─▶ Board ─┐
//!  job file ──────┼─▶ Work ─ per side: plan ─▶ program ─ proof ─▶ problems ─┬─ any not accepted: nothing is written
//!  --set ─────────┘                                                         └─ files of all sides, then written
//! ```

use super::cam_files::{self, FileReport, Written};
use super::cures::Curing;
use super::export::{self, Target};
use super::findings::{
    FindingReport, GroupReport, as_outcome, as_whole, finding_lines, kinds_accepted, outcome_line, unread,
    whole_lines,
};
use super::memory;
use super::saving;
use super::{Answer, ReadingArgs, Refusal, ToolReport, as_objects, diagnostic_lines, mm, rounded, sentence};
use crate::cli::job::{self, Whole};
use crate::machine_file;
use annulus_core::board::{Board, Face};
use annulus_core::cam::toolpaths::{
    self, BitTask, Means, PlacedBoard, Planned, PlannedOperation, lower_work,
};
use annulus_core::cam::work::{Operation, Work};
use annulus_core::cam::{self, PlanOptions, briefing, parameters};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::error;
use annulus_core::geometry::{Point, Region};
use annulus_core::job::{Briefing, Command, Mark, Program, milled_mm, travel_mm};
use annulus_core::machine::{self, Machine};
use annulus_core::post::{FileSplit, Manner};
use annulus_core::proof::{self, ProofResult, Verdict};
use annulus_core::wire::program;
use annulus_core::{motion, project, sim};
use serde::Serialize;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Arguments of `annulus cam`.
#[derive(Debug, clap::Args)]
pub(crate) struct CamArgs {
    /// Read the board from files, folders, zips or a saved project.
    #[arg(value_name = "JOB", required = true)]
    jobs: Vec<PathBuf>,
    #[command(flatten)]
    reading: ReadingArgs,
    #[command(flatten)]
    on: super::MachineArgs,
    /// Read setup, tools and operations from this TOML job file.
    #[arg(long, value_name = "FILE")]
    job: Option<PathBuf>,
    /// Set a parameter of the job, for example isolate.passes=3. Repeatable.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Write for this controller, for a postprocessor of your own (FILE.toml), or `program` for Annulus' own
    /// format. `annulus export --help` lists the controllers.
    #[arg(long, value_name = "NAME|FILE", value_parser = export::target_name)]
    to: String,
    /// Replace arcs by lines that deviate at most MM [default without MM: 0.005].
    #[arg(long = "arcs-to-lines", alias = "lines-only", value_name = "MM", num_args = 0..=1,
          require_equals = true, default_missing_value = "0.005", value_parser = export::chord_error)]
    lines_only: Option<f64>,
    /// Write one file per side, even for a controller without tool changer: it stops for each tool.
    #[arg(long = "single-file", alias = "one-file")]
    one_file: bool,
    /// Write the output to this folder.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Save the planned job, fixes included, to this file.
    #[arg(long, value_name = "FILE")]
    save_job: Option<PathBuf>,
    /// Save the board's files and the planned job as a project, as the page does.
    #[arg(long, value_name = "FILE")]
    save_project: Option<PathBuf>,
    /// Fix closed gaps: first with a smaller depth of the whole isolation, then gap by gap, until no more
    /// open.
    #[arg(long = "fix-gaps", alias = "cure")]
    cure: bool,
    /// Accept these errors and problems, by code or by a problem's name.
    #[arg(long, value_delimiter = ',', value_name = "CODE")]
    accept: Vec<String>,
    /// Set the seed of the search.
    #[arg(long, default_value_t = cam::SEED)]
    seed: u64,
    /// Limit the search for the order of holes to this many iterations.
    #[arg(long)]
    iterations: Option<u64>,
}

/// One planned and proved side.
struct Side {
    face: Face,
    planned: Planned,
    program: Program,
    verdict: Verdict,
    curing: Curing,
    diagnostics: Vec<Diagnostic>,
    /// Time of the whole side and per tool, s; `None` if it can't be computed.
    times_s: Option<(f64, Vec<f64>)>,
}

pub(crate) fn run(args: &CamArgs) -> Result<Answer, Refusal> {
    let target = target(args)?;
    let machine = machine_file::named(args.on.name())?.machine;
    let whole = job::read_whole(&args.jobs, &args.reading, &args.accept)?;
    let Whole { board, diagnostics: mut read, given, job } = whole;
    read.extend(target.iter().flat_map(Target::warnings));
    read.extend(args.on.assumed(&machine).filter(|_| target.is_some()));
    read.extend(machine::warnings(&machine));
    let mut work = chosen(args, &board, job.as_deref(), &machine)?;
    refuse_too_large(&board, &[])?;
    let mut sides = Vec::new();
    for face in work.faces() {
        sides.push(side(args, (&board, job::lost(&read)), &mut work, &machine, face)?);
    }
    if sides.is_empty() {
        return Err(Refusal::content(error!("cam.nothing_to_do")));
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
    let briefed = briefed(args, &sides, &work, &machine);
    let written = match &why {
        None => written(args, target.as_ref(), &mut sides, (&briefed, &machine))?,
        Some(_) => Written::default(),
    };
    let why = why.or_else(|| written.why.clone());
    read.extend(written.diagnostics.iter().cloned());
    let files = |at: usize| written.files.get(at).map(Vec::as_slice).unwrap_or_default();
    let programs = (0..).zip(&sides).map(|(at, side)| SideReport::of(side, files(at), &args.accept));
    let report = CamReport {
        to: &args.to,
        machine: args.on.name(),
        files: written.files.iter().flatten().collect(),
        run_sheet: written.run_sheet.as_deref(),
        assumed: Assumed::of(&briefed),
        programs: programs.collect(),
        findings_unread: unread,
        errors_unacknowledged: unseen(args, &sides).count(),
        diagnostics: &read,
    };
    Ok(Answer::new(&report, report.text()).on(&args.on, &machine).with_error(why))
}

#[derive(Serialize)]
struct CamReport<'a> {
    to: &'a str,
    machine: &'a str,
    files: Vec<&'a FileReport>,
    run_sheet: Option<&'a str>,
    assumed: Assumed,
    programs: Vec<SideReport<'a>>,
    findings_unread: usize,
    errors_unacknowledged: usize,
    #[serde(serialize_with = "as_objects")]
    diagnostics: &'a [Diagnostic],
}

impl CamReport<'_> {
    fn text(&self) -> String {
        let mut text: String = self.programs.iter().map(SideReport::text).collect();
        if let Some(sheet) = self.run_sheet {
            text += &(sentence("cam.report.run_sheet", &[("file", &sheet)]) + "\n");
        }
        let Assumed { board_mm, zero } = &self.assumed;
        let zero = sentence(&format!("run_sheet.zero_{zero}"), &[]);
        text += &(sentence("cam.report.assumed", &[("thickness", board_mm), ("zero", &zero)]) + "\n");
        text + &diagnostic_lines(self.diagnostics)
    }
}

/// What the job takes for granted: the user checks it at the machine.
#[derive(Serialize)]
struct Assumed {
    /// Thickness of the board.
    board_mm: f64,
    /// Position of the work zero, as on the run sheet.
    zero: String,
}

impl Assumed {
    fn of(briefed: &Briefing) -> Self {
        let board_mm = briefed.thickness.map(mm).unwrap_or_default();
        Self { board_mm, zero: briefed.zero.clone().unwrap_or_default() }
    }
}

/// Errors of all sides that are not accepted.
fn unseen<'a>(args: &'a CamArgs, sides: &'a [Side]) -> impl Iterator<Item = &'a Diagnostic> {
    sides
        .iter()
        .flat_map(|side| &side.diagnostics)
        .filter(|diagnostic| diagnostic.is_unacknowledged(&args.accept))
}

/// Why nothing may be written yet: problems, or else errors, that are not accepted.
fn unready(args: &CamArgs, sides: &[Side], unread: usize) -> Option<Diagnostic> {
    if unread > 0 {
        return Some(error!("cam.unread_findings", count = unread));
    }
    let mut codes: Vec<&str> = unseen(args, sides).map(|error| error.code.as_str()).collect();
    codes.sort_unstable();
    codes.dedup();
    let why = error!("cam.unacknowledged_errors", codes = codes.join(", "));
    (!codes.is_empty()).then_some(why)
}

/// The target controller; `None` for Annulus' own format.
fn target(args: &CamArgs) -> Result<Option<Target>, Refusal> {
    match (args.to.as_str(), args.lines_only) {
        (export::OWN_FORM, None) => Ok(None),
        (export::OWN_FORM, Some(_)) => Err(Refusal::usage(error!("cam.own_form_has_arcs"))),
        (name, _) => Target::named(name).map(Some),
    }
}

/// The job: default of the board, changed by the project's `saved` job, by the job file, then by flags.
fn chosen(args: &CamArgs, board: &Board, saved: Option<&str>, machine: &Machine) -> Result<Work, Refusal> {
    let mut work = job::opened(board, saved, machine)?;
    if let Some(path) = &args.job {
        work = job_file(path, &work)?;
    }
    for pair in &args.set {
        let Some((key, value)) = pair.split_once('=') else {
            return Err(Refusal::usage(error!("cam.bad_set", found = pair)));
        };
        parameters::assign(&mut work, key.trim(), value.trim()).map_err(Refusal::usage)?;
    }
    Ok(work)
}

/// The job file at `path`; missing values come from `base`.
pub(super) fn job_file(path: &Path, base: &Work) -> Result<Work, Refusal> {
    let text = export::read(path)?;
    project::read(&path.display().to_string(), &text, base).map_err(Refusal::content)
}

/// Refuses a board whose proof would need too much memory.
pub(super) fn refuse_too_large(board: &Board, programs: &[Program]) -> Result<(), Refusal> {
    proof::too_large(board, programs).map_or(Ok(()), |why| Err(Refusal::content(why)))
}

/// Plans and proves one side. With `--fix-gaps`, repeats this with fixes, which are stored in `work`.
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
        let planned = planned(board, work, machine, &means, args.cure.then_some(&mut known));
        let (mut planned, diagnostics) = planned.map_err(|errors| {
            let first = errors.first().cloned();
            errors.into_iter().skip(1).for_each(|error| super::say(Refusal::content(error)));
            Refusal::content(first.unwrap_or_else(|| error!("cam.nothing_to_do")))
        })?;
        let mut program = lower_work(&planned, work, machine);
        planned.empty_toolpaths();
        refuse_too_large(&planned.board, std::slice::from_ref(&program))?;
        let usual = proof::ProofOptions::of(face, work.promised(face));
        let asked = proof::ProofOptions { most: if args.cure { usize::MAX } else { usual.most }, ..usual };
        let mut verdict = memory::prove(&planned.board, std::slice::from_ref(&program), &asked);
        // Large, and unused here.
        verdict.left = Region::default();
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
        let timed = sim::times_s(&program, machine);
        let times_s = timed.as_ref().ok().cloned();
        let diagnostics = diagnostics.into_iter().chain(curing.left(&verdict)).chain(timed.err()).collect();
        return Ok(Side { face, planned, program, verdict, curing, diagnostics, times_s });
    }
}

/// Plans all operations of the upper side. With fixes, reuses unchanged operations from `known`.
fn planned(
    board: &Board,
    work: &Work,
    machine: &Machine,
    means: &Means<'_>,
    mut known: Option<&mut BTreeMap<String, PlannedOperation>>,
) -> Result<(Planned, Vec<Diagnostic>), Vec<Diagnostic>> {
    let scene = PlacedBoard::of(board, work);
    let mut parts = Vec::new();
    for (index, _) in toolpaths::planned_operations(work) {
        let key = || toolpaths::key(work, index, machine);
        if let Some(part) = known.as_ref().and_then(|known| known.get(&key())) {
            parts.push(part.clone());
            continue;
        }
        let part = toolpaths::plan_operation(&scene, work, index, machine, means, &mut |_| true);
        let part = part.map_err(|why| vec![why])?;
        if let Some(known) = &mut known {
            known.insert(key(), part.clone());
        }
        parts.push(part);
    }
    toolpaths::assemble(scene, work, machine, means, parts)
}

/// Name of the job in the names of files.
fn stem(args: &CamArgs) -> String {
    job::stem(args.jobs.first().unwrap_or(&args.output)).display().to_string()
}

/// The summary of all sides for the operator.
fn briefed(args: &CamArgs, sides: &[Side], work: &Work, machine: &Machine) -> Briefing {
    let stem = stem(args);
    let name = sides.iter().map(|side| side.planned.board.name.as_str()).find(|name| !name.is_empty());
    let mut briefed = briefing::briefing(name.unwrap_or(&stem), work, machine);
    for side in sides {
        let times_s = side.times_s.as_ref().map_or(&[][..], |(_, by_bit)| by_bit);
        let planned = (&side.planned, &side.program);
        briefing::add_side(&mut briefed, side.face, work, planned, times_s);
    }
    briefed
}

fn written(
    args: &CamArgs,
    target: Option<&Target>,
    sides: &mut [Side],
    (briefed, machine): (&Briefing, &Machine),
) -> Result<Written, Refusal> {
    let stem = stem(args);
    let programs: Vec<&mut Program> = sides.iter_mut().map(|side| &mut side.program).collect();
    let files = args.one_file.then_some(FileSplit::Job);
    let manner = Manner { lines_only_mm: args.lines_only, files, ..Manner::on(machine) };
    cam_files::write(target, &manner, (&args.output, &stem), programs, (briefed, &args.accept))
}

#[derive(Serialize)]
struct SideReport<'a> {
    face: &'static str,
    files: &'a [FileReport],
    program_sha256: String,
    total_time_s: Option<f64>,
    milled_mm: f64,
    travel_mm: f64,
    plunges: usize,
    retracts: usize,
    holes: usize,
    toolpaths: usize,
    tool_changes: usize,
    /// For each tool of each operation.
    tools: Vec<Value>,
    #[serde(serialize_with = "as_outcome")]
    outcome: ProofResult,
    groups: Vec<GroupReport>,
    #[serde(serialize_with = "as_whole")]
    whole: &'a Option<proof::Whole>,
    cured: Value,
    findings: Vec<FindingReport>,
    more: u32,
    #[serde(serialize_with = "as_objects")]
    diagnostics: &'a [Diagnostic],
}

impl<'a> SideReport<'a> {
    fn of(side: &'a Side, files: &'a [FileReport], accept: &[String]) -> Self {
        let Side { program, verdict, .. } = side;
        let by_leg = milled_mm(program);
        let commands = || program.legs.iter().flat_map(|leg| &leg.commands);
        Self {
            face: side.face.name(),
            files,
            program_sha256: program::key(&program::encode(program)),
            total_time_s: side.times_s.as_ref().map(|(total_s, _)| rounded(*total_s)),
            milled_mm: rounded(by_leg.iter().sum()),
            travel_mm: rounded(travel_mm(program)),
            plunges: commands().filter(|command| matches!(command, Command::Plunge { .. })).count(),
            retracts: commands().filter(|command| matches!(command, Command::Retract { .. })).count(),
            holes: program.hole_count(),
            toolpaths: program.toolpath_count(),
            tool_changes: program.bits.len(),
            tools: tools(side, &by_leg),
            outcome: verdict.outcome,
            groups: verdict.groups.iter().map(|group| GroupReport::of(group, accept)).collect(),
            whole: &verdict.whole,
            cured: side.curing.object(),
            findings: verdict.findings.iter().map(|one| FindingReport::of(one, accept, None)).collect(),
            more: verdict.more,
            diagnostics: &side.diagnostics,
        }
    }

    fn text(&self) -> String {
        let head = sentence(
            "cam.report.side",
            &[
                ("side", &self.face),
                ("toolpaths", &self.toolpaths),
                ("milled", &format!("{:.1}", self.milled_mm)),
                ("holes", &self.holes),
                ("bits", &self.tool_changes),
                ("retracts", &self.retracts),
            ],
        );
        let unread = self.groups.iter().map(|group| group.unread).sum();
        head + "\n"
            + &self.files.iter().map(FileReport::row).collect::<String>()
            + &outcome_line(&self.outcome, unread)
            + &finding_lines(&self.groups, &self.findings)
            + &whole_lines(self.whole.as_ref())
            + &diagnostic_lines(self.diagnostics)
    }
}

/// What each tool of each operation makes. `by_leg` is the milled length of each leg, in mm.
fn tools(side: &Side, by_leg: &[f64]) -> Vec<Value> {
    // Each toolpath is a leg, in the order of the tasks.
    let legs = side.program.legs.iter().zip(by_leg);
    let mut by_way = legs.filter(|(leg, _)| matches!(leg.mark, Mark::Toolpath(_))).map(|(_, mm)| *mm);
    let tasks = side.planned.parts.iter().flat_map(|part| part.tasks.iter().map(move |task| (part, task)));
    let row = |(part, task): (&PlannedOperation, &BitTask)| {
        let milled: f64 = by_way.by_ref().take(task.toolpaths.len()).sum();
        let tool = ToolReport::of(&task.bit);
        json!({ "operation": part.operation, "bit": task.bit.name, "form": tool.form,
            "diameter_mm": tool.diameter_mm, "tip_mm": tool.tip_mm, "angle_deg": tool.angle_deg,
            "tool": tool, "holes": task.drill_cycles.len(), "toolpaths": task.toolpaths.len(),
            "milled_mm": rounded(milled) })
    };
    tasks.map(row).collect()
}
