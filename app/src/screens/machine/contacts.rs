//! Where drill strokes ended on their sensor: a map of the holes, and a table of the largest deviations.
//! Moves nothing.
//!
//! ```text
//!  ◍  ●  ●      ring colour: higher or lower than the median                X 12.0 Y 4.0   −1.70   +0.30
//!  ●  ●  ◌      table: largest deviation first                              …
//! ```

use crate::i18n::{number, say, t};
use crate::model::link::contacts::ContactRow;
use crate::page::shared;
use leptos::html::{details, div, p, summary, table, tbody, td, th, thead, tr};
use leptos::prelude::*;
use leptos::svg::{circle, svg};

const LISTED: usize = 12;
const FULL_MM: f64 = 0.1;

fn mm(mm: f64) -> String {
    number(format!("{mm:.3}"))
}

fn signed(mm: f64) -> String {
    number(format!("{mm:+.3}"))
}

pub(super) fn contacts() -> impl IntoView {
    let rows = Memo::new(move |_| {
        let contacts = shared(|m| &m.link.contacts).get();
        shared(|m| &m.start.shown).with(|job| {
            let of = job.as_ref().filter(|job| job.key == contacts.job);
            of.map(|job| contacts.rows(&job.program)).unwrap_or_default()
        })
    });
    let middle =
        move || shared(|m| &m.link.contacts).with(|contacts| contacts.middle_mm()).unwrap_or_default();
    let any = Memo::new(move |_| rows.with(|rows| !rows.is_empty()));
    let found = move || {
        let (holes, most) = rows.with(|rows| (rows.len(), rows.first().map_or(0.0, |row| row.off_mm.abs())));
        say!("page.contacts.found", holes = holes, middle = mm(middle()), most = mm(most))
    };
    let unrecorded = move || {
        let holes =
            shared(|m| &m.start.shown).with(|job| job.as_ref().map_or(0, |job| job.program.hole_count()));
        let unrecorded = holes.saturating_sub(rows.with(Vec::len));
        (unrecorded > 0).then(|| say!("page.contacts.unrecorded", holes = unrecorded))
    };
    let more = move || {
        let more = rows.with(Vec::len).saturating_sub(LISTED);
        (more > 0).then(|| say!("page.contacts.more", holes = more))
    };
    move || {
        any.get().then(|| {
            details().class("block contacts").child((
                summary().child(t!("page.contacts.title")),
                p().class("tabular").attr("role", "status").child(found),
                p().class("quiet").child(t!("page.contacts.is")),
                p().class("quiet").child(unrecorded),
                move || map(&rows.get()),
                div().class("wide-table").child(listed(rows)),
                p().class("quiet").child(more),
            ))
        })
    }
}

fn listed(rows: Memo<Vec<ContactRow>>) -> impl IntoView {
    let cell = |words: fn() -> String| th().attr("scope", "col").child(words);
    let row = |row: ContactRow| {
        let (x, y) = (number(format!("{:.2}", row.at.x.mm())), number(format!("{:.2}", row.at.y.mm())));
        tr().child((
            th().attr("scope", "row").child(format!("X {x} Y {y}")),
            td().class("tabular").child(mm(row.height_mm)),
            td().class("tabular").child(signed(row.off_mm)),
        ))
    };
    table().attr("aria-label", t!("page.contacts.title")).child((
        thead().child(tr().child((
            cell(|| say!("page.contacts.place")),
            cell(|| say!("page.contacts.height")),
            cell(|| say!("page.contacts.off")),
        ))),
        tbody().child(move || rows.get().into_iter().take(LISTED).map(row).collect::<Vec<_>>()),
    ))
}

/// One ring per hole, Y up: blue if the stroke ended above the median, orange if below.
fn map(rows: &[ContactRow]) -> impl IntoView + use<> {
    let places = || rows.iter().map(|row| [row.at.x.mm(), -row.at.y.mm()]);
    let span = |axis: usize| {
        let along = || places().map(|place| place[axis]);
        (along().fold(f64::MAX, f64::min), along().fold(f64::MIN, f64::max))
    };
    let ((left, right), (top, bottom)) = (span(0), span(1));
    let ring = ((right - left) + (bottom - top)).max(1.0) * 0.018;
    let full = rows.iter().map(|row| row.off_mm.abs()).fold(FULL_MM, f64::max);
    // Largest deviations last, so that they are drawn over the others.
    let rings = rows.iter().rev().map(|row| {
        let share = (row.off_mm.abs() / full).min(1.0);
        let hue = if row.off_mm > 0.0 { 220 } else { 25 };
        let colour = format!("hsl({hue} {:.0}% 50%)", 15.0 + 75.0 * share);
        let shape = circle().attr("cx", row.at.x.mm()).attr("cy", -row.at.y.mm());
        shape.attr("r", ring * (0.7 + 0.6 * share)).attr("stroke", colour)
    });
    let rings: Vec<_> = rings.collect();
    let pad = 2.0 * ring;
    let frame =
        format!("{} {} {} {}", left - pad, top - pad, right - left + 2.0 * pad, bottom - top + 2.0 * pad);
    svg()
        .attr("viewBox", frame)
        .attr("role", "img")
        .attr("aria-label", t!("page.contacts.title"))
        .child(rings)
}
