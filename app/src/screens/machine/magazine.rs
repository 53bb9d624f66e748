//! The magazine: what lies where, which step of a change is in work, where one stopped and how it goes on; and what a person says of it.
//!
//! Comes in: what the machine tells of its magazine, the job on show. Goes out: asks. Nothing moves by them.

use crate::i18n::{language, say, t};
use crate::page::link::{self, Link};
use crate::page::open_board;
use crate::widgets::{push, push_if};
use annulus_core::control::State;
use annulus_core::magazine::{ChangeStep, Held, Seen, StockedTool, ToolStock, laid_out};
use annulus_core::wire::{Ask, MagazineReport};
use leptos::html::{details, div, h3, li, ol, p, section, strong, summary};
use leptos::prelude::*;
use std::sync::Arc;

/// Whether a person may say what lies where: nothing moves, and this page is in control.
fn may_say(line: Link) -> bool {
    line.may_act() && matches!(line.state(), Some(State::Ready | State::NotHomed))
}

fn called(tool: &StockedTool) -> String {
    say!("page.magazine.tool", number = tool.number, bit = tool.bit.title(&language()))
}

fn name(step: ChangeStep) -> String {
    crate::i18n::text(step.sentence_key(), &[])
}

/// Place by place, and the spindle.
fn list(stock: &ToolStock) -> impl IntoView + use<> {
    let row = |what: String, holds: String| li().child((strong().child(what), " ", holds));
    let held = match &stock.spindle {
        Held::Unknown => say!("page.magazine.unknown"),
        Held::Nothing => say!("page.magazine.empty"),
        Held::Tool { tool, .. } => called(tool),
    };
    let mut rows = vec![row(say!("page.magazine.spindle"), held)];
    for (number, tool) in (1..).zip(&stock.places) {
        let holds = tool.as_ref().map_or_else(|| say!("page.magazine.empty"), called);
        rows.push(row(say!("page.magazine.place", number = number), holds));
    }
    ol().class("places").child(rows)
}

/// The step in work, or the one at which a change stopped and the way on.
fn standing(report: &MagazineReport) -> Option<impl IntoView + use<>> {
    let change = report.stock.change.as_ref()?;
    let step = change.step;
    let title = if report.changes {
        say!("page.magazine.step", number = step.number())
    } else {
        say!("page.magazine.stopped", number = step.number())
    };
    let on = report.goes_on_with.filter(|_| !report.changes);
    let way = on.map(|next| {
        let words = say!("page.magazine.goes_on", number = next.number());
        p().child((words, " ", name(next)))
    });
    Some((p().attr("role", "status").child((strong().child(title), " ", name(step))), way))
}

/// Where nobody knows what the spindle holds after a stop: a person looks and answers.
fn question(line: Link, report: &MagazineReport) -> Option<impl IntoView + use<>> {
    let change = report.stock.change.as_ref().filter(|_| !report.changes)?;
    if report.stock.spindle != Held::Unknown {
        return None;
    }
    let (tool, place) = change.uncertain();
    let ask = say!("page.magazine.look", tool = called(tool));
    let number = u32::from(*place) + 1;
    let answer = move |seen: Seen, words: String| {
        let words = move || words.clone();
        push_if("button", move || may_say(line), words, move |_| link::ask(Ask::ToolSeen { seen }))
    };
    let answers = (
        answer(Seen::InSpindle, say!("page.magazine.in_spindle")),
        answer(Seen::InPlace, say!("page.magazine.in_place", number = number)),
        answer(Seen::TakenAway, say!("page.magazine.taken_away")),
    );
    Some(div().class("notice tone-alarm").attr("role", "alert").child((p().child(ask), answers)))
}

/// The tool that falls out of the spindle when its clamp opens; none where it is empty.
fn falls(report: &MagazineReport) -> Option<String> {
    match &report.stock.spindle {
        Held::Tool { tool, .. } => Some(called(tool)),
        Held::Unknown => report.stock.change.as_ref().map(|change| called(&change.uncertain().0)),
        Held::Nothing => None,
    }
}

