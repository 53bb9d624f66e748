//! State that a spindle reports, if it can report.
//!
//! ```text
//! untold                             a relay: its speed is unknown
//! unreachable ⇄ off ─▶ reaching ─▶ at speed ─▶ lost ─▶ off
//!                          └──────── too long ──▲          only when it is switched off again
//! ```
//!
//! Speeds in rpm.

use crate::diagnostic::Diagnostic;
use serde::{Deserialize, Serialize};

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum SpindleState {
    #[default]
    Untold,
    /// Should be off, and does not answer.
    Unreachable,
    /// Should be off.
    Off {
        /// Actual speed; more than 0 while it runs down.
        rpm: u32,
    },
    /// Accelerating to its speed.
    Reaching {
        /// Actual speed.
        rpm: u32,
    },
    /// Turns at the commanded speed.
    AtSpeed {
        /// Actual speed.
        rpm: u32,
    },
    /// Should turn, but lost its speed or no longer answers.
    Lost { trouble: SpindleTrouble },
}

/// Problem of a spindle that should turn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum SpindleTrouble {
    /// The converter does not answer.
    Silent,
    /// The converter's answer can't be understood.
    Garbled,
    /// The converter refuses a request.
    Refused {
        /// Reason, by the protocol's number.
        code: u8,
    },
    /// The spindle does not hold or reach its speed.
    Slow {
        /// Actual speed.
        rpm: u32,
        /// Commanded speed.
        wanted_rpm: u32,
    },
    /// The converter switched the spindle off.
    Tripped {
        /// Reason, by the converter's number.
        code: u16,
    },
}

impl SpindleTrouble {
    /// The trouble as a message.
    pub fn diagnostic(self) -> Diagnostic {
        let error = |code: &str| Diagnostic::error(code);
        match self {
            Self::Silent => error("spindle.silent"),
            Self::Garbled => error("spindle.garbled"),
            Self::Refused { code } => error("spindle.refused").with("code", code),
            Self::Slow { rpm, wanted_rpm } => {
                error("spindle.slow").with("rpm", rpm).with("wanted", wanted_rpm)
            }
            Self::Tripped { code } => error("spindle.tripped").with("code", code),
        }
    }
}
