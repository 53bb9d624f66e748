//! Toolpaths: paths of each tool's centre, operation by operation.
//!
//! ```text
//!  Board ─ laid ─▶ Scene ─┬─ isolate ─▶ Part ─┐
//!     (panel, pins,       ├─ clear            ├─▶ Planned ─ lower ─▶ Program
//!      flipped)            ├─ drill, bore      │
//!                         └─ cut out ─────────┘
//! ```
//!
//! Every operation is planned separately from one [`PlacedBoard`], so that a caller can reuse the parts of
//! unchanged operations: [`key`] shows whether one has changed.
//!
//! Lengths in whole nanometres in the coordinates of the board as placed.

mod checks;
mod clear;
pub(crate) mod cut;
mod cut_out;
mod drill;
mod engrave;
mod fill;
mod hand_tabs;
mod isolate;
mod joints;
mod kept;
mod linked;
mod lower;
mod mill_holes;
mod narrow;
mod refit;
mod route;
mod scene;
mod shared;
mod slivers;

#[cfg(test)]
mod tests;

use crate::{code, error};
pub use kept::Kept;
pub use lower::lower_work;
pub use scene::PlacedBoard;

use super::work::{Cut, Holes, Operation, OperationKind, Work};
use super::{PlanOptions, PlanningProgress, suits};
use crate::board::Board;
use crate::diagnostic::{Diagnostic, Severity};
use crate::geometry::{Path, Point};
use crate::job::{Bit, Cutter, Leg, Mark, Program, bite};
use crate::machine::Machine;
use crate::units::Length;
use checks::{duplicates, holding};
use sha2::{Digest, Sha256};

/// A path of a tool's centre, at one or more depths.
#[derive(Clone, Debug, PartialEq)]
pub struct Toolpath {
    pub path: Path,
    /// Depths of the passes, positive downwards, shallow first.
    pub depths: Vec<Length>,
    /// How the tool enters the material.
    pub entry: EntryMove,
    /// Lengths along the path, in mm, of the ends of each tab; between them the tool stays above `tab_depth`.
    pub tabs: Vec<(f64, f64)>,
    /// Greatest depth over a tab.
    pub tab_depth: Length,
    /// The hole or slot of the placed board that it clears, if any.
    pub clears: Option<HoleOrSlot>,
}

