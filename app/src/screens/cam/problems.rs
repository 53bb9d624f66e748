//! What the plan leaves out, what the proof found, and what cures all of it at once. Nothing is exported or sent while one is
//! unread.
//!
//! ```text
//! what the plan leaves out      each with a tick that it was seen
//! the cure of the whole board   one button, before those of single places
//! groups of findings
//! what the plan warns of
//! ```
//!
//! Comes in: errors and findings of the plan on show. Goes out: the finding marked in the picture, the cure of the whole put into
//! the job, ticks.

use super::groups;
use crate::engine::messages::PlanReady;
use crate::format::counted_from;
use crate::i18n::{advice, message, say, t};
use crate::model::{FilesEvent, JobEvent};
use crate::page::{OpenJob, open_board, open_job, send};
use crate::screens::shown::zero;
use crate::widgets::{Icon, icon, picture_button_if, push, push_if};
use crate::workbench::edit;
use annulus_core::diagnostic::{Diagnostic, Severity};
use annulus_core::proof::Whole;
use leptos::ev;
use leptos::html::{div, h2, header, input, label, li, p, section, span, strong, ul};
use leptos::prelude::*;

/// The block under the picture.
pub(super) fn problems() -> impl IntoView {
    let (bench, desk, zero) = (open_job(), open_board(), Memo::new(move |_| zero()));
    let found = move || {
        let all = |group: &annulus_core::proof::Group| group.count as usize;
        desk.proved
            .with(|proved| proved.as_ref().map_or(0, |proved| proved.groups.iter().map(all).sum::<usize>()))
    };
    let warned = Memo::new(move |_| desk.plan.with(|plan| warnings_of(plan.as_deref())));
    let any = move || found() > 0;
    let count = move || desk.left_out.with(Vec::len) + warned.with(Vec::len) + found();
    let unread = move || open_board().unread();
    let left_out = move || {
        let (left_out, zero) = (desk.left_out.get(), zero.get());
        let line = |error| missing_line(counted_from(error, zero)).into_any();
        let lines: Vec<AnyView> = left_out.iter().map(line).collect();
        (!lines.is_empty()).then(|| ul().class("findings").child(lines))
    };
    let warnings = move || {
        let (warned, zero) = (warned.get(), zero.get());
        let line = |warning| warning_line(counted_from(warning, zero)).into_any();
        let lines: Vec<AnyView> = warned.iter().map(line).collect();
        (!lines.is_empty()).then(|| ul().class("findings").child(lines))
    };
    let list = move || match desk.proved.get() {
        None => p().class("quiet").child(t!("page.cam.not_proved")).into_any(),
        Some(proved) if proved.findings.is_empty() => {
            p().class("quiet").child(t!("page.cam.proved")).into_any()
        }
        Some(proved) => groups::groups(bench, &proved).into_any(),
    };
    let whole = move || {
        let whole = desk.proved.with(|proved| proved.as_ref().and_then(|proved| proved.whole.clone()));
        whole.map(|whole| ul().class("findings").child(whole_line(bench, whole)))
    };
    section()
        .class(move || if open_board().stale.get() { "block under stale-list" } else { "block under" })
        .attr("aria-label", t!("page.cam.problems"))
        .attr("tabindex", "-1")
        .child((
            header().child((
                h2().child(move || say!("page.cam.problem_count", count = count())),
                span()
                    .class("quiet")
                    .attr("role", "status")
                    .child(move || (unread() > 0).then(|| say!("page.cam.unread", count = unread()))),
                div().class("row").child((
                    picture_button_if(Icon::Previous, any, t!("page.cam.before"), |_| walk(false)),
                    picture_button_if(Icon::Next, any, t!("page.cam.next"), |_| walk(true)),
                    push_if(
                        "button small",
                        move || unread() > 0,
                        t!("page.cam.all_seen"),
                        |_| send(JobEvent::AllSeen),
                    ),
                )),
            )),
            left_out,
            whole,
            list,
            warnings,
        ))
}

