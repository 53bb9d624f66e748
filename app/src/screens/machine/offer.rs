//! A job that was broken off: what is made of it, and the question whether to go on with it.
//!
//! Comes in: what the bridge offers. Goes out: the pre-flight of the rest, or that it is forgotten. Nothing moves here.

use crate::i18n::{say, t};
use crate::model::{LinkEvent, StartEvent};
use crate::page::link::Link;
use crate::page::send;
use crate::widgets::{Icon, icon, push_if};
use annulus_core::control::State;
use leptos::html::{div, span};
use leptos::prelude::*;

/// Goes on with it, or forgets it; nothing where there is none, or while something is in work.
pub(super) fn buttons(line: Link) -> impl IntoView {
    let offer = Memo::new(move |_| {
        let idle = matches!(line.state(), Some(State::Ready | State::NotHomed | State::Alarm));
        line.interrupted.get().filter(|_| idle)
    });
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
    move || {
        let offer = line.interrupted.get()?;
        let (name, done, total) = (offer.name, offer.holes_done, offer.holes_total);
        let text = move || match total {
            0 => say!("page.interrupted.milled", name = name),
            _ => say!("page.interrupted.text", name = name, done = done, total = total),
        };
        Some(div().class("notice tone-pause").attr("role", "status").child((
            icon(Icon::Pause),
            span().class("grow").child(text),
            buttons(line),
        )))
    }
}
