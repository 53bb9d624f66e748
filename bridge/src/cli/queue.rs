//! Checks a queue of work commands, or runs it row by row on a machine.
//!
//! Both assume that the machine is homed and the work zero is set at the position after homing.

use super::run::{typed_line, typed_lines};
use super::{Answer, Exit, Refusal, counted, diagnostic_lines, diagnostic_objects, dry_run, mm, rounded};
use crate::drill::Drill;
use crate::hosted::Hosted;
use crate::machine_file;
use crate::signals::Signals;
use annulus_core::control::State;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::{Machine, Output};
use annulus_core::queue::{self, CheckedQueue, Mode, Queue, RowState, Standing, check, print, read};
use annulus_core::virtual_drill::faults;
use annulus_core::wire::{Ask, QueuePhase, QueueStatus, Status, Tell};
use annulus_core::{error, warning};
use serde::Serialize;
use serde_json::json;
use std::fs;
use std::io;
use std::path::PathBuf;
use std::time::Duration;
use tokio::sync::mpsc::UnboundedReceiver;

/// Arguments of `annulus queue`.
#[derive(Debug, clap::Args)]
pub(crate) struct QueueArgs {
    #[command(subcommand)]
    what: What,
}

/// What to do with a queue.
#[derive(Debug, clap::Subcommand)]
enum What {
    /// Check that a queue may run, and show what it will do.
    Check(FileArgs),
    /// Run a queue.
    Run(RunArgs),
}

/// Which queue, on which machine.
#[derive(Debug, clap::Args)]
struct FileArgs {
    /// Read this text file, with one work command per line.
    file: PathBuf,
    /// Use this machine: a preset's name or a machine file.
    #[arg(short, long, default_value = "virtual")]
    machine: String,
}

/// Arguments of `annulus queue run`.
#[derive(Debug, clap::Args)]
struct RunArgs {
    #[command(flatten)]
    file: FileArgs,
    /// Report each row when it is done; at a terminal, wait for Enter before the next.
    #[arg(long)]
    step: bool,
    /// Ignore breakpoints [default: wait for Enter at a terminal, else stop].
    #[arg(long, conflicts_with = "step")]
    over_breakpoints: bool,
    /// Run the virtual drill this many times faster than real time.
    #[arg(long = "time-scale", alias = "speed", default_value_t = 1.0, value_parser = super::numbers::speed)]
    speed: f64,
    /// Inject a fault of the virtual drill, from a number of holes on: NAME or NAME@HOLES; see the manual.
    #[arg(long, value_name = "NAME[@HOLES]")]
    fault: Vec<String>,
    /// Move a real machine without a question.
    #[arg(long)]
    yes: bool,
    /// Print what would move, then end. Moves nothing.
    #[arg(long)]
    dry_run: bool,
}

impl RunArgs {
    fn mode(&self) -> Mode {
        match (self.step, self.over_breakpoints) {
            (true, _) => Mode::Step,
            (false, true) => Mode::ToEnd,
            (false, false) => Mode::ToBreakpoint,
        }
    }
}

pub(crate) fn run(args: &QueueArgs) -> Result<Answer, Refusal> {
    match &args.what {
        What::Check(file) => {
            let known = machine_file::named(&file.machine)?;
            let text = text_of(file)?;
            Ok(match checked(file, &text, &known.machine) {
                Ok((queue, done)) => promised(file, &queue, &done, &known.machine),
                Err(findings) => refused(&findings),
            })
        }
        What::Run(run) => {
            let known = super::run::own_machine(&run.file.machine)?;
            if known.machine.output != Output::Virtual {
                super::run::may_move_real(&run.file.machine, run.yes || run.dry_run, &run.fault)?;
            }
            let text = text_of(&run.file)?;
            match checked(&run.file, &text, &known.machine) {
                Ok((queue, done)) if run.dry_run => {
                    Ok(dry_run::marked(promised(&run.file, &queue, &done, &known.machine)))
                }
                Ok((queue, _)) => perform(run, known, &queue, text),
                Err(findings) => Ok(refused(&findings)),
            }
        }
    }
}

