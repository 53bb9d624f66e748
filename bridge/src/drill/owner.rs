//! The owner's thread: takes messages one by one, asks `control` what to do, and does it.
//!
//! Comes in: asks, reports, troubles. Goes out: actions done, tells. The only place that changes the session. Does not know
//! what segments a move is made of.

use super::begin::Starting;
use super::board::Judged;
use super::hands::Hands;
use super::moves::{Doing, Work, ruler};
use super::outputs::Bench;
use super::prepare::{Context, Prepared};
use super::queue::Lab;
use super::recorder::{Record, Recorder};
use super::store;
use super::ticket::{Ticket, Tickets};
use crate::executor::{Executor, Report, Shared};
use crate::journal::{Contents, JobRecord, Journal, Progress, WorkZero};
use crate::machine_file;
use annulus_core::control::{Action, Event, Session, State, Timing, Trust, step};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::job::Bit;
use annulus_core::machine::{self, IN_FILE_ONLY, Machine, Steps, Value};
use annulus_core::pins::AxisSet;
use annulus_core::queue::Mode;
use annulus_core::virtual_drill::{DrilledBoard, Faults};
use annulus_core::wire::{Ask, Status, Tell};
use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};
use tokio::sync::broadcast;

/// Status at least this often.
const HEARTBEAT: Duration = Duration::from_millis(100);

/// How long `shutdown` waits for the machine to come to rest.
const LAST_REST: Duration = Duration::from_secs(5);

/// Settings that the virtual drill is built from: when one changes, it is another drill and must be homed.
const BUILT_FROM: [&str; 10] = [
    "x.",
    "y.",
    "z.",
    "drive.",
    "card.",
    "machine.output",
    "stroke.end",
    "stroke.surface",
    "stroke.board_thickness",
    "stroke.breakthrough",
];

/// What reaches the owner.
pub(super) enum Message {
    /// An ask, and what it was asked under where a page asks.
    Ask(Ask, Option<Ticket>, Sender<Result<Vec<Tell>, Diagnostic>>),
    /// Somebody pressed STOP. Nobody waits for an answer.
    Stop,
    /// Who had control has it no more, or somebody has it now: what only he was allowed to leave on ends.
    ControlChanged,
    Context(Sender<Context>),
    Prepared(Box<Prepared>, Sender<Result<Vec<Tell>, Diagnostic>>),
    /// The plan that was made last for the job in work, and the feeds that are wanted.
    InWork(Sender<Option<(Arc<Prepared>, u8)>>),
    /// The job in work at other feeds.
    Anew(Box<Prepared>),
    /// The start of a job is in the journal, or cannot be.
    Begun(Result<(), Diagnostic>),
    Greeting(Sender<Vec<Tell>>),
    Report(Report),
    ExecutorGone(Diagnostic),
    CannotRecord(Diagnostic),
    KeepSettingsIn(PathBuf),
    Shutdown,
}

/// What the owner is made of.
pub(super) struct Parts {
    pub(super) folder: PathBuf,
    pub(super) machine: Machine,
    pub(super) speed: f64,
    pub(super) faults: Faults,
    pub(super) record: DrilledBoard,
    pub(super) journal: Journal,
    pub(super) contents: Contents,
    pub(super) alarm: Option<Diagnostic>,
    pub(super) messages: Sender<Message>,
    pub(super) tells: broadcast::Sender<Tell>,
    pub(super) tickets: Arc<Tickets>,
}

/// Everything about the one drill.
pub(super) struct Owner {
    settings: PathBuf,
    pub(super) machine: Machine,
    pub(super) speed: f64,
    pub(super) hands: Hands,
    /// What the clock is worth, where time is real.
    pub(super) timing: Option<Timing>,
    pub(super) session: Session,
    pub(super) executor: Executor,
    pub(super) recorder: Recorder,
    pub(super) prepared: Option<Arc<Prepared>>,
    pub(super) work: Option<Work>,
    /// A job whose start is being written down.
    pub(super) starting: Option<Starting>,
    /// A job that did not come to its end.
    pub(super) interrupted: Option<(JobRecord, Progress)>,
    pub(super) doing: Doing,
    /// The bit that the executor was told of last.
    pub(super) in_spindle: Option<Bit>,
    /// The queue of work commands.
    pub(super) lab: Option<Lab>,
    /// Outputs by hand.
    pub(super) bench: Bench,
    /// The last run's board.
    pub(super) judged: Judged,
    pub(super) task: u64,
    /// Machine steps at the last rest.
    pub(super) position: Steps,
    /// Axes that came there from above.
    pub(super) down: AxisSet,
    /// Events to come.
    pub(super) pending: VecDeque<Event>,
    pub(super) tells: broadcast::Sender<Tell>,
    pub(super) told: (Option<Status>, Instant),
    pub(super) tickets: Arc<Tickets>,
}

