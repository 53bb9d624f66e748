//! Faults to inject into the virtual drill.
//!
//! ```text
//! ☑ The bit breaks                          after [ 2 ] holes        broken-bit
//! ☐ The cable to the machine is pulled      after [ 2 ] holes        cable-pulled
//! [Provoke these]  [Mend all]                 now: broken-bit@2
//! ```
//!
//! Injecting moves nothing. The machine must be homed afterwards.

use crate::i18n::{self, say, t};
use crate::page::{link, read, watch};
use crate::widgets::{push_if, tick};
use annulus_core::virtual_drill::faults::{self, FAULTS, FaultRow};
use annulus_core::wire::Ask;
use leptos::ev;
use leptos::html::{div, h3, input, label, li, p, section, span, ul};
use leptos::prelude::*;
use std::collections::BTreeMap;

type Chosen = BTreeMap<&'static str, u32>;

fn of_words(words: &[String]) -> Chosen {
    let rows = words.iter().filter_map(|word| faults::named(word).ok());
    rows.map(|(row, after)| (row.name, after)).collect()
}

fn in_words(chosen: &Chosen) -> Vec<String> {
    chosen.iter().map(|(name, after)| format!("{name}@{after}")).collect()
}

pub(super) fn faults() -> impl IntoView {
    let body = move || {
        if read(|m| m.link.faults.is_some()) {
            table().into_any()
        } else {
            p().class("quiet empty").child(t!("page.lab.faults.not_here")).into_any()
        }
    };
    div().class("lab-sheet").child((div(), div().class("lab-scroll").child(body)))
}

fn table() -> impl IntoView {
    let now = Memo::new(move |_| watch(|m| &m.link.faults).get().unwrap_or_default());
    let chosen = RwSignal::new(of_words(&now.get_untracked()));
    // The machine's report counts, even if another page changed it.
    Effect::new(move |_| chosen.set(of_words(&now.get())));
    let rows = FAULTS.iter().map(|fault| row(fault, chosen)).collect::<Vec<_>>();
    let provoke = move |words: Vec<String>| link::ask(Ask::Provoke { faults: words });
    section().class("faults").attr("aria-label", t!("page.lab.sheet.faults")).child((
        h3().child(t!("page.lab.faults.title")),
        p().class("quiet").child(t!("page.lab.faults.about")),
        ul().child(rows),
        div().class("row").child((
            push_if(
                "button primary",
                move || link::may_change() && chosen.get() != of_words(&now.get()),
                t!("page.lab.faults.provoke"),
                move |_| provoke(chosen.with_untracked(in_words)),
            ),
            push_if(
                "button",
                move || link::may_change() && now.with(|now| !now.is_empty()),
                t!("page.lab.faults.mend"),
                move |_| provoke(Vec::new()),
            ),
        )),
        p().attr("role", "status").child(move || in_force(&now.get())),
    ))
}

fn in_force(words: &[String]) -> String {
    if words.is_empty() {
        return say!("page.lab.faults.none");
    }
    let known = words.iter().filter_map(|word| faults::named(word).ok());
    let said: Vec<String> = known.map(|(fault, _)| i18n::text(&fault.sentence_key(), &[])).collect();
    say!("page.lab.faults.now", faults = said.join("; "))
}

fn row(fault: &'static FaultRow, chosen: RwSignal<Chosen>) -> impl IntoView {
    let name = fault.name;
    let is_on = move || chosen.with(|chosen| chosen.contains_key(name));
    let sentence = move || i18n::text(&fault.sentence_key(), &[]);
    let put = move |on| {
        chosen.update(|chosen| {
            if on {
                chosen.insert(name, fault.after);
            } else {
                chosen.remove(name);
            }
        });
    };
    let holes = input()
        .attr("type", "number")
        .attr("min", "0")
        .attr("max", "1000000")
        .prop("value", move || chosen.with(|chosen| chosen.get(name).copied().unwrap_or(fault.after)))
        .prop("disabled", move || !is_on())
        .on(ev::change, move |event| {
            let typed = format!("{name}@{}", event_target_value(&event).trim());
            if let Ok((_, after)) = faults::named(&typed) {
                chosen.update(|chosen| {
                    chosen.insert(name, after);
                });
            }
            // Replace a text that isn't a number of holes by the last valid number.
            let there = chosen.with_untracked(|chosen| chosen.get(name).copied().unwrap_or(fault.after));
            event_target::<web_sys::HtmlInputElement>(&event).set_value(&there.to_string());
        });
    li().child((
        tick(is_on, sentence, put),
        label().class("after").child((span().child(t!("page.lab.faults.after")), holes)),
    ))
}
