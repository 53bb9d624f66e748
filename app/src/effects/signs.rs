//! Whether keys that type something do anything alone, kept for the next time.
//!
//! Comes in: the choice. Goes out: that choice into the store; the one of last time, as an event. Does not know which keys.

use crate::browser::kept_storage;
use crate::model::FrameEvent;
use crate::page::send;

const OFF: &str = "annulus.signs_off";

/// Begins as it was chosen last time.
pub(super) fn begin() {
    if kept_storage().and_then(|storage| storage.get_item(OFF).ok().flatten()).is_some() {
        send(FrameEvent::Signs { on: false });
    }
}

/// Keeps the choice.
pub(super) fn keep(on: bool) {
    if let Some(storage) = kept_storage() {
        let _full_or_denied_is_no_harm =
            if on { storage.remove_item(OFF) } else { storage.set_item(OFF, "1") };
    }
}
