//! The program for a controller, line by line: the current line is marked, pressing one jumps to its time.

use crate::i18n::{say, t};
use crate::model::ListingEvent;
use crate::model::lines::row_now;
use crate::page::{peek, read, send, shared, watch};
use crate::screens::cam::controller;
use crate::widgets::{refusal, row_top, virtual_list};
use leptos::ev;
use leptos::html::{code, div, header, section, span};
use leptos::prelude::*;

/// The controller and the lines.
pub(super) fn lines() -> impl IntoView {
    let count = Signal::derive(move || read(|m| m.lines.written.as_ref().map_or(0, |written| written.len())));
    let now = Memo::new(|_| read(row_now));
    let row = move |index: usize| {
        shared(|m| &m.lines.written).track();
        line(index, now).into_any()
    };
    let told = move || {
        if read(|m| m.lines.is_on_the_way()) {
            return say!("page.simulate.writing");
        }
        say!("page.simulate.lines_count", count = count.get())
    };
    let why = move || watch(|m| &m.lines.refused).get().into_iter().map(refusal).collect::<Vec<_>>();
    (
        section().class("block").attr("aria-label", t!("page.simulate.program")).child((
            controller(),
            header().child(span().class("quiet tabular").attr("role", "status").child(told)),
            why,
        )),
        virtual_list(t!("page.simulate.program"), count, now.into(), row, |by| {
            send(ListingEvent::Walk { by });
        }),
    )
}

fn line(row: usize, now: Memo<Option<usize>>) -> Option<impl IntoView> {
    let (number, text) = shared(|m| &m.lines.written).with_untracked(|written| {
        written.as_ref()?.row(row).map(|(number, text)| (number, text.to_owned()))
    })?;
    // All lines of one command are executed together.
    let chosen = move || {
        let written = peek(|m| m.lines.written.clone());
        now.get()
            .is_some_and(|now| now == row || written.is_some_and(|written| written.are_together(now, row)))
    };
    let class = if number.is_some() { "line program-line" } else { "line program-line head" };
    Some(
        div()
            .class(class)
            .attr("role", "option")
            .attr("aria-selected", move || if chosen() { "true" } else { "false" })
            .style(("top", row_top(row)))
            .attr("title", text.clone())
            .on(ev::click, move |_| send(ListingEvent::Press { row }))
            .child((
                span().class("quiet tabular").child(number.map(|number| number.to_string())),
                code().child(text),
            )),
    )
}