/// The work zero of a job, where its steps still mean what they meant.
pub(super) fn zero_of(job: &JobRecord, machine: &Machine) -> Option<[i64; 2]> {
    (job.ruler.as_ref() == Some(&ruler(machine))).then_some(job.zero)
}

pub(super) fn diagnostic(code: &str) -> Diagnostic {
    Diagnostic::error(code)
}

impl Owner {
    pub(super) fn new(parts: Parts) -> Result<Self, Diagnostic> {
        let Parts { folder, machine, speed, faults, record, journal, contents, alarm, .. } = parts;
        let Parts { messages, tells, tickets, .. } = parts;
        let record = Arc::new(Mutex::new(record));
        let shared = Arc::new(Shared::default());
        let (slips, board) = (Arc::default(), Arc::default());
        let hands =
            Hands { folder: folder.clone(), faults, record, slips, board, messages: messages.clone() };
        let (executor, timing) = hands.executor(&machine, speed, None, Arc::clone(&shared))?;
        let interrupted = contents.job;
        if let Some((job, _)) =
            interrupted.as_ref().filter(|(job, _)| store::load(&folder, &job.key).is_none())
            && let Some(program) = journal.program()
        {
            let _ = store::keep(&folder, &job.key, &program);
        }
        let recorder = Recorder::start(journal, shared, messages)
            .map_err(|error| diagnostic("control.no_thread").with("reason", error))?;
        let mut session = Session::default();
        if let Some(why) = alarm {
            (session.state, session.alarm) = (State::Alarm, Some(why));
        }
        session.offer = interrupted.as_ref().map(|(job, progress)| (job.key.clone(), progress.done));
        let begun = interrupted.as_ref().and_then(|(job, _)| zero_of(job, &machine));
        let kept = contents.zero.filter(|zero| zero.ruler == ruler(&machine)).map(|zero| zero.steps);
        session.zeros = begun.or(kept).into_iter().collect();
        Ok(Self {
            settings: folder.join("machines").join("virtual.toml"),
            machine,
            speed,
            hands,
            timing,
            session,
            executor,
            recorder,
            prepared: None,
            work: None,
            starting: None,
            interrupted,
            doing: Doing::Nothing,
            in_spindle: None,
            lab: None,
            bench: Bench::default(),
            judged: Judged::default(),
            task: 0,
            position: Steps::default(),
            down: 0,
            pending: VecDeque::new(),
            tells,
            told: (None, Instant::now()),
            tickets,
        })
    }

    /// Takes messages until it is shut down.
    pub(super) fn run(mut self, inbox: &Receiver<Message>) {
        loop {
            let left = HEARTBEAT.saturating_sub(self.told.1.elapsed());
            let left = self.outputs_due().map_or(left, |due| due.min(left));
            match inbox.recv_timeout(left) {
                Ok(Message::Shutdown) | Err(RecvTimeoutError::Disconnected) => {
                    return self.come_to_rest(inbox);
                }
                Ok(message) => self.take(message),
                Err(RecvTimeoutError::Timeout) => {}
            }
            self.tick_outputs();
            self.tell_status();
        }
    }

    fn come_to_rest(&mut self, inbox: &Receiver<Message>) {
        self.happen(Event::Stop);
        let since = Instant::now();
        while self.session.moving && since.elapsed() < LAST_REST {
            match inbox.recv_timeout(HEARTBEAT) {
                Ok(message @ (Message::Report(_) | Message::ExecutorGone(_) | Message::CannotRecord(_))) => {
                    self.take(message);
                }
                Err(RecvTimeoutError::Disconnected) => break,
                Ok(_) | Err(RecvTimeoutError::Timeout) => {}
            }
        }
        self.executor.shared.stop(u64::MAX);
        self.tell_status();
    }

