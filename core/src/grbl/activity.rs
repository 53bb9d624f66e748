//! What the engine does with the controller, one at a time. Each activity takes an event and returns the next
//! activity; nothing of it outlives it.
//!
//! ```text
//! Closed ─▶ Identify ─▶ Ready ─┬─ Homing, Jogging, Probing, Surveying, Checking ─▶ Ready
//!               │         ▲    └─ Running ─▶ Stopping ─▶ Identify
//!               ▼         │         └─ ToolChange (jog, probe, zero), Changing, Measuring ─▶ Running
//!            Locked ──────┘ home, unlock
//! ```

use super::asks::{EngineAction, EnginePhase};
use super::changing::Changing;
use super::checking::Checking;
use super::context::{Context, Report};
use super::heard::ReportedState;
use super::homing::Homing;
use super::identify::Identify;
use super::job::Job;
use super::jogging::{Jogging, Way};
use super::known::SAME_ZERO_MM;
use super::line::{Meaning, Outgoing, ZeroWanted};
use super::locked::Locked;
use super::measuring::Measuring;
use super::probing::Probing;
use super::running::Running;
use super::settings;
use super::stopping::Stopping;
use super::surveying::Surveying;
use super::tool_change::ToolChange;
use crate::control::{BoardHeight, Ending, Trust};
use crate::diagnostic::Diagnostic;
use crate::{error, warning};

const LOCKED: u16 = 9;
/// Hold reports that count as proof: our own stop may show one.
pub(super) const HOLD_REPORTS: u32 = 2;

#[derive(Debug, Default)]
pub(super) enum Activity {
    #[default]
    Closed,
    Identify(Identify),
    Ready,
    Locked(Locked),
    Homing(Homing),
    Jogging(Jogging),
    Probing(Probing),
    Surveying(Box<Surveying>),
    Checking(Box<Checking>),
    Running(Running),
    ToolChange(ToolChange),
    Measuring(Measuring),
    Changing(Changing),
    Stopping(Stopping),
    /// The job has ended in this phase without a stop: only the restart of the controller is awaited.
    Restarting(EnginePhase),
}

/// What an activity works on, and what ends with it.
#[derive(Debug)]
pub(super) enum Work {
    Nothing,
    Job(Box<Job>),
    Survey(Box<Surveying>),
    Check(Box<Checking>),
}

impl Work {
    fn of(job: Option<Box<Job>>) -> Self {
        job.map_or(Self::Nothing, Self::Job)
    }

    /// Ends it without a result: the controller is gone, locked, or restarted. `codes`: messages for a job and a
    /// survey, if no other reports the cause.
    pub(super) fn end(self, cx: &mut Context, codes: Option<[&str; 2]>, ending: Ending) {
        match self {
            Self::Job(_) => {
                cx.out.extend(codes.map(|[code, _]| EngineAction::Found(Diagnostic::error(code))));
                cx.out.push(EngineAction::Ended(ending));
            }
            Self::Survey(_) => {
                cx.out.extend(codes.map(|[_, code]| EngineAction::Found(Diagnostic::error(code))));
                cx.survey_failed();
            }
            Self::Check(_) | Self::Nothing => {}
        }
    }
}

impl Activity {
    pub(super) fn phase(&self) -> EnginePhase {
        match self {
            Self::Closed => EnginePhase::Closed,
            Self::Identify(_) => EnginePhase::Greeting,
            Self::Ready => EnginePhase::Ready,
            Self::Locked(_) => EnginePhase::Locked,
            Self::Homing(_) => EnginePhase::Homing,
            Self::Jogging(_) => EnginePhase::Jogging,
            Self::Probing(_) => EnginePhase::Probing,
            Self::Surveying(surveying) => surveying.phase(),
            Self::Checking(_) => EnginePhase::Checking,
            Self::Running(running) => running.phase(),
            Self::ToolChange(_) => EnginePhase::ToolChange,
            Self::Measuring(_) => EnginePhase::Measuring,
            Self::Changing(_) => EnginePhase::Changing,
            Self::Stopping(_) => EnginePhase::Stopping,
            Self::Restarting(phase) => *phase,
        }
    }

