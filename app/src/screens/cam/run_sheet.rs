//! The run sheet: what the job needs and what to run, in order. Can be printed or saved.

use crate::i18n::t;
use crate::model::ExportEvent;
use crate::page::{send, watch};
use crate::widgets::{Dialog, dialog, push};
use annulus_core::post::{RunSheet, SheetRow};
use leptos::html::{br, dd, div, dl, dt, h3, p, table, tbody, td, th, thead, tr};
use leptos::prelude::*;

pub(crate) fn run_sheet() -> impl IntoView {
    let shown = watch(|m| &m.export.run_sheet);
    let close = || send(ExportEvent::CloseRunSheet);
    let foot = (
        push("button", t!("page.close"), move |_| close()),
        push("button", t!("page.sheet.save"), |_| send(ExportEvent::SaveRunSheet)),
        push("button primary", t!("page.sheet.print"), |_| {
            let _ = window().print();
        }),
    );
    dialog(
        Signal::derive(move || shown.with(Option::is_some)),
        close,
        Dialog {
            name: "run-sheet",
            role: "dialog",
            title: Box::new(t!("page.sheet.title")),
            body: (move || shown.get().map(sheet)).into_any(),
            foot: foot.into_any(),
        },
    )
}

fn sheet(sheet: RunSheet) -> impl IntoView {
    let facts = sheet.facts.into_iter().map(|(name, value)| (dt().child(name), dd().child(value)).into_any());
    let heads = sheet.heads.into_iter().map(|head| th().attr("scope", "col").child(head).into_any());
    let rows = sheet.rows.into_iter().map(row);
    div().class("sheet-page").child((
        h3().child(sheet.title),
        dl().child(facts.collect::<Vec<_>>()),
        div().class("wide-table").child(table().child((
            thead().child(tr().child(heads.collect::<Vec<_>>())),
            tbody().child(rows.collect::<Vec<_>>()),
        ))),
        p().child(sheet.foot),
    ))
}

fn row(row: SheetRow) -> AnyView {
    match row {
        SheetRow::Turn(how) => tr().class("turn").child(td().attr("colspan", "7").child(how)).into_any(),
        SheetRow::File(cells) => {
            let cell = |(at, lines): (usize, Vec<String>)| {
                let lines: Vec<AnyView> = lines
                    .into_iter()
                    .enumerate()
                    .map(|(index, line)| ((index > 0).then(br), line).into_any())
                    .collect();
                td().class(if SheetRow::is_number(at) { "number" } else { "" }).child(lines).into_any()
            };
            let cells: Vec<AnyView> = cells.into_iter().enumerate().map(cell).collect();
            tr().child((cells, td().class("box"))).into_any()
        }
    }
}
