//! The engine of a controller by serial line: (state, event) → (state, actions).
//!
//! ```text
//! Closed ─▶ Greeting ─▶ Ready ─┬─ Homing, Jogging, Probing, Checking ─▶ Ready
//!               │         ▲    └─ Running ⇄ Holding, Held ─▶ Stopping ─▶ Ready
//!               ▼         │         └─ ToolChange (jog, probe, zero), Changing, Measuring ─▶ Running
//!             Locked ─────┘ home, unlock
//! ```
//!
//! Comes in: bytes, time, a link that opens and closes, what a person asks. Goes out: bytes to be written and what there is to tell.
//! Times in ms of any clock that only goes forward; places in mm. Knows no port, no page, no clock of its own.
//!
//! A position is never guessed: it is trusted after homing, or after a person set zero; a link that was lost, a reset that nobody asked
//! for and alarms end the trust (`alarm`).

use super::alarm::{ProbeAlarm, RESET_WANTED};
use super::asks::{EngineAction, EngineAsk, EngineEvent, EnginePhase, Info, signs};
use super::buffer::{Buffer, USUAL_RX_BYTES, stands_alone};
use super::changer::{ChangerLine, ChangerRun};
use super::check::CheckRun;
use super::ends::AxisEnds;
use super::heard::{ControllerStatus, Ear, HeardLine, Modes, ReportedState, hear};
use super::height::{BoardHeight, ZeroWanted};
use super::home::Homing;
use super::jog::{JogEnd, JogRun};
use super::meet::ResetOnOpen;
use super::overrides::OverrideWishes;
use super::park::ParkRun;
use super::routine::Routine;
use super::run::Run;
use super::setter::{SetterRun, SetterStep};
use super::settings::{self, MM_PER_INCH};
use super::survey::{SurveyRun, SurveyStep};
use crate::control::{Ending, Trust};
use crate::diagnostic::Diagnostic;
use std::collections::VecDeque;
use std::sync::Arc;

/// Between two questions for the status; with a look that waits, and without.
const ASK_SOON_MS: u64 = 100;
const ASK_USUALLY_MS: u64 = 200;
/// The same where a look is near.
const ASK_LATE_MS: u64 = 400;
/// Reports that come so late that another could have been asked for, after each other: what is between, or the board itself, has enough to
/// do, as CH340 chips and hubs have.
const LATE_REPORTS: u32 = 5;
/// A question without an answer is asked again.
const ASK_AGAIN_MS: u64 = 600;
/// Nothing heard for so long: nobody is there.
const SILENT_MS: u64 = 4_000;
/// How long a board takes to greet after its port was opened.
const GREET_MS: u64 = 2_500;
/// How long it takes after a reset.
const RESET_MS: u64 = 1_000;
/// How often a reset is tried.
const RESETS: u32 = 5;
/// The error of a line that was refused because the controller is locked.
const LOCKED: u16 = 9;

/// What a line in flight is for.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Meaning {
    /// Finding out who is there; the last of those.
    Greeting(bool),
    Home,
    Unlock,
    Jog,
    /// A stored place or a setting is written.
    Written,
    /// What was written is read again.
    Echo,
    Probe {
        plate_mm: f64,
        up_mm: f64,
    },
    Edge {
        axis: usize,
        radius_mm: f64,
        back_mm: f64,
    },
    /// A line of a survey; the words before it have no answer of their own.
    Survey(Option<SurveyStep>),
    /// A line of the measurement of a tool; the same.
    Setter(Option<SetterStep>),
    /// A line of a tool change that the machine makes itself.
    Changer(ChangerLine),
    /// `$C`, into check mode.
    CheckMode,
    /// A line of a job that is read in check mode: its text, and the section and the line of the program.
    Check {
        text: String,
        section: usize,
        line: u32,
    },
    /// A line of a job: its text, how long it may wait.
    Job {
        text: String,
        wait_s: f64,
    },
}

/// A line that is to be sent, or was.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Outgoing {
    pub(super) text: String,
    pub(super) meaning: Meaning,
}

