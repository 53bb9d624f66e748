//! Homing (C4), axis by axis and stage by stage (`motion::cycles`): of a queue's row, and of the whole machine.
//!
//! ```text
//! Seek ─gate▶ BackOff ─▶ Locate ─gate▶ the count is set right ─▶ Offset, to the very step where it always rests ─▶ next axis
//!                                            └▶ Index ─gate▶ once more ─┘
//! ```
//!
//! Comes in: reports of single segments. Goes out: the next segment and corrections of the count. Does not know why it is
//! homed, nor who plays.

use super::run::{Harm, QueueReport, guarded, late, missing};
use super::text::refuse;
use crate::diagnostic::Diagnostic;
use crate::job::{Mark, Stage};
use crate::machine::{Machine, Steps, axis_name, index_input};
use crate::motion::cycles;
use crate::pins::Outcome;
use crate::steps::{self, Segment};
use std::collections::VecDeque;

/// Steps by which a count may be off before it is worth an alarm.
const COUNT_TOLERANCE: i64 = 2;

/// A homing in work.
#[derive(Clone, Debug, PartialEq)]
pub struct Homing {
    /// Axes to come.
    axes: VecDeque<usize>,
    axis: usize,
    /// Stages of this axis to come.
    later: VecDeque<Segment>,
    stage: Stage,
    /// Axes whose count was believed before.
    counted: [bool; 3],
    /// By how many steps the end sensor of this axis set its count right, where an index pulse follows.
    by_sensor: i64,
    /// The first count that was wrong: axis, and by how many steps.
    off: Option<(usize, i64)>,
}

/// What follows from a report.
pub enum HomingNext {
    /// A move is to be played.
    Play {
        /// The move.
        segment: Segment,
        /// The count of the axis is to be corrected by so much before.
        correction_steps: i64,
    },
    /// All axes are homed.
    Homed,
}

impl Homing {
    /// Of these axes, in this order, with what is believed about each beforehand.
    pub fn new(axes: &[usize], counted: [bool; 3]) -> Self {
        let axes = axes.iter().copied().collect();
        let later = VecDeque::new();
        Self { axes, axis: 0, later, stage: Stage::Seek, counted, by_sensor: 0, off: None }
    }

    /// Which axis is being homed.
    pub fn axis(&self) -> usize {
        self.axis
    }

    /// The first segment of the next axis. Refused where the machine cannot be planned with.
    pub fn begin(&mut self, machine: &Machine) -> Result<HomingNext, Diagnostic> {
        let Some(axis) = self.axes.pop_front() else { return Ok(HomingNext::Homed) };
        self.axis = axis;
        let timeline = cycles::home_axis(machine, axis)?;
        let stages = timeline.moves.iter().filter(|planned| planned.stage != Stage::Offset);
        self.later = stages.map(|planned| steps::segment(planned, machine)).collect();
        Ok(self.stage(0).unwrap_or(HomingNext::Homed))
    }

    fn stage(&mut self, correction: i64) -> Option<HomingNext> {
        let segment = self.later.pop_front()?;
        self.stage = segment.stage;
        Some(HomingNext::Play { segment, correction_steps: correction })
    }

