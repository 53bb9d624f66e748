//! No machine yet: how to get one.
//!
//! Comes in: how far the connection is. Goes out: a card with the one thing to do.

use crate::i18n::{say, t};
use crate::model::LinkEvent;
use crate::page::link::{self, Phase};
use crate::page::{frame, send};
use crate::widgets::{Icon, icon, push};
use leptos::html::{code, div, h2, p};
use leptos::prelude::*;

/// The card.
pub(crate) fn connect() -> impl IntoView {
    let line = link::link();
    let text = move || match line.phase.get() {
        Phase::Unpaired if frame().alone.get() => say!("page.connect.alone"),
        Phase::Unpaired => say!("page.connect.unpaired"),
        _ => say!("page.connect.looking"),
    };
    let again = move || {
        (line.phase.get() != Phase::Unpaired)
            .then(|| push("button primary", t!("page.connect.again"), |_| send(LinkEvent::ReconnectNow)))
    };
    let linked = move || line.phase.get() == Phase::Unpaired && !frame().alone.get();
    let command = move || linked().then(|| code().child(t!("page.connect.command")));
    div().class("whole welcome").child(div().class("sheet").child(div().class("drop").child((
        icon(Icon::Plug),
        h2().child(t!("page.connect.title")),
        p().child(text),
        command,
        again,
    ))))
}