/// Everything that is known of a controller.
#[derive(Debug)]
pub struct Controller {
    /// What it is doing.
    pub phase: EnginePhase,
    /// How well its position is known.
    pub trust: Trust,
    /// Who it is.
    pub info: Info,
    /// What it reported last; places in mm.
    pub status: Option<ControllerStatus>,
    /// Work zero in machine coordinates, mm.
    pub zero_mm: Option<[f64; 3]>,
    /// The words in force, heard last.
    pub modes: Option<Modes>,
    pub(super) now_ms: u64,
    /// Opening the port was not to disturb the board; and it was told that it does something meanwhile.
    pub(super) is_spared: bool,
    pub(super) is_waited_for: bool,
    pub(super) ear: Ear,
    pub(super) buffer: Buffer<Outgoing>,
    pub(super) queue: VecDeque<Outgoing>,
    /// When the status was asked for, while no answer came.
    pub(super) asked_ms: Option<u64>,
    /// When it was asked for last.
    pub(super) last_ask_ms: u64,
    /// Reports that came late, after each other.
    pub(super) late_reports: u32,
    /// When anything was heard last.
    pub(super) heard_ms: u64,
    /// When a line was sent or answered last.
    pub(super) moved_ms: u64,
    /// A banner is due because the engine asked for it: since when, and how often it was tried.
    pub(super) reset_at: Option<(u64, u32)>,
    /// Since when the phase is what it is.
    pub(super) since_ms: u64,
    /// The controller has to begin anew before it can be unlocked.
    pub(super) needs_reset: bool,
    /// Whether the alarm that locked it may have been another one than was heard.
    pub(super) probe_alarm: ProbeAlarm,
    /// What is to be sent once it has begun anew: `$X` or `$H`.
    pub(super) after_reset: Option<Meaning>,
    pub(super) zero_wanted: Option<ZeroWanted>,
    pub(super) height: BoardHeight,
    pub(super) homing: Homing,
    /// The ends of X, Y and Z, as homing told them.
    pub(super) ends: [Option<AxisEnds>; 3],
    /// The move by hand that is sent piece by piece.
    pub(super) jog: Option<JogRun>,
    /// A way to where it is parked.
    pub(super) park: Option<ParkRun>,
    /// The move by hand was to end: should it be heard of still, it is told so again.
    pub(super) jog_end: JogEnd,
    /// Reports of rest since it was to come to rest.
    pub(super) idle_reports: u32,
    /// Reports of rest since an answer is overdue, to questions of then.
    pub(super) rests_overdue: u32,
    /// Reports in this phase, each asked for, that something holds it.
    pub(super) stand_reports: u32,
    /// When a person said that the tool is in, while that waits for a zero to be taken.
    pub(super) ready_asked_ms: Option<u64>,
    pub(super) probed: Option<bool>,
    /// Where the probe met the board, machine coordinates, mm.
    pub(super) probed_at_mm: Option<[f64; 3]>,
    pub(super) run: Option<Run>,
    pub(super) survey: Option<SurveyRun>,
    pub(super) setter: Option<SetterRun>,
    pub(super) changer: Option<ChangerRun>,
    /// How much higher zero of Z is than the place where the tool setter meets the same tool, mm.
    pub(super) reference_mm: Option<f64>,
    pub(super) check: Option<CheckRun>,
    pub(super) overrides: OverrideWishes,
    pub(super) ending: Option<Ending>,
    /// Lines of jobs that were sent since the link was opened.
    pub sent_lines: u64,
    /// Those of them that were answered.
    pub answered_lines: u64,
    pub(super) out: Vec<EngineAction>,
}

impl Default for Controller {
    fn default() -> Self {
        Self {
            phase: EnginePhase::Closed,
            trust: Trust::Lost,
            info: Info::default(),
            status: None,
            zero_mm: None,
            modes: None,
            now_ms: 0,
            is_spared: false,
            is_waited_for: false,
            ear: Ear::default(),
            buffer: Buffer::new(USUAL_RX_BYTES),
            queue: VecDeque::new(),
            asked_ms: None,
            last_ask_ms: 0,
            late_reports: 0,
            heard_ms: 0,
            moved_ms: 0,
            reset_at: None,
            since_ms: 0,
            needs_reset: false,
            probe_alarm: ProbeAlarm::None,
            after_reset: None,
            zero_wanted: None,
            height: BoardHeight::Unknown,
            homing: Homing::default(),
            ends: [None; 3],
            jog: None,
            park: None,
            jog_end: JogEnd::NotYet,
            idle_reports: 0,
            rests_overdue: 0,
            stand_reports: 0,
            ready_asked_ms: None,
            probed: None,
            probed_at_mm: None,
            run: None,
            survey: None,
            setter: None,
            changer: None,
            reference_mm: None,
            check: None,
            overrides: OverrideWishes::default(),
            ending: None,
            sent_lines: 0,
            answered_lines: 0,
            out: Vec::new(),
        }
    }
}

