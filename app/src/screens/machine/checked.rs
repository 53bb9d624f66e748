//! What a controller makes of the job before the first move: in its check mode it reads every line, and says which it refuses.
//!
//! Comes in: the pre-flight on show, what the controller has read. Goes out: `Check`. Moves nothing.

use crate::i18n::{message, say, t};
use crate::page::link;
use crate::widgets::push_if;
use annulus_core::control::State;
use annulus_core::wire::{Ask, CheckModeReport};
use leptos::html::{div, li, p, ul};
use leptos::prelude::*;

/// The button, and what came of it; nothing for machines that have no check mode.
pub(super) fn checked() -> impl IntoView {
    let line = link::link();
    // Before the job was compared the machine does not have it.
    let job = Memo::new(move |_| {
        let plans = line.preflight.with(|preflight| {
            preflight.as_ref().filter(|preflight| preflight.own_motion).map(|preflight| preflight.job.clone())
        });
        plans.filter(|job| line.armed.with(|armed| armed.as_ref().is_some_and(|armed| armed.job == *job)))
    });
    let report = Memo::new(move |_| {
        let job = job.get()?;
        line.checked.with(|report| report.as_deref().filter(|report| report.job == job).cloned())
    });
    let refused = move || line.refused.with(|why| why.as_ref().map(message));
    let told = move || refused().or_else(|| report.get().map(|report| words(&report)));
    let now = move || told().unwrap_or_else(|| say!("page.check.is"));
    let lines = move || report.get().map(|report| lines(&report));
    move || {
        job.get().map(|job| {
            let may = move || line.may_act() && line.state() == Some(State::Ready);
            let read = move |_| link::ask(Ask::Check { job: job.clone() });
            div().child((
                push_if("button", may, t!("page.check.read"), read),
                p().class("quiet").attr("role", "status").child(now),
                lines,
            ))
        })
    }
}

/// How far it is, or what came of it.
fn words(report: &CheckModeReport) -> String {
    let (done, of, refused) = (report.done, report.of, report.refused);
    match &report.why {
        _ if report.goes => say!("page.check.goes", done = done, of = of),
        Some(why) => message(why),
        None if refused > 0 => say!("page.check.bad", refused = refused, of = of),
        None => say!("page.check.good", of = of),
    }
}

/// The lines that it refuses, as far as they are told.
fn lines(report: &CheckModeReport) -> impl IntoView + use<> {
    let row = |line: u32, what: String| li().child(say!("page.check.line", line = line, what = what));
    let all = report.lines.iter().map(|why| row(why.place.as_ref().map_or(0, |at| at.line), message(why)));
    let more = report.refused.saturating_sub(report.lines.len() as u32);
    let more = (more > 0).then(|| li().child(say!("page.check.more", more = more)));
    (!report.lines.is_empty()).then(|| ul().child((all.collect::<Vec<_>>(), more)))
}
