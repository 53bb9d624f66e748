//! Converts a timeline into a step stream.
//!
//! ```text
//! steps ^          3 ┌──      the plan is the smooth line, the motor the stairs:
//!       |        2 ┌─┘        step k is due when the plan crosses k − ½,
//!       |     1 ┌──┘          so the motor is never more than half a step away
//!       |  0 ───┘
//!       +-----------------> time
//! ```
//!
//! A part moves from whole step to whole step, so all its steps are inside it: the first and last are half a
//! step from its ends. Axes of a straight line share one path: step k of n is at (k − ½)/n of the length.
//! Spindles with equal moves share their runs.

use super::fit::{Fitter, Track};
use super::stream::{Run, Segment, StepStream, TICK_HZ};
use crate::diagnostic::Diagnostic;
use crate::error;
use crate::job::Program;
use crate::machine::{AXES, Machine, Steps};
use crate::motion::path::sweeps_between;
use crate::motion::profile::{Inverse, Stroke};
use crate::motion::{AxisMove, Motion, MotorPath, Move, TableSteps, Timeline, each_leg};

/// Most runs of a stream. A board of 100,000 holes needs about a tenth of them.
const MOST_RUNS: usize = 100_000_000;

/// Least time at a reversal: both steps may be 1 µs off.
const TURN_ROOM_S: f64 = 2.1e-6;

pub fn stream(timeline: &Timeline, machine: &Machine) -> Result<StepStream, Diagnostic> {
    stream_telling(timeline, machine, &mut |_, _| {})
}

/// Like [`stream`]; `progress` gets the number of converted moves and their total.
pub fn stream_telling(
    timeline: &Timeline,
    machine: &Machine,
    progress: &mut dyn FnMut(u64, u64),
) -> Result<StepStream, Diagnostic> {
    let mut pile =
        Pile { maker: Maker::new(machine), segments: Vec::with_capacity(timeline.moves.len()), runs: 0 };
    let total = timeline.moves.len() as u64;
    for (done, planned) in (0..).zip(&timeline.moves) {
        progress(done, total);
        pile.take(std::slice::from_ref(planned))?;
    }
    Ok(StepStream { start: timeline.start, segments: pile.segments })
}

/// Converts a program leg by leg. The result equals the stream of its timeline, but the timeline is never in
/// memory as a whole.
pub fn stream_of(program: &Program, machine: &Machine) -> Result<StepStream, Diagnostic> {
    let mut pile = Pile { maker: Maker::new(machine), segments: Vec::new(), runs: 0 };
    let start = each_leg(program, machine, |moves| pile.take(moves))?;
    Ok(StepStream { start, segments: pile.segments })
}

/// Converts a program leg by leg: `take` gets the segments of each, which are dropped afterwards. Returns the
/// position of all axes before the first.
pub(super) fn leg_by_leg(
    program: &Program,
    machine: &Machine,
    mut take: impl FnMut(&[Segment]),
) -> Result<Steps, Diagnostic> {
    let mut pile = Pile { maker: Maker::new(machine), segments: Vec::new(), runs: 0 };
    each_leg(program, machine, |moves| {
        pile.segments.clear();
        pile.take(moves)?;
        take(&pile.segments);
        Ok(())
    })
}

struct Pile {
    maker: Maker,
    segments: Vec<Segment>,
    runs: usize,
}

impl Pile {
    fn take(&mut self, moves: &[Move]) -> Result<(), Diagnostic> {
        for planned in moves {
            let mut segment = self.maker.segment(planned);
            // A job has many thousands of segments: spare capacity adds up.
            segment.runs.shrink_to_fit();
            self.runs += segment.runs.len();
            if self.runs > MOST_RUNS {
                return Err(error!("motion.stream_too_long", runs = MOST_RUNS));
            }
            self.segments.push(segment);
        }
        Ok(())
    }
}

pub fn segment(planned: &Move, machine: &Machine) -> Segment {
    Maker::new(machine).segment(planned)
}

struct Maker {
    fitter: Fitter,
    least_interval: i64,
    /// Least time between the last step in one direction and the first one back, s.
    turn_s: f64,
    /// The latest different strokes, because every hole of a bit repeats two of each spindle.
    known: [Option<Known>; 2 * AXES],
    oldest: usize,
}

