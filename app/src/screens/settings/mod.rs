//! Machine settings: every field of the machine's table in groups, with a search; changes are collected,
//! checked, and applied together.

mod area;
mod controller;
mod field;
mod groups;
mod keys;
mod lengths;
mod names;
mod own;
mod search;
mod tools;

use crate::i18n::{message, say, t};
use crate::model::address::{PAGE_GROUP, group_of};
use crate::model::{FrameEvent, SettingsEvent};
use crate::page::{read, send, shared, watch};
use crate::widgets::{change_bar, refusal_text, tick};
use annulus_core::control::lateness::EDGES_US;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::{Group, Value};
use leptos::ev;
use leptos::html::{button, div, h3, nav, p, section, span, table, tbody, td, th, thead, tr};
use leptos::prelude::*;

fn changes() -> Vec<(String, Value)> {
    let machine = shared(|m| &m.machine).get();
    let who = shared(|m| &m.link.controller.who).get();
    watch(|m| &m.settings).with(|draft| draft.all_changes(&machine, who.as_deref()))
}

pub(crate) fn settings() -> impl IntoView {
    let refused = Memo::new(move |_| {
        let machine = shared(|m| &m.machine).get();
        watch(|m| &m.settings).with(|draft| draft.refusals(&machine))
    });
    let sought = Memo::new(move |_| watch(|m| &m.settings).with(|draft| draft.sought.trim().to_owned()));
    let is_seeking = Memo::new(move |_| sought.with(|sought| !sought.is_empty()));
    let body = move || {
        if is_seeking.get() {
            search::found(sought, refused).into_any()
        } else {
            groups::group(refused).into_any()
        }
    };
    let tabs = Group::ALL.into_iter().map(Some).chain([None]).map(|group| tab(group, is_seeking).into_any());
    div().class("whole").child(
        div().class("settings").child((
            nav()
                .attr("aria-label", t!("page.settings.sections"))
                .child((search::search(), div().class("groups").child(tabs.collect::<Vec<_>>()))),
            section().class("page").attr("aria-label", t!("page.settings.title")).child((
                refused_by_bridge(),
                body,
                diff(refused),
            )),
        )),
    )
}

/// The button of a group; `None` for the page's own settings. A controller that plans its own motion has no
/// wiring.
fn tab(group: Option<Group>, is_seeking: Memo<bool>) -> impl IntoView {
    let shown = watch(|m| &m.frame.section);
    let is_shown = move || !is_seeking.get() && group_of(shown.get()) == group;
    let section = group.map_or(PAGE_GROUP, Group::word);
    let button = move || {
        button()
            .attr("type", "button")
            .class("button quiet")
            .attr("aria-current", move || is_shown().then_some("true"))
            .on(ev::click, move |_| {
                send(FrameEvent::Section { section });
                search::seek(String::new());
            })
            .child(move || names::group_name(group))
    };
    let has = move || group != Some(Group::Wiring) || !read(|m| m.link.controller.plans());
    move || has().then(button)
}

/// Whether character keys work as shortcuts without a modifier.
fn signs() -> impl IntoView {
    let signs = || read(|m| m.frame.signs);
    div().class("field signs").child((
        span().child(t!("page.settings.signs")),
        tick(signs, t!("page.settings.signs_alone"), |on| send(FrameEvent::Signs { on })),
        p().class("quiet").child(t!("page.settings.signs_about")),
        keys::own_keys(),
    ))
}

fn refused_by_bridge() -> impl IntoView {
    let refused = watch(|m| &m.link.refused);
    move || refused.get().map(|why| refusal_text(message(&why)))
}

/// The bar of pending changes; what refuses them is shown next to the fields.
fn diff(refused: Memo<Vec<Diagnostic>>) -> impl IntoView {
    let staged = Memo::new(move |_| changes());
    change_bar(
        staged,
        |_, value| value.to_string(),
        move || refused.with(Vec::is_empty),
        || None,
        || send(SettingsEvent::Discard),
        || send(SettingsEvent::Apply),
    )
}

/// Timing quality of the bridge's clock on a real machine: text, and the histogram as a table. Nothing for a
/// virtual drill or without a bridge.
fn clock() -> impl IntoView {
    let timing = shared(|m| &m.link.timing);
    move || {
        timing.get().map(|timing| {
            let sentence = |found| p().child(move || message(&found));
            let sentences: Vec<_> = timing.diagnostics().into_iter().map(sentence).collect();
            let last = timing.lateness.bars.iter().rposition(|count| *count > 0).unwrap_or(0);
            let row = |(index, count): (usize, &u32)| {
                let edge = EDGES_US.get(index).copied();
                let late = move || match edge {
                    Some(us) => say!("page.settings.clock_edge", us = us),
                    None => say!("page.settings.clock_later"),
                };
                tr().child((th().attr("scope", "row").child(late), td().child(count.to_string())))
            };
            let rows: Vec<_> = timing.lateness.bars.iter().take(last + 1).enumerate().map(row).collect();
            let head = tr().child((
                th().attr("scope", "col").child(t!("page.settings.clock_late")),
                th().attr("scope", "col").child(t!("page.settings.clock_beats")),
            ));
            let bars = table().child((thead().child(head), tbody().child(rows)));
            (h3().child(t!("page.settings.clock")), sentences, bars)
        })
    }
}
