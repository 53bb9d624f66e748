//! The log: the machine's reports and this page's requests, newest first, with filters, saved as a file.

use crate::i18n::{advice, message, say, t};
use crate::lab::log::{LogEntry, LogEvent, Topic, csv_field};
use crate::model::LinkEvent;
use crate::page::{send, shared};
use crate::screens::machine::words;
use crate::widgets::{choice, push_if, save_file, segmented};
use leptos::ev;
use leptos::html::{div, input, label, p, span, table, tbody, td, th, thead, tr};
use leptos::prelude::*;

fn kind_name(kind: Topic) -> String {
    match kind {
        Topic::Machine => say!("page.lab.log.machine"),
        Topic::Trouble => say!("page.lab.log.trouble"),
        Topic::Asked => say!("page.lab.log.asked"),
        Topic::Link => say!("page.lab.log.link"),
    }
}

fn in_words(event: &LogEvent) -> String {
    match event {
        LogEvent::State(state, own) => {
            let look = words::state(*state);
            let both = own.unwrap_or([look.word, look.meaning]);
            let [word, meaning] = both.map(|key| crate::i18n::text(key, &[]));
            format!("{word}. {meaning}")
        }
        LogEvent::Change(step) => {
            let title = say!("page.magazine.step", number = step.number());
            format!("{title}. {}", crate::i18n::text(step.sentence_key(), &[]))
        }
        LogEvent::Ended { ending, holes, toolpaths } => {
            let made = crate::screens::machine::made(true, *holes, *toolpaths);
            crate::i18n::text(words::ending(*ending), &[("made", made)])
        }
        LogEvent::Alarm(diagnostic) | LogEvent::Refused(diagnostic) => {
            format!("{} {}", message(diagnostic), advice(diagnostic))
        }
        LogEvent::Asked(what) => say!("page.lab.log.asked_for", what = what.replace('_', " ")),
        LogEvent::Control { yours: true, .. } => say!("page.lab.log.control_yours"),
        LogEvent::Control { taken: true, .. } => say!("page.lab.log.control_taken"),
        LogEvent::Control { .. } => say!("page.lab.log.control_free"),
        LogEvent::Settings => say!("page.lab.log.settings"),
        LogEvent::Link { open: true } => say!("page.lab.log.link_open"),
        LogEvent::Link { open: false } => say!("page.lab.log.link_lost"),
    }
}

pub(super) fn date_and_clock(at_ms: f64) -> String {
    js_sys::Date::new(&at_ms.into()).to_iso_string().as_string().unwrap_or_default()
}

pub(super) fn clock(at_ms: f64) -> String {
    let at = js_sys::Date::new(&at_ms.into());
    format!(
        "{:02}:{:02}:{:02}.{:03}",
        at.get_hours(),
        at.get_minutes(),
        at.get_seconds(),
        at.get_milliseconds()
    )
}

fn as_file(entries: &[LogEntry]) -> String {
    let mut out = "number,time,kind,event\n".to_owned();
    for entry in entries.iter().rev() {
        let time = date_and_clock(entry.at_ms);
        let fields = [entry.number.to_string(), time, kind_name(entry.event.kind()), in_words(&entry.event)];
        out.push_str(&fields.map(|field| csv_field(&field)).join(","));
        out.push('\n');
    }
    out
}

pub(super) fn log() -> impl IntoView {
    let log = shared(|m| &m.link.log);
    let hidden = RwSignal::new(Vec::<Topic>::new());
    let word = RwSignal::new(String::new());
    let entries = Memo::new(move |_| {
        let (hidden, word) = (hidden.get(), word.get().to_lowercase());
        let mut found = log.with(|log| log.newest(|kind| !hidden.contains(&kind)));
        found.retain(|entry| word.is_empty() || in_words(&entry.event).to_lowercase().contains(&word));
        found
    });
    let any = move || !entries.with(Vec::is_empty);
    div().class("lab-log").child((
        div().class("lab-tools").child((
            kinds(hidden),
            label().class("field").child((
                span().child(t!("page.lab.log.search")),
                input().attr("type", "text").prop("value", move || word.get()).on(ev::input, move |event| {
                    word.set(event_target_value(&event));
                }),
            )),
            span().class("grow"),
            push_if(
                "button",
                move || log.with(|log| !log.is_empty()),
                t!("page.lab.log.clear"),
                |_| send(LinkEvent::ClearLog),
            ),
            push_if("button primary", any, t!("page.lab.log.export"), move |_| {
                save_file("annulus-log.csv", "text/csv", &entries.with_untracked(|entries| as_file(entries)));
            }),
        )),
        div()
            .class("lab-scroll")
            .attr("tabindex", "0")
            .attr("role", "region")
            .attr("aria-label", t!("page.lab.sheet.log"))
            .child(move || {
                if any() {
                    rows(entries).into_any()
                } else {
                    p().class("quiet empty").child(t!("page.lab.log.empty")).into_any()
                }
            }),
    ))
}

fn kinds(hidden: RwSignal<Vec<Topic>>) -> impl IntoView {
    let choices = Topic::ALL.map(|kind| {
        let shown = move || hidden.with(|hidden| !hidden.contains(&kind));
        choice(
            shown,
            move || kind_name(kind),
            move |_| {
                hidden.update(|hidden| match hidden.iter().position(|one| *one == kind) {
                    Some(at) => drop(hidden.remove(at)),
                    None => hidden.push(kind),
                });
            },
        )
        .into_any()
    });
    div().class("field").child((
        span().child(t!("page.lab.log.show")),
        segmented(t!("page.lab.log.show"), Vec::from(choices)),
    ))
}

fn rows(entries: Memo<Vec<LogEntry>>) -> impl IntoView {
    let head = |text: fn() -> String| th().attr("scope", "col").child(text);
    table().class("log-table").child((
        thead().child(tr().child((
            head(|| say!("page.lab.log.time")),
            head(|| say!("page.lab.log.kind")),
            head(|| say!("page.lab.log.event")),
        ))),
        tbody()
            .child(move || entries.get().into_iter().map(|entry| row(entry).into_any()).collect::<Vec<_>>()),
    ))
}

fn row(entry: LogEntry) -> impl IntoView {
    let kind = entry.event.kind();
    let event = entry.event;
    tr().class(if kind == Topic::Trouble { "trouble" } else { "" }).child((
        td().class("tabular").child(clock(entry.at_ms)),
        td().class("quiet").child(move || kind_name(kind)),
        td().child(move || in_words(&event)),
    ))
}
