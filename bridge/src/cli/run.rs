//! Runs a job on a machine: at its controller, at its own output, or on the virtual drill. Resumes an
//! interrupted job of the same program.

mod answer;
mod attended;

pub(super) use self::answer::lost;
use self::attended::Zero;
pub(super) use self::attended::{may_move_real, typed_line, typed_lines};
use super::dry_run::{self, DryRun};
use super::grbl::how::{Place, place};
use super::{Answer, Exit, Refusal, counted, grbl, job, verbosity};
use crate::drill::{Drill, RECORD};
use crate::hosted::Hosted;
use crate::machine_file;
use crate::signals::Signals;
use annulus_core::control::{Ending, State};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::geometry::Point;
use annulus_core::job::{Bit, Mark};
use annulus_core::level::{key_of, same_job};
use annulus_core::machine::{self, Lengths, Machine, Output};
use annulus_core::magazine::{Held, laid_out};
use annulus_core::sim;
use annulus_core::virtual_drill::faults;
use annulus_core::wire::{ArmedJob, Ask, InterruptedJob, JobEnd, RowVerdict, Status, Tell, program};
use annulus_core::{code, error, note, warning};
use indicatif::{HumanDuration, ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::time::{Duration, Instant};
use tokio::runtime::Runtime;
use tokio::sync::mpsc::{Receiver, UnboundedReceiver};

/// Arguments of `annulus run`.
#[derive(Debug, clap::Args)]
pub(crate) struct RunArgs {
    #[command(flatten)]
    at: grbl::RunArgs,
    /// Play the job of another machine on the virtual drill. The machine itself does not move.
    #[arg(long, conflicts_with = "port")]
    rehearse: bool,
    /// Inject a fault of the virtual drill, from a number of holes on: NAME or NAME@HOLES; see the manual.
    #[arg(long, value_name = "NAME[@HOLES]", conflicts_with = "port")]
    fault: Vec<String>,
    /// Assume that the magazine holds the tools of the job, in order of their use, and that the spindle is
    /// empty.
    #[arg(long = "assume-magazine-loaded", alias = "load-magazine", conflicts_with = "port")]
    load_magazine: bool,
}

impl RunArgs {
    fn job(&self) -> &super::JobArgs {
        &self.at.board.job
    }

    fn play(&self) -> PlayArgs {
        let how = &self.at.board.how;
        PlayArgs {
            job: self.job().clone(),
            speed: how.speed,
            fault: self.fault.clone(),
            confirm_tools: how.confirm_tools.unwrap_or_default(),
            same_length: how.same_length,
        }
    }

    /// What continues after a tool change on this driver.
    fn change(&self, driver: Driver) -> ToolChanges {
        match self.at.board.how.confirm_tools {
            Some(wait) => ToolChanges::After(wait),
            None if driver.is_real() => ToolChanges::Asked,
            None => ToolChanges::After(Duration::ZERO),
        }
    }
}

/// What drives a machine.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Driver {
    /// The controller at the port.
    Controller,
    /// The output of the machine itself: a card, a parallel port or an adapter. The machine moves.
    Own(Output),
    /// The virtual drill. `rehearsal` is set if it plays the job of another machine.
    Virtual { rehearsal: bool },
}

impl Driver {
    /// Its name in JSON, and in every line that reports drilled holes.
    const fn names(self) -> [&'static str; 2] {
        match self {
            Self::Controller => ["controller", "Controller"],
            Self::Own(output) => output.names(),
            Self::Virtual { rehearsal: true } => ["virtual_drill", "Rehearsal on the virtual drill"],
            Self::Virtual { .. } => Output::Virtual.names(),
        }
    }
}

/// Who continues after a manual tool change.
#[derive(Clone, Copy, Debug, PartialEq)]
enum ToolChanges {
    /// The command, after this time.
    After(Duration),
    /// The user at the terminal. Without a terminal, the job ends.
    Asked,
}

