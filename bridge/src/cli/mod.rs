//! The commands, one file each, and their shared arguments, errors and exit codes.

mod against;
mod browser;
mod cam;
mod cam_files;
mod completions;
mod cures;
mod doctor;
mod dry_run;
mod executor;
pub(crate) mod export;
mod export_board;
pub(crate) mod files;
mod findings;
mod firmware;
mod grbl;
mod height_map;
mod help;
mod inspect;
pub(crate) mod job;
mod judged;
mod lab;
mod level;
mod link;
mod log;
mod machine_table;
mod machines;
mod memory;
mod numbers;
mod old_flags;
mod plan;
mod prove;
mod prove_files;
mod prove_holes;
mod queue;
mod roles;
mod run;
pub(crate) mod saving;
mod serve;
mod simulate;
mod templates;
mod tools;
mod verbosity;

use crate::machine_file;
use crate::refusal::{Exit, Refusal};
use annulus_core::{error, note};

use annulus_core::diagnostic::Diagnostic;
use annulus_core::job::{Bit, Cutter};
use annulus_core::locale;
use annulus_core::machine::{self, Machine};
use annulus_core::units::Length;
use clap::{Args, ColorChoice, FromArgMatches, Parser, Subcommand, ValueEnum};
use serde::{Serialize, Serializer};
use serde_json::{Value, json};
use std::fmt::Display;
use std::io::{self, Write};
use std::path::PathBuf;
use std::process::ExitCode;

/// The command line.
#[derive(Debug, Parser)]
#[command(name = "annulus", version, about = help::ABOUT)]
pub(crate) struct Arguments {
    /// Print exactly one JSON object to standard output.
    #[arg(long, global = true)]
    pub(crate) json: bool,
    /// Print no notes and no progress, only results, warnings and errors.
    #[arg(short, long, global = true)]
    quiet: bool,
    /// Print long lists in full, and a detailed log.
    #[arg(short, long, global = true)]
    verbose: bool,
    /// Choose when help and messages are colored. NO_COLOR is respected.
    #[arg(long, global = true, value_enum, value_name = "WHEN", default_value_t = ColorChoice::Auto)]
    color: ColorChoice,
    #[command(subcommand)]
    pub(crate) command: Option<Command>,
}

/// What to do.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Read drill files, folders and zips, and list their contents.
    Inspect(inspect::InspectArgs),
    /// Choose tools and put the holes in order.
    Plan(plan::PlanArgs),
    /// Prove programs against the design: shorts, breaks, gaps, slivers.
    Prove(prove::ProveArgs),
    /// Plan milling and drilling of a whole board and write its programs.
    Cam(cam::CamArgs),
    /// Write a program for a controller.
    Export(export::ExportArgs),
    /// List blocks and parameters of postprocessors, print a built-in one, or check your own.
    Templates(templates::TemplatesArgs),
    /// Compute the step stream and its duration.
    Simulate(simulate::SimulateArgs),
    /// Probe the board on a grid and save its height map, for `run --height-map saved`.
    Level(Box<level::LevelArgs>),
    /// Run a job on a machine: at its controller, its card or adapter, or on the virtual drill.
    Run(Box<run::RunArgs>),
    /// List the serial ports of this computer.
    Ports,
    /// Work with a GRBL controller at a serial port: ports, info, check, level, run, resume.
    Grbl(grbl::GrblArgs),
    /// Show or flash the firmware of the USB step adapter: info, flash.
    Firmware(firmware::FirmwareArgs),
    /// Check or run a queue of work commands.
    Queue(queue::QueueArgs),
    /// Serve the page on this computer (the default).
    Serve(serve::ServeArgs),
    /// Print a new one-time address for a running bridge.
    Link(link::LinkArgs),
    /// List the known machines, or choose the one for all commands: use.
    Machines(machines::MachinesArgs),
    /// List the tools of a machine and their wear, or reset it: list, reset.
    Tools(tools::ToolsArgs),
    /// Compute motion for a report, or check files of expected numbers.
    Lab(lab::LabArgs),
    /// Check this computer: folders, ports, timing.
    Doctor(doctor::DoctorArgs),
    /// Print the completions for your shell.
    Completions(completions::CompletionsArgs),
    /// Write the manual pages, one per command.
    Man(completions::ManArgs),
    /// Generate pulses for the bridge, which starts this command.
    #[command(hide = true)]
    Executor,
}

