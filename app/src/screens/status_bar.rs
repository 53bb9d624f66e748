//! The status bar: where the pointer is, how close, what is wrong, what is being worked on, what draws.
//!
//! Comes in: the state. Goes out: a line of small text, the way to the problems, and Cancel.

use crate::i18n::{self, say, t};
use crate::keys::Tab;
use crate::model::{DrawEvent, Event, ExportEvent};
use crate::page::frame;
use crate::page::{open_board, open_drawing, play, send};
use crate::widgets::push;
use leptos::html::{footer, progress, span};
use leptos::prelude::*;

/// The bar.
pub(crate) fn status_bar() -> impl IntoView {
    let frame = frame();
    let place = move || {
        let unit = frame.unit.get();
        frame.cursor_mm.get().map(|[x, y]| {
            say!(
                "page.status.cursor",
                x = unit.coordinate(x),
                y = unit.coordinate(y),
                unit = i18n::unit_word()
            )
        })
    };
    let pictured = Memo::new(move |_| {
        let board = open_board().document.with(Option::is_some);
        match frame.tab.get() {
            Tab::Draw | Tab::Machine => true,
            Tab::Board | Tab::Cam | Tab::Simulate => board,
            Tab::Lab | Tab::Settings => false,
        }
    });
    // In space a length has no size of its own.
    let flat = move || pictured.get() && !(frame.tab.get() == Tab::Simulate && play().in_space.get());
    let zoom = move || {
        let camera = frame.camera.get().filter(|_| flat())?;
        Some(say!("page.status.zoom", percent = format!("{:.0}", camera.zoom() * 100.0)))
    };
    let backend = move || frame.backend.get().filter(|_| pictured.get()).map(|word| i18n::text(word, &[]));
    footer()
        .class("status-bar")
        .attr("id", "status")
        .attr("tabindex", "-1")
        .attr("aria-label", t!("page.status.title"))
        .child((
            span().class("where").child(place),
            span().child(zoom),
            problems,
            unkept,
            span().class("grow").child(task),
            network,
            span().child(backend),
        ))
}

/// That the page works without a network, or that there is none.
fn network() -> impl IntoView {
    let words = Memo::new(move |_| frame().network.get().words(frame().alone.get()));
    move || {
        words.get().map(|[word, meaning]| {
            span()
                .class("network")
                .attr("role", "status")
                .attr("title", move || i18n::text(meaning, &[]))
                .child(move || i18n::text(word, &[]))
        })
    }
}

/// How much is wrong with the board; pressed, it is shown.
fn problems() -> impl IntoView {
    let count = Memo::new(move |_| open_board().problems.with(Vec::len));
    move || {
        (count.get() > 0).then(|| {
            let text = move || say!("page.problems.count", count = count.get());
            push("button small quiet", text, |_| super::board::show_problems())
        })
    }
}

/// That the open project or the drawing cannot be kept in this browser, and why.
fn unkept() -> impl IntoView {
    let (project, drawing) = (open_board().unkept, open_drawing().unkept);
    let of_project = move || {
        project.get().map(|why| {
            push("button small danger", t!("page.kept.not_kept"), |_| send(ExportEvent::SaveProject))
                .attr("title", move || i18n::text(why, &[]))
        })
    };
    let of_drawing = move || {
        drawing.get().then(|| {
            push("button small danger", t!("page.draw.not_kept"), |_| send(DrawEvent::Save))
                .attr("title", t!("page.draw.not_kept_is"))
        })
    };
    (of_project, of_drawing)
}

fn task() -> impl IntoView {
    let task = open_board().task;
    let word = Memo::new(move |_| task.get().map(|task| task.word));
    move || {
        word.get().map(|word| {
            (
                span().attr("role", "status").child(move || i18n::text(word, &[])),
                progress()
                    .attr("max", "1")
                    .attr("aria-label", move || i18n::text(word, &[]))
                    .prop("value", move || task.get().map_or(0.0, |task| task.share)),
                push("button small quiet", t!("page.cancel"), |_| send(Event::Cancelled)),
            )
        })
    }
}
