//! What the session is asked and told, and what is to be done then.
//!
//! ```text
//!   a person asks, the executor reports ─▶ Event ─▶ session ─▶ Action ─▶ executor, journal, whoever asked
//! ```
//!
//! Comes in, goes out: plain data; places in machine steps, lengths in µm. Does not know what is allowed when.

use super::{Alarm, Ending, Trust};
use crate::diagnostic::Diagnostic;

/// Something asked, or something that happened.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// Home.
    Home,
    /// The place in the plane, machine steps, becomes work zero.
    SetZero {
        /// X and Y, machine steps.
        place_steps: [i64; 2],
    },
    /// The work zero before it.
    UndoZero,
    /// One axis by so many µm.
    Jog {
        /// Which axis, 0 to 2.
        axis: u8,
        /// How far.
        distance_um: i32,
    },
    /// To where the head is parked.
    Park,
    /// A job was checked and may start.
    Armed {
        /// Its key.
        job: String,
        /// Digest of its stream.
        digest: String,
    },
    /// What was armed no longer holds; whether the position is lost with it.
    Disarmed {
        /// Whether it must be homed again.
        position_lost: bool,
    },
    /// Start a job.
    Start {
        /// Its key.
        job: String,
        /// Digest of its stream.
        digest: String,
        /// The leg to begin with.
        from_leg: u32,
    },
    /// Begin a queue of work commands, or go on with it: a row, or up to a breakpoint.
    Queue,
    /// Finish the leg, then hold.
    Pause,
    /// Go on.
    Resume,
    /// Finish the hole or toolpath, then end.
    StopAfterHole,
    /// Come to rest now.
    Stop,
    /// The bit is in.
    ToolChanged,
    /// The alarm was read.
    Acknowledge,
    /// Report: all axes are homed.
    Homed,
    /// Report: the move by hand is done, or the head is parked, or stands where the job starts.
    Arrived,
    /// Report: a leg is done.
    LegDone {
        /// It drilled a hole or milled a toolpath.
        cut: bool,
        /// It was the last one of the job.
        last: bool,
    },
    /// Report: the leg waits for a bit.
    BitWanted,
    /// Report: the leg waits for a bit that the machine fetches itself.
    ChangeWanted,
    /// Report: the machine has fetched it.
    Changed,
    /// Report: the queue rests between two rows.
    QueueHeld,
    /// Report: the last row of the queue is done.
    QueueDone,
    /// A queue began to home an axis, or has homed all of them: whether every axis is homed.
    Counted {
        /// Whether every axis is homed.
        all_homed: bool,
    },
    /// Report: at rest because of Stop.
    Rested,
    /// Report: the tip is up and the spindle off.
    Safe,
    /// Report, at rest: something went wrong, and what is left of the trust.
    Failed {
        /// What went wrong.
        alarm: Alarm,
        /// What is left of the trust in the position.
        left: Trust,
    },
    /// The journal cannot keep up: nothing new may be begun.
    CannotRecord(Alarm),
    /// A job is over, at rest, and its board is not as programmed; what is left of the trust.
    BoardDiffers {
        /// In which way.
        alarm: Alarm,
        /// What is left of the trust in the position.
        left: Trust,
    },
}

/// Something to be done.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// Home all axes. Moves.
    Home,
    /// Move one axis by so many µm. Moves.
    Jog {
        /// Which axis, 0 to 2.
        axis: u8,
        /// How far.
        distance_um: i32,
    },
    /// Tips up, spindle off, and to where the head is parked. Moves.
    Park,
    /// Begin the job: go to where this leg starts, spindle on. Moves.
    Approach {
        /// The leg to begin with.
        leg: u32,
    },
    /// The next rows of the queue. Moves.
    Queue,
    /// Run the next leg. Moves.
    NextLeg,
    /// Fetch the bit that the leg waits for. Moves.
    ChangeTool,
    /// Run what is left of the leg after its bit. Moves.
    RestOfLeg,
    /// Spindle on again, as before the pause, then the next leg. Moves.
    SpindleOn,
    /// Tip up where the position is known well enough, spindle off. Moves.
    MakeSafe {
        /// Whether Z may be lifted.
        lift: bool,
    },
    /// Spindle off, nothing moves.
    SpindleOff,
    /// Whatever moves comes to rest.
    Brake,
    /// The work zero changed.
    KeepZero,
    /// The job is over.
    End(Ending),
    /// The ask is refused; nothing changed.
    Refuse(Diagnostic),
}

impl Action {
    /// Whether the executor gets something to do.
    pub fn moves(&self) -> bool {
        matches!(
            self,
            Self::Home
                | Self::Jog { .. }
                | Self::Park
                | Self::Approach { .. }
                | Self::Queue
                | Self::NextLeg
                | Self::ChangeTool
                | Self::RestOfLeg
                | Self::SpindleOn
                | Self::MakeSafe { .. }
        )
    }
}
