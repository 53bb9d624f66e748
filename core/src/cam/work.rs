//! The job as the user set it up. Plain data for page, job file and command line.
//!
//! ```text
//!  Work ─┬─ setup        side that is up, flip, panel, alignment holes, zones
//!        ├─ bits         the tools of the job by name (drills come from the machine's tools)
//!        └─ operations   isolate · clear · engrave · drill · bore · cut out, in order of execution
//! ```
//!
//! Lengths in whole nanometres, speeds in mm/s; depths are positive downwards from the surface.

use super::HoleOrder;
use crate::board::{Board, Face};
use crate::geometry::{Bounds, Point};
use crate::job::Bit;
use crate::locale;
use crate::machine::Machine;
use crate::units::Length;
use serde::{Deserialize, Serialize};
use std::ops::Range;

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Work {
    pub setup: Setup,
    /// Names are unique.
    pub bits: Vec<Bit>,
    /// In order of execution.
    pub operations: Vec<Operation>,
}

/// Placement of the board on the machine.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Setup {
    /// The side that is up; only operations of this side are planned.
    pub face: Face,
    /// Flip for the bottom side.
    pub flip: Flip,
    pub panel: Panel,
    /// Pin holes that align the board after a flip.
    pub alignment: Alignment,
    pub zero: Zero,
    /// How far toolpaths may leave the board's outline.
    pub margin: Length,
    /// Zones that tools must not enter, in the coordinates of the files.
    pub exclusions: Vec<Bounds>,
}

/// How a board is flipped.
///
/// ```text
///   left_right   ┌──┊──┐  vertical axis:               top_bottom  ┌─────┐  horizontal axis:
///                │ F┊  │  X is mirrored                             ┄┄┄┄┄┄┄  Y is mirrored
///                └──┊──┘                                            └─────┘
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Flip {
    /// About a vertical axis: X is mirrored.
    #[default]
    LeftRight,
    /// About a horizontal axis: Y is mirrored.
    TopBottom,
}

/// The position that becomes the work zero.
///
/// ```text
///      o┌─────┐
///       │  B  │o pins      board: lower left corner of B      blank: of everything, including pins
///       └─────┘            file: zero of the files
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Zero {
    /// The lower left corner of the outline's bounds.
    #[default]
    Board,
    /// The lower left corner of everything: outline, copper, holes, pins.
    Blank,
    /// The zero of the files, mirrored with the board if its bottom is up.
    File,
}

/// Copies of the board in a grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Panel {
    /// Copies along X, 1 … 50.
    pub columns: u32,
    /// Copies along Y, 1 … 50.
    pub rows: u32,
    /// Between the outlines of neighbours.
    pub gap: Length,
}

/// Pin holes, symmetric about the flip axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Alignment {
    /// 0 for none.
    pub pairs: u32,
    pub diameter: Length,
    /// From the outline to the centre of a hole.
    pub margin: Length,
    /// Depth below the board, into the bed.
    pub depth: Length,
}

impl Setup {
    /// The pin holes among the holes of a placed board: the last ones.
    pub fn pins(&self, laid: &Board) -> Range<u32> {
        let all = laid.holes.len() as u32;
        all.saturating_sub(2 * self.alignment.pairs)..all
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Operation {
    pub name: String,
    /// False for an operation that is switched off.
    pub on: bool,
    pub face: Face,
    /// Name of its tool in [`Work::bits`]; drilling uses the machine's drills.
    pub bit: String,
    /// Feed in XY, mm/s; `None`: the machine's default ([`Operation::speeds`]).
    pub feed_mm_per_s: Option<f64>,
    /// Plunge feed, mm/s; `None`: the machine's default.
    pub plunge_mm_per_s: Option<f64>,
    /// Spindle speed, rpm; `None`: the machine's.
    pub spindle_rpm: Option<u32>,
    /// Depth below the surface; 0: through the board plus the machine's breakthrough.
    pub depth: Length,
    /// Greatest depth of one pass; 0: a single pass.
    pub depth_per_pass: Length,
    pub action: OperationKind,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum OperationKind {
    /// Cut grooves around the copper.
    Isolate(Isolate),
    /// Remove all copper outside the design.
    Clear(Clear),
    /// Follow lines with the tool centre.
    Engrave(Engrave),
    Drill(Drill),
    /// Mill slots, and holes without a suitable drill.
    MillHoles(MillHoles),
    /// Cut out the board.
    CutOut(CutOut),
}

/// Cutting direction, for a spindle that turns clockwise seen from above.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CutDirection {
    /// The remaining material is on the right of the tool's path.
    #[default]
    Climb,
    /// The remaining material is on the left of the tool's path.
    Conventional,
}

/// Isolation passes around the copper.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Isolate {
    /// Number of grooves side by side, 1 … 20.
    pub passes: u32,
    /// Overlap of neighbouring grooves, in per cent of their width, below 100.
    pub overlap_percent: f64,
    /// Cutting direction of the groove next to the copper.
    pub direction: CutDirection,
    /// How far a closed groove continues beyond its start.
    pub loop_overlap: Length,
    /// One groove in the middle between neighbours: all other copper stays.
    pub voronoi: bool,
    /// Mill away strips of copper between grooves that are too thin to hold.
    pub slivers: bool,
    /// Names of smaller tools, for gaps that the previous tools could not enter.
    pub further: Vec<String>,
    /// Local changes that the user chose.
    pub cures: Vec<LocalIsolation>,
}

/// A local change of isolation at one gap.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LocalIsolation {
    /// One side of the gap, in the coordinates of the board as placed for this operation.
    pub from: Point,
    /// The other side of the gap.
    pub to: Point,
    pub with: Remedy,
}

