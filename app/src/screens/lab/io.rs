//! Live inputs, and a guided check of every sensor.
//!
//! ```text
//! input  now  changes  last change │ press this one … seen … next … report
//! ```

use crate::browser;
use crate::i18n::{self, say, t};
use crate::lab::io::{Check, Found};
use crate::model::LabEvent;
use crate::page::{peek, read, send, watch};
use crate::screens::machine::words;
use crate::widgets::{Icon, icon, push, push_if, save_file, shape};
use annulus_core::job::Input;
use leptos::html::{caption, div, h3, li, ol, p, section, span, strong, table, tbody, td, th, thead, tr};
use leptos::prelude::*;

fn sensor(input: Input) -> String {
    i18n::text(words::sensor(input), &[])
}

pub(super) fn io() -> impl IntoView {
    let body = || {
        if read(|m| m.link.status.is_some()) {
            div()
                .class("lab-columns even")
                .child((div().child((inputs(), super::outputs::outputs())), check()))
                .into_any()
        } else {
            p().class("quiet empty").child(t!("page.lab.io.no_machine")).into_any()
        }
    };
    div().class("lab-sheet").child((div(), body))
}

fn inputs() -> impl IntoView {
    let inputs = watch(|m| &m.lab.inputs);
    let touches = || read(|m| m.link.status.as_ref()?.touches);
    let are_counted = || read(|m| m.link.status.as_ref()?.touches).is_some();
    let head = |text: fn() -> String| th().attr("scope", "col").child(text);
    let rows = Input::ALL.into_iter().enumerate().map(|(index, input)| {
        let on = Memo::new(move |_| inputs.with(|inputs| inputs.on(input)));
        let edges = move || inputs.with(|inputs| inputs.edges[index]);
        let changed = move || {
            inputs.with(|inputs| inputs.changed_ms[index]).map_or_else(|| "–".to_owned(), super::log::clock)
        };
        let short = move || {
            let own = touches().and_then(|touches| touches.get(index).copied()).filter(|own| own.count > 0);
            own.map_or_else(
                || "–".to_owned(),
                |own| say!("page.lab.io.short_touches_of", count = own.count, longest = own.longest_us),
            )
        };
        let state = move || if on.get() { say!("page.sensor.on") } else { say!("page.sensor.off") };
        tr().child((
            th().attr("scope", "row").child(move || sensor(input)),
            td().child(
                span()
                    .class(move || if on.get() { "lamp on" } else { "lamp" })
                    .child((shape(""), span().child(state))),
            ),
            td().class("number tabular").child(edges),
            td().class("number tabular").child(changed),
            move || are_counted().then(|| td().class("number tabular").child(short)),
        ))
    });
    section().class("block").attr("aria-label", t!("page.lab.io.inputs")).child((
        div().class("row spread").child((
            h3().child(t!("page.lab.io.inputs")),
            push("button small", t!("page.lab.io.count_anew"), |_| send(LabEvent::CountAnew)),
        )),
        table().class("io-table").child((
            caption().class("unseen").child(t!("page.lab.io.inputs")),
            thead().child(tr().child((
                head(|| say!("page.lab.io.input")),
                head(|| say!("page.lab.io.now")),
                th().attr("scope", "col").class("number").child(t!("page.lab.io.changes")),
                th().attr("scope", "col").class("number").child(t!("page.lab.io.last_change")),
                move || {
                    let head = th().attr("scope", "col").class("number");
                    are_counted().then(|| head.child(t!("page.lab.io.short_touches")))
                },
            ))),
            tbody().child(rows.collect::<Vec<_>>()),
        )),
        p().class("quiet").child(t!("page.lab.io.sampled")),
        move || are_counted().then(|| p().class("quiet").child(t!("page.lab.io.short_touches_are"))),
    ))
}

fn found_words(found: Found) -> String {
    match found {
        Found::Good => say!("page.lab.io.good"),
        Found::StuckOn => say!("page.lab.io.stuck"),
        Found::OnAlready => say!("page.lab.io.on_already"),
        Found::Nothing => say!("page.lab.io.nothing"),
    }
}

fn report(check: &Check) -> String {
    let machine = peek(|m| m.machine.name.clone());
    let mut out = format!("{machine}\n{}\n", super::log::date_and_clock(browser::clock_ms()));
    for (index, input) in Input::ALL.into_iter().enumerate() {
        if let Some(found) = check.found(index) {
            out.push_str(&format!("{}\t{}\n", sensor(input), found_words(found)));
        }
    }
    out
}

fn check() -> impl IntoView {
    let check = watch(|m| &m.lab.check);
    let begin = |_| send(LabEvent::Check);
    let asked = move || {
        let now = check.get();
        match now.as_ref().and_then(Check::input) {
            Some(input) => p()
                .class("check-now")
                .child((
                    strong().child(t!("page.lab.io.press", input = sensor(input))),
                    push("button", t!("page.lab.io.skip"), |_| send(LabEvent::Skip)),
                ))
                .into_any(),
            None if now.is_some() => {
                p().class("row").child((icon(Icon::Check), span().child(t!("page.lab.io.done")))).into_any()
            }
            None => p().class("quiet").child(t!("page.lab.io.check_is")).into_any(),
        }
    };
    let list = move || {
        let now = check.get()?;
        let lines = Input::ALL.into_iter().enumerate().map(move |(index, input)| {
            let found = now.found(index);
            let class = match found {
                Some(Found::Good) => "found good",
                Some(_) => "found bad",
                None if now.at == index => "found now",
                None => "found",
            };
            let sign = found.map(|found| icon(if found == Found::Good { Icon::Check } else { Icon::Cross }));
            li().class(class).child((
                span().class("sign").child(sign),
                span().class("grow").child(move || sensor(input)),
                span().child(move || found.map(found_words)),
            ))
        });
        Some(ol().class("check-list").child(lines.collect::<Vec<_>>()))
    };
    let done = move || check.with(|check| check.is_some_and(|check| check.done()));
    section().class("block").attr("aria-label", t!("page.lab.io.check")).child((
        h3().child(t!("page.lab.io.check")),
        div().attr("role", "status").child(asked),
        list,
        div().class("row").child((
            push(
                "button",
                move || {
                    if check.with(Option::is_some) {
                        say!("page.lab.io.again")
                    } else {
                        say!("page.lab.io.begin")
                    }
                },
                begin,
            ),
            push_if("button", done, t!("page.lab.io.report"), move |_| {
                if let Some(check) = check.get_untracked() {
                    save_file("annulus-sensors.txt", "text/plain", &report(&check));
                }
            }),
        )),
    ))
}
