//! A running job: what is sent between two position checks, and which tool is in.
//!
//! ```text
//!  work of section k, approach to k+1 ─▶ all answered, stopped ─▶ check ─┬─ as planned ─▶ start k+1
//!                                        $G, then ?                      └─ not ────────▶ hold, reset, error
//! ```
//!
//! The tip descends only after a check found it at the right position with the right modal words. Moves are
//! relative, so a corrupted line shows up at the next check, and usually earlier as a report off the path.

use super::asks::EngineStart;
use super::changer::Changer;
use super::estimate::time_s;
use super::known::Known;
use super::lines::{LinePath, WireLine, WordsInForce, distance};
use super::routine::{Routine, RoutineAction, Section, SectionKind, Spindle};
use super::setter::ToolSetter;
use super::timing::PlannerLimits;
use crate::control::BoardHeight;
use std::collections::VecDeque;
use std::sync::Arc;

const NEAR_PATH_MM: f64 = 0.05;
/// A position check due within this time delays other queries.
const NEAR_END_MS: f64 = 120.0;

/// Next step after a successful position check.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum After {
    /// Our modal words are in force.
    #[default]
    Begun,
    /// The tip is up.
    Risen,
    /// The section's entry is reached.
    Entered,
    Done,
    /// The head left the entry for the tool change position, spindle off.
    Left,
}

#[derive(Debug, Default)]
pub(super) struct Batch {
    pub(super) lines: VecDeque<WireLine>,
    pub(super) after: After,
    /// The final `G4P0` and `$G` were sent.
    pub(super) closed: bool,
    pub(super) began_ms: Option<u64>,
    pub(super) expected_s: Option<f64>,
    /// A hold or an override changed the duration: don't compare it with the plan.
    pub(super) disturbed: bool,
    pub(super) looks: u32,
    /// The status query for this position check was sent.
    pub(super) asked: bool,
}

