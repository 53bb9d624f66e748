//! The core's checks of the queue: what it will do, or all errors with line and column.

use super::grid;
use crate::i18n::{advice, message, say, sentence, t};
use crate::model::LabEvent;
use crate::page::{lab, read, send, watch};
use crate::widgets::{Icon, icon, push};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::wire::QueuePhase;
use leptos::html::{div, li, p, span, strong, ul};
use leptos::prelude::*;

pub(super) fn verdict() -> impl IntoView {
    let wrong = Memo::new(move |_| super::refusals());
    let headline = move || {
        let count = wrong.with(Vec::len);
        if lab::lines().with(Vec::is_empty) {
            return None;
        }
        let (sign, words) = if count > 0 {
            (Icon::Cross, say!("page.lab.queue.wrong", count = count))
        } else {
            let done = lab::checked().with(|checked| checked.clone().and_then(Result::ok));
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
            p().class("quiet").attr("role", "status").child(running),
            ul().child(move || wrong.get().into_iter().map(|why| line(why).into_any()).collect::<Vec<_>>()),
        ))
}

fn running() -> String {
    if !read(|m| m.lab.on_machine) {
        return watch(|m| &m.lab.run.said).get().map(|text| sentence(&text)).unwrap_or_default();
    }
    if let Some(why) = watch(|m| &m.link.refused).get() {
        return format!("{} {}", message(&why), advice(&why));
    }
    watch(|m| &m.link.queue.status).with(|queue| match (queue.phase, &queue.why) {
        (QueuePhase::None, _) => say!("page.lab.queue.moves_machine"),
        (QueuePhase::Ready, _) => say!("page.lab.queue.ready"),
        (QueuePhase::Running, _) => say!("page.lab.queue.runs"),
        (QueuePhase::Held, _) => say!("page.lab.queue.held", row = queue.row.map_or(0, |at| at + 1)),
        (QueuePhase::Done, _) => say!("page.lab.queue.machine_done"),
        (QueuePhase::Stopped, _) => say!("page.lab.queue.stopped_here"),
        (QueuePhase::Failed, Some(why)) => message(why),
        (QueuePhase::Failed, None) => say!("page.lab.queue.refused"),
    })
}

fn line(why: Diagnostic) -> impl IntoView {
    let place = why.place.clone();
    let cure = why.clone();
    let show = place.map(|place| {
        let (row, column) = (place.line, place.column);
        let at = (row as usize).saturating_sub(1);
        push("button small", t!("page.lab.queue.place", line = row, column = column), move |_| {
            send(LabEvent::AsText { on: false });
            send(LabEvent::Row { at });
            grid::focus(at);
        })
    });
    li().class("row").child((
        show,
        div().child((strong().child(move || message(&why)), p().class("quiet").child(move || advice(&cure)))),
    ))
}
