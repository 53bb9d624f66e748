//! A running job: sends lines, compares reports with the path, and checks the position at the entry of every
//! section (a *look*).
//!
//! ```text
//!  work of section k, approach to k+1 ─▶ all answered, stopped ─▶ check ─┬─ as planned ─▶ start k+1
//!                                        $G, then ?                      └─ not ────────▶ hold, reset, error
//! ```
//!
//! The tip descends only after a check found it at the right position with the right modal words. Moves are
//! relative, so a corrupted line shows up at the next check, and usually earlier as a report off the path.

use super::asks::{EngineAction, EnginePhase, EngineStart, signs};
use super::changer::{Changer, LINE_S};
use super::engine::{Controller, Meaning};
use super::heard::ReportedState;
use super::height::BoardHeight;
use super::lines::{LinePath, WireLine, WordsInForce, distance};
use super::routine::{Routine, RoutineAction, Section, SectionKind, Spindle};
use super::setter::ToolSetter;
use super::settings::Values;
use super::timing::{Clockwork, PlannerLimits};
use annulus_core::control::Ending;
use annulus_core::diagnostic::Diagnostic;
use std::collections::VecDeque;
use std::sync::Arc;

const NEAR_PATH_MM: f64 = 0.05;
const NEAR_END_MS: f64 = 120.0;
const ANSWER_MS: f64 = 2_000.0;
const IDLE_REPORTS: u32 = 4;
const REST_MS: u64 = 10_000;

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum After {
    #[default]
    Begun,
    Risen,
    Entered,
    Done,
    Left,
}

#[derive(Debug, Default)]
pub(super) struct Batch {
    lines: VecDeque<WireLine>,
    after: After,
    closed: bool,
    pub(super) began_ms: Option<u64>,
    pub(super) expected_s: Option<f64>,
    pub(super) disturbed: bool,
    pub(super) looks: u32,
    pub(super) asked: bool,
}

#[derive(Debug)]
pub(super) struct Run {
    routine: Arc<Routine>,
    whole: Arc<Routine>,
    spin_up_s: f64,
    at: usize,
    pub(super) pen: WordsInForce,
    pub(super) batch: Batch,
    pub(super) window: VecDeque<(LinePath, u32)>,
    pub(super) off: u32,
    pub(super) fast_at_mm: Option<[f64; 3]>,
    limits: Option<PlannerLimits>,
    pub(super) is_to_go_on: bool,
    pub(super) stops_after: bool,
    pub(super) tool_before: Option<usize>,
    pub(super) same_length: bool,
    setter: Option<ToolSetter>,
    /// No tool was requested yet: the spindle holds the tool used for the Z zero, an end mill or a probing
    /// pin.
    is_unasked: bool,
    changer: Option<Changer>,
    /// The user states that all tools protrude equally; not merely the author of the macro.
    is_alike: bool,
    pub(super) wanted: u32,
    pub(super) is_in: bool,
    pub(super) is_asked: bool,
}

impl Run {
    pub(super) fn whole(&self) -> &Arc<Routine> {
        &self.whole
    }

    pub(super) fn take_routine(&mut self, routine: Arc<Routine>) {
        self.routine = routine;
    }

    pub(super) fn routine(&self) -> &Arc<Routine> {
        &self.routine
    }

    /// True if a sent path that may not be passed yet meets this position in work coordinates, or ends there.
    pub(super) fn leads_to(&self, place_mm: [f64; 3]) -> bool {
        let near = |mm: f64| mm <= NEAR_PATH_MM;
        let ends_there = near(distance(self.pen.at(), place_mm));
        ends_there || self.window.iter().any(|(piece, _)| near(piece.distance(place_mm)))
    }

    pub(super) fn looks(&self) -> bool {
        self.batch.closed
    }

    pub(super) fn ends_soon(&self, now_ms: u64) -> bool {
        let (Some(began), Some(expected)) = (self.batch.began_ms, self.batch.expected_s) else {
            return false;
        };
        self.batch.closed && (now_ms - began) as f64 + NEAR_END_MS > expected * 1e3
    }