/// Refuses a machine with its own controller if only the virtual drill can be driven.
fn own_controller(name: &str) -> Result<(), Refusal> {
    let preset = machine::preset_name(name);
    let has_own = machine::mill(preset).is_some() || preset == "3018";
    if has_own { Err(grbl::no_port(Some(preset))) } else { Ok(()) }
}

/// The named machine, which Annulus drives itself.
pub(super) fn own_machine(name: &str) -> Result<machine_file::Known, Refusal> {
    own_controller(name)?;
    machine_file::named(name)
}

/// A runtime for one command, and the signals that interrupt it.
pub(super) fn runtime() -> Result<(Runtime, Signals), Refusal> {
    let refused = |error: std::io::Error| Refusal::surroundings(error!("run.no_runtime", reason = error));
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().map_err(refused)?;
    let signals = runtime.block_on(async { Signals::new() }).map_err(refused)?;
    Ok((runtime, signals))
}

/// The driver of the named machine; an error if it can't be driven from the command line.
fn driver(args: &RunArgs) -> Result<Driver, Refusal> {
    let (how, name) = (&args.at.board.how, args.job().on.name());
    let known = machine_file::named(name)?;
    let output = known.machine.output;
    if let Some(port) = how.port.port.as_ref().filter(|_| output != Output::Adapter) {
        return grbl::no_controller(&args.job().on, Some(port)).map(|()| Driver::Controller);
    }
    if args.rehearse {
        return only_virtual(args).map(|()| Driver::Virtual { rehearsal: true });
    }
    let is_gcode = grbl::program::is_gcode(&args.job().job);
    // A dry run needs no port.
    if how.dry_run && (is_gcode || own_controller(name).is_err()) {
        return Ok(Driver::Controller);
    }
    own_controller(name)?;
    if is_gcode {
        return Err(grbl::no_port(None));
    }
    if output != Output::Virtual {
        return attended::may_run(args, &known.machine).map(|()| Driver::Own(output));
    }
    // A preset of a real machine that has no wiring yet.
    let is_unwired = name != "virtual" && machine::preset(name).is_some() && !known.path.is_file();
    if is_unwired {
        return Err(Refusal::usage(error!("run.no_output", machine = &known.machine.name)));
    }
    only_virtual(args).map(|()| Driver::Virtual { rehearsal: false })
}

/// Refuses options that need a controller.
fn only_virtual(args: &RunArgs) -> Result<(), Refusal> {
    let mut flags = args.at.board.how.of_controller().filter(|flag| *flag != "--equal-tool-lengths");
    match flags.next().or(other_of_controller(args)) {
        Some(flag) => Err(Refusal::usage(error!("run.needs_controller", flag = flag))),
        None => Ok(()),
    }
}

/// The other arguments that need a controller.
fn other_of_controller(args: &RunArgs) -> Option<&'static str> {
    let measures = (args.at.height_map() == Some(grbl::WhichMap::Measure)).then_some("--height-map measure");
    measures.or((!args.at.board.more.is_empty()).then_some("PROGRAM"))
}

/// Options for a board that may be interrupted.
#[derive(Clone, Copy)]
struct BoardHow<'a> {
    /// Follow the saved height map.
    level: bool,
    /// Start from the beginning even if it was interrupted.
    from_start: bool,
    /// The magazine of this machine holds its tools.
    loads: Option<&'a Machine>,
    /// The work zero of a real machine.
    zero: Option<Zero>,
}

