//! The job panel on the left: the side that is up, the operations in order, and the totals.
//!
//! ```text
//! [x] 1 Isolate, top        checkbox: on or off; press: its parameters on the right
//! [x] 2 Drill               reorder by dragging, by buttons, or by Alt and arrows
//! + Add
//! ```

use super::entry::entry;
use crate::format::duration;
use crate::i18n::{self, say, sentence, t};
use crate::model::{FrameEvent, JobEvent};
use crate::page::{board, peek, read, send, shared};
use crate::picture;
use crate::view::Palette;
use crate::widgets::{Icon, choice, fact, menu_word, picture_button_if, segmented, tick};
use crate::workbench::edit;
use annulus_core::board::Face;
use annulus_core::cam::parameters::SETUP;
use annulus_core::cam::work::{Operation, OperationKind, Setup};
use annulus_core::job::milled_mm;
use annulus_core::machine::Field;
use leptos::ev;
use leptos::html::{button, details, div, dl, h2, header, input, li, ol, section, select, span, summary};
use leptos::prelude::*;
use std::sync::Arc;

pub(crate) fn name_of(operation: &Operation) -> String {
    if operation.name.is_empty() {
        i18n::text(&operation.action.title_key(), &[])
    } else {
        operation.name.clone()
    }
}

fn word_of(word: &str) -> String {
    i18n::text(&format!("page.cam.word.{word}"), &[])
}

pub(super) fn job() -> impl IntoView {
    (sides(), operations(), totals(), board_setup())
}

fn sides() -> impl IntoView {
    let face = || read(|m| Some(m.job.work.as_ref()?.setup.face));
    let turn = |face: Face| send(JobEvent::Turn { face });
    let history = move |back: bool| {
        let (undo, redo) = read(|m| m.job.can_undo());
        if back { undo } else { redo }
    };
    section().class("block").attr("aria-label", t!("page.cam.side")).child((
        header().child((
            h2().child(t!("page.cam.job")),
            div().class("row").child((
                picture_button_if(
                    Icon::Undo,
                    move || history(true),
                    t!("page.cam.undo"),
                    |_| send(JobEvent::Undo { back: true }),
                ),
                picture_button_if(
                    Icon::Redo,
                    move || history(false),
                    t!("page.cam.redo"),
                    |_| send(JobEvent::Undo { back: false }),
                ),
            )),
        )),
        segmented(
            t!("page.cam.side"),
            (
                choice(move || face() == Some(Face::Top), t!("page.side.top"), move |_| turn(Face::Top)),
                choice(
                    move || face() == Some(Face::Bottom),
                    t!("page.view.bottom"),
                    move |_| {
                        turn(Face::Bottom);
                    },
                ),
            ),
        ),
    ))
}

fn operations() -> impl IntoView {
    let places = Memo::new(move |_| {
        shared(|m| &m.job.work)
            .with(|work| work.as_ref().map(|work| edit::of_face(work, work.setup.face)).unwrap_or_default())
    });
    let lines = move || {
        let places = places.get();
        (1..).zip(places).map(|(number, at)| line(number, at).into_any()).collect::<Vec<_>>()
    };
    let any = move || places.with(|places| places.contains(&read(|m| m.job.chosen)));
    let can_move = move |up: bool| {
        places.with(|places| {
            let here = places.iter().position(|at| *at == read(|m| m.job.chosen));
            here.is_some_and(|here| if up { here > 0 } else { here + 1 < places.len() })
        })
    };
    section().class("block").attr("aria-label", t!("page.cam.operations")).child((
        header().child((
            h2().child(t!("page.cam.operations")),
            div().class("row").child((
                picture_button_if(
                    Icon::Up,
                    move || can_move(true),
                    t!("page.cam.up"),
                    |_| send(JobEvent::Shift { up: true }),
                ),
                picture_button_if(
                    Icon::Down,
                    move || can_move(false),
                    t!("page.cam.down"),
                    |_| send(JobEvent::Shift { up: false }),
                ),
                picture_button_if(Icon::Cross, any, t!("page.cam.remove"), |_| send(JobEvent::Remove)),
            )),
        )),
        ol().class("operations").child(lines),
        add(),
    ))
}

pub(super) const ADD: &str = "cam-add";

fn add() -> impl IntoView {
    let words = OperationKind::WORDS.map(|word| menu_word(word, || false, move || word_of(word)));
    select()
        .attr("id", ADD)
        .attr("aria-label", t!("page.cam.add"))
        .prop("value", "")
        .on(ev::change, move |event| {
            let word = event_target_value(&event);
            send(JobEvent::Add { word });
            let menu: web_sys::HtmlSelectElement = event_target(&event);
            menu.set_value("");
        })
        .child((menu_word("", || true, t!("page.cam.add")), Vec::from(words)))
}

