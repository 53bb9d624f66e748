//! The frame: top bar, work area, status bar; keys, drops and the address.
//!
//! Comes in: the state. Goes out: the page. Knows no screen's content.

use super::{
    board, cam, drawing, help, lab, machine, palette, review, settings, simulate, splitters, stage,
    status_bar, top_bar, welcome,
};
use crate::keys::Tab;
use crate::page::{frame, open_board};
use leptos::html::{div, h1, main};
use leptos::prelude::*;

/// The page inside its frame.
pub(crate) fn shell() -> impl IntoView {
    let tab = frame().tab;
    let empty = Memo::new(move |_| open_board().document.with(Option::is_none));
    let reviewing = Memo::new(move |_| open_board().reviewing.get() && !empty.get());
    let screen = move || match tab.get() {
        Tab::Draw => drawing::drawing().into_any(),
        Tab::Machine => machine::machine().into_any(),
        Tab::Lab => lab::lab().into_any(),
        Tab::Settings => settings::settings().into_any(),
        _ if empty.get() => welcome::welcome().into_any(),
        _ if reviewing.get() => review::review().into_any(),
        Tab::Board => board::board().into_any(),
        Tab::Cam => cam::cam().into_any(),
        Tab::Simulate => simulate::simulate().into_any(),
    };
    let panel = move |right: bool| frame().panels.with(|panels| panels.px(tab.get(), right));
    let width = move |right: bool| panel(right).map_or_else(|| "initial".to_owned(), |px| format!("{px}px"));
    let view = move || frame().operator.get().then_some("operator");
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
            .attr("data-screen", move || tab.get().word())
            .attr("data-left", move || panel(false).map(|_| ""))
            .attr("data-right", move || panel(true).map(|_| ""))
            .style(("--left", move || width(false)))
            .style(("--right", move || width(true)))
            .attr("data-stale", move || open_board().stale.get().then_some(""))
            .attr("aria-label", move || top_bar::name_of(tab.get()))
            .child((
                h1().class("unseen").child(move || top_bar::name_of(tab.get())),
                stage::stage(),
                screen,
                splitters::splitters(),
            )),
        status_bar::status_bar(),
        machine::tool_change(),
        help::help(),
        palette::palette(),
    ))
}
