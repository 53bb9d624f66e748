//! Engine of a controller on a serial line: (state, event) → (state, actions).
//!
//! ```text
//! Closed ─▶ Greeting ─▶ Ready ─┬─ Homing, Jogging, Probing, Checking ─▶ Ready
//!               │         ▲    └─ Running ⇄ Holding, Held ─▶ Stopping ─▶ Ready
//!               ▼         │         └─ ToolChange (jog, probe, zero), Changing, Measuring ─▶ Running
//!             Locked ─────┘ home, unlock
//! ```
//!
//! Times in ms of any monotonic clock; positions in mm.
//!
//! Never guess a position. Trust it after homing, or after the user set zero. A disconnect, an unrequested
//! reset or an alarm ends the trust (`alarm`).

use super::alarm::{ProbeAlarm, RESET_WANTED};
use super::asks::{EngineAction, EngineAsk, EngineEvent, EnginePhase, Info, signs};
use super::buffer::{Buffer, USUAL_RX_BYTES, stands_alone};
use super::changer::{ChangerLine, ChangerRun};
use super::check::CheckRun;
use super::depth::TipDepth;
use super::ends::AxisEnds;
use super::ends::Ends;
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
use annulus_core::control::{Ending, Trust};
use annulus_core::diagnostic::Diagnostic;
use std::collections::VecDeque;
use std::sync::Arc;

const ASK_SOON_MS: u64 = 100;
const ASK_USUALLY_MS: u64 = 200;
const ASK_LATE_MS: u64 = 400;
/// This many late reports in a row mean that the line or the controller is busy, as with CH340 chips and
/// hubs. A late report arrives after the next query was due.
const LATE_REPORTS: u32 = 5;
const ASK_AGAIN_MS: u64 = 600;
const SILENT_MS: u64 = 4_000;
const GREET_MS: u64 = 2_500;
const RESET_MS: u64 = 1_000;
const RESETS: u32 = 5;
/// GRBL error of a line that is refused because the controller is locked.
const LOCKED: u16 = 9;

#[derive(Clone, Debug, PartialEq)]
pub(super) enum Meaning {
    Greeting(bool),
    Home,
    Unlock,
    Jog,
    Written,
    Echo,
    Probe { plate_mm: f64, up_mm: f64 },
    Edge { axis: usize, radius_mm: f64, back_mm: f64 },
    Survey(Option<SurveyStep>),
    Setter(Option<SetterStep>),
    Changer(ChangerLine),
    CheckMode,
    Check { text: String, section: usize, line: u32 },
    Job { text: String, wait_s: f64 },
}

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Outgoing {
    pub(super) text: String,
    pub(super) meaning: Meaning,
}

#[derive(Debug)]
pub struct Controller {
    pub phase: EnginePhase,
    pub trust: Trust,
    pub info: Info,
    pub status: Option<ControllerStatus>,
    pub zero_mm: Option<[f64; 3]>,
    pub modes: Option<Modes>,
    pub(super) now_ms: u64,
    pub(super) is_spared: bool,
    pub(super) is_waited_for: bool,
    pub(super) ear: Ear,
    pub(super) buffer: Buffer<Outgoing>,
    pub(super) queue: VecDeque<Outgoing>,
    pub(super) asked_ms: Option<u64>,
    pub(super) last_ask_ms: u64,
    pub(super) late_reports: u32,
    pub(super) heard_ms: u64,
    pub(super) moved_ms: u64,
    /// The engine requested a reset and waits for the banner: since when, and the number of tries.
    pub(super) reset_at: Option<(u64, u32)>,
    pub(super) since_ms: u64,
    pub(super) needs_reset: bool,
    pub(super) probe_alarm: ProbeAlarm,
    pub(super) after_reset: Option<Meaning>,
    pub(super) zero_wanted: Option<ZeroWanted>,
    pub(super) zero_refused: bool,
    pub(super) height: BoardHeight,
    pub(super) depth: TipDepth,
    pub(super) stopped_ms: Option<u64>,
    pub(super) homing: Homing,
    pub(super) ends: [Option<AxisEnds>; 3],
    pub(super) jog: Option<JogRun>,
    pub(super) park: Option<ParkRun>,
    /// End of the jog was requested; the request is repeated if the jog still moves.
    pub(super) jog_end: JogEnd,
    pub(super) idle_reports: u32,
    pub(super) rests_overdue: u32,
    pub(super) stand_reports: u32,
    pub(super) ready_asked_ms: Option<u64>,
    pub(super) probed: Option<bool>,
    pub(super) probed_at_mm: Option<[f64; 3]>,
    pub(super) run: Option<Run>,
    pub(super) survey: Option<SurveyRun>,
    pub(super) setter: Option<SetterRun>,
    pub(super) changer: Option<ChangerRun>,
    /// Z zero minus the height at which the tool setter meets the same tool, mm.
    pub(super) reference_mm: Option<f64>,
    pub(super) check: Option<CheckRun>,
    pub(super) overrides: OverrideWishes,
    pub(super) ending: Option<Ending>,
    pub sent_lines: u64,
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
            zero_refused: false,
            height: BoardHeight::Unknown,
            depth: TipDepth::default(),
            stopped_ms: None,
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
        // Identification must not disturb a running machine, but STOP always stops it.
        EngineEvent::Ask(EngineAsk::Stop) if controller.spares() => {
            controller.write(signs::HOLD);
            controller.drop_lines();
            controller.is_spared = false;
        }
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
    pub fn routine(&self) -> Option<&Arc<Routine>> {
        self.run.as_ref().map(Run::routine)
    }

