//! The import review: every file with its role and the reason; the number formats; what wasn't understood.

mod format;
mod preview;

use crate::engine::messages::FileRow;
use crate::i18n::{advice, key, message, say, t};
use crate::model::{Document, FilesEvent, Unseen};
use crate::page::{board, read, send, shared, watch};
use crate::widgets::{Icon, icon, menu_word, push, push_if, tick};
use annulus_core::artwork::{FileKind, FileRead, Role, Side};
use annulus_core::code;
use annulus_core::diagnostic::{Diagnostic, Severity};
use leptos::ev;
use leptos::html::{div, h2, header, input, p, select, span, strong, table, tbody, td, th, thead, tr};
use leptos::prelude::*;
use std::sync::Arc;

pub(crate) fn review() -> impl IntoView {
    let head = header().child((
        div()
            .class("grow")
            .child((h2().child(t!("page.review.title")), p().class("quiet").child(t!("page.review.about")))),
        back(),
        push("button", t!("page.review.discard"), |_| send(FilesEvent::Discarded)),
        push_if(
            "button primary large",
            move || board::unseen().is_none() && usable(),
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
        let word = match board::unseen()? {
            Unseen::Several => key!("page.review.unseen_several"),
            Unseen::Unread => key!("page.review.unseen"),
            Unseen::Board => key!("page.review.unseen_board"),
        };
        Some(p().class("quiet").attr("role", "status").child(move || crate::i18n::text(word, &[])).into_any())
    };
    let body = move || shared(|m| &m.board.document).get().map(|document| files(&document));
    div().class("whole").child(div().class("review").child((head, unseen, body)))
}

fn back() -> impl IntoView {
    let before = shared(|m| &m.before);
    move || {
        before.get().map(|before| {
            let name = before.document.reading.board.name.clone();
            push("button", t!("page.review.back", name = name), |_| send(FilesEvent::Back))
        })
    }
}

/// True if the files have anything to drill, mill or look at.
fn usable() -> bool {
    read(|m| m.board.document.as_ref().is_some_and(|document| document.usable()))
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
        preview::boards(document),
        table()
            .child((thead().child(tr().child(Vec::from(heads))), tbody().child(lines.collect::<Vec<_>>()))),
        alignment(document),
        div().class("diagnostics").child(board.collect::<Vec<_>>()),
    )
}

fn row_class(kind: FileKind, has_holes: bool, used: bool) -> &'static str {
    match kind {
        FileKind::Refused => "refused",
        FileKind::Gerber if !has_holes => "used",
        _ if used => "used",
        _ => "unused",
    }
}

fn line(document: &Arc<Document>, index: u32, row: &FileRow) -> impl IntoView + use<> {
    let used = document.reading.used.contains(&index);
    let file = &row.read;
    let can_be_used = row.drill.is_some();
    let name = file.name.clone();
    let tick = can_be_used.then(|| {
        input()
            .attr("type", "checkbox")
            .attr("aria-label", move || say!("page.review.use_file", name = name))
            .prop("checked", used)
            .on(ev::change, move |_| send(FilesEvent::FlipUse { row: index }))
    });
    let reason = file.reason.clone();
    let shown_diagnostics = file
        .diagnostics
        .iter()
        .take(20)
        .map(|diagnostic| finding(diagnostic.clone()).into_any())
        .collect::<Vec<_>>();
    let more = file.diagnostics.len().saturating_sub(20);
    tr().class(row_class(file.kind, can_be_used, used)).child((
        td().child(tick),
        td().child(file.name.clone()),
        td().child(role_menu(file)),
        td().child(side_menu(file)),
        td().child((
            p().child(move || crate::i18n::message(&reason)),
            row.drill.map(|drill| format::format(document.said.numbers.clone(), file, drill)),
            div().class("diagnostics").child(shown_diagnostics),
            (more > 0).then(|| p().class("quiet").child(t!("page.review.more", count = more))),
        )),
        td().child((preview::preview(document, index, row), format::rival(document, row))),
    ))
}

const ROLES: [Role; 6] = [Role::Copper, Role::Mask, Role::Silk, Role::Paste, Role::Outline, Role::Other];
const SIDES: [Option<Side>; 4] = [Some(Side::Top), Some(Side::Bottom), Some(Side::Inner), None];

fn say_role(file: &str, role: &str, side: &str) {
    let side = Some(side.to_owned()).filter(|side| !side.is_empty());
    send(FilesEvent::Role { file: file.to_owned(), role: role.to_owned(), side });
}