/// The controller after `event` at `now_ms`, and what to do.
#[must_use]
pub fn step(mut controller: Controller, now_ms: u64, event: EngineEvent) -> (Controller, Vec<EngineAction>) {
    controller.now_ms = controller.now_ms.max(now_ms);
    let ran = controller.run.is_some();
    match event {
        EngineEvent::Opened => controller.opened(ResetOnOpen::Usual),
        EngineEvent::OpenedSparing => controller.opened(ResetOnOpen::Never),
        EngineEvent::Closed => controller.closed(),
        EngineEvent::Bytes(bytes) => {
            controller.heard_ms = controller.now_ms;
            for line in controller.ear.take(&bytes) {
                controller.heard(hear(&line));
            }
        }
        EngineEvent::Tick => {}
        EngineEvent::Late => {
            if let Some(run) = &mut controller.run {
                run.batch.disturbed = true;
            }
        }
        // Whatever it is doing there, a person wants it to stand still.
        EngineEvent::Ask(EngineAsk::Stop) if controller.spares() => controller.write(signs::HOLD),
        EngineEvent::Ask(ask) => controller.ask(ask),
    }
    controller.time();
    controller.tool_ready_waits();
    controller.send_overrides();
    controller.feed();
    if ran && controller.run.is_none() {
        controller.bit_is_another();
    }
    let out = std::mem::take(&mut controller.out);
    (controller, out)
}

impl Controller {
    /// The job that runs, or is held.
    pub fn routine(&self) -> Option<&Arc<Routine>> {
        self.run.as_ref().map(Run::routine)
    }

    /// Where the tip is in work coordinates, mm.
    pub fn place(&self) -> Option<[f64; 3]> {
        let status = self.status.as_ref()?;
        let (machine, zero) = (status.machine_mm?, self.zero_mm?);
        Some(core::array::from_fn(|axis| machine[axis] - zero[axis]))
    }

    /// The line of the file that is being run, as far as the reports show on the path.
    pub fn line(&self) -> Option<u32> {
        self.run.as_ref().and_then(Run::line)
    }

    pub(super) fn set(&mut self, phase: EnginePhase) {
        if self.phase != phase {
            (self.phase, self.since_ms, self.jog_end) = (phase, self.now_ms, JogEnd::NotYet);
            (self.ready_asked_ms, self.stand_reports) = (None, 0);
        }
        if phase != EnginePhase::Jogging {
            (self.jog, self.park) = (None, None);
        }
        if phase != EnginePhase::Measuring {
            self.setter = None;
        }
        if phase != EnginePhase::Locked {
            self.probe_alarm = ProbeAlarm::None;
        }
        if phase != EnginePhase::Changing {
            self.changer = None;
        }
        if phase == EnginePhase::ToolChange {
            self.person_is_asked();
        }
    }

    pub(super) fn write(&mut self, sign: u8) {
        self.out.push(EngineAction::Write(vec![sign]));
    }

    pub(super) fn found(&mut self, diagnostic: Diagnostic) {
        self.out.push(EngineAction::Found(diagnostic));
    }

    pub(super) fn send(&mut self, text: &str, meaning: Meaning) {
        self.queue.push_back(Outgoing { text: text.to_owned(), meaning });
    }

    /// What was sent and not answered is gone, what waited to be sent too.
    pub(super) fn drop_lines(&mut self) {
        self.buffer.clear();
        self.queue.clear();
        (self.asked_ms, self.jog) = (None, None);
    }

    pub(super) fn reset(&mut self) {
        self.write(signs::RESET);
        self.drop_lines();
        let tries = self.reset_at.map_or(0, |(_, tries)| tries);
        self.reset_at = Some((self.now_ms, tries + 1));
    }

    pub(super) fn closed(&mut self) {
        if self.phase == EnginePhase::Closed {
            return;
        }
        if self.run.take().is_some() {
            self.found(Diagnostic::error("grbl.unplugged"));
            self.out.push(EngineAction::Ended(Ending::Alarm));
        }
        self.survey_is_over(Some("level.unplugged"));
        self.check_is_over(Some(Diagnostic::error("grbl.check_unplugged")));
        self.drop_lines();
        self.ear.clear();
        self.lose_place();
        self.set(EnginePhase::Closed);
    }

