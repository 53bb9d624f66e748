//! Plans all milling and drilling of a board and writes programs, one for each side (N7 N8 N9 N10 N24).
//!
//! ```text
//!  JOB… ─▶ Board ─┐
//!  job file ──────┼─▶ Work ─ side by side: plan ─▶ program ─ proof ─▶ findings ─┬─ unread: nothing is written
//!  --set ─────────┘                                                             └─ files of the dialect
//! ```
//!
//! Comes in: JOBs, a job file, flags. Goes out: files, whole or not at all, and a report. Does not know how ways are made.

use super::{Answer, Exit, ReadingArgs, Refusal, remark_lines, remark_objects, rounded};
use crate::job;
use crate::machine_file;
use annulus_core::board::{Board, Face};
use annulus_core::cam::PlanOptions;
use annulus_core::cam::parameters;
use annulus_core::cam::ways::{Means, Planned, lower_work, plan_work};
use annulus_core::cam::work::{Action, Cure, Remedy, Work};
use annulus_core::geometry::Point;
use annulus_core::job::{Command, Mark, Program};
use annulus_core::machine::Machine;
use annulus_core::proof::{self, Finding};
use annulus_core::remark::{Remark, Weight};
use annulus_core::wire::program;
use annulus_core::{locale, motion, project};
use serde_json::{Value, json};
use std::path::PathBuf;

/// How often cures are applied and proved again.
const ROUNDS: usize = 3;

/// Arguments of `annulus cam`.
#[derive(Debug, clap::Args)]
pub(crate) struct CamArgs {
    /// Files, folders or zips of the board.
    #[arg(value_name = "JOB", required = true)]
    jobs: Vec<PathBuf>,
    #[command(flatten)]
    reading: ReadingArgs,
    /// Machine: a preset's name or a machine file.
    #[arg(long, default_value = "virtual")]
    machine: String,
    /// Job file: setup, bits and operations as TOML.
    #[arg(long, value_name = "FILE")]
    job: Option<PathBuf>,
    /// A parameter of the job, for example isolate.passes=3; may be given several times.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Controller, or `program` for Annulus' own programs.
    #[arg(long, value_name = "DIALECT")]
    to: String,
    /// Folder for the output.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Write the job as planned, cures included, to this file.
    #[arg(long, value_name = "FILE")]
    save_job: Option<PathBuf>,
    /// Apply the gentlest cure to every gap that is not open, and prove again.
    #[arg(long)]
    cure: bool,
    /// Losses and findings that were seen, by code or by the finding's name.
    #[arg(long, value_delimiter = ',', value_name = "CODE")]
    accept: Vec<String>,
    /// Seed of the search.
    #[arg(long, default_value_t = 1)]
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
    findings: Vec<Finding>,
    remarks: Vec<Remark>,
}

/// Runs the command.
pub(crate) fn run(args: &CamArgs) -> Result<Answer, Refusal> {
    let machine = machine_file::named(&args.machine)?.machine;
    let (board, read) = job::read_whole(&args.jobs, &args.reading, &args.accept)?;
    let mut work = chosen(args, &board, &machine)?;
    let mut sides = Vec::new();
    for face in work.faces() {
        sides.push(side(args, &board, &mut work, &machine, face)?);
    }
    if sides.is_empty() {
        return Err(Refusal::content(Remark::new(Weight::Loss, "cam.nothing_to_do")));
    }
    if let Some(path) = &args.save_job {
        job::write_output(path, project::write(&work).as_bytes())?;
    }
    let unread: Vec<&Finding> = sides
        .iter()
        .flat_map(|side| &side.findings)
        .filter(|finding| is_unread(finding, &args.accept))
        .collect();
    let stem = job::stem(args.jobs.first().unwrap_or(&args.output));
    let mut reports = Vec::new();
    let mut text = String::new();
    for side in &sides {
        let files =
            if unread.is_empty() { written(args, side, &stem.to_string_lossy())? } else { Vec::new() };
        text += &sentences(side, &files);
        reports.push(report(side, &machine, files, &args.accept));
    }
    text += &remark_lines(&read);
    let mut object = json!({
        "to": args.to,
        "programs": reports,
        "findings_unread": unread.len(),
        "remarks": remark_objects(&read),
    });
    if unread.is_empty() {
        return Ok(Answer { object, text, exit: Exit::Done });
    }
    let why = Remark::new(Weight::Loss, "cam.unread_findings").with("count", unread.len());
    text += &remark_lines(std::slice::from_ref(&why));
    object["error"] = Refusal::content(why).object()["error"].clone();
    Ok(Answer { object, text, exit: Exit::Content })
}

