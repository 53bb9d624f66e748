//! Copper away that does not belong to the picture (N7): rings outwards from the copper until the board is covered.
//!
//! The widest bit takes all that it reaches, every thinner one what those before it left.
//!
//! Comes in: the copper of one side, an operation. Goes out: tasks, widest bit first. Does not know isolation.

use super::super::work::Clear;
use super::cut::Area;
use super::fill::{Field, Stopped, fill, without};
use super::isolate::turned;
use super::narrow::{NEARER, half};
use super::route::{Rules, arranged};
use super::{Desk, Part};
use crate::diagnostic::Diagnostic;
use crate::geometry::{Region, grow, rectangle, union};
use crate::units::Length;

/// Plans the operation.
pub(super) fn plan(desk: &mut Desk<'_>, clear: &Clear) -> Result<Part, Diagnostic> {
    let mut part = Part::default();
    let Some(copper) = desk.scene.copper(desk.operation.face) else {
        desk.say(Diagnostic::note("cam.no_copper"));
        return Ok(part);
    };
    let copper = &copper.region;
    let Some(board) = board(desk, copper) else { return Ok(part) };
    let names: Vec<&str> = std::iter::once(desk.operation.bit.as_str())
        .chain(clear.further.iter().map(String::as_str))
        .collect();
    let depth = desk.depth();
    let kept = grow(copper, clear.margin);
    let islands = Area::of(copper);
    let outlined = !desk.scene.board.outline.is_empty();
    let margin = if outlined { desk.work.setup.margin } else { Length::ZERO };
    let field = Field { kept: &kept, board: &board, margin };
    let bits = desk.mills(&names, false);
    let mut left: Option<Region> = None;
    for (number, bit) in bits.iter().enumerate() {
        let width = bit.width_at(depth);
        if width <= NEARER + NEARER {
            continue;
        }
        let step = Length::from_mm(width.mm() * clear.stepover_percent / 100.0);
        let filled = fill(&field, left.as_ref(), (width, step), &mut || desk.go_on().is_ok());
        let filled = filled.map_err(|why| stopped(desk, why))?;
        let closed = desk.scene.closed_to(width);
        let (paths, touched) = desk.scene.trimmed(turned(filled.paths, clear.direction), closed.as_ref());
        if touched {
            desk.say(Diagnostic::warning("cam.zone_in_the_way"));
        }
        let rules = Rules {
            start: desk.scene.origin,
            overlap: Length::ZERO,
            both_ways: true,
            link: Some((width, half(width) + clear.margin - Length::from_um(4), &islands)),
            seed: desk.means.options.seed,
        };
        let paths = arranged(paths, &rules);
        part.tasks.extend(desk.milling(bit, paths, depth));
        if number + 1 < bits.len() {
            left = Some(without(left.as_ref().unwrap_or(&board), &filled.swept));
        }
    }
    Ok(part)
}

/// What is to be cleared, copper included: the board, or without an outline the copper's box.
fn board(desk: &Desk<'_>, copper: &Region) -> Option<Region> {
    if !desk.scene.board.outline.is_empty() {
        return Some(desk.scene.board.outline.clone());
    }
    copper.bounds().map(|bounds| union(&[rectangle(bounds.grown(desk.work.setup.margin))]))
}

fn stopped(desk: &Desk<'_>, why: Stopped) -> Diagnostic {
    match why {
        Stopped::Cancelled => Diagnostic::error("plan.cancelled"),
        Stopped::TooMany => Diagnostic::error("cam.too_many_rings").with("operation", desk.operation.title()),
    }
}
