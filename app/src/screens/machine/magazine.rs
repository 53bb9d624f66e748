//! The tool magazine: which tool is in which slot, the current step of a change, and recovery after a stop.
//! Moves nothing.

use crate::i18n::{language, say, t};
use crate::model::Model;
use crate::page::{link, read, shared, watch};
use crate::widgets::{push, push_guarded, push_if};
use annulus_core::control::State;
use annulus_core::magazine::{ChangeStep, Held, Seen, StockedTool, ToolStock, laid_out};
use annulus_core::wire::{Ask, MagazineReport};
use leptos::html::{details, div, h3, li, ol, p, section, strong, summary};
use leptos::prelude::*;

/// True if the user may state what is in the magazine: nothing moves, and this page has control.
fn may_say() -> bool {
    link::may_act() && matches!(link::state(), Some(State::Ready | State::NotHomed))
}

fn called(tool: &StockedTool) -> String {
    say!("page.magazine.tool", number = tool.number, bit = tool.bit.title(&language()))
}

fn name(step: ChangeStep) -> String {
    crate::i18n::text(step.sentence_key(), &[])
}

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

/// The current step, or the step at which a change stopped and how it continues.
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

/// The question after a stop that left the content of the spindle unknown: the user looks and answers.
fn question(report: &MagazineReport) -> Option<impl IntoView + use<>> {
    let change = report.stock.change.as_ref().filter(|_| !report.changes)?;
    if report.stock.spindle != Held::Unknown {
        return None;
    }
    let (tool, place) = change.uncertain();
    let ask = say!("page.magazine.look", tool = called(tool));
    let number = u32::from(*place) + 1;
    let answer = move |seen: Seen, words: String| {
        let words = move || words.clone();
        push_guarded("button", || "clamp", may_say, words, move |_| link::ask(Ask::ToolSeen { seen }))
    };
    let answers = (
        answer(Seen::InSpindle, say!("page.magazine.in_spindle")),
        answer(Seen::InPlace, say!("page.magazine.in_place", number = number)),
        answer(Seen::TakenAway, say!("page.magazine.taken_away")),
    );
    Some(div().class("notice tone-alarm").attr("role", "alert").child((p().child(ask), answers)))
}

/// The tool that falls out of the spindle when its clamp opens; none if the spindle is empty.
fn falls(report: &MagazineReport) -> Option<String> {
    match &report.stock.spindle {
        Held::Tool { tool, .. } => Some(called(tool)),
        Held::Unknown => report.stock.change.as_ref().map(|change| called(&change.uncertain().0)),
        Held::Nothing => None,
    }
}

/// Opens the clamp after a question that names the tool that will fall out. Enabled by `may`.
pub(super) fn open_clamp(may: impl Fn() -> bool + Copy + Send + Sync + 'static) -> impl IntoView {
    let asks = RwSignal::new(false);
    let tool = Memo::new(move |_| shared(|m| &m.link.magazine).with(|report| falls(report.as_ref()?)));
    move || {
        let tool = tool.get()?;
        Some(if asks.get() {
            let open = move |_| {
                asks.set(false);
                link::ask(Ask::OpenClamp);
            };
            let words = p().child(move || say!("page.magazine.open_falls", tool = tool.clone()));
            let buttons = div().class("row").child((
                push_guarded("button", || "clamp", may, t!("page.magazine.open_now"), open),
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

/// True if the user has opened the clamp to replace a worn tool.
pub(super) fn is_open_for_new() -> bool {
    read(|m| {
        let report = m.link.magazine.as_ref();
        m.link.state() == Some(State::ToolChange)
            && report.is_some_and(|report| report.stock.spindle == Held::Unknown)
    })
}

/// The steps to put a new tool into the clamp of a machine with a magazine; nothing on other machines.
pub(super) fn new_tool() -> impl IntoView {
    let close = |_| link::ask(Ask::ToolSeen { seen: Seen::InSpindle });
    move || {
        read(|m| m.link.magazine.is_some()).then(|| {
            if is_open_for_new() {
                let button =
                    push_guarded("button", || "clamp", link::may_act, t!("page.magazine.close"), close);
                let words = p().child(t!("page.magazine.is_open"));
                div().class("notice tone-change").attr("role", "alert").child((words, button)).into_any()
            } else {
                open_clamp(link::may_act).into_any()
            }
        })
    }
}

/// The tools of the shown job in the slots where it needs them; none without a job.
fn needed() -> Option<Vec<Option<StockedTool>>> {
    let bits = shared(|m| &m.start.shown).with(|job| job.as_ref().map(|job| job.program.bits.clone()))?;
    let known = watch(|m| &m.link.tools).with(|report| report.wear.clone());
    Some(shared(|m| &m.machine).with(|machine| laid_out(&bits, machine, &known)))
}

fn edit() -> impl IntoView {
    let tools = Memo::new(move |_| needed());
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
                move || may_say() && tools.with(Option::is_some),
                t!("page.magazine.fill"),
                move |_| {
                    if let Some(places) = tools.get_untracked() {
                        says(places);
                    }
                },
            ),
            push_if("button", may_say, t!("page.magazine.none"), move |_| says(Vec::new())),
        )),
    ))
}

pub(super) fn magazine() -> impl IntoView {
    let report = move || shared(|m| &m.link.magazine).get();
    // In a tool change that waits for the user, the dialog asks.
    let waits = |m: &Model| m.link.state() == Some(State::ToolChange);
    let stopped = |m: &Model| {
        let report = m.link.magazine.as_ref();
        m.link.state() != Some(State::ToolChange)
            && report.is_some_and(|report| report.stock.change.is_some() && !report.changes)
    };
    move || {
        read(|m| m.link.magazine.is_some()).then(|| {
            section().class("block magazine").attr("aria-label", t!("page.magazine.title")).child((
                h3().child(t!("page.magazine.title")),
                move || report().and_then(|report| standing(&report)),
                move || report().filter(|_| !read(waits)).and_then(|report| question(&report)),
                move || read(stopped).then(|| open_clamp(may_say)),
                move || report().map(|report| list(&report.stock)),
                edit(),
            ))
        })
    }
}
