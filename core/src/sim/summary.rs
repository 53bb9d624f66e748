//! A job in numbers.
//!
//! Comes in: a timeline and its stream. Goes out: times and step counts. Knows no format.

use crate::job::Mark;
use crate::machine::AXES;
use crate::motion::Timeline;
use crate::steps::StepStream;
use crate::units::TICK_HZ;

/// What people want to know of a job before they start it.
#[derive(Clone, Debug, PartialEq)]
pub struct Summary {
    /// Time of the whole job without the waits for people, s.
    pub total_s: f64,
    /// How many holes.
    pub holes: u32,
    /// Holes per minute while drilling, changes of bit not counted: strokes of one spindle.
    pub holes_per_min: f64,
    /// The same if Z and XY never moved together.
    pub holes_per_min_sequential: f64,
    /// Median time of a hole, from leaving the one before, s.
    pub median_hole_s: f64,
    /// Longest time of a hole, s.
    pub longest_hole_s: f64,
    /// Steps of every axis, both ways together.
    pub steps: [u64; AXES],
}

/// The numbers of a job.
pub fn summary(timeline: &Timeline, stream: &StepStream) -> Summary {
    let mut holes: Vec<(u32, u64)> = Vec::new();
    for planned in timeline.moves.iter().filter(|planned| matches!(planned.mark, Mark::Hole(_))) {
        match holes.last_mut() {
            Some((leg, ticks)) if *leg == planned.leg => *ticks += planned.duration_ticks,
            _ => holes.push((planned.leg, planned.duration_ticks)),
        }
    }
    let mut times: Vec<u64> = holes.into_iter().map(|(_, ticks)| ticks).collect();
    times.sort_unstable();
    let seconds = |ticks: u64| ticks as f64 / TICK_HZ as f64;
    let drilling_s = seconds(times.iter().sum());
    let per_min = if drilling_s > 0.0 { 60.0 * times.len() as f64 / drilling_s } else { 0.0 };
    let middle = |index: usize| times.get(index).copied().map_or(0.0, seconds);
    let median_hole_s = 0.5 * (middle(times.len() / 2) + middle(times.len().saturating_sub(1) / 2));
    let mut steps = [0; AXES];
    for run in stream.segments.iter().flat_map(|segment| &segment.runs) {
        if let Some(axis) = steps.get_mut(usize::from(run.axis)) {
            *axis += u64::from(run.count);
        }
    }
    Summary {
        total_s: timeline.total_s(),
        holes: times.len() as u32,
        holes_per_min: per_min,
        holes_per_min_sequential: per_min,
        median_hole_s,
        longest_hole_s: times.last().copied().map_or(0.0, seconds),
        steps,
    }
}