    fn heard(&mut self, heard: HeardLine) {
        self.heard_homing(&heard);
        match heard {
            HeardLine::Banner(text) => self.greeted(text),
            HeardLine::Ok => self.answered(None),
            HeardLine::Error { number } => self.answered(Some(number)),
            HeardLine::Alarm { number } => self.alarmed(number),
            HeardLine::Status(status) => self.reported(*status),
            HeardLine::Setting { number, value } => self.setting_is(number, value),
            HeardLine::Version { version, .. } => self.info.version = version,
            HeardLine::Options(options) => {
                if options.rx_bytes > 0 {
                    self.buffer.resize(usize::from(options.rx_bytes));
                }
                self.info.options = options;
            }
            HeardLine::About { name, value } if self.info.about.len() < 64 => {
                self.info.about.insert(name, value);
            }
            HeardLine::Offset { name, places } => {
                let places = places.into_iter().map(|place| place * self.unit_mm()).collect();
                if self.info.offsets.len() < 32 || self.info.offsets.contains_key(&name) {
                    self.info.offsets.insert(name, places);
                }
            }
            HeardLine::Modes(mut modes) => {
                modes.feed_mm_per_min *= self.unit_mm();
                self.modes = Some(modes);
            }
            HeardLine::Probe { place_mm: place, met } => {
                self.probed = Some(met);
                self.probed_at_mm = Some(place.map(|value| value * self.unit_mm()));
            }
            HeardLine::Message(text) if text.contains(RESET_WANTED) => self.reset_is_wanted(),
            HeardLine::Message(text) => self.info.hear_ends(&text),
            HeardLine::About { .. } | HeardLine::Startup(_) | HeardLine::Other(_) => {}
        }
    }

    /// Millimetres in the unit of its reports.
    fn unit_mm(&self) -> f64 {
        if settings::in_inches(&self.info.values) { MM_PER_INCH } else { 1.0 }
    }

    /// A setting is so now. What was told in another unit is not known any more; while it greets, all of that was in the unit which is
    /// only known now.
    fn setting_is(&mut self, number: u16, value: f64) {
        let before = settings::in_inches(&self.info.values);
        self.info.values.insert(number, value);
        if settings::in_inches(&self.info.values) == before {
            return;
        }
        let factor = if before { 1.0 / MM_PER_INCH } else { MM_PER_INCH };
        let zero_mm = self.zero_mm.filter(|_| self.phase == EnginePhase::Greeting);
        (self.status, self.zero_mm) = (None, zero_mm.map(|zero| zero.map(|value| value * factor)));
    }

    fn greeted(&mut self, banner: String) {
        let expected = self.reset_at.take().is_some();
        self.alarm_is_over();
        self.drop_lines();
        self.info.banner = banner;
        (self.needs_reset, self.status, self.zero_mm) = (false, None, None);
        let stopping = self.phase == EnginePhase::Stopping;
        if !expected {
            self.lose_place();
        }
        let ending = self.ending.take().unwrap_or(Ending::Stopped);
        if self.run.take().is_some() {
            if !stopping {
                self.found(Diagnostic::error("grbl.reset_by_itself"));
            }
            self.out.push(EngineAction::Ended(if stopping { ending } else { Ending::Alarm }));
        }
        self.survey_is_over((!stopping).then_some("level.reset"));
        self.check_greeted();
        self.overrides = OverrideWishes::default();
        self.set(EnginePhase::Greeting);
        self.asks_who();
    }

    fn answered(&mut self, error: Option<u16>) {
        (self.moved_ms, self.rests_overdue) = (self.now_ms, 0);
        let Some(Outgoing { meaning, text: sent }) = self.buffer.answered() else {
            if self.run.is_some() {
                self.trouble(Diagnostic::error("grbl.answer_extra"));
            }
            return;
        };
        match (meaning, error) {
            (Meaning::Job { text, .. }, Some(number)) => {
                let why = Diagnostic::error(&settings::error_code(number)).with("number", number);
                self.trouble(why.with("line", text));
            }
            (Meaning::Job { .. }, None) => self.answered_lines += 1,
            (Meaning::Changer(line), error) => self.changer_answered(line, error),
            (Meaning::CheckMode, error) => self.check_mode_answered(error),
            (Meaning::Check { text, section, line }, error) => {
                self.check_answered(&text, (section, line), error);
            }
            (Meaning::Greeting(last), _) => {
                if last && self.is_known() {
                    self.is_met();
                    self.set(EnginePhase::Ready);
                    self.out.push(EngineAction::Greeted);
                    self.go_on_after_reset();
                }
            }
            (meaning, Some(number)) => {
                let text = match meaning {
                    Meaning::Home => "$H",
                    Meaning::Unlock => "$X",
                    _ => "",
                };
                let why = Diagnostic::error(&settings::error_code(number)).with("number", number);
                let comes_to_rest = meaning == Meaning::Jog && self.jog_refused();
                // That it is locked its report says, with what that means.
                if !comes_to_rest || number != LOCKED {
                    self.found(why.with("line", text));
                }
                if meaning == Meaning::Unlock {
                    self.unlock_failed();
                }
                // What comes to rest is reset there, whatever else was answered.
                if self.phase != EnginePhase::Stopping && !comes_to_rest {
                    self.survey_is_over(None);
                    self.rest();
                }
            }
            (meaning, None) => {
                if let Some((number, value)) = settings::written(&sent) {
                    self.setting_is(number, value);
                }
                self.done_by_hand(&meaning);
            }
        }
    }

