//! The Simulate screen: the planned motion played, faster or slower, forwards or by steps.
//!
//! ```text
//! timeline ─ Playback ─ at(second) ─▶ head, holes done, stage       the second is all that moves
//! ```
//!
//! Comes in: the plan in time. Goes out: the moment on show. Never moves a machine.

mod commands;
mod player;
mod scrub;

use crate::i18n::t;
use crate::keys::Action;
use crate::model::PlayEvent;
use crate::page::{open_board, play, send};
use crate::screens::shown::Moment;
use crate::view::Progress;
use annulus_core::job::{Mark, Stage};
use leptos::html::div;
use leptos::prelude::*;

/// What a key asks of the playback.
pub(crate) fn act(action: Action) {
    send(match action {
        Action::Play => PlayEvent::Toggle,
        Action::Step(stride) => PlayEvent::Step { stride },
        Action::Beginning => PlayEvent::Seek { at_s: 0.0 },
        Action::End => PlayEvent::End,
        Action::Faster(more) => PlayEvent::Faster { more },
        _ => return,
    });
}

/// How far the picture is.
pub(crate) fn moment() -> Moment {
    let Some(now) = play().now() else { return Moment::default() };
    let drilling = matches!(now.mark, Mark::Hole(_)) && matches!(now.stage, Stage::Approach | Stage::Drill);
    let [x, y, _] = now.position_mm;
    let done = open_board().toolpaths.with(|toolpaths| {
        toolpaths.as_ref().map_or(now.holes_done, |toolpaths| toolpaths.done(now.leg, now.holes_done))
    });
    Moment { progress: Progress { discs: done, drilling, lines: done }, head_mm: Some([x, y]) }
}

/// The panels round the picture.
pub(crate) fn simulate() -> impl IntoView {
    (
        div().class("panel right commands").child(commands::commands()),
        div()
            .class("bottom timeline")
            .attr("role", "region")
            .attr("aria-label", t!("page.simulate.timeline"))
            .child((player::controls(), scrub::coarse(), scrub::fine())),
    )
}
