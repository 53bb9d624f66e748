//! The playback's buttons, clock and facts.
//!
//! Comes in: the playback. Goes out: what is pressed.

use crate::format::{clock, plain};
use crate::i18n::{language, say, t};
use crate::keys::{KeyAction, Stride};
use crate::model::play::SPEEDS;
use crate::model::{FrameEvent, PlayEvent};
use crate::page::{frame, open_board, play, send};
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
    let play = play();
    let name =
        move || if play.running.get() { say!("page.simulate.hold") } else { say!("page.simulate.play") };
    let run = button()
        .attr("type", "button")
        .class("button primary icon")
        .attr("aria-label", name)
        .attr("title", name)
        .on(ev::click, |_| send(PlayEvent::Toggle))
        .child(move || icon(if play.running.get() { Icon::Pause } else { Icon::Play }));
    let time =
        move || say!("page.simulate.clock", now = clock(play.at_s.get()), total = clock(play.total_s()));
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

/// How the board is looked at, and what is wrong on the way.
fn looks() -> impl IntoView {
    use crate::i18n::key;
    let play = play();
    let flat = label().class("row check").child((
        input()
            .attr("type", "checkbox")
            .prop("checked", move || !play.in_space.get())
            .prop("disabled", move || play.no_space.get())
            .on(ev::change, move |event| send(PlayEvent::Flat { flat: Some(event_target_checked(&event)) })),
        span().attr("title", "Alt+3").child(t!("page.simulate.flat")),
    ));
    let travel = label().class("row check").child((
        input()
            .attr("type", "checkbox")
            .prop("checked", move || frame().show_travel.get())
            .prop("disabled", move || play.in_space.get())
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
        play.in_space.get().then(|| rows.map(view).into_iter().collect::<Vec<_>>())
    };
    let wrong = move || {
        let count = play.warnings.with(|warnings| warnings.len());
        (count > 0).then(|| {
            let word = move || say!("page.simulate.wrong", count = count);
            push("button warn", word, |_| send(PlayEvent::Wrong { on: true }))
        })
    };
    let said = Memo::new(move |_| super::bands::said(play));
    let said = span().class("mark-said strong").attr("role", "status").child(move || said.get());
    let none = move || play.no_space.get().then(|| span().class("quiet").child(t!("page.simulate.no_space")));
    div().class("row").child((views, flat, travel, wrong, said, none))
}

/// Speeds of the head that can be chosen, in mm/s.
const WORKING_MM_PER_S: [f64; 7] = [1.0, 5.0, 10.0, 20.0, 50.0, 200.0, 1000.0];

/// By a factor of the planned speed, or by a speed of the head.
fn speeds() -> impl IntoView {
    let play = play();
    let factor = |speed: f64| {
        let chosen = move || play.working_m_per_s.get().is_none() && (play.speed.get() - speed).abs() < 1e-9;
        option()
            .attr("value", format!("x{speed}"))
            .prop("selected", chosen)
            .child(t!("page.simulate.times", speed = plain(speed)))
    };
    let working = |mm_per_s: f64| {
        let m_per_s = mm_per_s * 1e-3;
        option()
            .attr("value", m_per_s.to_string())
            .prop("selected", move || play.working_m_per_s.get() == Some(m_per_s))
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
    let play = play();
    let count = move || {
        let now = play.now()?;
        Some(match play.playback.with(|playback| Some(playback.as_ref()?.counted(&now)))? {
            // Before anything is made nobody counts: a board may be milled first.
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
    let operation = move || play.now().and_then(|now| super::bands::operation(now.mark));
    let tool = move || {
        let bit = play.now()?.bit?;
        open_board().job.with(|job| Some(job.as_ref()?.program.bits.get(bit as usize)?.title(&language())))
    };
    let stage = move || play.now().map(|now| crate::i18n::text(words::stage(now.stage), &[]));
    let speed = move || {
        play.now().map(|now| say!("page.simulate.moving", speed = format!("{:.0}", now.speed_mm_per_s)))
    };
    (
        span().class("strong").child(operation),
        span().class("tabular").child(count),
        span().class("tabular").child(tool),
        span().child(stage),
        span().class("tabular quiet").child(speed),
    )
}
