//! Quality of the runs of a stream, for the benchmark.

use super::digest::RUN_BYTES;
use super::replay::replay;
use super::stream::{Run, Segment, StepStream, TICK_HZ};
use crate::machine::AXES;
use crate::motion::{Motion, Move, Timeline};

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Yield {
    pub steps: u64,
    pub runs: u64,
    pub bytes: u64,
    /// Greatest deviation of a step from its planned time, in µs.
    pub worst_us: f64,
    /// Highest rate of run bytes per second and axis, over any segment with more than 50 ms of motion. Axes
    /// that step together share the bytes.
    pub busiest_bytes_per_s: f64,
}

/// Bytes of runs per second of the busiest axis of a segment, over the time in which it moves.
fn busiest(segment: &Segment) -> f64 {
    let rate = |runs: &[Run]| {
        let ticks = runs.iter().map(|run| run.ticks()).sum::<i128>() as f64;
        let seconds = ticks / TICK_HZ as f64;
        let axes = runs.first().map_or(1, |run| run.axes.count_ones().max(1));
        if seconds < 0.05 { 0.0 } else { (RUN_BYTES * runs.len()) as f64 / seconds / f64::from(axes) }
    };
    segment.runs.chunk_by(|a, b| a.axes == b.axes).map(rate).fold(0.0, f64::max)
}

/// Counts steps and runs of `stream`, and compares it with its plan.
pub fn measure(plan: &Timeline, stream: &StepStream) -> Yield {
    let mut sum = Yield { bytes: super::compact(stream).len() as u64, ..Yield::default() };
    for (planned, segment) in plan.moves.iter().zip(&stream.segments) {
        sum.runs += segment.runs.len() as u64;
        sum.busiest_bytes_per_s = sum.busiest_bytes_per_s.max(busiest(segment));
        let mut done = [0_u64; AXES];
        for pulse in replay(segment) {
            for axis in (0..AXES).filter(|axis| pulse.axes >> axis & 1 == 1) {
                let error_us = pulse.tick as f64 / TICK_HZ as f64 - planned_s(planned, axis, done[axis]);
                sum.worst_us = sum.worst_us.max((error_us * 1e6).abs());
                done[axis] += 1;
                sum.steps += 1;
            }
        }
    }
    sum
}

/// Time in a move at which the plan crosses the middle of step `index` of `axis`, in seconds. NaN on a path,
/// where reversals skip steps.
fn planned_s(planned: &Move, axis: usize, mut index: u64) -> f64 {
    for part in &planned.parts {
        let count = (part.to[axis] - part.from[axis]).unsigned_abs();
        if index < count {
            let share = (index as f64 + 0.5) / count as f64;
            return part.start_s()
                + match &part.motion {
                    Motion::Line(stroke) => stroke.time_at(share * stroke.length_mm()),
                    Motion::TableSteps(steps) => steps.tick_of(index) as f64 / TICK_HZ as f64,
                    Motion::Path(_) => f64::NAN,
                };
        }
        index -= count;
    }
    f64::NAN
}
