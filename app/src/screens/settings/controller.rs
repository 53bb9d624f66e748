//! Settings of a controller, stored per machine: the tool change macro, the machine profile, and what opening
//! the port may do. Staged like the machine's own settings. Moves nothing.

use crate::i18n::{Words, say, t};
use crate::model::SettingsEvent;
use crate::page::{send, shared, watch};
use crate::widgets::menu_word;
use annulus_core::grbl::{CHANGER_KEY, RESET_KEY, ResetOnOpen, TOOL_MARK};
use annulus_core::machine::{MILL_KEY, MILLS};
use leptos::ev;
use leptos::html::{code, label, select, small, span, textarea};
use leptos::prelude::*;

/// Text of a setting of the controller: as typed, else its present value.
pub(super) fn own_text(key: &'static str) -> String {
    let who = shared(|m| &m.link.controller.who).get();
    watch(|m| &m.settings).with(|draft| draft.own_text(who.as_deref(), key))
}

pub(super) fn stage(key: &'static str, text: String) {
    send(SettingsEvent::Type { key, text });
}

/// Ids of a setting's control, name and help.
fn ids(key: &str) -> [String; 3] {
    let id = format!("setting-{}", key.replace('.', "-"));
    [format!("{id}-name"), format!("{id}-help"), id]
}

/// A control with its name and help, marked while its value is not applied.
fn labelled(key: &'static str, name: Words, help: Words, entry: AnyView) -> AnyView {
    let [name_id, help_id, id] = ids(key);
    let changed = move || watch(|m| &m.settings).with(|draft| draft.typed.contains_key(key));
    label()
        .class(move || if changed() { "setting changed" } else { "setting" })
        .attr("for", id)
        .child((
            span().attr("id", name_id).child(name),
            entry,
            small().attr("id", help_id).child((help, " ", code().child(key))),
        ))
        .into_any()
}

/// A menu for a setting of the controller.
pub(super) fn menu(key: &'static str, name: Words, help: Words, words: Vec<AnyView>) -> AnyView {
    let [name_id, help_id, id] = ids(key);
    let entry = select()
        .attr("id", id)
        .attr("aria-labelledby", name_id)
        .attr("aria-describedby", help_id)
        .on(ev::change, move |event| stage(key, event_target_value(&event)))
        .child(words);
    labelled(key, name, help, entry.into_any())
}

/// The tool change macro; empty if the user changes tools.
pub(super) fn changer() -> impl IntoView {
    let [name_id, help_id, id] = ids(CHANGER_KEY);
    let entry = textarea()
        .attr("id", id)
        .attr("rows", "4")
        .attr("spellcheck", "false")
        .attr("placeholder", "M6 T{tool}")
        .attr("aria-labelledby", name_id)
        .attr("aria-describedby", help_id)
        .prop("value", move || own_text(CHANGER_KEY))
        .on(ev::input, move |event| stage(CHANGER_KEY, event_target_value(&event)));
    let help: Words = Box::new(|| say!("page.changer.is", mark = TOOL_MARK));
    labelled(CHANGER_KEY, t!("page.changer.title"), help, entry.into_any())
}

/// The machine profile: the controller's own settings are compared with it before a job. Changes nothing in
/// the controller.
pub(super) fn mill() -> impl IntoView {
    let now = move || own_text(MILL_KEY);
    let none = menu_word("", move || now().is_empty(), t!("page.settings.mill_none")).into_any();
    let mills = MILLS.iter().map(|mill| {
        menu_word(mill.name, move || now() == mill.name, move || mill.title.to_owned()).into_any()
    });
    let words = std::iter::once(none).chain(mills).collect();
    menu(MILL_KEY, t!("page.settings.mill"), t!("page.settings.mill_about"), words)
}

/// Whether opening the port may reset the controller: most do, some must not. Applies from the next opening.
pub(super) fn opening() -> impl IntoView {
    let word = |word: ResetOnOpen, text: Words| {
        menu_word(word.word(), move || own_text(RESET_KEY) == word.word(), text).into_any()
    };
    let words = vec![
        word(ResetOnOpen::Usual, t!("page.opening.usual")),
        word(ResetOnOpen::Never, t!("page.opening.never")),
    ];
    menu(RESET_KEY, t!("page.opening.title"), t!("page.opening.is"), words)
}
