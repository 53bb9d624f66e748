//! The page's language: chosen at the first visit, fetched on demand, saved for the next visit.
//!
//! ```text
//! ?lang=pl │ chosen last time │ the browser's languages ─▶ FrameEvent::Language ─▶ locales/pl.toml ─▶ Spoken
//! ```
//!
//! English is built in. Other languages are separate files, so that only a page that uses one loads it. The
//! service worker caches them for offline use like other files of the site.

use crate::browser::{kept_storage, request, window};
use crate::model::FrameEvent;
use crate::page::send;
use annulus_core::locale;
use leptos::task::spawn_local;
use web_sys::UrlSearchParams;

const KEPT_AS: &str = "annulus.language";

/// The language requested by the address.
fn asked() -> Option<&'static str> {
    let search = window().location().search().ok()?;
    locale::serving(&UrlSearchParams::new_with_str(&search).ok()?.get("lang")?)
}

fn kept() -> Option<&'static str> {
    locale::serving(&kept_storage()?.get_item(KEPT_AS).ok()??)
}

/// The first of the browser's languages that this page offers.
fn read() -> Option<&'static str> {
    window().navigator().languages().iter().find_map(|tag| locale::serving(&tag.as_string()?))
}

/// Restores or selects the language.
pub(super) fn begin() {
    if let Some(language) =
        asked().or_else(kept).or_else(read).filter(|language| *language != locale::FALLBACK)
    {
        send(FrameEvent::Language { language: language.to_owned() });
    }
}

/// Loads the table of `language`, saves the choice, and sets the document's language.
pub(super) fn speak(language: String) {
    spawn_local(async move {
        let there = locale::has(&language) || fetched(&language).await;
        if there {
            if let Some(storage) = kept_storage() {
                let _full_or_denied_is_no_harm = storage.set_item(KEPT_AS, &language);
            }
            if let Some(root) = window().document().and_then(|document| document.document_element()) {
                let _ = root.set_attribute("lang", locale::tag(&language));
            }
        }
        send(FrameEvent::Spoken { language, there });
    });
}

async fn fetched(language: &str) -> bool {
    let answer = request("GET", &format!("locales/{language}.toml"), &[], None).await;
    let text =
        answer.filter(|answer| answer.status == 200).and_then(|answer| String::from_utf8(answer.body).ok());
    text.is_some_and(|text| locale::install(language, &text))
}