    /// The job that is running, held or stopping, or that waits for its tool.
    pub(super) fn job(&self) -> Option<&Job> {
        match self {
            Self::Jogging(Jogging { job, .. }) | Self::Probing(Probing { job }) => job.as_deref(),
            Self::Running(Running { job, .. })
            | Self::ToolChange(ToolChange { job, .. })
            | Self::Measuring(Measuring { job, .. })
            | Self::Changing(Changing { job, .. })
            | Self::Stopping(Stopping { work: Work::Job(job), .. }) => Some(job),
            _ => None,
        }
    }

    pub(super) fn job_mut(&mut self) -> Option<&mut Job> {
        match self {
            Self::Jogging(Jogging { job, .. }) | Self::Probing(Probing { job }) => job.as_deref_mut(),
            Self::Running(Running { job, .. })
            | Self::ToolChange(ToolChange { job, .. })
            | Self::Measuring(Measuring { job, .. })
            | Self::Changing(Changing { job, .. })
            | Self::Stopping(Stopping { work: Work::Job(job), .. }) => Some(job),
            _ => None,
        }
    }

    pub(super) fn into_work(self) -> Work {
        match self {
            Self::Jogging(Jogging { job, .. }) | Self::Probing(Probing { job }) => Work::of(job),
            Self::Running(Running { job, .. })
            | Self::ToolChange(ToolChange { job, .. })
            | Self::Measuring(Measuring { job, .. })
            | Self::Changing(Changing { job, .. }) => Work::Job(job),
            Self::Surveying(surveying) => Work::Survey(surveying),
            Self::Checking(checking) => Work::Check(checking),
            Self::Stopping(stopping) => stopping.work,
            _ => Work::Nothing,
        }
    }

    pub(super) fn into_job(self) -> Option<Box<Job>> {
        if let Work::Job(job) = self.into_work() { Some(job) } else { None }
    }

    pub(super) fn is_at_rest(&self, cx: &Context) -> bool {
        matches!(self, Self::Ready | Self::ToolChange(_)) && cx.line.is_idle()
    }

    /// True if a Hold or Door report must come from the machine: no job is moving and we requested no stop.
    pub(super) fn may_be_held(&self) -> bool {
        use EnginePhase::{Changing, Measuring, Probing, Ready, Surveying, ToolChange};
        match self {
            Self::Jogging(jogging) => !jogging.is_to_end(),
            _ => matches!(self.phase(), Ready | Probing | Surveying | Measuring | Changing | ToolChange),
        }
    }

    /// True if the machine holds the activity, or prevents a new one, and waits for Resume.
    pub(super) fn is_held_at_machine(&self, cx: &Context) -> bool {
        cx.hold_reports >= HOLD_REPORTS && self.may_be_held()
    }

    pub(super) fn takes_overrides(&self, cx: &Context) -> bool {
        !matches!(self, Self::Closed | Self::Identify(_)) && cx.line.reset_at.is_none()
    }

    /// True if it ends when the controller locks itself, even without a message.
    fn ends_by_lock(&self) -> bool {
        use Activity::{Closed, Homing, Identify, Locked, Stopping};
        !matches!(self, Closed | Identify(_) | Locked(_) | Homing(_) | Stopping(_))
    }

    /// Queues the next line of what is sent piece by piece. False if there is none now.
    pub(super) fn feed(&mut self, cx: &mut Context) -> bool {
        match self {
            Self::Running(running) => running.feed(cx),
            Self::Jogging(jogging) => jogging.feed(cx),
            Self::Checking(checking) => checking.feed(cx),
            _ => false,
        }
    }

    /// A status query was sent: it may show the position that is waited for.
    pub(super) fn on_query(&mut self, cx: &Context) {
        match self {
            Self::Running(running) => running.job.batch.asked = running.may_look(cx),
            Self::Measuring(measuring) => measuring.on_query(cx.line.is_empty()),
            Self::Changing(changing) => changing.on_query(cx.line.is_empty()),
            _ => {}
        }
    }

