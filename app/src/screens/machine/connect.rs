//! No machine yet: how to get one.
//!
//! Comes in: how far the connection is. Goes out: a card with the one thing to do.

use super::controller;
use crate::i18n::{advice, message, say, t};
use crate::model::LinkEvent;
use crate::page::link::{self, LinkPhase};
use crate::page::{frame, send};
use crate::widgets::{Icon, icon, push};
use leptos::html::{code, div, h2, p};
use leptos::prelude::*;

/// The card.
pub(crate) fn connect() -> impl IntoView {
    let line = link::link();
    let chosen = controller::chosen(line);
    let text = move || match line.phase.get() {
        _ if chosen.get() => line.refused.get().map_or_else(
            || say!("page.controller.looking"),
            |why| format!("{} {}", message(&why), advice(&why)),
        ),
        // The drill of this page says itself why it is not there.
        _ if frame().alone.get() => line
            .refused
            .get()
            .map_or_else(|| say!("page.connect.alone"), |why| format!("{} {}", message(&why), advice(&why))),
        LinkPhase::Unpaired => say!("page.connect.unpaired"),
        _ => say!("page.connect.looking"),
    };
    let again = move || {
        let waits = line.phase.get() != LinkPhase::Unpaired || chosen.get();
        (waits && (!frame().alone.get() || line.refused.get().is_some()))
            .then(|| push("button primary", t!("page.connect.again"), |_| send(LinkEvent::ReconnectNow)))
    };
    let linked = move || line.phase.get() == LinkPhase::Unpaired && !frame().alone.get() && !chosen.get();
    let command = move || linked().then(|| code().child(t!("page.connect.command")));
    div().class("whole welcome").child(div().class("sheet").child(div().class("drop").child((
        icon(Icon::Plug),
        h2().child(t!("page.connect.title")),
        p().child(text),
        command,
        again,
        controller::controller(),
    ))))
}
