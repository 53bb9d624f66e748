//! Engine of a controller on a serial line: (state, event) → (state, actions).
//!
//! Times in ms of any monotonic clock; positions in mm.

use super::activity::{Activity, HOLD_REPORTS, Work};
use super::asks::{EngineAction, EngineAsk, EngineEvent, EnginePhase, realtime};
use super::context::{Context, Report};
use super::heard::{ControllerStatus, HeardLine, ReportedState, hear};
use super::identify::{Identify, ResetOnOpen};
use super::known::Known;
use super::line::Line;
use super::locked::RESET_WANTED;
use super::overrides::OverrideWishes;
use super::routine::Routine;
use super::setter::SetterStep;
use super::stopping::{IDLE_REPORTS, Stopping};
use crate::control::Ending;
use crate::diagnostic::Diagnostic;
use crate::level::Survey;
use crate::{code, error};
use std::ops::Deref;
use std::sync::Arc;

/// Interval of status queries: while a position check waits, and normally.
const ASK_SOON_MS: u64 = 100;
const ASK_USUALLY_MS: u64 = 200;
const ASK_LATE_MS: u64 = 400;
/// This many late reports in a row mean that the line or the controller is busy, as with CH340 chips and
/// hubs. A late report arrives after the next query was due.
const LATE_REPORTS: u32 = 5;
const ASK_AGAIN_MS: u64 = 600;
const SILENT_MS: u64 = 4_000;
const GREET_MS: u64 = 2_500;
/// Time for the banner after a reset.
const RESET_MS: u64 = 1_000;
/// Resets before giving up.
const RESETS: u32 = 5;

/// State of a controller. What is known of the machine is read from it directly.
#[derive(Debug, Default)]
pub struct Controller {
    pub phase: EnginePhase,
    context: Context,
    activity: Activity,
}

impl Deref for Controller {
    type Target = Known;

    fn deref(&self) -> &Known {
        &self.context.known
    }
}

#[must_use]
pub fn step(mut controller: Controller, now_ms: u64, event: EngineEvent) -> (Controller, Vec<EngineAction>) {
    controller.context.now_ms = controller.context.now_ms.max(now_ms);
    let had_job = controller.activity.job().is_some();
    controller.on_event(event);
    controller.on_time();
    if matches!(controller.activity, Activity::ToolChange(_)) {
        controller.advance(|activity, cx| match activity {
            Activity::ToolChange(change) => change.on_time(cx),
            activity => activity,
        });
    }
    if controller.activity.takes_overrides(&controller.context) {
        let cx = &mut controller.context;
        cx.overrides.due(cx.now_ms).into_iter().for_each(|sign| cx.write(sign));
    }
    controller.feed();
    if had_job && controller.activity.job().is_none() {
        controller.context.known.change_tool(false);
    }
    let out = std::mem::take(&mut controller.context.out);
    (controller, out)
}

impl Controller {
    pub fn routine(&self) -> Option<&Arc<Routine>> {
        self.activity.job().map(|job| job.routine())
    }

    /// The program line in work, derived from the position reports.
    pub fn line(&self) -> Option<u32> {
        self.activity.job().and_then(|job| job.line())
    }

    /// Takes over how far down the tip may be from `before`, the same machine at a port that was lost.
    pub fn succeed(&mut self, before: &Self) {
        let depth = before.context.known.depth.restarted();
        // Keep the worse of two estimates: a tip taken as too deep only costs a longer lift.
        if depth.lift_first_mm() > self.lift_first_mm() {
            self.context.known.depth = depth;
        }
    }

    /// True if the machine holds the current activity, or prevents a new one, and waits for Resume.
    pub fn stands(&self) -> bool {
        self.activity.is_held_at_machine(&self.context)
    }

    pub fn parks(&self) -> bool {
        self.activity.parks()
    }

    /// The survey in progress.
    pub fn survey(&self) -> Option<&Survey> {
        match &self.activity {
            Activity::Surveying(surveying)
            | Activity::Stopping(Stopping { work: Work::Survey(surveying), .. }) => Some(surveying.survey()),
            _ => None,
        }
    }

    pub fn measuring(&self) -> Option<SetterStep> {
        if let Activity::Measuring(measuring) = &self.activity { Some(measuring.step()) } else { None }
    }