    pub(super) fn on_report(self, cx: &mut Context, report: Report) -> Self {
        let is_dead = matches!(report.doing, ReportedState::Alarm | ReportedState::Sleep);
        match self {
            // If it was locked at identification, that was already reported.
            Self::Ready
                if report.doing == ReportedState::Alarm
                    && report.before.is_none_or(|before| before == ReportedState::Alarm) =>
            {
                Self::Locked(Locked::default())
            }
            activity if is_dead && activity.ends_by_lock() => activity.on_silent_alarm(cx, report.doing),
            Self::Identify(identify) => identify.on_report(cx, report),
            Self::Locked(locked) => locked.on_report(cx, report),
            Self::Homing(homing) => homing.on_report(cx, report),
            Self::Jogging(jogging) => jogging.on_report(cx, report),
            Self::Surveying(surveying) => surveying.on_report(cx, report),
            Self::Checking(checking) => checking.on_report(cx, report),
            Self::Running(running) => running.on_report(cx, report),
            Self::Measuring(measuring) => measuring.on_report(cx, report),
            Self::Changing(changing) => changing.on_report(cx, report),
            Self::Stopping(stopping) => stopping.on_report(cx, report),
            Self::Closed | Self::Ready | Self::Probing(_) | Self::ToolChange(_) | Self::Restarting(_) => self,
        }
    }

    /// The oldest line was accepted or refused.
    pub(super) fn on_answer(self, cx: &mut Context, sent: Outgoing, error: Option<u16>) -> Self {
        let Outgoing { text, meaning } = sent;
        match (meaning, error, self) {
            (Meaning::Job { .. }, None, activity) => {
                cx.known.answered_lines += 1;
                activity
            }
            (Meaning::Job { .. }, Some(number), activity) => {
                activity.trouble(cx, settings::refused(number, &text))
            }
            (Meaning::Changer(line), _, Self::Changing(changing)) => changing.on_answer(cx, line, error),
            (Meaning::CheckMode, _, Self::Checking(checking)) => checking.on_mode_answer(cx, error),
            (Meaning::Check { section, line }, _, mut activity) => {
                if let Self::Checking(check) | Self::Stopping(Stopping { work: Work::Check(check), .. }) =
                    &mut activity
                {
                    check.on_answer(cx, &text, (section, line), error);
                }
                activity
            }
            (Meaning::Identify(true), _, Self::Identify(identify)) => identify.finish_identification(cx),
            (Meaning::Changer(_) | Meaning::CheckMode | Meaning::Identify(_), _, activity) => activity,
            (meaning, Some(number), activity) => activity.on_refusal(cx, &meaning, number),
            (meaning, None, activity) => {
                if let Some((number, value)) = settings::written(&text) {
                    cx.known.set(number, value, matches!(activity, Self::Identify(_)));
                }
                activity.on_acceptance(cx, meaning)
            }
        }
    }

    /// A line of the user's command was refused.
    fn on_refusal(mut self, cx: &mut Context, meaning: &Meaning, number: u16) -> Self {
        let text = match meaning {
            Meaning::Home => "$H",
            Meaning::Unlock => "$X",
            _ => "",
        };
        let comes_to_rest = match &mut self {
            Self::Jogging(jogging) if *meaning == Meaning::Jog => jogging.on_refusal(),
            _ => false,
        };
        // The status report shows the lock, with a better message.
        if !comes_to_rest || number != LOCKED {
            cx.found(settings::refused(number, text));
        }
        if *meaning == Meaning::Unlock {
            self.on_unlock_failed(cx);
        }
        // While stopping, the reset at standstill ends everything, regardless of the answer.
        if comes_to_rest || matches!(self, Self::Stopping(_)) {
            return self;
        }
        if matches!(self, Self::Surveying(_)) {
            cx.survey_failed();
        }
        self.rest(cx)
    }

    /// A line of the user's command was accepted.
    fn on_acceptance(self, cx: &mut Context, meaning: Meaning) -> Self {
        match (meaning, self) {
            // Older reports refer to another position or zero.
            (Meaning::Written, activity) => {
                cx.known.zero_mm = None;
                activity
            }
            (Meaning::Echo(wanted), activity) => activity.on_zero_read(cx, &wanted),
            (Meaning::Home, Self::Homing(homing)) => homing.on_answer(cx),
            (Meaning::Unlock, Self::Locked(_)) => Self::Ready,
            (Meaning::Jog, Self::Jogging(mut jogging)) => {
                jogging.on_answer(cx.now_ms);
                Self::Jogging(jogging)
            }
            (meaning @ (Meaning::Probe { .. } | Meaning::Edge { .. }), Self::Probing(probing)) => {
                probing.on_answer(cx, &meaning)
            }
            (Meaning::Survey(Some(step)), Self::Surveying(surveying)) => surveying.on_answer(cx, step),
            (Meaning::Setter(Some(step)), Self::Measuring(measuring)) => measuring.on_answer(cx, step),
            (_, activity) => activity,
        }
    }

