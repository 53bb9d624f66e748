//! The Simulate screen: plays the planned motion at any speed, or step by step. Never moves a machine.
//!
//! ```text
//! timeline ─ Playback ─ at(second) ─▶ position, holes done, stage       only the time changes
//! ```

mod bands;
mod commands;
mod lines;
mod player;
mod scrub;
mod space;

pub(crate) use space::in_space;

use crate::i18n::t;
use crate::keys::KeyAction;
use crate::model::PlayEvent;
use crate::page::send;
use leptos::html::div;
use leptos::prelude::*;

pub(crate) fn act(action: KeyAction) {
    send(match action {
        KeyAction::Play => PlayEvent::Toggle,
        KeyAction::Step(stride) => PlayEvent::Step { stride },
        KeyAction::Beginning => PlayEvent::Seek { at_s: 0.0 },
        KeyAction::End => PlayEvent::End,
        KeyAction::Faster { more } => PlayEvent::Faster { more },
        _ => return,
    });
}

pub(crate) fn simulate() -> impl IntoView {
    (
        div().class("panel right commands").child(commands::commands()),
        div()
            .class("bottom timeline")
            .attr("role", "region")
            .attr("aria-label", t!("page.simulate.timeline"))
            .child((
                player::controls(),
                scrub::coarse(),
                div().class("row").child((bands::menu(), scrub::fine())),
            )),
    )
}
