//! Runs a job: sends its lines and checks it against the status reports. The machine must be on the path sent;
//! at each position check (*look*) it must be at the planned position.

use super::activity::Activity;
use super::asks::{EngineAction, EnginePhase, EngineStart, realtime};
use super::changing::Changing;
use super::context::{Context, Report};
use super::estimate::wait_of;
use super::heard::{Modes, ReportedState};
use super::job::{After, Job, JobTool};
use super::line::Meaning;
use super::lines::{WordsInForce, distance};
use super::measuring::Measuring;
use super::routine::{SectionKind, Spindle};
use super::setter::ToolSetter;
use super::settings;
use super::tool_change::ToolChange;
use crate::control::{BoardHeight, Ending};
use crate::diagnostic::Diagnostic;
use crate::{error, warning};

/// Tolerance to the path, mm, plus 1.5 steps.
const OFF_PATH_MM: f64 = 0.02;
/// Tolerance at a position check, mm, plus 0.75 step and the last digit of a report.
const OFF_PLACE_MM: f64 = 0.0015;
/// Reports off the path that count as proof: a single report may be damaged.
const REPORTS: u32 = 2;
/// Tolerance above the programmed feed: factor, and mm/min.
const FEED_SLACK: (f64, f64) = (1.05, 10.0);
/// The reported speed leads the reported position by this time, s: it belongs to the motion prepared next.
const LEAD_S: f64 = 0.06;
/// Tolerance of the feed in force: this share of its last digit and of 1 mm/min, plus 1 %.
const FEED_ROUNDED_SHARE: f64 = 0.5;
/// Factor and offset, s: a batch faster than factor × planned time − offset did not run as planned.
const QUICKEST: (f64, f64) = (0.75, 0.15);
/// Reports of a hold, each answering a query, that count as proof.
const HOLD_REPORTS: u32 = 3;
/// After a resume, a report of a hold within this time is an old one.
const OLD_REPORT_MS: u64 = 500;
/// Pieces of path that are searched for a report.
const FAR: usize = 4_096;

#[derive(Debug)]
pub(super) struct Running {
    pub(super) job: Box<Job>,
    motion: Motion,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Motion {
    Moving {
        /// A resume was sent, and reports show only the hold since then.
        still_held: bool,
    },
    /// Stopping; still moving.
    Holding,
    Held,
}

impl Running {
    pub(super) fn start(cx: &mut Context, start: &EngineStart) -> Activity {
        let found = cx.known.check(start);
        let refused = found.iter().any(|diagnostic| diagnostic.is_unacknowledged(&start.accepted));
        let place = cx.known.place();
        cx.out.extend(found.into_iter().map(EngineAction::Found));
        let (false, Some(place)) = (refused, place) else { return Activity::Ready };
        let job = Box::new(Job::start(&cx.known, start, place));
        cx.known.start_job(start);
        Self::go(job)
    }

    pub(super) fn go(job: Box<Job>) -> Activity {
        Activity::Running(Self { job, motion: Motion::Moving { still_held: false } })
    }

    pub(super) fn phase(&self) -> EnginePhase {
        match self.motion {
            Motion::Moving { .. } => EnginePhase::Running,
            Motion::Holding => EnginePhase::Holding,
            Motion::Held => EnginePhase::Held,
        }
    }

    pub(super) fn moves(&self) -> bool {
        matches!(self.motion, Motion::Moving { .. })
    }

    pub(super) fn is_held(&self) -> bool {
        self.motion == Motion::Held
    }

    fn now(mut self, motion: Motion) -> Activity {
        self.motion = motion;
        Activity::Running(self)
    }

    pub(super) fn hold(self, cx: &mut Context) -> Activity {
        cx.write(realtime::HOLD);
        self.now(Motion::Holding)
    }

    pub(super) fn resume(self, cx: &mut Context) -> Activity {
        cx.write(realtime::RESUME);
        self.now(Motion::Moving { still_held: true })
    }

    fn trouble(self, cx: &mut Context, why: Diagnostic) -> Activity {
        Activity::Running(self).trouble(cx, why)
    }

    /// Queues the next line of the job, if one may be sent.
    pub(super) fn feed(&mut self, cx: &mut Context) -> bool {
        if !self.moves() || cx.line.reset_at.is_some() {
            return false;
        }
        let batch = &mut self.job.batch;
        batch.began_ms.get_or_insert(cx.now_ms);
        if let Some(line) = batch.lines.pop_front() {
            self.job.path.pieces.extend(line.piece.map(|piece| (piece, line.source)));
            cx.send(&line.text, Meaning::Job { wait_s: wait_of(&line.text) });
            return true;
        }
        if batch.closed {
            return false;
        }
        batch.closed = true;
        // These lines are answered only when all motion before them has stopped. Forget the modal words, so
        // that a lost `$G` answer is noticed.
        cx.known.modes = None;
        for text in ["G4P0", "$G"] {
            cx.send(text, Meaning::Job { wait_s: 0.0 });
        }
        true
    }

