//! The tree of the drawing: groups and their members.

use super::inputs::layer_word;
use crate::drawing::tree::TreeRow;
use crate::i18n::{self, number, say, t};
use crate::model::DrawEvent;
use crate::page::{peek, read, send, shared, watch};
use crate::widgets::{push, row_top, virtual_list};
use annulus_core::board::drawing::{Catch, Id, Thing};
use annulus_core::geometry::Point;
use annulus_core::units::Length;
use leptos::ev::{self, DragEvent, KeyboardEvent, MouseEvent};
use leptos::html::{div, h2, header, p, section, span};
use leptos::prelude::*;

const DRAGGED: &str = "application/x-annulus-thing";

pub(super) fn tree() -> impl IntoView {
    let count = Signal::derive(move || read(|m| m.draw.shown.tree.len()));
    let at = Memo::new(move |_| {
        let wanted = read(|m| m.draw.editor.chosen.first().copied())?;
        shared(|m| &m.draw.shown.tree).with(|rows| rows.iter().position(|row| row.item.catch == wanted))
    });
    let row = move |index: usize| {
        // The memo rebuilds a row only if that row changed, not whenever the tree did.
        let row = Memo::new(move |_| shared(|m| &m.draw.shown.tree).with(|rows| rows.get(index).cloned()));
        (move || row.get().map(|row| line(&row, index))).into_any()
    };
    let walk = move |by: i64| {
        let from = at.get_untracked().map_or(if by > 0 { -1 } else { 0 }, |at| at as i64);
        let chosen = shared(|m| &m.draw.shown.tree).with_untracked(|rows| {
            let to = (from + by).clamp(0, rows.len().saturating_sub(1) as i64);
            rows.get(to as usize).map(|row| row.item.id)
        });
        // After the rows are released: selecting writes to them.
        if let Some(id) = chosen {
            send(DrawEvent::Choose { id, adding: false });
        }
    };
    section()
        .class("block draw-tree")
        .attr("aria-label", t!("page.draw.tree"))
        .on(ev::keydown, by_key)
        .on(ev::dragover, |event| {
            is_line(&event);
        })
        .on(ev::drop, |event| dropped(&event, None))
        .child((
            header().child((h2().child(t!("page.draw.tree")), open_button())),
            move || (count.get() == 0).then(|| p().class("quiet").child(t!("page.draw.empty"))),
            virtual_list(t!("page.draw.tree"), count, at.into(), row, walk),
        ))
}

/// Alt and an arrow moves the selection between groups; an arrow alone opens or closes a group.
fn by_key(event: KeyboardEvent) {
    let into = match event.key().as_str() {
        "ArrowRight" => true,
        "ArrowLeft" => false,
        _ => return,
    };
    if event.ctrl_key() || event.shift_key() || event.meta_key() {
        return;
    }
    event.prevent_default();
    event.stop_propagation();
    if event.alt_key() {
        send(DrawEvent::Beside { into });
        return;
    }
    let group = shared(|m| &m.draw.shown.tree).with_untracked(|rows| {
        let shown = peek(|m| m.draw.editor.chosen.first().copied())?;
        rows.iter().find(|row| row.item.catch == shown && row.open == Some(!into)).map(|row| row.item.id)
    });
    group.into_iter().for_each(|id| send(DrawEvent::Open { id }));
}

/// Drops a row: moves its thing into `group`, or to the top level.
fn dropped(event: &DragEvent, group: Option<Id>) {
    let text = event.data_transfer().and_then(|data| data.get_data(DRAGGED).ok()).unwrap_or_default();
    if let Ok(id) = text.parse::<u32>() {
        event.prevent_default();
        event.stop_propagation();
        send(DrawEvent::Regroup { id: Id(id), group });
    }
}

/// True for a dragged row, which may be dropped here; false for a file.
fn is_line(event: &DragEvent) -> bool {
    let is_line = event.data_transfer().is_some_and(|data| data.types().includes(&DRAGGED.into(), 0));
    if is_line {
        event.prevent_default();
        event.stop_propagation();
    }
    is_line
}