    pub(super) fn line(&self) -> Option<u32> {
        let here = self.window.iter().map(|(_, line)| *line).find(|line| *line > 0);
        here.or_else(|| self.routine.sections.get(self.at).map(|section| section.line))
    }

    fn batch(&mut self, lines: Vec<WireLine>, after: After) {
        let expected_s = self.limits.clone().map(|limits| time_s(limits, &lines));
        let lines = lines.into();
        self.window.clear();
        (self.off, self.fast_at_mm) = (0, None);
        self.batch = Batch { lines, after, expected_s, ..Batch::default() };
    }

    /// Moves to the entry of the next section from any position: up first, then sideways.
    fn enter(&mut self, after: After) {
        let routine = Arc::clone(&self.routine);
        let Some(section) = routine.sections.get(self.at) else { return };
        let lines = match after {
            After::Begun => self.pen.words(),
            After::Risen => self.pen.rise(section, routine.safe),
            _ => self.pen.over(section, routine.safe, self.spin_up_s),
        };
        self.batch(lines, after);
    }

    /// From the entry of a section that has not started to the last tool change position: spindle off, up,
    /// over. Without an earlier change, only up.
    fn leave(&mut self) {
        let routine = Arc::clone(&self.routine);
        let before = routine.sections.iter().take(self.at).rev();
        let change = before.into_iter().find(|section| matches!(section.kind, SectionKind::Change(_)));
        let mut lines = vec![self.pen.turn(Spindle::Off)];
        lines.extend(self.pen.act(&RoutineAction::Coolant { mist: false, flood: false, line: 0 }));
        if let Some(place) = change.or_else(|| routine.sections.get(self.at)) {
            lines.extend(self.pen.rise(place, routine.safe));
        }
        lines.extend(change.into_iter().flat_map(|place| self.pen.over(place, routine.safe, 0.0)));
        self.batch(lines, After::Left);
    }

    /// True if the next section cuts and needs a new tool, or a touch-off of the current one.
    fn wants_tool(&self, height: BoardHeight) -> bool {
        let cuts = self.routine.sections.get(self.at).is_some_and(Section::cuts);
        let is_new = self.tool_before.is_some_and(|section| self.at >= section);
        cuts && (is_new || !height.may_cut())
    }

    pub(super) fn setter(&self) -> Option<ToolSetter> {
        self.setter.filter(|_| !self.same_length)
    }

    pub(super) fn changes(&self) -> Option<(&Changer, f64)> {
        self.changer.as_ref().map(|changer| (changer, self.routine.safe.mm()))
    }

    /// True if the next section cuts and the machine must fetch its tool first: the tool in the spindle is
    /// unknown.
    fn wants_change(&self) -> bool {
        let cuts = self.routine.sections.get(self.at).is_some_and(Section::cuts);
        cuts && self.changer.is_some() && !self.is_in && self.routine.tool_at(self.at).is_some()
    }

    /// True if the current tool must be measured before any tool change, as the reference for all tools.
    fn wants_reference(&self, height: BoardHeight, reference_mm: Option<f64>) -> bool {
        let known = height == BoardHeight::OfThisBit && reference_mm.is_none();
        self.is_unasked && known && self.setter().is_some() && self.routine.changes_tools()
    }

    pub(super) fn is_unasked(&self) -> bool {
        self.is_unasked
    }

    fn is_first_change(&self) -> bool {
        self.at == 0 && self.routine.sections.first().is_some_and(|section| !section.cuts())
    }

    fn work(&mut self) {
        let routine = Arc::clone(&self.routine);
        let Some(section) = routine.sections.get(self.at) else { return };
        let work = section.actions.iter().skip(section.approach);
        let next = routine.sections.get(self.at + 1);
        let approach = next.into_iter().flat_map(|next| next.actions.iter().take(next.approach));
        let lines = work.chain(approach).flat_map(|action| self.pen.act(action)).collect();
        self.batch(lines, After::Done);
    }
}

fn time_s(limits: PlannerLimits, lines: &[WireLine]) -> f64 {
    let mut clock = Clockwork::new(limits);
    for line in lines {
        match &line.piece {
            Some(piece) => clock.go(piece),
            None => clock.rest(wait_of(&line.text)),
        }
    }
    clock.rest(0.0);
    clock.spent_s()
}

