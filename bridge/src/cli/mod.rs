//! The commands, one file each, and what they share: arguments, refusals, exit codes.
//!
//! Comes in: parsed arguments. Goes out: an exit code; with `--json` exactly one object on standard output, also on
//! refusal. Does not know what the commands do.

mod against;
mod browser;
mod cam;
mod cam_files;
mod cures;
mod doctor;
mod executor;
pub(crate) mod export;
pub(crate) mod files;
mod findings;
mod firmware;
mod grbl;
mod height_map;
mod inspect;
pub(crate) mod job;
mod judged;
mod lab;
mod level;
mod link;
mod log;
mod machines;
mod plan;
mod prove;
mod prove_files;
mod prove_holes;
mod queue;
mod run;
pub(crate) mod saving;
mod serve;
mod simulate;
mod templates;
mod tools;

use crate::refusal::{Exit, Refusal};

use annulus_core::diagnostic::Diagnostic;
use annulus_core::job::{Bit, Cutter};
use annulus_core::locale;
use annulus_core::machine::Machine;
use clap::{Args, Parser, Subcommand, ValueEnum};
use serde_json::{Value, json};
use std::fmt::Display;
use std::io::{self, Write};
use std::path::PathBuf;
use std::process::ExitCode;

/// Drill and mill printed circuit boards.
#[derive(Debug, Parser)]
#[command(name = "annulus", version, about)]
pub(crate) struct Arguments {
    /// Print exactly one JSON object on standard output.
    #[arg(long, global = true)]
    pub(crate) json: bool,
    #[command(subcommand)]
    pub(crate) command: Option<Command>,
}

/// What to do.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Read drill files, folders and zips, and say what is in them.
    Inspect(inspect::InspectArgs),
    /// Choose bits and put the holes in order.
    Plan(plan::PlanArgs),
    /// Prove programs against the design: shorts, breaks, gaps, slivers.
    Prove(prove::ProveArgs),
    /// Plan milling and drilling of a whole board and write its programs.
    Cam(cam::CamArgs),
    /// Write a program in another controller's words.
    Export(export::ExportArgs),
    /// List what a template of a controller is made of, print one that ships, or look for faults in one's own.
    Templates(templates::TemplatesArgs),
    /// Compute the step stream and say how long it takes.
    Simulate(simulate::SimulateArgs),
    /// Touch the board at a grid of places and keep its height map, for `run --level`.
    Level(Box<level::LevelArgs>),
    /// Drill a job.
    Run(run::RunArgs),
    /// Controllers of the GRBL family at a serial port: ports, info, level, run, resume.
    Grbl(grbl::GrblArgs),
    /// Firmware of the USB step adapter: info, flash.
    Firmware(firmware::FirmwareArgs),
    /// Check or run a queue of work commands.
    Queue(queue::QueueArgs),
    /// Serve the page on this computer (the default).
    Serve(serve::ServeArgs),
    /// Print a fresh one-time address for a running bridge.
    Link(link::LinkArgs),
    /// List the machines that are known.
    Machines(machines::MachinesArgs),
    /// Tools of a machine and what each has done: list, reset.
    Tools(tools::ToolsArgs),
    /// Compute motion for a report, or check files of expected numbers.
    Lab(lab::LabArgs),
    /// Check this computer: folders, ports, timing.
    Doctor(doctor::DoctorArgs),
    /// Pulses for the bridge, which starts it.
    #[command(hide = true)]
    Executor,
}

/// How a job is read: shared by every command that takes one.
#[derive(Debug, Clone, Args)]
pub(crate) struct JobArgs {
    /// Drill file, folder, zip, saved project, or a program written by `plan -o`.
    #[arg(value_name = "JOB")]
    pub(crate) job: PathBuf,
    #[command(flatten)]
    pub(crate) reading: ReadingArgs,
    #[command(flatten)]
    pub(crate) on: MachineArgs,
    /// Order of the holes.
    #[arg(long, value_enum, default_value_t = Order::Shortest)]
    pub(crate) order: Order,
    /// Order of the bits.
    #[arg(long, value_enum, default_value_t = Group::Ascending)]
    pub(crate) group: Group,
    /// With `--group loaded-first`: diameter of the bit that is in the spindle, in mm.
    #[arg(long = "loaded", value_name = "MM")]
    pub(crate) loaded_mm: Option<f64>,
    /// Drill only: leave out slots and holes without a drill, which otherwise are milled.
    #[arg(long)]
    pub(crate) no_mill: bool,
    /// Spindles that are to drill, for example 1,2; without it, all that the machine has.
    #[arg(long, value_delimiter = ',', value_name = "N")]
    pub(crate) spindles: Vec<u8>,
    /// Errors and findings that were seen, by code.
    #[arg(long, value_delimiter = ',', value_name = "CODE")]
    pub(crate) accept: Vec<String>,
    /// Seed of the search.
    #[arg(long, default_value_t = annulus_core::cam::SEED)]
    pub(crate) seed: u64,
    /// Bound of the search; without it, sized by the number of holes for about a second.
    #[arg(long)]
    pub(crate) iterations: Option<u64>,
}

