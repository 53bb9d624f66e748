//! Plans: which bit drills which holes, and in which order.
//!
//! ```text
//!  Board ─ rack ─▶ bits with holes ─ order (tour) ─▶ Plan ─ lower ─▶ Program
//! ```
//!
//! Comes in: a board, a machine, what a person wants, and the time of a hop as a function. Goes out: a [`Plan`] and its
//! [`Program`](crate::job::Program). Does not know motion: how long a hop takes it is told.

pub mod bench;
pub mod briefing;
mod limits;
mod lower;
mod order;
pub mod parameters;
mod places;
pub mod rack;
mod tour;
pub mod usual;
pub mod ways;
pub mod work;

pub use lower::lower;
pub use rack::BitUse;

use crate::board::Board;
use crate::geometry::{Bounds, Point};
use crate::machine::Machine;
use crate::remark::{Remark, Weight};
use crate::units::Length;
use order::{straight_mm, way};
use serde::{Deserialize, Serialize};
use tour::Effort;

/// Order of the holes of one bit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Order {
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
pub enum Group {
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
    /// Order of the holes of one bit.
    pub order: Order,
    /// Order of the bits.
    pub group: Group,
    /// The bit in the spindle, for [`Group::LoadedFirst`].
    pub loaded: Option<Length>,
    /// The spindles that are to drill, one bit each (bit 0 is Z1); none for all that the machine has.
    pub spindles: Option<u8>,
    /// Seed of the search.
    pub seed: u64,
    /// Bound of the search, shared by the bits; none for [`default_iterations`].
    pub iterations: Option<u64>,
    /// Codes of losses that a person has seen: what they name is left out.
    pub accept: Vec<String>,
}

impl Default for PlanOptions {
    fn default() -> Self {
        Self {
            order: Order::default(),
            group: Group::default(),
            loaded: None,
            spindles: None,
            seed: SEED,
            iterations: None,
            accept: Vec::new(),
        }
    }
}

/// How a board is to be drilled.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// The place in the files' coordinates that becomes the work zero.
    pub origin: Point,
    /// Bits in order of use.
    pub bits: Vec<BitPlan>,
    /// The spindles that drill, one bit each (bit 0 is Z1).
    pub spindles: u8,
    /// Length of the ways with the holes as in the file: for each bit from the work zero to its first hole and from
    /// hole to hole.
    pub travel_before_mm: f64,
    /// The same as planned.
    pub travel_after_mm: f64,
    /// Time of these hops with the holes as in the file.
    pub hop_time_before_s: f64,
    /// The same as planned.
    pub hop_time_after_s: f64,
    /// Iterations of the search that were made.
    pub iterations: u64,
    /// Codes of the losses that this plan has and that were accepted.
    pub accepted: Vec<String>,
}

/// One bit of a plan.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BitPlan {
    /// Diameter of the bit.
    pub bit: Length,
    /// The sizes in the files that it stands in for, ascending.
    pub sizes: Vec<Length>,
    /// Holes in order of drilling, as indices into the board's holes.
    pub holes: Vec<u32>,
}

/// How far planning is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Iterations made.
    pub done: u64,
    /// Iterations there will be.
    pub total: u64,
}

/// Iterations when nobody says how many: about a second for a thousand holes on one core, and so many fewer for very many
/// holes, where each costs more, that a hundred thousand take a few seconds.
pub fn default_iterations(holes: usize) -> u64 {
    let holes = holes as u64;
    (30 * holes).min(40_000).min(2_000_000_000 / holes.max(1))
}

/// The spindles that are to drill: all that the machine has, or those wanted, if it has them.
fn spindles(wanted: Option<u8>, machine: &Machine) -> Result<u8, Vec<Remark>> {
    let installed = u8::MAX >> (8 - machine.spindles.clamp(1, 6));
    match wanted {
        None => Ok(installed),
        Some(set) if set != 0 && set & !installed == 0 => Ok(set),
        Some(_) => {
            Err(vec![Remark::new(Weight::Loss, "plan.no_such_spindle").with("count", machine.spindles)])
        }
    }
}