fn text_of(args: &FileArgs) -> Result<String, Refusal> {
    let path = args.file.display();
    let bytes = fs::read(&args.file).map_err(|error| {
        Refusal::surroundings(match error.kind() {
            io::ErrorKind::NotFound => error!("files.missing", path = path),
            _ => error!("files.unreadable", path = path, why = error),
        })
    })?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

/// The queue and its effect, or all its errors.
fn checked(args: &FileArgs, text: &str, machine: &Machine) -> Result<(Queue, CheckedQueue), Vec<Diagnostic>> {
    let file = args.file.display().to_string();
    let queue = read(&file, text)?;
    match check(&queue, machine, &machine.output_names(), &Standing::just_homed(machine)) {
        Ok(done) => Ok((queue, done)),
        Err(mut why) => {
            if let Some(place) = &mut why.place {
                place.file = file;
            }
            Err(vec![why])
        }
    }
}

fn refused(findings: &[Diagnostic]) -> Answer {
    let first = findings.first().cloned().unwrap_or_else(|| error!("queue.empty"));
    let error = Refusal::content(first).object()["error"].take();
    let object = json!({ "error": error, "findings": diagnostic_objects(findings) });
    let place = |why: &Diagnostic| why.place.as_ref().map_or(0, |place| place.line);
    let lines =
        findings.iter().map(|why| format!("{}: {}", place(why), diagnostic_lines(std::slice::from_ref(why))));
    Answer { exit: Exit::Content, ..Answer::new(&object, lines.collect()) }
}

fn promised(args: &FileArgs, queue: &Queue, done: &CheckedQueue, machine: &Machine) -> Answer {
    let home = Standing::just_homed(machine).position;
    let from_home = |place: [i64; 2]| {
        [0, 1].map(|axis: usize| mm(machine.axis(axis).scale.length(place[axis] - home[axis])))
    };
    let (lowest, highest) = (done.lowest.map(from_home), done.highest.map(from_home));
    let object = json!({
        "file": args.file.display().to_string(), "machine": machine.name, "rows": queue.rows().len(),
        "rows_done": done.rows, "strokes": done.strokes,
        "lowest_mm": lowest, "highest_mm": highest, "text": print(queue),
    });
    let mut text =
        format!("{} to run, {}.\n", counted(done.rows, "row"), counted(done.strokes, "drill cycle"));
    if let (Some([left, front]), Some([right, back])) = (lowest, highest) {
        text += &format!("From the work zero: X {left} … {right} mm, Y {front} … {back} mm.\n");
    }
    Answer::new(&object, text)
}

fn perform(
    args: &RunArgs,
    known: machine_file::Known,
    queue: &Queue,
    text: String,
) -> Result<Answer, Refusal> {
    let (runtime, signals) = super::run::runtime()?;
    let asks = known.machine.output != Output::Virtual && !args.yes;
    let faults = faults::read(args.fault.iter().map(String::as_str)).map_err(Refusal::usage)?;
    let drill = Drill::open_with(&machine_file::data_folder(), known.machine, args.speed, faults)?;
    drill.keep_settings_in(known.path);
    let mut operator = Operator { drill: &drill, signals, lines: typed_lines(), interrupted: false };
    let ran = runtime.block_on(operator.run(args.mode(), asks, queue, text));
    let answer = ran.map(|()| operator.answer(queue));
    drill.shutdown();
    answer
}

/// Acts for the user at the machine.
struct Operator<'a> {
    drill: &'a Drill,
    signals: Signals,
    /// Lines typed at the terminal.
    lines: Option<UnboundedReceiver<String>>,
    interrupted: bool,
}

