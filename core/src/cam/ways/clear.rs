//! Copper away that does not belong to the picture (N7): rings outwards from the copper until the board is covered.
//!
//! ```text
//!   ┌──────────────────┐     1st ring: the bit touches the copper's margin
//!   │ ╭──╮ ╭──────╮    │     every next one further by the stepover, as far as it lies on the board
//!   │ │▓▓│ │▓▓▓▓▓▓│    │
//!   │ ╰──╯ ╰──────╯    │
//!   └──────────────────┘
//! ```
//!
//! Comes in: the copper of one side, an operation. Goes out: tasks, widest bit first. Does not know isolation.

use super::super::work::Clear;
use super::cut::{self, Area};
use super::isolate::{Groove, turned};
use super::narrow::{NEARER, half, is_crumb};
use super::route::{Rules, arranged};
use super::{Desk, Part};
use crate::geometry::{Path, Region, Rule, combine, grow, rectangle, union};
use crate::remark::{Remark, Weight};
use crate::units::Length;

/// More rings than this are not made.
const MOST_RINGS: usize = 4_000;
/// More segments than this are not made.
const MOST_SEGMENTS: usize = 4_000_000;

/// Plans the operation.
pub(super) fn plan(desk: &mut Desk<'_>, clear: &Clear) -> Result<Part, Remark> {
    let mut part = Part::default();
    let Some(copper) = desk.scene.copper(desk.operation.face) else {
        desk.say(Remark::new(Weight::Note, "cam.no_copper"));
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
    let mut groove = Groove::of(&kept);
    let mut wider: Option<Length> = None;
    for bit in desk.mills(&names, false) {
        let width = bit.width_at(depth);
        if width <= NEARER + NEARER {
            continue;
        }
        let paths = match wider {
            None => rings(desk, &kept, &board, clear, width)?,
            Some(wider) => groove.rest(wider, width),
        };
        let closed = desk.scene.closed_to(width);
        let (paths, touched) = desk.scene.trimmed(turned(paths, clear.direction), closed.as_ref());
        if touched {
            desk.say(Remark::new(Weight::Doubt, "cam.zone_in_the_way"));
        }
        let rules = Rules {
            start: desk.scene.origin,
            overlap: Length::ZERO,
            both_ways: true,
            link: Some((width, half(width) + clear.margin - Length::from_um(4), &islands)),
            seed: desk.means.options.seed,
        };
        let paths = arranged(paths, &rules);
        part.tasks.extend(desk.milling(&bit, paths, depth));
        wider = Some(width);
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

fn rings(
    desk: &mut Desk<'_>,
    kept: &Region,
    board: &Region,
    clear: &Clear,
    width: Length,
) -> Result<Vec<Path>, Remark> {
    let step = Length::from_mm(width.mm() * clear.stepover_percent / 100.0);
    let field = Area::of(board);
    let mut region = grow(kept, half(width) - NEARER);
    let mut paths: Vec<Path> = Vec::new();
    let mut segments = 0;
    for _ in 0..MOST_RINGS {
        desk.go_on()?;
        let ring: Vec<Path> = region.paths().flat_map(|path| cut::parts(path, &field, true)).collect();
        segments += ring.iter().map(|path| path.segments.len()).sum::<usize>();
        let covered = ring.is_empty() && is_crumb(&combine(board, &region, Rule::Difference));
        paths.extend(ring);
        if covered {
            return Ok(paths);
        }
        if segments > MOST_SEGMENTS {
            break;
        }
        region = grow(&region, step);
    }
    Err(Remark::new(Weight::Loss, "cam.too_many_rings").with("operation", desk.operation.title()))
}
