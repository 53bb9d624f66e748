//! The independent checker of step streams. Input is only the stream and the machine, not the program or the
//! planner's data.
//!
//! | rule | refused with |
//! |---|---|
//! | only existing axes step | `check.axis_missing` |
//! | no run is empty | `check.empty_run` |
//! | totals stay within bounds | `check.too_large` |
//! | every segment ends at its stated position, in its stated time | `check.count`, `check.late_step` |
//! | no axis leaves its range | `check.range` |
//! | pulses keep the drive's least interval | `check.interval` |
//! | directions are set up in time | `check.direction_setup` |
//! | mean speed over 8 steps within the axis's limit | `check.speed` |
//! | change of mean speed over 5 ms within the axis's limit, more in corners | `check.acceleration` |
//! | no XY step while any bit is below the clearance over the board, except milling | `check.xy_in_board` |
//! | spindle speeds are plausible | `check.spindle_speed` |
//! | no bit below the surface until the spindle has spun up | `check.spindle_off`, `check.spin_up` |
//! | gates only on moves of a single axis | `check.gate_not_alone` |
//! | tool changes only with the spindle off and up | `check.await_bit` |
//! | every leg ends above the board, or the next one starts with a lift | `check.leg_ends_low` |
//! | the stream ends with the spindle off | `check.spindle_left_on` |
//!
//! Any violation refuses the stream.

mod interlocks;
mod known;
mod pulses;

use crate::diagnostic::Diagnostic;
use crate::error;
use crate::geometry::Point;
use crate::job::Mark;
use crate::machine::{AXES, Machine, Steps, axis_name};
use crate::steps::stream::{Run, Segment, StepStream};
use crate::units::Length;
use interlocks::{Heights, Interlocks};
use pulses::Walker;
use std::borrow::Borrow;

/// Longest stream: ten days, in ticks.
const MOST_TICKS: u64 = 10 * 24 * 3600 * crate::units::TICK_HZ;

const MOST_STEPS: u64 = 20_000_000_000;

const MOST_DIAGNOSTICS: usize = 20;

#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct CheckReport {
    pub total_ticks: u64,
    pub steps: [u64; AXES],
    pub lowest: Steps,
    pub highest: Steps,
    pub holes: u32,
    pub segments: usize,
    pub runs: usize,
}

/// The work zero with the most room for a board: the low corner, on the surface. Machine coordinates, in
/// steps.
pub fn corner_zero(machine: &Machine) -> Steps {
    let mut zero = machine.on_surface();
    zero[0] = machine.x.scale.steps(machine.x.min);
    zero[1] = machine.y.scale.steps(machine.y.min);
    zero
}

/// Like [`corner_zero`], for a program with the lowest work coordinates `low`. Moves the zero into the range,
/// because a cut-out extends beyond the board's corner.
pub fn roomy_zero(machine: &Machine, low: Point) -> Steps {
    let mut zero = corner_zero(machine);
    zero[0] -= machine.x.scale.steps(low.x.min(Length::ZERO));
    zero[1] -= machine.y.scale.steps(low.y.min(Length::ZERO));
    zero
}

/// Checks `stream`. `zero_steps` is the work zero in machine coordinates, with every tip on the surface.
pub fn verify(
    stream: &StepStream,
    machine: &Machine,
    zero_steps: Steps,
) -> Result<CheckReport, Vec<Diagnostic>> {
    verify_each(&stream.start, || stream.segments.iter(), machine, zero_steps)
}

