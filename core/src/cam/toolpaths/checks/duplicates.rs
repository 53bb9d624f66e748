//! Removes holes and slots that operations make twice.
//!
//! ```text
//!   drill     ●  0.8 mm, through     ─┐
//!   drill     ●  equal               ─┴─▶ once             bore      ◎ 5 mm, through     ─┐
//!   drill     ●  equal, but deeper   ───▶ stays            bore      ◎ with another mill ─┴─▶ once
//! ```
//!
//! A deeper cut stays, and so does a cut that only marks holes.

use crate::board::Board;
use crate::cam::places::{Places, Twice};
use crate::cam::toolpaths::{BitTask, HoleOrSlot, PlannedOperation};
use crate::cam::work::{Operation, Work};
use crate::code;
use crate::diagnostic::Diagnostic;
use crate::geometry::Point;
use crate::units::Length;
use std::collections::BTreeMap;

/// Holes and slots already milled: width, position, depth.
#[derive(Default)]
pub(in crate::cam::toolpaths) struct Milled {
    holes: Places,
    slots: BTreeMap<(Length, Vec<Point>), Length>,
}

impl Milled {
    /// True if a shape of `width` along `middle` was already milled, at least to `depth`; else records it. A
    /// slot may start at either end.
    pub(in crate::cam::toolpaths) fn again(
        &mut self,
        middle: &[Point],
        width: Length,
        depth: Length,
    ) -> bool {
        if let [at] = middle {
            return self.holes.again(width, *at, depth);
        }
        let turned: Vec<Point> = middle.iter().rev().copied().collect();
        let deep = self.slots.entry((width, turned.min(middle.to_vec()))).or_insert(Length::from_nm(-1));
        let again = *deep >= depth;
        *deep = depth.max(*deep);
        again
    }
}

/// Removes drill cycles at holes already drilled equally deep with the tool, and toolpaths of holes or slots
/// already milled equally deep with any tool. The parts still count these holes and slots as made.
pub(in crate::cam::toolpaths) fn once(
    work: &Work,
    board: &Board,
    parts: &mut [PlannedOperation],
) -> Vec<Diagnostic> {
    let (mut places, mut milled) = (Places::default(), Milled::default());
    let mut notes = Vec::new();
    for part in parts {
        let mut twice = Twice::default();
        // A shape has many toolpaths, perhaps with several tools: keep or remove all that this part has for
        // it.
        let mut judged: BTreeMap<HoleOrSlot, bool> = BTreeMap::new();
        part.tasks.retain_mut(|task| {
            let before = (task.drill_cycles.len(), task.toolpaths.len());
            drill_once(task, &mut places, &mut twice);
            task.toolpaths.retain(|way| {
                let Some(shape) = way.clears else { return true };
                let depth = way.depths.last().copied().unwrap_or_default();
                !*judged
                    .entry(shape)
                    .or_insert_with(|| mill_again(shape, depth, board, &mut milled, &mut twice))
            });
            (task.drill_cycles.len(), task.toolpaths.len()) == before
                || !task.drill_cycles.is_empty()
                || !task.toolpaths.is_empty()
        });
        let name = work.operations.get(part.operation as usize).map(Operation::title).unwrap_or_default();
        notes.extend(twice.note(code!("cam.holes_twice")).map(|note| note.with("operation", name)));
    }
    notes
}

/// Removes drill cycles of `task` at holes already drilled.
fn drill_once(task: &mut BitTask, places: &mut Places, twice: &mut Twice) {
    let (bit, depth) = (task.bit.diameter, task.depth);
    task.drill_cycles.retain(|stroke| {
        let again = stroke.hole.is_some() && places.again(bit, stroke.at, depth);
        if again {
            twice.add(stroke.at);
        }
        !again
    });
}

/// True if `shape` of `board` was already milled equally deep; counts it then.
fn mill_again(
    shape: HoleOrSlot,
    depth: Length,
    board: &Board,
    milled: &mut Milled,
    twice: &mut Twice,
) -> bool {
    let (middle, width) = match shape {
        HoleOrSlot::Hole(hole) => match board.holes.get(hole as usize) {
            Some(hole) => (std::slice::from_ref(&hole.at), hole.diameter),
            None => return false,
        },
        HoleOrSlot::Slot(slot) => match board.slots.get(slot as usize) {
            Some(slot) => (slot.path.as_slice(), slot.width),
            None => return false,
        },
    };
    let Some(width) = width else { return false };
    let again = milled.again(middle, width, depth);
    if let Some(at) = middle.first().filter(|_| again) {
        twice.add(*at);
    }
    again
}