    /// What follows. `position` is where the axes were counted to be; it is set right here. An error ends it: with
    /// [`Harm::None`] all axes are homed, but a count had been wrong.
    pub fn reported(
        &mut self,
        machine: &Machine,
        report: &QueueReport,
        position: &mut Steps,
    ) -> Result<HomingNext, (Diagnostic, Harm)> {
        let input = machine.home_input(self.axis);
        let lost = |code: &str| {
            let why = refuse(code).with("axis", axis_name(self.axis)).with("sensor", format!("{input:?}"));
            (why, Harm::Lost)
        };
        let mut correction = 0;
        match (self.stage, report.outcome) {
            (_, Outcome::Guarded(hit)) => return Err((guarded(hit).0, Harm::Lost)),
            (_, Outcome::Missing(gone)) => return Err((missing(gone), Harm::Lost)),
            (_, Outcome::Late { ticks }) => return Err((late(ticks), Harm::Lost)),
            (_, Outcome::Spindle { trouble }) => return Err((trouble.diagnostic(), Harm::Lost)),
            (Stage::Index, Outcome::Unmet(_)) => {
                return Err(self.bad_index(machine, "control.index_not_found"));
            }
            (_, Outcome::Unmet(_)) => return Err(lost("control.sensor_not_found")),
            (Stage::BackOff, _) if report.inputs & input.bit() != 0 => {
                return Err(lost("control.sensor_stuck"));
            }
            (Stage::Locate, Outcome::Gated(at)) => {
                correction = self.set_right(machine, cycles::home_count(machine, self.axis), &at, position);
                self.by_sensor = correction;
                if !machine.axis(self.axis).index {
                    self.is_located(machine, correction, position)?;
                }
            }
            (Stage::Index, Outcome::Gated(at)) => {
                correction = self.set_right(machine, cycles::index_count(machine, self.axis), &at, position);
                let settings = machine.axis(self.axis);
                // So far from the middle of its turn it may be the pulse before, or after.
                if 4 * correction.abs() > settings.scale.steps(settings.index_within) {
                    return Err(self.bad_index(machine, "control.index_unclear"));
                }
                self.is_located(machine, self.by_sensor + correction, position)?;
            }
            _ => {}
        }
        if let Some(next) = self.stage(correction) {
            return Ok(next);
        }
        if !self.axes.is_empty() {
            return self.begin(machine).map_err(|why| (why, Harm::Lost));
        }
        match self.off {
            None => Ok(HomingNext::Homed),
            Some((axis, steps)) => {
                let why = refuse("control.lost_count").with("axis", axis_name(axis)).with("steps", steps);
                Err((why, Harm::None))
            }
        }
    }
}

impl Homing {
    /// The axis was `at` these steps where it has this `count`. Gives by how many steps that is more, and sets `position` right by them.
    fn set_right(&self, machine: &Machine, count: i64, at: &Steps, position: &mut Steps) -> i64 {
        // Of spindles that do not stand alike the lowest is the last to be up: how they stand to each other is counted on.
        let lowest = cycles::together(machine, self.axis).map(|axis| at[axis]).min().unwrap_or(0);
        for axis in cycles::together(machine, self.axis) {
            position[axis] += count - lowest;
        }
        count - lowest
    }

    /// Its place is known; it was `off` by so many steps. What is left is the way to where it rests.
    fn is_located(
        &mut self,
        machine: &Machine,
        off: i64,
        position: &Steps,
    ) -> Result<(), (Diagnostic, Harm)> {
        let counted = self.counted.get(self.axis).copied().unwrap_or(false);
        if counted && off.abs() > COUNT_TOLERANCE {
            self.off.get_or_insert((self.axis, off));
        }
        let to_rest = offset(machine, self.axis, *position).map_err(|why| (why, Harm::Lost))?;
        self.later.extend(to_rest);
        Ok(())
    }

    fn bad_index(&self, machine: &Machine, code: &str) -> (Diagnostic, Harm) {
        let input = format!("{:?}", index_input(self.axis));
        let why = refuse(code).with("axis", axis_name(self.axis)).with("sensor", input);
        (why.with("mm", machine.axis(self.axis).index_within.mm()), Harm::Lost)
    }
}

/// From the sensor's edge to the step where the axis always rests after homing, all spindles alike.
fn offset(machine: &Machine, axis: usize, from: Steps) -> Result<Vec<Segment>, Diagnostic> {
    let (rests, speed) = (cycles::home_place(machine, axis), machine.axis(axis).home_speed_mm_per_s);
    let timeline = match axis {
        0 | 1 => cycles::jog(machine, from, axis, rests - from[axis], speed)?,
        _ => cycles::lower(machine, from, rests, speed)?,
    };
    let segments = timeline.moves.iter().map(|planned| steps::segment(planned, machine));
    Ok(segments.map(|segment| Segment { stage: Stage::Offset, mark: Mark::Prepare, ..segment }).collect())
}
