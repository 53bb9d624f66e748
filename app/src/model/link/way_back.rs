//! After an alarm: the way back to the job, step by step, instead of a person's guess (A12).
//!
//! ```text
//! read the alarm ─┬─ bit out of the board, where the position is trusted ─┬─ tool checked ─▶ resume
//!                 └─ homed again, which takes the bit up, where it is not ─┤
//!                    or zero set by hand, on a mill without switches      ─┘
//! ```
//!
//! Ticked is what was seen alone: that the bit is out of the board where the place is known, what the bit looks like by a person.
//!
//! Comes in: the status, whether the machine homes, whether a job was broken off, whether somebody looked at the bit. Goes out: the steps, each done, to be done now, or later. Moves nothing.

use annulus_core::control::Trust;
use annulus_core::wire::Status;

/// One step of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BackStep {
    /// The alarm is read.
    Read,
    /// The bit is out of the board.
    Lift,
    /// The position is trusted again, by homing.
    Home,
    /// The same of a machine without switches: by a zero that a person sets.
    Zero,
    /// The tool is whole; nobody but a person can know.
    Tool,
    /// The job goes on.
    Resume,
}

/// Where a step is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BackMark {
    /// It is done.
    Done,
    /// It is the one to be done.
    Now,
    /// Others come before it.
    Later,
}

/// The way back from how things stand, of a machine that `homes`; a job `is_broken_off` where one can be taken up. Somebody `has_looked` at
/// the bit.
pub fn way_back(
    status: &Status,
    homes: bool,
    is_broken_off: bool,
    has_looked: bool,
) -> Vec<(BackStep, BackMark)> {
    let is_known = status.trust == Trust::Trusted;
    let mut steps = vec![(BackStep::Read, status.alarm.is_none())];
    // Where the place is not trusted nobody but a person sees where the bit is, and homing takes it up first.
    if is_known {
        steps.push((BackStep::Lift, status.work_mm[2] > 0.0));
    }
    steps.push((if homes { BackStep::Home } else { BackStep::Zero }, is_known));
    if is_broken_off {
        steps.extend([(BackStep::Tool, has_looked), (BackStep::Resume, false)]);
    }
    let mut open = true;
    let mark = |(step, done): (BackStep, bool)| {
        let mark = match (done, open) {
            (true, _) => BackMark::Done,
            (false, true) => BackMark::Now,
            (false, false) => BackMark::Later,
        };
        // The tool is checked while Resume is offered: its pre-flight asks once more.
        open &= done || step == BackStep::Tool;
        (step, mark)
    };
    steps.into_iter().map(mark).collect()
}
