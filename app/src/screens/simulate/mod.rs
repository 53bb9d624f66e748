//! The Simulate screen: the planned motion played, faster or slower, forwards or by steps.
//!
//! ```text
//! timeline ─ Playback ─ at(second) ─▶ head, holes done, stage       the second is all that moves
//! ```
//!
//! Comes in: the plan in time. Goes out: the moment on show. Never moves a machine.

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
use crate::page::{play, send};
use leptos::html::div;
use leptos::prelude::*;

/// What a key asks of the playback.
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

/// The panels round the picture.
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
                div().class("row").child((bands::menu(play()), scrub::fine())),
            )),
    )
}
