//! Controllers of the GRBL family at a serial port: list ports, identify, check, level, run and resume.

mod alone;
mod check;
mod dry;
mod held;
pub(super) mod how;
mod keys;
mod level;
mod operator;
mod pressed;
pub(super) mod program;

use super::{Answer, Exit, Refusal};
use crate::adapter::is_adapter;
use crate::grbl::{self, Client, DiskFiles, GrblHost, Ledger, Site};
use crate::machine_file;
use crate::serial::Listed;
use annulus_core::align::BoardFit;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::grbl::{Info, ResetOnOpen, aligned_routine, estimate_s, settings};
use annulus_core::locale;
use annulus_core::machine::{self, Machine, Output};
use annulus_core::{code, error, note};
use annulus_host::grbl::{AttendedJob, JobTools, Named, Told, unfit};
use how::{How, Sold, sold_mill};
use operator::Operator;
use program::Programs;
use serde_json::{Value, json};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Time limit to identify a controller. At a wrong baud rate, noise can arrive without end.
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
    /// Identify a controller, and list its settings in words.
    Info(PortArgs),
    /// Let the controller read a job in its check mode: it parses every line without motion.
    Check(Box<CheckArgs>),
    /// Probe the board and save its height map, for `run --height-map saved`.
    Level(Box<BoardArgs>),
    /// Run a job: G-code programs one after the other, or a board.
    Run(Box<RunArgs>),
    /// Resume the interrupted job at its hole or toolpath.
    Resume(Box<ResumeArgs>),
}

/// Options of the serial port.
#[derive(Debug, Clone, Default, clap::Args)]
pub(super) struct PortArgs {
    /// Use this serial port, as listed by `annulus ports`.
    #[arg(long, value_name = "PORT")]
    pub(super) port: Option<String>,
    /// Set the baud rate [default: try the common ones until the controller answers].
    #[arg(long)]
    baud: Option<u32>,
    /// Choose whether opening the port may reset the controller, as it does on most boards (auto), or not
    /// (never) [default: auto].
    #[arg(long, value_enum)]
    reset_on_open: Option<MayReset>,
}

/// Whether opening the port may reset the controller.
#[derive(Debug, Clone, Copy, PartialEq, clap::ValueEnum)]
enum MayReset {
    /// It may reset it.
    #[value(name = "auto", alias = "usual")]
    Usual,
    /// It must not reset it.
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
    /// Opens the port for this job. `speed` is the time scale of the controller.
    fn open(&self, job: (AttendedJob, Option<JobTools>), speed: f64) -> Result<Client, Refusal> {
        let reset = self.reset_on_open.map(ResetOnOpen::from).unwrap_or_default();
        let port = self.port.clone().ok_or_else(|| no_port(None))?;
        no_adapter_at(&port)?;
        let site = Site { port, baud: self.baud, files: files(), named: None, speed };
        Client::open(site, reset, job, silent)
    }
}

fn silent(bits_per_s: u32) {
    super::say(format_args!("No controller answers at {bits_per_s} baud."));
}

/// Refuses a port with a USB step adapter.
fn no_adapter_at(port: &str) -> Result<(), Refusal> {
    let is_adapter = is_adapter_at(port, &grbl::list());
    let why = || Refusal::usage(error!("grbl.is_adapter", port = port));
    if is_adapter { Err(why()) } else { Ok(()) }
}

/// Opens the controller at a port with this baud rate, for the pages of the server. `named` is the machine
/// that the user named.
pub(super) fn serve(
    (port, baud): (&str, Option<u32>),
    named: Option<(&str, Machine)>,
    speed: f64,
) -> Result<GrblHost, Refusal> {
    no_adapter_at(port)?;
    if let Some((name, machine)) = &named {
        has_controller(machine, (*name, *name == "virtual"), Some(port))?;
        if let Some(why) = unfit(machine) {
            return Err(Refusal::usage(why));
        }
    }
    files().claim().map_err(Refusal::surroundings)?;
    let mill = |name| machine::mill(machine::preset_name(name));
    let named = named.map(|(name, machine)| Named { machine, mill: mill(name) });
    GrblHost::open(Site { port: port.to_owned(), baud, files: files(), named, speed }, silent)
}