fn line(number: usize, at: usize) -> impl IntoView {
    let operation =
        Memo::new(move |_| shared(|m| &m.job.work).with(|work| work.as_ref()?.operations.get(at).cloned()));
    let name = move || operation.with(|operation| operation.as_ref().map(name_of).unwrap_or_default());
    let bit = move || {
        operation.with(|operation| operation.as_ref().map(|one| super::called(&one.bit)).unwrap_or_default())
    };
    let on = move || operation.with(|operation| operation.as_ref().is_some_and(|one| one.on));
    let flip = move || {
        board::change_job(None, |work| edit::changed(work, at, |operation| operation.on = !operation.on));
    };
    let chosen = move || read(|m| m.job.chosen) == at;
    let colour = move || {
        operation.with(|operation| {
            let kind = operation.as_ref().map_or(0, picture::kind);
            Palette::DARK.operation(kind).css()
        })
    };
    li().class(move || if chosen() { "operation chosen" } else { "operation" })
        .attr("draggable", "true")
        .on(ev::dragstart, move |event| {
            if let Some(data) = event.data_transfer() {
                let _ = data.set_data("text/plain", &at.to_string());
            }
            // Choosing a lit operation again would end the light.
            if peek(|m| m.job.chosen != at) {
                send(JobEvent::Choose { at });
            }
        })
        .on(ev::dragover, |event| event.prevent_default())
        .on(ev::drop, move |event| {
            let from = event.data_transfer().and_then(|data| data.get_data("text/plain").ok());
            if let Some(from) = from.and_then(|text| text.parse().ok()) {
                event.prevent_default();
                event.stop_propagation();
                send(JobEvent::Move { from, to: at });
            }
        })
        .child((
            input()
                .attr("type", "checkbox")
                .attr("aria-label", move || say!("page.cam.done", name = name()))
                .prop("checked", on)
                .on(ev::change, move |_| flip()),
            button()
                .attr("type", "button")
                .attr("aria-current", move || chosen().then_some("true"))
                .attr("title", t!("page.cam.light"))
                .on(ev::click, move |event| {
                    if event.ctrl_key() || event.meta_key() {
                        flip();
                    } else {
                        send(JobEvent::Choose { at });
                    }
                })
                .child((
                    span().class("swatch").style(("--swatch", colour)),
                    span()
                        .class("grow")
                        .child(move || say!("page.cam.numbered", number = number, name = name())),
                    span().class("quiet").child(bit),
                )),
        ))
}

fn totals() -> impl IntoView {
    let time = move || {
        shared(|m| &m.board.timed).with(|timed| {
            timed.as_ref().map_or_else(|| "–".to_owned(), |timed| sentence(&duration(timed.total_s)))
        })
    };
    let metres = |mm: f64| format!("{:.2}", mm / 1000.0);
    let travel = move || {
        let travel = board::toolpaths().with(|all| all.as_ref().map_or(0.0, |all| all.travel_mm));
        say!("page.cam.metres", metres = metres(travel))
    };
    let milled = move || {
        let milled = shared(|m| &m.board.job)
            .with(|job| job.as_ref().map_or(0.0, |job| milled_mm(&job.program).iter().sum::<f64>()));
        say!("page.cam.metres", metres = metres(milled))
    };
    let count =
        move || board::toolpaths().with(|all| all.as_ref().map_or(0, |all| all.toolpath_count())).to_string();
    let holes = move || {
        board::toolpaths()
            .with(|toolpaths| {
                toolpaths.as_ref().map_or(0, |toolpaths| toolpaths.stops.len() - toolpaths.toolpath_count())
            })
            .to_string()
    };
    let changes = move || read(|m| m.board.job.as_ref().map_or(0, |job| job.program.bits.len())).to_string();
    section()
        .class(move || if read(|m| m.board.stale) { "block stale-numbers" } else { "block" })
        .attr("aria-label", t!("page.cam.totals"))
        .child(dl().class("facts").child((
            fact(t!("page.cam.time"), time),
            fact(t!("page.cam.milled"), milled),
            fact(t!("page.cam.travel"), travel),
            fact(t!("page.cam.toolpaths"), count),
            fact(t!("page.plan.holes"), holes),
            fact(t!("page.plan.changes"), changes),
        )))
        .child(tick(
            || read(|m| m.frame.show_travel),
            t!("page.cam.show_travel"),
            |on| send(FrameEvent::Travel { on }),
        ))
}

/// Panel, flip and pins: set once per job.
fn board_setup() -> impl IntoView {
    let rows = SETUP.iter().filter(|row| row.key != "setup.face").map(setup_row);
    section().class("block").attr("aria-label", t!("page.cam.setup")).child(details().child((
        summary().child(t!("page.cam.setup")),
        div().class("setting-list").child(rows.collect::<Vec<_>>()),
    )))
}

fn setup_row(row: &'static Field<Setup>) -> AnyView {
    let now = Memo::new(move |_| {
        shared(|m| &m.job.work).with(|work| work.as_ref().and_then(|work| row.get(&work.setup)))
    });
    let write = move |value| {
        let Some(work) = peek(|m| m.job.work.clone()) else { return Ok(()) };
        let mut setup = work.setup.clone();
        row.set(&mut setup, &value)?;
        board::change_job(Some(row.key), |work| annulus_core::cam::work::Work { setup, ..work.clone() });
        Ok(())
    };
    entry(row, now, None, Arc::new(write))
}
