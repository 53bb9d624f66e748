//! What a spindle tells of itself, where it tells anything (C6).
//!
//! ```text
//! untold                             a relay: nobody can know whether it turns
//! unreachable ⇄ off ─▶ reaching ─▶ at speed ─▶ lost ─▶ off
//!                          └──────── too long ──▲          only when it is switched off again
//! ```
//!
//! Comes in: what was heard of it. Goes out: the same as data, and as a sentence. Speeds in rpm. Does not know how it is asked.

use crate::diagnostic::Diagnostic;
use serde::{Deserialize, Serialize};

/// How a spindle stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum SpindleState {
    /// It tells nothing.
    #[default]
    Untold,
    /// It is not to turn, and does not answer.
    Unreachable,
    /// It is not to turn.
    Off {
        /// What it turns at all the same.
        rpm: u32,
    },
    /// It is on its way to its speed.
    Reaching {
        /// How far it is.
        rpm: u32,
    },
    /// It turns as fast as it is to.
    AtSpeed {
        /// How fast that is.
        rpm: u32,
    },
    /// It was to turn, and does not any more, or nobody knows.
    Lost {
        /// Why.
        trouble: SpindleTrouble,
    },
}

/// What is wrong with a spindle that is to turn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum SpindleTrouble {
    /// Its converter does not answer.
    Silent,
    /// What its converter answers is not understood.
    Garbled,
    /// Its converter refuses what it is asked.
    Refused {
        /// Its reason, by the number that the protocol has for it.
        code: u8,
    },
    /// It does not keep, or does not reach, its speed.
    Slow {
        /// What it turns at.
        rpm: u32,
        /// What it is to turn at.
        wanted_rpm: u32,
    },
    /// Its converter switched it off.
    Tripped {
        /// The number that the converter has for the reason.
        code: u16,
    },
}

impl SpindleTrouble {
    /// The same as a sentence.
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
