//! Clears copper outside the design: rings outwards from the copper until the board is covered.
//!
//! The widest tool clears all that it reaches, every narrower one the rest.

use super::super::work::Clear;
use super::cut::Area;
use super::fill::{Field, Stopped, fill, without};
use super::isolate::{LINK_SLACK, turned};
use super::linked::{LONGEST_MM, Links};
use super::narrow::{NEARER, half};
use super::route::{Rules, arranged};
use super::{PlanContext, PlannedOperation};
use crate::diagnostic::Diagnostic;
use crate::geometry::{Region, grow, rectangle, union};
use crate::units::Length;
use crate::{error, note, warning};

pub(super) fn plan(context: &mut PlanContext<'_>, clear: &Clear) -> Result<PlannedOperation, Diagnostic> {
    let mut part = PlannedOperation::default();
    let Some(copper) = context.scene.copper(context.operation.face) else {
        context.report(note!("cam.no_copper", ..));
        return Ok(part);
    };
    let copper = &copper.region;
    let Some(board) = board(context, copper) else { return Ok(part) };
    let depth = context.depth();
    let kept = grow(copper, clear.margin);
    let islands = Area::of(copper);
    let outlined = !context.scene.board.outline.is_empty();
    let margin = if outlined { context.work.setup.margin } else { Length::ZERO };
    let field = Field { kept: &kept, board: &board, margin };
    let bits = context.own_mills();
    let mut left: Option<Region> = None;
    for (number, bit) in bits.iter().enumerate() {
        let width = bit.width_at(depth);
        if width <= NEARER + NEARER {
            continue;
        }
        let step = Length::from_mm(width.mm() * clear.stepover_percent / 100.0);
        let filled = fill(&field, left.as_ref(), (width, step), &mut || context.go_on().is_ok());
        let filled = filled.map_err(|why| stopped(context, why))?;
        let closed = context.scene.closed_to(width);
        let (paths, touched) = context.scene.trimmed(turned(filled.paths, clear.direction), closed.as_ref());
        if touched {
            context.report(warning!("cam.zone_in_the_way", ..));
        }
        let links = Links {
            reach: width,
            longest_mm: LONGEST_MM,
            spacing: width,
            min_distance: half(width) + clear.margin - LINK_SLACK,
            max_distance: Length::LIMIT,
            copper: &islands,
            closed: closed.as_ref(),
        };
        let rules = Rules {
            start: context.scene.origin,
            overlap: Length::ZERO,
            both_ways: true,
            link: Some(&links),
            seed: context.means.options.seed,
        };
        let paths = arranged(paths, &rules);
        part.tasks.extend(context.milling(bit, paths, depth));
        if number + 1 < bits.len() {
            left = Some(without(left.as_ref().unwrap_or(&board), &filled.swept));
        }
    }
    Ok(part)
}

/// The area to clear, including copper: the board, or without an outline the copper's bounds.
fn board(context: &PlanContext<'_>, copper: &Region) -> Option<Region> {
    if !context.scene.board.outline.is_empty() {
        return Some(context.scene.board.outline.clone());
    }
    copper.bounds().map(|bounds| union(&[rectangle(bounds.grown(context.work.setup.margin))]))
}

fn stopped(context: &PlanContext<'_>, why: Stopped) -> Diagnostic {
    match why {
        Stopped::Cancelled => error!("plan.cancelled"),
        Stopped::TooMany => {
            error!("cam.too_many_rings", operation = context.operation.title())
        }
    }
}
