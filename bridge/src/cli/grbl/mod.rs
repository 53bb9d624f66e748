//! Controllers of the GRBL family at a serial port: which ports there are, who is there, a job run, a job resumed (N19).
//!
//! Comes in: names of ports, programs. Goes out: what was run, and how it ended. Does not know a controller's words.

mod check;
mod how;
mod keys;
mod level;
mod operator;
mod pressed;
mod program;

use super::{Answer, Exit, Refusal};
use crate::controller::ledger::Ledger;
use crate::controller::{self, Owner};
use crate::machine_file;
use crate::serial::Port;
use annulus_core::align::BoardFit;
use annulus_core::controller::{Info, ResetOnOpen, aligned_routine, estimate_s, settings};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::locale;
use annulus_core::machine;
use annulus_drill::controller::{AttendedJob, Told};
use how::{How, Sold, sold_mill};
use operator::Operator;
use program::Programs;
use serde_json::{Value, json};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// How long a controller may take to say who it is. A line at the wrong speed says something for ever.
const GREETING: Duration = Duration::from_secs(20);

/// Arguments of `annulus grbl`.
#[derive(Debug, clap::Args)]
pub(crate) struct GrblArgs {
    #[command(subcommand)]
    command: GrblCommand,
}

#[derive(Debug, clap::Subcommand)]
enum GrblCommand {
    /// List the serial ports of this computer.
    Ports,
    /// Ask a controller who it is, and list its settings in words.
    Info(PortArgs),
    /// Have the controller read a job in its check mode: every line, without a move.
    Check(Box<CheckArgs>),
    /// Touch the board with the probe all over and keep its height map, for `run --level kept`.
    Level(Box<BoardArgs>),
    /// Run a job: programs in G-code one after the other, or a board.
    Run(Box<RunArgs>),
    /// Go on with the job that was interrupted, at the hole or toolpath where it was.
    Resume(Box<ResumeArgs>),
}

/// The port.
#[derive(Debug, Clone, clap::Args)]
struct PortArgs {
    /// The serial port, as `annulus grbl ports` lists it.
    #[arg(long, value_name = "PORT")]
    port: String,
    /// Bits in a second; without it the usual speeds are tried until somebody answers.
    #[arg(long)]
    baud: Option<u32>,
    /// What opening the port may do to the board: begin anew, as most do (usual), or nothing that is written then resets it (never)
    /// [default: usual].
    #[arg(long, value_enum)]
    reset_on_open: Option<MayReset>,
}

/// What opening the port may do to the board.
#[derive(Debug, Clone, Copy, PartialEq, clap::ValueEnum)]
enum MayReset {
    /// It may begin anew.
    Usual,
    /// Nothing that is written then resets it.
    Never,
}

impl From<MayReset> for ResetOnOpen {
    fn from(may: MayReset) -> Self {
        match may {
            MayReset::Usual => Self::Usual,
            MayReset::Never => Self::Never,
        }
    }
}

impl PortArgs {
    /// The port, open, and at how many bits in a second.
    fn open(&self) -> Result<(Port, u32), Refusal> {
        let silent = |bits_per_s: u32| {
            super::say(format_args!("Nobody answers at {bits_per_s} bits a second."));
        };
        let reset = self.reset_on_open.map(ResetOnOpen::from).unwrap_or_default();
        controller::open(&self.port, self.baud, reset, silent).map_err(Refusal::surroundings)
    }
}

/// Arguments of `annulus grbl check`.
#[derive(Debug, clap::Args)]
struct CheckArgs {
    #[command(flatten)]
    job: super::JobArgs,
    /// Further programs of the same board, read after the first.
    #[arg(value_name = "PROGRAM")]
    more: Vec<PathBuf>,
    #[command(flatten)]
    port: PortArgs,
    /// Home first: soft limits mean nothing before.
    #[arg(long)]
    home: bool,
    /// How many times faster than life the controller runs, for simulated ones.
    #[arg(long, hide = true, default_value_t = 1.0)]
    speed: f64,
}

/// Arguments of `annulus grbl run`.
#[derive(Debug, clap::Args)]
struct RunArgs {
    #[command(flatten)]
    board: BoardArgs,
    /// Let depth follow the board's surface: touch it first (measure), or use the map that was kept (kept).
    #[arg(long, value_name = "WHICH")]
    level: Option<WhichMap>,
    /// Begin anew even though this job was interrupted, or another one, which is forgotten then.
    #[arg(long)]
    from_start: bool,
}

