//! The controller's check mode: the controller reads every line of the job before the first move and reports
//! the lines that it rejects. Moves nothing.

use crate::i18n::{message, say, t};
use crate::page::{link, shared, watch};
use crate::widgets::push_if;
use annulus_core::wire::{Ask, CheckModeReport};
use leptos::html::{div, li, p, ul};
use leptos::prelude::*;

/// The button and the result; nothing for machines without a check mode.
pub(super) fn checked() -> impl IntoView {
    // The machine has the job only after pre-flight.
    let job = Memo::new(move |_| {
        let plans = watch(|m| &m.start.preflight).with(|preflight| {
            preflight.as_ref().filter(|preflight| preflight.own_motion).map(|preflight| preflight.job.clone())
        });
        plans.filter(|job| {
            watch(|m| &m.link.armed).with(|armed| armed.as_ref().is_some_and(|armed| armed.job == *job))
        })
    });
    let report = Memo::new(move |_| {
        let job = job.get()?;
        shared(|m| &m.link.checked)
            .with(|report| report.as_deref().filter(|report| report.job == job).cloned())
    });
    let refused = move || watch(|m| &m.link.refused).with(|why| why.as_ref().map(message));
    let told = move || refused().or_else(|| report.get().map(|report| words(&report)));
    let now = move || told().unwrap_or_else(|| say!("page.check.is"));
    let lines = move || report.get().map(|report| lines(&report));
    move || {
        job.get().map(|job| {
            let read = move |_| link::ask(Ask::Check { job: job.clone() });
            div().child((
                push_if("button", link::ready, t!("page.check.read"), read),
                p().class("quiet").attr("role", "status").child(now),
                lines,
            ))
        })
    }
}

fn words(report: &CheckModeReport) -> String {
    let (done, of, refused) = (report.done, report.of, report.refused);
    match &report.why {
        _ if report.goes => say!("page.check.goes", done = done, of = of),
        Some(why) => message(why),
        None if refused > 0 => say!("page.check.bad", refused = refused, of = of),
        None => say!("page.check.good", of = of),
    }
}

fn lines(report: &CheckModeReport) -> impl IntoView + use<> {
    let row = |line: u32, what: String| li().child(say!("page.check.line", line = line, what = what));
    let all = report.lines.iter().map(|why| row(why.place.as_ref().map_or(0, |at| at.line), message(why)));
    let more = report.refused.saturating_sub(report.lines.len() as u32);
    let more = (more > 0).then(|| li().child(say!("page.check.more", more = more)));
    (!report.lines.is_empty()).then(|| ul().child((all.collect::<Vec<_>>(), more)))
}
