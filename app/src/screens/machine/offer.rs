//! An interrupted job: how much of it is done, and the buttons to resume or forget it. Moves nothing.

use crate::i18n::{say, t};
use crate::model::link::rest;
use crate::model::{LinkEvent, StartEvent};
use crate::page::{link, send, shared, watch};
use crate::widgets::{Icon, icon, push_if};
use annulus_core::control::State;
use annulus_core::wire::InterruptedJob;
use leptos::html::{div, span};
use leptos::prelude::*;

/// The job that can be resumed; none while the machine is busy.
pub(super) fn open() -> Memo<Option<InterruptedJob>> {
    Memo::new(move |_| {
        let idle = matches!(link::state(), Some(State::Ready | State::NotHomed | State::Alarm));
        watch(|m| &m.link.interrupted).get().filter(|_| idle)
    })
}

/// The job that the main button resumes, if that button doesn't start the planned job.
pub(super) fn of_main_button() -> Memo<Option<InterruptedJob>> {
    let offer = open();
    Memo::new(move |_| {
        let planned = shared(|m| &m.board.job).with(|job| job.as_ref().map(|job| job.key.clone()));
        offer.get().filter(|offer| rest::resumes(Some(offer), planned.as_deref()))
    })
}

/// Forget, and Resume if the main button doesn't offer it.
pub(super) fn buttons() -> impl IntoView {
    let (offer, by_main_button) = (open(), of_main_button());
    move || {
        let offer = offer.get()?;
        let open = move |_| send(StartEvent::Resume { offer: offer.clone() });
        let resume = || push_if("button", link::may_act, t!("page.interrupted.resume"), open);
        let forget = |_| send(LinkEvent::Forget);
        Some((
            by_main_button.with(Option::is_none).then(resume),
            push_if("button quiet", link::may_act, t!("page.interrupted.forget"), forget),
        ))
    }
}

/// A notice with the progress of the interrupted job and the buttons, if no other notice shows them.
pub(super) fn notice() -> impl IntoView {
    let offer = open();
    move || {
        let InterruptedJob { name, holes_done, holes_total, toolpaths_done, toolpaths_total, .. } =
            offer.get()?;
        let text = move || {
            let drilled =
                || say!("page.interrupted.text", name = name, done = holes_done, total = holes_total);
            let milled = || {
                say!("page.interrupted.milled", name = name, done = toolpaths_done, total = toolpaths_total)
            };
            match (holes_total, toolpaths_total) {
                (_, 0) => drilled(),
                (0, _) => milled(),
                _ => say!(
                    "page.interrupted.both",
                    name = name,
                    done = holes_done,
                    total = holes_total,
                    way = toolpaths_done,
                    toolpaths = toolpaths_total,
                ),
            }
        };
        Some(div().class("notice tone-pause").attr("role", "status").child((
            icon(Icon::Pause),
            span().class("grow").child(text),
            buttons(),
        )))
    }
}
