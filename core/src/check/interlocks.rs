//! The rules between axes, spindle, gates and legs.
//!
//! Comes in: segments, the heights of the spindles in them, and where they stand in time. Goes out: rules broken. Looks at
//! single pulses only where plane and spindles step in one segment.

use crate::job::{Effect, Stage};
use crate::machine::{MOST_RPM, Machine};
use crate::remark::{Remark, Weight};
use crate::steps::replay;
use crate::steps::stream::Segment;
use crate::units::{Length, TICK_HZ};

/// The tip must be this far over the surface before X or Y may step, or at the safe height where that is lower. Where plane
/// and spindles move together, the machine says how far.
const CLEARANCE: Length = Length::from_um(200);

/// How high the spindles are in a segment, steps over the surface.
pub(super) struct Heights<'a> {
    /// Before it, one for each spindle.
    pub(super) starts: &'a [i64],
    /// The lowest of all of them in it.
    pub(super) low_z: i64,
}

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
        let overlap = machine.overlap;
        let wanted = if overlap.on { Length::from_mm(overlap.clear_mm) } else { CLEARANCE };
        let clearance = machine.z.scale.steps(wanted.min(machine.process.safe_height));
        let spin_up_ticks = libm::floor(machine.process.spin_up_ms * 1e-3 * TICK_HZ as f64) as u64;
        Self { clearance, spin_up_ticks, spindle_rpm: 0, spindle_since: 0 }
    }

    /// Whether the spindle was left running.
    pub(super) fn spindle_runs(&self) -> bool {
        self.spindle_rpm > 0
    }

    /// One segment that begins at tick `now`, and the one after it.
    pub(super) fn segment(
        &mut self,
        segment: &Segment,
        heights: &Heights<'_>,
        now: u64,
        next: Option<&Segment>,
    ) -> Vec<Remark> {
        let low_z = heights.low_z;
        let start_z = heights.starts.iter().copied().min().unwrap_or(0);
        let mut found = Vec::new();
        if let Effect::Spindle(rpm) = segment.effect
            && rpm != self.spindle_rpm
        {
            (self.spindle_rpm, self.spindle_since) = (rpm, now);
        }
        let rpm = self.spindle_rpm;
        let mut refuse = |broken: bool, code: &str| {
            if broken {
                let remark = Remark::new(Weight::Loss, code).with("height_steps", low_z);
                found.push(remark.with("rpm", rpm).with("most", MOST_RPM));
            }
        };
        refuse(self.spindle_rpm > MOST_RPM, "check.spindle_speed");
        let awaits = matches!(segment.effect, Effect::AwaitBit(_));
        refuse(awaits && (self.spindle_rpm > 0 || start_z < self.clearance), "check.await_bit");
        let in_plane = segment.runs.iter().any(|run| run.axes & 0b11 != 0);
        let milled = segment.stage == Stage::Mill;
        let dragged =
            in_plane && !milled && low_z < self.clearance && drags(segment, heights.starts, self.clearance);
        refuse(dragged, "check.xy_in_board");
        let in_board = low_z < 0;
        refuse(in_board && self.spindle_rpm == 0, "check.spindle_off");
        let spun = now.saturating_sub(self.spindle_since) >= self.spin_up_ticks;
        refuse(in_board && self.spindle_rpm > 0 && !spun, "check.spin_up");
        let alone = segment.runs.windows(2).all(|pair| matches!(pair, [a, b] if a.axes == b.axes));
        refuse(segment.gate.is_some() && (!alone || segment.runs.is_empty()), "check.gate_not_alone");
        let ends_low = segment.end[2..].iter().take(heights.starts.len()).any(|end| *end < self.clearance);
        let last_of_leg = next.is_none_or(|next| next.leg != segment.leg);
        let lifted = next.is_some_and(begins_upwards);
        refuse(last_of_leg && ends_low && !lifted, "check.leg_ends_low");
        found
    }
}

/// Whether a segment moves spindles, and all of them first upwards.
fn begins_upwards(segment: &Segment) -> bool {
    let sets = segment.runs.chunk_by(|a, b| a.axes == b.axes).filter_map(|runs| runs.first());
    let mut spindles = sets.filter(|first| first.axes & !0b11 != 0).peekable();
    spindles.peek().is_some() && spindles.all(|first| first.forward)
}

/// Whether the plane steps while any spindle is below the clearance: pulse by pulse.
fn drags(segment: &Segment, starts: &[i64], clearance: i64) -> bool {
    let mut heights = starts.to_vec();
    replay(segment).any(|pulse| {
        for (spindle, height) in heights.iter_mut().enumerate() {
            if pulse.axes >> (spindle + 2) & 1 == 1 {
                *height += if pulse.forward >> (spindle + 2) & 1 == 1 { 1 } else { -1 };
            }
        }
        pulse.axes & 0b11 != 0 && heights.iter().any(|height| *height < clearance)
    })
}
