//! What a person chose for a job: the work. Plain data that page, job file and command line share.
//!
//! ```text
//!  Work ─┬─ setup        which side is up, how the board is turned over, panel, alignment holes, zones to keep out of
//!        ├─ bits         the bits of the job by name (drills come from the machine's rack)
//!        └─ operations   isolate · clear · engrave · drill · bore · cut out, in the order in which they are done
//! ```
//!
//! Comes in: a person's choice; what is usual stands in `usual`. Goes out: [`Work`].
//! Lengths in whole nanometres, speeds in mm/s; depths are positive downwards from the surface. Does not know how toolpaths
//! are made.

use super::HoleOrder;
use crate::board::{Board, Face};
use crate::geometry::{Bounds, Point};
use crate::job::Bit;
use crate::locale;
use crate::units::Length;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// A job as chosen.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Work {
    /// How the board lies.
    pub setup: Setup,
    /// The bits of the job; names are unique.
    pub bits: Vec<Bit>,
    /// What is done, in order.
    pub operations: Vec<Operation>,
}

/// How the board lies on the machine.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Setup {
    /// The side that is up; only operations of this side are planned.
    pub face: Face,
    /// How the board is turned over for its bottom side.
    pub flip: Flip,
    /// Copies side by side.
    pub panel: Panel,
    /// Holes for pins that hold the board when it is turned over.
    pub alignment: Alignment,
    /// Which corner becomes the work zero.
    pub zero: Zero,
    /// How far toolpaths may go beyond the board's outline.
    pub margin: Length,
    /// Where no bit may go, in the coordinates of the files.
    pub exclusions: Vec<Bounds>,
}

/// How a board is turned over.
///
/// ```text
///   left_right   ┌──┊──┐  the axis stands upright:      top_bottom  ┌─────┐  the axis lies:
///                │ F┊  │  X is mirrored                             ┄┄┄┄┄┄┄  Y is mirrored
///                └──┊──┘                                            └─────┘
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Flip {
    /// About an upright axis: X is mirrored.
    #[default]
    LeftRight,
    /// About a lying axis: Y is mirrored.
    TopBottom,
}

/// The place that becomes the work zero.
///
/// ```text
///      o┌─────┐
///       │  B  │o pins      board: B's lower left corner    blank: that of all there is, pins too
///       └─────┘            file: where the files have their zero
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Zero {
    /// The lower left corner of the outline's box.
    #[default]
    Board,
    /// The lower left corner of all there is: outline, copper, holes, pins.
    Blank,
    /// The zero of the files, mirrored with the board where its bottom is up.
    File,
}

/// Copies of the board side by side.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Panel {
    /// How many beside each other, 1 … 50.
    pub columns: u32,
    /// How many behind each other, 1 … 50.
    pub rows: u32,
    /// Between the outlines of neighbours.
    pub gap: Length,
}

/// Holes for pins, symmetric about the axis that the board is turned about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Alignment {
    /// Pairs of holes; 0 is none.
    pub pairs: u32,
    /// Diameter of the pins.
    pub diameter: Length,
    /// From the outline to the middle of a hole.
    pub margin: Length,
    /// How deep they go below the board into the bed.
    pub depth: Length,
}

impl Setup {
    /// The holes for pins among those of a board as it lies with them: the last ones.
    pub fn pins(&self, laid: &Board) -> Range<u32> {
        let all = laid.holes.len() as u32;
        all.saturating_sub(2 * self.alignment.pairs)..all
    }
}

/// One thing that is done.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Operation {
    /// Name for people.
    pub name: String,
    /// Whether it is done.
    pub on: bool,
    /// On which side.
    pub face: Face,
    /// Name of its bit among [`Work::bits`]; drilling takes its bits from the rack.
    pub bit: String,
    /// Feed in the plane, mm/s.
    pub feed_mm_per_s: f64,
    /// Feed straight down, mm/s.
    pub plunge_mm_per_s: f64,
    /// Spindle speed, rpm.
    pub spindle_rpm: u32,
    /// Depth below the surface; 0 for through the board and the machine's breakthrough.
    pub depth: Length,
    /// Greatest depth of one pass; 0 for all at once.
    pub depth_per_pass: Length,
    /// What is done.
    pub action: OperationKind,
}

/// The kinds of operations.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum OperationKind {
    /// Cut grooves round the copper.
    Isolate(Isolate),
    /// Take all copper away that does not belong to the picture.
    Clear(Clear),
    /// Follow lines with the middle of the bit.
    Engrave(Engrave),
    /// Drill round holes.
    Drill(Drill),
    /// Mill slots, and holes for which there is no drill.
    MillHoles(MillHoles),
    /// Cut the board out.
    CutOut(CutOut),
}

