//! The import review: every file with what it is taken for and why; how its numbers are read; what was not understood.
//!
//! Comes in: what was read. Goes out: which files are used, how numbers are read, losses ticked as seen (N4, N5).

mod finding;
mod format;

pub(crate) use finding::finding;

use crate::document::{self, Document, desk};
use crate::engine::messages::FileRow;
use crate::i18n::{key, say, t};
use crate::widgets::{push, push_if};
use leptos::ev;
use leptos::html::{div, h2, header, input, p, table, tbody, td, th, thead, tr};
use leptos::prelude::*;
use std::sync::Arc;

/// The sheet.
pub(crate) fn review() -> impl IntoView {
    let desk = desk();
    let head = header().child((
        div()
            .class("grow")
            .child((h2().child(t!("page.review.title")), p().class("quiet").child(t!("page.review.about")))),
        push("button", t!("page.review.discard"), move |_| {
            desk.document.set(None);
            desk.reviewing.set(false);
        }),
        push_if(
            "button primary large",
            move || !desk.losses_unseen(),
            t!("page.review.go"),
            move |_| desk.reviewing.set(false),
        ),
    ));
    let unseen = move || desk.losses_unseen().then(|| p().class("quiet").child(t!("page.review.unseen")));
    let body = move || desk.document.get().map(|document| files(&document));
    div().class("whole").child(div().class("review").child((head, unseen, body)))
}

const COLUMNS: [&str; 5] = [
    key!("page.review.use"),
    key!("page.review.file"),
    key!("page.review.is"),
    key!("page.review.side"),
    key!("page.review.because"),
];

fn files(document: &Arc<Document>) -> impl IntoView + use<> {
    let heads = COLUMNS.map(|name| th().attr("scope", "col").child(move || crate::i18n::text(name, &[])));
    let lines =
        (0..).zip(&document.reading.files).map(|(index, file)| line(document, index, file).into_any());
    let board = document.board_remarks().map(|remark| finding(remark.clone()).into_any());
    (
        table()
            .child((thead().child(tr().child(Vec::from(heads))), tbody().child(lines.collect::<Vec<_>>()))),
        div().class("remarks").child(board.collect::<Vec<_>>()),
    )
}

/// The board is read again with this file in it, or without.
fn flip_use(index: u32) {
    let Some(document) = desk().document.get_untracked() else { return };
    let mut used = document.reading.used.clone();
    match used.iter().position(|row| *row == index) {
        Some(at) => drop(used.remove(at)),
        None => used.push(index),
    }
    used.sort_unstable();
    leptos::task::spawn_local(document::read_again(document.numbers.clone(), Some(used)));
}

fn line(document: &Arc<Document>, index: u32, file: &FileRow) -> impl IntoView + use<> {
    let used = document.reading.used.contains(&index);
    let can_be_used = file.drill.is_some();
    let name = file.name.clone();
    let tick = can_be_used.then(|| {
        input()
            .attr("type", "checkbox")
            .attr("aria-label", move || say!("page.review.use_file", name = name))
            .prop("checked", used)
            .on(ev::change, move |_| flip_use(index))
    });
    let reason = file.reason.clone();
    let (kind, role) = (file.kind.clone(), file.role.clone());
    let side = file.side.clone();
    let shown_remarks =
        file.remarks.iter().take(20).map(|remark| finding(remark.clone()).into_any()).collect::<Vec<_>>();
    let more = file.remarks.len().saturating_sub(20);
    tr().class(if used { "used" } else { "unused" }).child((
        td().child(tick),
        td().child(file.name.clone()),
        td().child(move || what(&kind, &role)),
        td().child(move || side.as_deref().map(side_word)),
        td().child((
            p().child(move || crate::i18n::message(&reason)),
            file.drill.clone().map(|drill| format::format(document.numbers.clone(), drill)),
            div().class("remarks").child(shown_remarks),
            (more > 0).then(|| p().class("quiet").child(t!("page.review.more", count = more))),
        )),
    ))
}

fn what(kind: &str, role: &str) -> String {
    match (kind, role) {
        ("archive", _) => say!("page.kind.archive"),
        ("refused", _) => say!("page.kind.refused"),
        ("report", _) => say!("page.kind.report"),
        ("unknown", _) => say!("page.kind.unknown"),
        (_, "drill") => say!("page.kind.drill"),
        (_, "copper") => say!("page.kind.copper"),
        (_, "mask") => say!("page.kind.mask"),
        (_, "silk") => say!("page.kind.silk"),
        (_, "paste") => say!("page.kind.paste"),
        (_, "outline") => say!("page.kind.outline"),
        _ => say!("page.kind.other"),
    }
}

fn side_word(side: &str) -> String {
    match side {
        "top" => say!("page.side.top"),
        "bottom" => say!("page.side.bottom"),
        _ => say!("page.side.inner"),
    }
}
