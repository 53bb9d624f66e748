//! Saves whether shortcuts of a single character are on, the user's own shortcuts, and the panel widths.

use crate::browser::kept_storage;
use crate::model::FrameEvent;
use crate::page::send;

const OFF: &str = "annulus.signs_off";
const OWN: &str = "annulus.own_keys";
const PANELS: &str = "annulus.panels";

/// Restores the choices of the last visit.
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

/// Saves whether shortcuts of a single character are on.
pub(super) fn keep(on: bool) {
    put(OFF, if on { "" } else { "1" });
}

/// Saves the user's own shortcuts.
pub(super) fn keep_own(text: &str) {
    put(OWN, text);
}

pub(super) fn keep_panels(text: &str) {
    put(PANELS, text);
}

/// Saves a text; deletes an empty one.
fn put(name: &str, text: &str) {
    if let Some(storage) = kept_storage() {
        let _full_or_denied_is_no_harm =
            if text.is_empty() { storage.remove_item(name) } else { storage.set_item(name, text) };
    }
}
