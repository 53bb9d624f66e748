//! What the user prefers, saved for the next visit: language, colour scheme, shortcuts, panel widths, machine.
//!
//! ```text
//! ?lang=pl │ chosen last time │ the browser's languages ─▶ FrameEvent::Language ─▶ locales/pl.toml ─▶ Spoken
//! ```
//!
//! English is built in. Other languages are separate files, so that only a page that uses one loads it. The
//! service worker caches them for offline use like other files of the site.

use crate::browser::{kept_storage, request, window};
use crate::model::{FrameEvent, MachineEvent, Theme};
use crate::page::send;
use annulus_core::locale;
use leptos::task::spawn_local;
use web_sys::{Element, UrlSearchParams};

const LANGUAGE: &str = "annulus.language";
const THEME: &str = "annulus.theme";
const SIGNS_OFF: &str = "annulus.signs_off";
const OWN_KEYS: &str = "annulus.own_keys";
const PANELS: &str = "annulus.panels";
const MACHINES: &str = "annulus.machines";

/// Restores or selects the language, and restores the other choices of the last visit.
pub(super) fn begin() {
    let kept_language = || locale::serving(&kept(LANGUAGE)?);
    if let Some(language) =
        asked().or_else(kept_language).or_else(read).filter(|language| *language != locale::FALLBACK)
    {
        send(FrameEvent::Language { language: language.to_owned() });
    }
    if let Some(word) = kept(THEME) {
        send(FrameEvent::Colours { theme: Theme::called(&word) });
    }
    if kept(SIGNS_OFF).is_some() {
        send(FrameEvent::Signs { on: false });
    }
    if let Some(text) = kept(OWN_KEYS) {
        send(FrameEvent::OwnKeysKept { text });
    }
    if let Some(text) = kept(PANELS) {
        send(FrameEvent::PanelsKept { text });
    }
    if let Some(text) = kept(MACHINES) {
        send(MachineEvent::Kept { text });
    }
    if let Some(name) = in_address("machine") {
        send(MachineEvent::Linked { name });
    }
}

fn asked() -> Option<&'static str> {
    locale::serving(&in_address("lang")?)
}

/// The value of `name` in the page's address.
fn in_address(name: &str) -> Option<String> {
    let search = window().location().search().ok()?;
    UrlSearchParams::new_with_str(&search).ok()?.get(name)
}

/// The first of the browser's languages that this page offers.
fn read() -> Option<&'static str> {
    window().navigator().languages().iter().find_map(|tag| locale::serving(&tag.as_string()?))
}

/// Loads the table of `language`, saves the choice, and sets the document's language.
pub(super) fn speak(language: String) {
    spawn_local(async move {
        let there = locale::has(&language) || fetched(&language).await;
        if there {
            put(LANGUAGE, &language);
            if let Some(root) = root() {
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

/// Applies the colour scheme `word`, as an attribute of the root element for the style sheet, and saves it.
pub(super) fn show_colours(word: &str) {
    if let Some(root) = root() {
        let _ = if word == Theme::Auto.word() {
            root.remove_attribute("data-theme")
        } else {
            root.set_attribute("data-theme", word)
        };
    }
    put(THEME, word);
}

/// Saves whether shortcuts of a single character are on.
pub(super) fn keep_signs(on: bool) {
    put(SIGNS_OFF, if on { "" } else { "1" });
}

pub(super) fn keep_own_keys(text: &str) {
    put(OWN_KEYS, text);
}

pub(super) fn keep_machines(text: &str) {
    put(MACHINES, text);
}

pub(super) fn keep_panels(text: &str) {
    put(PANELS, text);
}

fn root() -> Option<Element> {
    window().document()?.document_element()
}

fn kept(name: &str) -> Option<String> {
    kept_storage()?.get_item(name).ok()?
}

/// Saves a text; deletes an empty one.
fn put(name: &str, text: &str) {
    if let Some(storage) = kept_storage() {
        let _full_or_denied_is_no_harm =
            if text.is_empty() { storage.remove_item(name) } else { storage.set_item(name, text) };
    }
}
