//! One finding: its severity, where, what it means, what to do; an error has a tick to say that it was seen.
//!
//! Comes in: a diagnostic. Goes out: a notice, and accepted errors.

use crate::i18n::{advice, key, message, say, t};
use crate::model::FilesEvent;
use crate::page::{open_board, send};
use crate::widgets::{Icon, icon};
use annulus_core::diagnostic::{Diagnostic, Severity};
use leptos::ev;
use leptos::html::{div, input, label, p, span, strong};
use leptos::prelude::*;

fn look(severity: Severity) -> (&'static str, Icon, &'static str) {
    match severity {
        Severity::Note => ("notice tone-quiet", Icon::Check, key!("page.severity.note")),
        Severity::Warning => ("notice tone-pause", Icon::Warning, key!("page.severity.warning")),
        Severity::Error => ("notice tone-alarm", Icon::Alarm, key!("page.severity.error")),
    }
}

/// The notice.
pub(crate) fn finding(diagnostic: Diagnostic) -> impl IntoView {
    let (class, sign, word) = look(diagnostic.severity);
    let place = diagnostic.place.clone().filter(|place| place.line > 0).map(|place| {
        move || say!("page.review.place", file = place.file, line = place.line, column = place.column)
    });
    let (what, cure, code) = (diagnostic.clone(), diagnostic.clone(), diagnostic.code.clone());
    let tick = (diagnostic.severity == Severity::Error).then(|| {
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
