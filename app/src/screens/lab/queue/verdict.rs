//! What the core says of the whole queue: what it will do, or everything that is wrong, with line and column.
//!
//! Comes in: the queue. Goes out: sentences; whoever presses one is led to its row.

use super::{Work, grid};
use crate::i18n::{advice, message, say, t};
use crate::widgets::{Icon, icon, push};
use annulus_core::remark::Remark;
use leptos::html::{div, li, p, span, strong, ul};
use leptos::prelude::*;

/// The foot of the sheet.
pub(super) fn verdict(work: Work) -> impl IntoView {
    let wrong = Memo::new(move |_| work.refusals());
    let headline = move || {
        let count = wrong.with(Vec::len);
        if work.lines.with(Vec::is_empty) {
            return None;
        }
        let (sign, words) = if count > 0 {
            (Icon::Cross, say!("page.lab.queue.wrong", count = count))
        } else {
            let done = work.checked.with(|checked| checked.clone().and_then(Result::ok));
            let (rows, strokes) = done.map_or((0, 0), |done| (done.rows, done.strokes));
            (Icon::Check, say!("page.lab.queue.sound", rows = rows, strokes = strokes))
        };
        Some((icon(sign), span().child(words)))
    };
    div()
        .class("findings queue-verdict")
        .attr("tabindex", "0")
        .attr("role", "group")
        .attr("aria-label", t!("page.lab.queue.check"))
        .child((
            p().class("row").attr("role", "status").child(headline),
            p().class("quiet").attr("role", "status").child(move || work.lab.runs.said.get()),
            ul().child(move || {
                wrong.get().into_iter().map(|why| line(work, why).into_any()).collect::<Vec<_>>()
            }),
        ))
}

fn line(work: Work, why: Remark) -> impl IntoView {
    let place = why.place.clone();
    let cure = why.clone();
    let show = place.map(|place| {
        let (row, column) = (place.line, place.column);
        let at = (row as usize).saturating_sub(1);
        push("button small", t!("page.lab.queue.place", line = row, column = column), move |_| {
            work.lab.as_text.set(false);
            work.lab.row.set(at);
            grid::focus(at);
        })
    });
    li().class("row").child((
        show,
        div().child((strong().child(move || message(&why)), p().class("quiet").child(move || advice(&cure)))),
    ))
}
