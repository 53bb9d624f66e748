//! Session, control, lateness and trust in the position, as pure state machines: (state, event) → (state,
//! actions).

mod board_height;
mod events;
pub mod lateness;
pub mod lease;
mod session;

pub use board_height::BoardHeight;
pub use events::{Action, Event};
pub use lateness::{Lateness, Timing};
pub use session::{Session, is_same_press, step};

use crate::diagnostic::Diagnostic;
use serde::{Deserialize, Serialize};

/// State of the machine, as the banner shows it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum State {
    /// Position unknown: home first.
    NotHomed,
    /// Moving to the limit switches.
    Homing,
    /// At rest, position known.
    Ready,
    /// A short jog.
    Jogging,
    Running,
    /// Braking, or finishing a hole, before a pause.
    Pausing,
    /// Paused; spindle off between holes.
    Paused,
    /// Waiting for the user to change the bit.
    ToolChange,
    /// A GRBL-family controller runs a job in its check mode; nothing moves.
    Checking,
    Stopping,
    /// An error that waits for acknowledgement.
    Alarm,
    /// Moving to the park position.
    Parking,
}

/// Reliability of the position. Only homing makes it trusted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Trust {
    /// Homed, with no doubtful event since.
    Trusted,
    /// Probably right, but something happened: home before a job.
    Suspect,
    #[default]
    Lost,
}

/// Reason for the end of a job.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Ending {
    Done,
    /// Stopped after a hole, on request.
    StoppedAfterHole,
    Stopped,
    Alarm,
}

/// An alarm, as a diagnostic with a code of the locale tables.
pub type Alarm = Diagnostic;
