//! The hole order, what it saves, and the problems in its way.

use crate::engine::messages::PlanReady;
use crate::format::{counted_from, duration};
use crate::i18n::{key, say, sentence, t};
use crate::keys::Tab;
use crate::model::{AnewEvent, Event, FilesEvent, FrameEvent, JobEvent, Model};
use crate::page::{board, peek, read, send, shared};
use crate::screens::review::finding;
use crate::screens::shown::zero;
use crate::widgets::{choice, fact, push, segmented, shape};
use annulus_core::cam::HoleOrder;
use annulus_core::units::Length;
use leptos::ev;
use leptos::html::{div, dl, h2, header, label, option, p, section, select, span};
use leptos::prelude::*;
use wasm_bindgen::JsCast;
use web_sys::HtmlElement;

pub(crate) fn inspector() -> impl IntoView {
    let first = || board::waits_for_person().then(problems);
    let last = || (!board::waits_for_person()).then(problems);
    (first, order(), gains(), last)
}

const ORDERS: [(HoleOrder, &str); 3] = [
    (HoleOrder::Shortest, key!("page.plan.shortest")),
    (HoleOrder::Fastest, key!("page.plan.fastest")),
    (HoleOrder::File, key!("page.plan.file")),
];

fn order() -> impl IntoView {
    let choices = ORDERS.map(|(order, name)| {
        choice(
            move || read(|m| m.job.drill_order()) == Some(order),
            move || crate::i18n::text(name, &[]),
            move |_| send(JobEvent::DrillOrder { order }),
        )
    });
    let bits = Memo::new(move |_| {
        shared(|m| &m.board.plan).with(|plan| {
            plan.as_ref().map(|plan| plan.bits.iter().map(|bit| bit.diameter).collect::<Vec<_>>())
        })
    });
    let options = move || {
        let mut bits = bits.get().unwrap_or_default();
        bits.sort_unstable();
        let unit = read(|m| m.frame.unit);
        let one = |bit: Length| {
            let size = unit.size(bit.mm());
            option()
                .attr("value", bit.nm().to_string())
                .prop("selected", peek(|m| m.board.loaded) == Some(bit))
                .child(move || say!("page.plan.loaded", size = size, unit = crate::i18n::unit_word()))
        };
        bits.into_iter().map(one).collect::<Vec<_>>()
    };
    section().class("block").attr("aria-label", t!("page.plan.order")).child((
        header().child(h2().child(t!("page.plan.order"))),
        segmented(t!("page.plan.order"), Vec::from(choices)),
        label().class("field").child((
            span().child(t!("page.plan.bits")),
            select()
                .on(ev::change, move |event| {
                    let bit = event_target_value(&event).parse().ok().map(Length::from_nm);
                    send(FilesEvent::Loaded { bit });
                })
                .child((option().attr("value", "").child(t!("page.plan.ascending")), options)),
        )),
    ))
}

fn bar(class: &'static str, share: f64) -> impl IntoView {
    div().class(class).child(shape("").style(("--share", format!("{:.1}%", share.clamp(0.0, 1.0) * 100.0))))
}

fn travel(plan: &PlanReady) -> impl IntoView + use<> {
    let (before, after) = (plan.travel_before_mm, plan.travel_after_mm);
    let (slow, quick) = (plan.hop_time_before_s, plan.hop_time_after_s);
    let metres = |mm: f64| format!("{:.2}", mm / 1000.0);
    let largest = before.max(after).max(1e-9);
    let before_text = t!("page.plan.before", metres = metres(before), time = sentence(&duration(slow)));
    let after_text = t!("page.plan.after", metres = metres(after), time = sentence(&duration(quick)));
    let saved = if before > 0.0 { (1.0 - after / before) * 100.0 } else { 0.0 };
    div().class("travel").child((
        span().child(before_text),
        bar("bar before", before / largest),
        span().child(after_text),
        bar("bar", after / largest),
        span().class("quiet").child(t!("page.plan.saved", percent = format!("{saved:.0}"))),
    ))
}

