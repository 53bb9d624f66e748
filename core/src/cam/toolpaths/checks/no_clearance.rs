//! Contours of an outline that are too narrow for a tool.
//!
//! ```text
//!   ╭───────────────╮ ╭────────╮   ▯ an inner contour narrower than the tool: left out, unless a hole or a
//!   │  ▯     ╭───╮  │ │        │     slot of the board is there
//!   │        ╰───╯  │ │        │   boards nearer to each other than the tool's width: no cut between them
//!   ╰───────────────╯ ╰────────╯
//! ```

use super::no_tool::Missing;
use crate::board::{Board, Hole, Slot};
use crate::cam::toolpaths::narrow::half;
use crate::geometry::{
    Bounds, CombineRule, Island, Point, Region, combine, grow, path_bounds, rectangle, union,
};
use crate::units::Length;

/// Margin around all contours, so that the outside is a gap like those inside.
const AROUND: Length = Length::from_um(1_000);
/// A hole or slot is a contour if its bounds are this near on every side.
const SAME: Length = Length::from_um(100);

#[derive(Default)]
pub(in crate::cam::toolpaths) struct Closed {
    /// Inner contours that are not cut, and that no hole or slot makes, by width.
    pub(in crate::cam::toolpaths) inner: Missing,
    pub(in crate::cam::toolpaths) merged: usize,
    /// Contours that touch others already in the design.
    pub(in crate::cam::toolpaths) touching: usize,
}

pub(in crate::cam::toolpaths) fn closed(board: &Board, offset: Length) -> Closed {
    let mut closed = Closed::default();
    let Some(bounds) = board.outline.bounds() else { return closed };
    let all = union(&[rectangle(bounds.grown(offset + offset + AROUND))]);
    let mut apart = 0;
    for gap in combine(&all, &board.outline, CombineRule::Difference).islands {
        let (around, between) = (path_bounds(&gap.outer), gap.holes.len());
        apart += between;
        let left = grow(&Region { islands: vec![gap] }, -offset);
        if left.is_empty() {
            if !made(board, around) {
                let (width, height) = (around.max.x - around.min.x, around.max.y - around.min.y);
                let middle = Point::new(around.min.x + half(width), around.min.y + half(height));
                closed.inner.add(width.min(height), middle);
            }
            continue;
        }
        let left: usize = left.islands.iter().map(|island: &Island| island.holes.len()).sum();
        closed.merged += between.saturating_sub(left);
    }
    closed.touching = board.outline.islands.len().saturating_sub(apart);
    closed
}

/// True if a hole or a slot of the board has these bounds.
pub(in crate::cam::toolpaths) fn made(board: &Board, around: Bounds) -> bool {
    let same = |own: Bounds| {
        let near = |a: Length, b: Length| (a - b).abs() <= SAME;
        let (low, high) = (near(own.min.x, around.min.x), near(own.max.x, around.max.x));
        low && high && near(own.min.y, around.min.y) && near(own.max.y, around.max.y)
    };
    let hole = |hole: &Hole| Some(Bounds::of(hole.at).grown(half(hole.diameter?)));
    let slot = |slot: &Slot| Some(Bounds::around(slot.path.iter().copied())?.grown(half(slot.width?)));
    board.holes.iter().filter_map(hole).chain(board.slots.iter().filter_map(slot)).any(same)
}
