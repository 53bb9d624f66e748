//! Planning: tools, their paths and order, and the resulting program.
//!
//! ```text
//!  Board ─┐
//!  Work ──┴─ toolpaths (operation by operation; holes in order by a tour) ─▶ Planned ─ lower ─▶ Program
//!                                                                          └─ figures ─▶ savings in drilling
//! ```
//!
//! There is one planner. A drilling job is also a [`work::Work`]: [`work::Work::drilling`].

pub mod bench;
pub mod briefing;
pub mod carried;
pub mod figures;
mod order;
pub mod parameters;
mod places;
pub mod rack;
pub mod suits;
pub mod toolpaths;
mod tour;
pub mod usual;
pub mod work;

use crate::board::Board;
use crate::diagnostic::Diagnostic;
use crate::geometry::{Bounds, Point};
use crate::machine::Machine;
use crate::units::Length;
use crate::{error, note, warning};
use serde::{Deserialize, Serialize};
use work::Work;

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum HoleOrder {
    /// Shortest closed tour in straight distance, opened at the best place for the approach.
    #[default]
    Shortest,
    Fastest,
    File,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BitOrder {
    #[default]
    Ascending,
    /// The tool in the spindle first, then ascending.
    LoadedFirst,
}

/// Default seed of the searches: equal on page and command line, so that both produce equal programs.
pub const SEED: u64 = 1;

/// The user's options for a plan.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlanOptions {
    pub group: BitOrder,
    /// The tool in the spindle, for [`BitOrder::LoadedFirst`].
    pub loaded: Option<Length>,
    /// Spindles that drill, as bits (bit 0 is Z1); `None`: all.
    pub spindles: Option<u8>,
    pub seed: u64,
    /// Limit of the search, shared by the tools of an operation; `None`: [`default_iterations`].
    pub iterations: Option<u64>,
    /// Codes of accepted errors: the affected features are left out.
    pub accept: Vec<String>,
    /// Codes of the errors in the board's files; the program lists those that were accepted.
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

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PlanningProgress {
    /// Parts done; never decreases.
    pub done: u64,
    pub total: u64,
}

/// Default number of iterations: about a second for a thousand holes on one core. Each costs more with very
/// many holes, so their number decreases: a hundred thousand holes take a few seconds.
pub fn default_iterations(holes: usize) -> u64 {
    let holes = holes as u64;
    (30 * holes).min(40_000).min(2_000_000_000 / holes.max(1))
}

/// The spindles that drill: all enabled ones, or those wanted, if they are enabled.
fn spindles(wanted: Option<u8>, machine: &Machine) -> Result<u8, Vec<Diagnostic>> {
    let there = machine.installed() & machine.enabled;
    match wanted {
        None => Ok(there),
        Some(set) if set != 0 && set & !there == 0 => Ok(set),
        Some(_) => Err(vec![error!("plan.no_such_spindle", count = machine.spindles)]),
    }
}

/// Index in `sizes`, the tools in order, of the loaded tool, to be used first. The error, with a diagnostic
/// if needed, means that the order stays.
fn loaded_first(
    sizes: &[Length],
    options: &PlanOptions,
    tolerance: Length,
) -> Result<usize, Option<Diagnostic>> {
    if options.group != BitOrder::LoadedFirst || sizes.is_empty() {
        return Err(None);
    }
    let Some(loaded) = options.loaded else {
        return Err(Some(warning!("plan.loaded_not_said")));
    };
    let found = rack::nearest(sizes, loaded, tolerance);
    found
        .and_then(|bit| sizes.iter().position(|&size| size == bit))
        .ok_or_else(|| Some(note!("plan.loaded_not_used", size = rack::size_text(loaded))))
}

/// Reference of the work zero: a lower left corner, unless the job sets another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Corner {
    Board,
    /// Of copper and holes together, at full size: the board has no outline. A flip uses the centre of this
    /// box, so both sides have one zero.
    Copper,
    /// Of hole centres, or else of slots: there is only a drill file, or the job makes only holes and slots.
    /// Then copper doesn't matter.
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

/// True if a job makes more than holes and slots, on any side: then its zero may depend on copper.
fn makes_more(work: &Work) -> bool {
    work.operations.iter().any(|operation| operation.on && !operation.action.rules().makes_holes)
}

/// The lower left corner of the board that was `laid` out with pins, see [`Corner`]; of `copies` without
/// their pins.
fn origin(copies: &Board, laid: &Board, work: &Work) -> Point {
    let holes = || Bounds::around(laid.holes.iter().map(|hole| hole.at)).or_else(|| laid.bounds());
    let corner = match Corner::of(laid, work) {
        Corner::Board => laid.extent(),
        Corner::Copper => copies.extent(),
        Corner::Holes => holes().or_else(|| laid.extent()),
    };
    corner.map_or(Point::default(), |bounds| bounds.min)
}
