//! A GRBL controller or a USB step adapter at a port of this computer: connecting, identification, and
//! commands that only such a machine has. Only probing moves the machine.

use crate::i18n::{key, say, t};
use crate::model::{ControllerEvent, LinkEvent, Support};
use crate::page::{link, read, send, shared};
use crate::widgets::{push_guarded, push_if};
use annulus_core::control::State;
use annulus_core::grbl::settings;
use annulus_core::wire::Ask;
use leptos::html::{details, div, h2, header, li, p, section, summary, ul};
use leptos::prelude::*;

const PROBE_UM: u32 = 10_000;

fn wish(event: ControllerEvent) {
    send(LinkEvent::Controller(event));
}

/// True if a controller is connected to this page itself.
pub(super) fn chosen() -> bool {
    read(|m| m.link.controller.chosen)
}

pub(super) fn plans() -> bool {
    read(|m| m.link.controller.plans())
}

/// The connect button, or why this browser can't connect.
pub(super) fn offer() -> impl IntoView {
    move || {
        let why_not = match read(|m| m.link.controller.support) {
            Support::Unknown => return None,
            Support::Yes => None,
            Support::Missing => Some(key!("page.controller.missing")),
            Support::Insecure => Some(key!("page.controller.insecure")),
        };
        if let Some(why_not) = why_not {
            return Some(p().class("quiet").child(move || crate::i18n::text(why_not, &[])).into_any());
        }
        let free = move || !link::busy();
        let ask = |_| wish(ControllerEvent::Wanted { ask: true });
        let again = move || {
            let take = |_| wish(ControllerEvent::Wanted { ask: false });
            read(|m| m.link.controller.known)
                .then(|| push_if("button", free, t!("page.controller.again"), take))
        };
        let connect = push_if("button", free, t!("page.controller.connect"), ask);
        Some((p().class("quiet").child(t!("page.controller.is")), again, connect).into_any())
    }
}

/// The last block of the set-up: connect a controller, or the connected one.
pub(super) fn controller() -> impl IntoView {
    let inside = || if chosen() || plans() { connected().into_any() } else { offer().into_any() };
    section()
        .class("block")
        .attr("aria-label", t!("page.controller.title"))
        .child((header().child(h2().child(t!("page.controller.title"))), inside))
}

fn connected() -> impl IntoView {
    let who = shared(|m| &m.link.controller.who);
    let name = move || match who.get() {
        _ if read(|m| m.link.controller.is_adapter) => say!("page.controller.adapter"),
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
        // The bridge keeps its port.
        move || {
            let leave = |_| wish(ControllerEvent::LetGo);
            chosen().then(|| push_if("button", || !link::busy(), t!("page.controller.leave"), leave))
        },
    ))
}

/// Set-up commands for a controller: set the board height, probe, and unlock a controller that isn't homed.
pub(super) fn set_up() -> impl IntoView {
    let may =
        || read(|m| m.link.may_act() && matches!(m.link.state(), Some(State::Ready | State::ToolChange)));
    // Our own drill has other buttons for the height, except during a tool change.
    move || {
        read(|m| m.link.controller.plans() || m.link.touches_off()).then(|| {
            (
                push_if("button large", may, t!("page.controller.height"), |_| link::ask(Ask::SetHeight)),
                push_guarded(
                    "button",
                    || "probe",
                    may,
                    t!("page.controller.probe"),
                    |_| link::ask(Ask::Probe { depth_um: PROBE_UM, plate_um: 0 }),
                ),
                p().class("quiet").child(t!("page.controller.probe_is")),
                move || {
                    let unlock = |_| link::ask(Ask::Unlock);
                    read(|m| m.link.state() == Some(State::NotHomed))
                        .then(|| push_if("button", link::may_act, t!("page.controller.unlock"), unlock))
                },
            )
        })
    }
}