    pub(super) fn take(&mut self, message: Message) {
        let Some(message) = self.in_turn(message) else { return };
        match message {
            Message::Ask(ask, ticket, reply) => {
                let asked = ticket.unwrap_or_else(|| self.tickets.now());
                match (self.tickets.check(asked), ask) {
                    (Ok(()), Ask::Start { job, stream_digest, from_leg }) => {
                        self.begin(Event::Start(job, stream_digest, from_leg), asked, reply);
                    }
                    (good, ask) => drop(reply.send(good.and_then(|()| self.ask(ask)))),
                }
            }
            Message::Begun(written) => self.begun(written),
            Message::Stop => drop(self.ask(Ask::Stop)),
            Message::ControlChanged => {
                self.executor.shared.revoke();
                self.lock_outputs();
            }
            Message::Context(reply) => drop(reply.send(self.context())),
            Message::Prepared(prepared, reply) => drop(reply.send(self.arm(*prepared))),
            Message::InWork(reply) => drop(reply.send(self.work.as_ref().map(Work::wanted))),
            Message::Anew(anew) => self.anew(*anew),
            Message::Greeting(reply) => drop(reply.send(self.greeting())),
            Message::Report(report) => {
                self.reported(&report);
                self.drain();
            }
            Message::ExecutorGone(why) => {
                self.doing = Doing::Nothing;
                self.happen(Event::Failed(why, Trust::Lost));
            }
            Message::CannotRecord(why) => self.happen(Event::CannotRecord(why)),
            Message::KeepSettingsIn(path) => self.settings = path,
            Message::Shutdown => {}
        }
    }

    fn ask(&mut self, ask: Ask) -> Result<Vec<Tell>, Diagnostic> {
        match ask {
            Ask::Home => self.try_event(Event::Home)?,
            Ask::SetZero => self.try_event(Event::SetZero(self.table()))?,
            Ask::UndoZero => self.try_event(Event::UndoZero)?,
            Ask::Jog { axis, distance_um } => {
                self.jog_steps(axis, distance_um)?;
                self.try_event(Event::Jog(axis, distance_um))?;
            }
            Ask::JogOn if self.doing == Doing::Jog => self.executor.shared.grant(),
            Ask::JogOn => {}
            Ask::Pause => {
                self.try_event(Event::Pause)?;
                self.queue_hold();
            }
            Ask::Resume if self.session.queue => self.queue_run(Mode::ToBreakpoint)?,
            Ask::Resume => self.try_event(Event::Resume)?,
            Ask::StopAfterHole => self.try_event(Event::StopAfterHole)?,
            Ask::FeedOverride { percent } => self.feed_override(percent)?,
            Ask::Stop => {
                self.stop_start();
                self.lock_outputs();
                self.try_event(Event::Stop)?;
            }
            Ask::Queue { text } => return self.queue_load(text),
            Ask::QueueRun { mode } => self.queue_run(mode)?,
            Ask::QueueClear => self.queue_clear()?,
            Ask::OutputLease { minutes } => self.lease_outputs(minutes)?,
            Ask::Output { name, on, pulse_ms } => self.switch_output(&name, on, pulse_ms)?,
            Ask::ToolChanged => self.try_event(Event::ToolChanged)?,
            Ask::AcknowledgeAlarm => {
                if self.executor.is_gone() {
                    self.renew_executor()?;
                }
                let damaged = self.session.alarm.as_ref().is_some_and(|why| why.code == super::DAMAGED);
                self.try_event(Event::Acknowledge)?;
                if damaged {
                    self.recorder.write(Record::DamageRead);
                }
            }
            Ask::ForgetInterrupted => self.forget()?,
            Ask::Configure { changes } => self.configure(&changes)?,
            Ask::Arm { .. }
            | Ask::Start { .. }
            | Ask::Hello { .. }
            | Ask::Ping { .. }
            | Ask::TakeControl { .. }
            | Ask::ReleaseControl => {
                return Err(diagnostic("control.not_for_the_drill"));
            }
        }
        Ok(Vec::new())
    }

    /// Where the table stands, as the count of an axis that came from below says it: one that came from above has its play
    /// between motor and table.
    fn table(&self) -> [i64; 2] {
        [0, 1].map(|axis: usize| {
            let settings = self.machine.axis(axis);
            let play = settings.scale.steps(settings.backlash);
            self.position[axis] + i64::from(self.down >> axis & 1) * play
        })
    }

