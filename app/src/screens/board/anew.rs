//! New exports of the open board: replaced files, changed holes and slots, and undo. The picture marks the
//! changes too.

use crate::i18n::{self, say, t, unit_word};
use crate::model::{AnewEvent, FrameEvent, NewExports};
use crate::page::{read, send, shared};
use crate::screens::shown::zero;
use crate::widgets::push;
use annulus_core::board::changes::{Changed, Fate};
use annulus_core::board::{Board, Hole, Slot};
use annulus_core::geometry::Point;
use annulus_core::units::Length;
use leptos::html::{div, h2, header, li, p, section, span, ul};
use leptos::prelude::*;

const MOST_LISTED: usize = 100;

pub(super) fn block() -> impl IntoView {
    move || shared(|m| &m.anew.shown).get().map(|anew| shown(&anew))
}

fn shown(anew: &NewExports) -> impl IntoView + use<> {
    let another = anew.compared.as_ref().is_some_and(|compared| compared.changes.may_be_another());
    section().class("block anew").attr("aria-label", t!("page.anew.title")).child((
        header().child(h2().child(t!("page.anew.title"))),
        p().class("quiet").child(files(anew)),
        div().attr("role", "status").child(lines(anew)),
        changed(anew),
        another.then(|| p().class("warning").child(t!("changes.another"))),
        div().class("row").child((
            push("button small primary", t!("page.anew.seen"), |_| send(AnewEvent::Seen)),
            push("button small", t!("page.anew.back"), |_| send(AnewEvent::Back)),
            push("button small", t!("page.anew.another"), |_| send(AnewEvent::Another)),
        )),
    ))
}

fn files(anew: &NewExports) -> Vec<String> {
    let rows = [
        (!anew.replaced.is_empty()).then(|| say!("page.anew.replaced", names = anew.replaced.join(", "))),
        (!anew.added.is_empty()).then(|| say!("page.anew.added", names = anew.added.join(", "))),
        (!anew.gone.is_empty()).then(|| say!("page.anew.gone", names = anew.gone.join(", "))),
    ];
    rows.into_iter().flatten().map(|row| row + " ").collect()
}

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

/// The changed holes and slots, up to a limit. Pressing a hole selects it in the picture.
fn changed(anew: &NewExports) -> impl IntoView + use<> {
    let compared = anew.compared.as_ref()?;
    let (holes, slots) = (&compared.changes.holes, &compared.changes.slots);
    let more = (holes.len() + slots.len()).saturating_sub(MOST_LISTED);
    let rows = holes.iter().map(hole_row).chain(slots.iter().map(slot_row));
    let rows: Vec<_> = rows.take(MOST_LISTED).map(|row| li().child(row)).collect();
    (!rows.is_empty()).then(|| {
        (
            ul().class("changes holes").child(rows),
            (more > 0).then(|| p().class("quiet").child(t!("page.anew.more", count = more))),
        )
    })
}

fn pair<T>(changed: &Changed<T>, words: impl Fn(&T) -> Option<String>) -> String {
    let (before, now) = (changed.before.as_ref().and_then(&words), changed.now.as_ref().and_then(&words));
    let text = match (before, now) {
        (Some(before), Some(now)) if before != now => format!("{before} → {now}"),
        (before, now) => now.or(before).unwrap_or_default(),
    };
    i18n::number(text)
}

fn at(place: Point) -> String {
    let (unit, zero) = (read(|m| m.frame.unit), zero());
    let [x, y] = [place.x - zero.x, place.y - zero.y].map(|length| unit.coordinate(length.mm()));
    format!("X {x} Y {y}")
}

fn size(length: Option<Length>) -> Option<String> {
    Some(read(|m| m.frame.unit).size(length?.mm()))
}

fn fate(fate: Fate, what: String) -> String {
    match fate {
        Fate::Added => say!("page.anew.one_added", what = what),
        Fate::Gone => say!("page.anew.one_gone", what = what),
        Fate::Moved => say!("page.anew.one_moved", what = what),
        Fate::Resized => say!("page.anew.one_resized", what = what),
        Fate::Replated => say!("page.anew.one_replated", what = what),
    }
}

fn hole_row(changed: &Changed<Hole>) -> AnyView {
    let place = pair(changed, |hole| Some(at(hole.at)));
    let size = pair(changed, |hole| Some(format!("⌀ {}", size(hole.diameter)?)));
    let what = match size.is_empty() {
        true => say!("page.anew.hole", place = place, unit = unit_word()),
        false => say!("page.anew.hole_sized", place = place, size = size, unit = unit_word()),
    };
    let words = fate(changed.fate, what);
    let Some(now) = changed.now.clone() else { return still(words) };
    let choose = move |_| {
        let index = |board: &Board| board.holes.iter().position(|other| *other == now);
        let chosen =
            shared(|m| &m.board.document).with_untracked(|document| index(&document.as_ref()?.reading.board));
        send(FrameEvent::Select { hole: chosen.map(|index| index as u32) });
    };
    push("button small quiet", move || words.clone(), choose).into_any()
}

fn slot_row(changed: &Changed<Slot>) -> AnyView {
    let ends = |slot: &Slot| Some(format!("{} – {}", at(*slot.path.first()?), at(*slot.path.last()?)));
    let (place, size) = (pair(changed, ends), pair(changed, |slot| size(slot.width)));
    let what = match size.is_empty() {
        true => say!("page.anew.slot", place = place, unit = unit_word()),
        false => say!("page.anew.slot_sized", place = place, size = size, unit = unit_word()),
    };
    still(fate(changed.fate, what))
}

fn still(words: String) -> AnyView {
    span().class("quiet").child(words).into_any()
}
