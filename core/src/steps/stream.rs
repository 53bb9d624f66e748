//! The step stream, which is hashed, checked, sent and replayed.
//!
//! ```text
//! segment        |<------------------ duration ------------------->|   (at rest at both ends)
//! run (axes 1)        |.    .   .  . . . .|      interval, count, change
//!                 the interval grows by the change after every step
//! ```
//!
//! Times are in ticks of 0.1 µs from the start of each segment, intervals in parts of a tick, positions in
//! whole motor steps from the work zero.

use crate::job::{Gate, Mark, Stage, Switching};
use crate::machine::Steps;
use serde::{Deserialize, Serialize};

pub use crate::units::TICK_HZ;

#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct StepStream {
    /// Position of all axes before the first segment, in steps from the work zero.
    pub start: Steps,
    /// In order, without gaps.
    pub segments: Vec<Segment>,
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Segment {
    pub leg: u32,
    pub mark: Mark,
    pub stage: Stage,
    /// Duration in ticks; not less than the time of the last step.
    pub duration_ticks: u64,
    /// Runs of everything that moves, by set of axes, in order of time within a set.
    pub runs: Vec<Run>,
    /// Switching at the start of the segment.
    pub effect: Switching,
    /// Sensor that may end the segment early.
    pub gate: Option<Gate>,
    /// Position of all axes at the end, if the segment isn't ended early.
    pub end: Steps,
}

/// Parts of a tick: the unit of intervals.
pub const PARTS: i64 = 1 << 16;

/// Steps at linearly changing intervals, of one axis or of several that step together. The first interval
/// starts at the previous step, or at the start of the segment for the first run of these axes. After every
/// step, the interval changes by `change`. Parts of a tick add up within the run; each step is rounded to the
/// nearest whole tick (half a tick: up). The next run counts from the whole tick of the last step:
///
/// ```text
/// tick of step i = tick before the run + ⌊(i·interval + i(i−1)/2·change + ½ tick) in parts / 65,536⌋
/// ```
///
/// An axis belongs to one set of axes throughout a segment.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Run {
    /// Set of axes: bit 0 is X, bit 1 is Y, bits 2 … 7 are Z1 … Z6.
    pub axes: u8,
    /// True if the axes count up.
    pub forward: bool,
    /// Interval before the first step, whole ticks.
    pub interval: u32,
    /// Fraction of that interval, in parts of a tick: 65,536 per tick.
    pub fraction: u16,
    /// Number of steps, at least 1.
    pub count: u32,
    /// Change of the interval after every step, in parts of a tick.
    pub change: i32,
}

impl Run {
    /// `count` steps at one interval of whole ticks.
    pub fn even(axes: u8, forward: bool, interval: u32, count: u32) -> Self {
        Self { axes, forward, interval, fraction: 0, count, change: 0 }
    }

    /// Interval before the first step, in parts of a tick.
    pub fn first_parts(&self) -> i64 {
        i64::from(self.interval) * PARTS + i64::from(self.fraction)
    }

    /// Interval before step `index`, from 0, in parts of a tick. Safe for invalid runs.
    pub fn parts_before(&self, index: u32) -> i128 {
        i128::from(self.first_parts()) + i128::from(self.change) * i128::from(index)
    }

    /// Ticks from the previous step to the last step of the run. Safe for invalid runs.
    pub fn ticks(&self) -> i128 {
        let count = i128::from(self.count);
        let parts =
            count * i128::from(self.first_parts()) + count * (count - 1) / 2 * i128::from(self.change);
        rounded(parts)
    }
}

/// Grid of a run of `count` steps: powers of two, in parts of a tick, for its interval and its change.
/// Rounding to half of the first moves the last step by at most 8 ticks. Rounding to half of the second moves
/// the middle by at most 4. Both stay within 1 µs, so the grid usually has a run if any exists.
pub(crate) fn fineness(count: u32) -> (u32, u32) {
    let length = u32::BITS - count.max(1).saturating_sub(1).leading_zeros();
    // In a run of two steps, the change compensates the rounding of the interval.
    (20_u32.saturating_sub(if count > 2 { length } else { 0 }), 22_u32.saturating_sub(2 * length))
}

/// Rounds parts to whole ticks, half a tick up.
pub(crate) fn rounded(parts: i128) -> i128 {
    (parts + i128::from(PARTS / 2)) >> PARTS.trailing_zeros()
}
