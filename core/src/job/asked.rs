//! Requirements of a job for holes, slots and the board's edge, and the copper that it promises to clear: all
//! unwanted copper that a bit reaches. The proof checks programs against them.
//!
//! ```text
//! ▓▓▓ copper ▓▓▓ ┆ margin ┆ (bit) ┆┄┄▶ up to the greatest distance of the bit's centre from the board
//! ```

use super::Bit;
use crate::geometry::Point;
use crate::units::Length;
use serde::{Deserialize, Serialize};

/// Requirements beyond the copper. For options, none means unspecified: the requirement holds if the programs
/// start to meet it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Asked {
    pub thickness: Length,
    /// Greatest difference between the diameters of a tool and its hole or slot.
    pub tolerance: Length,
    pub drilled: Length,
    pub milled: Length,
    /// True if the holes of the board must be made.
    pub holes: Option<bool>,
    pub pins: bool,
    /// True if slots must be made.
    pub slots: Option<bool>,
    /// Cutting out of the board; none if unspecified.
    pub cut_out: Option<AskedEdge>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AskedEdge {
    /// Least depth.
    pub depth: Length,
    /// The bit runs on the line, else outside the board.
    pub on_line: bool,
    /// Length of each contour that may stay, for tabs.
    pub spared: Length,
    /// Zones keep the bit out, anywhere.
    pub zones: bool,
    /// Diameter of the bit for the outline.
    pub bit: Length,
    /// Rows of holes along the edge let the tabs break.
    pub bites: bool,
    /// Number of tabs, on each contour or in total.
    pub tabs: u32,
    /// `tabs` counts all contours together.
    pub tabs_together: bool,
    pub tab_width: Length,
}

impl Asked {
    /// Default of the greatest difference of diameters.
    pub const TOLERANCE: Length = Length::from_um(100);

    /// Requirements for a board of this thickness without a planned job.
    pub const fn nothing(thickness: Length) -> Self {
        Self {
            thickness,
            tolerance: Self::TOLERANCE,
            drilled: thickness,
            milled: thickness,
            holes: None,
            pins: false,
            slots: None,
            cut_out: None,
        }
    }
}

/// The narrowest cut of a clearing operation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Cleared {
    /// Width at the surface.
    pub surface: Length,
    /// Width at the underside of the copper, above zero.
    pub through: Length,
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
