//! A field for one machine setting: name, unit, help with the setting's key, and why a typed value was rejected.

use crate::i18n::{self, t};
use crate::model::SettingsEvent;
use crate::model::settings::is_about;
use crate::page::{peek, send, shared, watch};
use crate::widgets::{keyboard, menu_word, refusal, tick, typed_input};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::{Setting, Value, ValueKind, is_adapter_wiring, is_in_file_only};
use leptos::ev;
use leptos::html::{code, div, label, select, small, span};
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

/// Whether each spindle drills. The value has one number for each; a missing one means that it does.
const SPINDLES: &str = "spindle.enabled";

fn class(key: &'static str) -> &'static str {
    let changed = watch(|m| &m.settings).with(|draft| draft.typed.contains_key(key));
    if changed { "setting changed" } else { "setting" }
}

/// A checkbox for each spindle.
fn spindles(setting: &'static Setting, why: Memo<Option<Diagnostic>>) -> AnyView {
    let count = Memo::new(|_| shared(|m| &m.machine).with(|machine| machine.spindles as usize));
    let is_on = move |spindle: usize| shown(setting).split_whitespace().nth(spindle) != Some("0");
    let set = move |spindle: usize, on: bool| {
        let one = |other: usize| {
            if untrack(|| if other == spindle { on } else { is_on(other) }) { "1" } else { "0" }
        };
        let text = (0..count.get_untracked()).map(one).collect::<Vec<_>>().join(" ");
        send(SettingsEvent::Type { key: setting.key, text });
    };
    let ticks = move || {
        let one = |spindle| {
            tick(move || is_on(spindle), move || format!("Z{}", spindle + 1), move |on| set(spindle, on))
                .into_any()
        };
        (0..count.get()).map(one).collect::<Vec<_>>()
    };
    let (name, help) = (setting.name_key(), setting.help_key());
    let (name_id, help_id) = (format!("{}-name", id(setting)), format!("{}-help", id(setting)));
    div()
        .class(move || class(setting.key))
        .attr("role", "group")
        .attr("aria-labelledby", name_id.clone())
        .attr("aria-describedby", help_id.clone())
        .child((
            span().attr("id", name_id).child(move || i18n::text(&name, &[])),
            div().class("row").child(ticks),
            small().attr("id", help_id).child((
                move || i18n::text(&help, &[]),
                " ",
                code().child(setting.key),
            )),
            move || why.get().map(refusal),
        ))
        .into_any()
}

pub(crate) fn field(setting: &'static Setting, refused: Memo<Vec<Diagnostic>>) -> AnyView {
    let why = Memo::new(move |_| {
        refused.with(|diagnostics| diagnostics.iter().find(|why| is_about(why, setting.key)).cloned())
    });
    if setting.key == SPINDLES {
        return spindles(setting, why);
    }
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
        .class(move || class(setting.key))
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
        .into_any()
}
