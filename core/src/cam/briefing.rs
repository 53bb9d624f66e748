//! What a person must know who runs a planned job: side by side, tool by tool.
//!
//! Comes in: [`Work`], and for each side [`Planned`] and its program. Goes out: a [`Briefing`]. Does not know times: whoever
//! reckoned them puts them in.

use super::toolpaths::{Planned, Task};
use super::work::{Action, Drill, Flip, Holes, Work, Zero};
use crate::board::Face;
use crate::geometry::Point;
use crate::job::{Briefing, Pins, Program, SideBriefing, ToolBriefing, touched};
use crate::machine::Machine;

/// The briefing of a job without its sides.
pub fn briefing(job: &str, work: &Work, machine: &Machine) -> Briefing {
    let zero = match work.setup.zero {
        Zero::Board => "board",
        Zero::Blank => "blank",
        Zero::File => "file",
    };
    let flip = match work.setup.flip {
        Flip::LeftRight => "left_right",
        Flip::TopBottom => "top_bottom",
    };
    Briefing {
        job: job.to_owned(),
        machine: machine.name.clone(),
        zero: Some(zero.to_owned()),
        thickness: Some(machine.process.board_thickness),
        pins: None,
        flip: (work.faces().len() > 1).then(|| flip.to_owned()),
        sides: Vec::new(),
    }
}

/// Adds the side that is `planned`, with its `program` and the seconds of its bits.
pub fn add_side(
    briefing: &mut Briefing,
    face: Face,
    work: &Work,
    (planned, program): (&Planned, &Program),
    times_s: &[f64],
) {
    let mut tools: Vec<ToolBriefing> = Vec::new();
    for part in &planned.parts {
        let Some(operation) = work.operations.get(part.operation as usize) else { continue };
        let word = operation.action.word();
        for task in &part.tasks {
            // As lowering does: a bit that is in stays in.
            if tools.last().is_none_or(|last| last.tool != task.bit) {
                let time_s = times_s.get(tools.len()).copied();
                tools.push(ToolBriefing { tool: task.bit.clone(), operations: Vec::new(), time_s });
            }
            if let Some(last) = tools.last_mut()
                && !last.operations.iter().any(|known| known == word)
            {
                last.operations.push(word.to_owned());
            }
            if matches!(operation.action, Action::Drill(Drill { holes: Holes::Alignment, .. })) {
                pins(briefing, work, planned, task);
            }
        }
    }
    let outline = planned.board.outline.bounds().map(|bounds| {
        let moved = |at: Point| Point::new(at.x - planned.origin.x, at.y - planned.origin.y);
        (moved(bounds.min), moved(bounds.max))
    });
    let blank = match (touched(program), outline) {
        (Some(cut), Some((low, high))) => Some(cut.with(low).with(high)),
        (cut, _) => cut,
    };
    briefing.sides.push(SideBriefing { side: face.name().to_owned(), blank, tools });
}

fn pins(briefing: &mut Briefing, work: &Work, planned: &Planned, task: &Task) {
    let alignment = &work.setup.alignment;
    let moved = |at: Point| Point::new(at.x - planned.origin.x, at.y - planned.origin.y);
    let pins = briefing.pins.get_or_insert_with(|| Pins {
        diameter: alignment.diameter,
        below: alignment.depth,
        at: Vec::new(),
    });
    pins.at.extend(task.strokes.iter().map(|stroke| moved(stroke.at)));
}