    /// The current line of the tool change macro, from 1, and the number of lines.
    pub fn changing(&self) -> Option<[u32; 2]> {
        if let Activity::Changing(changing) = &self.activity { Some(changing.progress()) } else { None }
    }

    /// Replaces the activity. With the phase its time starts again.
    fn advance(&mut self, next: impl FnOnce(Activity, &mut Context) -> Activity) {
        let cx = &mut self.context;
        self.activity = next(std::mem::take(&mut self.activity), cx);
        let phase = self.activity.phase();
        if self.phase != phase {
            self.phase = phase;
            (cx.since_ms, cx.hold_reports) = (cx.now_ms, 0);
        }
    }

    fn on_event(&mut self, event: EngineEvent) {
        match event {
            EngineEvent::Opened => self.open(ResetOnOpen::Usual),
            EngineEvent::OpenedSparing => self.open(ResetOnOpen::Never),
            EngineEvent::Closed => self.close(),
            EngineEvent::Bytes(bytes) => {
                let cx = &mut self.context;
                cx.line.heard_ms = cx.now_ms;
                for line in cx.line.ear.take(&bytes) {
                    self.on_line(hear(&line));
                }
            }
            EngineEvent::Tick => {}
            EngineEvent::Late => {
                if let Some(job) = self.activity.job_mut() {
                    job.batch.disturbed = true;
                }
            }
            // Identification must not disturb a running machine, but STOP always stops it.
            EngineEvent::Ask(EngineAsk::Stop) if self.must_not_disturb() => {
                if let Activity::Identify(identify) = &mut self.activity {
                    identify.on_stop(&mut self.context);
                }
            }
            EngineEvent::Ask(ask) => self.advance(|activity, cx| activity.on_ask(cx, ask)),
        }
    }

    fn must_not_disturb(&self) -> bool {
        matches!(&self.activity, Activity::Identify(identify) if identify.must_not_disturb())
    }

    /// The port was opened. All that is remembered is how far down the tip may be.
    fn open(&mut self, reset: ResetOnOpen) {
        let now_ms = self.context.now_ms;
        let depth = self.context.known.depth.restarted();
        self.context = Context {
            now_ms,
            since_ms: now_ms,
            line: Line { heard_ms: now_ms, ..Line::default() },
            known: Known { depth, ..Known::default() },
            ..Context::default()
        };
        self.activity = Activity::Identify(Identify::opened(reset));
        self.phase = self.activity.phase();
    }

    fn close(&mut self) {
        if self.phase == EnginePhase::Closed {
            return;
        }
        self.advance(|activity, cx| {
            let work = activity.into_work();
            if let Work::Check(check) = &work {
                cx.out.push(check.over(Some(error!("grbl.check_unplugged"))));
            }
            work.end(cx, Some([code!("grbl.unplugged"), code!("level.unplugged")]), Ending::Alarm);
            cx.line.drop_lines();
            cx.line.ear.clear();
            cx.known.lose_place();
            Activity::Closed
        });
    }

    fn on_silence(&mut self) {
        let must_not_disturb = self.must_not_disturb();
        let cx = &mut self.context;
        cx.error(code!("grbl.no_answer"));
        // The controller may still receive: stop our own motion.
        if !must_not_disturb {
            cx.write(realtime::JOG_CANCEL);
            cx.write(realtime::HOLD);
        }
        cx.out.push(EngineAction::Close);
        self.close();
    }

    fn on_line(&mut self, heard: HeardLine) {
        if let Activity::Homing(homing) = &mut self.activity {
            homing.on_line(&heard);
        }
        let cx = &mut self.context;
        match heard {
            HeardLine::Banner(text) => self.on_banner(text),
            HeardLine::Ok => self.on_answer(None),
            HeardLine::Error { number } => self.on_answer(Some(number)),
            HeardLine::Alarm { number } => self.advance(|activity, cx| activity.on_alarm(cx, number)),
            HeardLine::Status(status) => self.on_status(*status),
            HeardLine::Setting { number, value } => {
                cx.known.set(number, value, self.phase == EnginePhase::Greeting);
            }
            HeardLine::Message(text) if text.contains(RESET_WANTED) => {
                self.advance(|activity, cx| activity.on_reset_wanted(cx));
            }
            HeardLine::Options(options) => {
                // Some firmwares leave the size out: the usual one stays.
                if options.rx_bytes > 0 {
                    cx.line.buffer.resize(usize::from(options.rx_bytes));
                }
                cx.known.info.options = options;
            }
            heard => cx.known.hear(heard),
        }
    }