/// What the plan warns of.
fn warnings_of(plan: Option<&PlanReady>) -> Vec<Diagnostic> {
    let warnings = |diagnostic: &&Diagnostic| diagnostic.severity == Severity::Warning;
    plan.into_iter().flat_map(|plan| plan.diagnostics.iter().filter(warnings)).cloned().collect()
}

/// One warning of the plan: nobody has to tick it.
fn warning_line(warning: Diagnostic) -> impl IntoView {
    let what = warning.clone();
    li().class("finding tone-pause").child((
        icon(Icon::Warning),
        div().class("grow").child((
            strong().child(move || message(&what)),
            span().class("quiet").child(move || advice(&warning)),
        )),
    ))
}

/// What one change of the whole job opens, and the button that makes it: the lesser depth, else the finer tip.
fn whole_line(bench: OpenJob, whole: Whole) -> impl IntoView {
    let said: Vec<AnyView> = whole
        .diagnostics()
        .into_iter()
        .map(|told| strong().child(move || message(&with_bit_called(&told))).into_any())
        .collect();
    let offer = match (whole.shallower, whole.tip) {
        (Some(offer), _) => {
            let depth = format!("{:.3}", offer.depth.mm());
            let text = t!("page.cam.whole_depth", depth = depth);
            let act = move |_| bench.change(None, |work| edit::shallower(work, &offer));
            Some(push("button small primary", text, act).into_any())
        }
        (None, Some(tip)) => {
            let depth = format!("{:.3}", edit::FINER_TIP_DEPTH.mm());
            let text = t!("page.cam.whole_tip", tip = format!("{:.2}", tip.mm()), depth = depth);
            let act = move |_| bench.change(None, |work| edit::finer_tip(work, tip));
            Some(push("button small primary", text, act).into_any())
        }
        (None, None) => None,
    };
    li().class("finding whole-cure tone-run").child((
        icon(Icon::Check),
        div().class("grow").child(said),
        div().class("row").child(offer),
    ))
}

/// The same with its bit called as people call it.
fn with_bit_called(told: &Diagnostic) -> Diagnostic {
    let mut told = told.clone();
    let bits = told.args.iter_mut().filter(|(name, _)| name == "bit");
    bits.for_each(|(_, bit)| *bit = super::called(bit));
    told
}

/// One error of the plan.
fn missing_line(error: Diagnostic) -> impl IntoView {
    let (what, meaning, flip) = (error.clone(), error.clone(), error.code.clone());
    li().class("finding tone-alarm").child((
        icon(Icon::Alarm),
        div().class("grow").child((
            strong().child(move || message(&what)),
            span().class("quiet").child(move || advice(&meaning)),
        )),
        label().class("tick").child((
            input()
                .attr("type", "checkbox")
                .prop("checked", move || {
                    open_board().accepted.with(|accepted| accepted.contains(&error.code))
                })
                .on(ev::change, move |_| send(FilesEvent::FlipAccepted { code: flip.clone() })),
            span().child(t!("page.cam.seen")),
        )),
    ))
}

/// The next place in the list, or the one before, is shown and brought into view; after the last comes the first.
pub(super) fn walk(on: bool) {
    let bench = open_job();
    let Some(proved) = open_board().proved.get_untracked() else { return };
    let order = groups::order(&proved);
    let count = order.len();
    let here = bench.marked.get_untracked().and_then(|marked| order.iter().position(|at| *at == marked));
    let next = match here {
        Some(here) => (here + if on { 1 } else { count - 1 }) % count,
        None if on => 0,
        None => count.saturating_sub(1),
    };
    let Some(&at) = order.get(next) else { return };
    send(JobEvent::Mark { at });
    groups::open_for(bench, &proved, at);
    request_animation_frame(move || {
        if let Some(line) = document().get_element_by_id(&groups::line_id(at)) {
            line.scroll_into_view_with_bool(false);
        }
    });
}