/// A stroke over this many steps, and its runs relative to its start.
struct Known {
    way: i64,
    stroke: Stroke,
    runs: Vec<Run>,
    last_tick: i64,
}

/// Output position of one set of axes in a segment.
struct Cursor<'a> {
    axes: u8,
    last_tick: i64,
    runs: &'a mut Vec<Run>,
}

impl Maker {
    fn new(machine: &Machine) -> Self {
        // Rounded up: never faster than the limit.
        let least_interval = TICK_HZ.div_ceil(u64::from(machine.max_step_hz.max(1))) as i64;
        let direction_s = f64::from(machine.direction_setup_us) * 1e-6;
        let turn_s = direction_s.max(least_interval as f64 / TICK_HZ as f64) + TURN_ROOM_S;
        Self {
            fitter: Fitter::default(),
            least_interval,
            turn_s,
            known: [const { None }; 2 * AXES],
            oldest: 0,
        }
    }

    fn segment(&mut self, planned: &Move) -> Segment {
        Segment {
            leg: planned.leg,
            mark: planned.mark,
            stage: planned.stage,
            duration_ticks: planned.duration_ticks,
            runs: self.runs(planned),
            effect: planned.effect,
            gate: planned.gate,
            end: planned.to,
        }
    }

    fn runs(&mut self, planned: &Move) -> Vec<Run> {
        let mut runs = Vec::new();
        for (axis, axes) in sets(planned) {
            let mut cursor = Cursor { axes, last_tick: 0, runs: &mut runs };
            for part in planned.parts.iter().filter(|part| part.moves(axis)) {
                match &part.motion {
                    // Spindles repeat few strokes, which are cached; lines in XY all differ.
                    Motion::Line(stroke) if axis >= 2 => self.stroke(part, axis, stroke, &mut cursor),
                    Motion::Line(stroke) => self.line(part, axis, stroke, &mut cursor),
                    Motion::TableSteps(steps) => step_runs(part, axis, steps, &mut cursor),
                    Motion::Path(route) => self.path(part, axis, route, &mut cursor),
                }
            }
        }
        runs
    }

    fn line(&mut self, part: &AxisMove, axis: usize, stroke: &Stroke, cursor: &mut Cursor<'_>) {
        let way = part.to[axis] - part.from[axis];
        self.fit(way, stroke, part.start_tick, false, cursor);
    }

    /// A stroke of spindles: fitted once, then only shifted in time. Its first step is a run by itself,
    /// because only that interval depends on the start time.
    fn stroke(&mut self, part: &AxisMove, axis: usize, stroke: &Stroke, cursor: &mut Cursor<'_>) {
        let way = part.to[axis] - part.from[axis];
        let same = |known: &Known| known.way == way && known.stroke == *stroke;
        let found = self.known.iter().position(|known| known.as_ref().is_some_and(same));
        let place = found.unwrap_or(self.oldest);
        // Late enough that the least interval doesn't delay the first step.
        let lead = self.least_interval;
        if found.is_none() {
            let mut runs = Vec::new();
            let mut alone = Cursor { axes: cursor.axes, last_tick: 0, runs: &mut runs };
            self.fit(way, stroke, lead as u64, true, &mut alone);
            let last_tick = alone.last_tick;
            self.known[place] = Some(Known { way, stroke: stroke.clone(), runs, last_tick });
            self.oldest = (self.oldest + 1) % self.known.len();
        }
        let Some(known) = &self.known[place] else { return };
        // The cached runs assume a start at `lead`.
        let begin = part.start_tick as i64 - lead;
        let from = cursor.runs.len();
        cursor.runs.extend(known.runs.iter().map(|run| Run { axes: cursor.axes, ..*run }));
        if let Some(first) = cursor.runs.get_mut(from) {
            let interval = begin + i64::from(first.interval) - cursor.last_tick;
            first.interval = u32::try_from(interval).unwrap_or(u32::MAX);
        }
        cursor.last_tick = begin + known.last_tick;
    }

