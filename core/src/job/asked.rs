//! What a job asks of holes, slots and the edge of the board: what the proof of its programs is measured against.
//!
//! Comes in: a person's choice. Goes out: [`Asked`]; lengths in [`Length`], depths positive downwards from the surface. Does not
//! know how toolpaths are made.

use crate::units::Length;

/// What is asked beyond the copper. Where nobody says, it is asked for once programs begin with it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Asked {
    /// How thick the board is.
    pub thickness: Length,
    /// How far a tool's diameter may be from that of its hole or slot.
    pub tolerance: Length,
    /// How deep holes are drilled at least.
    pub drilled: Length,
    /// How deep holes and slots are milled at least.
    pub milled: Length,
    /// Whether the holes of the board are made; none where nobody says.
    pub holes: Option<bool>,
    /// Whether the holes for pins are made.
    pub pins: bool,
    /// Whether slots are made; none where nobody says.
    pub slots: Option<bool>,
    /// How the board is cut out; none where nobody says that it is.
    pub cut_out: Option<AskedEdge>,
}

/// How a board is cut out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AskedEdge {
    /// How deep, at least.
    pub depth: Length,
    /// The bit runs on the line; else beside the board.
    pub on_line: bool,
    /// So much of every contour may stay: tabs.
    pub spared: Length,
    /// Zones keep the bit out, wherever they are.
    pub zones: bool,
    /// Diameter of the bit that goes round the board.
    pub bit: Length,
    /// So many tabs are left: on every contour, or on all of them together.
    pub tabs: u32,
    /// Whether `tabs` are those of all contours together.
    pub tabs_together: bool,
    /// How wide a tab is.
    pub tab_width: Length,
}

impl Asked {
    /// How far a tool's diameter may be from its hole's where nobody says.
    pub const TOLERANCE: Length = Length::from_um(100);

    /// What is asked of a board of this thickness where nobody planned a job.
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
