//! What a job says it clears: all copper beside the picture that a bit reaches.
//!
//! ```text
//!   ▓▓▓ copper ▓▓▓ ┆ margin ┆ (bit) ┆┄┄▶ as far as the bit's middle may go beside the board
//! ```
//!
//! Comes in: a person's choice. Goes out: widths in [`Length`]. Does not know how toolpaths are made.

use super::Bit;
use crate::geometry::Point;
use crate::units::Length;
use serde::{Deserialize, Serialize};

/// The narrowest cut with which an operation clears.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Cleared {
    /// How wide it is at the surface.
    pub surface: Length,
    /// How wide it is at the underside of the copper, above zero.
    pub through: Length,
    /// What is kept around the copper beyond the bit itself.
    pub margin: Length,
    /// How far the middle of the bit may go beyond the outline; without one, what is cleared goes so far beyond the copper.
    pub beyond: Length,
}

impl Cleared {
    /// What `bit` clears at `depth`; none where it does not go through copper of this thickness.
    pub fn by(bit: &Bit, depth: Length, copper: Length, (margin, beyond): (Length, Length)) -> Option<Self> {
        let (surface, through) = (bit.width_at(depth), bit.width_at(depth - copper));
        let goes = depth >= copper && through > Length::ZERO;
        goes.then_some(Self { surface, through, margin, beyond })
    }
}

/// What a job promises of the copper of one side.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Promised {
    /// The bits that a person owns, for cures.
    pub owned: Vec<Bit>,
    /// The gaps, by their two sides, through whose middle a person has a pass made though it is too wide.
    pub agreed: Vec<(Point, Point)>,
    /// What is cleared.
    pub cleared: Vec<Cleared>,
    /// Whether anything is to separate the nets; none where nobody says.
    pub isolates: Option<bool>,
}
