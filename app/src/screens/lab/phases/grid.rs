//! The phase table as a grid, edited by keyboard or pointer, and as waveforms under its columns.
//!
//! ```text
//! arrows move │ Shift+arrows extend │ Space toggles │ Ctrl+C, Ctrl+V │ Ctrl+A all │ Delete clears
//! ```

use super::Table;
use crate::i18n::{say, t};
use crate::keys;
use crate::lab::phases::{Cell, CellBlock, LINES, PhaseLine, TableEdit, copied, is_on, stretches, whole};
use crate::model::LabEvent;
use crate::page::{lab, peek, send, watch};
use leptos::ev::{self, KeyboardEvent, MouseEvent};
use leptos::html::{div, span};
use leptos::prelude::*;
use leptos::svg::{path, svg};
use wasm_bindgen::JsCast;
use web_sys::HtmlElement;

fn cell_id(cell: Cell) -> String {
    format!("phase-{}-{}", cell.line, cell.column)
}

/// The grid, rebuilt only when the number of columns changes.
pub(super) fn grid(table: Table) -> impl IntoView {
    let count = Memo::new(move |_| table.columns.with(Vec::len));
    div()
        .class("phase-grid")
        .attr("role", "grid")
        .attr("aria-label", t!("page.lab.phases.grid"))
        .attr("aria-multiselectable", "true")
        .attr("aria-readonly", move || lab::locked().then_some("true"))
        .attr("aria-describedby", "phase-keys")
        .on(ev::keydown, move |event| pressed(table, &event))
        .child(move || {
            let count = count.get();
            let lines =
                LINES.iter().enumerate().map(|(index, line)| row(table, index, *line, count).into_any());
            std::iter::once(heads(table, count).into_any()).chain(lines).collect::<Vec<_>>()
        })
}

fn heads(table: Table, count: usize) -> impl IntoView {
    let columns = (0..count).map(|column| {
        let here = move || table.column() == column;
        div()
            .attr("role", "columnheader")
            .class(move || if here() { "phase-head here" } else { "phase-head" })
            .child(column + 1)
    });
    div().attr("role", "row").class("phase-row").child((
        div().attr("role", "columnheader").class("phase-name").child((
            span().child(t!("page.lab.phases.line")),
            span().class("quiet").child(t!("page.lab.phases.supply")),
        )),
        columns.collect::<Vec<_>>(),
    ))
}

fn row(table: Table, index: usize, line: PhaseLine, count: usize) -> impl IntoView {
    let cells = (0..count).map(|column| cell(table, line, Cell { line: index, column }).into_any());
    div().attr("role", "row").class(if line.volts > 5 { "phase-row boost" } else { "phase-row" }).child((
        div().attr("role", "rowheader").class("phase-name").child((
            span().child(line.name),
            span().class("quiet").child(t!("page.lab.phases.volts", volts = line.volts)),
        )),
        cells.collect::<Vec<_>>(),
    ))
}

fn cell(table: Table, line: PhaseLine, at: Cell) -> impl IntoView {
    let on = Memo::new(move |_| table.columns.with(|columns| is_on(columns, at)));
    let block = watch(|m| &m.lab.block);
    let chosen = Memo::new(move |_| block.with(|block| block.holds(at)));
    let focus = Memo::new(move |_| block.with(|block| block.cursor == at));
    let here = Memo::new(move |_| table.column() == at.column);
    let name = move || {
        let step = at.column + 1;
        if on.get() {
            say!("page.lab.phases.cell_on", line = line.name, takt = step)
        } else {
            say!("page.lab.phases.cell_off", line = line.name, takt = step)
        }
    };
    div()
        .attr("role", "gridcell")
        .attr("id", cell_id(at))
        .attr("tabindex", move || if focus.get() { "0" } else { "-1" })
        .attr("aria-selected", move || if chosen.get() { "true" } else { "false" })
        .attr("aria-label", name)
        .class("phase-cell")
        .class(("on", move || on.get()))
        .class(("here", move || here.get()))
        .on(ev::click, move |event| clicked(table, at, &event))
        .child(span())
}

fn clicked(table: Table, at: Cell, event: &MouseEvent) {
    if event.shift_key() {
        let block = peek(|m| m.lab.block);
        send(LabEvent::Choose { block: CellBlock { cursor: at, ..block } });
    } else {
        send(LabEvent::Choose { block: CellBlock::at(at) });
        table.edit(&TableEdit::Toggle(CellBlock::at(at)));
    }
    focus(at);
}

fn focus(at: Cell) {
    let found =
        document().get_element_by_id(&cell_id(at)).and_then(|cell| cell.dyn_into::<HtmlElement>().ok());
    if let Some(cell) = found {
        let _ = cell.focus();
    }
}

fn pressed(table: Table, event: &KeyboardEvent) {
    let count = table.columns.with_untracked(Vec::len);
    let block = peek(|m| m.lab.block);
    let (ctrl, shift) = (event.ctrl_key() || event.meta_key(), event.shift_key());
    let key = keys::latin(&event.key(), &event.code()).to_ascii_lowercase();
    let far = count as isize;
    let go = |lines: isize, columns: isize| Some(block.moved(lines, columns, shift, count));
    let moved = match (key.as_str(), ctrl) {
        ("arrowup", false) => go(-1, 0),
        ("arrowdown", false) => go(1, 0),
        ("arrowleft", false) => go(0, -1),
        ("arrowright", false) => go(0, 1),
        ("home", _) => go(0, -far),
        ("end", _) => go(0, far),
        ("a", true) => Some(whole(count)),
        _ => None,
    };
    if let Some(moved) = moved {
        event.prevent_default();
        send(LabEvent::Choose { block: moved });
        return focus(moved.cursor);
    }
    match (key.as_str(), ctrl) {
        (" ", false) => table.edit(&TableEdit::Toggle(block)),
        ("c", true) => {
            send(LabEvent::Copy { clip: table.columns.with_untracked(|columns| copied(columns, block)) });
        }
        ("v", true) => {
            if let Some(clip) = peek(|m| m.lab.clip.clone()) {
                let ((line, _), (column, _)) = (block.lines(), block.columns(count));
                table.edit(&TableEdit::Paste { at: Cell { line, column }, clip });
            }
        }
        ("delete", false) => table.edit(&TableEdit::Clear(block)),
        _ => return,
    }
    event.prevent_default();
}

/// The bits of the table as waveforms: high means on. Hidden from screen readers: the grid above has the same
/// data.
pub(super) fn waves(table: Table) -> impl IntoView {
    let lines = LINES.map(|line| {
        div().class(if line.volts > 5 { "wave boost" } else { "wave" }).child((
            span().class("phase-name").child(line.name),
            svg()
                .attr("viewBox", move || format!("0 0 {} 10", table.columns.with(Vec::len)))
                .attr("preserveAspectRatio", "none")
                .class("wave-line")
                .style(("--columns", move || table.columns.with(Vec::len).to_string()))
                .child(path().attr("d", move || table.columns.with(|columns| drawn(columns, line)))),
        ))
    });
    div().class("waves").attr("aria-hidden", "true").child(Vec::from(lines))
}

/// An SVG path: low at 9, high at 1, one unit per column.
fn drawn(columns: &[u8], line: PhaseLine) -> String {
    let high = stretches(columns, line);
    let mut drawn = "M0 9".to_owned();
    for (from, to) in high {
        drawn.push_str(&format!("H{from}V1H{to}V9"));
    }
    drawn.push_str(&format!("H{}", columns.len()));
    drawn
}