/// A job for the drill of this computer, and how to play it.
#[derive(Debug, clap::Args)]
pub(crate) struct PlayArgs {
    #[command(flatten)]
    pub(crate) job: super::JobArgs,
    /// Run the virtual drill this many times faster than real time.
    #[arg(long = "time-scale", alias = "speed", default_value_t = 1.0, value_parser = super::numbers::speed)]
    pub(crate) speed: f64,
    /// Inject a fault of the virtual drill, from a number of holes on: NAME or NAME@HOLES; see the manual.
    #[arg(long, value_name = "NAME[@HOLES]")]
    pub(crate) fault: Vec<String>,
    /// Confirm each tool change after SECONDS. The virtual drill needs no time.
    #[arg(long = "unattended-tool-change", alias = "confirm-tools", value_name = "SECONDS", default_value = "0", value_parser = super::numbers::seconds, allow_hyphen_values = true)]
    pub(crate) confirm_tools: Duration,
    /// Declare that every tool has the same length, on a machine that measures each tool after its change.
    #[arg(long = "equal-tool-lengths", alias = "same-length")]
    pub(crate) same_length: bool,
}

/// Options of a machine that Annulus drives itself and that is not the virtual drill.
#[derive(Debug, clap::Args)]
pub(crate) struct RealArgs {
    /// Set the work zero of a real machine in machine coordinates, in mm [default: the saved one].
    #[arg(long, value_name = "X,Y", value_parser = place, allow_hyphen_values = true)]
    pub(super) zero_at: Option<Place>,
    /// Move a real machine without a question.
    #[arg(long)]
    yes: bool,
}

pub(crate) fn run(args: &RunArgs, json: bool) -> Result<Answer, Refusal> {
    match driver(args)? {
        Driver::Controller => grbl::run_job(&args.at, json),
        driver => drill(args, driver, json),
    }
}

fn drill(args: &RunArgs, driver: Driver, json: bool) -> Result<Answer, Refusal> {
    let wanted = args.job();
    let mut known = machine_file::named(wanted.on.name())?;
    if let Some(port) = &args.at.board.how.port.port {
        known.machine.adapter.port.clone_from(port);
    }
    if driver == (Driver::Virtual { rehearsal: true }) {
        known.machine = virtual_of(known.machine);
    }
    job::can_be_accepted(&wanted.accept)?;
    let mut job = job::open_for_machine(wanted)?;
    if args.at.board.how.dry_run {
        return dry(args, driver, &known.machine, job);
    }
    super::tell(&job.diagnostics);
    if let Some(why) = args.at.board.how.unattended() {
        super::say(format_args!("{} {}", why.message("en"), why.advice("en")));
    } else if !driver.is_real() {
        super::tell(&[note!("run.changes_confirmed")]);
    }
    let low = job::low_corner(&job.program);
    let folder = machine_file::data_folder();
    let zero = driver.is_real().then(|| Zero::of(args.at.board.how.zero_at, &known.machine)).transpose()?;
    let loads = args.load_magazine.then_some(&known.machine);
    let how = BoardHow { level: args.at.height_map().is_some(), from_start: args.at.from_start, loads, zero };
    job.program.machine = known.machine.fingerprint();
    let (drill, operator, runtime) = opened(&args.play(), (&known, driver), how.level, json)?;
    let operator = Operator { changes: args.change(driver), says_yes: args.at.board.how.yes, ..operator };
    let bytes = program::encode(&job.program);
    let level_key = key_of(&job.program);
    let played = runtime.block_on(operator.drill_all((&bytes, &level_key), low, &wanted.accept, how));
    drill.shutdown();
    let mut answer = played?;
    answer.text += &format!("Drilled-board record: {}\n", folder.join(RECORD).display());
    Ok(answer.on(&wanted.on, &known.machine))
}

