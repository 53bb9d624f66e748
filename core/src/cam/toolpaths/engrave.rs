//! Lines that the tool centre follows: silkscreen, outline, edges of copper.

use super::super::work::{Engrave, Lines};
use super::route::arranged;
use super::{PlanContext, PlannedOperation};
use crate::diagnostic::Diagnostic;
use crate::geometry::Path;
use crate::{note, warning};

pub(super) fn plan(context: &mut PlanContext<'_>, engrave: &Engrave) -> Result<PlannedOperation, Diagnostic> {
    context.go_on()?;
    let (board, face) = (&context.scene.board, context.operation.face);
    let lines: Vec<Path> = match engrave.of {
        Lines::Outline => board.outline.paths().cloned().collect(),
        Lines::Copper => {
            let copper = context.scene.copper(face);
            copper.iter().flat_map(|copper| copper.region.paths()).cloned().collect()
        }
        Lines::Legend => {
            let legends = board.legend.iter().filter(|legend| legend.face == face);
            legends.flat_map(|legend| &legend.strokes).cloned().collect()
        }
    };
    let mut part = PlannedOperation::default();
    let stamped = board.legend.iter().filter(|legend| legend.face == face).map(|legend| legend.flashes);
    let stamped: u32 = if engrave.of == Lines::Legend { stamped.sum() } else { 0 };
    if stamped > 0 {
        context.report(note!("cam.legend_flashes", count = stamped, ..));
    }
    if lines.is_empty() {
        context.report(note!("cam.no_lines", ..));
        return Ok(part);
    }
    let Some(bit) = context.own_mills().pop() else { return Ok(part) };
    let depth = context.depth();
    let closed = context.scene.closed_to(bit.width_at(depth));
    let (lines, touched) = context.scene.trimmed(lines, closed.as_ref());
    if touched {
        context.report(warning!("cam.zone_in_the_way", ..));
    }
    let rules = context.free();
    let lines = chained(arranged(lines, &rules));
    part.tasks.extend(context.milling(&bit, lines, depth));
    Ok(part)
}

/// Joins lines that start at the end of the previous one.
fn chained(lines: Vec<Path>) -> Vec<Path> {
    let mut out: Vec<Path> = Vec::with_capacity(lines.len());
    for line in lines {
        match out.last_mut() {
            Some(last) if last.end() == line.start => last.segments.extend(line.segments),
            _ => out.push(line),
        }
    }
    out
}
