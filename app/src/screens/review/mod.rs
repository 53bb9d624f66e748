//! The import review: every file with what it is taken for and why; how its numbers are read; what was not understood.
//!
//! Comes in: what was read. Goes out: which files are used, how numbers are read, errors ticked as seen (N4, N5).

mod boards;
mod finding;
mod format;
mod preview;

pub(crate) use finding::finding;

use crate::engine::messages::FileRow;
use crate::i18n::{key, say, t};
use crate::model::{Document, FilesEvent, Unseen};
use crate::page::{open_board, send};
use crate::widgets::{menu_word, push, push_if};
use leptos::ev;
use leptos::html::{div, h2, header, input, label, p, select, span, table, tbody, td, th, thead, tr};
use leptos::prelude::*;
use std::sync::Arc;

/// The sheet.
pub(crate) fn review() -> impl IntoView {
    let desk = open_board();
    let head = header().child((
        div()
            .class("grow")
            .child((h2().child(t!("page.review.title")), p().class("quiet").child(t!("page.review.about")))),
        back(),
        push("button", t!("page.review.discard"), |_| send(FilesEvent::Discarded)),
        push_if(
            "button primary large",
            move || desk.unseen().is_none() && usable(),
            t!("page.review.go"),
            |_| send(FilesEvent::Reviewed),
        ),
    ));
    let unseen = move || {
        if !usable() {
            return Some(
                p().class("refusal").attr("role", "status").child(t!("page.review.unusable")).into_any(),
            );
        }
        let word = match desk.unseen()? {
            Unseen::Several => key!("page.review.unseen_several"),
            Unseen::Unread => key!("page.review.unseen"),
            Unseen::Board => key!("page.review.unseen_board"),
        };
        Some(p().class("quiet").attr("role", "status").child(move || crate::i18n::text(word, &[])).into_any())
    };
    let body = move || desk.document.get().map(|document| files(&document));
    div().class("whole").child(div().class("review").child((head, unseen, body)))
}

/// The way back to the board that was open before, as it was.
fn back() -> impl IntoView {
    let before = open_board().before;
    move || {
        before.get().map(|before| {
            let name = before.document.reading.board.name.clone();
            push("button", t!("page.review.back", name = name), |_| send(FilesEvent::Back))
        })
    }
}

/// Whether anything of the files can be drilled, milled or looked at.
fn usable() -> bool {
    open_board().document.with(|document| document.as_ref().is_some_and(|document| document.usable()))
}

const COLUMNS: [&str; 6] = [
    key!("page.review.use"),
    key!("page.review.file"),
    key!("page.review.is"),
    key!("page.review.side"),
    key!("page.review.because"),
    key!("page.review.preview"),
];

fn files(document: &Arc<Document>) -> impl IntoView + use<> {
    let heads = COLUMNS.map(|name| th().attr("scope", "col").child(move || crate::i18n::text(name, &[])));
    let lines =
        (0..).zip(&document.reading.files).map(|(index, file)| line(document, index, file).into_any());
    let board = document.board_diagnostics().map(|diagnostic| finding(diagnostic.clone()).into_any());
    (
        boards::boards(document),
        table()
            .child((thead().child(tr().child(Vec::from(heads))), tbody().child(lines.collect::<Vec<_>>()))),
        alignment(document),
        div().class("diagnostics").child(board.collect::<Vec<_>>()),
    )
}

fn row_class(kind: &str, has_holes: bool, used: bool) -> &'static str {
    match kind {
        "refused" => "refused",
        "gerber" if !has_holes => "used",
        _ if used => "used",
        _ => "unused",
    }
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
            .on(ev::change, move |_| send(FilesEvent::FlipUse { row: index }))
    });
    let reason = file.reason.clone();
    let is_gerber = file.kind == "gerber";
    let side = file.side.clone();
    let shown_diagnostics = file
        .diagnostics
        .iter()
        .take(20)
        .map(|diagnostic| finding(diagnostic.clone()).into_any())
        .collect::<Vec<_>>();
    let more = file.diagnostics.len().saturating_sub(20);
    tr().class(row_class(&file.kind, can_be_used, used)).child((
        td().child(tick),
        td().child(file.name.clone()),
        td().child(role_menu(file, side.as_deref(), is_gerber)),
        td().child(side_menu(file, side, is_gerber)),
        td().child((
            p().child(move || crate::i18n::message(&reason)),
            file.drill.clone().map(|drill| format::format(document.said.numbers.clone(), drill)),
            div().class("diagnostics").child(shown_diagnostics),
            (more > 0).then(|| p().class("quiet").child(t!("page.review.more", count = more))),
        )),
        td().child((
            preview::preview(document, index, file),
            file.drill.as_ref().and_then(|drill| format::rival(document, drill)),
        )),
    ))
}

const ROLES: [&str; 6] = ["copper", "mask", "silk", "paste", "outline", "other"];
const SIDES: [&str; 4] = ["top", "bottom", "inner", ""];

/// The board is read again with this file taken for something else.
fn say_role(file: String, role: String, side: Option<String>) {
    send(FilesEvent::Role { file, role, side });
}

fn role_menu(file: &FileRow, side: Option<&str>, editable: bool) -> AnyView {
    let (kind, role, side) = (file.kind.clone(), file.role.clone(), side.map(str::to_owned));
    let name = file.name.clone();
    if !editable {
        return span().child(move || what(&kind, &role)).into_any();
    }
    let options = ROLES.map(|word| {
        let (kind, chosen) = (kind.clone(), role == word);
        menu_word(word, move || chosen, move || what(&kind, word))
    });
    select()
        .attr("aria-label", t!("page.review.is"))
        .on(ev::change, move |event| {
            say_role(name.clone(), event_target_value(&event), side.clone());
        })
        .child(Vec::from(options))
        .into_any()
}

fn side_menu(file: &FileRow, side: Option<String>, editable: bool) -> AnyView {
    let (file, role) = (file.name.clone(), file.role.clone());
    if !editable || matches!(role.as_str(), "outline" | "other") {
        return span().child(move || side.as_deref().map(side_word)).into_any();
    }
    let now = side.unwrap_or_default();
    let options = SIDES.map(|word| {
        let chosen = now == word;
        let name = move || if word.is_empty() { say!("page.side.none") } else { side_word(word) };
        menu_word(word, move || chosen, name)
    });
    select()
        .attr("aria-label", t!("page.review.side"))
        .on(ev::change, move |event| {
            let side = Some(event_target_value(&event)).filter(|side| !side.is_empty());
            say_role(file.clone(), role.clone(), side);
        })
        .child(Vec::from(options))
        .into_any()
}

/// Layers that do not share the copper's zero point can be moved to it.
fn alignment(document: &Document) -> Option<AnyView> {
    let apart = ["board.outline_shifted", "board.outline_could_move"];
    let apart = document.diagnostics().any(|diagnostic| apart.contains(&diagnostic.code.as_str()));
    let holes_apart = document.reading.files.iter().any(|file| file.shifted);
    (apart || holes_apart || document.said.aligned).then(|| {
        let aligned = document.said.aligned;
        label()
            .class("tick")
            .child((
                input().attr("type", "checkbox").prop("checked", aligned).on(ev::change, move |event| {
                    let on = event_target_checked(&event);
                    send(FilesEvent::Aligned { on });
                }),
                span().child(t!("page.review.align")),
            ))
            .into_any()
    })
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
