//! The owner: takes messages one by one, asks `control` what to do, and does it.
//!
//! Comes in: asks, reports, troubles. Goes out: actions done, tells. The only place that changes the session. Does not know
//! what segments a move is made of.

mod begin;
pub(crate) mod board;
mod change;
mod clamp;
mod configure;
mod faster;
mod foot;
mod hands;
mod homing;
mod moves;
mod outputs;
mod park;
mod queue;
mod status;
mod tools;
mod touch;
mod work;

use self::begin::Starting;
use self::board::Judged;
use self::change::ToolChanger;
use self::foot::Foot;
use self::hands::Hands;
use self::moves::{Doing, ruler};
use self::outputs::ManualOutputs;
use self::queue::Lab;
use self::status::HEARTBEAT;
use self::touch::{SurveyWish, Touching};
use self::work::Work;
use crate::executor::{Executor, Report, Shared, Time};
use crate::journal::{Contents, Damage, JobRecord, Progress, Record, WorkZero};
use crate::outside::Outside;
use crate::prepare::{Context, Prepared};
use crate::surface::KeptSurface;
use crate::ticket::{Ticket, Tickets};
use annulus_core::control::{Action, Event, Session, State, Timing, Trust, step};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::job::Bit;
use annulus_core::machine::{Machine, Steps, ToolWear};
use annulus_core::pins::AxisSet;
use annulus_core::queue::Mode;
use annulus_core::virtual_drill::{DrilledBoard, Faults};
use annulus_core::wire::{Ask, Status, Tell, ToolsReport};
use std::collections::VecDeque;
use std::sync::mpsc::Sender;
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// What reaches the owner.
pub enum Message {
    /// An ask, and what it was asked under where a page asks.
    Ask {
        /// What is asked.
        ask: Ask,
        /// What it was asked under.
        ticket: Option<Ticket>,
        /// Where the answer goes.
        reply: Sender<Result<Vec<Tell>, Diagnostic>>,
    },
    /// Somebody pressed STOP. Nobody waits for an answer.
    Stop,
    /// Who had control has it no more, or somebody has it now: what only he was allowed to leave on ends.
    ControlChanged,
    /// How the drill stands is wanted.
    Context(Sender<Context>),
    /// A job was prepared.
    Prepared {
        /// The job.
        prepared: Box<Prepared>,
        /// Where the answer goes.
        reply: Sender<Result<Vec<Tell>, Diagnostic>>,
    },
    /// The plan that was made last for the job in work, and the feeds that are wanted.
    InWork(Sender<Option<(Arc<Prepared>, u8)>>),
    /// The job in work at other feeds.
    Anew(Box<Prepared>),
    /// The start of a job is in the journal, or cannot be.
    Begun(Result<(), Diagnostic>),
    /// What a newcomer must know is wanted.
    Greeting(Sender<Vec<Tell>>),
    /// What lies in the magazine is on the disk.
    StockKept {
        /// Number of its record.
        number: u32,
    },
    /// A task ended.
    Report(Report),
    /// The executor is no more; what it was doing was not reported.
    ExecutorGone(Diagnostic),
    /// Journal or drilled-board record refuse.
    CannotRecord(Diagnostic),
    /// It is to end, and comes to rest.
    Shutdown,
}

/// What the owner is made of.
pub struct Parts {
    /// The machine.
    pub machine: Machine,
    /// How many times faster than life the virtual drill runs.
    pub speed: f64,
    /// What of the virtual drill is broken.
    pub faults: Faults,
    /// Its chance.
    pub seed: u64,
    /// Where it writes its holes down.
    pub record: DrilledBoard,
    /// What the journal held.
    pub contents: Contents,
    /// The height map that was kept.
    pub surface: Option<KeptSurface>,
    /// What stands as an alarm from the beginning.
    pub alarm: Option<Diagnostic>,
    /// What pages' asks are good for.
    pub tickets: Arc<Tickets>,
    /// What executor and journal share with it.
    pub shared: Arc<Shared>,
    /// The clock.
    pub time: Time,
    /// The place where it runs.
    pub outside: Box<dyn Outside>,
}

