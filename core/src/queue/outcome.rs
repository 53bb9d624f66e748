//! What the player reports of a row, and what each outcome means for the trust in the position.

use crate::diagnostic::Diagnostic;
use crate::job::{Input, Otherwise};
use crate::machine::{Machine, Steps};
use crate::pins::Outcome;
use crate::steps::TICK_HZ;

const TICKS_OF_MS: u64 = TICK_HZ / 1_000;

/// Report of the player after [`super::QueueAction::Play`], at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QueueReport {
    /// Outcome of the last segment played.
    pub outcome: Outcome,
    pub position: Steps,
    /// Input bits at that time.
    pub inputs: u32,
    /// Machine time, in ticks.
    pub ticks: u64,
}

/// Effect of a failure on the trust in the position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Harm {
    /// No effect.
    None,
    Suspect,
    Lost,
}

/// A step was too late for its motor, by this many ticks.
pub fn late(ticks: u64) -> Diagnostic {
    Diagnostic::error("control.executor_late").with("ms", libm::ceil(ticks as f64 / TICKS_OF_MS as f64))
}

/// Error for a sensor that must stay off, and its effect on the trust. Counts stay exact, unless an axis hit
/// its end.
pub fn guarded(input: Input) -> (Diagnostic, Harm) {
    match input {
        Input::CoverOpen => (Diagnostic::error("control.cover_open"), Harm::None),
        Input::FootDown => (Diagnostic::error("control.foot_down"), Harm::None),
        _ => (Diagnostic::error("control.end_sensor").with("sensor", input.name()), Harm::Suspect),
    }
}

/// Error for a sensor that must be on: no board under the tip, or no presser foot on it.
pub fn missing(input: Input) -> Diagnostic {
    Diagnostic::error(if input == Input::Contact { "control.no_contact" } else { "control.foot_gone" })
}

/// Error for a tip of `machine` that touched something `at` a position above the board. `board_steps` is the
/// surface there relative to the flat surface, in steps of Z. Counts stay exact, and the next hole checks the
/// tip again.
pub fn early(machine: &Machine, at: &Steps, board_steps: i64) -> Diagnostic {
    let above = machine.z.scale.length(machine.lowest(at) - board_steps) - machine.process.surface;
    Diagnostic::error("control.early_contact").with("mm", format!("{:.2}", above.mm()))
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
            let why = Diagnostic::error("control.drilling_too_long").with("sensor", gate.input.name());
            Some((why.with("seconds", f64::from(gate.deadline_us) / 1e6), Harm::None))
        }
        _ => None,
    }
}
