//! The board as meant: holes and slots with their sizes, from whatever files described them.
//!
//! Comes in: drill files as written. Goes out: a [`Board`]. Does not know the words of any file format.

mod from_artwork;

pub use from_artwork::from_artwork;

use crate::geometry::{Bounds, Point};
use crate::units::Length;
use serde::{Deserialize, Serialize};

/// A round hole.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Hole {
    /// Its centre.
    pub at: Point,
    /// Finished diameter asked for; none where the file does not say (then a person must).
    pub diameter: Option<Length>,
    /// Plated through, not plated, or not said.
    pub plated: Option<bool>,
    /// Which of the board's sources it came from.
    pub source: u32,
    /// Tool number in that source.
    pub tool_code: u32,
    /// Line in that source, from 1.
    pub line: u32,
}

/// An elongated hole: a bit swept along a path of points (arcs already cut into chords of ≤ 5 µm error).
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Slot {
    /// Centre line, at least two points.
    pub path: Vec<Point>,
    /// Width asked for; none where the file does not say.
    pub width: Option<Length>,
    /// Plated, not plated, or not said.
    pub plated: Option<bool>,
    /// Which of the board's sources it came from.
    pub source: u32,
    /// Tool number in that source.
    pub tool_code: u32,
    /// Line in that source, from 1.
    pub line: u32,
}

/// A board to be drilled. Coordinates are the files' own.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Board {
    /// Name for people, from the files.
    pub name: String,
    /// Names of the files it was made from.
    pub sources: Vec<String>,
    /// Round holes in file order.
    pub holes: Vec<Hole>,
    /// Slots in file order.
    pub slots: Vec<Slot>,
    /// Outline of the board, if a file gave one: closed polygons.
    pub outline: Vec<Vec<Point>>,
}

impl Board {
    /// The box around all centres and slot points.
    pub fn bounds(&self) -> Option<Bounds> {
        let holes = self.holes.iter().map(|hole| hole.at);
        Bounds::around(holes.chain(self.slots.iter().flat_map(|slot| slot.path.iter().copied())))
    }
}
