//! Buttons, clock and facts of the playback.

use crate::format::{clock, plain};
use crate::i18n::{language, say, t};
use crate::keys::{KeyAction, Stride};
use crate::model::play::SPEEDS;
use crate::model::{FrameEvent, PlayEvent};
use crate::page::{board, read, send, shared};
use crate::screens::machine::{made, words};
use crate::widgets::{Icon, icon, picture_button, push};
use annulus_core::sim::Counted;
use leptos::ev;
use leptos::html::{button, div, input, label, option, select, span};
use leptos::prelude::*;

fn step(picture: Icon, action: KeyAction, name: &'static str) -> impl IntoView {
    picture_button(picture, move || crate::i18n::text(name, &[]), move |_| super::act(action))
}

/// Buttons, clock, hole, tool, stage.
pub(super) fn controls() -> impl IntoView {
    use crate::i18n::key;
    let name = move || {
        if read(|m| m.play.running) { say!("page.simulate.hold") } else { say!("page.simulate.play") }
    };
    let run = button()
        .attr("type", "button")
        .class("button primary icon")
        .attr("aria-label", name)
        .attr("title", name)
        .on(ev::click, |_| send(PlayEvent::Toggle))
        .child(move || icon(if read(|m| m.play.running) { Icon::Pause } else { Icon::Play }));
    let time = move || {
        say!(
            "page.simulate.clock",
            now = clock(read(|m| m.play.at_s)),
            total = clock(read(|m| m.play.total_s()))
        )
    };
    div().class("facts-line").child((
        div().class("row").attr("role", "group").attr("aria-label", t!("page.simulate.playback")).child((
            step(Icon::ToBeginning, KeyAction::Beginning, key!("page.simulate.beginning")),
            step(
                Icon::PreviousHole,
                KeyAction::Step(Stride::Hole { onwards: false }),
                key!("page.simulate.hole_back"),
            ),
            step(
                Icon::Previous,
                KeyAction::Step(Stride::Segment { onwards: false }),
                key!("page.simulate.segment_back"),
            ),
            run,
            step(
                Icon::Next,
                KeyAction::Step(Stride::Segment { onwards: true }),
                key!("page.simulate.segment_on"),
            ),
            step(
                Icon::NextHole,
                KeyAction::Step(Stride::Hole { onwards: true }),
                key!("page.simulate.hole_on"),
            ),
            step(Icon::ToEnd, KeyAction::End, key!("page.simulate.end")),
        )),
        span().class("clock tabular").child(time),
        speeds(),
        facts(),
        looks(),
    ))
}

fn looks() -> impl IntoView {
    use crate::i18n::key;
    let flat = label().class("row check").child((
        input()
            .attr("type", "checkbox")
            .prop("checked", move || !read(|m| m.play.in_space()))
            .prop("disabled", move || read(|m| m.play.no_space))
            .on(ev::change, move |event| send(PlayEvent::Flat { flat: Some(event_target_checked(&event)) })),
        span().attr("title", "Alt+3").child(t!("page.simulate.flat")),
    ));
    let travel = label().class("row check").child((
        input()
            .attr("type", "checkbox")
            .prop("checked", move || read(|m| m.frame.show_travel))
            .prop("disabled", move || read(|m| m.play.in_space()))
            .on(ev::change, move |event| send(FrameEvent::Travel { on: event_target_checked(&event) })),
        span().child(t!("page.simulate.travel")),
    ));
    let views = move || {
        let rows = [
            (KeyAction::HomeView, key!("page.simulate.home_view")),
            (KeyAction::FromAbove, key!("page.simulate.from_above")),
            (KeyAction::Flip, key!("page.simulate.flip")),
        ];
        let view = |(action, name): (KeyAction, &'static str)| {
            push(
                "button quiet",
                move || crate::i18n::text(name, &[]),
                move |_| send(FrameEvent::Look { action }),
            )
        };
        read(|m| m.play.in_space()).then(|| rows.map(view).into_iter().collect::<Vec<_>>())
    };
    let wrong = move || {
        let count = read(|m| m.play.warnings.len());
        (count > 0).then(|| {
            let word = move || say!("page.simulate.wrong", count = count);
            push("button warn", word, |_| send(PlayEvent::Wrong { on: true }))
        })
    };
    let said = Memo::new(|_| super::bands::said());
    let said = span().class("mark-said strong").attr("role", "status").child(move || said.get());
    let none =
        move || read(|m| m.play.no_space).then(|| span().class("quiet").child(t!("page.simulate.no_space")));
    div().class("row").child((views, flat, travel, wrong, said, none))
}

const WORKING_MM_PER_S: [f64; 7] = [1.0, 5.0, 10.0, 20.0, 50.0, 200.0, 1000.0];

/// The speed: a factor of the planned speed, or a tool speed.
fn speeds() -> impl IntoView {
    let factor = |speed: f64| {
        let chosen = move || {
            read(|m| m.play.working_m_per_s.is_none()) && (read(|m| m.play.speed) - speed).abs() < 1e-9
        };
        option()
            .attr("value", format!("x{speed}"))
            .prop("selected", chosen)
            .child(t!("page.simulate.times", speed = plain(speed)))
    };
    let working = |mm_per_s: f64| {
        let m_per_s = mm_per_s * 1e-3;
        option()
            .attr("value", m_per_s.to_string())
            .prop("selected", move || read(|m| m.play.working_m_per_s) == Some(m_per_s))
            .child(t!("page.simulate.working", speed = plain(m_per_s)))
    };
    let options = (Vec::from(SPEEDS.map(factor)), Vec::from(WORKING_MM_PER_S.map(working)));
    label().class("row").child((
        span().class("quiet").child(t!("page.simulate.speed")),
        select()
            .on(ev::change, move |event| {
                let chosen = event_target_value(&event);
                let event = match chosen.strip_prefix('x') {
                    Some(factor) => factor.parse().ok().map(|speed| PlayEvent::Speed { speed }),
                    None => chosen.parse().ok().map(|m_per_s| PlayEvent::Working { m_per_s }),
                };
                event.into_iter().for_each(send);
            })
            .child(options),
    ))
}

fn facts() -> impl IntoView {
    let count = move || {
        let now = board::moment()?;
        Some(match shared(|m| &m.play.playback).with(|playback| Some(playback.as_ref()?.counted(&now)))? {
            // Before the first hole or toolpath there is no count, because it isn't clear yet which one to
            // show.
            Counted::Nothing => return None,
            Counted::Hole { number, total } => say!("page.simulate.hole", done = number, total = total),
            Counted::Toolpath { number, total } => {
                say!("page.simulate.toolpath", done = number, total = total)
            }
            Counted::All { holes, toolpaths } => {
                say!("page.simulate.all", made = made(holes > 0, holes, toolpaths))
            }
        })
    };
    let operation = move || board::moment().and_then(|now| super::bands::operation(now.mark));
    let tool = move || {
        let bit = board::moment()?.bit?;
        shared(|m| &m.board.job)
            .with(|job| Some(job.as_ref()?.program.bits.get(bit as usize)?.title(&language())))
    };
    let stage = move || board::moment().map(|now| crate::i18n::text(words::stage(now.stage), &[]));
    let speed = move || {
        board::moment().map(|now| say!("page.simulate.moving", speed = format!("{:.0}", now.speed_mm_per_s)))
    };
    (
        span().class("strong").child(operation),
        span().class("tabular").child(count),
        span().class("tabular").child(tool),
        span().child(stage),
        span().class("tabular quiet").child(speed),
    )
}
