//! Whether a job fits a controller, before anything moves: its settings against the places, feeds and speeds of the job.
//!
//! Comes in: settings, the job, where the work zero is. Goes out: diagnostics; with an error among them nothing is started. Lengths in
//! mm. Does not know what moves.

use super::routine::{Course, Routine, RoutineAction, RoutineMove, Spindle};
use super::settings::{self, Values};
use crate::diagnostic::Diagnostic;

/// Steps in a second that an 8-bit controller can make.
pub const MOST_STEPS_PER_S: f64 = 30_000.0;
/// How far past the end of its travel a place may be said: a step, and rounding.
const SLACK_MM: f64 = 0.02;
/// How much above the fastest of an axis a feed may be before it is worth a word.
const FEED_SLACK_FACTOR: f64 = 1.01;
const AXES: [char; 3] = ['X', 'Y', 'Z'];

/// What the job is compared with.
#[derive(Clone, Debug, PartialEq)]
pub struct MachineRange<'m> {
    /// Its settings.
    pub values: &'m Values,
    /// Work zero in machine coordinates.
    pub zero_mm: [f64; 3],
    /// Machine coordinates mean places: it was homed.
    pub homed: bool,
    /// Its places run from 0 up, not from minus the travel to 0.
    pub positive: bool,
    /// An 8-bit board, whose rate of steps is limited.
    pub small: bool,
}

/// What does not fit, worst first.
pub fn compare(routine: &Routine, machine: &MachineRange<'_>) -> Vec<Diagnostic> {
    let mut found = Vec::new();
    if settings::on(machine.values, 32) {
        found.push(Diagnostic::error("grbl.laser_mode"));
    }
    found.extend(step_rates(machine));
    found.extend(travel(routine, machine));
    found.extend(feeds(routine, machine));
    found.extend(speeds(routine, machine));
    if !settings::on(machine.values, 22) {
        found.push(Diagnostic::warning("grbl.no_homing"));
    }
    found
}

fn step_rates(machine: &MachineRange<'_>) -> Vec<Diagnostic> {
    let (Some(scale), Some(rate)) =
        (settings::axes(machine.values, 100), settings::axes(machine.values, 110))
    else {
        return vec![Diagnostic::warning("grbl.settings_unknown")];
    };
    let too_fast = |axis: &usize| machine.small && scale[*axis] * rate[*axis] / 60.0 > MOST_STEPS_PER_S;
    (0..3)
        .filter(too_fast)
        .map(|axis| {
            let most = MOST_STEPS_PER_S * 60.0 / scale[axis];
            let found = Diagnostic::error("grbl.steps_too_fast").with("axis", AXES[axis]);
            let found = found.with("rate", libm::round(scale[axis] * rate[axis] / 60.0));
            found.with("number", 110 + axis).with("most", libm::floor(most))
        })
        .collect()
}

/// The ends of an axis with so much travel, in machine coordinates, mm.
pub(super) fn ends(travel_mm: f64, positive: bool) -> [f64; 2] {
    if positive { [0.0, travel_mm] } else { [-travel_mm, 0.0] }
}

fn travel(routine: &Routine, machine: &MachineRange<'_>) -> Vec<Diagnostic> {
    let (Some([low, high]), Some(travel)) = (routine.reach(), settings::axes(machine.values, 130)) else {
        return Vec::new();
    };
    let mut found = Vec::new();
    for axis in 0..3 {
        let top = if axis == 2 { high[2].max(routine.safe) } else { high[axis] };
        let (low, high) = (low[axis].mm(), top.mm());
        if high - low > travel[axis] + SLACK_MM {
            let error = Diagnostic::error("grbl.too_large").with("axis", AXES[axis]);
            found.push(error.with("needs", round(high - low)).with("travel", round(travel[axis])));
            continue;
        }
        let ends = ends(travel[axis], machine.positive);
        let (from, to) = (low + machine.zero_mm[axis], high + machine.zero_mm[axis]);
        let past = (ends[0] - from).max(to - ends[1]);
        if machine.homed && past > SLACK_MM {
            let error = Diagnostic::error("grbl.out_of_travel").with("axis", AXES[axis]);
            found.push(error.with("past", round(past)).with("from", round(from)).with("to", round(to)));
        }
    }
    found
}

fn feeds(routine: &Routine, machine: &MachineRange<'_>) -> Vec<Diagnostic> {
    let Some(rates) = settings::axes(machine.values, 110) else { return Vec::new() };
    let fastest = rates.iter().fold(0.0_f64, |most, rate| most.max(*rate));
    let cuts = moves(routine).filter(|step| step.course != Course::Rapid);
    let feed = cuts.map(|step| step.feed_mm_per_min).fold(0.0_f64, f64::max);
    if feed <= fastest * FEED_SLACK_FACTOR {
        return Vec::new();
    }
    let note = Diagnostic::warning("grbl.slower_than_asked").with("feed", round(feed));
    vec![note.with("fastest", round(fastest))]
}

fn moves(routine: &Routine) -> impl Iterator<Item = &RoutineMove> {
    routine.sections.iter().flat_map(|section| &section.actions).filter_map(|action| match action {
        RoutineAction::Go(step) => Some(step),
        _ => None,
    })
}

fn speeds(routine: &Routine, machine: &MachineRange<'_>) -> Vec<Diagnostic> {
    let said =
        routine.sections.iter().flat_map(|section| &section.actions).filter_map(|action| match action {
            RoutineAction::Spindle(Spindle::On(speed) | Spindle::Back(speed)) => Some(*speed),
            _ => None,
        });
    let fastest = said.fold(0.0_f64, f64::max);
    let most = machine.values.get(&30).copied().unwrap_or(0.0);
    if most <= 0.0 || fastest <= most {
        return Vec::new();
    }
    vec![Diagnostic::warning("grbl.spindle_slower").with("speed", round(fastest)).with("most", round(most))]
}

fn round(value: f64) -> f64 {
    libm::round(value * 100.0) / 100.0 + 0.0
}
