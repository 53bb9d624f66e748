//! Planning: which bit goes where, in which order, and the program of it.
//!
//! ```text
//!  Board ─┐
//!  Work ──┴─ toolpaths (operation by operation; holes in order by a tour) ─▶ Planned ─ lower ─▶ Program
//!                                                                          └─ figures ─▶ what its drilling saves
//! ```
//!
//! There is one planner. A job that only drills is a [`work::Work`] like any other: [`work::Work::drilling`].
//!
//! Comes in: a board, a work, a machine, what a person wants, and the time of a rapid as a function. Goes out:
//! [`Planned`](toolpaths::Planned) and its [`Program`](crate::job::Program). Does not know motion: how long a rapid takes it is told.

pub mod bench;
pub mod briefing;
pub mod carried;
pub mod figures;
mod limits;
mod order;
pub mod parameters;
mod places;
mod promised;
pub mod rack;
pub mod toolpaths;
mod tour;
pub mod usual;
pub mod work;

use crate::board::Board;
use crate::diagnostic::Diagnostic;
use crate::geometry::{Bounds, Point};
use crate::machine::Machine;
use crate::units::Length;
use serde::{Deserialize, Serialize};
use work::{OperationKind, Work};

/// Order of the holes of one bit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum HoleOrder {
    /// Shortest closed tour in straight distance, cut open where it serves the approach.
    #[default]
    Shortest,
    /// Least machine time from where the head is.
    Fastest,
    /// As in the file.
    File,
}

/// Order of the bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BitOrder {
    /// Small before large.
    #[default]
    Ascending,
    /// The bit that is in the spindle first, then ascending.
    LoadedFirst,
}

/// The seed of the searches unless a person gives another: the same in page and command line, so that both write the same.
pub const SEED: u64 = 1;

/// What a person wants of a plan.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlanOptions {
    /// Order of the bits.
    pub group: BitOrder,
    /// The bit in the spindle, for [`BitOrder::LoadedFirst`].
    pub loaded: Option<Length>,
    /// The spindles that are to drill, one bit each (bit 0 is Z1); none for all that the machine has.
    pub spindles: Option<u8>,
    /// Seed of the search.
    pub seed: u64,
    /// Bound of the search, shared by the bits of an operation; none for [`default_iterations`].
    pub iterations: Option<u64>,
    /// Codes of errors that a person has seen: what they name is left out.
    pub accept: Vec<String>,
    /// Codes of the errors that the files of the board have; the program names those of them that were accepted.
    pub lost: Vec<String>,
}

impl Default for PlanOptions {
    fn default() -> Self {
        Self {
            group: BitOrder::default(),
            loaded: None,
            spindles: None,
            seed: SEED,
            iterations: None,
            accept: Vec::new(),
            lost: Vec::new(),
        }
    }
}

/// How far planning is, in whatever parts it is divided.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PlanningProgress {
    /// Parts done; never fewer than before.
    pub done: u64,
    /// Parts there are.
    pub total: u64,
}

/// Iterations when nobody says how many: about a second for a thousand holes on one core, and so many fewer for very many
/// holes, where each costs more, that a hundred thousand take a few seconds.
pub fn default_iterations(holes: usize) -> u64 {
    let holes = holes as u64;
    (30 * holes).min(40_000).min(2_000_000_000 / holes.max(1))
}

/// The spindles that are to drill: all that are enabled, or those wanted, if they are.
fn spindles(wanted: Option<u8>, machine: &Machine) -> Result<u8, Vec<Diagnostic>> {
    let there = machine.installed() & machine.enabled;
    match wanted {
        None => Ok(there),
        Some(set) if set != 0 && set & !there == 0 => Ok(set),
        Some(_) => Err(vec![Diagnostic::error("plan.no_such_spindle").with("count", machine.spindles)]),
    }
}

/// The place among `sizes`, those of the bits in their order, of the bit that is to go first because it is loaded. An error,
/// with a diagnostic if one was wanted, where they stay as they are.
fn loaded_first(
    sizes: &[Length],
    options: &PlanOptions,
    tolerance: Length,
) -> Result<usize, Option<Diagnostic>> {
    if options.group != BitOrder::LoadedFirst || sizes.is_empty() {
        return Err(None);
    }
    let Some(loaded) = options.loaded else {
        return Err(Some(Diagnostic::warning("plan.loaded_not_said")));
    };
    let found = rack::nearest(sizes, loaded, tolerance);
    found
        .and_then(|bit| sizes.iter().position(|&size| size == bit))
        .ok_or_else(|| Some(Diagnostic::note("plan.loaded_not_used").with("size", rack::size_text(loaded))))
}

/// What the work zero is the lower left corner of, unless a job says otherwise.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Corner {
    /// Of the outline.
    Board,
    /// Of copper and holes together, as far as they reach: the board has no outline. It is turned over about the middle of the
    /// same box, so that both sides have one zero.
    Copper,
    /// Of the middles of holes, or else of slots: there is nothing but a drill file, or the job makes nothing but holes and slots.
    /// Whether copper was read does not matter then.
    Holes,
}

impl Corner {
    fn of(board: &Board, work: &Work) -> Self {
        let has_copper = board.copper.iter().any(|copper| !copper.region.is_empty());
        if !board.outline.is_empty() {
            Self::Board
        } else if has_copper && makes_more(work) {
            Self::Copper
        } else {
            Self::Holes
        }
    }

    /// A word of `run_sheet.zero`.
    fn word(self) -> &'static str {
        match self {
            Self::Board => "board",
            Self::Copper => "copper",
            Self::Holes => "holes",
        }
    }
}

/// Whether a job makes more than holes and slots, on any side: then its zero may depend on copper.
fn makes_more(work: &Work) -> bool {
    let makes_holes =
        |action: &OperationKind| matches!(action, OperationKind::Drill(_) | OperationKind::MillHoles(_));
    work.operations.iter().any(|operation| operation.on && !makes_holes(&operation.action))
}

/// The lower left corner of the board that was `laid` out with pins, see [`Corner`]; of `copies` without their pins.
fn origin(copies: &Board, laid: &Board, work: &Work) -> Point {
    let holes = || Bounds::around(laid.holes.iter().map(|hole| hole.at)).or_else(|| laid.bounds());
    let corner = match Corner::of(laid, work) {
        Corner::Board => laid.extent(),
        Corner::Copper => copies.extent(),
        Corner::Holes => holes().or_else(|| laid.extent()),
    };
    corner.map_or(Point::default(), |bounds| bounds.min)
}
