//! A controller and its job, without threads: the caller owns port and time, and calls in turn. Callers are
//! a page's worker ([`super::PageStation`]) and a thread of the bridge. Clients are pages or the command
//! line.
//!
//! Job progress is durable before it is reported.

use super::attended::{Attended, AttendedJob, Due, Told};
use super::given::JobGiven;
use super::host::{HELD_AFTER, Host, HostNews};
use super::ledger::{Bringing, Ledger};
use super::lengths;
use super::order::{Armed, Order};
use super::surface::{BoardSurface, HeightSet};
use crate::executor::Time;
use crate::files::Files;
use crate::owner::Message;
use crate::prepare::made;
use crate::programs::{Programs, Upload};
use crate::ticket::Tickets;
use annulus_core::control::{Ending, State, Trust};
use annulus_core::diagnostic::{Diagnostic, Severity};
use annulus_core::grbl::{
    BoardHeight, EngineAsk, EngineEvent, EnginePhase, ResetOnOpen, ToolLengths, ToolMacro, settings,
};
use annulus_core::machine::{self, Machine, MillProfile};
use annulus_core::wire::{Ask, CheckModeReport, JobEnd, Status, Tell, ToolsReport};
use annulus_core::{code, error};
use std::sync::Arc;
use std::time::Duration;

/// How often [`Station::advance`] wants to be called.
const TURN: Duration = Duration::from_millis(10);
/// How long a controller may take to identify itself: on a line at the wrong speed, noise never ends.
const GREETING: Duration = Duration::from_secs(8);

pub(super) struct Work {
    pub(super) order: Order,
    /// The section that this run started with, and seconds of each section from there.
    pub(super) from: usize,
    pub(super) each_s: Vec<f64>,
    pub(super) started: Duration,
}

#[derive(Default)]
pub(super) struct Hand {
    pub(super) until: Option<Duration>,
    pub(super) unlocked: bool,
    /// The zero that was requested and not yet confirmed.
    pub(super) zero_asked: Option<Zero>,
    /// The user set zero of X and Y since the port was opened; the position of the zero before.
    pub(super) zero_set: bool,
    pub(super) zero_before_mm: Option<[f64; 3]>,
    /// The user set zero of X or Y since the port was opened, by any method: a difference from the job's
    /// zero is intended.
    pub(super) zero_meant: bool,
    /// A job ended and parking is due: as soon as the controller is idle, unless a request arrives first.
    pub(super) parks: bool,
    /// The job stops after the current hole: no automatic move may follow, not even after the last hole.
    pub(super) stops_after: bool,
    /// Reference of the Z zero, if it was set since the port was opened and is still valid.
    pub(super) height: Option<HeightSet>,
}

#[derive(Clone, PartialEq)]
pub(super) enum Zero {
    Plane,
    Edge,
    Height(HeightSet),
}

/// What a station needs to know from its caller.
pub struct Setup {
    /// Time scale of a simulated controller, 1 for real time.
    pub speed: f64,
    pub time: Time,
    /// Decides which requests of pages are still valid.
    pub tickets: Arc<Tickets>,
    pub named: Option<Named>,
    /// The station is in the worker of a page: the job ends with the page.
    pub in_page: bool,
    /// If the command line is the client: its job, and whether opening the port may reset the controller.
    pub command: Option<(Attended, ResetOnOpen)>,
}

#[derive(Clone)]
pub struct Named {
    pub machine: Machine,
    /// Its profile, if it is a model that Annulus knows.
    pub mill: Option<&'static MillProfile>,
}

pub struct Station<F> {
    pub(super) attended: Attended,
    tickets: Arc<Tickets>,
    tells: Vec<Tell>,
    /// Notices for the command line, if it is the client.
    pub(super) notices: Option<Vec<Told>>,
    pub(super) ledger: Ledger<F>,
    pub(super) bringing: Option<Bringing>,
    pub(super) machine: Machine,
    pub(super) named: Option<Named>,
    pub(super) in_page: bool,
    pub(super) mill: Option<&'static MillProfile>,
    pub(super) lengths: ToolLengths,
    /// Whether opening the port may reset the controller.
    pub(super) reset: ResetOnOpen,
    /// The tool-change macro; empty if the user changes tools.
    pub(super) changer: ToolMacro,
    pub(super) programs: Programs,
    pub(super) armed: Option<Armed>,
    pub(super) work: Option<Work>,
    pub(super) offer: Option<Order>,
    pub(super) alarm: Option<Diagnostic>,
    pub(super) hand: Hand,
    pub(super) surface: BoardSurface,
    pub(super) checked: CheckModeReport,
    trust: Trust,
    written: Vec<u8>,
    pub(super) greeted: bool,
    over: bool,
    opened: Duration,
    host: Host,
    /// The host stalled too long, and the user has not continued since.
    pub(super) is_late: bool,
    speed: f64,
    pub(super) time: Time,
    pub(super) told: (Option<Status>, Duration),
    pub(super) tools_told: ToolsReport,
}

