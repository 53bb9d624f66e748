//! The rules between axes, spindle, gates and legs.
//!
//! Comes in: segments, the heights of Z in them, and where they stand in time. Goes out: rules broken. Does not
//! look at single pulses.

use crate::job::Effect;
use crate::machine::Machine;
use crate::remark::{Remark, Weight};
use crate::steps::stream::Segment;
use crate::units::{Length, TICK_HZ};

/// The tip must be this far over the surface before X or Y may step, or at the safe height where that is lower.
const CLEARANCE: Length = Length::from_um(200);

/// What the rules have to remember from segment to segment.
#[derive(Debug)]
pub(super) struct Interlocks {
    /// Steps from the surface to the clearance.
    clearance: i64,
    spin_up_ticks: u64,
    spindle_rpm: u32,
    /// When the spindle was last told another speed.
    spindle_since: u64,
}

impl Interlocks {
    /// For `machine`, spindle off.
    pub(super) fn new(machine: &Machine) -> Self {
        let clearance = machine.z.scale.steps(CLEARANCE.min(machine.process.safe_height));
        let spin_up_ticks = libm::floor(machine.process.spin_up_ms * 1e-3 * TICK_HZ as f64) as u64;
        Self { clearance, spin_up_ticks, spindle_rpm: 0, spindle_since: 0 }
    }

    /// Whether the spindle was left running.
    pub(super) fn spindle_runs(&self) -> bool {
        self.spindle_rpm > 0
    }

    /// One segment that begins at tick `now` with Z at `start_z` and gets as low as `low_z`.
    pub(super) fn segment(
        &mut self,
        segment: &Segment,
        start_z: i64,
        low_z: i64,
        now: u64,
        last_of_leg: bool,
    ) -> Vec<Remark> {
        let mut found = Vec::new();
        let mut refuse = |broken: bool, code: &str| {
            if broken {
                found.push(Remark::new(Weight::Loss, code).with("height_steps", low_z));
            }
        };
        if let Effect::Spindle(rpm) = segment.effect
            && rpm != self.spindle_rpm
        {
            (self.spindle_rpm, self.spindle_since) = (rpm, now);
        }
        let awaits = matches!(segment.effect, Effect::AwaitBit(_));
        refuse(awaits && (self.spindle_rpm > 0 || start_z < self.clearance), "check.await_bit");
        let in_plane = segment.runs.iter().any(|run| run.axis < 2);
        refuse(in_plane && low_z < self.clearance, "check.xy_in_board");
        let in_board = low_z < 0;
        refuse(in_board && self.spindle_rpm == 0, "check.spindle_off");
        let spun = now.saturating_sub(self.spindle_since) >= self.spin_up_ticks;
        refuse(in_board && self.spindle_rpm > 0 && !spun, "check.spin_up");
        let alone = segment.runs.windows(2).all(|pair| matches!(pair, [a, b] if a.axis == b.axis));
        refuse(segment.gate.is_some() && (!alone || segment.runs.is_empty()), "check.gate_not_alone");
        refuse(last_of_leg && segment.end[2] < self.clearance, "check.leg_ends_low");
        found
    }
}