/// Sent paths that the tip may not have passed yet, and reports that contradict them.
#[derive(Debug, Default)]
pub(super) struct Path {
    /// With their lines.
    pub(super) pieces: VecDeque<(LinePath, u32)>,
    pub(super) off: u32,
    pub(super) fast_at_mm: Option<[f64; 3]>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Lengths {
    /// The user states that all tools protrude equally.
    Alike,
    /// The author of the macro is responsible for equal lengths or offsets.
    ByMacro,
    Measured(ToolSetter),
    /// Each tool is touched off.
    TouchedOff,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum JobTool {
    /// No tool was requested yet: the spindle holds the tool used for the Z zero, an end mill or a probing pin.
    Reference,
    /// This one was requested.
    Wanted(u32),
    /// The machine has put it in, or the user replaces it.
    In(u32),
}

#[derive(Debug)]
pub(super) struct Job {
    /// Adapted to the current room above the zero.
    routine: Arc<Routine>,
    /// As started.
    whole: Arc<Routine>,
    spin_up_s: f64,
    /// The section at the entry, or before it.
    pub(super) at: usize,
    pub(super) pen: WordsInForce,
    pub(super) batch: Batch,
    pub(super) path: Path,
    limits: Option<PlannerLimits>,
    /// Ends at the next position check over the board.
    pub(super) stops_after: bool,
    /// A new tool is required before this section.
    pub(super) tool_before: Option<usize>,
    lengths: Lengths,
    changer: Option<Changer>,
    pub(super) tool: JobTool,
    /// The user was asked for the tool.
    pub(super) is_user_asked: bool,
}

impl Job {
    pub(super) fn start(known: &Known, start: &EngineStart, place_mm: [f64; 3]) -> Self {
        let lengths = match start.setter {
            // What the user states takes precedence over a setter and a macro.
            _ if start.same_length => Lengths::Alike,
            Some(setter) => Lengths::Measured(setter),
            None if start.changer.is_some() => Lengths::ByMacro,
            None => Lengths::TouchedOff,
        };
        let mut job = Self {
            routine: known.fitted(&start.routine).0,
            whole: Arc::clone(&start.routine),
            spin_up_s: start.spin_up_s,
            at: start.from,
            pen: WordsInForce::standing(place_mm),
            batch: Batch::default(),
            path: Path::default(),
            limits: PlannerLimits::of(&known.info.values, usize::from(known.info.options.blocks)),
            stops_after: false,
            tool_before: None,
            lengths,
            changer: start.changer.clone(),
            tool: JobTool::Reference,
            is_user_asked: false,
        };
        job.enter(After::Begun);
        job
    }

    pub(super) fn whole(&self) -> &Arc<Routine> {
        &self.whole
    }

    pub(super) fn routine(&self) -> &Arc<Routine> {
        &self.routine
    }

    /// The Z zero changed: compute the change height again.
    pub(super) fn fit(&mut self, known: &Known) {
        self.routine = known.fitted(&self.whole).0;
    }

    /// True if a sent path that may not be passed yet meets this position in work coordinates, or ends there.
    pub(super) fn leads_to(&self, place_mm: [f64; 3]) -> bool {
        let near = |mm: f64| mm <= NEAR_PATH_MM;
        let ends_there = near(distance(self.pen.at(), place_mm));
        ends_there || self.path.pieces.iter().any(|(piece, _)| near(piece.distance(place_mm)))
    }

    /// True if the position check at the end of the batch is near.
    pub(super) fn ends_soon(&self, now_ms: u64) -> bool {
        let (Some(began), Some(expected)) = (self.batch.began_ms, self.batch.expected_s) else {
            return false;
        };
        self.batch.closed && (now_ms - began) as f64 + NEAR_END_MS > expected * 1e3
    }

    pub(super) fn line(&self) -> Option<u32> {
        // Lines that the engine adds have no line in the file.
        let here = self.path.pieces.iter().map(|(_, line)| *line).find(|line| *line > 0);
        here.or_else(|| self.section().map(|section| section.line))
    }

    pub(super) fn section(&self) -> Option<&Section> {
        self.routine.sections.get(self.at)
    }

    pub(super) fn cuts(&self) -> bool {
        self.section().is_some_and(Section::cuts)
    }

    pub(super) fn tool_here(&self) -> Option<u32> {
        self.routine.tool_at(self.at)
    }

    fn batch(&mut self, lines: Vec<WireLine>, after: After) {
        let expected_s = self.limits.clone().map(|limits| time_s(limits, &lines));
        // A batch starts at a checked position: everything before it is passed.
        self.path = Path::default();
        self.batch = Batch { lines: lines.into(), after, expected_s, ..Batch::default() };
    }

    pub(super) fn enter_from(&mut self, place_mm: [f64; 3]) {
        self.pen = WordsInForce::standing(place_mm);
        self.enter(After::Begun);
    }

    /// Moves to the entry of the next section from any position: up first, then sideways.
    pub(super) fn enter(&mut self, after: After) {
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
    pub(super) fn leave(&mut self) {
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

    pub(super) fn needs_new_tool(&self) -> bool {
        self.tool_before.is_some_and(|section| self.at >= section)
    }

    /// True if the next section cuts and needs a new tool, or a touch-off of the current one.
    pub(super) fn wants_tool(&self, height: BoardHeight) -> bool {
        self.cuts() && (self.needs_new_tool() || !height.may_cut())
    }

    /// True if all tools are equally long, as far as Annulus has to know.
    pub(super) fn has_equal_tools(&self) -> bool {
        matches!(self.lengths, Lengths::Alike | Lengths::ByMacro)
    }

    /// True if nobody would know the length of a tool that the user puts in.
    pub(super) fn forbids_own_tools(&self) -> bool {
        self.lengths == Lengths::ByMacro
    }

    /// The tool setter; `None` if all tools are equally long.
    pub(super) fn setter(&self) -> Option<ToolSetter> {
        if let Lengths::Measured(setter) = self.lengths { Some(setter) } else { None }
    }

    /// The tool changer, if any, and the safe height in mm.
    pub(super) fn changes(&self) -> Option<(&Changer, f64)> {
        self.changer.as_ref().map(|changer| (changer, self.routine.safe.mm()))
    }

    /// True if the next section cuts and the machine must fetch its tool first: the tool in the spindle is
    /// unknown.
    pub(super) fn wants_change(&self) -> bool {
        let is_in = matches!(self.tool, JobTool::In(_));
        self.cuts() && self.changer.is_some() && !is_in && self.tool_here().is_some()
    }

    /// True if the current tool must be measured before any tool change, as the reference for all tools.
    pub(super) fn wants_reference(&self, known: &Known) -> bool {
        let is_unmeasured = known.height == BoardHeight::OfThisBit && known.reference_mm.is_none();
        let is_first = self.tool == JobTool::Reference;
        is_first && is_unmeasured && self.setter().is_some() && self.routine.changes_tools()
    }

    /// True at the start of the job: the first tool is requested.
    pub(super) fn is_first_change(&self) -> bool {
        self.at == 0 && self.routine.sections.first().is_some_and(|section| !section.cuts())
    }

    /// The work of the current section and the approach to the next one.
    pub(super) fn work(&mut self) {
        let routine = Arc::clone(&self.routine);
        let Some(section) = routine.sections.get(self.at) else { return };
        let work = section.actions.iter().skip(section.approach);
        let next = routine.sections.get(self.at + 1);
        let approach = next.into_iter().flat_map(|next| next.actions.iter().take(next.approach));
        let lines = work.chain(approach).flat_map(|action| self.pen.act(action)).collect();
        self.batch(lines, After::Done);
    }
}
