//! The slots that programs clear, against those of the board (N8 N9).
//!
//! ```text
//!    ╭┄×┄┄×┄┄×┄╮      at every place of the middle line, and across it near both edges, something must have gone deep
//!    ┄ ×  ×  × ┄
//!    ╰┄×┄┄×┄┄×┄╯
//! ```
//!
//! Comes in: boards as they lie with what goes deep in them; their slots in the same order. Goes out: places of slots. Does not
//! look at copper.

use super::deep::Swept;
use super::drilled::{DrillingProof, Layer};
use super::edges::Spot;
use crate::board::Slot;
use crate::job::Asked;
use crate::units::Length;

/// Places along a slot are this far apart, in mm.
const STEP_MM: f64 = 0.25;
/// What digits of files and chords of arcs may leave of an edge, in mm.
const SLACK_MM: f64 = 0.03;

/// Tells the slots that nothing clears, and those that are not deep enough. `any`: holes are made.
pub(super) fn slots(layers: &[Layer<'_>], (asked, any): (&Asked, bool), out: &mut DrillingProof) {
    let Some(first) = layers.first().filter(|first| !first.board.slots.is_empty()) else { return };
    let swept: Vec<Swept> = layers.iter().map(|layer| Swept::of(layer.legs.iter())).collect();
    let cleared = |number: usize, depth: Length| {
        let of_side = |(layer, swept): (&Layer<'_>, &Swept)| {
            let slot = layer.board.slots.get(number)?;
            Some((places(slot, asked.tolerance)?, swept)).map(|(places, swept)| {
                places.iter().map(|spot| swept.cover(*spot, SLACK_MM, depth)).collect::<Vec<_>>()
            })
        };
        let sides: Vec<Vec<bool>> = layers.iter().zip(&swept).filter_map(of_side).collect();
        let count = sides.iter().map(Vec::len).max().unwrap_or_default();
        let here = |index: usize| sides.iter().any(|side| side.get(index).copied().unwrap_or_default());
        (0..count).all(here)
    };
    let (mut missing, mut some) = (Vec::new(), any);
    for (number, slot) in first.board.slots.iter().enumerate().filter(|(_, slot)| slot.width.is_some()) {
        let at = slot.path.get(slot.path.len() / 2).copied().unwrap_or_default();
        if !cleared(number, Length::ZERO) {
            missing.push(at);
            continue;
        }
        some = true;
        if !cleared(number, asked.milled) {
            out.shallow.push(at);
        }
    }
    if asked.slots.unwrap_or(some) {
        out.slots_missing = missing;
    }
}

/// Where a slot must be cleared: along its middle, and near its edges as far as a tool may be of another size.
fn places(slot: &Slot, tolerance: Length) -> Option<Vec<Spot>> {
    let half = (slot.width?.mm() / 2.0 - tolerance.mm() / 2.0 - SLACK_MM).max(0.0);
    let spots: Vec<Spot> = slot.path.iter().copied().map(Spot::of).collect();
    let mut places: Vec<Spot> = spots.iter().copied().take(1).collect();
    for (from, to) in spots.iter().zip(spots.iter().skip(1)) {
        let length = from.distance(*to);
        if length <= 0.0 {
            continue;
        }
        let across = Spot { x: (from.y - to.y) / length * half, y: (to.x - from.x) / length * half };
        let count = libm::ceil(length / STEP_MM).clamp(1.0, 2_000.0) as u32;
        for index in 0..=count {
            let middle = from.towards(*to, f64::from(index) / f64::from(count));
            let other = Spot { x: middle.x + across.x, y: middle.y + across.y };
            places.extend([middle, other, middle.minus(across)]);
        }
    }
    Some(places)
}