fn open_button() -> impl IntoView {
    let group = Memo::new(move |_| {
        let shown = read(|m| m.draw.editor.chosen.first().copied())?;
        shared(|m| &m.draw.shown.tree).with(|rows| {
            let row = rows.iter().find(|row| row.item.catch == shown)?;
            row.open.map(|open| (row.item.id, open))
        })
    });
    move || {
        group.get().map(|(id, open)| {
            let word =
                move || if open { say!("page.draw.close_group") } else { say!("page.draw.open_group") };
            push("button small", word, move |_| send(DrawEvent::Open { id }))
        })
    }
}

fn place(at: Point) -> String {
    let unit = read(|m| m.frame.unit);
    format!("{} {}", number(unit.short(at.x.mm())), number(unit.short(at.y.mm())))
}

fn words(row: &TreeRow) -> String {
    let unit = read(|m| m.frame.unit);
    let size = |length: Length| number(unit.short(length.mm()));
    match &row.item.thing {
        Thing::Group { name } => name.clone(),
        Thing::Track { width, layer, .. } => {
            say!("page.draw.line.track", width = size(*width), layer = i18n::text(layer_word(*layer), &[]))
        }
        Thing::Pad { size: across, layer, .. } => {
            say!("page.draw.line.pad", size = size(*across), layer = i18n::text(layer_word(*layer), &[]))
        }
        Thing::Hole { diameter, .. } => say!("page.draw.line.hole", size = size(*diameter)),
        Thing::Node { .. } => say!("page.draw.line.node"),
        Thing::Imported { file, by: None, .. } => say!("page.draw.line.taken_out", file = file),
        Thing::Imported { file, copy: true, .. } => say!("page.draw.line.copy", file = file),
        thing @ Thing::Imported { file, .. } if thing.is_as_in_its_file() => {
            say!("page.draw.line.as_in_file", file = file)
        }
        Thing::Imported { file, turn_mdeg: 0, mirror: false, .. } => {
            say!("page.draw.line.moved", file = file)
        }
        Thing::Imported { file, .. } => say!("page.draw.line.turned", file = file),
    }
}

fn is_chosen(catch: Catch) -> bool {
    watch(|m| &m.draw.editor.chosen).with(|chosen| chosen.contains(&catch))
}

fn line(row: &TreeRow, index: usize) -> AnyView {
    let (id, catch, depth, open) = (row.item.id, row.item.catch, row.depth, row.open);
    let own = row.clone();
    let sign = open.map(|open| if open { "▾" } else { "▸" });
    let press = move |event: MouseEvent| {
        let adding = event.shift_key() || event.ctrl_key() || event.meta_key();
        send(DrawEvent::Choose { id, adding });
    };
    let at = row.item.at;
    // Dropping on a group moves into it; dropping on another row moves into that row's group.
    let target = if open.is_some() { Some(id) } else { row.item.group };
    let aimed = RwSignal::new(false);
    let places = move || {
        let places = [at.0, at.1].into_iter().flatten().map(place);
        places.collect::<Vec<_>>().join(" → ")
    };
    div()
        .class("line draw-line")
        .attr("role", "option")
        .attr("id", format!("thing-{}", id.0))
        .attr("aria-selected", move || if is_chosen(catch) { "true" } else { "false" })
        .style(("top", row_top(index)))
        .style(("padding-inline-start", format!("{}px", 12 + 14 * depth.min(12))))
        .attr("draggable", "true")
        .class(("aimed", move || aimed.get()))
        .on(ev::dragstart, move |event| {
            if let Some(data) = event.data_transfer() {
                let _ = data.set_data(DRAGGED, &id.0.to_string());
            }
        })
        .on(ev::dragover, move |event| {
            if is_line(&event) {
                aimed.set(true);
            }
        })
        .on(ev::dragleave, move |_| aimed.set(false))
        .on(ev::drop, move |event| {
            aimed.set(false);
            dropped(&event, target);
        })
        .on(ev::click, press)
        .on(ev::dblclick, move |_| {
            if open.is_some() {
                send(DrawEvent::Open { id });
            }
        })
        .child((
            span().class("cut").child((
                sign.map(|sign| span().attr("aria-hidden", "true").child(sign)),
                " ",
                move || words(&own),
            )),
            span().class("number quiet").child(places),
        ))
        .into_any()
}