/// Remedy for a gap too narrow for the tool.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Remedy {
    /// Another tool, by name; a V-bit as deep as fits the gap.
    Bit(String),
    /// The V-bit at this depth.
    Depth(Length),
    /// The narrowest tool of the operation in the middle of the gap, a V-bit no deeper than necessary. Its
    /// excess width is lost from the copper on both sides.
    Centred,
}

/// Remove all copper outside the design.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Clear {
    /// Distance of neighbouring toolpaths, in per cent of the cut's width, above 0, at most 100.
    pub stepover_percent: f64,
    /// Extra distance from the copper.
    pub margin: Length,
    pub direction: CutDirection,
    /// Names of smaller tools, for areas that the previous tools did not reach.
    pub further: Vec<String>,
}

/// Lines that the tool centre follows.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Engrave {
    pub of: Lines,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Lines {
    /// The centre lines of the silkscreen.
    #[default]
    Legend,
    /// The board's outline.
    Outline,
    /// The edges of the copper.
    Copper,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Drill {
    pub holes: Holes,
    pub order: HoleOrder,
    /// Largest difference between a hole and its drill; `None`: the machine's `rack.tolerance`.
    pub tolerance: Option<Length>,
    /// Depth of a peck, after which the drill retracts to clear chips; 0 for none.
    pub peck: Length,
    /// Point angle of the drills in degrees: through a board they go deeper by the height of the point; 180
    /// is flat.
    pub point_deg: f64,
    /// Point angle of individual drills, by diameter.
    pub points: Vec<(Length, f64)>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Holes {
    /// The holes of the board.
    #[default]
    Board,
    /// The pin holes, symmetric about the flip axis.
    Alignment,
}

/// Slots, and holes without a suitable drill.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct MillHoles {
    pub slots: bool,
    /// Round holes without a suitable drill.
    pub holes: bool,
    pub direction: CutDirection,
    /// Names of smaller tools, for features too narrow for the tool.
    pub further: Vec<String>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CutOut {
    /// Side of the outline for the tool's path.
    pub side: CutSide,
    pub direction: CutDirection,
    /// Number of tabs, spread evenly along the outline; 0 for none.
    pub tabs: u32,
    pub tab_width: Length,
    /// Height of a tab above the bottom of the board; with mouse-bites a tab is as high as the board.
    pub tab_height: Length,
    /// Middles of user-placed tabs, each at the nearest point of the outline; if there are any, none are
    /// spread.
    pub tab_at: Vec<Point>,
    /// Rows of holes across the tabs, so that they break.
    pub bites: bool,
    pub bite_hole: Length,
    /// Distance of mouse-bite holes.
    pub bite_pitch: Length,
    /// Ramp angle in degrees along the path; 0 for straight down.
    pub ramp_deg: f64,
    /// Names of smaller tools, for inner contours and inlets that the previous tools could not enter.
    pub further: Vec<String>,
}

/// Side of the outline for the tool's path.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CutSide {
    /// The board keeps its size.
    #[default]
    Outside,
    /// The tool centre is on the line.
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
    /// Sets the remedy for the gap between `from` and `to`, replacing an earlier one. True if that is a
    /// change.
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

impl Drill {
    /// Largest difference between a hole and its drill, on `machine`.
    pub fn tolerance_on(&self, machine: &Machine) -> Length {
        self.tolerance.unwrap_or(machine.rack_tolerance)
    }
}

impl OperationKind {
    /// Name in files.
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

    /// Message key of its name, in the locale tables.
    pub fn title_key(&self) -> String {
        format!("page.cam.word.{}", self.word())
    }

    /// The names of all kinds, in the usual order of a job.
    pub const WORDS: [&'static str; 6] = ["isolate", "clear", "engrave", "drill", "mill_holes", "cut_out"];
}

impl Work {
    pub fn bit(&self, name: &str) -> Option<&Bit> {
        self.bits.iter().find(|bit| bit.name == name)
    }

    /// The sides with active operations, in the order of their first operations.
    pub fn faces(&self) -> Vec<Face> {
        let mut faces = Vec::new();
        for operation in self.operations.iter().filter(|operation| operation.on) {
            if !faces.contains(&operation.face) {
                faces.push(operation.face);
            }
        }
        faces
    }

    /// Point angle of the drills, if an operation drills.
    pub fn point_deg(&self) -> Option<f64> {
        self.operations.iter().filter(|one| one.on).find_map(|one| match &one.action {
            OperationKind::Drill(drill) => Some(drill.point_deg),
            _ => None,
        })
    }
}

impl Operation {
    /// Its name in messages: its own, else that of its kind.
    pub fn title(&self) -> String {
        if self.name.is_empty() { locale::word(&self.action.title_key()) } else { self.name.clone() }
    }

    /// The names of all its tools: its main tool, smaller tools, then those of local changes. Empty for
    /// drilling.
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
