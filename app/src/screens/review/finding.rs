//! One finding: its weight, where, what it means, what to do; a loss has a tick to say that it was seen.
//!
//! Comes in: a remark. Goes out: a notice, and accepted losses.

use crate::i18n::{advice, key, message, say, t};
use crate::model::FilesEvent;
use crate::page::{open_board, send};
use crate::widgets::{Icon, icon};
use annulus_core::remark::{Remark, Weight};
use leptos::ev;
use leptos::html::{div, input, label, p, span, strong};
use leptos::prelude::*;

fn look(weight: Weight) -> (&'static str, Icon, &'static str) {
    match weight {
        Weight::Note => ("notice tone-quiet", Icon::Check, key!("page.weight.note")),
        Weight::Doubt => ("notice tone-pause", Icon::Warning, key!("page.weight.doubt")),
        Weight::Loss => ("notice tone-alarm", Icon::Alarm, key!("page.weight.loss")),
    }
}

/// The notice.
pub(crate) fn finding(remark: Remark) -> impl IntoView {
    let (class, sign, word) = look(remark.weight);
    let place = remark.place.clone().filter(|place| place.line > 0).map(|place| {
        move || say!("page.review.place", file = place.file, line = place.line, column = place.column)
    });
    let (what, cure, code) = (remark.clone(), remark.clone(), remark.code.clone());
    let tick = (remark.weight == Weight::Loss).then(|| {
        let desk = open_board();
        let (seen, flip) = (code.clone(), code);
        label().class("tick").child((
            input()
                .attr("type", "checkbox")
                .prop("checked", move || desk.accepted.with(|accepted| accepted.contains(&seen)))
                .on(ev::change, move |_| send(FilesEvent::FlipAccepted { code: flip.clone() })),
            span().child(t!("page.review.accept")),
        ))
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
