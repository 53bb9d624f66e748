//! Drills a job.
//!
//! Comes in: a job and a machine. Goes out: a drilled board, and how it ended. An interrupted job of the same program is
//! taken up where it was left. Does not know how anything moves.

use super::job;
use super::{Answer, Exit, Refusal, counted};
use crate::drill::{Drill, RECORD};
use crate::machine_file;
use crate::signals::Signals;
use annulus_core::control::{Ending, State};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::geometry::Point;
use annulus_core::level::{key_of, same_job};
use annulus_core::locale;
use annulus_core::machine::{Machine, Output, axis_name};
use annulus_core::magazine::{Held, laid_out};
use annulus_core::virtual_drill::faults;
use annulus_core::wire::{Ask, DrilledReport, RowVerdict, SlipReport, Status, Tell, program};
use indicatif::{HumanDuration, ProgressBar, ProgressStyle};
use serde_json::json;
use std::io::IsTerminal;
use std::time::{Duration, Instant};
use tokio::runtime::Runtime;
use tokio::sync::broadcast::{Receiver, error::RecvError};

/// Arguments of `annulus run`.
#[derive(Debug, clap::Args)]
pub(crate) struct RunArgs {
    #[command(flatten)]
    pub(crate) play: PlayArgs,
    /// Let depth follow the board: use the height map that `annulus level` kept.
    #[arg(long)]
    pub(crate) level: bool,
    /// The tools of the job lie in the places of the magazine, in the order of their use, and the spindle is empty: for a machine that
    /// changes its tools itself.
    #[arg(long)]
    pub(crate) load_magazine: bool,
    /// Begin anew even though this job was interrupted.
    #[arg(long)]
    pub(crate) from_start: bool,
}

/// What is asked of a board that may have been begun before.
#[derive(Clone, Copy)]
struct BoardHow<'a> {
    /// It follows the height map that was kept.
    level: bool,
    /// It is begun anew even though it was interrupted.
    from_start: bool,
    /// Its tools lie in the magazine of this machine.
    loads: Option<&'a Machine>,
}

/// What is played on the drill of this computer, and how.
#[derive(Debug, clap::Args)]
pub(crate) struct PlayArgs {
    #[command(flatten)]
    pub(crate) job: super::JobArgs,
    /// How many times faster than life the virtual drill runs.
    #[arg(long, default_value_t = 1.0, value_parser = speed)]
    pub(crate) speed: f64,
    /// Provoke a fault of the virtual drill, from so many holes on: NAME or NAME@HOLES; see the manual.
    #[arg(long, value_name = "NAME[@HOLES]")]
    pub(crate) fault: Vec<String>,
    /// Answer each tool change after so many seconds, as a person or a changer would. The virtual drill needs none.
    #[arg(long, value_name = "SECONDS", default_value = "0", value_parser = seconds, allow_hyphen_values = true)]
    pub(crate) confirm_tools: Duration,
}

/// A number of times; which of them can be, the drill says.
pub(super) fn speed(text: &str) -> Result<f64, String> {
    text.parse().map_err(|_| locale::text("en", "control.speed_words", &[]))
}

/// A time of at most a day.
pub(super) fn seconds(text: &str) -> Result<Duration, String> {
    const DAY_S: f64 = 86_400.0;
    let found = text.parse::<f64>().ok().filter(|seconds| (0.0..=DAY_S).contains(seconds));
    found.map(Duration::from_secs_f64).ok_or_else(|| format!("give seconds from 0 to {DAY_S}"))
}