fn wait_of(text: &str) -> f64 {
    text.strip_prefix("G4P").and_then(|wait| wait.parse().ok()).unwrap_or(0.0)
}

/// Duration from section `from` on, s, starting at `at_mm` in work coordinates. Includes position checks,
/// excludes tool changes. `None` if the settings are incomplete.
pub fn estimate_s(
    routine: &Routine,
    values: &Values,
    blocks: usize,
    from: usize,
    at_mm: [f64; 3],
) -> Option<f64> {
    Some(estimates_s(routine, values, blocks, from, at_mm)?.into_iter().sum())
}

pub fn estimates_s(
    routine: &Routine,
    values: &Values,
    blocks: usize,
    from: usize,
    at_mm: [f64; 3],
) -> Option<Vec<f64>> {
    const LOOK_S: f64 = 0.07;
    let limits = PlannerLimits::of(values, blocks)?;
    let mut pen = WordsInForce::standing(at_mm);
    let mut each_s = Vec::new();
    for (index, section) in routine.sections.iter().enumerate().skip(from) {
        let fresh = index == from || matches!(routine.sections[index - 1].kind, SectionKind::Change(_));
        let lines: Vec<WireLine> = if fresh {
            let up = pen.rise(section, routine.safe);
            up.into_iter().chain(pen.over(section, routine.safe, 0.0)).collect()
        } else {
            section.actions.iter().take(section.approach).flat_map(|action| pen.act(action)).collect()
        };
        let work = section.actions.iter().skip(section.approach).flat_map(|action| pen.act(action));
        let lines: Vec<WireLine> = lines.into_iter().chain(work).collect();
        each_s.push(time_s(limits.clone(), &lines) + LOOK_S);
    }
    Some(each_s)
}

impl Controller {
    pub(super) fn start(&mut self, start: &EngineStart, place_mm: [f64; 3]) {
        let pen = WordsInForce::standing(place_mm);
        let limits = PlannerLimits::of(&self.info.values, usize::from(self.info.options.blocks));
        let mut run = Run {
            routine: self.fitted(&start.routine).0,
            whole: Arc::clone(&start.routine),
            spin_up_s: start.spin_up_s,
            at: start.from,
            pen,
            batch: Batch::default(),
            window: VecDeque::new(),
            off: 0,
            fast_at_mm: None,
            limits,
            is_to_go_on: false,
            stops_after: false,
            tool_before: None,
            // Without a setter the author of the macro is responsible for equal lengths or offsets.
            same_length: start.same_length || (start.changer.is_some() && start.setter.is_none()),
            setter: start.setter,
            is_unasked: true,
            changer: start.changer.clone(),
            is_alike: start.same_length,
            wanted: 0,
            is_in: false,
            is_asked: false,
        };
        run.enter(After::Begun);
        (self.run, self.ending) = (Some(run), None);
        self.height_at_start(start);
        self.set(EnginePhase::Running);
    }

    pub(super) fn feed_run(&mut self) -> bool {
        if self.phase != EnginePhase::Running || self.reset_at.is_some() {
            return false;
        }
        let now_ms = self.now_ms;
        let Some(run) = &mut self.run else { return false };
        run.batch.began_ms.get_or_insert(now_ms);
        if let Some(line) = run.batch.lines.pop_front() {
            run.window.extend(line.piece.map(|piece| (piece, line.source)));
            let wait_s = wait_of(&line.text);
            let meaning = Meaning::Job { text: line.text.clone(), wait_s };
            self.send(&line.text, meaning);
            return true;
        }
        if run.batch.closed {
            return false;
        }
        run.batch.closed = true;
        self.close_batch();
        true
    }

    /// Ends a batch: these lines are answered only when all motion before them has stopped.
    fn close_batch(&mut self) {
        // Forget the modal words, so that a lost `$G` answer is noticed.
        self.modes = None;
        for text in ["G4P0", "$G"] {
            self.send(text, Meaning::Job { text: text.to_owned(), wait_s: 0.0 });
        }
    }

