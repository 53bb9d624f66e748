//! What of the last run is really in the board, by the virtual drill's own record, sentence by sentence.
//!
//! Comes in: the status. Goes out: sentences to be said; none where everything is as programmed. Does not know how the run ended.

use crate::said::{Text, key};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::wire::Status;

/// What is not as programmed, the gravest first; then the hole that was drilled twice when the job was taken up, which is no
/// fault.
pub fn lines(status: &Status) -> Vec<Text> {
    let told = status.drilled.unwrap_or_default();
    let rows = [
        (u64::from(told.missing), key!("page.ended.missing")),
        (u64::from(told.shifted), key!("page.ended.shifted")),
        (u64::from(told.doubled), key!("page.ended.doubled")),
        (u64::from(told.broken), key!("page.ended.broken")),
        (told.slipped_steps, key!("page.ended.slipped")),
    ];
    let faults = rows.into_iter().filter(|(count, _)| *count > 0);
    let faults = faults.map(|(count, key)| Text::Key { key, args: vec![("count", count.to_string())] });
    let twice = status
        .drilled_twice
        .iter()
        .map(|hole| Text::Found(Diagnostic::note("run.drilled_twice").with("hole", hole)));
    faults.chain(twice).collect()
}
