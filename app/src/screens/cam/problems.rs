//! Errors of the plan, problems found by the proof, and one fix for all. Export and start are blocked until
//! every problem is accepted.
//!
//! ```text
//! errors of the plan          each with a checkbox to accept it
//! fix for the whole board     one button, before those of single locations
//! groups of findings
//! warnings of the plan
//! problems of the files       on the Board screen
//! ```

use super::groups;
use crate::engine::messages::PlanReady;
use crate::format::counted_from;
use crate::i18n::{advice, message, say, t};
use crate::keys::Tab;
use crate::model::{FilesEvent, FrameEvent, JobEvent};
use crate::page::{board, peek, read, send, shared, watch};
use crate::screens::board::PROBLEMS;
use crate::screens::shown::zero;
use crate::widgets::{Icon, icon, picture_button_if, push, push_if, tick};
use crate::workbench::edit;
use annulus_core::diagnostic::{Diagnostic, Severity};
use annulus_core::proof::Whole;
use leptos::html::{div, h2, header, li, section, span, strong, ul};
use leptos::prelude::*;

/// The block under the picture.
pub(super) fn problems() -> impl IntoView {
    let zero = Memo::new(move |_| zero());
    let any = move || {
        shared(|m| &m.board.proved)
            .with(|proved| proved.as_ref().is_some_and(|proved| !proved.findings.is_empty()))
    };
    let warned = Memo::new(move |_| shared(|m| &m.board.plan).with(|plan| warnings_of(plan.as_deref())));
    let left_out = move || {
        let (left_out, zero) = (board::left_out().get(), zero.get());
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
    // The line at the foot of the page says whether the job is proved.
    let list = move || {
        let proved = shared(|m| &m.board.proved).get();
        proved.filter(|proved| !proved.findings.is_empty()).map(|proved| groups::groups(&proved))
    };
    let whole = move || {
        let whole = shared(|m| &m.board.proved)
            .with(|proved| proved.as_ref().and_then(|proved| proved.whole.clone()));
        whole.map(|whole| ul().class("findings").child(whole_line(whole)))
    };
    section()
        .class(move || if read(|m| m.board.stale) { "block under stale-list" } else { "block under" })
        .attr("id", PROBLEMS)
        .attr("aria-label", t!("page.cam.problems"))
        .attr("tabindex", "-1")
        .child((
            header().child((
                h2().child(move || say!("page.cam.problem_count", count = board::problem_count())),
                span().class("quiet").attr("role", "status").child(move || {
                    (board::unread() > 0).then(|| say!("page.cam.unread", count = board::unread()))
                }),
                div().class("row").child((
                    picture_button_if(Icon::Previous, any, t!("page.cam.before"), |_| walk(false)),
                    picture_button_if(Icon::Next, any, t!("page.cam.next"), |_| walk(true)),
                    push_if(
                        "button small",
                        move || board::unread() > 0,
                        t!("page.cam.all_seen"),
                        |_| send(JobEvent::AllSeen),
                    ),
                )),
            )),
            left_out,
            whole,
            list,
            warnings,
            at_board,
        ))
}

/// The problems of the files, which are counted here too, with a button to their list on Board.
fn at_board() -> impl IntoView {
    let count = Memo::new(|_| board::of_files_count());
    move || {
        (count.get() > 0).then(|| {
            let go = |_| send(FrameEvent::Show { tab: Tab::Board });
            div().class("row").child((
                span().class("grow").child(t!("page.cam.at_board", count = count.get())),
                push("button small", t!("page.cam.go_board"), go),
            ))
        })
    }
}

fn warnings_of(plan: Option<&PlanReady>) -> Vec<Diagnostic> {
    let warnings = |diagnostic: &&Diagnostic| diagnostic.severity == Severity::Warning;
    plan.into_iter().flat_map(|plan| plan.diagnostics.iter().filter(warnings)).cloned().collect()
}

/// A warning of the plan; needs no acceptance.
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

/// The problems that one change of the whole job fixes, with its button: a smaller depth, else a finer tip.
fn whole_line(whole: Whole) -> impl IntoView {
    let said: Vec<AnyView> = whole
        .diagnostics()
        .into_iter()
        .map(|told| strong().child(move || message(&with_bit_called(&told))).into_any())
        .collect();
    let offer = match (whole.shallower, whole.tip) {
        (Some(offer), _) => {
            let depth = format!("{:.3}", offer.depth.mm());
            let text = t!("page.cam.whole_depth", depth = depth);
            let act = move |_| board::change_job(None, |work| edit::shallower(work, &offer));
            Some(push("button small primary", text, act).into_any())
        }
        (None, Some(tip)) => {
            let depth = format!("{:.3}", edit::FINER_TIP_DEPTH.mm());
            let text = t!("page.cam.whole_tip", tip = format!("{:.2}", tip.mm()), depth = depth);
            let act = move |_| board::change_job(None, |work| edit::finer_tip(work, tip));
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

fn with_bit_called(told: &Diagnostic) -> Diagnostic {
    let mut told = told.clone();
    let bits = told.args.iter_mut().filter(|(name, _)| name == "bit");
    bits.for_each(|(_, bit)| *bit = super::called(bit));
    told
}

fn missing_line(error: Diagnostic) -> impl IntoView {
    let (what, meaning, flip) = (error.clone(), error.clone(), error.code.clone());
    li().class("finding tone-alarm").child((
        icon(Icon::Alarm),
        div().class("grow").child((
            strong().child(move || message(&what)),
            span().class("quiet").child(move || advice(&meaning)),
        )),
        tick(
            move || watch(|m| &m.board.accepted).with(|accepted| accepted.contains(&error.code)),
            t!("page.cam.seen"),
            move |_| send(FilesEvent::FlipAccepted { code: flip.clone() }),
        ),
    ))
}

/// Shows the next location of the list, or the previous one; wraps around.
pub(super) fn walk(on: bool) {
    let Some(proved) = peek(|m| m.board.proved.clone()) else { return };
    let order = groups::order(&proved);
    let count = order.len();
    let here = peek(|m| m.job.marked).and_then(|marked| order.iter().position(|at| *at == marked));
    let next = match here {
        Some(here) => (here + if on { 1 } else { count - 1 }) % count,
        None if on => 0,
        None => count.saturating_sub(1),
    };
    let Some(&at) = order.get(next) else { return };
    send(JobEvent::Mark { at });
    groups::open_for(&proved, at);
    request_animation_frame(move || {
        if let Some(line) = document().get_element_by_id(&groups::line_id(at)) {
            line.scroll_into_view_with_bool(false);
        }
    });
}