/// Everything about the one drill.
pub struct Owner {
    pub(crate) machine: Machine,
    pub(crate) speed: f64,
    pub(crate) hands: Hands,
    /// What the clock is worth, where time is real.
    pub timing: Option<Timing>,
    pub(crate) session: Session,
    pub(crate) executor: Executor,
    pub(crate) outside: Box<dyn Outside>,
    pub(crate) time: Time,
    pub(crate) prepared: Option<Arc<Prepared>>,
    pub(crate) work: Option<Work>,
    /// A job whose start is being written down.
    pub(crate) starting: Option<Starting>,
    /// A job that did not come to its end.
    pub(crate) interrupted: Option<(JobRecord, Progress)>,
    pub(crate) doing: Doing,
    /// The bit that the executor was told of last.
    pub(crate) in_spindle: Option<Bit>,
    /// Number of the tool of the rack that a job put in last.
    pub(crate) tool_in: Option<u32>,
    /// What tools have done since they were new.
    pub(crate) wear: Vec<ToolWear>,
    /// What changes tools.
    pub(crate) tools: ToolChanger,
    /// The queue of work commands.
    pub(crate) lab: Option<Lab>,
    /// The height map of the board.
    pub(crate) surface: Option<Arc<KeptSurface>>,
    /// What is being touched.
    pub(crate) touching: Option<Touching>,
    /// Outputs by hand.
    pub(crate) by_hand: ManualOutputs,
    /// The last run's board.
    pub(crate) judged: Judged,
    pub(crate) task: u64,
    /// Machine steps at the last rest.
    pub(crate) position: Steps,
    /// Axes that came there from above.
    pub(crate) down: AxisSet,
    /// The presser foot is down, or may be.
    pub(crate) foot: Foot,
    /// Events to come.
    pub(crate) pending: VecDeque<Event>,
    /// The status that was told last, and when.
    pub(crate) told: (Option<Status>, Duration),
    /// What was told of the tools.
    pub(crate) tools_told: ToolsReport,
    pub(crate) tickets: Arc<Tickets>,
}

/// The work zero of a job, where its steps still mean what they meant.
pub(crate) fn zero_of(job: &JobRecord, machine: &Machine) -> Option<[i64; 2]> {
    (job.ruler.as_ref() == Some(&ruler(machine))).then_some(job.zero)
}

pub(crate) fn diagnostic(code: &str) -> Diagnostic {
    Diagnostic::error(code)
}

impl Owner {
    /// The drill at rest, its position unknown. Nothing moves.
    pub fn new(parts: Parts) -> Result<Self, Diagnostic> {
        let Parts { machine, speed, faults, seed, record, contents, .. } = parts;
        let Parts { surface, alarm, tickets, shared, time, outside, .. } = parts;
        let record = Arc::new(Mutex::new(record));
        let hands = Hands { faults, seed, record, slips: Arc::default(), board: Arc::default() };
        let (executor, timing) = hands.executor(&machine, None, shared, &*outside)?;
        let interrupted = contents.job;
        let mut session = Session::default();
        if let Some(why) = alarm {
            (session.state, session.alarm) = (State::Alarm, Some(why));
        }
        session.offer = interrupted.as_ref().map(|(job, progress)| (job.key.clone(), progress.done));
        let begun = interrupted.as_ref().and_then(|(job, _)| zero_of(job, &machine));
        let kept = contents.zero.filter(|zero| zero.ruler == ruler(&machine)).map(|zero| zero.steps);
        session.zeros = begun.or(kept).into_iter().collect();
        let owner = Self {
            machine,
            speed,
            hands,
            timing,
            session,
            executor,
            outside,
            time,
            prepared: None,
            work: None,
            starting: None,
            interrupted,
            doing: Doing::Nothing,
            in_spindle: None,
            tool_in: None,
            wear: contents.wear,
            tools: ToolChanger::new(contents.stock.unwrap_or_default()),
            lab: None,
            surface: surface.map(Arc::new),
            touching: None,
            by_hand: ManualOutputs::default(),
            judged: Judged::default(),
            task: 0,
            position: Steps::default(),
            down: 0,
            foot: Foot::default(),
            pending: VecDeque::new(),
            told: (None, time()),
            tools_told: ToolsReport::default(),
            tickets,
        };
        owner.stock_for_pins();
        Ok(owner)
    }

    /// How long it needs nothing where no message comes.
    pub fn idle(&self) -> Duration {
        let left = HEARTBEAT.saturating_sub(self.now().saturating_sub(self.told.1));
        self.outputs_due().map_or(left, |due| due.min(left))
    }

    /// Does what it is time for. After every message, and when it was idle for so long.
    pub fn beat(&mut self) {
        self.tick_outputs();
        self.look_at_spindle();
        self.tell_status();
    }

    /// Whether anything moves.
    pub fn moves(&self) -> bool {
        self.session.moving
    }

    /// Nothing is waited for any more: it ends.
    pub fn over(&mut self) {
        self.executor.shared.stop(u64::MAX);
        self.tell_status();
    }