/// How to read a job: shared by every command that takes one.
#[derive(Debug, Clone, Args)]
pub(crate) struct JobArgs {
    /// Read the job from a drill file, folder, zip, saved project, or a program written by `plan -o`.
    #[arg(value_name = "JOB")]
    pub(crate) job: PathBuf,
    #[command(flatten)]
    pub(crate) reading: ReadingArgs,
    #[command(flatten)]
    pub(crate) on: MachineArgs,
    /// Choose the order of the holes.
    #[arg(long, value_enum, default_value_t = Order::Shortest)]
    pub(crate) order: Order,
    /// Choose the order of the tools.
    #[arg(long, value_enum, default_value_t = Group::Ascending)]
    pub(crate) group: Group,
    /// Set the diameter of the tool in the spindle, in mm, for `--group loaded-first`.
    #[arg(long = "loaded", value_name = "MM")]
    pub(crate) loaded_mm: Option<f64>,
    /// Drill only: leave out slots and holes without a matching drill, which are milled by default.
    #[arg(long)]
    pub(crate) no_mill: bool,
    /// Drill with these spindles, for example 1,2 [default: all of the machine].
    #[arg(long, value_delimiter = ',', value_name = "N")]
    pub(crate) spindles: Vec<u8>,
    /// Accept these errors and problems, by code.
    #[arg(long, value_delimiter = ',', value_name = "CODE")]
    pub(crate) accept: Vec<String>,
    /// Set the seed of the search.
    #[arg(long, default_value_t = annulus_core::cam::SEED)]
    pub(crate) seed: u64,
    /// Limit the search to this many iterations [default: about one second, by the number of holes].
    #[arg(long)]
    pub(crate) iterations: Option<u64>,
}

/// The machine of a job.
#[derive(Debug, Clone, Default, Args)]
pub(crate) struct MachineArgs {
    /// Use this machine: a preset's name (hobby is a small router) or a machine file [default: the one of
    /// `annulus machines use`, else virtual].
    #[arg(short, long, value_name = "NAME|FILE")]
    machine: Option<String>,
}

impl MachineArgs {
    /// The named machine, else the one that `annulus machines use` chose, else the virtual drill.
    pub(crate) fn name(&self) -> &str {
        match (&self.machine, machine_file::chosen()) {
            (Some(name), _) => name,
            (None, Some(name)) => name,
            (None, None) => machine::VIRTUAL,
        }
    }

    /// Where the machine comes from, as in JSON.
    pub(crate) fn origin(&self) -> &'static str {
        match (&self.machine, machine_file::chosen()) {
            (Some(_), _) => "flag",
            (None, Some(_)) => "chosen",
            (None, None) => "default",
        }
    }

    /// Returns `true` if the virtual drill was named.
    pub(crate) fn is_virtual(&self) -> bool {
        self.machine.as_deref() == Some("virtual")
    }

    /// A note that `machine` was assumed, if none was named or chosen.
    pub(crate) fn assumed(&self, machine: &Machine) -> Option<Diagnostic> {
        let note = note!("cli.machine_assumed", machine = &machine.name);
        (self.origin() == "default").then_some(note)
    }
}