fn gains() -> impl IntoView {
    let before = || read(|m| m.frame.show_before);
    let total = move || {
        shared(|m| &m.board.timed).with(|timed| {
            timed.as_ref().map_or_else(|| "–".to_owned(), |timed| sentence(&duration(timed.total_s)))
        })
    };
    let holes = move || {
        shared(|m| &m.board.timed)
            .with(|timed| timed.as_ref().map_or_else(|| "–".to_owned(), |timed| timed.holes.to_string()))
    };
    let changes = move || read(|m| m.board.job.as_ref().map_or(0, |job| job.program.bits.len())).to_string();
    section().class("block").attr("aria-label", t!("page.plan.travel")).child((
        header().child(h2().child(t!("page.plan.travel"))),
        || board::waits_for_person().then(|| p().child(t!("page.plan.waits"))),
        move || shared(|m| &m.board.plan).with(|plan| plan.as_ref().map(|plan| travel(plan))),
        segmented(
            t!("page.plan.shown"),
            (
                choice(before, t!("page.plan.show_before"), |_| send(FrameEvent::Before { on: true })),
                choice(
                    move || !before(),
                    t!("page.plan.show_after"),
                    |_| send(FrameEvent::Before { on: false }),
                ),
            ),
        ),
        dl().class("facts").child((
            fact(t!("page.plan.total"), total),
            fact(t!("page.plan.holes"), holes),
            fact(t!("page.plan.changes"), changes),
        )),
    ))
}

/// The list of problems, on Board and on CAM.
pub(crate) const PROBLEMS: &str = "problems";

/// Shows the list with the first problem to solve.
pub(crate) fn show_problems() {
    send(FrameEvent::Show { tab: peek(Model::problems_tab) });
    request_animation_frame(|| {
        let block =
            document().get_element_by_id(PROBLEMS).and_then(|block| block.dyn_into::<HtmlElement>().ok());
        if let Some(block) = block {
            block.scroll_into_view();
            let _ = block.focus();
        }
    });
}

/// The problems of the proof, which are counted here too, with a button to their list on CAM.
fn at_cam() -> impl IntoView {
    let found = Memo::new(|_| shared(|m| &m.board.proved).with(|_| peek(|m| m.board.found())));
    move || {
        let count = found.get();
        (count > 0).then(|| {
            let go = |_| send(FrameEvent::Show { tab: Tab::Cam });
            div().class("row").child((
                span().class("grow").child(t!("page.problems.at_cam", count = count)),
                push("button small", t!("page.problems.go_cam"), go),
            ))
        })
    }
}

/// Problems of files and plan. Errors can be accepted here too.
fn problems() -> impl IntoView {
    let zero = Memo::new(move |_| zero());
    let list = move || {
        let (diagnostics, zero) = (board::problems().get(), zero.get());
        if diagnostics.is_empty() {
            let none = board::problem_count() == 0;
            none.then(|| p().class("quiet").child(t!("page.problems.none"))).into_any()
        } else {
            div()
                .class("row")
                .child(
                    diagnostics
                        .into_iter()
                        .map(|diagnostic| finding(counted_from(&diagnostic, zero)).into_any())
                        .collect::<Vec<_>>(),
                )
                .into_any()
        }
    };
    let block = section().class("block").attr("id", PROBLEMS).attr("tabindex", "-1");
    block.attr("aria-label", t!("page.problems.title")).child((
        header().child((
            h2().child(move || say!("page.problems.count", count = board::problem_count())),
            push("button small", t!("page.anew.choose"), |_| send(AnewEvent::Choose)),
            push("button small", t!("page.problems.review"), |_| send(FilesEvent::Review)),
        )),
        list,
        at_cam(),
        move || {
            read(|m| m.task().is_some())
                .then(|| push("button", t!("page.task.cancel"), |_| send(Event::Cancelled)))
        },
    ))
}
