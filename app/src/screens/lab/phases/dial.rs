//! The rotor dial: the field's direction step by step, played or stepped by buttons.
//!
//! ```text
//!        1a
//!    2a  ─┼▶ 2b       the hand shows the field; one turn of the dial is four full steps
//!        1b
//! ```

use super::Table;
use crate::i18n::{say, t};
use crate::lab::phases::LINES;
use crate::widgets::{Icon, picture_button};
use annulus_core::machine::phases::{Commutator, angle};
use leptos::html::{div, h3, p, section};
use leptos::prelude::*;
use leptos::svg::{circle, g, line, svg, text};
use std::time::Duration;

/// Time per step while playing: slow enough to see.
const STEP_TIME: Duration = Duration::from_millis(250);

pub(super) fn dial(table: Table) -> impl IntoView {
    let playing = RwSignal::new(false);
    let forward = RwSignal::new(true);
    let step = move |on: bool| {
        forward.set(on);
        table.driver.update(|driver| {
            driver.step(on);
        });
    };
    let timer = set_interval_with_handle(
        move || {
            if playing.get_untracked() {
                step(forward.get_untracked());
            }
        },
        STEP_TIME,
    );
    on_cleanup(move || {
        if let Ok(timer) = timer {
            timer.clear();
        }
    });
    let play_icon = move || {
        if playing.get() {
            picture_button(Icon::Pause, t!("page.lab.phases.hold"), move |_| playing.set(false)).into_any()
        } else {
            picture_button(Icon::Play, t!("page.lab.phases.play"), move |_| playing.set(true)).into_any()
        }
    };
    section().class("block dial").attr("aria-label", t!("page.lab.phases.rotor")).child((
        h3().child(t!("page.lab.phases.rotor")),
        drawing(table),
        p().class("tabular").child(move || in_words(table)),
        div().class("row").child((
            picture_button(Icon::Previous, t!("page.lab.phases.step_back"), move |_| step(false)),
            play_icon,
            picture_button(Icon::Next, t!("page.lab.phases.step_on"), move |_| step(true)),
        )),
    ))
}

fn in_words(table: Table) -> String {
    let byte = table.driver.with(Commutator::byte);
    let names: Vec<_> = LINES.iter().filter(|line| byte & line.mask() != 0).map(|line| line.name).collect();
    let lines = if names.is_empty() { say!("page.lab.phases.none_on") } else { names.join(" ") };
    say!("page.lab.phases.takt", takt = table.column() + 1, lines = lines)
}

fn drawing(table: Table) -> impl IntoView {
    let turned = move || angle(table.driver.with(Commutator::byte)).map(|eighths| u16::from(eighths) * 45);
    let hand = move || {
        turned().map(|deg| {
            g().attr("transform", format!("rotate({deg})")).child((
                line()
                    .attr("x1", "0")
                    .attr("y1", "26")
                    .attr("x2", "0")
                    .attr("y2", "-34")
                    .attr("class", "hand"),
                circle().attr("cx", "0").attr("cy", "-34").attr("r", "5").attr("class", "hand-head"),
            ))
        })
    };
    let poles = [(0, "1a"), (90, "2b"), (180, "1b"), (270, "2a")].map(|(deg, name)| {
        let (x, y) = match deg {
            0 => (0, -56),
            90 => (58, 0),
            180 => (0, 56),
            _ => (-58, 0),
        };
        let lit = move || {
            let mask = LINES.iter().find(|line| line.name == name).map_or(0, |line| line.mask());
            table.driver.with(Commutator::byte) & mask != 0
        };
        g().attr("class", move || if lit() { "pole on" } else { "pole" }).child((
            circle().attr("cx", x).attr("cy", y).attr("r", "13"),
            text().attr("x", x).attr("y", y).attr("dy", "4").attr("text-anchor", "middle").child(name),
        ))
    });
    let ticks = Vec::from([0, 45, 90, 135, 180, 225, 270, 315].map(|deg| {
        let transform = format!("rotate({deg})");
        line()
            .attr("x1", "0")
            .attr("y1", "-38")
            .attr("x2", "0")
            .attr("y2", "-42")
            .attr("transform", transform)
    }));
    svg().attr("viewBox", "-76 -72 152 144").attr("aria-hidden", "true").attr("class", "dial-face").child((
        circle().attr("cx", "0").attr("cy", "0").attr("r", "42").attr("class", "rim"),
        g().attr("class", "ticks").child(ticks),
        Vec::from(poles),
        hand,
        circle().attr("cx", "0").attr("cy", "0").attr("r", "4").attr("class", "axle"),
    ))
}
