//! One row at the machine: its segments, from the machine's basic moves (`motion::cycles`); then what the
//! player reports of it, and what each outcome means for the trust in the position.

use super::rules::bottom;
use crate::diagnostic::Diagnostic;
use crate::job::{Gate, Input, Mark, Otherwise, Stage, Switching};
use crate::machine::{Machine, Steps, StrokeEnd};
use crate::motion::{Timeline, cycles};
use crate::pins::Outcome;
use crate::steps::{self, Segment, TICK_HZ};
use crate::{code, error};

pub(super) fn segments(timeline: &Timeline, machine: &Machine) -> Vec<Segment> {
    timeline.moves.iter().map(|planned| steps::segment(planned, machine)).collect()
}

pub(super) fn rest(end: Steps, duration_ticks: u64, effect: Switching) -> Segment {
    let (stage, mark) = (Stage::Dwell, Mark::Prepare);
    Segment { leg: 0, mark, stage, duration_ticks, runs: Vec::new(), effect, gate: None, end }
}

/// X and Y in a straight line ([`cycles::travel`]).
pub fn travel(machine: &Machine, from: Steps, to: Steps) -> Result<Vec<Segment>, Diagnostic> {
    Ok(cycles::travel(machine, from, to)?.iter().flat_map(|way| segments(way, machine)).collect())
}

/// Through the board: settle, down to just above it, then at feed to the lower switch or, without one, by
/// counted steps.
pub(super) fn down(machine: &Machine, from: Steps) -> Result<Vec<Segment>, Diagnostic> {
    let gate = (machine.stroke_end == StrokeEnd::Sensor).then(|| Gate {
        input: Input::ZBottom,
        deadline_us: libm::round(machine.longest_drilling_s * 1e6) as u32,
        otherwise: Otherwise::Alarm,
    });
    let mut pieces = foot(machine, from, true);
    pieces.extend(segments(&cycles::stroke(machine, from, bottom(machine), gate)?, machine));
    Ok(pieces)
}

/// Moves the presser foot and waits for it; nothing without a foot.
pub(super) fn foot(machine: &Machine, at: Steps, down: bool) -> Vec<Segment> {
    let press = || rest(at, machine.foot.ticks(), Switching::Foot { down });
    machine.foot.on.then(press).into_iter().collect()
}

pub(super) fn up(machine: &Machine, from: Steps, z: i64) -> Result<Vec<Segment>, Diagnostic> {
    let mut pieces = segments(&cycles::retract(machine, from, z)?, machine);
    let mut above = from;
    cycles::together(machine, 2).for_each(|axis| above[axis] = z);
    pieces.extend(foot(machine, above, false));
    Ok(pieces)
}

/// All the way up, presser foot up and spindle off; then to the park position.
pub fn park(machine: &Machine, from: Steps) -> Result<Vec<Segment>, Diagnostic> {
    let mut above = from;
    machine.spindle_axes().for_each(|axis| above[axis] = from[axis].max(cycles::top(machine)));
    let mut to = above;
    to[..2].copy_from_slice(&cycles::park_place(machine));
    let mut pieces = segments(&cycles::go_to(machine, from, above)?, machine);
    pieces.extend(foot(machine, above, false));
    pieces.push(rest(above, 0, Switching::Spindle { rpm: 0 }));
    pieces.extend(travel(machine, above, to)?);
    Ok(pieces)
}

pub(super) fn spindle(machine: &Machine, at: Steps, rpm: u32) -> Vec<Segment> {
    let spin_up = libm::ceil(machine.process.spin_up_ms * 1e-3 * TICK_HZ as f64) as u64;
    vec![rest(at, if rpm == 0 { 0 } else { spin_up }, Switching::Spindle { rpm })]
}

pub(super) fn wait(at: Steps, ticks: u64) -> Vec<Segment> {
    if ticks == 0 { Vec::new() } else { vec![rest(at, ticks, Switching::None)] }
}

const TICKS_OF_MS: u64 = TICK_HZ / 1_000;

/// Report of the player after [`super::QueueAction::Play`], at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QueueReport {
    pub outcome: Outcome,
    pub position: Steps,
    /// Input bits at that time.
    pub inputs: u32,
    /// Machine time, in ticks.
    pub ticks: u64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Harm {
    /// No effect.
    None,
    Suspect,
    Lost,
}

/// A step was too late for its motor, by this many ticks.
pub fn late(ticks: u64) -> Diagnostic {
    error!("control.executor_late", ms = libm::ceil(ticks as f64 / TICKS_OF_MS as f64))
}

/// Error for a sensor that must stay off, and its effect on the trust. Counts stay exact, unless an axis hit
/// its end.
pub fn guarded(input: Input) -> (Diagnostic, Harm) {
    match input {
        Input::CoverOpen => (error!("control.cover_open"), Harm::None),
        Input::FootDown => (error!("control.foot_down"), Harm::None),
        _ => (error!("control.end_sensor", sensor = input.name()), Harm::Suspect),
    }
}

/// Error for a sensor that must be on: no board under the tip, or no presser foot on it.
pub fn missing(input: Input) -> Diagnostic {
    Diagnostic::error(if input == Input::Contact {
        code!("control.no_contact")
    } else {
        code!("control.foot_gone")
    })
}

/// Error for a tip of `machine` that touched something `at` a position above the board. `board_steps` is the
/// surface there relative to the flat surface, in steps of Z. Counts stay exact, and the next hole checks the
/// tip again.
pub fn early(machine: &Machine, at: &Steps, board_steps: i64) -> Diagnostic {
    let above = machine.z.scale.length(machine.lowest(at) - board_steps) - machine.process.surface;
    error!("control.early_contact", mm = format!("{:.2}", above.mm()))
}

/// Error and effect of an outcome that isn't the normal end of a row.
pub(super) fn failure(machine: &Machine, outcome: &Outcome) -> Option<(Diagnostic, Harm)> {
    match outcome {
        Outcome::Guarded(input) => Some(guarded(*input)),
        Outcome::Missing(input) => Some((missing(*input), Harm::None)),
        Outcome::Early { at } => Some((early(machine, at, 0), Harm::None)),
        Outcome::Late { ticks } => Some((late(*ticks), Harm::Suspect)),
        Outcome::Spindle { trouble } => Some((trouble.diagnostic(), Harm::None)),
        Outcome::Unmet(gate) if gate.otherwise == Otherwise::Alarm => {
            let why = error!("control.drilling_too_long", sensor = gate.input.name(), ..);
            Some((why.with("seconds", f64::from(gate.deadline_us) / 1e6), Harm::None))
        }
        _ => None,
    }
}
