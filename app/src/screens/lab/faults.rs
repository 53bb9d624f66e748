//! What can be broken of the virtual drill on demand: provoke, observe, explain (N20).
//!
//! ```text
//! ☑ The bit breaks                          after [ 2 ] holes        broken-bit
//! ☐ The cable to the machine is pulled      after [ 2 ] holes        cable-pulled
//! [Provoke these]  [None]                   now: broken-bit@2
//! ```
//!
//! Comes in: the table of faults, those that the machine has. Goes out: the wish for others. Nothing moves; the machine is to be
//! homed afterwards. Does not know what a fault does.

use crate::i18n::{self, say, t};
use crate::page::link::{self, Link};
use crate::widgets::push_if;
use annulus_core::virtual_drill::faults::{self, FAULTS, FaultRow};
use annulus_core::wire::Ask;
use leptos::ev;
use leptos::html::{div, h3, input, label, li, p, section, span, ul};
use leptos::prelude::*;
use std::collections::BTreeMap;

/// After how many holes each chosen fault comes, by its name.
type Chosen = BTreeMap<&'static str, u32>;

fn of_words(words: &[String]) -> Chosen {
    let rows = words.iter().filter_map(|word| faults::named(word).ok());
    rows.map(|(row, after)| (row.name, after)).collect()
}

fn in_words(chosen: &Chosen) -> Vec<String> {
    chosen.iter().map(|(name, after)| format!("{name}@{after}")).collect()
}

/// The sheet.
pub(super) fn faults() -> impl IntoView {
    let line = link::link();
    let has = Memo::new(move |_| line.faults.with(Option::is_some));
    let body = move || {
        if has.get() {
            table(line).into_any()
        } else {
            p().class("quiet empty").child(t!("page.lab.faults.not_here")).into_any()
        }
    };
    div().class("lab-sheet").child((div(), div().class("lab-scroll").child(body)))
}

fn table(line: Link) -> impl IntoView {
    let now = Memo::new(move |_| line.faults.get().unwrap_or_default());
    let chosen = RwSignal::new(of_words(&now.get_untracked()));
    // What the machine says counts, also where another page said it.
    Effect::new(move |_| chosen.set(of_words(&now.get())));
    let rows = FAULTS.iter().map(|fault| row(fault, chosen)).collect::<Vec<_>>();
    let may = move || line.may_act() && !line.busy();
    let provoke = move |words: Vec<String>| link::ask(Ask::Provoke { faults: words });
    section().class("faults").attr("aria-label", t!("page.lab.sheet.faults")).child((
        h3().child(t!("page.lab.faults.title")),
        p().class("quiet").child(t!("page.lab.faults.about")),
        ul().child(rows),
        div().class("row").child((
            push_if(
                "button primary",
                move || may() && chosen.get() != of_words(&now.get()),
                t!("page.lab.faults.provoke"),
                move |_| provoke(chosen.with_untracked(in_words)),
            ),
            push_if(
                "button",
                move || may() && now.with(|now| !now.is_empty()),
                t!("page.lab.faults.mend"),
                move |_| provoke(Vec::new()),
            ),
        )),
        p().attr("role", "status").child(move || in_force(&now.get())),
    ))
}

/// What is broken now, in words.
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
    let tick = input().attr("type", "checkbox").prop("checked", is_on).on(ev::change, move |event| {
        chosen.update(|chosen| {
            if event_target_checked(&event) {
                chosen.insert(name, fault.after);
            } else {
                chosen.remove(name);
            }
        });
    });
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
            // What is no number of holes is not left standing there.
            let there = chosen.with_untracked(|chosen| chosen.get(name).copied().unwrap_or(fault.after));
            event_target::<web_sys::HtmlInputElement>(&event).set_value(&there.to_string());
        });
    li().child((
        label().class("tick").child((tick, span().child(sentence))),
        label().class("after").child((span().child(t!("page.lab.faults.after")), holes)),
    ))
}