/// A hole or a slot, by its index on the placed board.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum HoleOrSlot {
    Hole(u32),
    Slot(u32),
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum EntryMove {
    #[default]
    Plunge,
    /// Along the path, by this depth for every mm.
    Ramp(f64),
    /// One lap of the path for every pass.
    Helix,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DrillCycle {
    pub at: Point,
    /// The hole of the board that it makes, if any.
    pub hole: Option<u32>,
}

/// Work of one tool in an operation: first it drills, then it mills.
#[derive(Clone, Debug, PartialEq)]
pub struct BitTask {
    pub bit: Bit,
    /// In order.
    pub drill_cycles: Vec<DrillCycle>,
    pub depth: Length,
    /// Depth of a peck, after which the drill retracts to clear chips; 0 for none.
    pub peck: Length,
    /// In order.
    pub toolpaths: Vec<Toolpath>,
}

#[derive(Clone, Debug, Default, PartialEq)]
pub struct PlannedOperation {
    /// Index into [`Work::operations`].
    pub operation: u32,
    /// Work of its tools, in order.
    pub tasks: Vec<BitTask>,
    pub diagnostics: Vec<Diagnostic>,
    pub holes: Vec<u32>,
    pub slots: Vec<u32>,
    /// Holes that it leaves out, with diagnostics.
    pub left_holes: Vec<u32>,
    /// Slots that it leaves out, with diagnostics.
    pub left_slots: Vec<u32>,
    pub iterations: u64,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Planned {
    pub board: Board,
    /// The position that becomes the work zero.
    pub origin: Point,
    /// In order.
    pub parts: Vec<PlannedOperation>,
    /// Codes of accepted errors of the plan and its files. If it has other errors, it must not be exported or
    /// run.
    pub accepted: Vec<String>,
    /// The spindles in use, as bits (bit 0 is Z1).
    pub spindles: u8,
}

impl Planned {
    /// All toolpaths in the order of [`crate::job::Mark::Toolpath`].
    pub fn toolpaths(&self) -> impl Iterator<Item = &Toolpath> {
        self.parts.iter().flat_map(|part| &part.tasks).flat_map(|task| &task.toolpaths)
    }

    /// The operation of a leg of `program`, the program of this plan, as index into [`Work::operations`].
    /// Drill cycles and toolpaths have one order in the program and here. `None` for legs between them.
    pub fn operation_at(&self, program: &Program, leg: u32) -> Option<u32> {
        let does = |leg: &&Leg| matches!(leg.mark, Mark::Hole(_) | Mark::Toolpath(_));
        let leg = leg as usize;
        program.legs.get(leg).filter(does)?;
        let mut before = program.legs.iter().take(leg).filter(does).count();
        let count = |task: &BitTask| task.drill_cycles.len() + task.toolpaths.len();
        self.parts.iter().find_map(|part| {
            let own = part.tasks.iter().map(count).sum();
            let here = before < own;
            before = before.saturating_sub(own);
            here.then_some(part.operation)
        })
    }

    /// Empties the toolpaths, once they are a program: a board has millions of segments. How many toolpaths there are stays known.
    pub fn empty_toolpaths(&mut self) {
        let tasks = self.parts.iter_mut().flat_map(|part| &mut part.tasks);
        tasks.flat_map(|task| &mut task.toolpaths).for_each(|way| way.path = Path::default());
    }

    /// Length of all toolpaths in mm, every pass counted. Ramps and links are not included; they are in the
    /// program.
    pub fn toolpaths_mm(&self) -> f64 {
        self.toolpaths().map(|way| way.path.length_mm() * way.depths.len() as f64).sum()
    }
}

/// Inputs of planning other than board, work and machine.
pub struct Means<'a> {
    /// Seed, search limit, spindles and accepted errors.
    pub options: &'a PlanOptions,
    /// Seconds from one position to another, equal in both directions.
    pub rapid_time: &'a dyn Fn(Point, Point) -> f64,
}

/// A digest of all inputs of the part of operation `index`, apart from the board's files. If digest and board
/// are unchanged, the part is valid. The operation's name and speeds are excluded: [`assemble`] adds them.
pub fn key(work: &Work, index: usize, machine: &Machine) -> String {
    let operation = work.operations.get(index);
    let bits: Vec<&Bit> =
        operation.iter().flat_map(|o| o.bit_names()).filter_map(|name| work.bit(name)).collect();
    let shape = operation.cloned().map(|operation| Operation {
        name: String::new(),
        feed_mm_per_s: None,
        plunge_mm_per_s: None,
        spindle_rpm: None,
        ..operation
    });
    let tolerances: Vec<Length> =
        work.operations.iter().filter_map(|one| board_tolerance(one, machine)).collect();
    let tolerances = (tolerances, machine.rack_tolerance);
    let text = serde_json::to_string(&(&work.setup, &bits, &shape, &tolerances, super::makes_more(work)))
        .unwrap_or_default();
    let mut hash = Sha256::new();
    hash.update(text.as_bytes());
    hash.update(machine.fingerprint().as_bytes());
    let drills = machine.rack.iter().map(|tool| (tool.cutter, tool.diameter));
    hash.update(format!("{:?}", drills.collect::<Vec<_>>()).as_bytes());
    hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}

fn board_tolerance(operation: &Operation, machine: &Machine) -> Option<Length> {
    let drill = operation.action.drill().filter(|drill| operation.on && drill.holes == Holes::Board)?;
    Some(drill.tolerance_on(machine))
}

/// The operations of `work` to plan: active ones of the side that is up.
pub fn planned_operations(work: &Work) -> impl Iterator<Item = (usize, &Operation)> {
    work.operations
        .iter()
        .enumerate()
        .filter(|(_, operation)| operation.on && operation.face == work.setup.face)
}

/// Plans operation `index` of `work` on `scene`. Calls `tick` with the progress in [`WHOLE`]ths; false
/// cancels.
pub fn plan_operation(
    scene: &PlacedBoard,
    work: &Work,
    index: usize,
    machine: &Machine,
    means: &Means<'_>,
    tick: &mut dyn FnMut(u64) -> bool,
) -> Result<PlannedOperation, Diagnostic> {
    let Some(operation) = work.operations.get(index) else { return Ok(PlannedOperation::default()) };
    let mut context =
        PlanContext { scene, work, operation, machine, means, tick, done: 0, diagnostics: Vec::new() };
    let mut part = match &operation.action {
        OperationKind::Isolate(isolate) => isolate::plan(&mut context, isolate),
        OperationKind::Clear(clear) => clear::plan(&mut context, clear),
        OperationKind::Engrave(engrave) => engrave::plan(&mut context, engrave),
        OperationKind::Drill(drill) => drill::plan(&mut context, drill),
        OperationKind::MillHoles(bore) => mill_holes::plan(&mut context, bore),
        OperationKind::CutOut(cut_out) => cut_out::plan(&mut context, cut_out),
    }?;
    holding::depths(&mut context, &part);
    part.operation = index as u32;
    part.diagnostics = context.diagnostics;
    Ok(part)
}

/// Adds the operation's name and the notes about its speeds to the diagnostics.
fn with_speeds(part: &mut PlannedOperation, work: &Work, machine: &Machine) {
    let Some(operation) = work.operations.get(part.operation as usize) else { return };
    let mut found = suits::bounded(operation, machine);
    for task in &part.tasks {
        let real = suits::with_bit(operation, &task.bit, machine);
        found.extend(bite::judged(&task.bit, real.plunge_mm_per_s, real.spindle_rpm));
    }
    let title = operation.title();
    let names = part.diagnostics.iter_mut().flat_map(|found| &mut found.args);
    names.filter(|(name, _)| name == "operation").for_each(|(_, called)| called.clone_from(&title));
    part.diagnostics.extend(found.into_iter().map(|found| found.with("operation", &title)));
}

pub const WHOLE: u64 = 1_000;

/// Plans all operations of the side that is up. Each feature left out is an error among the diagnostics, to
/// be accepted before export or run ([`Diagnostic::is_unacknowledged`]). Fails if nothing is left to do.
pub fn plan_work(
    board: &Board,
    work: &Work,
    machine: &Machine,
    means: &Means<'_>,
    progress: &mut dyn FnMut(PlanningProgress) -> bool,
) -> Result<(Planned, Vec<Diagnostic>), Vec<Diagnostic>> {
    let scene = PlacedBoard::of(board, work);
    let total = planned_operations(work).count() as u64 * WHOLE;
    let mut parts = Vec::new();
    for (before, (index, _)) in (0..).zip(planned_operations(work)) {
        let mut tick = |done| progress(PlanningProgress { done: before * WHOLE + done, total });
        parts.push(plan_operation(&scene, work, index, machine, means, &mut tick).map_err(|why| vec![why])?);
    }
    assemble(scene, work, machine, means, parts)
}

/// Combines parts that were planned on `scene`, perhaps at different times, in the order of the operations.
/// Repeated holes are made once. Diagnostics and failures are those of [`plan_work`].
pub fn assemble(
    scene: PlacedBoard,
    work: &Work,
    machine: &Machine,
    means: &Means<'_>,
    mut parts: Vec<PlannedOperation>,
) -> Result<(Planned, Vec<Diagnostic>), Vec<Diagnostic>> {
    let spindles = super::spindles(means.options.spindles, machine)?;
    parts.iter_mut().for_each(|part| with_speeds(part, work, machine));
    let mut diagnostics: Vec<Diagnostic> =
        parts.iter().flat_map(|part| part.diagnostics.iter().cloned()).collect();
    diagnostics.extend(left_out(&scene, work, machine, &parts));
    diagnostics.extend(scene.idle_zones(work));
    diagnostics.extend(scene.zero_without_outline(work));
    diagnostics.extend(duplicates::once(work, &scene.board, &mut parts));
    once_in(work, &mut parts);
    diagnostics.extend(holding::too_early(work, machine, &parts));
    let accept = &means.options.accept;
    if parts.iter().all(|part| part.tasks.is_empty()) {
        let mut why: Vec<Diagnostic> =
            diagnostics.into_iter().filter(|diagnostic| diagnostic.is_unacknowledged(accept)).collect();
        why.push(error!("cam.nothing_to_do"));
        return Err(why);
    }
    let seen = diagnostics
        .iter()
        .filter(|diagnostic| diagnostic.severity == Severity::Error && !diagnostic.is_unacknowledged(accept));
    let mut accepted: Vec<String> = seen.map(|diagnostic| diagnostic.code.clone()).collect();
    accepted.extend(means.options.lost.iter().filter(|code| accept.contains(code)).cloned());
    accepted.sort();
    accepted.dedup();
    Ok((Planned { origin: scene.origin, board: scene.board, parts, accepted, spindles }, diagnostics))
}

/// Avoids tool changes: in an operation that mills holes, the tool order is free. The current tool is first,
/// and the first tool of the next operation last.
fn once_in(work: &Work, parts: &mut [PlannedOperation]) {
    let mills_holes = |part: &PlannedOperation| {
        let operation = work.operations.get(part.operation as usize);
        operation.is_some_and(|operation| operation.action.rules().makes_holes && operation.uses_bit())
    };
    for index in 0..parts.len() {
        let (before, rest) = parts.split_at_mut(index);
        let Some((part, after)) = rest.split_first_mut().filter(|(part, _)| mills_holes(part)) else {
            continue;
        };
        let is_in = before.iter().rev().find_map(|part| part.tasks.last()).map(|task| task.bit.clone());
        let next = after.iter().find_map(|part| part.tasks.first()).map(|task| task.bit.clone());
        part.tasks.sort_by_key(|task| (is_in.as_ref() != Some(&task.bit), next.as_ref() == Some(&task.bit)));
    }
}

/// Holes and slots that no operation makes or reports, if any holes of the board are drilled or slots milled.
fn left_out(
    scene: &PlacedBoard,
    work: &Work,
    machine: &Machine,
    parts: &[PlannedOperation],
) -> Vec<Diagnostic> {
    let holes_wanted = planned_operations(work).any(|(_, o)| board_tolerance(o, machine).is_some());
    let mills_slots = |o: &Operation| matches!(&o.action, OperationKind::MillHoles(bore) if bore.slots);
    if !holes_wanted && !planned_operations(work).any(|(_, o)| mills_slots(o)) {
        return Vec::new();
    }
    let tolerance = scene.tolerance(work, machine);
    let done: std::collections::BTreeSet<u32> =
        parts.iter().flat_map(|part| part.holes.iter().chain(&part.left_holes)).copied().collect();
    let slots: std::collections::BTreeSet<u32> =
        parts.iter().flat_map(|part| part.slots.iter().chain(&part.left_slots)).copied().collect();
    let missing = (0..)
        .zip(&scene.board.holes)
        .filter(|(index, _)| holes_wanted && !done.contains(index) && !scene.pins.contains(index));
    let missing: Vec<_> = missing.map(|(_, hole)| hole.diameter).collect();
    let mut without: std::collections::BTreeMap<Length, usize> = std::collections::BTreeMap::new();
    for size in missing.iter().flatten() {
        *without.entry(*size).or_default() += 1;
    }
    let without: Vec<_> = without.into_iter().collect();
    let unsized_holes = missing.iter().filter(|size| size.is_none()).count();
    let open_slots = scene.board.slots.len().saturating_sub(slots.len());
    super::rack::errors(&without, unsized_holes, open_slots, (&machine.drills(), tolerance))
}

struct PlanContext<'a> {
    scene: &'a PlacedBoard,
    work: &'a Work,
    operation: &'a Operation,
    machine: &'a Machine,
    means: &'a Means<'a>,
    tick: &'a mut dyn FnMut(u64) -> bool,
    done: u64,
    diagnostics: Vec<Diagnostic>,
}

