//! Custom keyboard shortcuts: a list of commands, each with the character that runs it.

use crate::i18n::{self, key, say, t};
use crate::keys::{SHORTCUTS, Shortcut, is_of_ones_own};
use crate::model::FrameEvent;
use crate::page::{read, send, watch, written};
use crate::screens::top_bar::name_of;
use crate::widgets::push_if;
use leptos::ev;
use leptos::html::{details, div, input, label, p, span, summary};
use leptos::prelude::*;

fn name(shortcut: &Shortcut) -> String {
    let does = i18n::text(shortcut.name, &[]);
    match shortcut.tab {
        Some(tab) => say!("page.settings.key_on", screen = name_of(tab), does = does),
        None => does,
    }
}

fn row(shortcut: &'static Shortcut) -> impl IntoView {
    let sign = move || written(shortcut);
    let field = input()
        .attr("type", "text")
        .attr("maxlength", "1")
        .attr("autocomplete", "off")
        .class("tabular")
        .prop("value", sign)
        .on(ev::focus, |event| event_target::<web_sys::HtmlInputElement>(&event).select())
        .on(ev::change, move |event| {
            send(FrameEvent::OwnKey { shortcut, sign: event_target_value(&event) });
            // Replace a rejected character by the one in use.
            let there = untrack(|| written(shortcut));
            event_target::<web_sys::HtmlInputElement>(&event).set_value(&there);
        });
    label().class("own-key").child((span().child(move || name(shortcut)), field))
}

fn refused() -> impl IntoView {
    let text = |(sign, by): (String, Option<&'static Shortcut>)| match by {
        Some(other) => say!("page.settings.key_taken", sign = sign.to_uppercase(), does = name(other)),
        None => i18n::text(key!("page.settings.key_kept"), &[]),
    };
    move || {
        let why = watch(|m| &m.frame.own_key_refused).get()?;
        Some(p().class("refusal").attr("role", "alert").child(move || text(why.clone())))
    }
}

pub(super) fn own_keys() -> impl IntoView {
    let rows = SHORTCUTS.iter().filter(|shortcut| is_of_ones_own(shortcut)).map(row).collect::<Vec<_>>();
    let moved = move || read(|m| !m.frame.own_keys.is_empty());
    let back =
        push_if("button small", moved, t!("page.settings.keys_back"), |_| send(FrameEvent::OwnKeysForgotten));
    details().child((
        summary().child(t!("page.settings.own_keys")),
        p().class("quiet").child(t!("page.settings.own_keys_about")),
        refused(),
        div().class("own-keys").child(rows),
        back,
    ))
}
