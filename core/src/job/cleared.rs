//! The copper that a job promises to clear: all unwanted copper that a bit reaches.
//!
//! ```text
//! ▓▓▓ copper ▓▓▓ ┆ margin ┆ (bit) ┆┄┄▶ up to the greatest distance of the bit's centre from the board
//! ```

use super::Bit;
use crate::geometry::Point;
use crate::units::Length;
use serde::{Deserialize, Serialize};

/// The narrowest cut of a clearing operation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Cleared {
    /// Width at the surface.
    pub surface: Length,
    /// Width at the underside of the copper, above zero.
    pub through: Length,
    /// Distance from the copper, in addition to the bit.
    pub margin: Length,
    /// Greatest distance of the bit's centre outside the outline; without an outline, outside the copper.
    pub beyond: Length,
}

impl Cleared {
    /// The cut of `bit` at `depth`; none if it doesn't go through copper of this thickness.
    pub fn by(bit: &Bit, depth: Length, copper: Length, (margin, beyond): (Length, Length)) -> Option<Self> {
        let (surface, through) = (bit.width_at(depth), bit.width_at(depth - copper));
        let goes = depth >= copper && through > Length::ZERO;
        goes.then_some(Self { surface, through, margin, beyond })
    }
}

/// Promises of a job for the copper of one side.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Promised {
    /// The user's bits, for fixes.
    pub owned: Vec<Bit>,
    /// Gaps, by their two sides, that the user agreed to cut through the middle although the pass is too
    /// wide.
    pub agreed: Vec<(Point, Point)>,
    pub cleared: Vec<Cleared>,
    /// True if the nets must be separated; none if unspecified.
    pub isolates: Option<bool>,
}
