//! A GRBL mill or a USB step adapter at a port of this computer, driven by the page itself: how to get one, who it is, and what only such a machine is asked.
//!
//! Comes in: what the browser can, what the controller said. Goes out: wishes. The machine moves by none of it but the probe.

use crate::i18n::{key, say, t};
use crate::model::{ControllerEvent, LinkEvent, Support};
use crate::page::link::{self, Link};
use crate::page::send;
use crate::widgets::push_if;
use annulus_core::control::State;
use annulus_core::controller::settings;
use annulus_core::wire::Ask;
use leptos::html::{details, div, h2, header, li, p, section, summary, ul};
use leptos::prelude::*;

/// How far down the probe looks for the board, µm.
const PROBE_UM: u32 = 10_000;

fn wish(event: ControllerEvent) {
    send(LinkEvent::Controller(event));
}

/// Whether this page has a controller.
pub(super) fn chosen(line: Link) -> Memo<bool> {
    Memo::new(move |_| line.controller.with(|controller| controller.chosen))
}

/// Whether this page has a controller that plans its own motion.
pub(super) fn plans(line: Link) -> Memo<bool> {
    Memo::new(move |_| line.controller.with(|controller| controller.plans()))
}

/// Connect, or the sentence why this browser cannot.
pub(super) fn offer(line: Link) -> impl IntoView {
    let support = Memo::new(move |_| line.controller.with(|controller| controller.support));
    let known = Memo::new(move |_| line.controller.with(|controller| controller.known));
    move || {
        let why_not = match support.get() {
            Support::Unknown => return None,
            Support::Yes => None,
            Support::Missing => Some(key!("page.controller.missing")),
            Support::Insecure => Some(key!("page.controller.insecure")),
        };
        if let Some(why_not) = why_not {
            return Some(p().class("quiet").child(move || crate::i18n::text(why_not, &[])).into_any());
        }
        let free = move || !line.busy();
        let ask = |_| wish(ControllerEvent::Wanted { ask: true });
        let again = move || {
            let take = |_| wish(ControllerEvent::Wanted { ask: false });
            known.get().then(|| push_if("button", free, t!("page.controller.again"), take))
        };
        let connect = push_if("button", free, t!("page.controller.connect"), ask);
        Some((p().class("quiet").child(t!("page.controller.is")), again, connect).into_any())
    }
}

/// The last block of the set-up: a controller to be had, or the one that there is.
pub(super) fn controller() -> impl IntoView {
    let line = link::link();
    let chosen = chosen(line);
    let inside = move || if chosen.get() { connected(line).into_any() } else { offer(line).into_any() };
    section()
        .class("block")
        .attr("aria-label", t!("page.controller.title"))
        .child((header().child(h2().child(t!("page.controller.title"))), inside))
}

fn connected(line: Link) -> impl IntoView {
    let who = Memo::new(move |_| line.controller.with(|controller| controller.who.clone()));
    let is_adapter = Memo::new(move |_| line.controller.with(|controller| controller.is_adapter));
    let name = move || match who.get() {
        _ if is_adapter.get() => say!("page.controller.adapter"),
        None => say!("page.controller.looking"),
        Some(who) => {
            say!("page.controller.name", flavour = who.flavour, version = who.version)
        }
    };
    let rows = move || {
        let who = who.get()?;
        let row = |(number, value): &(u16, f64)| {
            let (number, value, row) = (*number, *value, settings::of(*number)?);
            let text = move || {
                let name = crate::i18n::text(&row.key(), &[]);
                let value = crate::i18n::number(crate::format::plain(value));
                say!("page.controller.setting", number = number, name = name, value = value, unit = row.unit)
            };
            Some(li().class("tabular").child(text))
        };
        let rows: Vec<_> = who.values.iter().filter_map(row).collect();
        Some(details().child((summary().child(t!("page.controller.settings")), ul().child(rows))))
    };
    div().child((
        p().child(name),
        rows,
        push_if(
            "button",
            move || !line.busy(),
            t!("page.controller.leave"),
            |_| {
                wish(ControllerEvent::LetGo);
            },
        ),
    ))
}

/// What only a controller is asked to get ready: the height of the board, and to be unlocked where it was not homed.
pub(super) fn set_up(line: Link) -> impl IntoView {
    let plans = plans(line);
    let may = move || line.may_act() && matches!(line.state(), Some(State::Ready | State::ToolChange));
    let locked = Memo::new(move |_| line.state() == Some(State::NotHomed));
    move || {
        plans.get().then(|| {
            (
                push_if("button large", may, t!("page.controller.height"), |_| link::ask(Ask::SetHeight)),
                push_if("button", may, t!("page.controller.probe"), |_| {
                    link::ask(Ask::Probe { depth_um: PROBE_UM, plate_um: 0 });
                }),
                p().class("quiet").child(t!("page.controller.probe_is")),
                move || {
                    let unlock = |_| link::ask(Ask::Unlock);
                    locked.get().then(|| {
                        push_if("button", move || line.may_act(), t!("page.controller.unlock"), unlock)
                    })
                },
            )
        })
    }
}