    /// Does what follows from `event`, or says why it is refused.
    pub(super) fn try_event(&mut self, event: Event) -> Result<(), Diagnostic> {
        let (next, actions) = step(&self.session, event);
        if let [Action::Refuse(why)] = actions.as_slice() {
            return Err(why.clone());
        }
        let counted = self.session.trust != Trust::Lost;
        self.session = next;
        if actions.iter().any(Action::moves) {
            self.lock_outputs();
        }
        for action in actions {
            if let Err(why) = self.act(action, counted) {
                // Nothing was set in motion after all.
                self.pending.push_back(Event::Failed(why, self.session.trust));
            }
        }
        self.drain();
        Ok(())
    }

    pub(super) fn happen(&mut self, event: Event) {
        self.pending.push_back(event);
        self.drain();
    }

    fn drain(&mut self) {
        while let Some(event) = self.pending.pop_front() {
            let _ = self.try_event(event);
        }
    }

    fn act(&mut self, action: Action, counted: bool) -> Result<(), Diagnostic> {
        match action {
            Action::Home => self.home(counted)?,
            Action::Jog(axis, um) => {
                let steps = self.jog_steps(axis, um)?;
                self.jog(usize::from(axis), steps)?;
            }
            Action::Approach(_) => self.approach()?,
            Action::Queue => self.queue_go(),
            Action::NextLeg => self.leg(Vec::new()),
            Action::RestOfLeg => self.rest_of_leg(),
            Action::SpindleOn => self.spindle_on(),
            Action::MakeSafe { lift } => self.make_safe(lift),
            Action::SpindleOff => self.executor.spindle_off()?,
            Action::Brake => self.executor.shared.stop(self.task),
            Action::KeepZero => {
                self.prepared = None;
                let ruler = ruler(&self.machine);
                let zero = self.session.zero().map(|steps| WorkZero { steps, ruler });
                self.recorder.write(Record::Zero(zero));
            }
            Action::End(ending) => {
                self.queue_over();
                self.end(ending);
            }
            Action::Refuse(why) => return Err(why),
        }
        Ok(())
    }

    fn configure(&mut self, changes: &[(String, Value)]) -> Result<(), Diagnostic> {
        // Which hardware is touched is said in the machine's file alone, whoever asks.
        if let Some((key, _)) = changes.iter().find(|(key, _)| IN_FILE_ONLY.contains(&key.as_str())) {
            return Err(diagnostic("control.in_file_only").with("key", key));
        }
        let changed = machine::apply(&self.machine, changes)
            .map_err(|refusals| refusals.into_iter().next().unwrap_or_else(|| diagnostic("control.busy")))?;
        let rebuilt = machine::settings().any(|setting| {
            let differs = setting.value(&self.machine) != setting.value(&changed);
            differs && BUILT_FROM.iter().any(|start| setting.key.starts_with(start))
        });
        if let [Action::Refuse(why)] = step(&self.session, Event::Disarmed(rebuilt)).1.as_slice() {
            return Err(why.clone());
        }
        machine_file::save(&self.settings, &changed)?;
        self.try_event(Event::Disarmed(rebuilt))?;
        if ruler(&self.machine) != ruler(&changed) {
            // The work zero was counted in the old steps.
            self.session.zeros.clear();
            self.recorder.write(Record::Zero(None));
        }
        self.machine = changed;
        (self.prepared, self.lab) = (None, None);
        self.lock_outputs();
        if rebuilt {
            self.renew_executor()?;
        }
        self.tell(self.machine_tell());
        self.queue_greeting().into_iter().for_each(|tell| self.tell(tell));
        self.tell(self.outputs_tell());
        Ok(())
    }

    /// Another executor in the place of this one, for the machine as it is now. It knows no position.
    fn renew_executor(&mut self) -> Result<(), Diagnostic> {
        let shared = Arc::clone(&self.executor.shared);
        self.executor.finish();
        let measured = self.timing.as_ref().map(|timing| timing.lateness.clone());
        let (executor, timing) = self.hands.executor(&self.machine, self.speed, measured, shared)?;
        (self.executor, self.timing) = (executor, timing);
        (self.position, self.down, self.in_spindle) = (Steps::default(), 0, None);
        Ok(())
    }
}
