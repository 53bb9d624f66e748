//! The process of the executor. Only the bridge starts it, and exchanges frames with it.

use super::{Answer, Exit, Refusal};
use crate::executor::child;
use annulus_core::error;
use serde_json::Value;

pub(super) fn run() -> Result<Answer, Refusal> {
    let ended = child::run();
    ended.map_err(|error| Refusal::surroundings(error!("output.not_by_hand", reason = error)))?;
    Ok(Answer { object: Value::Null, text: String::new(), exit: Exit::Done })
}
