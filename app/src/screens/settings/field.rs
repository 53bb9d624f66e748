//! A field for one machine setting: name, unit, help with the setting's key, and why a typed value was rejected.

use crate::i18n::{self, t};
use crate::model::SettingsEvent;
use crate::page::{peek, send, shared, watch};
use crate::widgets::{keyboard, menu_word, refusal, typed_input};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::{Setting, Value, ValueKind, is_adapter_wiring, is_in_file_only};
use leptos::ev;
use leptos::html::{code, label, select, small, span};
use leptos::prelude::*;

fn id(setting: &Setting) -> String {
    format!("setting-{}", setting.key.replace('.', "-"))
}

fn shown(setting: &'static Setting) -> String {
    let typed = watch(|m| &m.settings).with(|draft| draft.typed.get(setting.key).cloned());
    typed.unwrap_or_else(|| match shared(|m| &m.machine).with(|machine| setting.value(machine)) {
        Value::Text(text) => text,
        numbers => i18n::number(numbers.to_string()),
    })
}

pub(crate) fn field(setting: &'static Setting, refused: Memo<Vec<Diagnostic>>) -> impl IntoView {
    let why = Memo::new(move |_| {
        let about = |diagnostic: &&Diagnostic| {
            diagnostic.args.iter().any(|(name, value)| name == "key" && value == setting.key)
        };
        refused.with(|diagnostics| diagnostics.iter().find(about).cloned())
    });
    let changed = move || watch(|m| &m.settings).with(|draft| draft.typed.contains_key(setting.key));
    // Name and help are read apart: the label would join them to one long name.
    let named = format!("{}-name", id(setting));
    let described = format!("{}-help", id(setting));
    let (name_id, help_id) = (named.clone(), described.clone());
    // A machine driven by this page alone has no settings file, so its wiring must be editable here.
    let own = peek(|m| m.link.controller.is_adapter);
    let fixed = is_in_file_only(setting.key) && !(own && is_adapter_wiring(setting.key));
    let write = move |text: String| send(SettingsEvent::Type { key: setting.key, text });
    let entry = match setting.kind {
        ValueKind::Choice(words) if !fixed => {
            let options = words
                .iter()
                .copied()
                .map(|word| menu_word(word, move || shown(setting) == word, move || word.to_owned()));
            select()
                .attr("id", id(setting))
                .attr("aria-labelledby", named)
                .attr("aria-describedby", described)
                .on(ev::change, move |event| write(event_target_value(&event)))
                .child(options.collect::<Vec<_>>())
                .into_any()
        }
        kind => typed_input(keyboard(kind), move || shown(setting), move || why.with(Option::is_some))
            .attr("id", id(setting))
            .prop("readOnly", fixed)
            .attr("aria-labelledby", named)
            .attr("aria-describedby", described)
            .on(ev::input, move |event| write(event_target_value(&event)))
            .into_any(),
    };
    let (name, help) = (setting.name_key(), setting.help_key());
    label()
        .class(move || if changed() { "setting changed" } else { "setting" })
        .attr("for", id(setting))
        .child((
            span().attr("id", name_id).child(move || i18n::text(&name, &[])),
            span().class("with-unit").child((entry, span().child(move || i18n::unit_of(setting.unit)))),
            small().attr("id", help_id).child((
                move || i18n::text(&help, &[]),
                " ",
                code().child(setting.key),
                fixed.then(|| span().child((". ", t!("page.settings.in_file")))),
            )),
            move || why.get().map(refusal),
        ))
}
