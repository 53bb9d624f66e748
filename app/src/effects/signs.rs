//! Whether keys that type something do anything alone, which of them a person moved, and how wide the panels are, kept for the next
//! time.
//!
//! Comes in: the choices. Goes out: those choices into the store; those of last time, as events. Does not know what the keys do.

use crate::browser::kept_storage;
use crate::model::FrameEvent;
use crate::page::send;

const OFF: &str = "annulus.signs_off";
const OWN: &str = "annulus.own_keys";
const PANELS: &str = "annulus.panels";

/// Begins as it was chosen last time.
pub(super) fn begin() {
    let kept = |name| kept_storage().and_then(|storage| storage.get_item(name).ok().flatten());
    if kept(OFF).is_some() {
        send(FrameEvent::Signs { on: false });
    }
    if let Some(text) = kept(OWN) {
        send(FrameEvent::OwnKeysKept { text });
    }
    if let Some(text) = kept(PANELS) {
        send(FrameEvent::PanelsKept { text });
    }
}

/// Keeps whether they work alone.
pub(super) fn keep(on: bool) {
    put(OFF, if on { "" } else { "1" });
}

/// Keeps which were moved.
pub(super) fn keep_own(text: &str) {
    put(OWN, text);
}

/// Keeps how wide the panels are.
pub(super) fn keep_panels(text: &str) {
    put(PANELS, text);
}

/// Keeps a text, or nothing where it is empty.
fn put(name: &str, text: &str) {
    if let Some(storage) = kept_storage() {
        let _full_or_denied_is_no_harm =
            if text.is_empty() { storage.remove_item(name) } else { storage.set_item(name, text) };
    }
}
