//! Homing, axis by axis and stage by stage (`motion::cycles`), for queue rows and for the whole machine.
//!
//! ```text
//! Seek ─gate▶ BackOff ─▶ Locate ─gate▶ correct the count ─▶ Offset, to the exact rest step ─▶ next axis
//!                                          └▶ Index ─gate▶ again ─┘
//! ```

use super::work::{Harm, QueueReport, guarded, late, missing};
use crate::diagnostic::Diagnostic;
use crate::job::{Mark, Stage};
use crate::machine::{Machine, Steps, axis_name, index_input};
use crate::motion::cycles;
use crate::pins::Outcome;
use crate::steps::{self, Segment};
use crate::{code, error};
use std::collections::VecDeque;

/// Largest error of a count without an alarm, in steps.
const COUNT_TOLERANCE: i64 = 2;

/// A running homing.
#[derive(Clone, Debug, PartialEq)]
pub struct Homing {
    axes: VecDeque<usize>,
    axis: usize,
    /// Remaining stages of this axis.
    later: VecDeque<Segment>,
    stage: Stage,
    /// Axes with a trusted count before homing.
    counted: [bool; 3],
    /// Correction of the count by the limit switch of this axis, in steps, if an index pulse follows.
    by_sensor: i64,
    /// The first wrong count: axis and error in steps.
    off: Option<(usize, i64)>,
}

pub enum HomingNext {
    Play {
        segment: Segment,
        /// Correction of the axis' count before the move.
        correction_steps: i64,
    },
    Homed,
}

impl Homing {
    /// Homing of these axes in this order. `counted`: which counts were trusted before.
    pub fn new(axes: &[usize], counted: [bool; 3]) -> Self {
        let axes = axes.iter().copied().collect();
        let later = VecDeque::new();
        Self { axes, axis: 0, later, stage: Stage::Seek, counted, by_sensor: 0, off: None }
    }

    pub fn axis(&self) -> usize {
        self.axis
    }

    /// The first segment of the next axis. Fails if the machine can't plan it.
    pub fn begin(&mut self, machine: &Machine) -> Result<HomingNext, Diagnostic> {
        let Some(axis) = self.axes.pop_front() else { return Ok(HomingNext::Homed) };
        self.axis = axis;
        let timeline = cycles::home_axis(machine, axis)?;
        // The move to the rest position is planned later, from the corrected count.
        let stages = timeline.moves.iter().filter(|planned| planned.stage != Stage::Offset);
        self.later = stages.map(|planned| steps::segment(planned, machine)).collect();
        Ok(self.stage(0).unwrap_or(HomingNext::Homed))
    }

    fn stage(&mut self, correction: i64) -> Option<HomingNext> {
        let segment = self.later.pop_front()?;
        self.stage = segment.stage;
        Some(HomingNext::Play { segment, correction_steps: correction })
    }

    /// Next action after a report. Corrects `position`, the counted position. Any error ends the homing: with
    /// [`Harm::None`] all axes are homed, but a count was wrong.
    pub fn reported(
        &mut self,
        machine: &Machine,
        report: &QueueReport,
        position: &mut Steps,
    ) -> Result<HomingNext, (Diagnostic, Harm)> {
        let input = machine.home_input(self.axis);
        let lost = |code: &str| {
            let why = Diagnostic::error(code).with("axis", axis_name(self.axis)).with("sensor", input.name());
            (why, Harm::Lost)
        };
        let mut correction = 0;
        match (self.stage, report.outcome) {
            // A failure during homing always loses the position.
            (_, Outcome::Guarded(hit)) => return Err((guarded(hit).0, Harm::Lost)),
            (_, Outcome::Missing(gone)) => return Err((missing(gone), Harm::Lost)),
            (_, Outcome::Late { ticks }) => return Err((late(ticks), Harm::Lost)),
            (_, Outcome::Spindle { trouble }) => return Err((trouble.diagnostic(), Harm::Lost)),
            (Stage::Index, Outcome::Unmet(_)) => {
                return Err(self.bad_index(machine, code!("control.index_not_found")));
            }
            (_, Outcome::Unmet(_)) => return Err(lost(code!("control.sensor_not_found"))),
            (Stage::BackOff, _) if report.inputs & input.bit() != 0 => {
                return Err(lost(code!("control.sensor_stuck")));
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
                // At that distance from the middle of a turn, the pulse may be the previous or the next one.
                if 4 * correction.abs() > settings.scale.steps(settings.index_within) {
                    return Err(self.bad_index(machine, code!("control.index_unclear")));
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
                let why = error!("control.lost_count", axis = axis_name(axis), steps = steps);
                Err((why, Harm::None))
            }
        }
    }
}

impl Homing {
    /// Sets `position` so that the axis, found `at` these steps, has this `count`. Returns the correction.
    fn set_right(&self, machine: &Machine, count: i64, at: &Steps, position: &mut Steps) -> i64 {
        // If spindles differ in height, the lowest reaches the top switch last; their relative heights are
        // trusted.
        let lowest = cycles::together(machine, self.axis).map(|axis| at[axis]).min().unwrap_or(0);
        for axis in cycles::together(machine, self.axis) {
            position[axis] += count - lowest;
        }
        count - lowest
    }

    /// Records that the position is known, with an error of `off` steps. Only the move to the rest position
    /// remains.
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
        let input = index_input(self.axis).name();
        let why = Diagnostic::error(code).with("axis", axis_name(self.axis)).with("sensor", input);
        (why.with("mm", machine.axis(self.axis).index_within.mm()), Harm::Lost)
    }
}

/// From the switch edge to the rest position after homing, with all spindles level.
fn offset(machine: &Machine, axis: usize, from: Steps) -> Result<Vec<Segment>, Diagnostic> {
    let (rests, speed) = (cycles::home_place(machine, axis), machine.axis(axis).home_speed_mm_per_s);
    let timeline = match axis {
        0 | 1 => cycles::jog(machine, from, axis, rests - from[axis], speed)?,
        _ => cycles::lower(machine, from, rests, speed)?,
    };
    let segments = timeline.moves.iter().map(|planned| steps::segment(planned, machine));
    Ok(segments.map(|segment| Segment { stage: Stage::Offset, mark: Mark::Prepare, ..segment }).collect())
}
