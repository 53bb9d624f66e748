//! Settings of the machine (A11): every field of the machine's table, staged, refused with a sentence, applied at once.
//!
//! ```text
//! field ─▶ draft (key → text) ─▶ changes ─▶ machine::apply ─▶ refusals beside their fields
//!                                                       └──▶ Apply ─▶ Ask::Configure
//! ```
//!
//! Comes in: the machine. Goes out: `Configure`. Knows no single setting: the table does.

mod clock;
mod field;

use crate::i18n::{self, key, message, say, t};
use crate::model::LinkEvent;
use crate::page::{frame, open_board};
use crate::page::{link, send};
use crate::screens::top_bar::{languages, theme_word, themes};
use crate::widgets::{push, push_if};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::{self, SECTIONS, Setting, Value, ValueKind};
use annulus_core::wire::Ask;
use leptos::ev;
use leptos::html::{button, dd, div, dl, dt, h2, label, nav, p, section, span};
use leptos::prelude::*;
use std::collections::BTreeMap;

/// What was typed and not applied, by key.
pub(crate) type Draft = RwSignal<BTreeMap<&'static str, String>>;

fn section_name(section: &str) -> &'static str {
    match section {
        "machine" => key!("page.settings.machine"),
        "card" => key!("page.settings.card"),
        "adapter" => key!("page.settings.adapter"),
        "x" => key!("page.settings.x"),
        "y" => key!("page.settings.y"),
        "z" => key!("page.settings.z"),
        "drive" => key!("page.settings.drive"),
        "motion" => key!("page.settings.motion"),
        "overlap" => key!("page.settings.overlap"),
        "stroke" => key!("page.settings.stroke"),
        "spindle" => key!("page.settings.spindle"),
        _ => key!("page.settings.rack"),
    }
}

/// What was typed, as a value of the setting; text that is no number stays text and is refused as such.
fn value(setting: &Setting, typed: &str) -> Value {
    match setting.kind {
        ValueKind::Text(_) | ValueKind::Choice(_) => Value::Text(typed.to_owned()),
        ValueKind::Number(..) | ValueKind::Whole(..) => {
            crate::format::typed(typed).map_or_else(|| Value::Text(typed.to_owned()), Value::Number)
        }
        ValueKind::Numbers(..) | ValueKind::Wholes(..) => {
            let words: Option<Vec<_>> = typed.split_whitespace().map(crate::format::typed).collect();
            words.map_or_else(|| Value::Text(typed.to_owned()), Value::Numbers)
        }
    }
}

/// What would change, in the order of the table.
fn changes(draft: &BTreeMap<&'static str, String>) -> Vec<(String, Value)> {
    let machine = open_board().machine.get();
    let staged = machine::settings().filter_map(|setting| {
        let value = value(setting, draft.get(setting.key)?);
        (value != setting.value(&machine)).then(|| (setting.key.to_owned(), value))
    });
    staged.collect()
}

fn refusals(draft: Draft) -> Vec<Diagnostic> {
    let changes = draft.with(changes);
    machine::apply(&open_board().machine.get(), &changes).err().unwrap_or_default()
}

/// The screen.
pub(crate) fn settings() -> impl IntoView {
    let draft: Draft = RwSignal::new(BTreeMap::new());
    let shown = RwSignal::new(SECTIONS[0].0);
    let refused = Memo::new(move |_| refusals(draft));
    let tabs = SECTIONS.iter().map(|(section, _)| {
        let this = *section;
        button()
            .attr("type", "button")
            .class("button quiet")
            .attr("aria-current", move || (shown.get() == this).then_some("true"))
            .on(ev::click, move |_| shown.set(this))
            .child(move || i18n::text(section_name(this), &[]))
    });
    let fields = move || {
        let rows =
            SECTIONS.iter().find(|(section, _)| *section == shown.get()).map_or(&[][..], |(_, rows)| rows);
        rows.iter().map(|setting| field::field(setting, draft, refused).into_any()).collect::<Vec<_>>()
    };
    div().class("whole").child(div().class("settings").child((
        nav().attr("aria-label", t!("page.settings.sections")).child((
            tabs.collect::<Vec<_>>(),
            label().class("field").child((span().child(t!("page.theme.title")), themes())),
            label().class("field").child((span().child(t!("page.language_title")), languages())),
        )),
        section().class("page").attr("aria-label", t!("page.settings.title")).child((
            h2().child(move || i18n::text(section_name(shown.get()), &[])),
            p().class("quiet").child(t!("page.settings.about")),
            refused_by_bridge(),
            div().class("setting-grid").child(fields),
            move || (shown.get() == "card").then(clock::clock),
            diff(draft, refused),
        )),
    )))
}

/// Why the bridge did not take the last wish.
fn refused_by_bridge() -> impl IntoView {
    let refused = link::link().refused;
    move || refused.get().map(|why| p().class("refusal").attr("role", "alert").child(message(&why)))
}

fn apply(draft: Draft) {
    send(LinkEvent::Close { notice: link::Notice::Refused });
    link::ask(Ask::Configure { changes: draft.with_untracked(changes) });
    draft.set(BTreeMap::new());
}

/// What will change, and the two buttons. Refused while the machine moves, and then it says so.
fn diff(draft: Draft, refused: Memo<Vec<Diagnostic>>) -> impl IntoView {
    let line = link::link();
    let staged = Memo::new(move |_| draft.with(changes));
    let list = move || {
        let machine = open_board().machine.get();
        let rows = staged.get().into_iter().map(|(key, value)| {
            let old =
                machine::setting(&key).map(|setting| setting.value(&machine).to_string()).unwrap_or_default();
            (dt().child(key), dd().child(move || say!("page.settings.change", old = old, new = value)))
        });
        rows.collect::<Vec<_>>()
    };
    let may = move || refused.with(Vec::is_empty) && line.may_act() && !line.busy();
    let why = move || {
        if !line.may_act() {
            Some(say!("page.settings.needs_control"))
        } else if line.busy() {
            Some(say!("page.settings.moving"))
        } else {
            None
        }
    };
    move || {
        (!staged.with(Vec::is_empty)).then(|| {
            div()
                .class("diff-bar")
                .attr("role", "group")
                .attr("aria-label", t!("page.settings.changes"))
                .child((
                    dl().class("facts grow").child(list),
                    p().class("quiet").child(why),
                    push("button", t!("page.settings.discard"), move |_| draft.set(BTreeMap::new())),
                    push_if("button primary", may, t!("page.settings.apply"), move |_| apply(draft)),
                ))
        })
    }
}

/// The chosen colours over a reload, and on the root of the page.
pub(crate) fn keep_theme() {
    let theme = frame().theme;
    Effect::new(move |_| {
        let word = theme_word(theme.get());
        let root = document().document_element();
        if let Some(root) = root {
            let _ = if word == "auto" {
                root.remove_attribute("data-theme")
            } else {
                root.set_attribute("data-theme", word)
            };
        }
        if let Ok(Some(storage)) = window().local_storage() {
            let _ = storage.set_item("annulus.theme", word);
        }
    });
}

/// The colours chosen last time.
pub(crate) fn kept_theme() -> Option<String> {
    window().local_storage().ok()??.get_item("annulus.theme").ok()?
}