/// Returns `true` if the port `name`, or the target of that link, is a USB step adapter.
fn is_adapter_at(name: &str, ports: &[Listed]) -> bool {
    ports.iter().any(|port| is_adapter(port) && port.is_named(name))
}

/// Refuses a machine that no GRBL controller drives.
pub(super) fn no_controller(on: &super::MachineArgs, port: Option<&str>) -> Result<(), Refusal> {
    has_controller(&machine_file::named(on.name())?.machine, (on.name(), on.is_virtual()), port)
}

fn has_controller(
    machine: &Machine,
    (name, is_virtual): (&str, bool),
    port: Option<&str>,
) -> Result<(), Refusal> {
    let code = match machine.output {
        Output::Virtual if is_virtual => code!("run.port_of_virtual"),
        Output::Virtual => return Ok(()),
        Output::Adapter => code!("run.port_of_adapter"),
        _ => code!("run.port_of_output"),
    };
    let why = Diagnostic::error(code).with("machine", name);
    Err(Refusal::usage(why.with("port", port.unwrap_or("PORT"))))
}

/// Error if a controller needs a port and none is named: lists the ports. Without any port, the exit code
/// differs.
pub(super) fn no_port(machine: Option<&str>) -> Refusal {
    let found: Vec<String> = grbl::list().into_iter().map(|port| port.name).collect();
    if found.is_empty() {
        let why = error!("run.no_ports", machine = machine.unwrap_or("GRBL"));
        return Refusal::surroundings(why);
    }
    let why = error!("run.no_port", machine = machine.unwrap_or("GRBL"), ..);
    Refusal::usage(why.with("ports", found.join(", ")))
}

/// Arguments of `annulus grbl check`.
#[derive(Debug, clap::Args)]
struct CheckArgs {
    #[command(flatten)]
    job: super::JobArgs,
    /// More programs of the same board, read after the first.
    #[arg(value_name = "PROGRAM")]
    more: Vec<PathBuf>,
    #[command(flatten)]
    port: PortArgs,
    /// Home first: soft limits work only after homing.
    #[arg(long)]
    home: bool,
    /// Set how many times faster than real time a simulated controller runs.
    #[arg(long = "time-scale", alias = "speed", hide = true, default_value_t = 1.0)]
    speed: f64,
}

/// Arguments of `annulus run` and `annulus grbl run`.
#[derive(Debug, clap::Args)]
pub(super) struct RunArgs {
    #[command(flatten)]
    pub(super) board: BoardArgs,
    /// Let depth follow this height map of the board [default: none].
    #[arg(long = "height-map", alias = "level", value_enum, value_name = "WHICH")]
    which_map: Option<WhichMap>,
    /// Start from the beginning even if this job, or another one, was interrupted.
    #[arg(long = "restart", alias = "from-start")]
    pub(super) from_start: bool,
}

impl RunArgs {
    /// The height map to follow, if any.
    pub(super) fn height_map(&self) -> Option<WhichMap> {
        self.which_map.filter(|which| *which != WhichMap::None)
    }
}

/// A board or its programs at a controller: input of `annulus grbl level` and `run`.
#[derive(Debug, clap::Args)]
pub(super) struct BoardArgs {
    #[command(flatten)]
    pub(super) job: super::JobArgs,
    /// More programs of the same board, run after the first, with a tool change before each.
    #[arg(value_name = "PROGRAM")]
    pub(super) more: Vec<PathBuf>,
    #[command(flatten)]
    pub(super) how: How,
    #[command(flatten)]
    touches: TouchArgs,
}

