//! Texts saved while the page closes: synchronously in local storage, because nothing asynchronous completes
//! then.

use crate::browser::kept_storage;

/// One kind of text; the prefix of its keys.
#[derive(Clone, Copy)]
pub(super) struct LeftTexts(pub &'static str);

impl LeftTexts {
    fn key(self, place: u32) -> String {
        format!("{}{place}", self.0)
    }

    /// Saves a text. If there is no room, the store's version is at most half a second old.
    pub(super) fn put(self, place: u32, text: &str, at_ms: f64) {
        if let Some(storage) = kept_storage() {
            let _ = storage.set_item(&self.key(place), &format!("{at_ms} {text}"));
        }
    }

    /// The text saved after `at_ms`, and its time.
    pub(super) fn since(self, place: u32, at_ms: f64) -> Option<(f64, String)> {
        let text = kept_storage()?.get_item(&self.key(place)).ok()??;
        let (left_ms, text) = text.split_once(' ')?;
        let left_ms = left_ms.parse().ok().filter(|left_ms| *left_ms > at_ms)?;
        Some((left_ms, text.to_owned()))
    }

    /// The store has the version of `at_ms`: deletes the text unless it is newer.
    pub(super) fn stored(self, place: u32, at_ms: f64) {
        if self.since(place, at_ms).is_none() {
            self.clear(place);
        }
    }

    pub(super) fn clear(self, place: u32) {
        if let Some(storage) = kept_storage() {
            let _ = storage.remove_item(&self.key(place));
        }
    }
}
