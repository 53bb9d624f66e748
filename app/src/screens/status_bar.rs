//! The status bar: the line about the open board, pointer position, zoom, renderer.

use super::job_line;
use crate::i18n::{self, say, t};
use crate::keys::Tab;
use crate::model::{DrawEvent, ExportEvent, Model};
use crate::page::{read, send};
use crate::widgets::push;
use leptos::html::{footer, span};
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
            job_line::job_line(),
            unkept,
            span().class("where").child(place),
            span().class("zoom").child(zoom),
            network,
            span().class("renderer").child(backend),
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