/// Where and how to probe a board.
#[derive(Debug, Clone, clap::Args)]
struct TouchArgs {
    /// Set the largest distance between two probed positions.
    #[arg(long = "spacing", alias = "grid", value_name = "MM", default_value_t = 10.0)]
    grid: f64,
    /// Keep the outermost probed positions this far inside the cut area.
    #[arg(long, value_name = "MM", default_value_t = 2.0)]
    margin: f64,
    /// Set the travel height of the tool above the highest probed position.
    #[arg(long = "travel-height", alias = "clear", value_name = "MM", default_value_t = 1.0)]
    clear: f64,
    /// Set how far a position may be below the previous one.
    #[arg(long = "max-drop", alias = "depth", value_name = "MM", default_value_t = 2.0)]
    depth: f64,
}

/// The height map that a job follows.
#[derive(Debug, Clone, Copy, PartialEq, clap::ValueEnum)]
pub(super) enum WhichMap {
    /// Follow no map.
    None,
    /// Use the saved map.
    #[value(alias = "kept")]
    Saved,
    /// Probe the board now.
    Measure,
}

/// Arguments of `annulus grbl resume`.
#[derive(Debug, clap::Args)]
struct ResumeArgs {
    /// Accept these errors and problems, by code.
    #[arg(long, value_delimiter = ',', value_name = "CODE")]
    accept: Vec<String>,
    /// Use only the options given here, not those of the interrupted run. The job continues where it was.
    #[arg(long = "forget-options", alias = "anew")]
    anew: bool,
    /// Compare the controller's settings with this machine model.
    #[arg(short, long, value_name = "NAME", value_parser = sold_mill)]
    machine: Option<Sold>,
    #[command(flatten)]
    how: How,
}

/// The programs, aligned with the measured holes.
fn aligned(programs: Programs, how: &How) -> Result<Programs, Refusal> {
    if how.found.is_empty() {
        return Ok(programs);
    }
    let fit = BoardFit::of(&how.found).map_err(Refusal::content)?;
    let mm = |mm: f64| format!("{mm:.3}");
    let told = note!("align.lies", degrees = mm(fit.degrees()), ..);
    let told = told.with("x", mm(fit.shift_mm[0])).with("y", mm(fit.shift_mm[1]));
    super::say(told.with("left", mm(fit.left_over_mm)).message("en"));
    let routine = Arc::new(aligned_routine(&programs.routine, &fit));
    Ok(Programs { routine, ..programs })
}

pub(crate) fn run(args: &GrblArgs, json: bool) -> Result<Answer, Refusal> {
    match &args.command {
        GrblCommand::Ports => Ok(ports()),
        GrblCommand::Info(port) => info(port),
        GrblCommand::Check(args) => check::run(args),
        GrblCommand::Level(args) if args.how.dry_run => dry::level(args),
        GrblCommand::Level(args) => level::run(args, json),
        GrblCommand::Run(args) => run_job(args, json),
        GrblCommand::Resume(args) if args.how.dry_run => dry::resume(args),
        GrblCommand::Resume(args) => resume(args, json),
    }
}

/// Lists the serial ports of this computer.
pub(super) fn ports() -> Answer {
    let found = grbl::list();
    let text = found.iter().map(|port| format!("{:<16} {}\n", port.name, port.what)).collect();
    let rows: Vec<Value> = found.iter().map(|port| json!({ "port": port.name, "what": port.what })).collect();
    Answer { object: json!({ "ports": rows }), text, exit: Exit::Done }
}

/// The files of the controller.
fn files() -> DiskFiles {
    DiskFiles::in_folder(&machine_file::data_folder())
}

/// The ledger of jobs at controllers.
pub(super) fn ledger() -> Result<Ledger, Refusal> {
    Ledger::open(files()).map_err(Refusal::surroundings)
}

/// The same, to be written: no other process may do so meanwhile.
pub(super) fn own_ledger() -> Result<Ledger, Refusal> {
    files().claim().map_err(Refusal::surroundings)?;
    ledger()
}