/// Sense of cutting, for a spindle that turns clockwise seen from above.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CutDirection {
    /// What stays is on the right of the bit's way.
    #[default]
    Climb,
    /// What stays is on the left of the bit's way.
    Conventional,
}

/// Isolation passes round the copper.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Isolate {
    /// How many grooves beside each other, 1 … 20.
    pub passes: u32,
    /// How much of its width a groove shares with its neighbour, in per cent, below 100.
    pub overlap_percent: f64,
    /// Sense of cutting of the groove beside the copper.
    pub direction: CutDirection,
    /// How far a closed groove goes on beyond its start.
    pub loop_overlap: Length,
    /// One groove in the middle between neighbours: all other copper stays.
    pub voronoi: bool,
    /// Strips of copper too thin to hold, which grooves leave between them, are milled away.
    pub slivers: bool,
    /// Names of smaller bits, for the gaps that the bits before them did not reach.
    pub further: Vec<String>,
    /// Places that a person wants done otherwise.
    pub cures: Vec<LocalIsolation>,
}

/// One place where isolation is done otherwise.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LocalIsolation {
    /// The gap on one of its sides, in the coordinates of the board as it lies for this operation.
    pub from: Point,
    /// The gap on its other side.
    pub to: Point,
    /// What is done.
    pub with: Remedy,
}

/// What is done with a gap that is too narrow for the bit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Remedy {
    /// Another bit cuts it, by name; a V-bit as deep as fits the gap.
    Bit(String),
    /// The same V-bit cuts it at this depth.
    Depth(Length),
    /// The thinnest bit of the operation cuts its middle, a V-bit no deeper than must be, and takes from the copper on both
    /// sides what it is too wide.
    Centred,
}

/// All copper away that does not belong to the picture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Clear {
    /// How far neighbouring toolpaths are apart, in per cent of the width of the cut, above 0, at most 100.
    pub stepover_percent: f64,
    /// What is kept around the copper beyond the bit itself.
    pub margin: Length,
    /// Sense of cutting.
    pub direction: CutDirection,
    /// Names of smaller bits, for what the bits before them did not reach.
    pub further: Vec<String>,
}

/// Lines that the middle of the bit follows.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Engrave {
    /// Which lines.
    pub of: Lines,
}

/// Lines of a board.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Lines {
    /// The middle lines of the strokes of the legend.
    #[default]
    Legend,
    /// The board's outline.
    Outline,
    /// The edges of the copper.
    Copper,
}

/// Round holes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Drill {
    /// Which holes.
    pub holes: Holes,
    /// Their order.
    pub order: HoleOrder,
    /// How far a hole's size may be from the bit used for it.
    pub tolerance: Length,
    /// Depth after which the bit comes up to clear itself; 0 for never.
    pub peck: Length,
    /// Angle of the drills' points in degrees: through a board they go deeper by the height of the point; 180 is flat.
    pub point_deg: f64,
    /// The same for single drills of the rack, by their diameter.
    pub points: Vec<(Length, f64)>,
}

/// Sets of holes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Holes {
    /// The holes of the board.
    #[default]
    Board,
    /// The holes for pins, symmetric about the axis of turning over.
    Alignment,
}

/// Slots, and holes for which there is no drill.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct MillHoles {
    /// Slots too.
    pub slots: bool,
    /// Round holes that no drill of the rack fits.
    pub holes: bool,
    /// Sense of cutting.
    pub direction: CutDirection,
    /// Names of smaller bits, for what the bit does not fit into.
    pub further: Vec<String>,
}

/// The board is cut out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CutOut {
    /// On which side of the outline the bit runs.
    pub side: CutSide,
    /// Sense of cutting.
    pub direction: CutDirection,
    /// How many tabs hold the board, spread evenly along the outline; 0 for none.
    pub tabs: u32,
    /// Width of a tab.
    pub tab_width: Length,
    /// Height of a tab above the bottom of the board; with mouse-bites a tab is as high as the board.
    pub tab_height: Length,
    /// Middles of tabs by hand, each put on the nearest place of the outline; where there are any, none is spread.
    pub tab_at: Vec<Point>,
    /// Rows of holes across the tabs, so that they break.
    pub bites: bool,
    /// Diameter of a mouse-bite hole.
    pub bite_hole: Length,
    /// From hole to hole.
    pub bite_pitch: Length,
    /// Angle in degrees at which the bit goes down along its way; 0 for straight down.
    pub ramp_deg: f64,
    /// Names of smaller bits, for inner contours and inlets that the bits before them did not get into.
    pub further: Vec<String>,
}

/// On which side of the outline the bit runs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CutSide {
    /// The board keeps its size.
    #[default]
    Outside,
    /// The bit runs on the line.
    On,
}

