//! Session, control, lateness and trust in the position, as pure state machines: (state, event) → (state,
//! actions).

mod events;
pub mod lateness;
pub mod lease;
mod session;

pub use events::{Action, Event};
pub use lateness::{Lateness, Timing};
pub use session::{Session, is_same_press, step};

use crate::diagnostic::Diagnostic;
use serde::{Deserialize, Serialize};

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum State {
    /// Position unknown: home first.
    NotHomed,
    Homing,
    /// At rest, position known.
    Ready,
    Jogging,
    Running,
    /// Braking, or finishing a hole, before a pause.
    Pausing,
    /// Paused; spindle off between holes.
    Paused,
    ToolChange,
    /// A GRBL-family controller runs a job in its check mode; nothing moves.
    Checking,
    Stopping,
    Alarm,
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

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Ending {
    Done,
    /// Stopped after a hole, on request.
    StoppedAfterHole,
    Stopped,
    Alarm,
}

pub type Alarm = Diagnostic;

/// The bit to which the zero of Z applies: no other may cut. The rule holds for machines that Annulus drives
/// itself, and for controllers.
///
/// ```text
///  Unknown ── zero of Z is set or probed ──▶ OfThisBit
///                                               │ another tool is requested or inserted,
///             OfAnotherBit ◀────────────────────┘ unless all tools are equally long
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BoardHeight {
    /// Not set since the link opened, or rejected.
    #[default]
    Unknown,
    OfAnotherBit,
    OfThisBit,
}

impl BoardHeight {
    /// The height after a possible tool change. `alike`: all tools are equally long.
    #[must_use]
    pub fn with_another_tool(self, alike: bool) -> Self {
        if self == Self::OfThisBit && !alike { Self::OfAnotherBit } else { self }
    }

    pub fn may_cut(self) -> bool {
        self == Self::OfThisBit
    }
}
