//! The playback's buttons, clock and facts.
//!
//! Comes in: the playback. Goes out: what is pressed.

use crate::format::{clock, plain};
use crate::i18n::{language, say, t};
use crate::keys::{Action, Stride};
use crate::model::PlayEvent;
use crate::model::play::SPEEDS;
use crate::page::{open_board, play, send};
use crate::screens::machine::words;
use crate::widgets::{Icon, icon, picture_button};
use leptos::ev;
use leptos::html::{button, div, label, option, select, span};
use leptos::prelude::*;

fn step(picture: Icon, action: Action, name: &'static str) -> impl IntoView {
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
            step(Icon::ToBeginning, Action::Beginning, key!("page.simulate.beginning")),
            step(Icon::PreviousHole, Action::Step(Stride::Hole(false)), key!("page.simulate.hole_back")),
            step(Icon::Previous, Action::Step(Stride::Segment(false)), key!("page.simulate.segment_back")),
            run,
            step(Icon::Next, Action::Step(Stride::Segment(true)), key!("page.simulate.segment_on")),
            step(Icon::NextHole, Action::Step(Stride::Hole(true)), key!("page.simulate.hole_on")),
            step(Icon::ToEnd, Action::End, key!("page.simulate.end")),
        )),
        span().class("clock tabular").child(time),
        speeds(),
        facts(),
    ))
}

fn speeds() -> impl IntoView {
    let play = play();
    let options = SPEEDS.map(|speed| {
        option()
            .attr("value", speed.to_string())
            .prop("selected", move || (play.speed.get() - speed).abs() < 1e-9)
            .child(t!("page.simulate.times", speed = plain(speed)))
    });
    label().class("row").child((
        span().class("quiet").child(t!("page.simulate.speed")),
        select()
            .on(ev::change, move |event| {
                if let Ok(speed) = event_target_value(&event).parse() {
                    send(PlayEvent::Speed { speed });
                }
            })
            .child(Vec::from(options)),
    ))
}

fn facts() -> impl IntoView {
    let play = play();
    let hole = move || {
        let total =
            play.playback.with(|playback| playback.as_ref().map_or(0, |playback| playback.drilled().len()));
        let done = play.now().map_or(0, |now| now.holes_done);
        say!("page.simulate.hole", done = done, total = total)
    };
    let tool = move || {
        let bit = play.now()?.bit?;
        open_board().job.with(|job| Some(job.as_ref()?.program.bits.get(bit as usize)?.title(&language())))
    };
    let stage = move || play.now().map(|now| crate::i18n::text(words::stage(now.stage), &[]));
    let speed = move || {
        play.now().map(|now| say!("page.simulate.moving", speed = format!("{:.0}", now.speed_mm_per_s)))
    };
    (
        span().class("tabular").child(hole),
        span().class("tabular").child(tool),
        span().child(stage),
        span().class("tabular quiet").child(speed),
    )
}