/// A board or its programs, at a controller: what `annulus grbl level` touches, and `run` makes.
#[derive(Debug, clap::Args)]
struct BoardArgs {
    #[command(flatten)]
    job: super::JobArgs,
    /// Further programs of the same board, run after the first; between two of them the tool is changed.
    #[arg(value_name = "PROGRAM")]
    more: Vec<PathBuf>,
    #[command(flatten)]
    how: How,
    #[command(flatten)]
    touches: TouchArgs,
}

/// Where and how a board is touched.
#[derive(Debug, Clone, clap::Args)]
struct TouchArgs {
    /// The board is touched at places that are at most so many mm apart.
    #[arg(long, value_name = "MM", default_value_t = 10.0)]
    grid: f64,
    /// The outermost places lie so many mm inside of what is cut.
    #[arg(long, value_name = "MM", default_value_t = 2.0)]
    margin: f64,
    /// From place to place the tip goes so many mm over the highest place touched.
    #[arg(long, value_name = "MM", default_value_t = 1.0)]
    clear: f64,
    /// One place may lie so many mm below the one before it.
    #[arg(long, value_name = "MM", default_value_t = 2.0)]
    depth: f64,
}

/// Which height map a job follows.
#[derive(Debug, Clone, Copy, PartialEq, clap::ValueEnum)]
enum WhichMap {
    /// One that is measured now.
    Measure,
    /// The one that was kept.
    Kept,
}

/// Arguments of `annulus grbl resume`.
#[derive(Debug, clap::Args)]
struct ResumeArgs {
    /// Errors and findings that were seen, by code.
    #[arg(long, value_delimiter = ',', value_name = "CODE")]
    accept: Vec<String>,
    /// Use nothing again that the interrupted run was given: only what is given here.
    #[arg(long)]
    anew: bool,
    /// Which mill it is, as it is sold: what the controller's settings are compared with.
    #[arg(long, value_name = "NAME", value_parser = sold_mill)]
    machine: Option<Sold>,
    #[command(flatten)]
    how: How,
}

/// The programs where the board lies.
fn aligned(programs: Programs, how: &How) -> Result<Programs, Refusal> {
    if how.found.is_empty() {
        return Ok(programs);
    }
    let fit = BoardFit::of(&how.found).map_err(Refusal::content)?;
    let mm = |mm: f64| format!("{mm:.3}");
    let told = Diagnostic::note("align.lies").with("degrees", mm(fit.degrees()));
    let told = told.with("x", mm(fit.shift_mm[0])).with("y", mm(fit.shift_mm[1]));
    super::say(told.with("left", mm(fit.left_over_mm)).message("en"));
    let routine = Arc::new(aligned_routine(&programs.routine, &fit));
    Ok(Programs { routine, ..programs })
}

/// Runs the command.
pub(crate) fn run(args: &GrblArgs, json: bool) -> Result<Answer, Refusal> {
    match &args.command {
        GrblCommand::Ports => Ok(ports()),
        GrblCommand::Info(port) => info(port),
        GrblCommand::Check(args) => check::run(args),
        GrblCommand::Level(args) => level::run(args, json),
        GrblCommand::Run(args) => run_job(args, json),
        GrblCommand::Resume(args) => resume(args, json),
    }
}

fn ports() -> Answer {
    let found = controller::list();
    let text = found.iter().map(|port| format!("{:<16} {}\n", port.name, port.what)).collect();
    let rows: Vec<Value> = found.iter().map(|port| json!({ "port": port.name, "what": port.what })).collect();
    Answer { object: json!({ "ports": rows }), text, exit: Exit::Done }
}

/// What is done at controllers.
pub(super) fn ledger() -> Ledger {
    Ledger::in_folder(&machine_file::data_folder())
}