impl Operator<'_> {
    fn ask(&self, ask: Ask) -> Result<(), Refusal> {
        self.drill.ask(ask).map(|_| ()).map_err(Refusal::content)
    }

    fn stands(&self) -> (Option<Status>, QueueStatus) {
        let (mut status, mut queue) = (None, QueueStatus::default());
        for tell in self.drill.greeting() {
            match tell {
                Tell::Status(told) => status = Some(*told),
                Tell::Queue(told) => queue = *told,
                _ => {}
            }
        }
        (status, queue)
    }

    /// Runs the queue. `asks`: waits for Enter before the machine moves.
    async fn run(&mut self, mode: Mode, asks: bool, queue: &Queue, text: String) -> Result<(), Refusal> {
        if let Some(alarm) = self.stands().0.and_then(|status| status.alarm) {
            return Err(Refusal::content(alarm));
        }
        if asks {
            let why = warning!("queue.moves");
            super::say(format_args!("{} {}", why.message("en"), why.advice("en")));
            if !self.enter().await {
                return Err(Refusal {
                    exit: Exit::Interrupted,
                    ..Refusal::content(error!("run.not_started"))
                });
            }
        }
        self.ask(Ask::Home)?;
        self.settle(|status, _| at_rest(status)).await;
        if self.interrupted || self.stands().0.is_none_or(|status| status.state != State::Ready) {
            return Ok(());
        }
        self.ask(Ask::SetZero)?;
        self.ask(Ask::Queue { text })?;
        let step = mode == Mode::Step;
        loop {
            let row = self.stands().1.row;
            self.ask(Ask::QueueRun { mode })?;
            self.settle(|_, queue| queue.phase != QueuePhase::Running).await;
            let (_, stands) = self.stands();
            if let Some(row) = row.filter(|_| step)
                && let Some(result) = result_of(&stands, row)
            {
                super::say(RowReport::of(queue, row, result).line());
            }
            if stands.phase != QueuePhase::Held {
                break;
            }
            if self.lines.is_some() {
                if let Some(row) = stands.row.filter(|_| !step) {
                    super::say(format_args!("Breakpoint before row {}. Press Enter to continue.", row + 1));
                }
                if !self.enter().await {
                    return Ok(());
                }
            } else if !step {
                // Without a terminal, nobody can continue the queue. A held queue never reports rest, so don't wait.
                return Ok(());
            }
        }
        self.settle(|status, _| at_rest(status)).await;
        Ok(())
    }

    /// Waits until `rests` holds. The first signal stops the drill.
    async fn settle(&mut self, rests: impl Fn(&Status, &QueueStatus) -> bool) {
        loop {
            if let (Some(status), queue) = self.stands()
                && rests(&status, &queue)
            {
                return;
            }
            tokio::select! {
                () = tokio::time::sleep(Duration::from_millis(5)) => {}
                _ = self.signals.wait() => self.stop(),
            }
        }
    }

    /// Waits for Enter. Returns `false` if a signal or the end of the terminal came first.
    async fn enter(&mut self) -> bool {
        // What was typed before the question does not answer it.
        while self.lines.as_mut().is_some_and(|lines| lines.try_recv().is_ok()) {}
        tokio::select! {
            line = typed_line(&mut self.lines) => line.is_some(),
            _ = self.signals.wait() => {
                self.stop();
                false
            }
        }
    }

    fn stop(&mut self) {
        if !self.interrupted {
            self.interrupted = true;
            super::say("Stopping.");
            let _ = self.drill.ask(Ask::Stop);
        }
    }

    fn answer(&self, queue: &Queue) -> Answer {
        let (status, stands) = self.stands();
        let exit = match stands.phase {
            QueuePhase::Done => Exit::Done,
            _ if self.interrupted => Exit::Interrupted,
            _ => Exit::Content,
        };
        let rows: Vec<RowReport> = (0_u32..)
            .zip(queue.rows())
            .filter(|(_, row)| row.command.is_some())
            .map(|(at, _)| RowReport::of(queue, at, result_of(&stands, at).unwrap_or_default()))
            .collect();
        let of = status.as_ref();
        let object = json!({
            "ended": stands.phase, "rows_done": stands.passed, "rows_total": stands.total, "rows": rows,
            "position_mm": of.map(|status| status.work_mm.map(rounded)),
            "position_trust": of.map(|status| status.trust), "slips": of.map(|status| &status.slips),
        });
        let mut text = format!("{} of {} done.\n", stands.passed, counted(stands.total, "row"));
        of.iter().flat_map(|status| &status.slips).for_each(|slip| text += &super::run::lost(slip));
        let held = stands.row.filter(|_| stands.phase == QueuePhase::Held && !self.interrupted);
        let why = held.map_or(error!("queue.stopped"), |row| error!("queue.at_breakpoint", row = row + 1));
        let why = status.and_then(|status| status.alarm).unwrap_or(why);
        let answer = Answer::new(&object, text).with_error((exit != Exit::Done).then_some(why));
        Answer { exit, ..answer }
    }
}

fn at_rest(status: &Status) -> bool {
    matches!(status.state, State::Ready | State::NotHomed | State::Alarm) && status.spindle_rpm == 0
}

/// A row of the queue and its result.
#[derive(Serialize)]
struct RowReport {
    row: u32,
    text: String,
    state: RowState,
    turns: u32,
    ms: f64,
    code: Option<String>,
}

impl RowReport {
    fn of(queue: &Queue, row: u32, result: queue::RowResult) -> Self {
        let text = print(queue).lines().nth(row as usize).unwrap_or_default().trim().to_owned();
        let queue::RowResult { state, turns, ms, why } = result;
        Self { row: row + 1, text, state, turns, ms: rounded(ms), code: why.map(|why| why.code) }
    }

    fn line(&self) -> String {
        let state = match self.state {
            RowState::Done => "done",
            RowState::Refused => "refused",
            RowState::StoppedHere => "stopped here",
            RowState::Waiting | RowState::Working => "–",
        };
        format!("{:>4}  {:<40} {state}, {} ms", self.row, self.text, self.ms.round())
    }
}

fn result_of(stands: &QueueStatus, row: u32) -> Option<queue::RowResult> {
    stands.results.iter().find(|(at, _)| *at == row).map(|(_, result)| result.clone())
}
