//! Checks that depths and the order of operations keep the board in place and in one piece while it is
//! needed.
//!
//! ```text
//!   first side   drill · isolate              cutting out is last: a later operation would find
//!   second side  isolate · drill · cut out    the board on its tabs, or loose
//! ```

use crate::board;
use crate::cam::toolpaths::{BitTask, PlanContext, PlannedOperation, planned_operations};
use crate::cam::work::{Cut, Operation, Work};
use crate::diagnostic::Diagnostic;
use crate::machine::Machine;
use crate::units::Length;
use crate::{error, warning};

/// Reports depths that end in the board although they should go through, or far below it.
pub(in crate::cam::toolpaths) fn depths(context: &mut PlanContext<'_>, part: &PlannedOperation) {
    let rules = context.operation.action.rules();
    let (through, pins) = (rules.cut != Cut::Surface, rules.makes_pins);
    let Some(deepest) = part.tasks.iter().filter_map(deepest).max().filter(|_| through) else { return };
    let thickness = context.machine.process.board_thickness;
    let mm = |length: Length| format!("{:.2}", length.mm());
    if deepest < thickness {
        let warning = warning!("cam.not_through", depth = mm(deepest), ..);
        context.report(warning.with("thickness", mm(thickness)));
    }
    if deepest > thickness + board::bed(pins) {
        let warning = warning!("cam.far_below", depth = mm(deepest), ..);
        context.report(warning.with("below", mm(deepest - thickness)));
    }
}

/// Depth of a task; `None` if it has nothing to do.
fn deepest(task: &BitTask) -> Option<Length> {
    let milled = task.toolpaths.iter().filter_map(|way| way.depths.last().copied()).max();
    let drilled = (!task.drill_cycles.is_empty()).then_some(task.depth);
    milled.max(drilled)
}

/// An error for every operation of this side that cuts out the board before other operations, here or on the
/// next side.
pub(in crate::cam::toolpaths) fn too_early(
    work: &Work,
    machine: &Machine,
    parts: &[PlannedOperation],
) -> Vec<Diagnostic> {
    let busy = |index: usize| {
        let own = |part: &&PlannedOperation| part.operation as usize == index;
        parts.iter().find(own).is_some_and(|part| !part.tasks.is_empty())
    };
    let cuts_out = |operation: &Operation| {
        let through = operation.depth == Length::ZERO || operation.depth >= machine.process.board_thickness;
        through && operation.action.rules().tabs.is_some()
    };
    let later: Vec<_> =
        work.faces().into_iter().skip_while(|face| *face != work.setup.face).skip(1).collect();
    let mut errors = Vec::new();
    for (index, operation) in planned_operations(work).filter(|(index, own)| cuts_out(own) && busy(*index)) {
        let here = planned_operations(work)
            .filter(|(next, own)| *next > index && busy(*next) && own.action.rules().tabs.is_none());
        let there = work.operations.iter().filter(|own| own.on && later.contains(&own.face));
        if let Some(next) = here.map(|(_, own)| own).chain(there).next() {
            let error = error!("cam.cut_out_too_early", next = next.title(), ..);
            errors.push(error.with("side", next.face.name()).with("operation", operation.title()));
        }
    }
    errors
}
