//! Canned drilling cycles: G73 G81 G82 G83 G85 G86 G89 with G98 and G99, and Sinumerik's CYCLE81 to CYCLE83.
//!
//! ```text
//!   ┄┄┄┄┄┄┄┄ height before the cycle (G98 returns to it)
//!   ┄┄┄┄┄┄┄┄ R: rapid down to here (G99 returns to it)
//!   ════╤═══ board
//!       ▼ Z
//! ```
//!
//! Pecks are not followed individually: only their end counts.

use super::hand::{Hand, Tip};
use crate::diagnostic::Diagnostic;

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Cycle {
    pub(super) reference_mm: f64,
    pub(super) bottom_mm: f64,
    /// The height before the first hole.
    pub(super) before_mm: f64,
    /// Return to the height before the cycle, not only to the reference.
    pub(super) back: bool,
}

impl Cycle {
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

    /// The cycle that a Sinumerik call drills at the tip: retraction plane, reference, safety distance,
    /// bottom, or depth from the reference. `scale_mm` is a unit in mm.
    pub(super) fn called(numbers: &[Option<f64>], scale_mm: f64) -> Option<Self> {
        let number = |at: usize| numbers.get(at).copied().flatten().map(|number| number * scale_mm);
        let (retract, surface, over) = (number(0)?, number(1)?, number(2)?);
        let bottom = number(3).or_else(|| Some(surface - number(4)?))?;
        Some(Self { reference_mm: surface + over, bottom_mm: bottom, before_mm: retract, back: true })
    }
}
