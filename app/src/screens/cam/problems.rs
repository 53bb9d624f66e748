//! What the plan leaves out, and what the proof found: each with a tick that it was seen, findings with Show and what would
//! cure them. Nothing is exported or sent while one is unread.
//!
//! Comes in: losses and findings of the plan on show. Goes out: the finding marked in the picture, cures put into the job, ticks.

use crate::document::desk;
use crate::i18n::{advice, message, say, t};
use crate::widgets::{Icon, icon, picture_button_if, push, push_if};
use crate::workbench::{Bench, bench, edit};
use annulus_core::proof::{Cure, Finding, Whole};
use annulus_core::remark::{Remark, Weight};
use leptos::ev;
use leptos::html::{div, h2, header, input, label, li, p, section, span, strong, ul};
use leptos::prelude::*;

/// The most findings listed; all of them are marked in the picture.
const MOST_LISTED: usize = 200;

/// Losses of the plan on show: what of the board it leaves out.
pub(super) fn missing() -> Vec<Remark> {
    let losses = |remark: &&Remark| remark.weight == Weight::Loss;
    desk().plan.with(|plan| {
        plan.iter().flat_map(|plan| plan.remarks.iter().filter(losses).cloned()).take(MOST_LISTED).collect()
    })
}

/// Whether nobody has ticked this loss as seen.
pub(super) fn is_unseen(loss: &Remark) -> bool {
    desk().accepted.with(|accepted| !accepted.contains(&loss.code))
}

/// The block under the picture.
pub(super) fn problems() -> impl IntoView {
    let (bench, desk) = (bench(), desk());
    let found = move || desk.proved.with(|proved| proved.as_ref().map_or(0, |proved| proved.findings.len()));
    let any = move || found() > 0;
    let count = move || missing().len() + found();
    let unread = move || super::unread();
    let left_out = move || {
        let lines: Vec<AnyView> = missing().into_iter().map(|loss| missing_line(loss).into_any()).collect();
        (!lines.is_empty()).then(|| ul().class("findings").child(lines))
    };
    let list = move || match desk.proved.get() {
        None => p().class("quiet").child(t!("page.cam.not_proved")).into_any(),
        Some(proved) if proved.findings.is_empty() => {
            p().class("quiet").child(t!("page.cam.proved")).into_any()
        }
        Some(proved) => {
            let lines = proved.findings.iter().take(MOST_LISTED).cloned().enumerate();
            let lines: Vec<AnyView> =
                lines.map(|(at, finding)| line(bench, at, finding).into_any()).collect();
            let more = proved.findings.len().saturating_sub(MOST_LISTED) + proved.more as usize;
            let more = (more > 0).then(|| p().class("quiet").child(t!("page.cam.more", count = more)));
            (ul().class("findings").child(lines), more).into_any()
        }
    };
    let whole = move || {
        let whole = desk.proved.with(|proved| proved.as_ref().and_then(|proved| proved.whole.clone()));
        whole.map(|whole| ul().class("findings").child(whole_line(bench, whole)))
    };
    section()
        .class(move || if bench.stale.get() { "block under stale-list" } else { "block under" })
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
                        move |_| {
                            let codes = missing().into_iter().map(|loss| loss.code);
                            desk.accepted.update(|accepted| accepted.extend(codes));
                            if let Some(proved) = desk.proved.get_untracked() {
                                bench.read.update(|read| {
                                    read.extend(proved.findings.iter().map(|finding| finding.id.clone()));
                                });
                            }
                        },
                    ),
                )),
            )),
            left_out,
            whole,
            list,
        ))
}

/// What a change of the whole job opens, and the one that can be made here.
fn whole_line(bench: Bench, whole: Whole) -> impl IntoView {
    let said: Vec<AnyView> =
        whole.remarks().into_iter().map(|told| strong().child(move || message(&told)).into_any()).collect();
    let offer = whole.shallower.map(|offer| {
        let depth = format!("{:.3}", offer.depth.mm());
        push(
            "button small",
            move || say!("page.cam.whole_depth", depth = depth),
            move |_| bench.change(None, |work| edit::shallower(work, &offer)),
        )
    });
    li().class("finding tone-quiet").child((
        icon(Icon::Warning),
        div().class("grow").child(said),
        div().class("row").child(offer),
    ))
}

