//! The status bar: pointer position, zoom, problems, running task, renderer.

use crate::i18n::{self, say, t};
use crate::keys::Tab;
use crate::model::{DrawEvent, Event, ExportEvent, Model};
use crate::page::{board, read, send};
use crate::widgets::push;
use leptos::html::{footer, progress, span};
use leptos::prelude::*;

pub(crate) fn status_bar() -> impl IntoView {
    let place = move || {
        let unit = read(|m| m.frame.unit);
        read(|m| m.frame.cursor_mm).map(|[x, y]| {
            say!(
                "page.status.cursor",
                x = unit.coordinate(x),
                y = unit.coordinate(y),
                unit = i18n::unit_word()
            )
        })
    };
    let pictured = |m: &Model| match m.frame.tab {
        Tab::Draw | Tab::Machine => true,
        tab => tab.shows_board() && m.board.document.is_some(),
    };
    // In the 3D view there is no single scale.
    let flat = move || read(pictured) && !read(|m| m.frame.tab == Tab::Simulate && m.play.in_space());
    let zoom = move || {
        let camera = read(|m| m.frame.camera).filter(|_| flat())?;
        Some(say!("page.status.zoom", percent = format!("{:.0}", camera.zoom() * 100.0)))
    };
    let backend =
        move || read(|m| m.frame.backend).filter(|_| read(pictured)).map(|word| i18n::text(word, &[]));
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

fn network() -> impl IntoView {
    let words = move || read(|m| m.frame.network.words(m.frame.alone));
    move || {
        words().map(|[word, meaning]| {
            span()
                .class("network")
                .attr("role", "status")
                .attr("title", move || i18n::text(meaning, &[]))
                .child(move || i18n::text(word, &[]))
        })
    }
}

/// The number of problems; pressing it shows them.
fn problems() -> impl IntoView {
    let count = Memo::new(|_| board::problems().with(Vec::len));
    move || {
        (count.get() > 0).then(|| {
            let text = move || say!("page.problems.count", count = count.get());
            push("button small quiet", text, |_| super::board::show_problems())
        })
    }
}

/// Shows that the project or the drawing can't be saved in this browser, and why.
fn unkept() -> impl IntoView {
    let of_project = move || {
        read(|m| m.keeping.failed).map(|why| {
            push("button small danger", t!("page.kept.not_kept"), |_| send(ExportEvent::SaveProject))
                .attr("title", move || i18n::text(why, &[]))
        })
    };
    let of_drawing = move || {
        read(|m| m.draw.unkept()).then(|| {
            push("button small danger", t!("page.draw.not_kept"), |_| send(DrawEvent::Save))
                .attr("title", t!("page.draw.not_kept_is"))
        })
    };
    (of_project, of_drawing)
}

fn task() -> impl IntoView {
    move || {
        read(|m| Some(m.task()?.word)).map(|word| {
            (
                span().attr("role", "status").child(move || i18n::text(word, &[])),
                progress()
                    .attr("max", "1")
                    .attr("aria-label", move || i18n::text(word, &[]))
                    .prop("value", || read(|m| m.task().map_or(0.0, |task| task.share))),
                push("button small quiet", t!("page.cancel"), |_| send(Event::Cancelled)),
            )
        })
    }
}