    /// One axis of a path: steps in one direction, then in the other.
    fn path(&mut self, part: &AxisMove, axis: usize, route: &MotorPath, cursor: &mut Cursor<'_>) {
        let start = part.start_tick as f64;
        let Some(of) = route.coordinate(axis) else { return };
        let ends = (part.from[axis], part.to[axis]);
        for sweep in sweeps_between(&route.path, of, route.mm_per_step[of], self.turn_s, ends) {
            let track = Track {
                axes: cursor.axes,
                forward: sweep.forward,
                count: sweep.count,
                least_interval: self.least_interval,
                from: cursor.last_tick,
                first_alone: false,
                even: None,
            };
            let time_of = |step: u64| start + sweep.time_s(&route.path, step) * TICK_HZ as f64;
            cursor.last_tick = self.fitter.fit(track, time_of, cursor.runs);
        }
    }

    /// Appends runs of `way` steps along `stroke`, which starts at `start_tick`.
    fn fit(
        &mut self,
        way: i64,
        stroke: &Stroke,
        start_tick: u64,
        first_alone: bool,
        cursor: &mut Cursor<'_>,
    ) {
        let count = way.unsigned_abs();
        let step_mm = stroke.length_mm() / count.max(1) as f64;
        let start = start_tick as f64;
        let mut track = Track {
            axes: cursor.axes,
            forward: way > 0,
            count,
            least_interval: self.least_interval,
            from: cursor.last_tick,
            first_alone,
            even: None,
        };
        // A step is due halfway to its position: the error stays within half a step.
        let place_mm = |step: u64| (step as f64 - 0.5) * step_mm;
        cursor.last_tick = match stroke {
            Stroke::One(profile) => {
                let inverse = Inverse::of(profile);
                let (from_mm, to_mm) = inverse.cruise_mm();
                let step_at = |mm: f64| mm / step_mm + 0.5;
                track.even = Some((libm::ceil(step_at(from_mm)) as u64, libm::floor(step_at(to_mm)) as u64));
                let time_of = |step: u64| start + inverse.time_at(place_mm(step)) * TICK_HZ as f64;
                self.fitter.fit(track, time_of, cursor.runs)
            }
            Stroke::Two(_) => {
                let time_of = |step: u64| start + stroke.time_at(place_mm(step)) * TICK_HZ as f64;
                self.fitter.fit(track, time_of, cursor.runs)
            }
        };
    }
}

/// Sets of axes that step together throughout a move, each with one of its axes: X, Y, and spindles with
/// equal parts.
fn sets(planned: &Move) -> Vec<(usize, u8)> {
    let mut sets: Vec<(usize, u8)> = Vec::new();
    let way = |part: &AxisMove, axis: usize| part.to[axis] - part.from[axis];
    for axis in (0..AXES).filter(|axis| planned.parts.iter().any(|part| part.moves(*axis))) {
        // Spindles that go equally far step at the same ticks: one run for all.
        let alike = |(first, _): &&mut (usize, u8)| {
            axis >= 2 && *first >= 2 && planned.parts.iter().all(|part| way(part, axis) == way(part, *first))
        };
        match sets.iter_mut().find(alike) {
            Some((_, axes)) => *axes |= 1 << axis,
            None => sets.push((axis, 1 << axis)),
        }
    }
    sets
}

/// Runs of a table-driven axis: one for each stretch of equal intervals.
fn step_runs(part: &AxisMove, axis: usize, steps: &TableSteps, cursor: &mut Cursor<'_>) {
    let forward = part.to[axis] > part.from[axis];
    let begin = part.start_tick as i64;
    let mut offset = begin - cursor.last_tick;
    for some in &steps.stretches {
        let interval = i64::from(some.interval) * steps.interrupt_ticks as i64;
        let mut left = some.count;
        // The first interval starts at the previous step, not at the start of the part.
        if offset != 0 && left > 0 {
            cursor.push(forward, interval + offset, 1);
            left -= 1;
            offset = 0;
        }
        while left > 0 {
            let count = u32::try_from(left).unwrap_or(u32::MAX);
            cursor.push(forward, interval, count);
            left -= u64::from(count);
        }
    }
}

impl Cursor<'_> {
    fn push(&mut self, forward: bool, interval: i64, count: u32) {
        self.last_tick += interval * i64::from(count);
        let interval = u32::try_from(interval).unwrap_or(u32::MAX);
        self.runs.push(Run::even(self.axes, forward, interval, count));
    }
}