impl<F: Files> Station<F> {
    /// Opens the station whose ledger is in `files`; its port is open.
    pub fn open(mut files: F, setup: Setup) -> Result<Self, Diagnostic> {
        let Setup { speed, time, tickets, named, in_page, command } = setup;
        if !(speed.is_finite() && (0.01..=1e6).contains(&speed)) {
            return Err(error!("control.speed_range", speed = speed));
        }
        let surface = BoardSurface::kept(&mut files);
        let mut ledger = Ledger::open(files)?;
        let notices = command.as_ref().map(|_| Vec::new());
        let offer = if command.is_some() { None } else { ledger.broken_off() };
        let (attended, reset) = command.unwrap_or_else(|| {
            (Attended::new(ledger.entry().clone()), lengths::reset_of(&ledger.settings()))
        });
        let opened = time();
        let mut station = Self {
            attended,
            tickets,
            tells: Vec::new(),
            notices,
            ledger,
            bringing: None,
            machine: machine::hobby_3018(),
            named,
            in_page,
            mill: None,
            lengths: ToolLengths::default(),
            reset,
            changer: ToolMacro::default(),
            programs: Programs::of(offer.as_ref().map(|order| (order.key.clone(), order.bytes.clone()))),
            armed: None,
            work: None,
            offer,
            alarm: None,
            hand: Hand::default(),
            surface,
            checked: CheckModeReport::default(),
            trust: Trust::Lost,
            written: Vec::new(),
            greeted: false,
            over: false,
            opened,
            host: Host::new(opened, speed),
            is_late: false,
            speed,
            time,
            told: (None, Duration::ZERO),
            tools_told: ToolsReport::default(),
        };
        station.engine(match station.reset {
            ResetOnOpen::Usual => EngineEvent::Opened,
            ResetOnOpen::Never => EngineEvent::OpenedSparing,
        });
        Ok(station)
    }

    /// Takes over from the station `before`, whose port was lost. Its alarm stays until the user
    /// acknowledges it. The user may have changed the ledger meanwhile.
    pub fn succeed(&mut self, before: Self) {
        self.attended.succeed(&before.attended);
        self.alarm = self.alarm.take().or(before.alarm);
        self.programs.follow(before.programs);
        self.surface.map = before.surface.map;
        // While the port was lost, another process may have resumed the job.
        if !self.ledger.is_newer_than(&before.ledger) {
            (self.ledger, self.offer) = (before.ledger, before.offer);
        }
        self.describe();
        let greeting = self.greeting();
        self.tells.extend(greeting);
    }

    /// The pending alarm.
    pub fn alarm(&self) -> Option<&Diagnostic> {
        self.alarm.as_ref()
    }

    pub(super) fn tell(&mut self, tell: Tell) {
        self.tells.push(tell);
    }

    pub fn tells(&mut self) -> Vec<Tell> {
        std::mem::take(&mut self.tells)
    }

    pub fn bytes(&mut self, bytes: Vec<u8>) {
        self.look_at_host();
        self.by_itself(EngineEvent::Bytes(bytes));
    }

    /// The port is closed.
    pub fn unplugged(&mut self) {
        self.by_itself(EngineEvent::Closed);
        self.over = true;
        if !self.in_page && self.alarm.is_none() {
            self.alarm = Some(error!("grbl.cable_pulled"));
        }
    }

    /// Reports a pending alarm now: in a page, no status follows.
    pub(super) fn say_farewell(&mut self) {
        if let Some(why) = self.alarm.take() {
            self.tell(Tell::Refused { why });
        }
    }

    /// Takes the bytes for the port, in order. The caller confirms each batch with [`Self::carried`].
    pub fn written(&mut self) -> Vec<u8> {
        if !self.written.is_empty() {
            self.host.is_written((self.time)());
        }
        std::mem::take(&mut self.written)
    }

    /// The port accepted the oldest written batch.
    pub fn carried(&mut self) {
        self.look_at_host();
        self.host.is_carried((self.time)());
    }

