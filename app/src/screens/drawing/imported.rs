//! The objects of the open files, listed by kind: keyboard access to what a press in the picture selects.
//! Deleted objects are only in the tree.

use super::inputs::layer_word;
use crate::drawing::kinds::{ImportedKind, of_kind};
use crate::drawing::tree::TreeRow;
use crate::i18n::{self, key, number, say, t};
use crate::model::DrawEvent;
use crate::page::{read, send, shared, watch};
use crate::widgets::{menu_word, row_top, virtual_list};
use annulus_core::board::drawing::{Catch, Imported, Thing};
use annulus_core::units::Length;
use leptos::ev;
use leptos::html::{div, h2, header, section, select, span};
use leptos::prelude::*;
use std::collections::BTreeSet;

fn kind_word(kind: ImportedKind) -> &'static str {
    match kind {
        ImportedKind::Hole => key!("page.draw.imported.holes"),
        ImportedKind::Pad => key!("page.draw.imported.pads"),
        ImportedKind::Track => key!("page.draw.imported.tracks"),
        ImportedKind::Area => key!("page.draw.imported.areas"),
    }
}

/// The block; nothing if there are no files.
pub(super) fn imported() -> impl IntoView {
    move || read(|m| !m.draw.editor.finder().imported().is_empty()).then(|| block().into_any())
}

fn taken_out(row: &TreeRow) -> Option<u32> {
    match (&row.item.thing, row.item.catch) {
        (Thing::Imported { by: None, .. }, Catch::Imported(of)) => Some(of),
        _ => None,
    }
}

fn block() -> impl IntoView {
    let kind = RwSignal::new(ImportedKind::default());
    let gone = Memo::new(move |_| {
        shared(|m| &m.draw.shown.tree)
            .with(|rows| rows.iter().filter_map(taken_out).collect::<BTreeSet<u32>>())
    });
    let listed = Memo::new(move |_| {
        gone.with(|gone| {
            shared(|m| m.draw.editor.finder().imported())
                .with(|all| of_kind(all, kind.get(), |of| gone.contains(&of)))
        })
    });
    let count = Signal::derive(move || listed.with(Vec::len));
    let at = Memo::new(move |_| {
        let Some(Catch::Imported(of)) = read(|m| m.draw.editor.chosen.first().copied()) else { return None };
        listed.with(|listed| listed.binary_search(&of).ok())
    });
    let row = move |index: usize| {
        let of = Memo::new(move |_| listed.with(|listed| listed.get(index).copied()));
        (move || of.get().map(|of| line(of, index))).into_any()
    };
    let walk = move |by: i64| {
        let from = at.get_untracked().map_or(if by > 0 { -1 } else { 0 }, |at| at as i64);
        let chosen = listed.with_untracked(|listed| {
            let to = (from + by).clamp(0, listed.len().saturating_sub(1) as i64);
            listed.get(to as usize).copied()
        });
        if let Some(of) = chosen {
            send(DrawEvent::ChooseImported { of });
        }
    };
    let options = ImportedKind::ALL.map(|this| {
        menu_word(this.word(), move || kind.get() == this, move || i18n::text(kind_word(this), &[]))
    });
    let choose = move |event| {
        let word = event_target_value(&event);
        kind.set(ImportedKind::ALL.into_iter().find(|kind| kind.word() == word).unwrap_or_default());
    };
    section().class("block draw-imported").attr("aria-label", t!("page.draw.imported.title")).child((
        header().child((
            h2().child(t!("page.draw.imported.title")),
            select()
                .attr("aria-label", t!("page.draw.imported.kind"))
                .on(ev::change, choose)
                .child(Vec::from(options)),
        )),
        virtual_list(move || i18n::text(kind_word(kind.get()), &[]), count, at.into(), row, walk),
    ))
}

fn words(one: &Imported) -> String {
    let unit = read(|m| m.frame.unit);
    let size = |length: Length| number(unit.short(length.mm()));
    let layer = || one.layer.map_or_else(String::new, |layer| i18n::text(layer_word(layer), &[]));
    let across = |of: Length| Length::from_nm(of.nm() * 2);
    match ImportedKind::of(one) {
        ImportedKind::Hole if one.has_angle() => {
            say!("page.draw.line.slot", size = size(across(one.body.radius)))
        }
        ImportedKind::Hole => say!("page.draw.line.hole", size = size(across(one.body.radius))),
        ImportedKind::Track => {
            say!("page.draw.line.track", width = size(across(one.body.radius)), layer = layer())
        }
        ImportedKind::Area => say!("page.draw.line.area", layer = layer()),
        ImportedKind::Pad => {
            let bounds = one.body.bounds();
            let (x, y) = (bounds.max.x - bounds.min.x, bounds.max.y - bounds.min.y);
            let size = if x == y { size(x) } else { format!("{} × {}", size(x), size(y)) };
            say!("page.draw.line.pad", size = size, layer = layer())
        }
    }
}

fn line(of: u32, index: usize) -> AnyView {
    let Some(one) =
        shared(|m| m.draw.editor.finder().imported()).with_untracked(|all| all.get(of as usize).cloned())
    else {
        return ().into_any();
    };
    let chosen =
        move || watch(|m| &m.draw.editor.chosen).with(|chosen| chosen.contains(&Catch::Imported(of)));
    let at = one.at;
    let place = move || {
        let unit = read(|m| m.frame.unit);
        format!("{} {}", number(unit.short(at.x.mm())), number(unit.short(at.y.mm())))
    };
    div()
        .class("line draw-line")
        .attr("role", "option")
        .attr("aria-selected", move || if chosen() { "true" } else { "false" })
        .style(("top", row_top(index)))
        .on(ev::click, move |_| send(DrawEvent::ChooseImported { of }))
        .child((span().class("cut").child(move || words(&one)), span().class("number quiet").child(place)))
        .into_any()
}
