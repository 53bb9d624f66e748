//! The job as the user set it up. Plain data for page, job file and command line.
//!
//! ```text
//!  Work ─┬─ setup        side that is up, flip, panel, alignment holes, zones
//!        ├─ bits         the tools of the job by name (drills come from the machine's tools)
//!        └─ operations   isolate · clear · engrave · drill · bore · cut out, in order of execution
//! ```
//!
//! Lengths in whole nanometres, speeds in mm/s; depths are positive downwards from the surface. Each kind of
//! operation is a file with its values, defaults and rules ([`Rules`]), and a row of [`OperationKind`].

mod clear;
mod cut_out;
mod drill;
mod engrave;
mod isolate;
mod mill_holes;

pub use clear::Clear;
pub use cut_out::{CutOut, CutSide};
pub use drill::{Drill, Holes, POINT_DEG};
pub use engrave::{Engrave, Lines};
pub use isolate::{Isolate, LocalIsolation, Remedy};
pub use mill_holes::MillHoles;

use crate::board::{Board, Face};
use crate::geometry::{Bounds, Point};
use crate::job::{Asked, Bit, Promised};
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

impl OperationKind {
    /// The names of all kinds, in the usual order of a job.
    pub const WORDS: [&'static str; 6] = ["isolate", "clear", "engrave", "drill", "mill_holes", "cut_out"];

    /// The kind called `word` with default values.
    pub fn usual(word: &str) -> Option<Self> {
        Some(match word {
            "isolate" => Self::Isolate(Isolate::default()),
            "clear" => Self::Clear(Clear::default()),
            "engrave" => Self::Engrave(Engrave::default()),
            "drill" => Self::Drill(Drill::default()),
            "mill_holes" => Self::MillHoles(MillHoles::default()),
            "cut_out" => Self::CutOut(CutOut::default()),
            _ => return None,
        })
    }

    fn row(&self) -> (&'static str, Rules<'_>) {
        match self {
            Self::Isolate(isolate) => ("isolate", isolate.rules()),
            Self::Clear(clear) => ("clear", clear.rules()),
            Self::Engrave(engrave) => ("engrave", engrave.rules()),
            Self::Drill(drill) => ("drill", drill.rules()),
            Self::MillHoles(mill) => ("mill_holes", mill.rules()),
            Self::CutOut(cut_out) => ("cut_out", cut_out.rules()),
        }
    }

    /// Name in files.
    pub fn word(&self) -> &'static str {
        self.row().0
    }

    pub fn rules(&self) -> Rules<'_> {
        self.row().1
    }

    /// Positions on the board that the user set.
    pub(super) fn places(&mut self) -> Vec<&mut Point> {
        match self {
            Self::Isolate(isolate) => {
                isolate.cures.iter_mut().flat_map(|cure| [&mut cure.from, &mut cure.to]).collect()
            }
            Self::CutOut(cut_out) => cut_out.tab_at.iter_mut().collect(),
            Self::Clear(_) | Self::Engrave(_) | Self::Drill(_) | Self::MillHoles(_) => Vec::new(),
        }
    }

    /// Message key of its name, in the locale tables.
    pub fn title_key(&self) -> String {
        format!("page.cam.word.{}", self.word())
    }

    pub fn drill(&self) -> Option<&Drill> {
        if let Self::Drill(drill) = self { Some(drill) } else { None }
    }
}

/// What planner, proof and page need to know of an operation.
#[derive(Clone, Copy, Debug, Default)]
pub struct Rules<'a> {
    /// Gives the defaults of tool, depths and speeds.
    pub cut: Cut,
    /// Names of smaller tools.
    pub further: &'a [String],
    pub cures: &'a [LocalIsolation],
    /// It must separate nets.
    pub separates: bool,
    /// It makes only holes and slots.
    pub makes_holes: bool,
    /// It drills the holes of alignment pins.
    pub makes_pins: bool,
    /// If it cuts out the board: the number of its tabs.
    pub tabs: Option<u32>,
}

/// How an operation cuts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Cut {
    /// The surface, with a V-bit.
    #[default]
    Surface,
    /// Through the board in passes, with a mill.
    Through,
    /// Through the board, with the machine's drills.
    Drilled,
}

/// The smaller mill of a new job.
pub(super) const SMALL_MILL: &str = "end mill 0.8";

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
        self.operations.iter().filter(|one| one.on).find_map(|one| Some(one.action.drill()?.point_deg))
    }

    /// Requirements of the operations on `face`.
    pub fn promised(&self, face: Face) -> Promised {
        let rules = || self.on(face).map(|operation| operation.action.rules());
        let agreed = rules().flat_map(|rules| rules.cures).filter(|cure| cure.with == Remedy::Centred);
        // Zones that block tools leave copper.
        let clears = self.on(face).filter(|_| self.setup.exclusions.is_empty());
        let cleared = clears.filter_map(|operation| match &operation.action {
            OperationKind::Clear(clear) => clear.cleared(operation, self),
            _ => None,
        });
        Promised {
            owned: self.bits.clone(),
            agreed: agreed.map(|cure| (cure.from, cure.to)).collect(),
            cleared: cleared.collect(),
            isolates: Some(rules().any(|rules| rules.separates)),
        }
    }

    /// Requirements of the operations on `faces` other than copper, for a board of this thickness on
    /// `machine`.
    pub fn asked(&self, faces: &[Face], thickness: Length, machine: &Machine) -> Asked {
        let mut asked = Asked {
            holes: Some(false),
            slots: Some(false),
            tolerance: Length::ZERO,
            drilled: Length::ZERO,
            milled: Length::ZERO,
            ..Asked::nothing(thickness)
        };
        for operation in faces.iter().flat_map(|face| self.on(*face)) {
            let depth = if operation.depth > Length::ZERO { operation.depth } else { thickness };
            let reach = depth.min(thickness);
            match &operation.action {
                OperationKind::Isolate(_) | OperationKind::Clear(_) | OperationKind::Engrave(_) => {}
                OperationKind::Drill(drill) => drill.ask(&mut asked, reach, machine),
                OperationKind::MillHoles(mill) => mill.ask(&mut asked, reach),
                OperationKind::CutOut(cut_out) => {
                    asked.cut_out = Some(cut_out.edge(reach, (self, operation)));
                }
            }
        }
        let or = |length: Length, usual: Length| if length == Length::ZERO { usual } else { length };
        Asked {
            tolerance: or(asked.tolerance, Asked::TOLERANCE),
            drilled: or(asked.drilled, thickness),
            milled: or(asked.milled, thickness),
            ..asked
        }
    }

    /// The active operations on `face`.
    fn on(&self, face: Face) -> impl Iterator<Item = &Operation> {
        self.operations.iter().filter(move |operation| operation.on && operation.face == face)
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
        if !self.uses_bit() {
            return Vec::new();
        }
        let rules = self.action.rules();
        let of_cures = rules.cures.iter().filter_map(|cure| match &cure.with {
            Remedy::Bit(name) => Some(name),
            _ => None,
        });
        std::iter::once(&self.bit).chain(rules.further).chain(of_cures).map(String::as_str).collect()
    }

    /// True for an active isolation of side `face`.
    pub fn isolates(&self, face: Face) -> bool {
        self.on && self.face == face && matches!(self.action, OperationKind::Isolate(_))
    }

    /// False if it uses the machine's drills in place of [`Operation::bit`].
    pub fn uses_bit(&self) -> bool {
        self.action.rules().cut != Cut::Drilled
    }
}
