//! The page's colour scheme: an attribute of the root element for the style sheet, saved for the next visit.

use crate::browser::{kept_storage, window};
use crate::model::{FrameEvent, Theme};
use crate::page::send;

const KEPT_AS: &str = "annulus.theme";

/// Restores the colours of the last visit.
pub(super) fn begin() {
    let kept = kept_storage().and_then(|storage| storage.get_item(KEPT_AS).ok().flatten());
    if let Some(word) = kept {
        send(FrameEvent::Colours { theme: Theme::called(&word) });
    }
}

/// Applies the colour scheme `word` and saves it.
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