    /// The controller restarted: what it did has ended. Identify it again.
    fn on_banner(&mut self, banner: String) {
        self.advance(|activity, cx| {
            let is_expected = cx.line.reset_at.take().is_some();
            if let Activity::Locked(locked) = &activity {
                locked.on_restart(cx);
            }
            // A restart empties the receive buffer: lines in flight are never answered.
            cx.line.drop_lines();
            cx.line.needs_reset = false;
            cx.known.info.banner = banner;
            (cx.known.status, cx.known.zero_mm) = (None, None);
            if !is_expected {
                cx.known.restart();
            }
            let ending =
                if let Activity::Stopping(stopping) = &activity { Some(stopping.ending) } else { None };
            let codes = ending.is_none().then_some([code!("grbl.reset_by_itself"), code!("level.reset")]);
            let work = activity.into_work();
            if let Work::Check(check) = &work {
                cx.out.push(check.on_banner());
            }
            work.end(cx, codes, ending.unwrap_or(Ending::Alarm));
            // A restart sets all overrides back to 100 %.
            cx.overrides = OverrideWishes::default();
            Activity::Identify(Identify::greeted(cx))
        });
    }

    fn on_answer(&mut self, error: Option<u16>) {
        let line = &mut self.context.line;
        (line.moved_ms, line.rests_overdue) = (self.context.now_ms, 0);
        let sent = line.buffer.answered();
        self.advance(|activity, cx| match sent {
            Some(sent) => activity.on_answer(cx, sent, error),
            // More answers than lines: answers can no longer be matched to lines.
            None => activity.trouble(cx, error!("grbl.answer_extra")),
        });
    }

    fn on_status(&mut self, status: ControllerStatus) {
        let cx = &mut self.context;
        // A report counts as fresh only if it answers our query; others may be old.
        let fresh = cx.line.asked_ms.take().is_some();
        let late = cx.now_ms >= cx.line.last_ask_ms + ASK_SOON_MS;
        cx.line.late_reports = if late || !fresh { cx.line.late_reports + u32::from(fresh) } else { 0 };
        let doing = status.doing;
        let is_overdue = cx.line.is_overdue(cx.now_ms);
        cx.line.rests_overdue += u32::from(fresh && doing.is_at_rest() && is_overdue);
        // An older report may not show the override steps sent since.
        let overrides = status.overrides.filter(|_| fresh);
        let before = cx.known.report(status);
        if before.as_ref().is_some_and(|before| self.has_restarted(before)) {
            return self.advance(|activity, cx| {
                cx.known.restart();
                cx.error(code!("grbl.reset_by_itself"));
                activity.reset_without_job(cx)
            });
        }
        let cx = &mut self.context;
        if let Some(overrides) = overrides {
            let found = cx.overrides.on_report(overrides, cx.line.last_ask_ms);
            found.into_iter().for_each(|why| cx.found(why));
        }
        let in_job = self.activity.job().is_some();
        cx.known.follow_depth(in_job, in_job && self.phase != EnginePhase::ToolChange);
        let report = Report { doing, fresh, before: before.map(|before| before.doing) };
        self.count_hold(report);
        self.advance(|activity, cx| activity.on_report(cx, report));
    }

    /// True if the controller restarted and its banner was lost. While a job moves, only the position is
    /// dropped, unless its path leads to zero: the job then ends by other checks.
    fn has_restarted(&mut self, before: &ControllerStatus) -> bool {
        let cx = &mut self.context;
        if !cx.known.may_have_restarted(before) {
            return false;
        }
        match self.phase {
            EnginePhase::Ready | EnginePhase::ToolChange => {
                cx.line.is_idle() && before.doing == ReportedState::Idle
            }
            // Lines sent after a hold have not run.
            EnginePhase::Held => true,
            EnginePhase::Running | EnginePhase::Holding | EnginePhase::Stopping => {
                let place = cx.known.zero_mm.map(|zero| zero.map(|value| -value));
                let job = self.activity.job().zip(place);
                if !job.is_some_and(|(job, place)| job.leads_to(place)) {
                    cx.known.lose_place();
                }
                false
            }
            _ => false,
        }
    }

