//! The colours of the page: a word on its root, where the style sheet looks for it, kept for the next time.
//!
//! Comes in: the theme that was chosen. Goes out: that word, in the page and in the store; the one of last time, as an event. Knows no
//! colour.

use crate::browser::{kept_storage, window};
use crate::model::{FrameEvent, Theme};
use crate::page::send;

const KEPT_AS: &str = "annulus.theme";

/// Begins with the colours chosen last time.
pub(super) fn begin() {
    let kept = kept_storage().and_then(|storage| storage.get_item(KEPT_AS).ok().flatten());
    if let Some(word) = kept {
        send(FrameEvent::Colours { theme: Theme::called(&word) });
    }
}

/// Shows the page in the colours called `word`, and keeps the choice.
pub(super) fn show(word: &str) {
    if let Some(root) = window().document().and_then(|document| document.document_element()) {
        let _ = if word == Theme::Auto.word() {
            root.remove_attribute("data-theme")
        } else {
            root.set_attribute("data-theme", word)
        };
    }
    if let Some(storage) = kept_storage() {
        let _full_or_denied_is_no_harm = storage.set_item(KEPT_AS, word);
    }
}
