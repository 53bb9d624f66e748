//! A job that was broken off: what is made of it, and the question whether to go on with it.
//!
//! Comes in: what the bridge offers. Goes out: the pre-flight of the rest, or that it is forgotten. Nothing moves here.

use crate::i18n::{say, t};
use crate::model::{LinkEvent, StartEvent};
use crate::page::link::Interrupted;
use crate::page::link::Link;
use crate::page::send;
use crate::widgets::{Icon, icon, push_if};
use annulus_core::control::State;
use leptos::html::{div, span};
use leptos::prelude::*;

/// What can be taken up; nothing where there is none, or while something is in work.
pub(super) fn open(line: Link) -> Memo<Option<Interrupted>> {
    Memo::new(move |_| {
        let idle = matches!(line.state(), Some(State::Ready | State::NotHomed | State::Alarm));
        line.interrupted.get().filter(|_| idle)
    })
}

/// Goes on with it, or forgets it.
pub(super) fn buttons(line: Link) -> impl IntoView {
    let offer = open(line);
    move || {
        let offer = offer.get()?;
        let resume = move |_| send(StartEvent::Resume { offer: offer.clone() });
        let forget = |_| send(LinkEvent::Forget);
        Some((
            push_if("button", move || line.may_act(), t!("page.interrupted.resume"), resume),
            push_if("button quiet", move || line.may_act(), t!("page.interrupted.forget"), forget),
        ))
    }
}

/// The same with what is made of it, where nothing else tells that.
pub(super) fn notice(line: Link) -> impl IntoView {
    let offer = open(line);
    move || {
        let Interrupted { name, holes_done, holes_total, toolpaths_done, toolpaths_total, .. } =
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
            buttons(line),
        )))
    }
}
