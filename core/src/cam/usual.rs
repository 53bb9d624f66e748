//! Default values of jobs, operations and tools.

use super::HoleOrder;
use super::work::{Cut, Holes, Operation, OperationKind, SMALL_MILL, Setup, Work};
use crate::board::{Board, Face};
use crate::job::{Bit, Cutter};
use crate::machine::Machine;
use crate::units::Length;

/// Default plunge feed of mills and V-bits, mm/s, unless the machine's drilling feed is lower.
const MILL_DOWN_MM_PER_S: f64 = 1.5;

/// The V-bit of a new job. Names of tools are their titles.
const VEE: &str = "V-bit 30°, tip 0.1";
const MILL: &str = "end mill 1.5";

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
    /// An operation of the kind called `word` on `face` with default values; `None` for an unknown kind. Its
    /// speeds are those of the machine that it is planned for.
    pub fn usual(word: &str, face: Face) -> Option<Self> {
        let action = OperationKind::usual(word)?;
        let (bit, depth, depth_per_pass) = match action.rules().cut {
            Cut::Surface => (VEE, 80, 0),
            Cut::Through => (MILL, 0, 600),
            Cut::Drilled => ("", 0, 0),
        };
        Some(Self {
            name: String::new(),
            on: true,
            face,
            bit: bit.to_owned(),
            feed_mm_per_s: None,
            plunge_mm_per_s: None,
            spindle_rpm: None,
            depth: Length::from_um(depth),
            depth_per_pass: Length::from_um(depth_per_pass),
            action,
        })
    }

    /// Its speeds on `machine`: those that the user set, else defaults. Not limited.
    pub fn speeds(&self, machine: &Machine) -> Speeds {
        let process = &machine.process;
        let mill_down = MILL_DOWN_MM_PER_S.min(process.feed_mm_per_s);
        let (feed, plunge) = match self.action.rules().cut {
            Cut::Surface => (6.0, mill_down),
            Cut::Through => (5.0, mill_down),
            Cut::Drilled => (process.feed_mm_per_s, process.feed_mm_per_s),
        };
        Speeds {
            feed_mm_per_s: self.feed_mm_per_s.unwrap_or(feed),
            plunge_mm_per_s: self.plunge_mm_per_s.unwrap_or(plunge),
            spindle_rpm: self.spindle_rpm.unwrap_or(process.usual_rpm()),
        }
    }
}

/// Speeds of an operation on a machine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Speeds {
    pub feed_mm_per_s: f64,
    pub plunge_mm_per_s: f64,
    pub spindle_rpm: u32,
}

impl Work {
    /// The default job of `board` on `machine`: isolates the copper of each side, makes holes and slots, cuts
    /// out. A board with copper on both sides is flipped about two pins, its bottom first.
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
            wanted.iter().filter_map(|(word, face)| Operation::usual(word, *face)).collect();
        if let Some(Operation { action: OperationKind::Drill(drill), .. }) =
            operations.first_mut().filter(|_| setup.alignment.pairs > 0)
        {
            drill.holes = Holes::Alignment;
        }
        Self { setup, bits: usual_bits(), operations }
    }

    /// A job that only makes the holes and slots of `board` on `machine`, seen from above as in the files.
    /// Round holes are drilled in this order; slots and holes without a suitable drill are milled.
    pub fn drilling(board: &Board, machine: &Machine, order: HoleOrder) -> Self {
        let usual = |word| Operation::usual(word, Face::Top);
        let operations = makes_holes(board, machine).filter_map(usual).collect();
        Self { setup: Setup::default(), bits: usual_bits(), operations }.drilled_in(order)
    }

    /// The same job with its holes in this order.
    pub fn drilled_in(mut self, order: HoleOrder) -> Self {
        for operation in &mut self.operations {
            if let OperationKind::Drill(drill) = &mut operation.action {
                drill.order = order;
            }
        }
        self
    }
}

fn makes_holes(board: &Board, machine: &Machine) -> impl Iterator<Item = &'static str> + use<> {
    let drills = machine.drills();
    let drilled = |size: Option<Length>| {
        size.is_none_or(|size| super::rack::nearest(&drills, size, machine.rack_tolerance).is_some())
    };
    // A hole without a size can't be milled.
    let mills = !board.slots.is_empty() || board.holes.iter().any(|hole| !drilled(hole.diameter));
    [("drill", !board.holes.is_empty()), ("mill_holes", mills)]
        .into_iter()
        .filter(|row| row.1)
        .map(|row| row.0)
}
