//! Summary of a planned job for the operator: side by side, tool by tool.

use super::Corner;
use super::toolpaths::{BitTask, Planned};
use super::work::{Flip, Work, Zero};
use crate::board::Face;
use crate::geometry::{Bounds, Point};
use crate::job::{AlignmentPins, Briefing, Program, SideBriefing, ToolBriefing, touched};
use crate::machine::Machine;
use crate::units::Length;

/// Material around the cut and the pins: the frame that holds the tabs.
const RIM: Length = Length::from_um(5_000);

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
        tabs: None,
        flip: (work.faces().len() > 1).then(|| flip.to_owned()),
        sides: Vec::new(),
    }
}

/// Adds the side that is `planned`, with its `program` and the duration of each tool in seconds.
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
            // As in `lower`: a tool in the spindle is not requested again.
            if tools.last().is_none_or(|last| last.tool != task.bit) {
                let time_s = times_s.get(tools.len()).copied();
                tools.push(ToolBriefing { tool: task.bit.clone(), operations: Vec::new(), time_s });
            }
            if let Some(last) = tools.last_mut()
                && !last.operations.iter().any(|known| known == word)
            {
                last.operations.push(word.to_owned());
            }
            briefing.tabs = operation.action.rules().tabs.or(briefing.tabs);
            if operation.action.rules().makes_pins {
                pins(briefing, work, planned, task);
            }
        }
    }
    if work.setup.zero == Zero::Board {
        briefing.zero = Some(Corner::of(&planned.board, work).word().to_owned());
    }
    let blank = one_piece(briefing, needed(work, planned, program), work, planned);
    briefing.sides.push(SideBriefing { side: face.name().to_owned(), blank, tools });
}

/// Material that one side needs: all cuts and the board, plus [`RIM`] if something is cut out or pins are
/// drilled.
fn needed(work: &Work, planned: &Planned, program: &Program) -> Option<Bounds> {
    let moved = |at: Point| Point::new(at.x - planned.origin.x, at.y - planned.origin.y);
    let outline =
        planned.board.outline.bounds().map(|bounds| Bounds::of(moved(bounds.min)).with(moved(bounds.max)));
    let all = both(touched(program), outline)?;
    let wants_rim = planned.parts.iter().filter(|part| !part.tasks.is_empty()).any(|part| {
        let rules = work.operations.get(part.operation as usize).map(|operation| operation.action.rules());
        rules.is_some_and(|rules| rules.tabs.is_some() || rules.makes_pins)
    });
    Some(if wants_rim { all.grown(RIM) } else { all })
}

/// The sides of a board share one blank: each needs the area that the others need as well, flipped with the
/// board. Returns the area of this side, and enlarges the sides already in the briefing.
fn one_piece(briefing: &mut Briefing, own: Option<Bounds>, work: &Work, planned: &Planned) -> Option<Bounds> {
    let turning = planned.board.turning(work.setup.flip == Flip::LeftRight);
    let turned = |bounds: Bounds| {
        let turning = turning.as_ref()?;
        let (zero, shift) = (planned.origin, |at: Point, by: Point| Point::new(at.x + by.x, at.y + by.y));
        let over = |at: Point| shift(turning.point(shift(at, zero)), Point::new(-zero.x, -zero.y));
        Some(Bounds::of(over(bounds.min)).with(over(bounds.max)))
    };
    let mut all = own;
    for side in &mut briefing.sides {
        all = both(all, side.blank.and_then(turned));
        side.blank = both(side.blank, own.and_then(turned));
    }
    all
}

fn both(a: Option<Bounds>, b: Option<Bounds>) -> Option<Bounds> {
    match (a, b) {
        (Some(a), Some(b)) => Some(a.with(b.min).with(b.max)),
        (a, b) => a.or(b),
    }
}

fn pins(briefing: &mut Briefing, work: &Work, planned: &Planned, task: &BitTask) {
    let alignment = &work.setup.alignment;
    let moved = |at: Point| Point::new(at.x - planned.origin.x, at.y - planned.origin.y);
    let pins = briefing.pins.get_or_insert_with(|| AlignmentPins {
        diameter: alignment.diameter,
        below: alignment.depth,
        at: Vec::new(),
    });
    pins.at.extend(task.drill_cycles.iter().map(|stroke| moved(stroke.at)));
}
