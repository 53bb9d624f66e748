//! Holes that operations drill twice: the second stroke goes.
//!
//! Comes in: parts, in the order of their operations. Goes out: the same without strokes that find their hole made, and a note
//! for every operation that loses some. A bit that comes back to go deeper stays, as one does that only marks holes.

use super::super::places::{Places, Twice};
use super::super::work::Work;
use super::{Part, title};
use crate::remark::Remark;

/// Takes strokes away whose hole was drilled before as deep with the same bit. Parts keep the holes they count as made.
pub(super) fn once(work: &Work, parts: &mut [Part]) -> Vec<Remark> {
    let mut places = Places::default();
    let mut notes = Vec::new();
    for part in parts {
        let mut twice = Twice::default();
        part.tasks.retain_mut(|task| {
            let (bit, depth) = (task.bit.diameter, task.depth);
            let before = task.strokes.len();
            task.strokes.retain(|stroke| {
                let again = stroke.hole.is_some() && places.again(bit, stroke.at, depth);
                if again {
                    twice.add(stroke.at);
                }
                !again
            });
            task.strokes.len() == before || !task.strokes.is_empty() || !task.ways.is_empty()
        });
        let name = work.operations.get(part.operation as usize).map(title).unwrap_or_default();
        notes.extend(twice.note("cam.holes_twice").map(|note| note.with("operation", name)));
    }
    notes
}
