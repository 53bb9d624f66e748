//! One problem: severity, location, meaning, advice; an error has a checkbox to accept it.

use crate::i18n::{advice, key, message, say, t};
use crate::model::FilesEvent;
use crate::page::{send, watch};
use crate::widgets::{Icon, icon, tick};
use annulus_core::diagnostic::{Diagnostic, Severity};
use leptos::html::{div, p, strong};
use leptos::prelude::*;

fn look(severity: Severity) -> (&'static str, Icon, &'static str) {
    match severity {
        Severity::Note => ("notice tone-quiet", Icon::Check, key!("page.severity.note")),
        Severity::Warning => ("notice tone-pause", Icon::Warning, key!("page.severity.warning")),
        Severity::Error => ("notice tone-alarm", Icon::Alarm, key!("page.severity.error")),
    }
}

pub(crate) fn finding(diagnostic: Diagnostic) -> impl IntoView {
    let (class, sign, word) = look(diagnostic.severity);
    let place = diagnostic.place.clone().filter(|place| place.line > 0).map(|place| {
        move || say!("page.review.place", file = place.file, line = place.line, column = place.column)
    });
    let (what, cure, code) = (diagnostic.clone(), diagnostic.clone(), diagnostic.code.clone());
    let tick = (diagnostic.severity == Severity::Error).then(|| {
        let (seen, flip) = (code.clone(), code);
        tick(
            move || watch(|m| &m.board.accepted).with(|accepted| accepted.contains(&seen)),
            t!("page.review.accept"),
            move |_| send(FilesEvent::FlipAccepted { code: flip.clone() }),
        )
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
