//! The board as intended: holes and slots with sizes, independent of the file formats.

mod boards;
pub mod changes;
mod copper;
pub mod drawing;
mod drill_layers;
mod faces;
#[cfg(test)]
mod frame_tests;
mod from_artwork;
mod lay;
mod legend;
mod mend;
mod outline;
mod rivals;
mod split;
#[cfg(test)]
mod tests;
mod trace;

pub use from_artwork::{BoardWanted, from_artwork, from_artwork_telling, from_artwork_with};

use crate::artwork::NamedPad;
use crate::geometry::{Bounds, Path, Point, Region};
use crate::units::Length;
use serde::{Deserialize, Serialize};

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Hole {
    pub at: Point,
    /// Finished diameter; `None` if the file doesn't state it, then the user must.
    pub diameter: Option<Length>,
    /// `None` if the file doesn't state it.
    pub plated: Option<bool>,
    /// Index into the board's sources.
    pub source: u32,
    pub tool_code: u32,
    /// Line in that source, from 1.
    pub line: u32,
}

/// A slot: a tool swept along a path of points (arcs already cut into chords with an error of at most 5 µm).
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Slot {
    /// Centre line, at least two points.
    pub path: Vec<Point>,
    /// `None` if the file doesn't state it.
    pub width: Option<Length>,
    /// `None` if the file doesn't state it.
    pub plated: Option<bool>,
    /// Index into the board's sources.
    pub source: u32,
    /// Tool number in that source.
    pub tool_code: u32,
    /// Line in that source, from 1.
    pub line: u32,
}

/// Copper thickness of a standard board: 1 oz on a square foot.
pub const COPPER_THICKNESS: Length = Length::from_um(35);

/// Extra depth beyond the copper thickness for a cut that must certainly go through it.
pub const DEPTH_MARGIN: Length = Length::from_um(15);

/// Depth below the board that needs no warning: the thickness of a usual spoilboard. A pin hole (`is_pin`)
/// enters the bed on purpose, up to this depth.
pub const fn bed(is_pin: bool) -> Length {
    Length::from_um(if is_pin { 10_000 } else { 3_000 })
}

/// Copper narrower than this may tear off.
pub const THINNEST: Length = Length::from_um(50);

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Face {
    /// The component side, as the files show it.
    #[default]
    Top,
    Bottom,
}

impl Face {
    /// Name in file names and reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Top => "top",
            Self::Bottom => "bottom",
        }
    }
}

#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Copper {
    pub face: Face,
    /// The copper islands, without copper that is to be removed.
    pub region: Region,
    /// The net of each island from X2 attributes; `None` if there is none, then the island is its own net.
    pub nets: Vec<Option<String>>,
    /// A pad or part on each island from X2 attributes, as a name for islands without a net. Empty if there
    /// are no attributes.
    #[serde(default)]
    pub pads: Vec<Option<String>>,
    /// The pads that X2 attributes name, with their positions.
    #[serde(default)]
    pub named: Vec<NamedPad>,
    /// Index into the board's sources.
    pub source: u32,
}

#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Legend {
    pub face: Face,
    /// Centre lines of strokes, and edges of areas.
    pub strokes: Vec<Path>,
    /// Number of flashes, which have no centre line.
    pub flashes: u32,
    /// Index into the board's sources.
    pub source: u32,
}

/// A board to be made. Coordinates are the files' own.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Board {
    pub name: String,
    pub sources: Vec<String>,
    /// Round holes in file order.
    pub holes: Vec<Hole>,
    /// Slots in file order.
    pub slots: Vec<Slot>,
    /// Material of the board: outer edges and inner cut-outs, arcs preserved. Empty if no file has an
    /// outline; use [`Board::bounds`] with a margin then.
    pub outline: Region,
    /// At most one entry for each side.
    pub copper: Vec<Copper>,
    pub legend: Vec<Legend>,
}

impl Board {
    /// The area inside the outer edges of the outline, cut-outs filled; empty without an outline.
    pub fn body(&self) -> Region {
        outline::filled(&self.outline)
    }

    /// The board without its copper areas; the named pads of each side stay. For callers that have the areas
    /// elsewhere, or need none.
    #[must_use]
    pub fn without_areas(&self) -> Self {
        let named = |copper: &Copper| {
            let (face, named, source) = (copper.face, copper.named.clone(), copper.source);
            Copper { face, named, source, ..Copper::default() }
        };
        Self {
            name: self.name.clone(),
            sources: self.sources.clone(),
            holes: self.holes.clone(),
            slots: self.slots.clone(),
            outline: self.outline.clone(),
            copper: self.copper.iter().map(named).collect(),
            legend: self.legend.clone(),
        }
    }

    pub fn bounds(&self) -> Option<Bounds> {
        let holes = self.holes.iter().map(|hole| hole.at);
        Bounds::around(holes.chain(self.slots.iter().flat_map(|slot| slot.path.iter().copied())))
    }
}
