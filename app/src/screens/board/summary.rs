//! The board in a few lines: size, copper, nets, holes and slots by size, and what no tool can make.

use crate::i18n::{self, key, message, number, say, t};
use crate::layers::LayerKind;
use crate::page::{read, shared};
use crate::widgets::fact;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::units::Length;
use leptos::html::{dl, h2, header, li, section, ul};
use leptos::prelude::*;
use std::collections::BTreeMap;

/// Further sizes are only counted.
const MOST_SIZES: usize = 6;

/// Errors about parts that no tool fits.
const NO_TOOL: [&str; 6] = [
    key!("plan.no_bit"),
    key!("cam.holes_missing"),
    key!("cam.slots_missing"),
    key!("cam.cut_outs_missing"),
    key!("cam.no_bit_for_pins"),
    key!("cam.no_bit_for_bites"),
];

pub(super) fn summary() -> impl IntoView {
    section().class("block summary").attr("aria-label", t!("page.summary.title")).child((
        header().child(h2().child(t!("page.summary.title"))),
        dl().class("facts").child((
            fact(t!("page.summary.size"), size),
            fact(t!("page.summary.copper"), copper),
            fact(t!("page.summary.nets"), nets),
            fact(t!("page.summary.holes"), holes),
            fact(t!("page.summary.slots"), slots),
        )),
        missing(),
    ))
}

/// Width and height of the outline.
fn size() -> String {
    let bounds = shared(|m| &m.board.document)
        .with(|document| document.as_ref().and_then(|document| document.reading.board.outline.bounds()));
    let Some(bounds) = bounds else { return say!("page.summary.no_outline") };
    let unit = read(|m| m.frame.unit);
    let [x, y] = [bounds.max.x - bounds.min.x, bounds.max.y - bounds.min.y]
        .map(|length| number(unit.short(length.mm())));
    say!("page.summary.size_is", x = x, y = y, unit = i18n::unit_word())
}

/// The sides with copper.
fn copper() -> String {
    let count = |wanted: LayerKind| {
        shared(|m| &m.board.document).with(|document| {
            let layers = document.iter().flat_map(|document| &document.reading.layers);
            layers.filter(|layer| LayerKind::of(layer.role, layer.side) == wanted).count()
        })
    };
    let sides = [
        (LayerKind::CopperTop, say!("page.side.top")),
        (LayerKind::CopperInner, say!("page.layers.inner")),
        (LayerKind::CopperBottom, say!("page.side.bottom")),
    ];
    let there = sides.into_iter().filter(|(kind, _)| count(*kind) > 0);
    let names: Vec<String> = there.map(|(_, name)| name).collect();
    if names.is_empty() { say!("page.summary.none") } else { names.join(", ") }
}

/// The nets of the side that is up, which the proof counts.
fn nets() -> String {
    let nets = shared(|m| &m.board.proved).with(|proved| proved.as_ref().map(|proved| proved.outcome.nets));
    nets.map_or_else(|| "–".to_owned(), |nets| nets.to_string())
}

fn holes() -> String {
    shared(|m| &m.board.document).with(|document| {
        let holes = document.iter().flat_map(|document| &document.reading.board.holes);
        by_size(holes.map(|hole| hole.diameter))
    })
}

fn slots() -> String {
    shared(|m| &m.board.document).with(|document| {
        let slots = document.iter().flat_map(|document| &document.reading.board.slots);
        by_size(slots.map(|slot| slot.width))
    })
}

/// `22: 16 × 0.8, 6 × 1.0 mm`; parts without a size come first.
fn by_size(sizes: impl Iterator<Item = Option<Length>>) -> String {
    let mut counts: BTreeMap<Option<Length>, usize> = BTreeMap::new();
    for size in sizes {
        *counts.entry(size).or_default() += 1;
    }
    let all: usize = counts.values().sum();
    if all == 0 {
        return say!("page.summary.none");
    }
    let unit = read(|m| m.frame.unit);
    let one = |(size, count): (&Option<Length>, &usize)| match size {
        Some(size) => format!("{count} × {}", number(unit.size(size.mm()))),
        None => format!("{count} × ?"),
    };
    let mut listed: Vec<String> = counts.iter().take(MOST_SIZES).map(one).collect();
    if counts.len() > MOST_SIZES {
        listed.push("…".to_owned());
    }
    say!("page.summary.by_size", count = all, sizes = listed.join(", "), unit = i18n::unit_word())
}

/// What the plan leaves out for want of a tool.
fn missing() -> impl IntoView {
    let found = Memo::new(move |_| {
        shared(|m| &m.board.plan).with(|plan| {
            let all = plan.iter().flat_map(|plan| &plan.diagnostics);
            let wanted = all.filter(|diagnostic| NO_TOOL.contains(&diagnostic.code.as_str()));
            wanted.cloned().collect::<Vec<Diagnostic>>()
        })
    });
    let line = |diagnostic: Diagnostic| li().child(move || message(&diagnostic)).into_any();
    move || {
        let lines: Vec<AnyView> = found.get().into_iter().map(line).collect();
        (!lines.is_empty())
            .then(|| ul().class("missing").attr("aria-label", t!("page.summary.missing")).child(lines))
    }
}
