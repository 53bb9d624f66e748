//! One group of settings: its sections, advanced settings folded, then what the machine doesn't have.

use super::names::{group_name, section_name};
use super::{area, clock, controller, field, lengths, own, tools};
use crate::i18n::{say, t};
use crate::model::address::group_of;
use crate::model::settings::{Part, parts};
use crate::page::{read, shared, watch};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::{self, Group};
use leptos::html::{details, div, h2, h3, p, summary};
use leptos::prelude::*;

type Refused = Memo<Vec<Diagnostic>>;

pub(super) fn group(refused: Refused) -> impl IntoView {
    let section = watch(|m| &m.frame.section);
    let shown = Memo::new(move |_| group_of(section.get()));
    move || match shown.get() {
        Some(group) => of_machine(group, refused).into_any(),
        None => own::page().into_any(),
    }
}

fn of_machine(group: Group, refused: Refused) -> impl IntoView {
    let plans = Memo::new(|_| read(|m| m.link.controller.plans()));
    let layout = Memo::new(move |_| {
        let plans = plans.get();
        shared(|m| &m.machine).with(|machine| parts(group, machine, plans))
    });
    (
        h2().child(move || group_name(Some(group))),
        p().class("quiet").child(t!("page.settings.about")),
        (group == Group::Machine).then(area::area),
        move || plans.get().then(|| of_controller(group, refused)),
        move || sections(layout.get(), refused),
    )
}

/// The settings of a controller that plans its own motion.
fn of_controller(group: Group, refused: Refused) -> AnyView {
    match group {
        Group::Machine => {
            div().class("setting-grid").child((controller::mill(), controller::opening())).into_any()
        }
        Group::Tools => controller::changer().into_any(),
        Group::Probing => lengths::lengths(refused).into_any(),
        _ => ().into_any(),
    }
}

fn sections(parts: Vec<Part>, refused: Refused) -> AnyView {
    let (used, unused): (Vec<_>, Vec<_>) = parts.into_iter().partition(|part| part.is_used);
    let used = used.into_iter().map(|part| of_section(part, refused)).collect::<Vec<_>>();
    let rest = (!unused.is_empty()).then(|| folded_sections(unused, refused));
    (used, rest).into_any()
}

fn of_section(part: Part, refused: Refused) -> AnyView {
    let Part { section, rows, advanced, .. } = part;
    let more = (!advanced.is_empty()).then(|| {
        let open = needs_attention(advanced.clone(), refused);
        details()
            .class("folded")
            .prop("open", move || open.get())
            .child((summary().child(t!("page.settings.advanced")), grid(advanced, refused)))
    });
    div()
        .class("setting-part")
        .child((
            h3().child(move || section_name(section)),
            (section == "rack").then(|| tools::tools(refused)),
            (!rows.is_empty()).then(|| grid(rows, refused)),
            more,
            ["card", "parallel"].contains(&section).then(clock),
        ))
        .into_any()
}

/// The sections that the machine doesn't have: one of their settings may turn them on.
fn folded_sections(parts: Vec<Part>, refused: Refused) -> AnyView {
    let sections: Vec<_> = parts.iter().map(|part| part.section).collect();
    let keys = parts.iter().flat_map(|part| part.rows.iter().chain(&part.advanced)).copied().collect();
    let open = needs_attention(keys, refused);
    let names = move || sections.iter().map(|section| section_name(section)).collect::<Vec<_>>().join(", ");
    let all = parts.into_iter().map(|part| of_section(part, refused)).collect::<Vec<_>>();
    details()
        .class("folded unused")
        .prop("open", move || open.get())
        .child((summary().child(move || say!("page.settings.unused", names = names())), all))
        .into_any()
}

/// True while one of the settings has a change or a refusal, so that it must be seen.
fn needs_attention(keys: Vec<&'static str>, refused: Refused) -> Memo<bool> {
    Memo::new(move |_| {
        refused.with(|refused| watch(|m| &m.settings).with(|draft| draft.concerns(refused, &keys)))
    })
}

fn grid(keys: Vec<&'static str>, refused: Refused) -> impl IntoView {
    let settings = keys.into_iter().filter_map(machine::setting);
    let fields = settings.map(|setting| field::field(setting, refused));
    div().class("setting-grid").child(fields.collect::<Vec<_>>())
}