/// Opens the clamp, asked first with what falls out; where `may` says.
pub(super) fn open_clamp(line: Link, may: impl Fn() -> bool + Copy + Send + Sync + 'static) -> impl IntoView {
    let asks = RwSignal::new(false);
    let tool = Memo::new(move |_| line.magazine.with(|report| falls(report.as_ref()?)));
    move || {
        let tool = tool.get()?;
        Some(if asks.get() {
            let open = move |_| {
                asks.set(false);
                link::ask(Ask::OpenClamp);
            };
            let words = p().child(move || say!("page.magazine.open_falls", tool = tool.clone()));
            let buttons = div().class("row").child((
                push_if("button", may, t!("page.magazine.open_now"), open),
                push("button", t!("page.magazine.open_not"), move |_| asks.set(false)),
            ));
            div()
                .class("notice tone-alarm")
                .attr("role", "alert")
                .child(div().child((words, buttons)))
                .into_any()
        } else {
            push_if("button", may, t!("page.magazine.open"), move |_| asks.set(true)).into_any()
        })
    }
}

/// Whether a person opened the clamp for a new tool in the place of one that is worn.
pub(super) fn is_open_for_new(line: Link) -> bool {
    let unknown = |report: &Arc<MagazineReport>| report.stock.spindle == Held::Unknown;
    line.state() == Some(State::ToolChange)
        && line.magazine.with(|report| report.as_ref().is_some_and(unknown))
}

/// The steps of a person who puts a new tool into the clamp of a machine with a magazine; nothing on others.
pub(super) fn new_tool(line: Link) -> impl IntoView {
    let open = Memo::new(move |_| is_open_for_new(line));
    let has = Memo::new(move |_| line.magazine.with(Option::is_some));
    let close = |_| link::ask(Ask::ToolSeen { seen: Seen::InSpindle });
    move || {
        has.get().then(|| {
            if open.get() {
                let button = push_if("button", move || line.may_act(), t!("page.magazine.close"), close);
                let words = p().child(t!("page.magazine.is_open"));
                div().class("notice tone-change").attr("role", "alert").child((words, button)).into_any()
            } else {
                open_clamp(line, move || line.may_act()).into_any()
            }
        })
    }
}

/// The tools of the job on show, as it needs them in the places; none without a job.
fn needed(line: Link) -> Option<Vec<Option<StockedTool>>> {
    let bits = line.shown_job.with(|job| job.as_ref().map(|job| job.program.bits.clone()))?;
    let known = line.tools.with(|report| report.wear.clone());
    Some(open_board().machine.with(|machine| laid_out(&bits, machine, &known)))
}

/// What lies where, as a person says it.
fn edit(line: Link) -> impl IntoView {
    let tools = Memo::new(move |_| needed(line));
    let says = |places: Vec<Option<StockedTool>>| link::ask(Ask::Stock { places, spindle: Held::Nothing });
    let rows = move || {
        tools.get().map(|tools| {
            let each = tools.into_iter().flatten().map(|tool| li().child(called(&tool)));
            ol().child(each.collect::<Vec<_>>())
        })
    };
    details().child((
        summary().child(t!("page.magazine.edit")),
        p().child(t!("page.magazine.fill_is")),
        rows,
        div().class("row").child((
            push_if(
                "button",
                move || may_say(line) && tools.with(Option::is_some),
                t!("page.magazine.fill"),
                move |_| {
                    if let Some(places) = tools.get_untracked() {
                        says(places);
                    }
                },
            ),
            push_if("button", move || may_say(line), t!("page.magazine.none"), move |_| says(Vec::new())),
        )),
    ))
}

/// The block of a machine that has a magazine.
pub(super) fn magazine() -> impl IntoView {
    let line = link::link();
    let has = Memo::new(move |_| line.magazine.with(Option::is_some));
    let report = move || line.magazine.get();
    // In a change that waits for a new tool its dialog asks.
    let waits = Memo::new(move |_| line.state() == Some(State::ToolChange));
    let stopped = Memo::new(move |_| {
        let is = |report: &Arc<MagazineReport>| report.stock.change.is_some() && !report.changes;
        !waits.get() && line.magazine.with(|report| report.as_ref().is_some_and(is))
    });
    move || {
        has.get().then(|| {
            section().class("block magazine").attr("aria-label", t!("page.magazine.title")).child((
                h3().child(t!("page.magazine.title")),
                move || report().and_then(|report| standing(&report)),
                move || report().filter(|_| !waits.get()).and_then(|report| question(line, &report)),
                move || stopped.get().then(|| open_clamp(line, move || may_say(line))),
                move || report().map(|report| list(&report.stock)),
                edit(line),
            ))
        })
    }
}