    pub(super) fn on_report(mut self, cx: &mut Context, report: Report) -> Activity {
        use ReportedState::{Check, Door, Hold, Home, Idle, Jog, Run, Tool};
        let doing = report.doing;
        let overridden = cx.known.overrides().is_some_and(|all| all[..2] != [100, 100]);
        self.job.batch.disturbed |= overridden || !self.moves();
        if let Motion::Moving { still_held } = &mut self.motion {
            *still_held &= matches!(doing, Hold { .. });
        }
        let is_old = cx.now_ms < cx.since_ms + OLD_REPORT_MS;
        match (self.motion, doing) {
            // The resume may arrive as late as the queries sent after it, if the line or the page stalled. Of
            // three successive queries, the last one certainly shows the effect of the resume.
            (Motion::Moving { .. }, Hold { .. }) if is_old || cx.hold_reports < HOLD_REPORTS => {}
            (Motion::Moving { still_held }, Hold { .. }) => return self.on_own_hold(cx, still_held),
            (Motion::Moving { .. } | Motion::Holding, Door { .. }) => {
                cx.found(warning!("grbl.door"));
                return self.now(Motion::Held);
            }
            (Motion::Moving { .. }, Check | Tool | Home | Jog) => {
                return self.trouble(cx, error!("grbl.held_by_itself"));
            }
            (Motion::Moving { .. }, _) => {
                return match self.follow(cx, report.fresh) {
                    Some(why) => self.trouble(cx, why),
                    None => self.look(cx, report),
                };
            }
            (Motion::Holding, Hold { rests: true }) => return self.now(Motion::Held),
            (Motion::Holding, Run | Idle) if !is_old => {
                // The hold was lost on the way.
                cx.since_ms = cx.now_ms;
                cx.write(realtime::HOLD);
            }
            (Motion::Held, Run) if !is_old => return self.now(Motion::Moving { still_held: false }),
            _ => {}
        }
        Activity::Running(self)
    }

    /// The controller is held. If it never moved since the resume, this is our own hold: some controllers
    /// drop a resume that arrives together with another hold. Ask the user to resume again: the user doesn't
    /// expect a delayed start of motion.
    fn on_own_hold(self, cx: &mut Context, still_held: bool) -> Activity {
        if !still_held {
            return self.trouble(cx, error!("grbl.held_by_itself"));
        }
        cx.found(warning!("grbl.still_held"));
        self.now(Motion::Held)
    }

    /// Finds the reported position on the path and drops the path before it. Returns the problem, if the
    /// machine is elsewhere or too fast. If several reports arrive at once, as after a stalled hub, only the
    /// report that answers a query counts.
    fn follow(&mut self, cx: &Context, fresh: bool) -> Option<Diagnostic> {
        let tolerance = OFF_PATH_MM + 1.5 * cx.known.step_mm();
        let place = cx.known.place()?;
        let feed = cx.known.status.as_ref().and_then(|status| status.feed_mm_per_min);
        let override_part = cx.known.overrides().map_or(1.0, |all| f64::from(all[0]) / 100.0);
        let path = &mut self.job.path;
        if path.pieces.is_empty() {
            return None;
        }
        let near = path.pieces.iter().take(FAR).position(|(piece, _)| piece.distance(place) <= tolerance);
        let Some(near) = near else {
            path.off += u32::from(fresh);
            let off =
                path.pieces.iter().map(|(piece, _)| piece.distance(place)).fold(f64::INFINITY, f64::min);
            let why = || error!("grbl.off_path", off = libm::round(off * 1e3) / 1e3);
            return (path.off >= REPORTS).then(why);
        };
        path.off = 0;
        path.pieces.drain(..near);
        // Checks for a speed above the feed. Pieces that may be on a rapid, such as the retract from a hole,
        // are not judged. One fast report may show the speed of the next piece; a second counts only after
        // the head has moved further than that lead.
        let here = path.pieces.iter().take(FAR).filter(|(piece, _)| piece.distance(place) <= tolerance);
        let most = here.map(|(piece, _)| piece.feed_mm_per_min).reduce(|a, b| Some(a?.max(b?))).flatten();
        let over =
            |most: f64| feed.is_some_and(|feed| feed > most * override_part * FEED_SLACK.0 + FEED_SLACK.1);
        let is_over = most.is_some_and(over);
        let first = path.fast_at_mm.filter(|_| is_over).or_else(|| (is_over && fresh).then_some(place));
        path.fast_at_mm = first;
        let lead_mm = feed.unwrap_or(0.0) / 60.0 * LEAD_S;
        let is_fast = fresh && first.is_some_and(|first| distance(first, place) >= lead_mm);
        is_fast.then(|| {
            let why = error!("grbl.too_fast", feed = feed.unwrap_or(0.0), ..);
            why.with("most", most.unwrap_or(0.0))
        })
    }

