//! The executor's process. The bridge starts it and speaks to it in frames; a person has no use for it.
//!
//! Comes in: standard input. Goes out: standard output, in frames. Does not know what is moved.

use super::{Answer, Exit, Refusal};
use crate::executor::child;
use annulus_core::diagnostic::Diagnostic;
use serde_json::Value;

/// Runs the command.
pub(super) fn run() -> Result<Answer, Refusal> {
    let ended = child::run();
    ended.map_err(|error| {
        Refusal::surroundings(Diagnostic::error("output.not_by_hand").with("reason", error))
    })?;
    Ok(Answer { object: Value::Null, text: String::new(), exit: Exit::Done })
}