/// What the job would move on the drill of this computer.
fn dry(args: &RunArgs, driver: Driver, machine: &Machine, job: job::Job) -> Result<Answer, Refusal> {
    let how = &args.at.board.how;
    let zero = match driver {
        Driver::Virtual { .. } => dry_run::Zero::Homed,
        _ => Zero::of(how.zero_at, machine).map(|_| dry_run::Zero::of(how.zero_at, how.zero_here))?,
    };
    let changes = job.program.legs.iter().filter(|leg| matches!(leg.mark, Mark::ToolChange(_))).count();
    Ok(DryRun {
        holes: job.program.hole_count(),
        toolpaths: job.program.toolpath_count(),
        time_s: sim::times_s(&job.program, machine).ok().map(|(total_s, _)| total_s),
        tool_changes: changes,
        zero,
        diagnostics: job.diagnostics,
        ..DryRun::on(Some(machine.name.clone()), driver.names()[0], how.port.port.clone())
    }
    .answer())
}

/// The machine with the virtual drill as its output.
fn virtual_of(machine: Machine) -> Machine {
    Machine { output: Output::Virtual, ..machine }
}

/// Settings that a flag replaces for one run.
const OF_ONE_RUN: [&str; 2] = ["change.lengths", "adapter.port"];

/// Opens the drill of this computer and its operator. Jobs follow the saved height map, or none.
fn opened(
    args: &PlayArgs,
    (known, driver): (&machine_file::Known, Driver),
    level: bool,
    json: bool,
) -> Result<(Drill, Operator, Runtime), Refusal> {
    let faults = faults::read(args.fault.iter().map(String::as_str)).map_err(Refusal::usage)?;
    let (runtime, signals) = runtime()?;
    let open = if level { Drill::open_with } else { Drill::open_flat };
    let mut machine = known.machine.clone();
    if args.same_length {
        machine.change.lengths = Lengths::Equal;
    }
    let drill = open(&machine_file::data_folder(), machine, args.speed, faults)?;
    if driver != (Driver::Virtual { rehearsal: true }) {
        let of_file = machine_file::named(args.job.on.name())?.machine;
        let value = |key: &str| Some((key.to_owned(), machine::setting(key)?.value(&of_file)));
        let unchanged = OF_ONE_RUN.into_iter().filter_map(value).collect();
        drill.keep_settings_but(known.path.clone(), unchanged);
    }
    let operator = Operator::new(&drill, signals, json, (args, known, driver));
    Ok((drill, operator, runtime))
}

/// Probes the board as in `ask`, and saves the map. The work zero of the virtual drill is at its corner.
pub(super) fn touch(
    args: &PlayArgs,
    real: &RealArgs,
    (low, ask): (Point, Ask),
    json: bool,
) -> Result<Answer, Refusal> {
    let name = args.job.on.name();
    let known = own_machine(name)?;
    let driver = match known.machine.output {
        Output::Virtual => Driver::Virtual { rehearsal: false },
        output => Driver::Own(output),
    };
    let zero = if driver.is_real() {
        attended::may_move_real(name, real.yes, &args.fault)?;
        Some(Zero::of(real.zero_at, &known.machine)?)
    } else {
        None
    };
    let (drill, operator, runtime) = opened(args, (&known, driver), true, json)?;
    let operator = Operator { says_yes: real.yes, ..operator };
    let touched = runtime.block_on(operator.touch((low, zero), ask, &args.job.accept));
    drill.shutdown();
    touched
}

/// Acts for the user at the machine.
struct Operator {
    drill: Drill,
    /// SHA-256 of the job's program.
    key: String,
    tells: Receiver<Tell>,
    bar: ProgressBar,
    signals: Signals,
    /// A signal arrived.
    interrupted: bool,
    /// What continues after a tool change.
    changes: ToolChanges,
    /// Why a tool change ended the job.
    unchanged: Option<Diagnostic>,
    /// When the current tool was requested.
    asked: Option<Instant>,
    driver: Driver,
    machine: Machine,
    /// Tools of the program.
    bits: Vec<Bit>,
    /// The user has answered every question in advance.
    says_yes: bool,
    /// Lines typed at the terminal of a real machine.
    lines: Option<UnboundedReceiver<String>>,
    /// The last typed line.
    typed: Option<String>,
}