    pub fn place(&self) -> Option<[f64; 3]> {
        let status = self.status.as_ref()?;
        let (machine, zero) = (status.machine_mm?, self.zero_mm?);
        Some(core::array::from_fn(|axis| machine[axis] - zero[axis]))
    }

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

    pub(super) fn unit_mm(&self) -> f64 {
        if settings::in_inches(&self.info.values) { MM_PER_INCH } else { 1.0 }
    }

    /// A setting has changed. If the unit changed, drop values in the old unit. During identification,
    /// convert the zero: only its unit was misread.
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
            self.depth = self.depth.restarted();
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
                // The status report shows the lock, with a better message.
                if !comes_to_rest || number != LOCKED {
                    self.found(why.with("line", text));
                }
                if meaning == Meaning::Unlock {
                    self.unlock_failed();
                }
                // While stopping, the reset at standstill ends everything, regardless of the answer.
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

    /// Returns to the state before a jog or a measurement; if that moved the machine, stops first.
    pub(super) fn rest(&mut self) {
        self.queue.clear();
        let phase = match () {
            () if self.setter.is_some() => EnginePhase::Jogging,
            () if self.run.is_some() => EnginePhase::ToolChange,
            () => EnginePhase::Ready,
        };
        self.set(phase);
        // The reference for all tools could not be measured: the tip is up and nothing has started.
        if phase == EnginePhase::ToolChange && self.run.as_ref().is_some_and(Run::is_unasked) {
            self.stop(Ending::Alarm);
        }
    }

    fn hand_rests(&self) -> bool {
        self.buffer.is_empty() && self.queue.is_empty() && !self.jog_goes_on()
    }

    /// A jog ended: the machine is stopped, unless the move to the park position continues.
    fn hand_is_over(&mut self) {
        // GRBL 1.1h reports Idle but reads no more lines if a jog cancel arrives just as the jog ends. A resume
        // ends that, and moves nothing: nothing is planned.
        if self.jog_is_to_end() {
            self.write(signs::RESUME);
        }
        if !self.park_goes_on() {
            self.rest();
        }
    }

    fn watches_report(&mut self, doing: ReportedState, fresh: bool) {
        self.depth_reported();
        self.jog_reported(doing, fresh);
        self.alarm_reported(doing, fresh);
        self.stand_reported(doing, fresh);
    }

    fn reported(&mut self, status: ControllerStatus) {
        // A report counts as fresh only if it answers our query; others may be old.
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
        self.watches_report(doing, fresh);
        match self.phase {
            EnginePhase::Greeting if self.reset_at.is_none() && self.info.banner.is_empty() => {
                self.strange(doing);
            }
            EnginePhase::Jogging if fresh && doing == ReportedState::Idle && self.hand_rests() => {
                self.hand_is_over();
            }
            // The cancel was lost, or came before the move began.
            EnginePhase::Jogging if self.jog_is_to_end() && doing == ReportedState::Jog => {
                self.write(signs::JOG_CANCEL);
            }
            // A jog that a door or a button holds never ends by itself. At standstill a reset keeps the
            // position.
            EnginePhase::Jogging if self.jog_is_to_end() && doing.is_held_at_rest() => self.reset(),
            // If it was locked at identification, that was already reported.
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
        // A controller that waits for its reset may be silent.
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
            // A jog is paced by its reports.
            None if soon && (self.jog.is_some() || self.late_reports < LATE_REPORTS) => ASK_SOON_MS,
            None => ASK_USUALLY_MS,
        };
        // Delay queries shortly before a position check: right after this query the check could not send its
        // own.
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
