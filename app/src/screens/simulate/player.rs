//! The playback's clock and its buttons.
//!
//! Comes in: frames of the browser. Goes out: the second on show; it moves only while it runs.

use super::{Play, play, scrub};
use crate::format::{clock, plain};
use crate::i18n::{language, say, t};
use crate::keys::{Action, Stride};
use crate::link::browser::now_ms;
use crate::page::open_board;
use crate::screens::machine::words;
use crate::widgets::{Icon, icon, picture_button};
use leptos::ev;
use leptos::html::{button, div, label, option, select, span};
use leptos::prelude::*;
use std::cell::Cell;

thread_local! {
    static LAST_MS: Cell<Option<f64>> = const { Cell::new(None) };
}

/// Runs while the playback does.
pub(super) fn begin(play: Play) {
    Effect::new(move |_| {
        if play.running.get() {
            LAST_MS.set(None);
            request_animation_frame(move || frame(play));
        }
    });
}

fn frame(play: Play) {
    if !play.running.get_untracked() {
        return;
    }
    let now = now_ms();
    // A page that was hidden makes no leap when it comes back.
    let gone_s = LAST_MS.replace(Some(now)).map_or(0.0, |last| (now - last).min(200.0)) / 1000.0;
    let at_s = play.at_s.get_untracked() + gone_s * play.speed.get_untracked();
    play.seek(at_s);
    if play.at_s.get_untracked() < at_s {
        play.running.set(false);
    } else {
        request_animation_frame(move || frame(play));
    }
}

fn step(picture: Icon, action: Action, name: &'static str) -> impl IntoView {
    picture_button(picture, move || crate::i18n::text(name, &[]), move |_| play().act(action))
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
        .on(ev::click, move |_| play.toggle())
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
    let options = scrub::SPEEDS.map(|speed| {
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
                    play.speed.set(speed);
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