impl Default for Setup {
    fn default() -> Self {
        let mm = Length::from_mm;
        Self {
            face: Face::Top,
            flip: Flip::LeftRight,
            panel: Panel { columns: 1, rows: 1, gap: mm(3.0) },
            alignment: Alignment { pairs: 0, diameter: mm(3.0), margin: mm(4.0), depth: mm(6.0) },
            zero: Zero::Board,
            margin: mm(1.0),
            exclusions: Vec::new(),
        }
    }
}

impl Default for Isolate {
    fn default() -> Self {
        Self {
            passes: 2,
            overlap_percent: 30.0,
            direction: CutDirection::Climb,
            loop_overlap: Length::from_um(500),
            voronoi: false,
            slivers: true,
            further: Vec::new(),
            cures: Vec::new(),
        }
    }
}

impl Isolate {
    /// Has the gap between `from` and `to` done with this remedy, whatever was chosen for it before. Whether that is new.
    pub fn cure(&mut self, from: Point, to: Point, with: Remedy) -> bool {
        let cure = LocalIsolation { from, to, with };
        let new = !self.cures.contains(&cure);
        if new {
            self.cures.retain(|other| (other.from, other.to) != (from, to));
            self.cures.push(cure);
        }
        new
    }
}

impl Default for Clear {
    fn default() -> Self {
        Self {
            stepover_percent: 60.0,
            margin: Length::ZERO,
            direction: CutDirection::Climb,
            further: Vec::new(),
        }
    }
}

impl Default for CutOut {
    fn default() -> Self {
        let mm = Length::from_mm;
        Self {
            side: CutSide::Outside,
            direction: CutDirection::Climb,
            tabs: 4,
            tab_width: mm(2.0),
            tab_height: mm(0.6),
            tab_at: Vec::new(),
            bites: false,
            bite_hole: mm(0.5),
            bite_pitch: mm(0.8),
            ramp_deg: 3.0,
            further: Vec::new(),
        }
    }
}

impl OperationKind {
    /// Its word in files.
    pub const fn word(&self) -> &'static str {
        match self {
            Self::Isolate(_) => "isolate",
            Self::Clear(_) => "clear",
            Self::Engrave(_) => "engrave",
            Self::Drill(_) => "drill",
            Self::MillHoles(_) => "mill_holes",
            Self::CutOut(_) => "cut_out",
        }
    }

    /// The key of what people call it, in the locale tables.
    pub fn title_key(&self) -> String {
        format!("page.cam.word.{}", self.word())
    }

    /// The words of all kinds, in the order in which a job does them.
    pub const WORDS: [&'static str; 6] = ["isolate", "clear", "engrave", "drill", "mill_holes", "cut_out"];
}

impl Work {
    /// The bit called `name`.
    pub fn bit(&self, name: &str) -> Option<&Bit> {
        self.bits.iter().find(|bit| bit.name == name)
    }

    /// The sides that have something to do, in the order of their first operations.
    pub fn faces(&self) -> Vec<Face> {
        let mut faces = Vec::new();
        for operation in self.operations.iter().filter(|operation| operation.on) {
            if !faces.contains(&operation.face) {
                faces.push(operation.face);
            }
        }
        faces
    }

    /// The angle of the drills' points, where an operation drills.
    pub fn point_deg(&self) -> Option<f64> {
        self.operations.iter().filter(|one| one.on).find_map(|one| match &one.action {
            OperationKind::Drill(drill) => Some(drill.point_deg),
            _ => None,
        })
    }
}

impl Operation {
    /// What sentences call it: its name, else the word for what it does.
    pub fn title(&self) -> String {
        if self.name.is_empty() { locale::word(&self.action.title_key()) } else { self.name.clone() }
    }

    /// The names of all bits that it uses: its own first, then further ones, then those of cures. None for drilling.
    pub fn bit_names(&self) -> Vec<&str> {
        let own = self.bit.as_str();
        let further = match &self.action {
            OperationKind::Drill(_) => return Vec::new(),
            OperationKind::Isolate(Isolate { further, .. })
            | OperationKind::Clear(Clear { further, .. })
            | OperationKind::MillHoles(MillHoles { further, .. })
            | OperationKind::CutOut(CutOut { further, .. }) => further.as_slice(),
            OperationKind::Engrave(_) => &[],
        };
        let mut names: Vec<&str> = std::iter::once(own).chain(further.iter().map(String::as_str)).collect();
        if let OperationKind::Isolate(isolate) = &self.action {
            names.extend(isolate.cures.iter().filter_map(|cure| match &cure.with {
                Remedy::Bit(name) => Some(name.as_str()),
                _ => None,
            }));
        }
        names
    }
}