/// Like [`verify`], for a stream that is never in memory as a whole. Calls `segments` twice.
pub fn verify_each<I: Iterator<Item: Borrow<Segment>>>(
    start: &Steps,
    segments: impl Fn() -> I,
    machine: &Machine,
    zero_steps: Steps,
) -> Result<CheckReport, Vec<Diagnostic>> {
    let mut report = measure(segments())?;
    let mut walkers: [Walker; AXES] =
        std::array::from_fn(|axis| Walker::new(machine, axis, zero_steps[axis], start[axis]));
    let present = machine.spindle_axes().end;
    let mut interlocks = Interlocks::new(machine);
    let mut diagnostics = Vec::new();
    for (axis, walker) in walkers.iter().enumerate().take(present) {
        let outside = walker.within_range(walker.at).err();
        diagnostics.extend(outside.map(|diagnostic| diagnostic.with("axis", axis_name(axis)).with("leg", 0)));
    }
    let (mut now, mut index) = (0, 0);
    let mut segments = segments().peekable();
    while let Some(segment) = segments.next() {
        let (segment, next) = (segment.borrow(), segments.peek().map(Borrow::borrow));
        let starts = walkers.each_ref().map(|walker| walker.at);
        for found in walk(segment, &mut walkers, now, present) {
            diagnostics.push(found.with("leg", segment.leg).with("segment", index));
        }
        let low_z = walkers[2..present].iter().map(|walker| walker.low_in_segment).min().unwrap_or(0);
        let heights = Heights { starts: &starts[2..present], low_z };
        for found in interlocks.segment(segment, &heights, now, next) {
            diagnostics.push(found.with("leg", segment.leg).with("segment", index));
        }
        if diagnostics.len() >= MOST_DIAGNOSTICS {
            break;
        }
        now += segment.duration_ticks;
        index += 1;
    }
    if diagnostics.is_empty() && interlocks.spindle_runs() {
        diagnostics.push(error!("check.spindle_left_on"));
    }
    if !diagnostics.is_empty() {
        return Err(diagnostics);
    }
    for (axis, walker) in walkers.iter().enumerate() {
        (report.lowest[axis], report.highest[axis]) = (walker.lowest, walker.highest);
    }
    Ok(report)
}

/// Sums up the stream without visiting single steps, so that oversized streams are refused at once.
fn measure(segments: impl Iterator<Item: Borrow<Segment>>) -> Result<CheckReport, Vec<Diagnostic>> {
    let mut report = CheckReport::default();
    let mut last_hole = None;
    for segment in segments {
        let segment = segment.borrow();
        report.segments += 1;
        report.total_ticks = report.total_ticks.saturating_add(segment.duration_ticks);
        report.runs += segment.runs.len();
        for run in &segment.runs {
            for axis in (0..AXES).filter(|axis| run.axes >> axis & 1 == 1) {
                report.steps[axis] += u64::from(run.count);
            }
        }
        if matches!(segment.mark, Mark::Hole(_)) && last_hole != Some(segment.leg) {
            last_hole = Some(segment.leg);
            report.holes += 1;
        }
    }
    let all_steps = report.steps.iter().fold(0, |sum: u64, steps| sum.saturating_add(*steps));
    if report.total_ticks > MOST_TICKS || all_steps > MOST_STEPS {
        let hours = report.total_ticks / crate::units::TICK_HZ / 3600;
        let diagnostic = error!("check.too_large", steps = all_steps, hours = hours);
        return Err(vec![diagnostic]);
    }
    Ok(report)
}

/// Checks the pulses of one segment, axis by axis; at most one problem per axis.
fn walk(segment: &Segment, walkers: &mut [Walker; AXES], now: u64, present: usize) -> Vec<Diagnostic> {
    let mut found = Vec::new();
    let axes = segment.runs.iter().fold(0, |axes, run| axes | run.axes);
    if segment.runs.iter().any(|run| run.axes == 0) || u32::from(axes) >> present != 0 {
        found.push(error!("check.axis_missing", axis = axes, ..));
    }
    for (axis, walker) in walkers.iter_mut().enumerate() {
        let ends = (segment.duration_ticks, segment.end[axis], segment.stage);
        let told = match runs_of(segment, axis) {
            Some(runs) => walker.segment(runs, now, ends).err(),
            None => {
                walker.at = segment.end[axis];
                Some(error!("check.two_sets", ..))
            }
        };
        found.extend(told.map(|diagnostic| diagnostic.with("axis", axis_name(axis))));
    }
    found
}

/// The runs of `axis`. None if it changes between sets of axes within the segment, because then the times of
/// its runs are undefined.
fn runs_of(segment: &Segment, axis: usize) -> Option<&[Run]> {
    let has = |run: &Run| run.axes >> axis & 1 == 1;
    let Some(first) = segment.runs.iter().position(has) else { return Some(&[]) };
    let (runs, later) = segment.runs[first..].split_at(
        segment.runs[first..].iter().position(|run| !has(run)).unwrap_or(segment.runs.len() - first),
    );
    let one_set = runs.iter().all(|run| run.axes == runs[0].axes) && !later.iter().any(has);
    one_set.then_some(runs)
}
