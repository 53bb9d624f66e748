//! The step stream: what is digested, checked, sent and replayed.
//!
//! ```text
//! segment        |<------------------ duration ------------------->|   (at rest at both ends)
//! run (axes 1)        |.    .   .  . . . .|      interval, count, change
//!                 the interval grows by the change after every step
//! ```
//!
//! Comes in: runs. Goes out: the same as plain data. Time is counted in ticks of 0.1 µs from the start of each
//! segment, intervals in parts of a tick; positions are whole motor steps from the work zero. Does not know millimetres.

use crate::job::{Gate, Mark, Stage, Switching};
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
    pub effect: Switching,
    /// The sensor that may end it early.
    pub gate: Option<Gate>,
    /// Where all axes stand afterwards when it was not ended early.
    pub end: Steps,
}

/// Parts of a tick in which intervals are counted.
pub const PARTS: i64 = 1 << 16;

/// Steps at intervals that grow or shrink evenly, of one axis or of several that step together. The first interval begins
/// at the step before (or at the start of the segment, for the first run of these axes in it); after every step it changes
/// by `change`. Parts of a tick add up within the run; each step comes in the nearest whole tick (half a tick: the later),
/// and the next run counts from the whole tick of the last step:
///
/// ```text
/// tick of step i = tick before the run + ⌊(i·interval + i(i−1)/2·change + ½ tick) in parts / 65,536⌋,  i = 1 … count
/// ```
///
/// An axis belongs to one set of axes all through a segment.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Run {
    /// Which axes, one bit each: bit 0 is X, bit 1 is Y, bits 2 … 7 are Z1 … Z6.
    pub axes: u8,
    /// Whether they count up.
    pub forward: bool,
    /// Whole ticks of the interval before the first step of the run.
    pub interval: u32,
    /// What it is longer than that, in parts of a tick, 65,536 to the tick.
    pub fraction: u16,
    /// How many steps, at least 1.
    pub count: u32,
    /// Change of the interval after every step, in parts of a tick.
    pub change: i32,
}

impl Run {
    /// `count` steps at one interval of whole ticks.
    pub fn even(axes: u8, forward: bool, interval: u32, count: u32) -> Self {
        Self { axes, forward, interval, fraction: 0, count, change: 0 }
    }

    /// The interval before its first step, in parts of a tick.
    pub fn first_parts(&self) -> i64 {
        i64::from(self.interval) * PARTS + i64::from(self.fraction)
    }

    /// The interval before its step `index`, counted from 0, in parts of a tick. Any run can be asked, a senseless one too.
    pub fn parts_before(&self, index: u32) -> i128 {
        i128::from(self.first_parts()) + i128::from(self.change) * i128::from(index)
    }

    /// Ticks from the step before it to its last step. Any run can be asked, a senseless one too.
    pub fn ticks(&self) -> i128 {
        let count = i128::from(self.count);
        let parts =
            count * i128::from(self.first_parts()) + count * (count - 1) / 2 * i128::from(self.change);
        rounded(parts)
    }
}

/// How coarsely a run of `count` steps is made: its interval and its change are multiples of so many parts of a tick, as powers
/// of two. Half of the first moves its last step by 8 ticks at most, half of the second its middle by 4 beside its ends: both
/// within 1 µs, so that there mostly is such a run where there is any.
pub(crate) fn fineness(count: u32) -> (u32, u32) {
    let length = u32::BITS - count.max(1).saturating_sub(1).leading_zeros();
    // The change of a pair makes up for its interval.
    (20_u32.saturating_sub(if count > 2 { length } else { 0 }), 22_u32.saturating_sub(2 * length))
}

/// Whole ticks of so many parts: the nearest, of two the later.
pub(crate) fn rounded(parts: i128) -> i128 {
    (parts + i128::from(PARTS / 2)) >> PARTS.trailing_zeros()
}