/// The work: as the board opens, changed by the job file and then by flags.
fn chosen(args: &CamArgs, board: &Board, machine: &Machine) -> Result<Work, Refusal> {
    let mut work = Work::default_for(board, machine);
    if let Some(path) = &args.job {
        let name = path.display().to_string();
        let text = std::fs::read_to_string(path).map_err(|error| {
            let why = Remark::new(Weight::Loss, "job.unreadable").with("file", &name).with("reason", error);
            Refusal::surroundings(why)
        })?;
        work = project::read(&name, &text, &work, machine).map_err(Refusal::content)?;
    }
    for pair in &args.set {
        let Some((key, value)) = pair.split_once('=') else {
            return Err(Refusal::usage(Remark::new(Weight::Loss, "cam.bad_set").with("found", pair)));
        };
        parameters::assign(&mut work, key.trim(), value.trim()).map_err(Refusal::usage)?;
    }
    Ok(work)
}

/// Plans and proves one side; with `--cure` again with cures, which stay in `work`.
fn side(
    args: &CamArgs,
    board: &Board,
    work: &mut Work,
    machine: &Machine,
    face: Face,
) -> Result<Side, Refusal> {
    work.setup.face = face;
    let options = PlanOptions {
        seed: args.seed,
        iterations: args.iterations,
        accept: args.accept.clone(),
        ..PlanOptions::default()
    };
    let hop_time = |from: Point, to: Point| motion::hop_time_s(machine, from, to);
    let means = Means { options: &options, hop_time: &hop_time };
    let mut round = 0;
    loop {
        let planned = plan_work(board, work, machine, &means, &mut |_| true);
        let (planned, remarks) = planned.map_err(|losses| {
            let first = losses.first().cloned();
            losses.into_iter().skip(1).for_each(|loss| super::say(Refusal::content(loss)));
            Refusal::content(first.unwrap_or_else(|| Remark::new(Weight::Loss, "cam.nothing_to_do")))
        })?;
        let mut program = lower_work(&planned, work, machine);
        let asked = proof::Options { face, owned: work.bits.clone(), ..proof::Options::default() };
        let findings = proof::prove(&planned.board, std::slice::from_ref(&program), &asked).findings;
        round += 1;
        if args.cure && round <= ROUNDS && cured(work, face, &findings) {
            continue;
        }
        let seen =
            findings.iter().filter(|finding| finding.must_be_read() && !is_unread(finding, &args.accept));
        program.accepted.extend(seen.map(|finding| finding.kind.code().to_owned()));
        program.accepted.sort();
        program.accepted.dedup();
        return Ok(Side { face, planned, program, findings, remarks });
    }
}

/// Adds the gentlest cure of every gap to the first isolation of `face`; whether any was new.
fn cured(work: &mut Work, face: Face, findings: &[Finding]) -> bool {
    let bits = work.bits.clone();
    let isolation = work.operations.iter_mut().find_map(|operation| match &mut operation.action {
        Action::Isolate(isolate) if operation.on && operation.face == face => Some(isolate),
        _ => None,
    });
    let Some(isolate) = isolation else { return false };
    let mut any = false;
    for finding in findings {
        let (Some((from, to)), Some(cure)) = (finding.ends, finding.cures.first()) else { continue };
        let with = match cure {
            proof::Cure::Shallower { depth, .. } => Remedy::Depth(*depth),
            proof::Cure::OtherBit { bit, .. } if bits.iter().any(|own| own.name == *bit) => {
                Remedy::Bit(bit.clone())
            }
            proof::Cure::Centred { .. } => Remedy::Centred,
            _ => continue,
        };
        let cure = Cure { from, to, with };
        if !isolate.cures.contains(&cure) {
            isolate.cures.push(cure);
            any = true;
        }
    }
    any
}

fn is_unread(finding: &Finding, accept: &[String]) -> bool {
    let seen = |word: &String| *word == finding.id || *word == finding.kind.code();
    finding.must_be_read() && !accept.iter().any(seen)
}

const fn word(face: Face) -> &'static str {
    match face {
        Face::Top => "top",
        Face::Bottom => "bottom",
    }
}