fn info(args: &PortArgs) -> Result<Answer, Refusal> {
    let station = args.open((AttendedJob::default(), None), 1.0)?;
    let mut said = error!("grbl.no_answer");
    let since = Instant::now();
    let info = loop {
        if since.elapsed() > GREETING {
            return Err(Refusal::surroundings(said));
        }
        match station.next() {
            Some(Told::Greeted(info)) => break info,
            Some(Told::Found(found)) => said = found,
            Some(Told::Gone) => return Err(Refusal::surroundings(said)),
            _ => {}
        }
    };
    let (mut object, bits_per_s) = (described(&info), station.bits_per_s);
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

pub(super) fn run_job(args: &RunArgs, json: bool) -> Result<Answer, Refusal> {
    let board = &args.board;
    if board.how.dry_run {
        return dry::run(args);
    }
    no_controller(&board.job.on, board.how.port.port.as_deref())?;
    let ledger = own_ledger()?;
    let programs = aligned(program::read(&board.job, &board.more, &ledger)?, &board.how)?;
    refuse_interrupted(&ledger, &programs.routine.key, args.from_start)?;
    let how = board.how();
    let (files, given) = (programs.files.clone(), how.given());
    let entry = AttendedJob { files, given, ..AttendedJob::default() };
    let tools = programs.tools(ledger.wear());
    let mut operator = Operator::new(&how, &ledger, (entry, tools), how.typing(), json)?;
    operator.tells(how.unattended().into_iter().collect());
    let level = args.height_map().map(|which| (which, &board.touches));
    operator.run(&programs, None, &board.job.accept, level)
}

/// Refuses to start the job `key` if another one, or this one, was interrupted.
fn refuse_interrupted(ledger: &Ledger, key: &str, from_start: bool) -> Result<(), Refusal> {
    let begun = ledger.interrupted().filter(|entry| entry.holes + entry.toolpaths > 0);
    let Some(entry) = begun.filter(|_| !from_start) else { return Ok(()) };
    let why = if entry.key == key {
        error!("grbl.interrupted", ..)
    } else {
        error!("grbl.forgets", name = &entry.name, ..)
    };
    let why = why.with("holes", entry.holes).with("toolpaths", entry.toolpaths);
    Err(Refusal::content(why))
}

impl BoardArgs {
    /// The options, with the machine model that was named or chosen.
    fn how(&self) -> How {
        let on = &self.job.on;
        let name = (on.origin() != "default").then(|| on.name());
        self.how.on(name.and_then(|name| machine::mill(machine::preset_name(name))))
    }
}

fn resume(args: &ResumeArgs, json: bool) -> Result<Answer, Refusal> {
    let ledger = own_ledger()?;
    let none = || Refusal::content(error!("grbl.nothing_interrupted"));
    let before = ledger.interrupted().cloned().ok_or_else(none)?;
    let how = args.how.on(args.machine.map(|sold| sold.0));
    let (how, told) = if args.anew { (how, Vec::new()) } else { how.as_before(&before) };
    let entry = AttendedJob { given: how.given(), ..before };
    let programs = aligned(program::read_again(&program::files_of(&ledger, &files()))?, &how)?;
    if programs.routine.key != entry.key {
        let why = error!("grbl.other_job", name = &entry.name);
        return Err(Refusal::content(why));
    }
    let tools = programs.tools(ledger.wear());
    let mut operator = Operator::new(&how, &ledger, (entry.clone(), tools), how.typing(), json)?;
    operator.tells(told);
    operator.tells(how.unattended().into_iter().collect());
    operator.run(&programs, Some(&entry), &args.accept, None)
}

/// Duration of a job from a section on, s, for the JSON object.
fn time_s(programs: &Programs, info: &Info, from: usize, at: [f64; 3]) -> Option<f64> {
    estimate_s(&programs.routine, &info.values, usize::from(info.options.blocks), from, at)
}
