//! Getting ready: home, park and base.
//!
//! Comes in: what the machine allows now. Goes out: `Home`, `Park`, `SetZero`, `UndoZero`. Nothing here starts a job.

use super::controller;
use crate::health::{Blocked, blocked};
use crate::i18n::{key, t};
use crate::page::frame;
use crate::page::link::{self, Link, LinkPhase};
use crate::widgets::{Icon, icon, push_if};
use annulus_core::control::State;
use annulus_core::wire::Ask;
use leptos::ev;
use leptos::html::{button, div, h2, header, p, section, span};
use leptos::prelude::*;

/// The sentence under Home.
const HOME_IS: &str = "home-is";

/// The key of the sentence why the machine cannot be initialised now; none when it can.
fn why_not(line: Link) -> Option<&'static str> {
    if !line.homes() {
        return Some(key!("page.machine.no_switches"));
    }
    let open = line.phase.get() == LinkPhase::Open;
    let blocked = blocked(open, line.freshness.get(), line.control.get().yours, line.state())?;
    Some(match blocked {
        Blocked::NoLink => key!("page.blocked.no_link"),
        Blocked::Old => key!("page.blocked.old"),
        Blocked::NoControl => key!("page.blocked.no_control"),
        Blocked::Alarm => key!("page.blocked.alarm"),
        Blocked::Busy => key!("page.blocked.busy"),
    })
}

fn ready(line: Link) -> bool {
    line.may_act() && line.state() == Some(State::Ready)
}

/// Out of the way of a board that is laid on or taken off.
fn park(line: Link) -> impl IntoView {
    button()
        .attr("type", "button")
        .class("button large")
        .prop("disabled", move || !ready(line))
        .attr("title", t!("page.machine.park_is"))
        .on(ev::click, |_| link::ask(Ask::Park))
        .child(t!("page.machine.park"))
}

/// Home, park and base.
pub(crate) fn set_up() -> impl IntoView {
    let line = link::link();
    let homed = move || !line.homes() || line.state().is_some_and(|state| state != State::NotHomed);
    let home_class = move || if homed() { "button large grow" } else { "button large primary grow" };
    let home = button()
        .attr("type", "button")
        .class(home_class)
        .prop("disabled", move || why_not(line).is_some())
        .attr("title", move || why_not(line).map(|why| crate::i18n::text(why, &[])))
        .attr("aria-describedby", HOME_IS)
        .on(ev::click, |_| link::ask(Ask::Home))
        .child((icon(Icon::Home), t!("page.machine.home")));
    let zero = move || {
        let zero = line.status.with(|status| status.as_ref().and_then(|status| status.zero_mm));
        let unit = frame().unit.get();
        zero.map_or_else(
            || crate::i18n::say!("page.machine.no_zero"),
            |[x, y]| {
                crate::i18n::say!("page.machine.zero_at", x = unit.coordinate(x), y = unit.coordinate(y))
            },
        )
    };
    section().class("block").attr("aria-label", t!("page.machine.set_up")).child((
        header().child(h2().child(t!("page.machine.set_up"))),
        div().class("row").child((home, park(line))),
        p().class("quiet")
            .attr("id", HOME_IS)
            .child(move || crate::i18n::text(why_not(line).unwrap_or(key!("page.machine.home_is")), &[])),
        push_if("button large", move || ready(line), t!("page.machine.base"), |_| link::ask(Ask::SetZero)),
        div().class("row").child((
            span().class("quiet tabular grow").child(zero),
            push_if("button small quiet", move || ready(line), t!("page.undo"), |_| link::ask(Ask::UndoZero)),
        )),
        controller::set_up(line),
        super::touch_off::touch_off(line),
        super::level::level(line),
        super::second_side::second_side(line),
    ))
}