/// Runs the command.
pub(crate) fn run(args: &RunArgs, json: bool) -> Result<Answer, Refusal> {
    let PlayArgs { job: wanted, .. } = &args.play;
    let known = machine_file::named(wanted.on.name())?;
    if known.machine.output != Output::Virtual {
        return Err(Refusal::usage(diagnostic("run.needs_page")));
    }
    job::can_be_accepted(&wanted.accept)?;
    let job = job::open_for_machine(wanted)?;
    for diagnostic in &job.diagnostics {
        super::say(diagnostic.message("en"));
    }
    let low = job::low_corner(&job.program);
    let folder = machine_file::data_folder();
    let loads = args.load_magazine.then_some(&known.machine);
    let how = BoardHow { level: args.level, from_start: args.from_start, loads };
    let (drill, operator, runtime) = opened(&args.play, how.level, json)?;
    let bytes = program::encode(&job.program);
    let level_key = key_of(&job.program);
    let played = runtime.block_on(operator.drill_all((&bytes, &level_key), low, &wanted.accept, how));
    drill.shutdown();
    let mut answer = played?;
    answer.text += &format!("Drilled-board record: {}\n", folder.join(RECORD).display());
    Ok(answer)
}

/// The drill of this computer, and who stands at it. Jobs follow the height map that was kept, or none.
fn opened(args: &PlayArgs, level: bool, json: bool) -> Result<(Drill, Operator, Runtime), Refusal> {
    let known = machine_file::named(args.job.on.name())?;
    if known.machine.output != Output::Virtual {
        return Err(Refusal::usage(diagnostic("run.needs_page")));
    }
    let faults = faults::read(args.fault.iter().map(String::as_str)).map_err(Refusal::usage)?;
    let no_runtime =
        |error: std::io::Error| Refusal::surroundings(diagnostic("run.no_runtime").with("reason", error));
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().map_err(no_runtime)?;
    let signals = runtime.block_on(async { Signals::new() }).map_err(no_runtime)?;
    let open = if level { Drill::open_with } else { Drill::open_flat };
    let drill = open(&machine_file::data_folder(), known.machine, args.speed, faults)?;
    drill.keep_settings_in(known.path);
    let operator = Operator::new(&drill, signals, json, args.confirm_tools);
    Ok((drill, operator, runtime))
}

/// Has the board touched as `ask` says, the machine's corner its work zero; the map is kept.
pub(super) fn touch(args: &PlayArgs, low: Point, ask: Ask, json: bool) -> Result<Answer, Refusal> {
    let (drill, operator, runtime) = opened(args, true, json)?;
    let touched = runtime.block_on(operator.touch(low, ask, &args.job.accept));
    drill.shutdown();
    touched
}

fn diagnostic(code: &str) -> Diagnostic {
    Diagnostic::error(code)
}

/// Stands in for the person at the machine.
struct Operator {
    drill: Drill,
    tells: Receiver<Tell>,
    bar: ProgressBar,
    signals: Signals,
    /// A signal came.
    interrupted: bool,
    /// How long a tool change takes.
    change: Duration,
    /// Since when one is waited for.
    asked: Option<Instant>,
}

impl Operator {
    fn new(drill: &Drill, signals: Signals, json: bool, change: Duration) -> Self {
        let shown = std::io::stderr().is_terminal() && !json;
        let bar = if shown { ProgressBar::new(0) } else { ProgressBar::hidden() };
        if let Ok(style) = ProgressStyle::with_template("{bar:40} {pos}/{len} holes and toolpaths  {msg}") {
            bar.set_style(style);
        }
        Self {
            drill: drill.clone(),
            tells: drill.watch(),
            bar,
            signals,
            interrupted: false,
            change,
            asked: None,
        }
    }

    fn ask(&self, ask: Ask) -> Result<Vec<Tell>, Refusal> {
        self.drill.ask(ask).map_err(Refusal::content)
    }

    fn status(&self) -> Option<Status> {
        self.drill.greeting().into_iter().find_map(status_of)
    }

