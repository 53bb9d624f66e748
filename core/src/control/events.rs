//! Inputs and outputs of the session.
//!
//! ```text
//!   user requests, executor reports ─▶ Event ─▶ session ─▶ Action ─▶ executor, journal, reply to the user
//! ```

use super::{Alarm, Ending, Trust};
use crate::diagnostic::Diagnostic;

/// A request or a report.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    Home,
    /// Make this XY position the work zero.
    SetZero {
        /// X and Y, machine steps.
        place_steps: [i64; 2],
    },
    /// Restore the previous work zero.
    UndoZero,
    /// Jog one axis.
    Jog {
        /// Axis, 0 to 2.
        axis: u8,
        distance_um: i32,
    },
    /// Move to the park position.
    Park,
    /// A job was checked and may start.
    Armed {
        job: String,
        /// Digest of its stream.
        digest: String,
    },
    /// The armed job is no longer valid.
    Disarmed {
        /// True if the position is lost, too.
        position_lost: bool,
    },
    Start {
        job: String,
        /// Digest of its stream.
        digest: String,
        /// First leg to run.
        from_leg: u32,
    },
    /// Start or continue a queue of work commands: one row, or up to a breakpoint.
    Queue,
    /// Probe the board with the new tool, during a tool change.
    Touch,
    /// Hold: along a toolpath at once, else at the end of the leg.
    Pause,
    /// Lift the tip off the toolpath on which it is paused.
    Lift,
    /// Report: at rest on the toolpath, with the task not complete.
    Held,
    Resume,
    /// Finish the hole or toolpath, then end the job.
    StopAfterHole,
    /// Stop now.
    Stop {
        /// Time of the press of STOP, ms on a monotonic clock.
        now_ms: u64,
    },
    /// The requested bit is in the spindle.
    ToolChanged,
    /// The user has read the alarm.
    Acknowledge,
    /// Report: all axes are homed.
    Homed,
    /// Report: a jog, a park or the move to the start of the job is complete.
    Arrived,
    /// Report: a leg is complete.
    LegDone {
        /// The leg drilled a hole or milled a toolpath.
        cut: bool,
        /// The leg was the last one of the job.
        last: bool,
    },
    /// Report: the leg waits for a bit from the user.
    BitWanted,
    /// Report: the leg waits for a bit from the magazine.
    ChangeWanted,
    /// Report: the machine has changed the bit.
    Changed,
    /// Report: the queue rests between two rows.
    QueueHeld,
    /// Report: the last row of the queue is complete.
    QueueDone,
    /// A queue started to home an axis, or finished homing.
    Counted {
        /// True if every axis is homed.
        all_homed: bool,
    },
    /// Report: at rest because of Stop.
    Rested,
    /// Report: the tip is up and the spindle off.
    Safe,
    /// Report, at rest: a failure.
    Failed {
        alarm: Alarm,
        /// Remaining trust in the position.
        left: Trust,
    },
    /// The journal can't keep up, so nothing new may start.
    CannotRecord(Alarm),
    /// A job ended, at rest, and its board differs from the program.
    BoardDiffers {
        alarm: Alarm,
        /// Remaining trust in the position.
        left: Trust,
    },
}

/// An action for the host.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// Home all axes. Moves.
    Home,
    /// Jog one axis. Moves.
    Jog {
        /// Axis, 0 to 2.
        axis: u8,
        distance_um: i32,
    },
    /// Tips up, spindle off, then to the park position. Moves.
    Park,
    /// Start the job: spindle on, move to the start of this leg. Moves.
    Approach {
        /// First leg to run.
        leg: u32,
    },
    /// Run the next rows of the queue. Moves.
    Queue,
    /// Use the result of a probe during a tool change, and lift the tip. Moves.
    Touched,
    /// Run the next leg. Moves.
    NextLeg,
    /// Fetch the bit that the leg waits for. Moves.
    ChangeTool,
    /// Run the rest of the leg after its tool change. Moves.
    RestOfLeg,
    /// Spindle on as before the pause, then the next leg. Moves.
    SpindleOn,
    /// Spindle off, and tip up if the position is reliable enough. Moves.
    MakeSafe {
        /// True if Z may be lifted.
        lift: bool,
    },
    /// Spindle off without a move.
    SpindleOff,
    /// Bring all motion to rest.
    Brake,
    /// Bring motion along a toolpath to rest, and wait there.
    Hold,
    /// Continue held motion on a toolpath, or cancel a pending hold.
    Go,
    /// Lift the tip off the toolpath on which it is paused, spindle off.
    LiftOffPath,
    /// Save the work zero, which changed.
    KeepZero,
    /// The job is over.
    End(Ending),
    /// The request is refused; nothing changed.
    Refuse(Diagnostic),
}

impl Action {
    /// True if the executor gets work.
    pub fn moves(&self) -> bool {
        matches!(
            self,
            Self::Home
                | Self::Jog { .. }
                | Self::Park
                | Self::Approach { .. }
                | Self::Queue
                | Self::Touched
                | Self::NextLeg
                | Self::ChangeTool
                | Self::RestOfLeg
                | Self::SpindleOn
                | Self::MakeSafe { .. }
        )
    }
}