impl PlanContext<'_> {
    /// Rules for toolpaths in any order and direction, the shortest from the work zero, without links.
    fn free(&self) -> route::Rules<'static> {
        let (start, seed) = (self.scene.origin, self.means.options.seed);
        route::Rules { start, overlap: Length::ZERO, both_ways: true, link: None, seed }
    }

    fn report(&mut self, diagnostic: Diagnostic) {
        self.diagnostics.push(diagnostic.with("operation", self.operation.title()));
    }

    /// Fails if the user cancelled the plan.
    fn go_on(&mut self) -> Result<(), Diagnostic> {
        if (self.tick)(self.done) { Ok(()) } else { Err(error!("plan.cancelled")) }
    }

    /// The mills of the operation, widest first. For cuts through the board, they must be flat.
    fn own_mills(&mut self) -> Vec<Bit> {
        let operation = self.operation;
        let rules = operation.action.rules();
        let names = std::iter::once(&operation.bit).chain(rules.further).map(String::as_str);
        self.mills(&names.collect::<Vec<_>>(), rules.cut == Cut::Through)
    }

    /// The mills called `names`, widest first. Reports unknown tools and drills.
    fn mills(&mut self, names: &[&str], flat: bool) -> Vec<Bit> {
        let depth = self.depth();
        let mut bits: Vec<Bit> = Vec::new();
        for name in names {
            let code = match self.work.bit(name) {
                None => code!("cam.no_such_bit"),
                Some(Bit { cutter: Cutter::Drill, .. }) => code!("cam.bit_only_drills"),
                Some(Bit { cutter: Cutter::Vee { .. }, .. }) if flat => code!("cam.bit_not_flat"),
                Some(bit) => {
                    if !bits.contains(bit) {
                        bits.push(bit.clone());
                    }
                    continue;
                }
            };
            let called = self.work.bit(name).map_or_else(|| (*name).to_owned(), Bit::called);
            self.report(Diagnostic::error(code).with("bit", called));
        }
        bits.sort_by_key(|bit| std::cmp::Reverse(bit.width_at(depth)));
        bits
    }

    fn depth(&self) -> Length {
        let process = &self.machine.process;
        match self.operation.depth {
            Length::ZERO => process.board_thickness + process.breakthrough,
            depth => depth,
        }
    }

    /// Depths of its passes: equal steps, none above the depth of one pass.
    fn depths(&self, depth: Length) -> Vec<Length> {
        let step = self.operation.depth_per_pass.nm();
        let passes = if step > 0 { (depth.nm() + step - 1) / step } else { 1 }.clamp(1, MOST_PASSES);
        (1..=passes).map(|pass| Length::from_nm(depth.nm() * pass / passes)).collect()
    }

    /// A task that mills `paths` in this order with a plunge at each start.
    fn milling(&self, bit: &Bit, paths: Vec<Path>, depth: Length) -> Option<BitTask> {
        let depths = self.depths(depth);
        let way = |path| Toolpath {
            path,
            depths: depths.clone(),
            entry: EntryMove::Plunge,
            tabs: Vec::new(),
            tab_depth: Length::ZERO,
            clears: None,
        };
        let toolpaths: Vec<Toolpath> = paths.into_iter().map(way).collect();
        (!toolpaths.is_empty()).then(|| BitTask { toolpaths, ..BitTask::with(bit) })
    }
}

impl BitTask {
    /// A task of this tool without work.
    fn with(bit: &Bit) -> Self {
        Self {
            bit: bit.clone(),
            drill_cycles: Vec::new(),
            depth: Length::ZERO,
            peck: Length::ZERO,
            toolpaths: Vec::new(),
        }
    }
}

/// Limit of passes; beyond it each pass gets deeper.
const MOST_PASSES: i64 = 500;

fn with_position(diagnostic: Diagnostic, place: Point) -> Diagnostic {
    diagnostic.with("x", format!("{:.2}", place.x.mm())).with("y", format!("{:.2}", place.y.mm()))
}
