//! Before the first move: the program goes to the bridge, the bridge checks it, a person reads the rows.
//!
//! ```text
//! Start… ─▶ upload ─▶ Arm ─▶ rows and digest ─▶ [Start drilling]   (only this button moves anything)
//! ```
//!
//! Comes in: the planned job. Goes out: `Arm`, and `Start` once nothing fails and every warning is ticked.

use super::words;
use crate::i18n::{advice, key, message, say, t};
use crate::link::{self, Armed};
use crate::model::Job;
use crate::page::open_board;
use crate::state::state;
use crate::widgets::{Dialog, dialog, icon, push, push_if};
use annulus_core::remark::{Remark, Weight};
use annulus_core::wire::{Ask, PreflightRow, Verdict};
use leptos::ev;
use leptos::html::{div, input, label, li, p, span, strong, ul};
use leptos::prelude::*;
use std::collections::BTreeSet;
use std::sync::Arc;

/// A pre-flight on show.
#[derive(Clone, Debug, PartialEq)]
pub struct Preflight {
    /// The program's key.
    pub job: String,
    /// Where to begin.
    pub from_leg: u32,
    /// Digest of the stream as this page computed it.
    pub own_digest: String,
}

/// Opens the pre-flight of the planned job.
pub fn open() {
    if let Some(job) = open_board().job.get_untracked() {
        show(job, 0);
    }
}

/// Opens the pre-flight of a job that was broken off.
pub fn resume(offer: &link::Interrupted) {
    let offer = offer.clone();
    leptos::task::spawn_local(async move {
        if let Some(job) = crate::state::job_by_key(&offer.job).await {
            show(job, offer.next_leg);
        }
    });
}

/// Opens the pre-flight of `job`, to begin at `from_leg`.
pub(super) fn show(job: Arc<Job>, from_leg: u32) {
    let line = link::link();
    line.armed.set(None);
    line.refused.set(None);
    state().ticked.set(BTreeSet::new());
    let (key, own_digest) = (job.key.clone(), job.stream_digest.clone());
    state().preflight.set(Some(Preflight { job: key, from_leg, own_digest }));
    leptos::task::spawn_local(async move {
        match link::upload(&job.bytes).await {
            Ok(job) => link::ask(&Ask::Arm { job }),
            Err(why) => line.refused.set(Some(why)),
        }
    });
}

fn close() {
    state().preflight.set(None);
}

/// The bridge's rows, and the page's own: that both computed the same steps.
fn rows(preflight: &Preflight, armed: &Armed) -> Vec<PreflightRow> {
    let same = preflight.own_digest == armed.stream_digest;
    let code = if same { key!("page.preflight.same_steps") } else { key!("page.preflight.other_steps") };
    let weight = if same { Weight::Note } else { Weight::Loss };
    let digest = PreflightRow {
        finding: Remark::new(weight, code).with("digest", armed.stream_digest.get(..12).unwrap_or_default()),
        verdict: if same { Verdict::Pass } else { Verdict::Fail },
    };
    armed.checks.iter().cloned().chain([digest]).collect()
}

fn now() -> Option<(Preflight, Vec<PreflightRow>)> {
    let preflight = state().preflight.get()?;
    let armed = link::link().armed.get().filter(|armed| armed.job == preflight.job)?;
    let rows = rows(&preflight, &armed);
    Some((preflight, rows))
}

fn may_start() -> bool {
    let ticked = state().ticked.get();
    now().is_some_and(|(_, rows)| {
        rows.iter().all(|row| match row.verdict {
            Verdict::Pass => true,
            Verdict::Warn => ticked.contains(&row.finding.code),
            Verdict::Fail => false,
        })
    })
}

fn start() {
    if let Some((preflight, _)) = now() {
        let Preflight { job, from_leg, own_digest } = preflight;
        link::ask(&Ask::Start { job, stream_digest: own_digest, from_leg });
        link::link().ended.set(None);
        close();
    }
}

fn row(row: PreflightRow) -> impl IntoView {
    let look = words::verdict(row.verdict);
    let (word, code) = (look.word, row.finding.code.clone());
    let (what, cure) = (row.finding.clone(), row.finding);
    let needs_tick = row.verdict == Verdict::Warn;
    let advised = (row.verdict != Verdict::Pass).then(|| p().class("advice").child(move || advice(&cure)));
    let tick = needs_tick.then(|| {
        let flip = move |_| {
            state().ticked.update(|ticked| {
                if !ticked.remove(&code) {
                    ticked.insert(code.clone());
                }
            });
        };
        label().class("tick").child((
            input().attr("type", "checkbox").on(ev::change, flip),
            span().child(t!("page.preflight.seen")),
        ))
    });
    li().child((
        span()
            .class(format!("tag {}", look.tone))
            .child((icon(look.icon), span().child(move || crate::i18n::text(word, &[])))),
        div().child((strong().child(move || message(&what)), advised)),
        tick,
    ))
}

/// The dialog.
pub fn preflight() -> impl IntoView {
    let line = link::link();
    let rows = Memo::new(move |_| now().map(|(_, rows)| rows));
    let body = move || match rows.get() {
        Some(rows) => ul().class("preflight").child(rows.into_iter().map(row).collect::<Vec<_>>()).into_any(),
        None => p().class("quiet").child(waiting(line)).into_any(),
    };
    let from = move || {
        let from =
            state().preflight.with(|preflight| preflight.as_ref().map_or(0, |preflight| preflight.from_leg));
        if from == 0 { say!("page.preflight.start") } else { say!("page.preflight.resume") }
    };
    let foot = (
        push("button", t!("page.cancel"), |_| close()),
        push_if("button primary", may_start, from, |_| start()),
    );
    dialog(
        Signal::derive(move || state().preflight.with(Option::is_some)),
        close,
        Dialog {
            name: "preflight",
            role: "dialog",
            title: Box::new(t!("page.preflight.title")),
            body: body.into_any(),
            foot: foot.into_any(),
        },
    )
}

fn waiting(line: link::Link) -> impl Fn() -> String {
    move || line.refused.get().map_or_else(|| say!("page.preflight.checking"), |why| message(&why))
}
