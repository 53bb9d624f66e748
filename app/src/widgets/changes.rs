//! The bar of changes to the machine: each with its old and new value, why they can't be applied, and two
//! buttons.

use super::{push, push_if};
use crate::i18n::{self, say, t};
use crate::model::settings::own_value;
use crate::page::{link, shared};
use annulus_core::grbl::{CHANGER_KEY, LENGTH_KEY, RESET_KEY, SETTER_KEY};
use annulus_core::machine::{self, MILL_KEY, Value};
use leptos::html::{dd, div, dl, dt, p};
use leptos::prelude::*;

/// The bar; hidden without changes. Disabled while the machine moves, with a text that explains it.
///
/// `may` is true if nothing refuses the changes; `refused` is what the bar shows about that.
pub fn change_bar(
    staged: Memo<Vec<(String, Value)>>,
    written: fn(&str, &Value) -> String,
    may: impl Fn() -> bool + Copy + Send + Sync + 'static,
    refused: impl Fn() -> Option<String> + Copy + Send + Sync + 'static,
    discard: fn(),
    apply: impl Fn() + Copy + Send + 'static,
) -> impl IntoView {
    let why = move || {
        refused().or_else(|| {
            if !link::may_act() {
                Some(say!("page.settings.needs_control"))
            } else if link::busy() {
                Some(say!("page.settings.moving"))
            } else {
                None
            }
        })
    };
    let may = move || may() && link::may_change();
    move || {
        (!staged.with(Vec::is_empty)).then(|| {
            div()
                .class("diff-bar")
                .attr("role", "group")
                .attr("aria-label", t!("page.settings.changes"))
                .child((
                    dl().class("facts grow").attr("tabindex", "0").child(move || rows(staged.get(), written)),
                    p().class("quiet").attr("role", "status").child(why),
                    push("button", t!("page.settings.discard"), move |_| discard()),
                    push_if("button primary", may, t!("page.settings.apply"), move |_| apply()),
                ))
        })
    }
}

/// The changes, row by row: old and new value.
fn rows(staged: Vec<(String, Value)>, written: fn(&str, &Value) -> String) -> Vec<AnyView> {
    let machine = shared(|m| &m.machine).get();
    let who = shared(|m| &m.link.controller.who).get();
    let rows = staged.into_iter().map(|(key, value)| {
        let before = match machine::setting(&key) {
            Some(setting) => Some(setting.value(&machine)),
            None => who.as_deref().map(|who| own_value(who, &key)),
        };
        let (old, new) = match (before, value) {
            (Some(Value::Texts(old)), Value::Texts(new)) => (others(&old, &new), others(&new, &old)),
            (before, value) => {
                (before.map(|old| written(&key, &old)).unwrap_or_default(), written(&key, &value))
            }
        };
        let change = dd().child(move || say!("page.settings.change", old = old, new = new));
        (dt().child(move || name_of(&key)), change).into_any()
    });
    rows.collect()
}

/// The name of a setting, with that of its section.
fn name_of(key: &str) -> String {
    if let Some(setting) = machine::setting(key) {
        let section = key.split_once('.').map_or(key, |(section, _)| section);
        let section = i18n::text(&format!("page.section.{section}"), &[]);
        return say!(
            "page.settings.change_of",
            section = section,
            name = i18n::text(&setting.name_key(), &[])
        );
    }
    match key {
        MILL_KEY => say!("page.settings.mill"),
        LENGTH_KEY => say!("page.lengths.title"),
        SETTER_KEY => say!("page.lengths.setter"),
        CHANGER_KEY => say!("page.changer.title"),
        RESET_KEY => say!("page.opening.title"),
        _ => key.to_owned(),
    }
}

/// The lines of a list that another list doesn't have.
fn others(lines: &[String], than: &[String]) -> String {
    let others = lines.iter().filter(|line| !than.contains(line)).map(String::as_str);
    let others = others.collect::<Vec<_>>().join(", ");
    if others.is_empty() { "–".to_owned() } else { others }
}