fn role_menu(file: &FileRead) -> AnyView {
    let (kind, role, side, name) = (file.kind, file.role, file.side, file.name.clone());
    if kind != FileKind::Gerber {
        return span().child(move || what(kind, role)).into_any();
    }
    let options = ROLES.map(|one| menu_word(one.name(), move || role == one, move || what(kind, one)));
    select()
        .attr("aria-label", t!("page.review.is"))
        .on(ev::change, move |event| {
            say_role(&name, &event_target_value(&event), side.map_or("", Side::name));
        })
        .child(Vec::from(options))
        .into_any()
}

fn side_menu(file: &FileRead) -> AnyView {
    let (name, role, side) = (file.name.clone(), file.role, file.side);
    if file.kind != FileKind::Gerber || matches!(role, Role::Outline | Role::Other) {
        return span().child(move || side.map(side_word)).into_any();
    }
    let options = SIDES.map(|one| {
        let word = move || one.map_or_else(|| say!("page.side.none"), side_word);
        menu_word(one.map_or("", Side::name), move || side == one, word)
    });
    select()
        .attr("aria-label", t!("page.review.side"))
        .on(ev::change, move |event| {
            say_role(&name, role.name(), &event_target_value(&event));
        })
        .child(Vec::from(options))
        .into_any()
}

/// The offer to move layers that don't share the copper's origin.
fn alignment(document: &Document) -> Option<AnyView> {
    let apart = [code!("board.outline_shifted"), code!("board.outline_could_move")];
    let apart = document.diagnostics().any(|diagnostic| apart.contains(&diagnostic.code.as_str()));
    let holes_apart = document.reading.files.iter().any(FileRow::is_shifted);
    (apart || holes_apart || document.said.aligned).then(|| {
        let aligned = document.said.aligned;
        tick(move || aligned, t!("page.review.align"), |on| send(FilesEvent::Aligned { on })).into_any()
    })
}

fn what(kind: FileKind, role: Role) -> String {
    match (kind, role) {
        (FileKind::Archive, _) => say!("page.kind.archive"),
        (FileKind::Refused, _) => say!("page.kind.refused"),
        (FileKind::Report, _) => say!("page.kind.report"),
        (FileKind::Unknown, _) => say!("page.kind.unknown"),
        (_, Role::Drill) => say!("page.kind.drill"),
        (_, Role::Copper) => say!("page.kind.copper"),
        (_, Role::Mask) => say!("page.kind.mask"),
        (_, Role::Silk) => say!("page.kind.silk"),
        (_, Role::Paste) => say!("page.kind.paste"),
        (_, Role::Outline) => say!("page.kind.outline"),
        (_, Role::Other) => say!("page.kind.other"),
    }
}

fn side_word(side: Side) -> String {
    match side {
        Side::Top => say!("page.side.top"),
        Side::Bottom => say!("page.side.bottom"),
        Side::Inner => say!("page.side.inner"),
    }
}

fn look(severity: Severity) -> (&'static str, Icon, &'static str) {
    match severity {
        Severity::Note => ("notice tone-quiet", Icon::Check, key!("page.severity.note")),
        Severity::Warning => ("notice tone-pause", Icon::Warning, key!("page.severity.warning")),
        Severity::Error => ("notice tone-alarm", Icon::Alarm, key!("page.severity.error")),
    }
}

/// One problem: severity, location, meaning, advice; an error has a checkbox to accept it.
pub(crate) fn finding(diagnostic: Diagnostic) -> impl IntoView {
    let (class, sign, word) = look(diagnostic.severity);
    let place = diagnostic.place.clone().filter(|place| place.line > 0).map(|place| {
        move || say!("page.review.place", file = place.file, line = place.line, column = place.column)
    });
    let (what, cure, code) = (diagnostic.clone(), diagnostic.clone(), diagnostic.code.clone());
    let tick = (diagnostic.severity == Severity::Error).then(|| {
        let (seen, flip) = (code.clone(), code);
        tick(
            move || watch(|m| &m.board.accepted).with(|accepted| accepted.contains(&seen)),
            t!("page.review.accept"),
            move |_| send(FilesEvent::FlipAccepted { code: flip.clone() }),
        )
    });
    div().class(class).child((
        icon(sign),
        div().class("grow").child((
            strong().child((move || crate::i18n::text(word, &[]), ": ", move || message(&what))),
            p().child(move || advice(&cure)),
            place.map(|place| p().class("quiet tabular").child(place)),
            tick,
        )),
    ))
}