    /// The stored offsets were listed: is the zero the one that was written?
    fn on_zero_read(mut self, cx: &mut Context, wanted: &ZeroWanted) -> Self {
        // Include every active offset: positions refer to the sum.
        let found = cx.known.listed_zero_mm();
        let same = |axis: usize| {
            let is_there =
                |wanted: f64| found.is_some_and(|found| libm::fabs(found[axis] - wanted) <= SAME_ZERO_MM);
            wanted.place_mm[axis].is_none_or(is_there)
        };
        // The probed position is queried again: a damaged number would give a wrong zero.
        let touched = wanted.touched_mm.is_none() || wanted.touched_mm == cx.known.probed_at_mm;
        let plane = same(0) && same(1) && (touched || wanted.of_height);
        if !(plane && same(2) && touched) {
            return self.on_zero_differs(cx, !plane);
        }
        if wanted.trusts {
            cx.known.trust = Trust::Trusted;
        }
        cx.known.zero_refused &= !wanted.of_plane;
        if wanted.of_height {
            cx.known.height = BoardHeight::OfThisBit;
            if let Some(job) = self.job_mut() {
                job.fit(&cx.known);
            }
        }
        if let Self::Measuring(measuring) = &mut self {
            measuring.is_answered = true;
        }
        cx.out.push(EngineAction::ZeroSet);
        self
    }

    /// Another zero is stored than requested. `plane`: X or Y may be off from the running job's zero.
    fn on_zero_differs(self, cx: &mut Context, plane: bool) -> Self {
        cx.known.height = BoardHeight::Unknown;
        cx.known.zero_refused |= plane;
        let why = error!("grbl.zero_not_taken");
        // Without limit switches, only the zero defines the position.
        if plane && !cx.known.homes() {
            cx.known.lose_place();
        }
        // The rest of the job would be cut next to what is already cut.
        if plane && self.job().is_some() {
            return self.trouble(cx, why);
        }
        cx.found(why);
        if matches!(self, Self::Measuring(_)) { self.rest(cx) } else { self }
    }

    fn on_unlock_failed(&mut self, cx: &mut Context) {
        if let Self::Locked(locked) = self {
            locked.on_unlock_failed(cx);
        }
    }

    /// Answers are missing although the controller keeps reporting Idle.
    pub(super) fn on_missing_answer(mut self, cx: &mut Context) -> Self {
        let why = || error!("grbl.answer_missing");
        match &mut self {
            // Both end without answers: by the reset at standstill, and by Idle reports.
            Self::Stopping(_) | Self::Homing(_) => {}
            Self::Running(running) if running.moves() => return self.trouble(cx, why()),
            Self::Changing(_) => return self.trouble(cx, why()),
            Self::Identify(identify) if identify.must_not_disturb() => cx.line.drop_lines(),
            Self::Identify(_) => cx.reset(),
            Self::Checking(checking) => checking.leave(cx, Some(why())),
            _ => {
                self.on_unlock_failed(cx);
                cx.found(if self.job().is_some() { why() } else { warning!("grbl.answer_missing") });
                // A reset at standstill keeps the position.
                return self.reset_without_job(cx);
            }
        }
        self
    }

    /// Resets the controller. A job ends now; all else ends with the banner.
    pub(super) fn reset_without_job(self, cx: &mut Context) -> Self {
        if self.job().is_some() {
            cx.out.push(EngineAction::Ended(Ending::Alarm));
        }
        let next = match self {
            Self::Jogging(jogging) => Self::Jogging(jogging.without_job()),
            Self::Probing(_) => Self::Probing(Probing { job: None }),
            activity if activity.job().is_some() => Self::Restarting(activity.phase()),
            activity => activity,
        };
        cx.reset();
        next
    }

    /// True while more of a jog is to be sent.
    pub(super) fn is_paced(&self) -> bool {
        matches!(self, Self::Jogging(jogging) if jogging.is_paced())
    }

    pub(super) fn parks(&self) -> bool {
        matches!(self, Self::Jogging(Jogging { way: Way::Park(_), .. }))
    }
}