    /// Compares the position and modal words at the end of a batch with the plan.
    fn look(mut self, cx: &mut Context, report: Report) -> Activity {
        let values = &cx.known.info.values;
        let tolerance = OFF_PLACE_MM + settings::place_digit_mm(values) + 0.75 * cx.known.step_mm();
        let feed_slack = FEED_ROUNDED_SHARE * (1.0 + settings::feed_digit_mm_per_min(values));
        if !(self.may_look(cx) && report.is_idle() && self.job.batch.asked) {
            return Activity::Running(self);
        }
        self.job.batch.asked = false;
        let Some(place) = cx.known.place() else { return Activity::Running(self) };
        let Some(modes) = &cx.known.modes else {
            // The answer was damaged: query again.
            self.job.batch.looks += 1;
            if self.job.batch.looks > REPORTS {
                return self.trouble(cx, error!("grbl.answer_missing"));
            }
            cx.send("$G", Meaning::Job { wait_s: 0.0 });
            return Activity::Running(self);
        };
        let expected = self.job.pen.at();
        let off = (0..3).map(|axis| libm::fabs(place[axis] - expected[axis])).fold(0.0_f64, f64::max);
        if off > tolerance {
            self.job.batch.looks += 1;
            if self.job.batch.looks < REPORTS {
                return Activity::Running(self);
            }
            let words = |place: [f64; 3]| place.map(|value| format!("{value:.3}")).join(", ");
            let why = error!("grbl.place_differs", found = words(place), ..);
            return self.trouble(cx, why.with("expected", words(expected)));
        }
        if let Some(word) = other_mode(modes, &self.job.pen, feed_slack) {
            return self.trouble(cx, error!("grbl.modes_differ", word = word));
        }
        let batch = &self.job.batch;
        let spent_s = batch.began_ms.map_or(0.0, |began| (cx.now_ms - began) as f64 / 1e3);
        let quickest = batch.expected_s.map_or(0.0, |expected| expected * QUICKEST.0 - QUICKEST.1);
        if spent_s < quickest && !batch.disturbed {
            let why = error!("grbl.too_quick", seconds = format!("{spent_s:.1}"), ..);
            let expected = batch.expected_s.unwrap_or(0.0);
            return self.trouble(cx, why.with("expected", format!("{expected:.1}")));
        }
        self.pass(cx)
    }

    /// True if all of a batch is answered, so that a report shows its final position.
    pub(super) fn may_look(&self, cx: &Context) -> bool {
        self.job.batch.closed && cx.line.is_empty()
    }

    fn pass(mut self, cx: &mut Context) -> Activity {
        let job = &mut self.job;
        match job.batch.after {
            After::Begun => job.enter(After::Risen),
            After::Risen if job.wants_reference(&cx.known) => return self.measure_reference(cx),
            After::Risen if job.wants_change() || job.wants_tool(cx.known.height) => job.leave(),
            After::Risen => job.enter(After::Entered),
            After::Left if job.stops_after => {
                return Activity::Running(self).stop(cx, Ending::StoppedAfterHole);
            }
            After::Left => {
                let tool = job.tool_here().unwrap_or(0);
                return self.wait_for_tool(cx, tool, true);
            }
            After::Entered | After::Done => return self.pass_entry(cx),
        }
        Activity::Running(self)
    }

    /// The tip is over the entry of a section. Measure, work, wait for a tool, or end.
    fn pass_entry(mut self, cx: &mut Context) -> Activity {
        let job = &mut self.job;
        if job.batch.after == After::Done {
            job.at += 1;
            cx.out.push(EngineAction::Progress { sections: job.at });
        }
        let kind = job.section().map(|section| section.kind);
        if job.stops_after && !matches!(kind, Some(SectionKind::Finish) | None) {
            return Activity::Running(self).stop(cx, Ending::StoppedAfterHole);
        }
        match kind {
            Some(SectionKind::Hole(_) | SectionKind::Toolpath(_)) => {
                if job.wants_tool(cx.known.height) {
                    job.leave();
                } else {
                    job.work();
                }
                Activity::Running(self)
            }
            // The first tool is the one used for the Z zero. With a tool setter it is measured like every
            // other.
            Some(SectionKind::Change(tool)) => {
                let is_measured = job.setter().is_some() && cx.known.reference_mm.is_some();
                let another = !job.is_first_change() || is_measured;
                self.wait_for_tool(cx, tool, another)
            }
            Some(SectionKind::Finish) | None => {
                let sections = job.routine().sections.len();
                cx.out.extend([EngineAction::Progress { sections }, EngineAction::Ended(Ending::Done)]);
                Activity::Ready
            }
        }
    }

