//! The step stream: what is digested, checked, sent and replayed.
//!
//! ```text
//! segment        |<------------------ duration ------------------->|   (at rest at both ends)
//! run (axes 1)        |.    .   .  . . . .|      interval, count, change
//!                 t0 + i, then i += change after every step
//! ```
//!
//! Comes in: runs. Goes out: the same as plain data. Time is counted in ticks of 0.1 µs from the start of each
//! segment; positions are whole motor steps from the work zero. Does not know millimetres.

use crate::job::{Effect, Gate, Mark, Stage};
use crate::machine::Steps;
use serde::{Deserialize, Serialize};

pub use crate::units::TICK_HZ;

/// A whole program as step times.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct StepStream {
    /// Where all axes stand before the first segment, in steps from the work zero.
    pub start: Steps,
    /// What happens, in order. Segments follow each other without a gap.
    pub segments: Vec<Segment>,
}

/// A piece of the stream that begins and ends at rest.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Segment {
    /// Index of the leg in the program.
    pub leg: u32,
    /// What the leg is for.
    pub mark: Mark,
    /// What is being done.
    pub stage: Stage,
    /// How long it takes, in ticks; not less than the time of its last step.
    pub duration_ticks: u64,
    /// Steps of everything that moves, set of axes by set of axes, in order of time within a set.
    pub runs: Vec<Run>,
    /// What is switched at the start of the segment.
    pub effect: Effect,
    /// The sensor that may end it early.
    pub gate: Option<Gate>,
    /// Where all axes stand afterwards when it was not ended early.
    pub end: Steps,
}

/// Steps at intervals that grow or shrink evenly, of one axis or of several that step together. The first step comes
/// `interval` ticks after the step before it (or after the start of the segment, for the first run of these axes in it);
/// then the interval changes by `change` after every step. An axis belongs to one set of axes all through a segment.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Run {
    /// Which axes, one bit each: bit 0 is X, bit 1 is Y, bits 2 … 7 are Z1 … Z6.
    pub axes: u8,
    /// Whether they count up.
    pub forward: bool,
    /// Ticks before the first step of the run.
    pub interval: u32,
    /// How many steps, at least 1.
    pub count: u32,
    /// Change of the interval after every step, in ticks.
    pub change: i32,
}