/// Chooses bits and puts holes in order. `hop_time` tells the seconds from one place to another, the same there and
/// back. `progress` is told how far it is and says whether to go on. Fails with the losses that were not accepted.
pub fn plan(
    board: &Board,
    machine: &Machine,
    options: &PlanOptions,
    hop_time: &dyn Fn(Point, Point) -> f64,
    progress: &mut dyn FnMut(Progress) -> bool,
) -> Result<(Plan, Vec<Remark>), Vec<Remark>> {
    let spindles = spindles(options.spindles, machine)?;
    let (mut bits, told) = rack::assign(board, machine);
    let unseen: Vec<Remark> = told.iter().filter(|loss| loss.is_unseen(&options.accept)).cloned().collect();
    if !unseen.is_empty() {
        return Err(unseen);
    }
    if bits.is_empty() {
        return Err(vec![Remark::new(Weight::Loss, "plan.nothing_to_drill")]);
    }
    let losses = told.iter().filter(|remark| remark.weight == Weight::Loss);
    let accepted = losses.map(|loss| loss.code.clone()).collect();
    let mut remarks = told;
    let sizes: Vec<Length> = bits.iter().map(|bit| bit.bit).collect();
    match loaded_first(&sizes, options, machine.rack_tolerance) {
        Ok(first) => bits[..=first].rotate_right(1),
        Err(why) => remarks.extend(why),
    }
    let total_holes: usize = bits.iter().map(|bit| bit.holes.len()).sum();
    let total = match options.order {
        Order::File => 0,
        _ => options.iterations.unwrap_or_else(|| default_iterations(total_holes)),
    };
    let mut plan = Plan {
        origin: origin(board),
        bits: Vec::with_capacity(bits.len()),
        spindles,
        travel_before_mm: 0.0,
        travel_after_mm: 0.0,
        hop_time_before_s: 0.0,
        hop_time_after_s: 0.0,
        iterations: 0,
        accepted,
    };
    let mut holes_done = 0;
    for bit in bits {
        // Each bit's share grows with its holes, and the shares add up to the total.
        let share_end = share(total, holes_done + bit.holes.len(), total_holes);
        let effort = Effort { kicks: share_end - plan.iterations, seed: options.seed };
        holes_done += bit.holes.len();
        let made = plan.iterations;
        let mut tick = |done: u64| progress(Progress { done: made + done, total });
        if !plan_bit(board, bit, options.order, hop_time, effort, &mut tick, &mut plan) {
            return Err(vec![Remark::new(Weight::Loss, "plan.cancelled")]);
        }
        plan.iterations = share_end;
    }
    Ok((plan, remarks))
}

/// How much of `total` belongs to the first `part` of `whole`.
fn share(total: u64, part: usize, whole: usize) -> u64 {
    (u128::from(total) * part as u128 / (whole as u128).max(1)) as u64
}

/// Puts one bit's holes in order and adds it to the plan; false when stopped.
fn plan_bit(
    board: &Board,
    bit: BitUse,
    order: Order,
    hop_time: &dyn Fn(Point, Point) -> f64,
    effort: Effort,
    tick: &mut dyn FnMut(u64) -> bool,
    plan: &mut Plan,
) -> bool {
    let zero = plan.origin;
    let place = |hole: u32| board.holes.get(hole as usize).map_or(zero, |hole| hole.at);
    let in_file: Vec<(u32, Point)> = bit.holes.iter().map(|&hole| (hole, place(hole))).collect();
    let Some(holes) = order::arrange(&in_file, zero, order, hop_time, effort, tick) else { return false };
    let before = || in_file.iter().map(|(_, at)| *at);
    let after = || holes.iter().map(|&hole| place(hole));
    plan.travel_before_mm += way(zero, before(), straight_mm);
    plan.travel_after_mm += way(zero, after(), straight_mm);
    plan.hop_time_before_s += way(zero, before(), hop_time);
    plan.hop_time_after_s += way(zero, after(), hop_time);
    plan.bits.push(BitPlan { bit: bit.bit, sizes: bit.sizes, holes });
    true
}

/// The place among `sizes`, those of the bits in their order, of the bit that is to go first because it is loaded. An error,
/// with a remark if one was wanted, where they stay as they are.
fn loaded_first(sizes: &[Length], options: &PlanOptions, tolerance: Length) -> Result<usize, Option<Remark>> {
    if options.group != Group::LoadedFirst || sizes.is_empty() {
        return Err(None);
    }
    let Some(loaded) = options.loaded else {
        return Err(Some(Remark::new(Weight::Doubt, "plan.loaded_not_said")));
    };
    let found = rack::nearest(sizes, loaded, tolerance);
    found.and_then(|bit| sizes.iter().position(|&size| size == bit)).ok_or_else(|| {
        Some(Remark::new(Weight::Note, "plan.loaded_not_used").with("size", rack::size_text(loaded)))
    })
}

/// The lower left corner of the outline's box if there is an outline, else of the holes' box, else of the copper's.
fn origin(board: &Board) -> Point {
    let outline = board.outline.bounds();
    let holes = || Bounds::around(board.holes.iter().map(|hole| hole.at));
    outline.or_else(holes).or_else(|| board.extent()).map_or(Point::default(), |bounds| bounds.min)
}