    /// Measures the tool used for the Z zero before any tool change. If that is impossible, the job doesn't
    /// start.
    fn measure_reference(self, cx: &mut Context) -> Activity {
        let Some(setter) = self.job.setter() else { return Activity::Running(self).stop(cx, Ending::Alarm) };
        match Measuring::start(cx, self.job, setter) {
            Ok(measuring) => measuring,
            Err(job) => Self::go(job).stop(cx, Ending::Alarm),
        }
    }

    fn wait_for_tool(mut self, cx: &mut Context, tool: u32, another: bool) -> Activity {
        let job = &mut self.job;
        job.path.pieces.clear();
        // The user replaces a worn tool, even if the machine changes tools itself.
        let is_worn = job.needs_new_tool();
        // A replacement that is due later stays requested.
        job.tool_before = job.tool_before.filter(|section| *section > job.at);
        job.tool = if is_worn { JobTool::In(tool) } else { JobTool::Wanted(tool) };
        job.is_user_asked = false;
        // The macro doesn't know the length of a tool that the user puts in, and nothing measures it.
        if is_worn && job.forbids_own_tools() {
            return self.trouble(cx, error!("changer.worn"));
        }
        let is_stop = job.routine().stops.contains(&tool);
        if job.changes().is_some() && !is_worn && !is_stop {
            // The tool that is still in is the one to go by.
            let is_reference = cx.known.reference_mm.is_none() && cx.known.height == BoardHeight::OfThisBit;
            return match job.setter().filter(|_| is_reference) {
                Some(setter) => self.measure(cx, setter),
                None => Changing::start(cx, self.job, tool),
            };
        }
        job.is_user_asked = true;
        if another {
            cx.known.change_tool(job.has_equal_tools());
        }
        cx.out.push(EngineAction::ToolWanted { tool });
        ToolChange::start(cx, self.job)
    }

    /// Measures the tool without asking. If that is impossible, the job ends: no user is waiting there.
    fn measure(self, cx: &mut Context, setter: ToolSetter) -> Activity {
        if let Some(why) = cx.known.setter_refused(&setter) {
            return self.trouble(cx, why);
        }
        Measuring::start(cx, self.job, setter).unwrap_or_else(Self::go)
    }

    /// The tool is in: continue from any position with the next section, or with the hole or toolpath that
    /// waited.
    pub(super) fn continue_with_tool(cx: &mut Context, mut job: Box<Job>, place_mm: [f64; 3]) -> Activity {
        if job.tool == JobTool::Reference {
            // The reference is measured: the job requests its tools. A program that starts without a change
            // already has its tool.
            job.tool = JobTool::Wanted(0);
            job.enter_from(place_mm);
            if job.tool_here().is_some() {
                cx.known.change_tool(job.has_equal_tools());
            }
            return Self::go(job);
        }
        let cuts = job.cuts();
        job.at += usize::from(!cuts);
        job.enter_from(place_mm);
        if !cuts {
            cx.out.push(EngineAction::Progress { sections: job.at });
        }
        Self::go(job)
    }
}

/// The first modal word that differs from the plan.
fn other_mode(modes: &Modes, pen: &WordsInForce, feed_slack: f64) -> Option<String> {
    let spindle = match pen.spindle {
        Spindle::Off => ('M', 50),
        Spindle::On(_) => ('M', 30),
        Spindle::Back(_) => ('M', 40),
    };
    let words = [spindle, ('G', 170), ('G', 210), ('G', 940), ('G', 540)];
    if let Some(word) = modes.first_missing(&words) {
        return Some(word);
    }
    if let Spindle::On(speed) | Spindle::Back(speed) = pen.spindle
        && libm::fabs(modes.speed_rpm - speed) > 1.0
    {
        return Some(format!("S{}", modes.speed_rpm));
    }
    let is_other = |feed: &f64| libm::fabs(modes.feed_mm_per_min - feed) > feed_slack + 0.01 * feed;
    let feed = pen.feed_mm_per_min.filter(is_other);
    feed.map(|_| format!("F{}", modes.feed_mm_per_min))
}