/// Overrides of the number format of a drill file.
#[derive(Debug, Clone, Default, Args)]
pub(crate) struct ReadingArgs {
    /// Ignore the other files in the folder of a requested file.
    #[arg(long = "ignore-siblings", alias = "alone")]
    pub(crate) alone: bool,
    /// Set the units of the coordinates.
    #[arg(long, value_enum)]
    pub(crate) units: Option<Units>,
    /// Set the digits before and after the decimal point, for example 2.4.
    #[arg(long = "format", alias = "digits", value_name = "I.D")]
    pub(crate) digits: Option<String>,
    /// Set which zeros are left out of the coordinates.
    #[arg(long = "suppress-zeros", alias = "zeros", value_enum)]
    pub(crate) zeros: Option<Zeros>,
    /// Move holes and outline onto the copper if their zero points differ. By default they stay in place, and
    /// the difference is reported.
    #[arg(long = "align-layers", alias = "align")]
    pub(crate) align: bool,
    /// Choose one of several boards, by its name in the output of `inspect`.
    #[arg(long, value_name = "NAME")]
    pub(crate) board: Option<String>,
    /// Set the role of a layer: top-copper, bottom-copper, inner-copper, top-mask, bottom-silk, top-paste,
    /// outline or other. FILE is its name in the output of `inspect`, or the end of its path. Repeatable.
    #[arg(long = "role", value_name = "FILE=ROLE")]
    pub(crate) roles: Vec<String>,
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
    /// Leading zeros.
    Leading,
    /// Trailing zeros.
    Trailing,
    /// None.
    None,
}

/// Order of the holes of one tool.
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

/// Order of the tools.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Group {
    /// Small before large.
    Ascending,
    /// The loaded tool first, then ascending.
    LoadedFirst,
}

/// The result of a command, as JSON and as text.
pub(crate) struct Answer {
    /// The JSON object, without `ok`; null if the command has already printed everything.
    pub(crate) object: Value,
    /// The text output.
    pub(crate) text: String,
    /// Exit code. Content that is refused gives 1 even with an answer.
    pub(crate) exit: Exit,
}

impl Answer {
    /// The answer with a report, and the same as text.
    fn new(report: &impl Serialize, text: String) -> Self {
        Self { object: serde_json::to_value(report).unwrap_or_default(), text, exit: Exit::Done }
    }

    /// Adds the machine that was used, and where that choice comes from.
    fn on(mut self, on: &MachineArgs, machine: &Machine) -> Self {
        if let Value::Object(report) = &mut self.object {
            report.entry("machine").or_insert_with(|| json!(on.name()));
            report.insert("machine_from".to_owned(), json!(on.origin()));
        }
        // The note of an assumed machine says it already.
        if !self.text.contains("(cli.machine_assumed)") {
            let key = format!("cli.report.machine_{}", on.origin());
            self.text += &(sentence(&key, &[("machine", &machine.name)]) + "\n");
        }
        self
    }

    /// Adds an error, if any: to the JSON object as in a refusal, and as the last line of the text.
    fn with_error(mut self, why: impl Into<Option<Diagnostic>>) -> Self {
        let Some(why) = why.into() else { return self };
        let refusal = Refusal::content(why);
        self.object["error"] = refusal.object()["error"].take();
        self.text += &format!("{refusal}\n");
        Self { exit: Exit::Content, ..self }
    }
}

/// Rounds to six decimals, as documented; never a negative zero.
fn rounded(value: f64) -> f64 {
    (value * 1e6).round() / 1e6 + 0.0
}

fn mm(length: Length) -> f64 {
    rounded(length.mm())
}

/// The text of `key`.
fn sentence(key: &str, args: &[(&str, &dyn Display)]) -> String {
    let args: Vec<_> = args.iter().map(|(name, value)| ((*name).to_owned(), value.to_string())).collect();
    locale::text("en", key, &args)
}

/// Shape and sizes of a tool. Only V-bits have tip and angle.
#[derive(Clone, Serialize)]
struct ToolReport {
    form: &'static str,
    diameter_mm: f64,
    angle_deg: Option<f64>,
    tip_mm: Option<f64>,
    name: String,
}

impl ToolReport {
    fn of(bit: &Bit) -> Self {
        let (form, tip, angle_mdeg) = match bit.cutter {
            Cutter::Drill => ("drill", None, None),
            Cutter::Mill => ("mill", None, None),
            Cutter::Vee { tip, angle_mdeg } => ("vee", Some(tip), Some(angle_mdeg)),
        };
        let angle_deg = angle_mdeg.map(|angle| rounded(f64::from(angle) / 1e3));
        let (diameter_mm, tip_mm) = (mm(bit.diameter), tip.map(mm));
        Self { form, diameter_mm, angle_deg, tip_mm, name: bit.title(locale::FALLBACK) }
    }
}

/// Diagnostics as JSON.
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

