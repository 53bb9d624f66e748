//! Canned cycles of drilling: G73 G81 G82 G83 G85 G86 G89 with G98 and G99, and Sinumerik's CYCLE81 to CYCLE83.
//!
//! ```text
//!   ┄┄┄┄┄┄┄┄ height before the cycle (G98 comes back to it)
//!   ┄┄┄┄┄┄┄┄ R: rapid down to here (G99 comes back to it)
//!   ════╤═══ board
//!       ▼ Z
//! ```
//!
//! Comes in: a place, R and Z. Goes out: moves for the hand. Pecks end where the hole ends: they are not followed one by one.

use super::hand::{Hand, Tip};
use crate::diagnostic::Diagnostic;

/// A cycle that holds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Cycle {
    /// The height where the fast move down ends.
    pub(super) reference_mm: f64,
    /// The bottom.
    pub(super) bottom_mm: f64,
    /// The height before the first hole.
    pub(super) before_mm: f64,
    /// Up to the height before it, not only to the reference.
    pub(super) back: bool,
}

impl Cycle {
    /// Drills at a place.
    pub(super) fn drill(&self, hand: &mut Hand, (x, y): (f64, f64)) -> Result<(), Diagnostic> {
        hand.another();
        let over = hand.tip.z.max(self.reference_mm);
        let at = |z: f64| Tip { x, y, z };
        hand.line_to(Tip { z: over, ..hand.tip }, true)?;
        hand.line_to(at(over), true)?;
        hand.line_to(at(self.reference_mm), true)?;
        hand.line_to(at(self.bottom_mm), false)?;
        hand.line_to(
            at(if self.back { self.before_mm.max(self.reference_mm) } else { self.reference_mm }),
            true,
        )
    }

    /// The cycle that a Sinumerik call drills where the tip is: retraction plane, reference, distance over it, bottom, or depth
    /// from the reference. `scale_mm` is a unit in mm.
    pub(super) fn called(numbers: &[Option<f64>], scale_mm: f64) -> Option<Self> {
        let number = |at: usize| numbers.get(at).copied().flatten().map(|number| number * scale_mm);
        let (retract, surface, over) = (number(0)?, number(1)?, number(2)?);
        let bottom = number(3).or_else(|| Some(surface - number(4)?))?;
        Some(Self { reference_mm: surface + over, bottom_mm: bottom, before_mm: retract, back: true })
    }
}
