//! Holes and slots that operations make twice: the second time goes.
//!
//! ```text
//!   drill     ●  0.8 mm, through     ─┐
//!   drill     ●  the same            ─┴─▶ once             bore      ◎ 5 mm, through   ─┐
//!   drill     ●  the same, deeper    ───▶ stays            bore      ◎ with another mill ┴─▶ once
//! ```
//!
//! Comes in: parts, in the order of their operations. Goes out: the same without strokes and toolpaths that find their hole or slot
//! made, and a note for every operation that loses some. A bit that comes back to go deeper stays, as one does that only marks
//! holes.

use crate::board::Board;
use crate::cam::places::{Places, Twice};
use crate::cam::toolpaths::{BitTask, HoleOrSlot, PlannedOperation};
use crate::cam::work::{Operation, Work};
use crate::diagnostic::Diagnostic;
use crate::geometry::Point;
use crate::units::Length;
use std::collections::BTreeMap;

/// Holes and slots that are milled already: how wide, where, how deep.
#[derive(Default)]
pub(in crate::cam::toolpaths) struct Milled {
    holes: Places,
    slots: BTreeMap<(Length, Vec<Point>), Length>,
}

impl Milled {
    /// Whether what is `width` wide along `middle` was milled before, and at least to `depth`; else it has been now. A slot is
    /// the same from whichever end.
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

/// Takes strokes away whose hole was drilled before as deep with the same bit, and toolpaths whose hole or slot was milled before
/// as deep with whatever bit. Parts keep the holes and slots that they count as made.
pub(in crate::cam::toolpaths) fn once(
    work: &Work,
    board: &Board,
    parts: &mut [PlannedOperation],
) -> Vec<Diagnostic> {
    let (mut places, mut milled) = (Places::default(), Milled::default());
    let mut notes = Vec::new();
    for part in parts {
        let mut twice = Twice::default();
        // A shape has many toolpaths, and may have some of several bits: it stays or goes with all that this part does there.
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
        notes.extend(twice.note("cam.holes_twice").map(|note| note.with("operation", name)));
    }
    notes
}

/// Takes strokes of `task` away that find their hole drilled.
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

/// Whether `shape` of `board` was milled before as deep, which counts it among those that are there twice.
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