    /// Takes a message.
    pub fn take(&mut self, message: Message) {
        let Some(message) = self.in_turn(message) else { return };
        match message {
            Message::Ask { ask, ticket, reply } => {
                let asked = ticket.unwrap_or_else(|| self.tickets.now());
                match (self.tickets.check(asked), ask) {
                    (Ok(()), Ask::Start { job, stream_digest, from_leg }) => {
                        self.begin(Event::Start { job, digest: stream_digest, from_leg }, asked, reply);
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
            Message::Prepared { prepared, reply } => drop(reply.send(self.arm(*prepared))),
            Message::InWork(reply) => drop(reply.send(self.work.as_ref().map(Work::wanted))),
            Message::Anew(anew) => self.anew(*anew),
            Message::Greeting(reply) => drop(reply.send(self.greeting())),
            Message::StockKept { number } => {
                self.stock_kept(number);
                self.drain();
            }
            Message::Report(report) => {
                self.reported(&report);
                self.drain();
            }
            Message::ExecutorGone(why) => {
                self.doing = Doing::Nothing;
                self.happen(Event::Failed { alarm: why, left: Trust::Lost });
            }
            Message::CannotRecord(why) => self.happen(Event::CannotRecord(why)),
            Message::Shutdown => self.happen(Event::Stop),
        }
    }

    fn ask(&mut self, ask: Ask) -> Result<Vec<Tell>, Diagnostic> {
        match ask {
            Ask::Home => self.try_event(Event::Home)?,
            Ask::Park => self.try_event(Event::Park)?,
            Ask::SetZero => self.try_event(Event::SetZero { place_steps: self.table() })?,
            Ask::UndoZero => self.try_event(Event::UndoZero)?,
            Ask::Jog { axis, distance_um } => {
                self.jog_steps(axis, distance_um)?;
                self.try_event(Event::Jog { axis, distance_um })?;
            }
            Ask::JogOn if self.doing == Doing::Jog => self.executor.shared.grant(),
            Ask::JogOn => {}
            Ask::Pause => {
                self.try_event(Event::Pause)?;
                self.queue_hold();
            }
            Ask::Resume if self.touching.is_some() => self.touching_goes_on()?,
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
            Ask::ToolChanged => self.tool_changed()?,
            Ask::NewTool { number } => self.new_tool(number)?,
            Ask::Stock { places, spindle } => self.stock_said(places, spindle)?,
            Ask::ToolSeen { seen } => self.tool_seen(seen)?,
            Ask::OpenClamp => self.open_clamp()?,
            Ask::AcknowledgeAlarm => {
                if self.executor.is_gone() {
                    self.renew_executor()?;
                }
                let damaged = self.session.alarm.as_ref().is_some_and(Damage::is_told_by);
                self.try_event(Event::Acknowledge)?;
                if damaged {
                    self.outside.record(Record::DamageRead);
                }
            }
            Ask::ForgetInterrupted => self.forget()?,
            Ask::Configure { changes } => self.configure(&changes)?,
            Ask::Provoke { faults } => self.provoke(&faults)?,
            Ask::Survey { grid, job, clear_um, depth_um, now_s } => {
                self.survey(SurveyWish { grid, job, clear_um, depth_um, now_s })?;
            }
            Ask::ForgetHeightMap => self.forget_surface()?,
            Ask::SetHeight => self.height_here()?,
            Ask::Probe { depth_um, plate_um } => self.touch_height(depth_um, plate_um)?,
            Ask::Edge { axis, up, reach_um, tool_um } => self.touch_edge((axis, up), reach_um, tool_um)?,
            Ask::Unlock | Ask::SpindleOverride { .. } | Ask::RapidOverride { .. } | Ask::Check { .. } => {
                return Err(diagnostic("control.controllers_alone"));
            }
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
    pub(crate) fn try_event(&mut self, event: Event) -> Result<(), Diagnostic> {
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
                self.fails(why, self.session.trust);
            }
        }
        self.drain();
        Ok(())
    }

    pub(crate) fn happen(&mut self, event: Event) {
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
            Action::Park => self.park()?,
            Action::Jog { axis, distance_um: um } => {
                let steps = self.jog_steps(axis, um)?;
                self.jog(usize::from(axis), steps)?;
            }
            Action::Approach { .. } => self.approach()?,
            Action::Queue if self.touching.is_some() => self.touching_begins(),
            Action::Queue => self.queue_go(),
            Action::NextLeg => self.leg(Vec::new()),
            Action::ChangeTool => self.change_tool()?,
            Action::RestOfLeg => self.rest_of_leg(),
            Action::SpindleOn => self.spindle_on(),
            Action::MakeSafe { lift } => self.make_safe(lift),
            Action::SpindleOff => self.executor.spindle_off()?,
            Action::Brake => {
                self.executor.shared.stop(self.task);
                self.brake_change();
                self.parks_no_more();
            }
            Action::KeepZero => {
                self.prepared = None;
                let ruler = ruler(&self.machine);
                let zero = self.session.zero().map(|steps| WorkZero { steps, ruler });
                self.outside.record(Record::Zero(zero));
                self.tell(self.surface_tell());
            }
            Action::End(ending) => {
                self.queue_over();
                self.touching_over(ending);
                self.end(ending);
            }
            Action::Refuse(why) => return Err(why),
        }
        Ok(())
    }
}
