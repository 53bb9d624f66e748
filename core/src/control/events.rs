//! Inputs and outputs of the session.
//!
//! ```text
//!   user requests, executor reports ─▶ Event ─▶ session ─▶ Action ─▶ executor, journal, reply to the user
//! ```

use super::{Alarm, Ending, Trust};
use crate::diagnostic::Diagnostic;

#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    Home,
    SetZero {
        place_steps: [i64; 2],
    },
    UndoZero,
    Jog {
        /// Axis, 0 to 2.
        axis: u8,
        distance_um: i32,
    },
    Park,
    Armed {
        job: String,
        digest: String,
    },
    /// The armed job is no longer valid.
    Disarmed {
        position_lost: bool,
    },
    Start {
        job: String,
        digest: String,
        from_leg: u32,
    },
    /// Start or continue a queue of work commands: one row, or up to a breakpoint.
    Queue,
    Touch,
    /// Hold: along a toolpath at once, else at the end of the leg.
    Pause,
    Lift,
    /// Report: at rest on the toolpath, with the task not complete.
    Held,
    Resume,
    StopAfterHole,
    Stop {
        now_ms: u64,
    },
    /// The requested bit is in the spindle.
    ToolChanged,
    Acknowledge,
    Homed,
    /// Report: a jog, a park or the move to the start of the job is complete.
    Arrived,
    LegDone {
        cut: bool,
        last: bool,
    },
    /// Report: the leg waits for a bit from the user.
    BitWanted,
    /// Report: the leg waits for a bit from the magazine.
    ChangeWanted,
    /// Report: the machine has changed the bit.
    Changed,
    QueueHeld,
    QueueDone,
    /// A queue started to home an axis, or finished homing.
    Counted {
        all_homed: bool,
    },
    /// Report: at rest because of Stop.
    Rested,
    /// Report: the tip is up and the spindle off.
    Safe,
    /// Report, at rest: a failure.
    Failed {
        alarm: Alarm,
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
        lift: bool,
    },
    /// Spindle off without a move.
    SpindleOff,
    Brake,
    /// Bring motion along a toolpath to rest, and wait there.
    Hold,
    /// Continue held motion on a toolpath, or cancel a pending hold.
    Go,
    LiftOffPath,
    /// Save the work zero, which changed.
    KeepZero,
    End(Ending),
    /// The request is refused; nothing changed.
    Refuse(Diagnostic),
}

impl Action {
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