fn info(args: &PortArgs) -> Result<Answer, Refusal> {
    let (port, bits_per_s) = args.open()?;
    let owner = Owner::new(port, ledger(), (AttendedJob::default(), None), 1.0);
    let mut said = Diagnostic::error("grbl.no_answer");
    let since = Instant::now();
    let info = loop {
        if since.elapsed() > GREETING {
            return Err(Refusal::surroundings(said));
        }
        match owner.next() {
            Some(Told::Greeted(info)) => break info,
            Some(Told::Found(found)) => said = found,
            Some(Told::Gone) => return Err(Refusal::surroundings(said)),
            _ => {}
        }
    };
    let mut object = described(&info);
    object["bits_per_s"] = bits_per_s.into();
    let text = format!("{}{bits_per_s} bits a second\n", text_of(&info));
    Ok(Answer { object, text, exit: Exit::Done })
}

fn controller_object(info: &Info) -> Value {
    json!({ "flavour": info.flavour(), "version": info.version, "rx_bytes": info.options.rx_bytes })
}

fn described(info: &Info) -> Value {
    let rows: Vec<Value> = info
        .values
        .iter()
        .map(|(number, value)| {
            let row = settings::of(*number);
            let name = row.map(|row| locale::text("en", &row.key(), &[]));
            json!({ "number": number, "name": name, "value": value, "unit": row.map(|row| row.unit) })
        })
        .collect();
    json!({ "controller": controller_object(info), "banner": info.banner, "settings": rows })
}

fn text_of(info: &Info) -> String {
    let mut text = format!("{} {}\n{}\n", info.flavour(), info.version, info.banner);
    for (number, value) in &info.values {
        let Some(row) = settings::of(*number) else { continue };
        let name = locale::text("en", &row.key(), &[]);
        text += &format!("${number:<4} {value:>10} {:<9} {name}\n", row.unit);
    }
    text
}

fn run_job(args: &RunArgs, json: bool) -> Result<Answer, Refusal> {
    let board = &args.board;
    let ledger = ledger();
    let programs = aligned(program::read(&board.job, &board.more, &ledger)?, &board.how)?;
    let begun = ledger.interrupted().filter(|entry| entry.holes + entry.toolpaths > 0);
    if let Some(entry) = begun.filter(|_| !args.from_start) {
        let why = if entry.key == programs.routine.key {
            Diagnostic::error("grbl.interrupted")
        } else {
            Diagnostic::error("grbl.forgets").with("name", &entry.name)
        };
        let why = why.with("holes", entry.holes).with("toolpaths", entry.toolpaths);
        return Err(Refusal::content(why));
    }
    let how = board.how();
    let (files, given) = (programs.files.clone(), how.given());
    let entry = AttendedJob { files, given, ..AttendedJob::default() };
    let tools = programs.tools(&ledger);
    let mut operator = Operator::new(&how, &ledger, (entry, tools), json)?;
    let level = args.level.map(|which| (which, &board.touches));
    operator.run(&programs, None, &board.job.accept, level)
}

impl BoardArgs {
    /// How it is run, on the mill as it is sold that was named as the machine.
    fn how(&self) -> How {
        let name = self.job.on.machine.as_deref();
        self.how.on(name.and_then(|name| machine::mill(machine::preset_name(name))))
    }
}

fn resume(args: &ResumeArgs, json: bool) -> Result<Answer, Refusal> {
    let ledger = ledger();
    let none = || Refusal::content(Diagnostic::error("grbl.nothing_interrupted"));
    let before = ledger.interrupted().ok_or_else(none)?;
    let how = args.how.on(args.machine.map(|sold| sold.0));
    let (how, told) = if args.anew { (how, Vec::new()) } else { how.as_before(&before) };
    let entry = AttendedJob { given: how.given(), ..before };
    let programs = aligned(program::read_again(&entry.files)?, &how)?;
    if programs.routine.key != entry.key {
        let why = Diagnostic::error("grbl.other_job").with("name", &entry.name);
        return Err(Refusal::content(why));
    }
    let tools = programs.tools(&ledger);
    let mut operator = Operator::new(&how, &ledger, (entry.clone(), tools), json)?;
    operator.tells(told);
    operator.run(&programs, Some(&entry), &args.accept, None)
}

/// How long a job takes from a section on, in words of the object.
fn time_s(programs: &Programs, info: &Info, from: usize, at: [f64; 3]) -> Option<f64> {
    estimate_s(&programs.routine, &info.values, usize::from(info.options.blocks), from, at)
}