impl Operator {
    fn new(
        drill: &Drill,
        signals: Signals,
        json: bool,
        (args, known, driver): (&PlayArgs, &machine_file::Known, Driver),
    ) -> Self {
        let shown = std::io::stderr().is_terminal() && !json && !verbosity::is_quiet();
        let bar = if shown { ProgressBar::new(0) } else { ProgressBar::hidden() };
        let on = if driver.is_real() { "" } else { " on the virtual drill" };
        let style = format!("{{bar:40}} {{pos}}/{{len}} holes and toolpaths{on}  {{msg}}");
        if let Ok(style) = ProgressStyle::with_template(&style) {
            bar.set_style(style);
        }
        Self {
            drill: drill.clone(),
            key: String::new(),
            tells: drill.watch(),
            bar,
            signals,
            interrupted: false,
            changes: ToolChanges::After(args.confirm_tools),
            unchanged: None,
            asked: None,
            driver,
            machine: known.machine.clone(),
            bits: Vec::new(),
            says_yes: false,
            lines: if driver.is_real() { typed_lines() } else { None },
            typed: None,
        }
    }

    fn ask(&self, ask: Ask) -> Result<Vec<Tell>, Refusal> {
        self.drill.ask(ask).map_err(Refusal::content)
    }

    fn status(&self) -> Option<Status> {
        self.drill.greeting().into_iter().find_map(status_of)
    }

    /// Refuses to start with an old alarm that the user has not accepted; acknowledges an accepted one.
    fn may_begin(&self, accept: &[String]) -> Result<(), Refusal> {
        let Some(alarm) = self.status().and_then(|status| status.alarm) else { return Ok(()) };
        if !accept.contains(&alarm.code) {
            return Err(Refusal::content(alarm));
        }
        super::say(format_args!("{} {}", alarm.message("en"), alarm.advice("en")));
        self.ask(Ask::AcknowledgeAlarm).map(drop)
    }

    async fn drill_all(
        mut self,
        (bytes, level_key): (&[u8], &str),
        low: Point,
        accept: &[String],
        how: BoardHow<'_>,
    ) -> Result<Answer, Refusal> {
        let key = program::key(bytes);
        self.key.clone_from(&key);
        self.bits = program::decode(bytes).map_err(Refusal::content)?.bits;
        self.drill.upload(&key, bytes).map_err(Refusal::content)?;
        self.may_begin(accept)?;
        let greeting = self.drill.greeting();
        if let Some(machine) = how.loads {
            let known = greeting.iter().find_map(|tell| match tell {
                Tell::Tools(report) => Some(report.wear.as_slice()),
                _ => None,
            });
            let places = laid_out(&self.bits, machine, known.unwrap_or_default());
            self.ask(Ask::Stock { places, spindle: Held::Nothing })?;
        }
        if how.level {
            follows(&greeting, level_key)?;
        }
        let interrupted = interrupted(greeting).filter(|_| !how.from_start);
        let offer = interrupted.as_ref().filter(|offer| offer.job == key);
        if let Some(zero) = &how.zero {
            self.may_move(zero, (interrupted.as_ref(), offer), &warning!("run.homes")).await?;
        }
        if let Some(answer) = self.home().await? {
            return Ok(answer);
        }
        let from_leg = match (offer, how.zero) {
            (Some(offer), _) => {
                let ([_, driver], done) = (self.driver.names(), done(offer.holes_done, offer.toolpaths_done));
                super::say(format_args!(
                    "{driver}: this job was interrupted after {done}. It continues there."
                ));
                offer.next_leg
            }
            (None, Some(zero)) => {
                self.set_zero(zero).await?;
                0
            }
            (None, None) => {
                self.make_room(low).await?;
                self.ask(Ask::SetZero)?;
                0
            }
        };
        let digest = self.arm(&key, from_leg).await?;
        self.ask(Ask::Start { job: key.clone(), stream_digest: digest.clone(), from_leg })?;
        let (ending, done) = self.until_ended(&key).await;
        self.bar.finish_and_clear();
        let rested = self.settle().await;
        Ok(self.answer(ending, done, &digest, &rested))
    }

