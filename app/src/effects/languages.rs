//! The language of the page: found at the first visit, fetched when it is chosen, kept for the next time.
//!
//! ```text
//! ?lang=pl │ chosen last time │ what the browser reads ─▶ FrameEvent::Language ─▶ locales/pl.toml ─▶ Spoken
//! ```
//!
//! English is part of the page. The others lie beside it as the files they were written in: nobody waits for a language that is
//! not read, and what keeps the page for use without a net keeps them like any other file of it.
//!
//! Comes in: the address, the browser, a choice. Goes out: the table, as an event. Does not know the words.

use crate::browser::{kept_storage, request, window};
use crate::model::FrameEvent;
use crate::page::send;
use annulus_core::locale;
use leptos::task::spawn_local;
use web_sys::UrlSearchParams;

const KEPT_AS: &str = "annulus.language";

/// The language that the address asks for.
fn asked() -> Option<&'static str> {
    let search = window().location().search().ok()?;
    locale::serving(&UrlSearchParams::new_with_str(&search).ok()?.get("lang")?)
}

fn kept() -> Option<&'static str> {
    locale::serving(&kept_storage()?.get_item(KEPT_AS).ok()??)
}

/// The first of the languages that the browser's person reads and this page speaks.
fn read() -> Option<&'static str> {
    window().navigator().languages().iter().find_map(|tag| locale::serving(&tag.as_string()?))
}

/// Begins with the language of this person.
pub(super) fn begin() {
    if let Some(language) =
        asked().or_else(kept).or_else(read).filter(|language| *language != locale::FALLBACK)
    {
        send(FrameEvent::Language { language: language.to_owned() });
    }
}

/// Has the table of `language`, keeps the choice, and tells the browser what the page is read in.
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
