//! The owner: takes messages one by one, passes them to the session (`control`), and carries out its
//! actions. Only the owner changes the session.

mod begin;
pub(crate) mod board;
mod change;
mod clamp;
mod configure;
mod foot;
mod hands;
mod hold;
mod homing;
mod length;
mod moves;
mod outputs;
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
use crate::surface::{KeptSurface, KnownHeight};
use crate::ticket::{Ticket, Tickets};
use annulus_core::control::{Action, Event, Session, State, Timing, Trust, step};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::error;
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

pub enum Message {
    /// A request; the ticket if a page sent it.
    Ask {
        ask: Ask,
        ticket: Option<Ticket>,
        reply: Sender<Result<Vec<Tell>, Diagnostic>>,
    },
    /// STOP. No answer is expected.
    Stop,
    /// A page lost or gained control: jogs and manual outputs end.
    ControlChanged,
    Context(Sender<Context>),
    Prepared {
        prepared: Box<Prepared>,
        reply: Sender<Result<Vec<Tell>, Diagnostic>>,
    },
    /// Requests the latest plan of the running job and the requested feed.
    InWork(Sender<Option<(Arc<Prepared>, u8)>>),
    /// The running job, planned at another feed.
    Anew(Box<Prepared>),
    /// The start of a job is durable, or could not be written.
    Begun(Result<(), Diagnostic>),
    Greeting(Sender<Vec<Tell>>),
    StockKept {
        number: u32,
    },
    Report(Report),
    /// The executor ended; its current task will not be reported.
    ExecutorGone(Diagnostic),
    CannotRecord(Diagnostic),
    Shutdown,
}

pub struct Parts {
    pub machine: Machine,
    /// Time scale of the virtual drill, 1 for real time.
    pub speed: f64,
    pub faults: Faults,
    pub seed: u64,
    pub record: DrilledBoard,
    /// Contents of the journal.
    pub contents: Contents,
    pub surface: Option<KeptSurface>,
    /// An alarm to start with.
    pub alarm: Option<Diagnostic>,
    /// Decides which requests of pages are still valid.
    pub tickets: Arc<Tickets>,
    pub shared: Arc<Shared>,
    pub time: Time,
    pub outside: Box<dyn Outside>,
}

pub struct Owner {
    pub(crate) machine: Machine,
    pub(crate) speed: f64,
    pub(crate) hands: Hands,
    /// Quality of the clock, on real hardware.
    pub timing: Option<Timing>,
    pub(crate) session: Session,
    pub(crate) executor: Executor,
    pub(crate) outside: Box<dyn Outside>,
    pub(crate) time: Time,
    pub(crate) prepared: Option<Arc<Prepared>>,
    pub(crate) work: Option<Work>,
    /// A job whose start is being written to the journal.
    pub(crate) starting: Option<Starting>,
    pub(crate) interrupted: Option<(JobRecord, Progress)>,
    pub(crate) doing: Doing,
    pub(crate) in_spindle: Option<Bit>,
    /// Number of the tool, in the machine's list, that a job last inserted.
    pub(crate) tool_in: Option<u32>,
    pub(crate) wear: Vec<ToolWear>,
    pub(crate) tools: ToolChanger,
    pub(crate) lab: Option<Lab>,
    pub(crate) surface: Option<Arc<KeptSurface>>,
    pub(crate) touching: Option<Touching>,
    pub(crate) known: KnownHeight,
    pub(crate) by_hand: ManualOutputs,
    /// Comparison of the last run's board with its program.
    pub(crate) judged: Judged,
    pub(crate) task: u64,
    /// Number of the hold on the current task's path; 0 for none.
    pub(crate) held: u64,
    pub(crate) position: Steps,
    /// Steps that the tool must rise to be certainly out of the board, after the position was lost.
    pub(crate) unseen_steps: i64,
    /// Axes whose last step counted down.
    pub(crate) down: AxisSet,
    pub(crate) foot: Foot,
    pub(crate) pending: VecDeque<Event>,
    pub(crate) told: (Option<Status>, Duration),
    pub(crate) tools_told: ToolsReport,
    pub(crate) tickets: Arc<Tickets>,
}

/// The work zero of a job, if its steps still have the same meaning.
pub(crate) fn zero_of(job: &JobRecord, machine: &Machine) -> Option<[i64; 2]> {
    (job.ruler.as_ref() == Some(&ruler(machine))).then_some(job.zero)
}