    /// Homes. Returns an answer if the command ends here.
    async fn home(&mut self) -> Result<Option<Answer>, Refusal> {
        self.ask(Ask::Home)?;
        let homed = self.settle().await;
        let is_over = self.interrupted || homed.state != State::Ready;
        Ok(is_over.then(|| self.answer(ending_of(&homed), (0, 0), "", &homed)))
    }

    /// Probes the board and returns the saved map.
    async fn touch(
        mut self,
        (low, zero): (Point, Option<Zero>),
        ask: Ask,
        accept: &[String],
    ) -> Result<Answer, Refusal> {
        self.may_begin(accept)?;
        if let Some(zero) = &zero {
            self.may_move(zero, (None, None), &warning!("level.moves")).await?;
        }
        if let Some(answer) = self.home().await? {
            return Ok(answer);
        }
        match zero {
            Some(zero) => self.set_zero(zero).await?,
            None => {
                self.make_room(low).await?;
                self.ask(Ask::SetZero)?;
            }
        }
        let begun_s = if let Ask::Survey { now_s, .. } = ask { now_s } else { 0 };
        self.ask(ask)?;
        let rested = self.settle().await;
        if self.interrupted || rested.alarm.is_some() {
            return Ok(self.answer(ending_of(&rested), (0, 0), "", &rested));
        }
        match self.drill.map().filter(|map| map.measured_s == begun_s) {
            Some(map) => Ok(Answer {
                object: super::height_map::object(&map),
                text: super::height_map::text(&map),
                exit: Exit::Done,
            }),
            None => Err(Refusal::content(error!("level.stopped"))),
        }
    }

    /// Jogs away from the machine's corner, so that positions below the work zero are in the range.
    async fn make_room(&mut self, low: Point) -> Result<(), Refusal> {
        for (axis, low) in [(0, low.x), (1, low.y)] {
            let below_um = (999 - low.nm()) / 1_000;
            if below_um > 0 {
                let distance_um = i32::try_from(below_um).unwrap_or(i32::MAX);
                self.ask(Ask::Jog { axis, distance_um, anyway: false })?;
                self.settle().await;
            }
        }
        Ok(())
    }

    /// Arms the job, to start at `from_leg`. The first failed check refuses it. On a real machine, the user
    /// confirms the warnings.
    async fn arm(&mut self, key: &str, from_leg: u32) -> Result<String, Refusal> {
        for tell in self.ask(Ask::Arm { job: key.to_owned(), from_leg })? {
            if let Tell::Armed(ArmedJob { stream_digest, checks, levelled, .. }) = tell {
                if self.driver.is_real() {
                    self.confirm_warnings(&checks).await?;
                }
                if let Some(row) =
                    checks.iter().find(|row| levelled && row.finding.code == code!("level.follows"))
                {
                    super::say(row.finding.message("en"));
                }
                let failed = checks.into_iter().find(|row| row.verdict == RowVerdict::Fail);
                return failed.map_or(Ok(stream_digest), |row| Err(Refusal::content(row.finding)));
            }
        }
        Err(Refusal::content(error!("control.not_armed")))
    }

    /// Returns the next message. The first signal stops the drill.
    async fn next(&mut self) -> Option<Tell> {
        tokio::select! {
            tell = self.tells.recv() => {
                // A probe that fails reports it here.
                if let (true, Some(Tell::Refused { why })) = (self.driver.is_real(), &tell) {
                    self.tell(why);
                }
                tell
            }
            line = typed_line(&mut self.lines) => {
                self.typed = line;
                self.status().map(|status| Tell::Status(Box::new(status)))
            }
            _ = self.signals.wait() => {
                if !self.interrupted {
                    self.interrupted = true;
                    super::say("Stopping.");
                    let _ = self.drill.ask(Ask::Stop);
                }
                self.status().map(|status| Tell::Status(Box::new(status)))
            }
        }
    }