/// The same as a field of a report.
fn as_objects<S: Serializer>(diagnostics: &[Diagnostic], to: S) -> Result<S::Ok, S::Error> {
    diagnostic_objects(diagnostics).serialize(to)
}

/// Diagnostics as text, one per line.
fn diagnostic_lines(diagnostics: &[Diagnostic]) -> String {
    let line = |diagnostic: &Diagnostic| {
        let place = diagnostic.place.as_ref().filter(|place| place.line > 0);
        let at = place.map_or(String::new(), |place| format!("{}:{}: ", place.file, place.line));
        format!("- {at}{} {} ({})\n", diagnostic.message("en"), diagnostic.advice("en"), diagnostic.code)
    };
    diagnostics.iter().filter(|one| verbosity::is_shown(one)).map(line).collect()
}

/// Reads the command line, runs the command and prints the result.
pub(crate) fn main() -> ExitCode {
    let words = old_flags::joined(std::env::args_os());
    let parsed = help::command().color(verbosity::asked_color(&words)).try_get_matches_from(&words);
    match parsed.and_then(|mut found| Arguments::from_arg_matches_mut(&mut found)) {
        Ok(arguments) => {
            verbosity::choose(&arguments);
            tell(&old_flags::notes(&words));
            run(arguments)
        }
        Err(error) => explain(&error),
    }
}

/// Prints help, version or wrong usage; wrong usage also as JSON if requested.
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
        let refusal = Refusal::usage(error!("cli.usage", what = first));
        return ended(refusal.exit, print(format_args!("{}\n", refusal.object())));
    }
    Exit::Usage.into()
}

/// Prints to standard output.
fn print(text: impl Display) -> io::Result<()> {
    let mut out = io::stdout().lock();
    write!(out, "{text}")?;
    out.flush()
}

/// Prints a line to standard error. A closed pipe is ignored.
pub(crate) fn say(line: impl Display) {
    let _ = writeln!(io::stderr().lock(), "{line}");
}

/// Prints messages to standard error, without their advice. `--quiet` leaves out notes.
fn tell(messages: &[Diagnostic]) {
    let shown = messages.iter().filter(|message| verbosity::is_shown(message));
    shown.for_each(|message| say(message.message("en")));
}

/// A count with its noun in the right number: `1 hole`, `2 holes`.
pub(crate) fn counted(count: impl Into<u64>, one: &str) -> String {
    let count = count.into();
    if count == 1 { format!("1 {one}") } else { format!("{count} {one}s") }
}

/// Exit code after printing. A closed pipe (`annulus … | head`) is no error; a full disk is.
fn ended(exit: Exit, printed: io::Result<()>) -> ExitCode {
    match printed {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            let why = error!("cli.not_printed", reason = error);
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
        // The command has already printed everything.
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
            say(verbosity::in_red(&refusal));
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
        Some(Command::Export(args)) if args.is_of_board() => export_board::run(&args),
        Some(Command::Export(args)) => export::run(&args),
        Some(Command::Templates(args)) => templates::run(&args),
        Some(Command::Simulate(args)) => simulate::run(&args),
        Some(Command::Level(args)) => level::run(&args, json),
        Some(Command::Run(args)) => run::run(&args, json),
        Some(Command::Ports) => Ok(grbl::ports()),
        Some(Command::Grbl(args)) => grbl::run(&args, json),
        Some(Command::Firmware(args)) => firmware::run(&args),
        Some(Command::Queue(args)) => queue::run(&args),
        Some(Command::Serve(args)) => serve::run(&args, json),
        Some(Command::Link(args)) => link::run(&args),
        Some(Command::Machines(args)) => machines::run(&args),
        Some(Command::Tools(args)) => tools::run(&args),
        Some(Command::Lab(args)) => lab::run(&args, json),
        Some(Command::Doctor(args)) => doctor::run(&args),
        Some(Command::Completions(args)) => Ok(completions::run(&args)),
        Some(Command::Man(args)) => completions::write_manual(&args),
        Some(Command::Executor) => executor::run(),
        None => serve::run(&serve::ServeArgs { is_default: true, ..serve::ServeArgs::default() }, json),
    }
}