/// Writes the files of one side; their names, sizes and digests.
fn written(args: &CamArgs, side: &Side, stem: &str) -> Result<Vec<Value>, Refusal> {
    let stem = format!("{stem}-{}", word(side.face));
    let files = job::outputs(&args.to, &side.program, &stem)?;
    std::fs::create_dir_all(&args.output).map_err(|error| {
        let why = Remark::new(Weight::Loss, "job.not_written").with("file", args.output.display());
        Refusal::surroundings(why.with("reason", error))
    })?;
    let mut out = Vec::new();
    for (name, bytes) in files {
        let path = args.output.join(name);
        job::write_output(&path, &bytes)?;
        out.push(json!({ "file": path.display().to_string(), "bytes": bytes.len(), "sha256": program::key(&bytes) }));
    }
    Ok(out)
}

/// Counts of a program.
#[derive(Default)]
struct Counts {
    plunges: usize,
    retracts: usize,
    travel_mm: f64,
}

fn counts(program: &Program) -> Counts {
    let mut counts = Counts::default();
    let mut here = Point::default();
    for command in program.legs.iter().flat_map(|leg| &leg.commands) {
        match command {
            Command::Rapid { to } => {
                counts.travel_mm += here.distance_mm(*to);
                here = *to;
            }
            Command::Mill { to, .. } | Command::MillArc { to, .. } => here = *to,
            Command::Plunge { .. } => counts.plunges += 1,
            Command::Retract { .. } => counts.retracts += 1,
            _ => {}
        }
    }
    counts
}

fn report(side: &Side, machine: &Machine, files: Vec<Value>, accept: &[String]) -> Value {
    let timed = motion::timeline(&side.program, machine);
    let counts = counts(&side.program);
    let tasks = side.planned.parts.iter().flat_map(|part| part.tasks.iter().map(move |task| (part, task)));
    let tools: Vec<Value> = tasks
        .map(|(part, task)| {
            let milled: f64 =
                task.ways.iter().map(|way| way.path.length_mm() * way.depths.len() as f64).sum();
            json!({ "operation": part.operation, "bit": task.bit.name, "form": task.bit.cutter,
                "diameter_mm": rounded(task.bit.diameter.mm()), "holes": task.strokes.len(),
                "ways": task.ways.len(), "milled_mm": rounded(milled) })
        })
        .collect();
    let findings: Vec<Value> = side
        .findings
        .iter()
        .map(|finding| {
            let remark = finding.remark();
            json!({ "id": finding.id, "code": finding.kind.code(), "weight": finding.weight(),
                "unread": is_unread(finding, accept),
                "x_mm": rounded(finding.at.x.mm()), "y_mm": rounded(finding.at.y.mm()),
                "width_mm": rounded(finding.width.mm()), "nets": finding.nets, "cures": finding.cures,
                "message": remark.message("en"), "advice": remark.advice("en") })
        })
        .collect();
    let mut remarks = side.remarks.clone();
    remarks.extend(timed.as_ref().err().cloned());
    json!({
        "face": word(side.face),
        "files": files,
        "program_sha256": program::key(&program::encode(&side.program)),
        "total_time_s": timed.map_or(Value::Null, |timeline| json!(rounded(timeline.total_s()))),
        "milled_mm": rounded(side.planned.milled_mm()),
        "travel_mm": rounded(counts.travel_mm),
        "plunges": counts.plunges,
        "retracts": counts.retracts,
        "holes": side.program.hole_count(),
        "ways": side.program.legs.iter().filter(|leg| matches!(leg.mark, Mark::Way(_))).count(),
        "tool_changes": side.program.bits.len(),
        "tools": tools,
        "findings": findings,
        "remarks": remark_objects(&remarks),
    })
}

fn sentences(side: &Side, files: &[Value]) -> String {
    let counts = counts(&side.program);
    let say = |key: &str, args: &[(&str, String)]| {
        let args: Vec<_> = args.iter().map(|(name, value)| ((*name).to_owned(), value.clone())).collect();
        locale::text("en", key, &args) + "\n"
    };
    let mut out = say(
        "cam.report.side",
        &[
            ("side", word(side.face).to_owned()),
            ("ways", side.planned.ways().count().to_string()),
            ("milled", format!("{:.1}", side.planned.milled_mm())),
            ("holes", side.program.hole_count().to_string()),
            ("bits", side.program.bits.len().to_string()),
            ("retracts", counts.retracts.to_string()),
        ],
    );
    for file in files {
        out += &say("cam.report.file", &[("file", file["file"].as_str().unwrap_or_default().to_owned())]);
    }
    let findings: Vec<Remark> = side.findings.iter().map(Finding::remark).collect();
    out + &remark_lines(&findings) + &remark_lines(&side.remarks)
}
