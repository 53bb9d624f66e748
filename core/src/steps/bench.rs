//! What the benchmark measures beside the time: how good the runs of a stream are.
//!
//! Comes in: a plan and its stream. Goes out: counts, and the furthest any step is from its time. Knows no clock.

use super::replay::replay;
use super::stream::{StepStream, TICK_HZ};
use crate::machine::AXES;
use crate::motion::Timeline;

/// What came of turning a timeline into steps.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Yield {
    /// Steps of all axes.
    pub steps: u64,
    /// Runs.
    pub runs: u64,
    /// Bytes of the canonical encoding.
    pub bytes: u64,
    /// Furthest any step is from its planned time, in µs.
    pub worst_us: f64,
}

/// Counts steps and runs of `stream` and measures it against its plan.
pub fn measure(plan: &Timeline, stream: &StepStream) -> Yield {
    let mut sum = Yield { bytes: super::encoded_len(stream), ..Yield::default() };
    for (planned, segment) in plan.moves.iter().zip(&stream.segments) {
        sum.runs += segment.runs.len() as u64;
        let mut done = [0_u64; AXES];
        for pulse in replay(segment) {
            for axis in (0..AXES).filter(|axis| pulse.axes >> axis & 1 == 1) {
                let count = (planned.to[axis] - planned.from[axis]).unsigned_abs();
                let place_mm = (done[axis] as f64 + 0.5) / count.max(1) as f64 * planned.profile.length_mm;
                let planned_s = planned.lead_s + planned.profile.time_at(place_mm);
                let error_us = (pulse.tick as f64 / TICK_HZ as f64 - planned_s) * 1e6;
                sum.worst_us = sum.worst_us.max(error_us.abs());
                done[axis] += 1;
                sum.steps += 1;
            }
        }
    }
    sum
}