    /// Waits until the drill is stopped.
    async fn settle(&mut self) -> Status {
        loop {
            if let Some(status) = self.status()
                && matches!(status.state, State::Ready | State::NotHomed | State::Alarm | State::ToolChange)
                && status.spindle_rpm == 0
            {
                return status;
            }
            // A jog continues only while it is renewed.
            let _ = self.drill.ask(Ask::JogOn);
            let _ = tokio::time::timeout(Duration::from_millis(20), self.next()).await;
        }
    }

    /// Confirms tools and shows the progress until the job ends.
    async fn until_ended(&mut self, key: &str) -> (Ending, (u32, u32)) {
        loop {
            match self.next().await {
                Some(Tell::Ended(JobEnd { job, ending, holes_done, toolpaths_done })) if job == *key => {
                    return (ending, (holes_done, toolpaths_done));
                }
                Some(Tell::Status(status)) => {
                    match self.changes {
                        ToolChanges::After(wait) => self.change_after(wait, status.state),
                        ToolChanges::Asked => self.change_asked().await,
                    }
                    // A redrawn bar would hide what the user types.
                    if status.state == State::ToolChange {
                        continue;
                    }
                    self.bar.set_length(u64::from(status.holes_total) + u64::from(status.toolpaths_total));
                    self.bar.set_position(u64::from(status.holes_done) + u64::from(status.toolpaths_done));
                    let left = Duration::from_secs_f64(status.left_s.max(0.0));
                    self.bar.set_message(format!("{} left", HumanDuration(left)));
                }
                Some(_) => {}
                None => return (Ending::Alarm, (0, 0)),
            }
        }
    }

    /// Confirms a tool when its time is over. Statuses arrive ten times a second.
    fn change_after(&mut self, wait: Duration, state: State) {
        if state != State::ToolChange {
            self.asked = None;
            return;
        }
        let since = *self.asked.get_or_insert_with(Instant::now);
        if since.elapsed() < wait {
            return;
        }
        match self.drill.ask(Ask::ToolChanged) {
            Ok(_) => {
                self.asked = None;
                super::say("The next tool is in. The job continues.");
            }
            // The tool can't be measured here. The job can be resumed.
            Err(why) if why.code == "control.length_first" => self.end_unchanged(why),
            Err(_) => {}
        }
    }
}

/// The job that was interrupted, if any.
fn interrupted(greeting: Vec<Tell>) -> Option<InterruptedJob> {
    greeting.into_iter().find_map(|tell| match tell {
        Tell::Interrupted(job) => Some(job),
        _ => None,
    })
}

/// Refuses if there is no height map of this job.
fn follows(greeting: &[Tell], level_key: &str) -> Result<(), Refusal> {
    let report = greeting.iter().find_map(|tell| match tell {
        Tell::HeightMap(report) if report.grid.is_some() => Some(report),
        _ => None,
    });
    match report {
        None => Err(Refusal::content(error!("level.none_kept"))),
        Some(report) if !same_job(&report.job, level_key) => Err(Refusal::content(error!("level.other_job"))),
        Some(_) => Ok(()),
    }
}

/// Text: the drilled holes and milled toolpaths.
fn done(holes: u32, toolpaths: u32) -> String {
    let drilled = counted(holes, "hole");
    if toolpaths == 0 { drilled } else { format!("{drilled} and {}", counted(toolpaths, "toolpath")) }
}

fn ending_of(status: &Status) -> Ending {
    if status.alarm.is_some() { Ending::Alarm } else { Ending::Stopped }
}

fn status_of(tell: Tell) -> Option<Status> {
    if let Tell::Status(status) = tell { Some(*status) } else { None }
}
