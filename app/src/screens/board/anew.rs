//! New exports of the open board: which files came, what changed, each hole that did, and the way back.
//!
//! Comes in: what changed. Goes out: choices of the person, the hole chosen. What changed is marked in the picture too.

use crate::i18n::{self, say, t, unit_word};
use crate::model::{AnewEvent, FrameEvent, NewExports};
use crate::page::{frame, open_board, send};
use crate::widgets::push;
use annulus_core::board::changes::{Changed, Fate};
use annulus_core::board::{Board, Hole};
use leptos::html::{div, h2, header, li, p, section, span, ul};
use leptos::prelude::*;

/// The most holes listed.
const MOST_LISTED: usize = 100;

/// The block; nothing where there is nothing to show.
pub(super) fn block() -> impl IntoView {
    move || open_board().anew.get().map(|anew| shown(&anew))
}

fn shown(anew: &NewExports) -> impl IntoView + use<> {
    let another = anew.compared.as_ref().is_some_and(|compared| compared.changes.may_be_another());
    section().class("block anew").attr("aria-label", t!("page.anew.title")).child((
        header().child(h2().child(t!("page.anew.title"))),
        p().class("quiet").child(files(anew)),
        div().attr("role", "status").child(lines(anew)),
        holes(anew),
        another.then(|| p().class("warning").child(t!("changes.another"))),
        div().class("row").child((
            push("button small primary", t!("page.anew.seen"), |_| send(AnewEvent::Seen)),
            push("button small", t!("page.anew.back"), |_| send(AnewEvent::Back)),
            push("button small", t!("page.anew.another"), |_| send(AnewEvent::Another)),
        )),
    ))
}

/// Which files came and went.
fn files(anew: &NewExports) -> Vec<String> {
    let rows = [
        (!anew.replaced.is_empty()).then(|| say!("page.anew.replaced", names = anew.replaced.join(", "))),
        (!anew.added.is_empty()).then(|| say!("page.anew.added", names = anew.added.join(", "))),
        (!anew.gone.is_empty()).then(|| say!("page.anew.gone", names = anew.gone.join(", "))),
    ];
    rows.into_iter().flatten().map(|row| row + " ").collect()
}

/// What changed, line by line.
fn lines(anew: &NewExports) -> AnyView {
    let Some(compared) = &anew.compared else {
        let word = if anew.failed { say!("page.anew.failed") } else { say!("page.anew.looking") };
        return p().child(word).into_any();
    };
    if compared.changes.is_none() {
        return p().child(say!("changes.none")).into_any();
    }
    let line = |(key, args): (&'static str, Vec<(&'static str, String)>)| li().child(i18n::text(key, &args));
    ul().class("changes").child(compared.changes.lines().into_iter().map(line).collect::<Vec<_>>()).into_any()
}

/// Every hole that changed; pressed, one that is there is chosen in the picture.
fn holes(anew: &NewExports) -> impl IntoView + use<> {
    let holes = anew.compared.iter().flat_map(|compared| &compared.changes.holes);
    let rows: Vec<_> = holes.take(MOST_LISTED).map(|hole| li().child(row(hole))).collect();
    (!rows.is_empty()).then(|| ul().class("changes holes").child(rows))
}

fn row(changed: &Changed<Hole>) -> AnyView {
    let unit = frame().unit.get();
    let at = |hole: &Option<Hole>| {
        hole.as_ref().map(|hole| {
            format!("X {} Y {}", unit.coordinate(hole.at.x.mm()), unit.coordinate(hole.at.y.mm()))
        })
    };
    let size = |hole: &Option<Hole>| {
        let length = hole.as_ref()?.diameter?;
        Some(format!("⌀ {}", unit.size(length.mm())))
    };
    let pair = |before: Option<String>, now: Option<String>| match (before, now) {
        (Some(before), Some(now)) if before != now => format!("{before} → {now}"),
        (Some(one), _) | (None, Some(one)) => one,
        (None, None) => String::new(),
    };
    let place = i18n::number(pair(at(&changed.before), at(&changed.now)));
    let size = i18n::number(pair(size(&changed.before), size(&changed.now)));
    let hole = match size.is_empty() {
        true => say!("page.anew.hole", place = place, unit = unit_word()),
        false => say!("page.anew.hole_sized", place = place, size = size, unit = unit_word()),
    };
    let what = match changed.fate {
        Fate::Added => say!("page.anew.hole_added", hole = hole),
        Fate::Gone => say!("page.anew.hole_gone", hole = hole),
        Fate::Moved => say!("page.anew.hole_moved", hole = hole),
        Fate::Resized => say!("page.anew.hole_resized", hole = hole),
        Fate::Replated => say!("page.anew.hole_replated", hole = hole),
    };
    let Some(now) = changed.now.clone() else { return span().class("quiet").child(what).into_any() };
    let choose = move |_| {
        let index = |board: &Board| board.holes.iter().position(|other| *other == now);
        let chosen =
            open_board().document.with_untracked(|document| index(&document.as_ref()?.reading.board));
        send(FrameEvent::Select { hole: chosen.map(|index| index as u32) });
    };
    push("button small quiet", move || what.clone(), choose).into_any()
}
