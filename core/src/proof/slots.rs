//! Compares the slots that programs clear with those of the board.
//!
//! ```text
//!    ╭┄×┄┄×┄┄×┄╮      every point of the centre line, and of lines near both edges, must be cut deep
//!    ┄ ×  ×  × ┄
//!    ╰┄×┄┄×┄┄×┄╯
//! ```

use super::deep::Swept;
use super::edges::Spot;
use super::sides::{DrillingProof, Layer};
use crate::board::Slot;
use crate::job::Asked;
use crate::units::Length;

const STEP_MM: f64 = 0.25;
/// With at least this share of a slot cut deep, the cut is meant for it.
const MEANT_SHARE: f64 = 0.3;
/// Tolerance of an edge for digits of files and chords of arcs, in mm.
const SLACK_MM: f64 = 0.03;

/// Reports slots that nothing clears, and those that are not deep enough. `any`: holes are made.
pub(super) fn slots(layers: &[Layer<'_>], (asked, any): (&Asked, bool), out: &mut DrillingProof) {
    let Some(first) = layers.first().filter(|first| !first.board.slots.is_empty()) else { return };
    let swept: Vec<Swept> = layers.iter().map(|layer| Swept::of(layer.legs.iter())).collect();
    let cleared = |number: usize, depth: Length| -> (usize, usize) {
        let of_side = |(layer, swept): (&Layer<'_>, &Swept)| {
            let slot = layer.board.slots.get(number)?;
            Some((places(slot, asked.tolerance)?, swept)).map(|(places, swept)| {
                places.iter().map(|spot| swept.cover(*spot, SLACK_MM, depth)).collect::<Vec<_>>()
            })
        };
        let sides: Vec<Vec<bool>> = layers.iter().zip(&swept).filter_map(of_side).collect();
        let count = sides.iter().map(Vec::len).max().unwrap_or_default();
        let here = |index: usize| sides.iter().any(|side| side.get(index).copied().unwrap_or_default());
        ((0..count).filter(|index| here(*index)).count(), count)
    };
    let (mut missing, mut some) = (Vec::new(), any);
    for (number, slot) in first.board.slots.iter().enumerate().filter(|(_, slot)| slot.width.is_some()) {
        let at = slot.path.get(slot.path.len() / 2).copied().unwrap_or_default();
        let (here, all) = cleared(number, Length::ZERO);
        if here < all {
            // Enough of the slot is cut deep to be meant for it.
            some |= here as f64 >= all as f64 * MEANT_SHARE;
            missing.push(at);
            continue;
        }
        (some, out.made) = (true, out.made + 1);
        let (here, all) = cleared(number, asked.milled);
        if here < all {
            out.shallow.push(at);
        }
    }
    if asked.slots.unwrap_or(some) {
        out.slots_missing = missing;
    } else if asked.slots.is_none() {
        out.slots_left = missing;
    }
}

/// Points of a slot that must be cleared: on its centre line, and near its edges within the size tolerance.
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