impl Owner {
    /// Creates a stopped drill with unknown position. Nothing moves.
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
        let mut owner = Self {
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
            known: KnownHeight::default(),
            by_hand: ManualOutputs::default(),
            judged: Judged::default(),
            task: 0,
            held: 0,
            position: Steps::default(),
            unseen_steps: 0,
            down: 0,
            foot: Foot::default(),
            pending: VecDeque::new(),
            told: (None, time()),
            tools_told: ToolsReport::default(),
            tickets,
        };
        owner.stock_for_pins();
        if owner.interrupted.is_some() {
            owner.may_be_low();
        }
        Ok(owner)
    }

    /// How long [`Self::beat`] may wait if no message arrives.
    pub fn idle(&self) -> Duration {
        let left = HEARTBEAT.saturating_sub(self.now().saturating_sub(self.told.1));
        self.outputs_due().map_or(left, |due| due.min(left))
    }

    /// Does what is due. Call it after every message, and after [`Self::idle`].
    pub fn beat(&mut self) {
        self.tick_outputs();
        self.look_at_spindle();
        self.look_at_hold();
        self.tell_status();
    }

    pub fn moves(&self) -> bool {
        self.session.moving
    }

    pub fn over(&mut self) {
        self.executor.shared.stop(u64::MAX);
        self.tell_status();
    }

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
                self.ended_unseen();
                self.doing = Doing::Nothing;
                self.happen(Event::Failed { alarm: why, left: Trust::Lost });
            }
            Message::CannotRecord(why) => self.happen(Event::CannotRecord(why)),
            Message::Shutdown => self.happen(self.stop_event()),
        }
    }

    fn ask(&mut self, ask: Ask) -> Result<Vec<Tell>, Diagnostic> {
        match ask {
            Ask::Home => self.try_event(Event::Home)?,
            Ask::Park => {
                self.may_move_in_change()?;
                self.try_event(Event::Park)?;
            }
            Ask::SetZero => self.try_event(Event::SetZero { place_steps: self.table() })?,
            Ask::UndoZero => self.try_event(Event::UndoZero)?,
            Ask::Jog { axis, distance_um, anyway } => {
                self.may_move_in_change()?;
                self.ask_jog(axis, distance_um, anyway)?;
            }
            Ask::JogOn if self.doing == Doing::Jog => self.executor.shared.grant(),
            Ask::JogOn => {}
            Ask::Pause => {
                self.try_event(Event::Pause)?;
                self.queue_hold();
            }
            Ask::LiftTool => self.lift_off_path()?,
            Ask::Resume if self.touching.is_some() => self.touching_goes_on()?,
            Ask::Resume if self.session.queue => self.queue_run(Mode::ToBreakpoint)?,
            Ask::Resume => self.try_event(Event::Resume)?,
            Ask::StopAfterHole => self.try_event(Event::StopAfterHole)?,
            Ask::FeedOverride { percent } => self.feed_override(percent)?,
            Ask::Stop => {
                self.stop_start();
                self.lock_outputs();
                self.try_event(self.stop_event())?;
            }
            Ask::Queue { text } => return self.queue_load(text),
            Ask::QueueRun { mode } => self.queue_run(mode)?,
            Ask::QueueClear => self.queue_clear()?,
            Ask::OutputLease { minutes } => self.lease_outputs(minutes)?,
            Ask::Output { name, on, pulse_ms } => self.switch_output(&name, on, pulse_ms)?,
            Ask::ToolChanged => self.tool_changed()?,
            Ask::SameLength => self.same_length()?,
            Ask::MeasureTool => self.measure_tool()?,
            Ask::NewTool { number } => self.new_tool(number)?,
            Ask::Stock { places, spindle } => self.stock_said(places, spindle)?,
            Ask::ToolSeen { seen } => self.tool_seen(seen)?,
            Ask::OpenClamp => self.open_clamp()?,
            Ask::AcknowledgeAlarm => self.acknowledge()?,
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
                return Err(error!("control.controllers_alone"));
            }
            Ask::Arm { .. }
            | Ask::Start { .. }
            | Ask::Hello { .. }
            | Ask::Ping { .. }
            | Ask::TakeControl { .. }
            | Ask::ReleaseControl => {
                return Err(error!("control.not_for_the_drill"));
            }
        }
        Ok(Vec::new())
    }

    /// Clears an acknowledged alarm. Restarts the executor first, if it ended.
    fn acknowledge(&mut self) -> Result<(), Diagnostic> {
        if self.executor.is_gone() {
            self.renew_executor()?;
        }
        let damaged = self.session.alarm.as_ref().is_some_and(Damage::is_told_by);
        self.try_event(Event::Acknowledge)?;
        if damaged {
            self.outside.record(Record::DamageRead);
        }
        Ok(())
    }

    fn stop_event(&self) -> Event {
        Event::Stop { now_ms: u64::try_from(self.now().as_millis()).unwrap_or(u64::MAX) }
    }

    /// Table position, as counted on an axis that moved up: after a move down, the backlash separates motor
    /// and table.
    fn table(&self) -> [i64; 2] {
        [0, 1].map(|axis: usize| {
            let settings = self.machine.axis(axis);
            let play = settings.scale.steps(settings.backlash);
            self.position[axis] + i64::from(self.down >> axis & 1) * play
        })
    }

    /// Applies `event` to the session and carries out its actions, or returns why it is refused.
    pub(crate) fn try_event(&mut self, event: Event) -> Result<(), Diagnostic> {
        let (next, actions) = step(&self.session, event);
        if let [Action::Refuse(why)] = actions.as_slice() {
            return Err(why.clone());
        }
        let counted = self.session.trust != Trust::Lost;
        let low = self.lift_first_steps();
        self.session = next;
        match self.session.trust {
            Trust::Lost => self.lost_low(low),
            Trust::Trusted => self.unseen_steps = 0,
            Trust::Suspect => {}
        }
        if actions.iter().any(Action::moves) {
            self.lock_outputs();
        }
        for action in actions {
            if let Err(why) = self.act(action, counted) {
                // Nothing started to move.
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
            Action::Touched => self.touched_in_change()?,
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
            Action::Hold => self.hold(),
            Action::Go => self.goes_on(),
            Action::LiftOffPath => self.executor.shared.lift(self.task),
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