    /// An alarm that stands from before is for a person to read. Only with their word is it acknowledged here.
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
        self.drill.upload(&key, bytes).map_err(Refusal::content)?;
        self.may_begin(accept)?;
        let greeting = self.drill.greeting();
        if let Some(machine) = how.loads {
            let known = greeting.iter().find_map(|tell| match tell {
                Tell::Tools(report) => Some(report.wear.as_slice()),
                _ => None,
            });
            let bits = program::decode(bytes).map_err(Refusal::content)?.bits;
            let places = laid_out(&bits, machine, known.unwrap_or_default());
            self.ask(Ask::Stock { places, spindle: Held::Nothing })?;
        }
        if how.level {
            follows(&greeting, level_key)?;
        }
        let offer = greeting.into_iter().find_map(|tell| match tell {
            Tell::Interrupted { job, next_leg, holes_done, toolpaths_done, .. } if job == key => {
                Some((next_leg, done(holes_done, toolpaths_done)))
            }
            _ => None,
        });
        if let Some(answer) = self.home().await? {
            return Ok(answer);
        }
        let from_leg = match offer.filter(|_| !how.from_start) {
            Some((leg, done)) => {
                super::say(format_args!("This job was interrupted after {done}; it goes on there."));
                leg
            }
            None => {
                self.make_room(low).await?;
                self.ask(Ask::SetZero)?;
                0
            }
        };
        let digest = self.arm(&key, from_leg)?;
        self.ask(Ask::Start { job: key.clone(), stream_digest: digest.clone(), from_leg })?;
        let (ending, done) = self.until_ended(&key).await;
        self.bar.finish_and_clear();
        let rested = self.settle().await;
        Ok(self.answer(ending, done, &digest, &rested))
    }

    /// Homes; an answer where that is all there is to say.
    async fn home(&mut self) -> Result<Option<Answer>, Refusal> {
        self.ask(Ask::Home)?;
        let homed = self.settle().await;
        let is_over = self.interrupted || homed.state != State::Ready;
        Ok(is_over.then(|| self.answer(ending_of(&homed), (0, 0), "", &homed)))
    }

    /// Touches the board; the map that is kept then.
    async fn touch(mut self, low: Point, ask: Ask, accept: &[String]) -> Result<Answer, Refusal> {
        self.may_begin(accept)?;
        if let Some(answer) = self.home().await? {
            return Ok(answer);
        }
        self.make_room(low).await?;
        self.ask(Ask::SetZero)?;
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
            None => Err(Refusal::content(diagnostic("level.stopped"))),
        }
    }

    /// Goes so far from the corner of the machine that what lies below the work zero is in the range too.
    async fn make_room(&mut self, low: Point) -> Result<(), Refusal> {
        for (axis, low) in [(0, low.x), (1, low.y)] {
            let below_um = (999 - low.nm()) / 1_000;
            if below_um > 0 {
                let distance_um = i32::try_from(below_um).unwrap_or(i32::MAX);
                self.ask(Ask::Jog { axis, distance_um })?;
                self.settle().await;
            }
        }
        Ok(())
    }

    /// Arms the job, to begin at `from_leg`; the first failed row of the pre-flight refuses it.
    fn arm(&self, key: &str, from_leg: u32) -> Result<String, Refusal> {
        for tell in self.ask(Ask::Arm { job: key.to_owned(), from_leg })? {
            if let Tell::Armed { stream_digest, checks, levelled, .. } = tell {
                if let Some(row) = checks.iter().find(|row| levelled && row.finding.code == "level.follows") {
                    super::say(row.finding.message("en"));
                }
                let failed = checks.into_iter().find(|row| row.verdict == RowVerdict::Fail);
                return failed.map_or(Ok(stream_digest), |row| Err(Refusal::content(row.finding)));
            }
        }
        Err(Refusal::content(diagnostic("control.not_armed")))
    }

    /// The next tell; the first signal stops the drill.
    async fn next(&mut self) -> Option<Tell> {
        tokio::select! {
            tell = self.tells.recv() => match tell {
                Ok(tell) => Some(tell),
                Err(RecvError::Lagged(_)) => self.status().map(|status| Tell::Status(Box::new(status))),
                Err(RecvError::Closed) => None,
            },
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

    /// Waits for rest.
    async fn settle(&mut self) -> Status {
        loop {
            if let Some(status) = self.status()
                && matches!(status.state, State::Ready | State::NotHomed | State::Alarm)
                && status.spindle_rpm == 0
            {
                return status;
            }
            // A move by hand goes as long as somebody waits for it.
            let _ = self.drill.ask(Ask::JogOn);
            let _ = tokio::time::timeout(Duration::from_millis(20), self.next()).await;
        }
    }

    /// Confirms bits and shows the progress until the job is over.
    async fn until_ended(&mut self, key: &str) -> (Ending, (u32, u32)) {
        loop {
            match self.next().await {
                Some(Tell::Ended { job, ending, holes_done, toolpaths_done }) if job == *key => {
                    return (ending, (holes_done, toolpaths_done));
                }
                Some(Tell::Status(status)) => {
                    self.change_tool(status.state);
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

    /// Confirms a tool when it has had its time. Statuses come ten times a second.
    fn change_tool(&mut self, state: State) {
        if state != State::ToolChange {
            self.asked = None;
            return;
        }
        let since = *self.asked.get_or_insert_with(Instant::now);
        if since.elapsed() >= self.change && self.drill.ask(Ask::ToolChanged).is_ok() {
            self.asked = None;
            super::say("The next bit is in.");
        }
    }

    fn answer(
        &self,
        ending: Ending,
        (holes, toolpaths): (u32, u32),
        digest: &str,
        rested: &Status,
    ) -> Answer {
        let drilled = rested.drilled.unwrap_or_default();
        let exit = match ending {
            Ending::Done if drilled == DrilledReport::default() => Exit::Done,
            _ if self.interrupted => Exit::Interrupted,
            _ => Exit::Content,
        };
        let mut object = json!({
            "holes_done": holes,
            "stopped_because": ending,
            "position_trust": rested.trust,
            "stream_digest": digest,
            "toolpaths_done": toolpaths,
            "slips": rested.slips,
            "drilled": drilled,
            "drilled_twice": rested.drilled_twice,
        });
        let why = rested.alarm.clone().unwrap_or_else(|| diagnostic("run.stopped"));
        let milled = format!(" {} milled.", counted(toolpaths, "toolpath"));
        let milled = if toolpaths > 0 { milled.as_str() } else { "" };
        let mut text = format!("{} drilled.{milled}\n", counted(holes, "hole"));
        rested.slips.iter().for_each(|slip| text += &lost(slip));
        for hole in &rested.drilled_twice {
            let note = Diagnostic::note("run.drilled_twice").with("hole", hole);
            text += &format!("{} {}\n", note.message("en"), note.advice("en"));
        }
        if exit != Exit::Done {
            let refusal = Refusal::content(why);
            object["error"] = refusal.object()["error"].clone();
            text += &format!("{refusal}\n");
        }
        Answer { object, text, exit }
    }
}

/// Refused where there is no height map to follow, or none of this job.
fn follows(greeting: &[Tell], level_key: &str) -> Result<(), Refusal> {
    let report = greeting.iter().find_map(|tell| match tell {
        Tell::HeightMap(report) if report.grid.is_some() => Some(report),
        _ => None,
    });
    match report {
        None => Err(Refusal::content(diagnostic("level.none_kept"))),
        Some(report) if !same_job(&report.job, level_key) => {
            Err(Refusal::content(diagnostic("level.other_job")))
        }
        Some(_) => Ok(()),
    }
}

/// Where a motor of the virtual drill lost steps, and why.
fn lost(slip: &SlipReport) -> String {
    let arguments = [
        ("axis", axis_name(usize::from(slip.axis))),
        ("place", format!("{:.2}", slip.place_mm)),
        ("lost", slip.lost.to_string()),
    ];
    let say = |key: &str, arguments: &[(String, String)]| {
        locale::text("en", &format!("page.slip.{key}"), arguments)
    };
    let line = say("line", &arguments.map(|(name, value)| (name.to_owned(), value)));
    format!("{}: {line} {}\n", say("title", &[]), say(&slip.cause, &[]))
}

/// What is done, in words.
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
