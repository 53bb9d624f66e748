//! The board as meant: holes and slots with their sizes, from whatever files described them.
//!
//! Comes in: drill files as written. Goes out: a [`Board`]. Does not know the words of any file format.

pub mod changes;
mod copper;
pub mod drawing;
mod from_artwork;
mod lay;
mod legend;
mod mend;
mod outline;
mod rivals;
#[cfg(test)]
mod tests;

pub use from_artwork::{BoardWanted, from_artwork, from_artwork_telling, from_artwork_with};

use crate::artwork::NamedPad;
use crate::geometry::{Bounds, Path, Point, Region};
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

/// How thick the copper of a usual board is: 1 oz on a square foot.
pub const COPPER_THICKNESS: Length = Length::from_um(35);

/// How much deeper than the copper is thick a cut goes that must go through it for certain.
pub const DEPTH_MARGIN: Length = Length::from_um(15);

/// How far below the board a tip may go before that is told: as thick as a usual bed is. A hole for a pin (`is_pin`) goes into the
/// bed on purpose; deeper than this nobody's bed is meant to be drilled for one.
pub const fn bed(is_pin: bool) -> Length {
    Length::from_um(if is_pin { 10_000 } else { 3_000 })
}

/// Copper thinner than this may tear off.
pub const THINNEST: Length = Length::from_um(50);

/// Which side of a board.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Face {
    /// The component side, as the files show it.
    #[default]
    Top,
    /// The solder side.
    Bottom,
}

impl Face {
    /// Its word in names of files and in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Top => "top",
            Self::Bottom => "bottom",
        }
    }
}

/// The copper of one side, as it shall be.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Copper {
    /// Which side it is on.
    pub face: Face,
    /// What is copper, in islands. Copper that is not wanted at all is not in it.
    pub region: Region,
    /// The net of every island, as X2 attributes say; none where they do not, then every island is a net of its own.
    pub nets: Vec<Option<String>>,
    /// A pad or part on every island, as X2 attributes say, to call islands by that have no net; empty where they never do.
    #[serde(default)]
    pub pads: Vec<Option<String>>,
    /// The pads that X2 attributes name, where they lie.
    #[serde(default)]
    pub named: Vec<NamedPad>,
    /// Which of the board's sources it came from.
    pub source: u32,
}

/// The lines that a legend is drawn with.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Legend {
    /// Which side it is on.
    pub face: Face,
    /// Middle lines of its strokes, and the edges of its areas.
    pub strokes: Vec<Path>,
    /// How much of it is stamped and has no middle line.
    pub flashes: u32,
    /// Which of the board's sources it came from.
    pub source: u32,
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
    /// The material of the board, if a file gave its outline: outer edges and inner cut-outs, arcs kept. Empty where no
    /// file did; whoever needs one then takes [`Board::bounds`] and a margin of its own.
    pub outline: Region,
    /// Copper by side: at most one entry for each.
    pub copper: Vec<Copper>,
    /// Legends by side.
    pub legend: Vec<Legend>,
}

impl Board {
    /// What the outer edges of the outline enclose, inner cut-outs filled; empty where there is no outline.
    pub fn body(&self) -> Region {
        outline::filled(&self.outline)
    }

    /// The board without the areas of its copper: of every side what bears names, where it lies. For those who have the areas
    /// otherwise, or need none.
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

    /// The box around all centres and slot points.
    pub fn bounds(&self) -> Option<Bounds> {
        let holes = self.holes.iter().map(|hole| hole.at);
        Bounds::around(holes.chain(self.slots.iter().flat_map(|slot| slot.path.iter().copied())))
    }
}
