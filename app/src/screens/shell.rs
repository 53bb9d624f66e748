//! The frame: top bar, work area, status bar; keys, drops and the URL.

use super::{cam, help, machine, machines, palette, splitters, stage, status_bar, top_bar};
use crate::page::{read, watch};
use leptos::html::{div, h1, main};
use leptos::prelude::*;

pub(crate) fn shell() -> impl IntoView {
    let tab = || read(|m| m.frame.tab);
    let panel = move |right: bool| watch(|m| &m.frame.panels).with(|panels| panels.px(tab(), right));
    let width = move |right: bool| panel(right).map_or_else(|| "initial".to_owned(), |px| format!("{px}px"));
    let view = move || read(|m| m.frame.operator).then_some("operator");
    div().class("shell").attr("data-view", view).child((
        div().class("head").child((
            top_bar::top_bar(),
            machine::alarm(),
            machine::lost(),
            machine::elsewhere(),
        )),
        main()
            .class("work")
            .attr("id", "work")
            .attr("tabindex", "-1")
            .attr("data-screen", move || tab().word())
            .attr("data-left", move || panel(false).map(|_| ""))
            .attr("data-right", move || panel(true).map(|_| ""))
            .style(("--left", move || width(false)))
            .style(("--right", move || width(true)))
            .attr("data-stale", move || read(|m| m.board.stale).then_some(""))
            .attr("aria-label", move || top_bar::name_of(tab()))
            .child((
                h1().class("unseen").child(move || top_bar::name_of(tab())),
                stage::stage(),
                move || super::screen(tab()),
                splitters::splitters(),
                cam::panel(),
                cam::run_sheet(),
            )),
        status_bar::status_bar(),
        machine::tool_change(),
        help::help(),
        machines::machines(),
        palette::palette(),
    ))
}