    /// True if all of a batch is answered, so that a report shows its final position.
    pub(super) fn may_look(&self) -> bool {
        self.run.as_ref().is_some_and(Run::looks) && self.buffer.is_empty() && self.queue.is_empty()
    }

    pub(super) fn asked_for_look(&mut self) {
        let may = self.may_look();
        if let Some(run) = &mut self.run {
            run.batch.asked = may;
        }
        self.setter_asked();
        self.changer_asked();
    }

    pub(super) fn passed(&mut self) {
        let (height, reference_mm) = (self.height, self.reference_mm);
        let Some(run) = &mut self.run else { return };
        match run.batch.after {
            After::Begun => return run.enter(After::Risen),
            After::Risen if run.wants_reference(height, reference_mm) => return self.measure_reference(),
            After::Risen if run.wants_change() || run.wants_tool(height) => return run.leave(),
            After::Risen => return run.enter(After::Entered),
            After::Left if run.stops_after => return self.stop(Ending::StoppedAfterHole),
            After::Left => {
                let tool = run.routine.tool_at(run.at).unwrap_or(0);
                return self.wait_for_tool(tool, true);
            }
            After::Entered | After::Done => {}
        }
        if run.batch.after == After::Done {
            run.at += 1;
            let done = run.at;
            self.out.push(EngineAction::Progress { sections: done });
        }
        let Some(run) = &mut self.run else { return };
        let kind = run.routine.sections.get(run.at).map(|section| section.kind);
        if run.stops_after && !matches!(kind, Some(SectionKind::Finish) | None) {
            return self.stop(Ending::StoppedAfterHole);
        }
        match kind {
            Some(SectionKind::Hole(_) | SectionKind::Toolpath(_)) => {
                if run.wants_tool(height) {
                    run.leave();
                } else {
                    run.work();
                }
            }
            // The first tool is the one used for the Z zero. With a tool setter it is measured like every
            // other.
            Some(SectionKind::Change(tool)) => {
                let another = !run.is_first_change() || run.setter().is_some() && reference_mm.is_some();
                self.wait_for_tool(tool, another);
            }
            Some(SectionKind::Finish) | None => {
                let done = run.routine.sections.len();
                self.run = None;
                self.out
                    .extend([EngineAction::Progress { sections: done }, EngineAction::Ended(Ending::Done)]);
                self.set(EnginePhase::Ready);
            }
        }
    }

    fn wait_for_tool(&mut self, tool: u32, another: bool) {
        let (height, known) = (self.height, self.reference_mm.is_some());
        if let Some(run) = &mut self.run {
            run.window.clear();
            // The user replaces a worn tool, even if the machine changes tools itself.
            let is_worn = run.tool_before.is_some_and(|section| run.at >= section);
            // A replacement that is due later stays requested.
            run.tool_before = run.tool_before.filter(|section| *section > run.at);
            run.is_unasked = false;
            (run.wanted, run.is_in, run.is_asked) = (tool, is_worn, false);
            // The macro doesn't know the length of a tool that the user puts in, and nothing measures it.
            if run.changer.is_some() && is_worn && run.setter.is_none() && !run.is_alike {
                return self.trouble(Diagnostic::error("changer.worn"));
            }
            let is_stop = run.routine.stops.contains(&tool);
            if run.changer.is_some() && !is_worn && !is_stop {
                // The tool that is still in is the one to go by.
                return match run.setter() {
                    Some(setter) if !known && height == BoardHeight::OfThisBit => self.measures(setter),
                    _ => self.begin_change(tool),
                };
            }
            run.is_asked = true;
        }
        if another {
            self.bit_is_another();
        }
        self.set(EnginePhase::ToolChange);
        self.out.push(EngineAction::ToolWanted { tool });
    }

    /// The tool is in: continue from any position with the next section, or with the hole or toolpath that
    /// waited.
    pub(super) fn tool_ready(&mut self, place_mm: [f64; 3]) {
        let Some(run) = &mut self.run else { return };
        if run.is_unasked {
            return self.reference_is_known(place_mm);
        }
        let cuts = run.routine.sections.get(run.at).is_some_and(Section::cuts);
        run.at += usize::from(!cuts);
        let done = run.at;
        run.pen = WordsInForce::standing(place_mm);
        run.enter(After::Begun);
        if !cuts {
            self.out.push(EngineAction::Progress { sections: done });
        }
        self.set(EnginePhase::Running);
    }