/// One loss of the plan.
fn missing_line(loss: Remark) -> impl IntoView {
    let (what, meaning, flip) = (loss.clone(), loss.clone(), loss.code.clone());
    li().class("finding tone-alarm").child((
        icon(Icon::Alarm),
        div().class("grow").child((
            strong().child(move || message(&what)),
            span().class("quiet").child(move || advice(&meaning)),
        )),
        label().class("tick").child((
            input()
                .attr("type", "checkbox")
                .prop("checked", move || !is_unseen(&loss))
                .on(ev::change, move |_| desk().flip_accepted(&flip)),
            span().child(t!("page.cam.seen")),
        )),
    ))
}

/// The next finding, or the one before, is shown; after the last comes the first.
pub(super) fn walk(on: bool) {
    let count = desk().proved.with_untracked(|proved| proved.as_ref().map_or(0, |one| one.findings.len()));
    if count == 0 {
        return;
    }
    let next = match bench().marked.get_untracked() {
        None => {
            if on {
                0
            } else {
                count - 1
            }
        }
        Some(at) => (at + if on { 1 } else { count - 1 }) % count,
    };
    bench().marked.set(Some(next));
}

fn cure_text(cure: &Cure) -> String {
    let mm = |length: annulus_core::units::Length| format!("{:.3}", length.mm());
    match cure {
        Cure::Shallower { depth, .. } => say!("page.cam.cure_shallower", depth = mm(*depth)),
        Cure::OtherBit { bit, .. } => say!("page.cam.cure_other_bit", bit = bit),
        Cure::Centred { lost, .. } => say!("page.cam.cure_centred", lost = mm(*lost)),
        Cure::Deeper { depth, .. } => say!("page.cam.cure_deeper", depth = mm(*depth)),
    }
}

/// The cure goes into the chosen operation where that isolates, else into the first that does.
fn apply(bench: Bench, finding: &Finding, cure: &Cure) {
    let chosen = bench.chosen.get_untracked();
    bench.change(None, |work| edit::cured(work, chosen, finding, cure));
}

fn line(bench: Bench, at: usize, finding: Finding) -> impl IntoView {
    let remark = finding.remark();
    let (what, meaning) = (remark.clone(), remark);
    let (class, sign) = match finding.weight() {
        Weight::Loss => ("finding tone-alarm", Icon::Alarm),
        Weight::Doubt => ("finding tone-pause", Icon::Warning),
        Weight::Note => ("finding tone-quiet", Icon::Check),
    };
    let marked = move || bench.marked.get() == Some(at);
    let agreed = finding.agreed;
    let (id, flip) = (finding.id.clone(), finding.id.clone());
    let cures: Vec<AnyView> = finding
        .cures
        .iter()
        .cloned()
        .map(|cure| {
            let (text, finding) = (cure.clone(), finding.clone());
            push("button small", move || cure_text(&text), move |_| apply(bench, &finding, &cure)).into_any()
        })
        .collect();
    li().class(class).attr("aria-current", move || marked().then_some("true")).child((
        icon(sign),
        div().class("grow").child((
            strong().child(move || message(&what)),
            span().class("quiet").child(move || advice(&meaning)),
            agreed.then(|| span().class("quiet").child(t!("page.cam.agreed"))),
        )),
        div().class("row").child((
            push("button small", t!("page.cam.show"), move |_| bench.marked.set(Some(at))),
            cures,
            label().class("tick").child((
                input()
                    .attr("type", "checkbox")
                    .prop("checked", move || bench.read.with(|read| read.contains(&id)))
                    .on(ev::change, move |_| {
                        bench.read.update(|read| {
                            if !read.remove(&flip) {
                                read.insert(flip.clone());
                            }
                        });
                    }),
                span().child(t!("page.cam.seen")),
            )),
        )),
    ))
}