/// The machine that a job is for.
#[derive(Debug, Clone, Default, Args)]
pub(crate) struct MachineArgs {
    /// Machine: a preset's name (hobby is a small router) or a machine file [default: virtual].
    #[arg(long, value_name = "NAME|FILE")]
    machine: Option<String>,
}

impl MachineArgs {
    /// The machine that was named, else the virtual drill.
    pub(crate) fn name(&self) -> &str {
        self.machine.as_deref().unwrap_or("virtual")
    }

    /// A note that `machine` was assumed, where nobody named one.
    pub(crate) fn assumed(&self, machine: &Machine) -> Option<Diagnostic> {
        let note = Diagnostic::note("cli.machine_assumed").with("machine", &machine.name);
        self.machine.is_none().then_some(note)
    }
}

/// Overrides of what a drill file says about its numbers.
#[derive(Debug, Clone, Default, Args)]
pub(crate) struct ReadingArgs {
    /// Do not look at the files beside it.
    #[arg(long)]
    pub(crate) alone: bool,
    /// Units of the coordinates.
    #[arg(long, value_enum)]
    pub(crate) units: Option<Units>,
    /// Digits before and after the decimal point, for example 2.4.
    #[arg(long, value_name = "I.D")]
    pub(crate) digits: Option<String>,
    /// Zeros that were left out.
    #[arg(long, value_enum)]
    pub(crate) zeros: Option<Zeros>,
    /// Move holes and outline that do not share the zero point of the copper to where they fit it. Without it every layer
    /// stays where its file puts it, and what lies apart is told.
    #[arg(long)]
    pub(crate) align: bool,
    /// Of several boards the one that is meant, by the name that `inspect` gives it.
    #[arg(long, value_name = "NAME")]
    pub(crate) board: Option<String>,
}

/// Units of coordinates.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Units {
    /// Millimetres.
    Mm,
    /// Inches.
    Inch,
}

/// Zeros left out of coordinates.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Zeros {
    /// Those in front.
    Leading,
    /// Those behind.
    Trailing,
    /// None.
    None,
}

/// Order of the holes of one bit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Order {
    /// Shortest closed tour.
    Shortest,
    /// Least machine time.
    Fastest,
    /// As in the file.
    File,
}

impl From<Order> for annulus_core::cam::HoleOrder {
    fn from(order: Order) -> Self {
        match order {
            Order::Shortest => Self::Shortest,
            Order::Fastest => Self::Fastest,
            Order::File => Self::File,
        }
    }
}

/// Order of the bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Group {
    /// Small before large.
    Ascending,
    /// The loaded bit first, then ascending.
    LoadedFirst,
}

/// What a command found, for scripts and for people.
pub(crate) struct Answer {
    /// The JSON object, without `ok`; null when the command has said everything itself.
    pub(crate) object: Value,
    /// The same for people.
    pub(crate) text: String,
    /// Exit code: refused for content gives 1 even though there is an answer.
    pub(crate) exit: Exit,
}

impl Answer {
    /// What was found, though it is refused all the same: the object says why, as that of a refusal does.
    fn refused(mut object: Value, text: &str, why: Diagnostic) -> Self {
        let refusal = Refusal::content(why);
        object["error"] = refusal.object()["error"].take();
        Self { object, text: format!("{text}{refusal}\n"), exit: Exit::Content }
    }
}

/// To a millionth, as the contract says; never a negative zero.
fn rounded(value: f64) -> f64 {
    (value * 1e6).round() / 1e6 + 0.0
}

/// A tool for scripts: the word of its form and its sizes. Tip and angle are those of V-bits.
fn tool_object(bit: &Bit) -> Value {
    let (form, tip, angle_mdeg) = match bit.cutter {
        Cutter::Drill => ("drill", None, None),
        Cutter::Mill => ("mill", None, None),
        Cutter::Vee { tip, angle_mdeg } => ("vee", Some(tip), Some(angle_mdeg)),
    };
    json!({
        "form": form,
        "diameter_mm": rounded(bit.diameter.mm()),
        "angle_deg": angle_mdeg.map(|angle| rounded(f64::from(angle) / 1e3)),
        "tip_mm": tip.map(|tip| rounded(tip.mm())),
        "name": bit.title(locale::FALLBACK),
    })
}

/// Diagnostics for scripts.
fn diagnostic_objects(diagnostics: &[Diagnostic]) -> Vec<Value> {
    let object = |diagnostic: &Diagnostic| {
        let place = diagnostic.place.as_ref();
        json!({ "severity": diagnostic.severity, "code": diagnostic.code,
            "file": place.map(|place| place.file.as_str()), "line": place.map(|place| place.line),
            "column": place.map(|place| place.column), "message": diagnostic.message("en"),
            "advice": diagnostic.advice("en") })
    };
    diagnostics.iter().map(object).collect()
}

