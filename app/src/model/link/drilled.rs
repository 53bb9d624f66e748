//! Result of the last run in the board, according to the virtual drill, as messages.

use crate::said::{Text, key};
use annulus_core::note;
use annulus_core::wire::Status;

/// The deviations from the program, the gravest first; then holes that a resumed job drilled twice, which is
/// no fault.
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
    let twice = status.drilled_twice.iter().map(|hole| Text::Found(note!("run.drilled_twice", hole = hole)));
    faults.chain(twice).collect()
}