    /// Reports a hold that comes from the machine: an opened door, a hold button, a tool that the controller
    /// waits for. Lines get no answer meanwhile, and Resume continues.
    fn count_hold(&mut self, report: Report) {
        let cx = &mut self.context;
        let code = match report.doing {
            ReportedState::Door { .. } => code!("grbl.door"),
            ReportedState::Hold { .. } => code!("grbl.held_there"),
            ReportedState::Tool => code!("grbl.tool_there"),
            _ => {
                cx.hold_reports = 0;
                return;
            }
        };
        if report.fresh {
            cx.hold_reports = cx.hold_reports.saturating_add(1);
            if cx.hold_reports == HOLD_REPORTS && self.activity.may_be_held() {
                cx.found(Diagnostic::warning(code));
            }
        }
    }

    fn on_time(&mut self) {
        let cx = &mut self.context;
        let now_ms = cx.now_ms;
        if self.phase == EnginePhase::Closed {
            return;
        }
        if let Some((since, tries)) = cx.line.reset_at
            && now_ms >= since + RESET_MS
        {
            if tries >= RESETS {
                return self.on_silence();
            }
            cx.reset();
        }
        match &self.activity {
            Activity::Identify(identify) if identify.is_silent() && now_ms < cx.since_ms + GREET_MS => return,
            Activity::Homing(homing) => {
                let homing = *homing;
                return self.advance(|_, cx| homing.on_time(cx));
            }
            // A controller that waits for its reset may be silent.
            Activity::Locked(_) if cx.line.needs_reset => cx.line.heard_ms = now_ms,
            _ => {}
        }
        // A new phase gets the full time, even if the line was silent before it.
        if now_ms >= cx.line.heard_ms.max(cx.since_ms) + SILENT_MS && cx.line.asked_ms.is_some() {
            return self.on_silence();
        }
        // A reset discards everything unread, so a query during it gets no answer.
        if cx.line.reset_at.is_none() && now_ms >= cx.line.last_ask_ms + self.query_interval_ms() {
            self.context.query();
            self.activity.on_query(&self.context);
        }
        self.watch_answers();
    }

    fn query_interval_ms(&self) -> u64 {
        use EnginePhase::{Changing, Measuring, Stopping, Surveying};
        let line = &self.context.line;
        // A jog is paced by its reports.
        let is_paced = self.activity.is_paced();
        let soon = is_paced
            || matches!(self.phase, Stopping | Measuring | Changing | Surveying)
            || self.activity.job().is_some_and(|job| job.batch.closed);
        // One query at a time: GRBL merges queries that arrive before it reports.
        let wait_ms = match line.asked_ms {
            Some(_) => ASK_AGAIN_MS,
            None if soon && (is_paced || line.late_reports < LATE_REPORTS) => ASK_SOON_MS,
            None => ASK_USUALLY_MS,
        };
        // Delay queries shortly before a position check: right after this query the check could not send its
        // own.
        match &self.activity {
            Activity::Running(running) if running.moves() && !running.may_look(&self.context) => {
                let is_near = running.job.ends_soon(self.context.now_ms);
                wait_ms.max(if is_near { ASK_LATE_MS } else { ASK_USUALLY_MS })
            }
            _ => wait_ms,
        }
    }

    /// Silence alone proves nothing: a USB hub may have stalled, with the line still in it. But answers are
    /// missing if the controller keeps reporting Idle.
    fn watch_answers(&mut self) {
        let line = &self.context.line;
        let is_overdue = line.rests_overdue >= IDLE_REPORTS && line.is_overdue(self.context.now_ms);
        if is_overdue && line.reset_at.is_none() {
            self.advance(|activity, cx| activity.on_missing_answer(cx));
        }
    }

    /// Sends queued lines while the buffer has room.
    fn feed(&mut self) {
        let cx = &mut self.context;
        loop {
            let is_fed = if cx.line.queue.is_empty() { self.activity.feed(cx) } else { cx.send_next() };
            if !is_fed {
                return;
            }
        }
    }
}
