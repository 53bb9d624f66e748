//! What a job, an operation, a bit has as long as nobody chose otherwise (N11).
//!
//! Comes in: a board and a machine, or the word of a kind. Goes out: [`Work`] and its parts. Does not know how toolpaths are
//! made.

use super::HoleOrder;
use super::work::{
    Clear, CutDirection, CutOut, Drill, Engrave, Holes, Isolate, Lines, MillHoles, Operation, OperationKind,
    Setup, Work,
};
use crate::board::{Board, Face};
use crate::job::{Bit, Cutter};
use crate::machine::Machine;
use crate::units::Length;

impl OperationKind {
    /// The kind called `word` with its usual values on `machine`.
    pub fn usual(word: &str, machine: &Machine) -> Option<Self> {
        Some(match word {
            "isolate" => Self::Isolate(Isolate::default()),
            "clear" => Self::Clear(Clear::default()),
            "engrave" => Self::Engrave(Engrave { of: Lines::Legend }),
            "drill" => Self::Drill(Drill {
                holes: Holes::Board,
                order: HoleOrder::Shortest,
                tolerance: machine.rack_tolerance,
                peck: Length::ZERO,
                point_deg: POINT_DEG,
                points: Vec::new(),
            }),
            "mill_holes" => Self::MillHoles(MillHoles {
                slots: true,
                holes: true,
                direction: CutDirection::Climb,
                further: vec![SMALL_MILL.to_owned()],
            }),
            "cut_out" => Self::CutOut(CutOut::default()),
            _ => return None,
        })
    }
}

/// Angle of a drill's point in degrees, unless somebody says otherwise.
pub const POINT_DEG: f64 = 130.0;

/// The V-bit that a new job has. The bits of new jobs are called by their titles, as everywhere.
const VEE: &str = "V-bit 30°, tip 0.1";
/// The mill that a new job bores and cuts out with.
const MILL: &str = "end mill 1.5";
/// Its smaller mill.
const SMALL_MILL: &str = "end mill 0.8";

/// The bits that a new job has.
pub fn usual_bits() -> Vec<Bit> {
    let bit = |name: &str, um, cutter| Bit {
        diameter: Length::from_um(um),
        name: name.to_owned(),
        cutter,
        handling: Default::default(),
    };
    vec![
        bit(VEE, 3_175, Cutter::Vee { tip: Length::from_um(100), angle_mdeg: 30_000 }),
        bit(MILL, 1_500, Cutter::Mill),
        bit(SMALL_MILL, 800, Cutter::Mill),
    ]
}

impl Operation {
    /// An operation of the kind called `word` on `face` with its usual values; none for an unknown kind.
    pub fn usual(word: &str, face: Face, machine: &Machine) -> Option<Self> {
        let action = OperationKind::usual(word, machine)?;
        let (bit, depth, depth_per_pass, feed, plunge) = match &action {
            OperationKind::Isolate(_) | OperationKind::Clear(_) | OperationKind::Engrave(_) => {
                (VEE, 80, 0, 6.0, 1.5)
            }
            OperationKind::Drill(_) => {
                ("", 0, 0, machine.process.feed_mm_per_s, machine.process.feed_mm_per_s)
            }
            OperationKind::MillHoles(_) | OperationKind::CutOut(_) => (MILL, 0, 600, 5.0, 1.5),
        };
        Some(Self {
            name: String::new(),
            on: true,
            face,
            bit: bit.to_owned(),
            feed_mm_per_s: feed,
            plunge_mm_per_s: plunge,
            spindle_rpm: machine.process.spindle_rpm,
            depth: Length::from_um(depth),
            depth_per_pass: Length::from_um(depth_per_pass),
            action,
        })
    }
}

impl Work {
    /// The job that `board` opens with on `machine`: grooves round the copper of each side that has any, holes, slots and
    /// the outline. A board with copper on both sides is turned over about two pins, its bottom first.
    pub fn default_for(board: &Board, machine: &Machine) -> Self {
        let has = |face| board.copper.iter().any(|copper| copper.face == face && !copper.region.is_empty());
        let (top, bottom) = (has(Face::Top), has(Face::Bottom));
        let last = if bottom && !top { Face::Bottom } else { Face::Top };
        let mut setup = Setup { face: last, ..Setup::default() };
        let mut wanted = Vec::new();
        if top && bottom {
            setup.alignment.pairs = 1;
            wanted.extend([("drill", Face::Bottom), ("isolate", Face::Bottom)]);
        }
        if top || bottom {
            wanted.push(("isolate", last));
        }
        wanted.extend(makes_holes(board, machine).map(|word| (word, last)));
        wanted.extend((!board.outline.is_empty()).then_some(("cut_out", last)));
        let mut operations: Vec<Operation> =
            wanted.iter().filter_map(|(word, face)| Operation::usual(word, *face, machine)).collect();
        if let Some(Operation { action: OperationKind::Drill(drill), .. }) =
            operations.first_mut().filter(|_| setup.alignment.pairs > 0)
        {
            drill.holes = Holes::Alignment;
        }
        Self { setup, bits: usual_bits(), operations }
    }

    /// The job that makes the holes and slots of `board` on `machine` and nothing else, seen from above as in the files: round
    /// holes are drilled in this order, slots and holes that no drill of the rack fits are milled.
    pub fn drilling(board: &Board, machine: &Machine, order: HoleOrder) -> Self {
        let usual = |word| Operation::usual(word, Face::Top, machine);
        let mut operations: Vec<Operation> = makes_holes(board, machine).filter_map(usual).collect();
        for operation in &mut operations {
            if let OperationKind::Drill(drill) = &mut operation.action {
                drill.order = order;
            }
        }
        Self { setup: Setup::default(), bits: usual_bits(), operations }
    }
}

/// The kinds of operations that make the holes and slots of `board`.
fn makes_holes(board: &Board, machine: &Machine) -> impl Iterator<Item = &'static str> + use<> {
    let drills = machine.drills();
    let drilled = |size: Option<Length>| {
        size.is_none_or(|size| super::rack::nearest(&drills, size, machine.rack_tolerance).is_some())
    };
    // A hole without a size is no milling matter.
    let mills = !board.slots.is_empty() || board.holes.iter().any(|hole| !drilled(hole.diameter));
    [("drill", !board.holes.is_empty()), ("mill_holes", mills)]
        .into_iter()
        .filter(|row| row.1)
        .map(|row| row.0)
}