    /// Measures the tool used for the Z zero before any tool change. If that is impossible, the job doesn't
    /// start.
    fn measure_reference(&mut self) {
        if let Some(setter) = self.run.as_ref().and_then(Run::setter) {
            self.measure_tool(setter);
        }
        if self.phase != EnginePhase::Measuring {
            self.stop(Ending::Alarm);
        }
    }

    /// The reference is measured: continue with the job, which requests its tools. A program that starts
    /// without a change already has its tool.
    fn reference_is_known(&mut self, place_mm: [f64; 3]) {
        let Some(run) = &mut self.run else { return };
        run.is_unasked = false;
        run.pen = WordsInForce::standing(place_mm);
        run.enter(After::Begun);
        if run.routine.tool_at(run.at).is_some() {
            self.bit_is_another();
        }
        self.set(EnginePhase::Running);
    }

    pub(super) fn trouble(&mut self, why: Diagnostic) {
        if self.phase == EnginePhase::Stopping || self.run.is_none() {
            return;
        }
        self.found(why);
        self.stop(Ending::Alarm);
    }

    pub(super) fn stop(&mut self, ending: Ending) {
        if self.phase == EnginePhase::Changing {
            self.found(Diagnostic::warning("changer.stopped"));
        }
        self.ending = Some(ending);
        self.queue.clear();
        self.write(signs::HOLD);
        (self.asked_ms, self.idle_reports) = (None, 0);
        self.set(EnginePhase::Stopping);
    }

    /// A report while stopping. A reset in motion would lose the position, so wait for the hold.
    pub(super) fn stopping(&mut self, doing: ReportedState) {
        if self.reset_at.is_some() {
            return;
        }
        let late = self.now_ms >= self.since_ms + REST_MS;
        match doing {
            _ if doing == ReportedState::Check || doing.is_held_at_rest() => self.reset(),
            _ if late || matches!(doing, ReportedState::Alarm | ReportedState::Sleep) => {
                self.lose_place();
                self.reset();
            }
            ReportedState::Idle => {
                self.idle_reports += 1;
                if self.idle_reports >= IDLE_REPORTS { self.reset() } else { self.write(signs::HOLD) }
            }
            ReportedState::Run | ReportedState::Jog => self.write(signs::HOLD),
            _ => {}
        }
    }

    pub(super) fn is_overdue(&self) -> bool {
        let waits_s: f64 = self
            .buffer
            .waiting()
            .map(|sent| match sent.meaning {
                Meaning::Job { wait_s, .. } => wait_s,
                Meaning::Changer(_) => LINE_S,
                _ => 0.0,
            })
            .sum();
        let is_late = self.now_ms as f64 > self.moved_ms as f64 + ANSWER_MS + waits_s * 1e3;
        is_late && !self.buffer.is_empty()
    }

    /// Answers are missing although the controller keeps reporting Idle. Silence alone proves nothing: a USB
    /// hub may have stalled, with the line still in it.
    pub(super) fn stalls(&mut self) {
        if self.rests_overdue < IDLE_REPORTS || !self.is_overdue() || self.reset_at.is_some() {
            return;
        }
        match self.phase {
            EnginePhase::Running | EnginePhase::Changing => {
                self.trouble(Diagnostic::error("grbl.answer_missing"));
            }
            EnginePhase::Stopping | EnginePhase::Homing => {}
            EnginePhase::Greeting if self.spares() => self.drop_lines(),
            EnginePhase::Greeting => self.reset(),
            EnginePhase::Checking => self.leave_check(Some(Diagnostic::error("grbl.answer_missing"))),
            _ => {
                self.unlock_failed();
                // A reset at standstill keeps the position.
                if self.run.take().is_some() {
                    self.found(Diagnostic::error("grbl.answer_missing"));
                    self.out.push(EngineAction::Ended(Ending::Alarm));
                } else {
                    self.found(Diagnostic::warning("grbl.answer_missing"));
                }
                self.reset();
            }
        }
    }
}