    /// Back to what it was before a move by hand, or a measurement: what that moved comes to rest first.
    pub(super) fn rest(&mut self) {
        self.queue.clear();
        let phase = match () {
            () if self.setter.is_some() => EnginePhase::Jogging,
            () if self.run.is_some() => EnginePhase::ToolChange,
            () => EnginePhase::Ready,
        };
        self.set(phase);
        // What all tools were to go by could not be measured: the tip is up, and nothing was begun.
        if phase == EnginePhase::ToolChange && self.run.as_ref().is_some_and(Run::is_unasked) {
            self.stop(Ending::Alarm);
        }
    }

    /// Whether all of a move by hand was answered, and nothing of it is to come.
    fn hand_rests(&self) -> bool {
        self.buffer.is_empty() && self.queue.is_empty() && !self.jog_goes_on()
    }

    /// A move by hand is at its end: the machine rests, where no way to its parking place goes on.
    fn hand_is_over(&mut self) {
        if !self.park_goes_on() {
            self.rest();
        }
    }

    /// Places in mm, and what is not told as it was told last.
    fn completed(&mut self, mut status: ControllerStatus) -> ControllerStatus {
        let unit = self.unit_mm();
        let scaled = |place: Option<[f64; 3]>| place.map(|place| place.map(|value| value * unit));
        (status.machine_mm, status.work_mm, status.offset_mm) =
            (scaled(status.machine_mm), scaled(status.work_mm), scaled(status.offset_mm));
        status.feed_mm_per_min = status.feed_mm_per_min.map(|feed| feed * unit);
        if status.offset_mm.is_some() {
            self.zero_mm = status.offset_mm;
        }
        if let (None, Some(work), Some(zero)) = (status.machine_mm, status.work_mm, self.zero_mm) {
            status.machine_mm = Some(core::array::from_fn(|axis| work[axis] + zero[axis]));
        }
        if status.overrides.is_none() {
            status.overrides = self.status.as_ref().and_then(|before| before.overrides);
            status.accessories = self.status.as_ref().and_then(|before| before.accessories.clone());
        }
        status
    }

    fn reported(&mut self, status: ControllerStatus) {
        let fresh = self.asked_ms.take().is_some();
        let told = status.overrides.filter(|_| fresh);
        let late = self.now_ms >= self.last_ask_ms + ASK_SOON_MS;
        self.late_reports = if late || !fresh { self.late_reports + u32::from(fresh) } else { 0 };
        let doing = status.doing;
        self.rests_overdue += u32::from(fresh && doing.is_at_rest() && self.is_overdue());
        let status = self.completed(status);
        let before = self.status.replace(status);
        if self.began_anew(before.as_ref()) {
            return self.greets_anew();
        }
        let before = before.map(|before| before.doing);
        if let Some(told) = told {
            self.overrides_reported(told, self.last_ask_ms);
        }
        self.jog_reported(doing, fresh);
        self.alarm_reported(doing, fresh);
        self.stand_reported(doing, fresh);
        match self.phase {
            EnginePhase::Greeting if self.reset_at.is_none() && self.info.banner.is_empty() => {
                self.strange(doing);
            }
            EnginePhase::Jogging if fresh && doing == ReportedState::Idle && self.hand_rests() => {
                self.hand_is_over();
            }
            // It was not heard, or came before the move began.
            EnginePhase::Jogging if self.jog_is_to_end() && doing == ReportedState::Jog => {
                self.write(signs::JOG_CANCEL);
            }
            // A move by hand that is held by a door or a button never ends by itself: at rest a reset leaves the position as it was.
            EnginePhase::Jogging if self.jog_is_to_end() && doing.is_held_at_rest() => self.reset(),
            // What was locked when it greeted has said so there.
            EnginePhase::Ready
                if doing == ReportedState::Alarm
                    && before.is_none_or(|before| before == ReportedState::Alarm) =>
            {
                self.set(EnginePhase::Locked);
            }
            EnginePhase::Ready
            | EnginePhase::Jogging
            | EnginePhase::Probing
            | EnginePhase::Surveying
            | EnginePhase::Measuring
            | EnginePhase::Changing
            | EnginePhase::Checking
            | EnginePhase::Running
            | EnginePhase::Holding
            | EnginePhase::Held
            | EnginePhase::ToolChange
                if matches!(doing, ReportedState::Alarm | ReportedState::Sleep) =>
            {
                self.alarmed_unheard(doing);
            }
            EnginePhase::Locked
                if doing == ReportedState::Idle && self.buffer.is_empty() && !self.needs_reset =>
            {
                self.set(EnginePhase::Ready);
            }
            EnginePhase::Stopping => self.stopping(doing),
            EnginePhase::Checking => self.check_reported(doing, fresh.then_some(self.last_ask_ms)),
            EnginePhase::Homing => self.report_homing(doing, fresh),
            EnginePhase::Measuring | EnginePhase::Changing => self.change_reported(doing, fresh),
            EnginePhase::Surveying | EnginePhase::Holding if fresh && self.survey.is_some() => {
                self.survey_reported(self.last_ask_ms);
            }
            _ if self.run.is_some() => self.watch(doing, fresh),
            _ => {}
        }
    }

