//! After an alarm: the steps back to the job, so that the user need not guess.
//!
//! ```text
//! acknowledge the alarm ─┬─ position trusted: raise the tool out of the board ──┬─ check the tool ─▶ resume
//!                        └─ not trusted: home, which raises the tool first ─────┤
//!                           or set zero, on a machine without limit switches ───┘
//! ```
//!
//! A step counts as done only if it was observed: a raised tool by a trusted position, the tool's state by
//! the user.
//!
//! Moves nothing.

use annulus_core::control::Trust;
use annulus_core::wire::Status;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BackStep {
    /// The alarm is acknowledged.
    Read,
    /// The tool is out of the board.
    Lift,
    Home,
    /// On a machine without limit switches, setting zero makes the position trusted again.
    Zero,
    /// The tool is not broken; only the user can check that.
    Tool,
    Resume,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BackMark {
    Done,
    /// The step to do next.
    Now,
    Later,
}

/// The steps from the current state. `homes`: the machine has limit switches. `is_broken_off`: a job can be
/// resumed. `has_looked`: the user has checked the tool.
pub fn way_back(
    status: &Status,
    homes: bool,
    is_broken_off: bool,
    has_looked: bool,
) -> Vec<(BackStep, BackMark)> {
    let is_known = status.trust == Trust::Trusted;
    let mut steps = vec![(BackStep::Read, status.alarm.is_none())];
    // Without a trusted position only the user can see where the tool is, and homing raises it first.
    if is_known {
        steps.push((BackStep::Lift, status.work_mm[2] > 0.0));
    }
    steps.push(if homes {
        (BackStep::Home, is_known)
    } else {
        (BackStep::Zero, is_known && !status.needs_z_zero)
    });
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
        // Resume is offered although the tool is not checked yet: its preflight asks again.
        open &= done || step == BackStep::Tool;
        (step, mark)
    };
    steps.into_iter().map(mark).collect()
}
