//! Machine settings: every field of the machine's table; changes are collected, checked, and applied
//! together.

mod controller;
mod field;
mod keys;
mod lengths;
mod own;
mod tools;

use crate::i18n::{self, message, say, t};
use crate::model::address::OWN_SECTIONS;
use crate::model::{FrameEvent, SettingsEvent};
use crate::page::{read, send, shared, watch};
use crate::widgets::{change_bar, refusal_text, tick};
use annulus_core::control::lateness::EDGES_US;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::{SECTIONS, Value, ValueKind};
use leptos::ev;
use leptos::html::{button, div, h2, h3, nav, p, section, span, table, tbody, td, th, thead, tr};
use leptos::prelude::*;

fn section_name(section: &str) -> String {
    own::name(section)
        .map_or_else(|| i18n::text(&format!("page.section.{section}"), &[]), |key| i18n::text(key, &[]))
}

fn changes() -> Vec<(String, Value)> {
    let machine = shared(|m| &m.machine).get();
    watch(|m| &m.settings).with(|draft| draft.changes(&machine))
}

pub(crate) fn settings() -> impl IntoView {
    let shown = watch(|m| &m.frame.section);
    let refused = Memo::new(move |_| {
        let machine = shared(|m| &m.machine).get();
        watch(|m| &m.settings).with(|draft| draft.refusals(&machine))
    });
    let [general, others @ ..] = OWN_SECTIONS;
    let of_machine = SECTIONS.iter().map(|(section, _)| *section);
    let tabs = [general].into_iter().chain(of_machine).chain(others).map(|this| {
        button()
            .attr("type", "button")
            .class("button quiet")
            .attr("aria-current", move || (shown.get() == this).then_some("true"))
            .on(ev::click, move |_| send(FrameEvent::Section { section: this }))
            .child(move || section_name(this))
    });
    let plans = move || read(|m| m.link.controller.plans());
    let fields = move || {
        let rows =
            SECTIONS.iter().find(|(section, _)| *section == shown.get()).map_or(&[][..], |(_, rows)| rows);
        let shown = rows.iter().filter(|setting| setting.kind != ValueKind::Tools);
        shown.map(|setting| field::field(setting, refused).into_any()).collect::<Vec<_>>()
    };
    let own = Memo::new(move |_| Some(shown.get()).filter(|section| own::name(section).is_some()));
    div().class("whole").child(div().class("settings").child((
        nav().attr("aria-label", t!("page.settings.sections")).child(tabs.collect::<Vec<_>>()),
        section().class("page").attr("aria-label", t!("page.settings.title")).child((
            h2().child(move || section_name(shown.get())),
            move || own.get().map(own::body),
            move || own.get().is_none().then(|| p().class("quiet").child(t!("page.settings.about"))),
            refused_by_bridge(),
            move || (shown.get() == "machine" && plans()).then(of_controller),
            move || (shown.get() == "rack").then(|| tools::tools(refused)),
            move || own.get().is_none().then(|| div().class("setting-grid").child(fields())),
            move || ["card", "parallel"].contains(&shown.get()).then(clock),
            diff(refused),
        )),
    )))
}

fn of_controller() -> impl IntoView {
    (controller::mill(), lengths::lengths(), controller::changer(), controller::opening())
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