    /// After a long stall of the host, the controller has run empty and stopped. The job is held until the
    /// user resumes it. The position is still valid. What can't be held now, such as a tool measurement, is
    /// held as soon as the job moves.
    pub(super) fn look_at_host(&mut self) {
        let news = self.host.look((self.time)());
        if news.is_some() {
            self.by_itself(EngineEvent::Late);
        }
        if news == Some(HostNews::TooLate) {
            (self.is_late, self.hand.parks) = (true, false);
            if self.attended.controller().parks() {
                self.by_itself(EngineEvent::Ask(EngineAsk::JogCancel));
            }
        }
        let phase = self.attended.controller().phase;
        if self.is_late && matches!(phase, EnginePhase::Running | EnginePhase::Surveying) {
            self.is_late = false;
            self.by_itself(EngineEvent::Ask(EngineAsk::Hold));
            let command = self.is_for_command();
            let code = if command { code!("grbl.command_stood") } else { code!("grbl.computer_stood") };
            let why = Diagnostic::warning(code).with("seconds", HELD_AFTER.as_secs());
            self.notice(Told::Found(why.clone()));
            self.tell(Tell::Refused { why });
        }
    }

    /// Returns `true` if the session ended and the port should be closed.
    pub fn is_over(&self) -> bool {
        self.over
    }

    /// Returns `true` if the controller identified itself since the port was opened.
    pub fn greeted(&self) -> bool {
        self.greeted
    }

    pub fn upload(&mut self, upload: Upload) {
        // The program of a running or interrupted job must not be dropped.
        let stays = self.work.as_ref().map(|work| &work.order).or(self.offer.as_ref());
        let stays = stays.map(|order| &order.key);
        self.programs.keep(upload, stays);
    }

    pub fn job(&self, key: &str) -> Option<&[u8]> {
        self.programs.bytes(key)
    }

    /// Does everything that is due now. Returns the delay until the next call.
    pub fn advance(&mut self) -> Duration {
        self.look_at_host();
        let now = (self.time)();
        if self.hand.until.is_some_and(|until| now > until) {
            self.end_jog();
        }
        self.by_itself(EngineEvent::Tick);
        if self.state() == State::Ready && std::mem::take(&mut self.hand.parks) {
            self.parks_after_job();
        }
        // An understood status proves that the line speed is right. A controller that must not be reset may
        // take longer to identify itself. The command line has its own limit.
        let is_waited_for = self.reset == ResetOnOpen::Never && self.attended.controller().status.is_some();
        let is_silent = !self.greeted && !is_waited_for && !self.is_for_command();
        self.over |= is_silent && now.saturating_sub(self.opened + self.host.stood()) > GREETING;
        TURN
    }

    fn end_jog(&mut self) {
        let needs_page = self.hand.until.take().is_some();
        if needs_page && self.attended.controller().phase == EnginePhase::Jogging {
            self.engine(EngineEvent::Ask(EngineAsk::JogCancel));
        }
    }

    /// Handles a message from a page's connection.
    pub fn take(&mut self, message: Message) {
        self.look_at_host();
        if matches!(message, Message::Ask { .. } | Message::Stop) {
            self.hand.parks = false;
        }
        match message {
            Message::Ask { ask, ticket, reply } => {
                let may = ticket.map_or(Ok(()), |ticket| self.tickets.check(ticket));
                let continues =
                    matches!(ask, Ask::Start { .. } | Ask::Resume | Ask::ToolChanged | Ask::Survey { .. });
                let answer = may.and_then(|()| self.asked(ask));
                // A refused request starts nothing that the user could expect.
                self.is_late &= !(continues && answer.is_ok());
                let _ = reply.send(answer.map(|()| Vec::new()));
            }
            Message::Stop => {
                let found = self.engine(EngineEvent::Ask(EngineAsk::Stop));
                // A stop during a tool change leaves the held tool unknown: report that.
                for why in found.into_iter().filter(|why| why.code == code!("changer.stopped")) {
                    self.tell(Tell::Refused { why });
                }
            }
            Message::Greeting(reply) => drop(reply.send(self.greeting())),
            Message::ControlChanged => self.end_jog(),
            // Other messages come from executors and planners, which a controller doesn't have.
            _ => {}
        }
    }

    /// Handles an event that no request caused. An error that ends the current activity becomes an alarm.
    fn by_itself(&mut self, event: EngineEvent) {
        for why in self.engine(event) {
            let phase = self.attended.controller().phase;
            let ends = matches!(
                phase,
                EnginePhase::Stopping | EnginePhase::Locked | EnginePhase::Closed | EnginePhase::Greeting
            );
            if why.severity == Severity::Error && ends {
                // "Unplugged" explains more than "no response", so it replaces that alarm.
                if self.alarm.is_none() || why.code == code!("grbl.unplugged") {
                    self.alarm = Some(why);
                }
            } else {
                self.tell(Tell::Refused { why });
            }
        }
    }

