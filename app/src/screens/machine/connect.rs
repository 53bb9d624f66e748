//! No machine yet: how to connect one.

use super::controller;
use crate::i18n::{advice, message, say, t};
use crate::model::link::LinkPhase;
use crate::model::{LinkEvent, Model};
use crate::page::{read, send, watch};
use crate::widgets::{Icon, icon, push};
use leptos::html::{code, div, h2, p};
use leptos::prelude::*;

pub(crate) fn connect() -> impl IntoView {
    let text = || match read(|m| m.link.phase) {
        _ if controller::chosen() => watch(|m| &m.link.refused).get().map_or_else(
            || say!("page.controller.looking"),
            |why| format!("{} {}", message(&why), advice(&why)),
        ),
        // The page's own drill gives the reason itself.
        _ if read(|m| m.frame.alone) => watch(|m| &m.link.refused)
            .get()
            .map_or_else(|| say!("page.connect.alone"), |why| format!("{} {}", message(&why), advice(&why))),
        LinkPhase::Unpaired => say!("page.connect.unpaired"),
        _ => say!("page.connect.looking"),
    };
    let again = move || {
        let waits = |m: &Model| m.link.phase != LinkPhase::Unpaired || m.link.controller.chosen;
        (read(waits) && read(|m| !m.frame.alone || m.link.refused.is_some()))
            .then(|| push("button primary", t!("page.connect.again"), |_| send(LinkEvent::ReconnectNow)))
    };
    let linked =
        |m: &Model| m.link.phase == LinkPhase::Unpaired && !m.frame.alone && !m.link.controller.chosen;
    let command = move || read(linked).then(|| code().child(t!("page.connect.command")));
    div().class("whole welcome").child(div().class("sheet").child(div().class("drop").child((
        icon(Icon::Plug),
        h2().child(t!("page.connect.title")),
        p().child(text),
        command,
        again,
        controller::controller(),
    ))))
}