/// Diagnostics for people, a line each.
fn diagnostic_lines(diagnostics: &[Diagnostic]) -> String {
    let line = |diagnostic: &Diagnostic| {
        format!("- {} {} ({})\n", diagnostic.message("en"), diagnostic.advice("en"), diagnostic.code)
    };
    diagnostics.iter().map(line).collect()
}

/// Reads the command line, runs the command and reports.
pub(crate) fn main() -> ExitCode {
    match Arguments::try_parse() {
        Ok(arguments) => run(arguments),
        Err(error) => explain(&error),
    }
}

/// Help, version, or wrong usage. Scripts that asked for an object get one.
fn explain(error: &clap::Error) -> ExitCode {
    let _ = error.print();
    if !error.use_stderr() {
        return Exit::Done.into();
    }
    let asked = std::env::args_os()
        .skip(1)
        .take_while(|argument| argument != "--")
        .any(|argument| argument == "--json");
    if asked {
        let text = error.render().to_string();
        let first = text.lines().next().unwrap_or_default().trim_start_matches("error: ");
        let refusal = Refusal::usage(Diagnostic::error("cli.usage").with("what", first));
        return ended(refusal.exit, print(format_args!("{}\n", refusal.object())));
    }
    Exit::Usage.into()
}

/// Prints on standard output.
fn print(text: impl Display) -> io::Result<()> {
    let mut out = io::stdout().lock();
    write!(out, "{text}")?;
    out.flush()
}

/// Says a line to the person on standard error; whoever does not listen need not.
pub(crate) fn say(line: impl Display) {
    let _ = writeln!(io::stderr().lock(), "{line}");
}

/// So many of a thing, by its name for one of it: `1 hole`, `2 holes`.
pub(crate) fn counted(count: impl Into<u64>, one: &str) -> String {
    let count = count.into();
    if count == 1 { format!("1 {one}") } else { format!("{count} {one}s") }
}

/// Exit code after printing: a reader that went away (`annulus … | head`) has had enough, a full disk has not.
fn ended(exit: Exit, printed: io::Result<()>) -> ExitCode {
    match printed {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            let why = Diagnostic::error("cli.not_printed").with("reason", error);
            let refusal = Refusal::surroundings(why);
            say(&refusal);
            refusal.exit.into()
        }
        _ => exit.into(),
    }
}

fn run(arguments: Arguments) -> ExitCode {
    let json = arguments.json;
    match dispatch(arguments) {
        // What a command already said itself is not said again.
        Ok(answer) if answer.object.is_null() => answer.exit.into(),
        Ok(answer) if json => {
            let mut object = json!({ "ok": answer.exit == Exit::Done });
            if let (Value::Object(out), Value::Object(rows)) = (&mut object, answer.object) {
                out.extend(rows);
            }
            if !answer.text.is_empty() {
                say(answer.text.trim_end());
            }
            ended(answer.exit, print(format_args!("{object}\n")))
        }
        Ok(answer) => ended(answer.exit, print(answer.text)),
        Err(refusal) => {
            say(&refusal);
            let object = if json { format!("{}\n", refusal.object()) } else { String::new() };
            ended(refusal.exit, print(object))
        }
    }
}

fn dispatch(arguments: Arguments) -> Result<Answer, Refusal> {
    let json = arguments.json;
    match arguments.command {
        Some(Command::Inspect(args)) => inspect::run(&args, json),
        Some(Command::Plan(args)) => plan::run(&args),
        Some(Command::Prove(args)) => prove::run(&args),
        Some(Command::Cam(args)) => cam::run(&args),
        Some(Command::Export(args)) => export::run(&args),
        Some(Command::Templates(args)) => templates::run(&args),
        Some(Command::Simulate(args)) => simulate::run(&args),
        Some(Command::Level(args)) => level::run(&args, json),
        Some(Command::Run(args)) => run::run(&args, json),
        Some(Command::Grbl(args)) => grbl::run(&args, json),
        Some(Command::Firmware(args)) => firmware::run(&args),
        Some(Command::Queue(args)) => queue::run(&args),
        Some(Command::Serve(args)) => serve::run(&args, json),
        Some(Command::Link(args)) => link::run(&args),
        Some(Command::Machines(args)) => machines::run(&args),
        Some(Command::Tools(args)) => tools::run(&args),
        Some(Command::Lab(args)) => lab::run(&args, json),
        Some(Command::Doctor(args)) => doctor::run(&args),
        Some(Command::Executor) => executor::run(),
        None => serve::run(&serve::ServeArgs::default(), json),
    }
}