    /// Feeds an event to the engine and carries out the resulting work. Returns the problems found.
    pub(super) fn engine(&mut self, event: EngineEvent) -> Vec<Diagnostic> {
        let passed = (self.time)().saturating_sub(self.opened + self.host.stood());
        let now_ms = (passed.as_secs_f64() * 1e3 * self.speed) as u64;
        let (mut found, mut is_saved) = (Vec::new(), true);
        for due in self.attended.event(now_ms, event) {
            match due {
                Due::Write(bytes) => self.written.extend(bytes),
                Due::Close => self.over = true,
                Due::Keep(entry) => {
                    if let Some(why) = self.keep(&entry) {
                        is_saved = false;
                        found.push(why.clone());
                        self.notice(Told::Found(why));
                    }
                }
                Due::Tell(told) => {
                    match &told {
                        Told::Found(why) => found.push(why.clone()),
                        told => self.happened(told),
                    }
                    self.notice(told);
                }
            }
        }
        if self.attended.controller().height() == BoardHeight::Unknown {
            self.hand.height = None;
        }
        // Without a saved progress nothing new may start. A job that has ended needs no hold.
        if !is_saved && self.attended.controller().phase == EnginePhase::Running {
            found.extend(self.engine(EngineEvent::Ask(EngineAsk::Hold)));
        }
        found
    }

    /// Saves the progress.
    fn keep(&mut self, entry: &AttendedJob) -> Option<Diagnostic> {
        let wear = self.wear_now();
        let failed = if self.is_for_command() {
            self.ledger.save(entry, wear).err()
        } else if self.bringing.is_none() && self.work.is_none() {
            // No job of ours is running, so this is not its end.
            return None;
        } else {
            // Drop the files and options of an earlier job of the command line.
            let entry = AttendedJob { files: Vec::new(), given: JobGiven::default(), ..entry.clone() };
            self.ledger.write(self.bringing.take(), &entry, wear).err()
        };
        self.tell_tools();
        failed
    }

    fn happened(&mut self, told: &Told) {
        match told {
            Told::Greeted(info) => {
                self.greeted = true;
                let homes = settings::on(&info.values, 22);
                if !homes && self.attended.controller().trust != Trust::Trusted {
                    self.lost_place();
                }
                self.describe();
                let greeting = self.greeting();
                self.tells.extend(greeting);
            }
            Told::ZeroSet => {
                match self.hand.zero_asked.take() {
                    Some(Zero::Plane) => (self.hand.zero_set, self.hand.zero_meant) = (true, true),
                    Some(Zero::Edge) => self.hand.zero_meant = true,
                    Some(Zero::Height(set)) => self.hand.height = Some(set),
                    None => {}
                }
                self.tell_surface();
            }
            Told::Now(now) => {
                let homes = settings::on(&self.attended.controller().info.values, 22);
                if self.trust == Trust::Trusted && now.trust != Trust::Trusted && !homes {
                    self.lost_place();
                }
                self.trust = now.trust;
            }
            Told::Ended(ending) => self.ended(*ending),
            Told::Survey(news) => self.touched(news),
            Told::Check(news) => self.was_read(news),
            Told::ToolWanted { .. }
            | Told::ToolFetched { .. }
            | Told::Found(_)
            | Told::Progress
            | Told::Handled
            | Told::Gone => {}
        }
    }

    /// Forgets zero and height: without limit switches they do not survive a lost position.
    fn lost_place(&mut self) {
        (self.hand.height, self.hand.zero_set, self.hand.zero_before_mm) = (None, false, None);
        self.surface_is_lost();
    }

    fn parks_after_job(&mut self) {
        if let Err(why) = self.park() {
            self.tell(Tell::Refused { why });
        }
    }

    fn ended(&mut self, ending: Ending) {
        let Some(work) = self.work.take() else { return };
        let done = ending == Ending::Done;
        let stops = std::mem::take(&mut self.hand.stops_after);
        self.hand.parks = done && !stops && self.machine.park.after_job;
        let legs =
            if done { work.order.program.legs.len() } else { work.order.leg(self.attended.entry().done) };
        let (holes_done, toolpaths_done) = made(work.order.program.legs.iter().take(legs));
        self.tell(Tell::Ended(JobEnd { job: work.order.key.clone(), ending, holes_done, toolpaths_done }));
        self.armed = None;
        self.offer = (!done && self.attended.entry().done > 0).then_some(work.order);
        if let Some(offer) = self.offer_tell() {
            self.tell(offer);
        }
    }
}