    /// What only time brings.
    fn time(&mut self) {
        if self.phase == EnginePhase::Closed {
            return;
        }
        if let Some((since, tries)) = self.reset_at
            && self.now_ms >= since + RESET_MS
        {
            if tries >= RESETS {
                return self.silent();
            }
            self.reset();
        }
        if self.phase == EnginePhase::Greeting
            && self.info.banner.is_empty()
            && self.now_ms < self.since_ms + GREET_MS
        {
            return;
        }
        if self.phase == EnginePhase::Homing {
            return self.time_homing();
        }
        // A board that waits for its reset need not say anything before.
        if self.phase == EnginePhase::Locked && self.needs_reset {
            self.heard_ms = self.now_ms;
        }
        if self.now_ms >= self.heard_ms.max(self.since_ms) + SILENT_MS && self.asked_ms.is_some() {
            return self.silent();
        }
        use EnginePhase::{Changing, Measuring, Stopping, Surveying};
        let soon = matches!(self.phase, Stopping | Measuring | Changing | Surveying)
            || self.jog.is_some()
            || self.run.as_ref().is_some_and(Run::looks);
        let wait = match self.asked_ms {
            Some(_) => ASK_AGAIN_MS,
            // A move by hand goes by its reports.
            None if soon && (self.jog.is_some() || self.late_reports < LATE_REPORTS) => ASK_SOON_MS,
            None => ASK_USUALLY_MS,
        };
        // So near to a look it is held back: the look's own question could not be asked at once after it.
        let held = self.run.as_ref().is_some_and(|run| run.ends_soon(self.now_ms));
        let wait = match () {
            () if self.may_look() || self.phase != EnginePhase::Running => wait,
            () if held => wait.max(ASK_LATE_MS),
            () => wait.max(ASK_USUALLY_MS),
        };
        if self.reset_at.is_none() && self.now_ms >= self.last_ask_ms + wait {
            self.write(signs::ASK);
            (self.last_ask_ms, self.asked_ms) = (self.now_ms, Some(self.now_ms));
            self.asked_for_look();
        }
        self.stalls();
    }

    /// Sends what has room.
    fn feed(&mut self) {
        loop {
            let Some(next) = self.queue.front() else {
                if !self.feed_run() && !self.feed_jog() && !self.feed_check() {
                    return;
                }
                continue;
            };
            let alone = stands_alone(&next.text);
            if self.reset_at.is_some() || !self.buffer.takes(next.text.len() + 1, alone) {
                return;
            }
            let Some(next) = self.queue.pop_front() else { return };
            self.put(next, alone);
        }
    }

    fn put(&mut self, next: Outgoing, alone: bool) {
        let mut bytes = next.text.clone().into_bytes();
        bytes.push(b'\n');
        self.sent_lines += u64::from(matches!(next.meaning, Meaning::Job { .. }));
        self.buffer.put(bytes.len(), alone, next);
        (self.moved_ms, self.rests_overdue) = (self.now_ms, 0);
        self.out.push(EngineAction::Write(bytes));
    }
}
