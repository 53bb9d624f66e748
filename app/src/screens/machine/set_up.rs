//! Getting ready: home, park and base. Nothing here starts a job.

use super::controller;
use crate::health::{Blocked, blocked};
use crate::i18n::{key, t};
use crate::model::link::LinkPhase;
use crate::page::{link, read};
use crate::widgets::{Icon, icon, push_if};
use annulus_core::control::State;
use annulus_core::wire::Ask;
use leptos::ev;
use leptos::html::{button, div, h2, header, p, section, span};
use leptos::prelude::*;

const HOME_IS: &str = "home-is";

/// Key of the reason why homing is disabled; none if it is enabled.
fn why_not() -> Option<&'static str> {
    if !read(|m| m.link.homes()) {
        return Some(key!("page.machine.no_switches"));
    }
    let open = read(|m| m.link.phase == LinkPhase::Open);
    let blocked = blocked(open, read(|m| m.link.freshness), read(|m| m.link.control.yours), link::state())?;
    Some(match blocked {
        Blocked::NoLink => key!("page.blocked.no_link"),
        Blocked::Old => key!("page.blocked.old"),
        Blocked::NoControl => key!("page.blocked.no_control"),
        Blocked::Alarm => key!("page.blocked.alarm"),
        Blocked::Busy => key!("page.blocked.busy"),
    })
}

/// Park moves out of the way for loading and unloading a board.
fn park() -> impl IntoView {
    button()
        .attr("type", "button")
        .class("button large")
        .attr("data-moves", "park")
        .attr("aria-disabled", "true")
        .prop("disabled", || {
            let in_change =
                read(|m| m.link.may_act() && m.link.controller.parks_in_change(m.link.status.as_deref()));
            !(link::ready() || in_change)
        })
        .attr("title", t!("page.machine.park_is"))
        .on(ev::click, |_| link::ask(Ask::Park))
        .child(t!("page.machine.park"))
}

pub(crate) fn set_up() -> impl IntoView {
    let homed =
        move || !read(|m| m.link.homes()) || link::state().is_some_and(|state| state != State::NotHomed);
    let home_class = move || if homed() { "button large grow" } else { "button large primary grow" };
    let home = button()
        .attr("type", "button")
        .class(home_class)
        .attr("data-moves", "home")
        .attr("aria-disabled", "true")
        .prop("disabled", move || why_not().is_some())
        .attr("title", move || why_not().map(|why| crate::i18n::text(why, &[])))
        .attr("aria-describedby", HOME_IS)
        .on(ev::click, |_| link::ask(Ask::Home))
        .child((icon(Icon::Home), t!("page.machine.home")));
    let zero = move || {
        let zero = read(|m| m.link.status.as_ref()?.zero_mm);
        let unit = read(|m| m.frame.unit);
        let plane = zero.map_or_else(
            || crate::i18n::say!("page.machine.no_zero"),
            |[x, y]| {
                crate::i18n::say!("page.machine.zero_at", x = unit.coordinate(x), y = unit.coordinate(y))
            },
        );
        let needs_z = read(|m| m.link.status.as_ref().is_some_and(|status| status.needs_z_zero));
        if needs_z { format!("{plane} · {}", crate::i18n::say!("page.state.no_z_zero")) } else { plane }
    };
    section().class("block").attr("aria-label", t!("page.machine.set_up")).child((
        header().child(h2().child(t!("page.machine.set_up"))),
        div().class("row").child((home, park())),
        p().class("quiet")
            .attr("id", HOME_IS)
            .child(move || crate::i18n::text(why_not().unwrap_or(key!("page.machine.home_is")), &[])),
        push_if("button large", link::ready, t!("page.machine.base"), |_| link::ask(Ask::SetZero)),
        div().class("row").child((
            span().class("quiet tabular grow").child(zero),
            push_if("button small quiet", link::ready, t!("page.undo"), |_| link::ask(Ask::UndoZero)),
        )),
        controller::set_up(),
        super::touch_off::touch_off(),
        super::level::level(),
        super::second_side::second_side(),
    ))
}
