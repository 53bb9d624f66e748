//! The tools with their counts, and the list of holes; selecting a row selects the hole in the picture and
//! vice versa.

use super::rows::{self, Row, Tool, swatch};
use crate::i18n::{say, t};
use crate::model::FrameEvent;
use crate::page::{read, send, shared};
use crate::screens::shown::zero;
use crate::widgets::{row_top, virtual_list};
use annulus_core::board::Board;
use annulus_core::units::Length;
use leptos::ev;
use leptos::html::{div, h2, header, section, span, table, tbody, td, th, thead, tr};
use leptos::prelude::*;
use std::sync::Arc;

#[derive(Clone, PartialEq)]
struct Listed {
    board: Board,
    tools: Vec<Tool>,
    rows: Vec<Row>,
}

fn listed() -> Memo<Option<Arc<Listed>>> {
    Memo::new(move |_| {
        let document = shared(|m| &m.board.document).get()?;
        let board = document.reading.board.clone();
        let tools = shared(|m| &m.board.plan).with(|plan| rows::tools(&board, plan.as_deref()));
        let rows = rows::rows(&tools);
        Some(Arc::new(Listed { board, tools, rows }))
    })
}

pub(crate) fn holes() -> impl IntoView {
    let listed = listed();
    let count = move || listed.with(|listed| listed.as_ref().map_or(0, |listed| listed.board.holes.len()));
    (
        section().class("block").attr("aria-label", t!("page.holes.tools")).child((
            header().child((
                h2().child(t!("page.holes.title")),
                span().class("quiet tabular").child(move || say!("page.holes.count", count = count())),
            )),
            move || listed.get().map(|listed| tool_table(&listed)),
        )),
        list(listed),
    )
}

fn tool_table(listed: &Listed) -> impl IntoView + use<> {
    let lines = listed.tools.iter().map(|tool| tool_line(&listed.board, tool).into_any());
    table().class("tools-table").child((
        thead().child(tr().child((
            th().attr("scope", "col").child(t!("page.holes.size")),
            th().attr("scope", "col").class("number").child(t!("page.holes.bit")),
            th().attr("scope", "col").class("number").child(t!("page.holes.number")),
            th().attr("scope", "col").child(t!("page.holes.plated")),
        ))),
        tbody().child(lines.collect::<Vec<_>>()),
    ))
}

fn size_text(size: Option<Length>) -> String {
    let unit = read(|m| m.frame.unit);
    size.map_or_else(|| say!("page.holes.unsized"), |size| crate::i18n::number(unit.size(size.mm())))
}

fn plated_text((plated, bare): (usize, usize), all: usize) -> String {
    match (plated, bare) {
        (0, 0) => say!("page.holes.not_said"),
        (plated, 0) if plated == all => say!("page.holes.all_plated"),
        (0, bare) if bare == all => say!("page.holes.none_plated"),
        (plated, _) => say!("page.holes.some_plated", plated = plated, all = all),
    }
}

fn tool_line(board: &Board, tool: &Tool) -> impl IntoView + use<> {
    let colour = swatch(board, tool.sizes.first().copied());
    let (sizes, bit, holes, plated) = (tool.sizes.clone(), tool.bit, tool.holes.len(), tool.plated);
    let names = move || {
        if sizes.is_empty() {
            return size_text(None);
        }
        sizes.iter().map(|size| size_text(Some(*size))).collect::<Vec<_>>().join(", ")
    };
    tr().child((
        td().child((span().class("swatch").style(("--swatch", colour)), " ", names)),
        td().class("number").child(move || bit.map_or_else(|| "–".to_owned(), |bit| size_text(Some(bit)))),
        td().class("number").child(holes),
        td().child(move || plated_text(plated, holes)),
    ))
}

fn list(listed: Memo<Option<Arc<Listed>>>) -> impl IntoView {
    let count =
        Signal::derive(move || listed.with(|listed| listed.as_ref().map_or(0, |listed| listed.rows.len())));
    let chosen = Memo::new(move |_| {
        let wanted = read(|m| m.frame.selected)?;
        let is = |row: &Row| matches!(row, Row::Hole(hole, _) if *hole == wanted);
        listed.with(|listed| listed.as_ref()?.rows.iter().position(is))
    });
    let row =
        move |index: usize| listed.with(|listed| Some(line(listed.as_ref()?, index))).flatten().into_any();
    let walk = move |by: i64| {
        listed.with_untracked(|listed| {
            let Some(listed) = listed else { return };
            let last = listed.rows.len() as i64 - 1;
            let from = chosen.get_untracked().map_or(-1, |at| at as i64);
            let mut at = (from + by).clamp(0, last.max(0));
            if matches!(listed.rows.get(at as usize), Some(Row::Tool(_))) {
                at = (at + by.signum()).clamp(0, last.max(0));
            }
            if let Some(Row::Hole(hole, _)) = listed.rows.get(at as usize) {
                send(FrameEvent::Select { hole: Some(*hole) });
            }
        });
    };
    virtual_list(t!("page.holes.list"), count, chosen.into(), row, walk)
}

fn line(listed: &Listed, index: usize) -> Option<AnyView> {
    match *listed.rows.get(index)? {
        Row::Tool(tool) => Some(head(listed, tool, index)),
        Row::Hole(hole, number) => Some(hole_line(listed, hole, number, index)),
    }
}

fn head(listed: &Listed, tool: usize, index: usize) -> AnyView {
    let Some(tool) = listed.tools.get(tool) else { return ().into_any() };
    let size = tool.bit.or_else(|| tool.sizes.first().copied());
    let count = tool.holes.len();
    let text = move || {
        say!("page.holes.head", size = size_text(size), unit = crate::i18n::unit_word(), count = count)
    };
    div()
        .class("line head")
        .attr("role", "presentation")
        .style(("top", row_top(index)))
        .child(span().child(text))
        .into_any()
}

fn hole_line(listed: &Listed, hole: u32, number: usize, index: usize) -> AnyView {
    let Some(meant) = listed.board.holes.get(hole as usize).cloned() else { return ().into_any() };
    let colour = swatch(&listed.board, meant.diameter);
    let chosen = move || read(|m| m.frame.selected) == Some(hole);
    let coordinate = |mm: f64| crate::i18n::number(read(|m| m.frame.unit).coordinate(mm));
    let (x, y) = (meant.at.x, meant.at.y);
    let in_file = move || say!("page.holes.in_file", x = coordinate(x.mm()), y = coordinate(y.mm()));
    div()
        .class("line hole-line")
        .attr("role", "option")
        .attr("id", format!("hole-{hole}"))
        .attr("aria-selected", move || if chosen() { "true" } else { "false" })
        .attr("title", in_file)
        .style(("top", row_top(index)))
        .on(ev::click, move |_| send(FrameEvent::Select { hole: Some(hole) }))
        .child((
            span().class("swatch").style(("--swatch", colour)),
            span().child(move || say!("page.holes.hole", number = number)),
            span().class("number").child(move || coordinate((x - zero().x).mm())),
            span().class("number").child(move || coordinate((y - zero().y).mm())),
        ))
        .into_any()
}
