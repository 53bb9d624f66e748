//! What a page puts down while it is being left: at once, for what takes time does not happen any more.
//!
//! Comes in: texts with the time. Goes out: those that are newer than what the store has. Does not know what is in them.

use crate::browser::kept_storage;

/// Where one kind of thing is put down, by its place.
#[derive(Clone, Copy)]
pub(super) struct LeftTexts(pub &'static str);

impl LeftTexts {
    fn key(self, place: u32) -> String {
        format!("{}{place}", self.0)
    }

    /// Puts a text down. Where there is no room, what the store has is half a second old at most.
    pub(super) fn put(self, place: u32, text: &str, at_ms: f64) {
        if let Some(storage) = kept_storage() {
            let _ = storage.set_item(&self.key(place), &format!("{at_ms} {text}"));
        }
    }

    /// What was put down after `at_ms`, and when.
    pub(super) fn since(self, place: u32, at_ms: f64) -> Option<(f64, String)> {
        let text = kept_storage()?.get_item(&self.key(place)).ok()??;
        let (left_ms, text) = text.split_once(' ')?;
        let left_ms = left_ms.parse().ok().filter(|left_ms| *left_ms > at_ms)?;
        Some((left_ms, text.to_owned()))
    }

    /// The store has what is of `at_ms`: what was put down by then is not needed any more.
    pub(super) fn stored(self, place: u32, at_ms: f64) {
        if self.since(place, at_ms).is_none() {
            self.clear(place);
        }
    }

    /// Takes away what lies there.
    pub(super) fn clear(self, place: u32) {
        if let Some(storage) = kept_storage() {
            let _ = storage.remove_item(&self.key(place));
        }
    }
}
