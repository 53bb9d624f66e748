//! The drill's mind: session, guard, trust in the position. Pure state machines, (state, event) → (state, actions).
//!
//! Comes in: what people ask and what the executor reports. Goes out: what to do, and what to show. Knows no socket, no
//! thread, no disk.

mod events;
pub mod lateness;
pub mod lease;
mod session;

pub use events::{Action, Event};
pub use lateness::{Lateness, Timing};
pub use session::{Session, step};

use crate::diagnostic::Diagnostic;
use serde::{Deserialize, Serialize};

/// What the machine is doing, in the words of the banner.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum State {
    /// Position unknown: initialise first.
    NotHomed,
    /// Moving to the end sensors.
    Homing,
    /// At rest, position known.
    Ready,
    /// A short move by hand.
    Jogging,
    /// Drilling a job.
    Running,
    /// Finishing the stroke before a pause.
    Pausing,
    /// Held between two holes; spindle off.
    Paused,
    /// Waiting for a person to change the bit.
    ToolChange,
    /// A controller of the GRBL family reads a job in its check mode; nothing moves.
    Checking,
    /// Coming to rest.
    Stopping,
    /// Something went wrong; it waits to be acknowledged.
    Alarm,
    /// Going to where the head is parked.
    Parking,
}

/// How well the position is known. Only homing makes it trusted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Trust {
    /// Known: homed and nothing happened since.
    Trusted,
    /// Probably right, but something happened: home before a job.
    Suspect,
    /// Not known.
    Lost,
}

/// Why a job came to its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Ending {
    /// All holes drilled.
    Done,
    /// Stopped after a hole, as asked.
    StoppedAfterHole,
    /// STOP was pressed.
    Stopped,
    /// An alarm.
    Alarm,
}

/// An alarm: what happened, as a diagnostic with a code of the locale tables.
pub type Alarm = Diagnostic;
