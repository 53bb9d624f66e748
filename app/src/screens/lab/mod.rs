//! The Lab: try the parts of a machine one by one, without a board. The maths is in `annulus-core`.
//!
//! ```text
//! Inputs and outputs │ Queue │ [Phases] │ Motion │ Servo │ Faults │ Log          undo, redo
//! the panel
//! ```

mod apply;
mod faults;
mod fields;
mod io;
mod log;
mod motion;
mod outputs;
mod phases;
mod queue;
mod servo;

pub(crate) use queue::key as queue_key;

use crate::i18n::{self, sentence, t};
use crate::lab::LabPanel;
use crate::model::LabEvent;
use crate::page::{lab, read, send, watch};
use crate::widgets::{Icon, icon, picture_button_if};
use leptos::ev::{self, KeyboardEvent};
use leptos::html::{button, div, h2, header, p, span};
use leptos::prelude::*;
use wasm_bindgen::JsCast;
use web_sys::HtmlElement;

pub(crate) fn lab() -> impl IntoView {
    let sheet = move || match read(|m| m.lab.sheet) {
        LabPanel::Io => io::io().into_any(),
        LabPanel::Queue => queue::queue().into_any(),
        LabPanel::Phases => phases::phases().into_any(),
        LabPanel::Motion => motion::motion().into_any(),
        LabPanel::Servo => servo::servo().into_any(),
        LabPanel::Faults => faults::faults().into_any(),
        LabPanel::Log => log::log().into_any(),
    };
    div().class("whole").child(
        div().class("lab").child((
            header().class("lab-head").child((sheets(), undo_buttons())),
            locked(),
            div()
                .class("sheet-of-lab")
                .attr("role", "tabpanel")
                .attr("id", "lab-sheet")
                .attr("aria-labelledby", move || tab_id(read(|m| m.lab.sheet)))
                .child((
                    h2().class("unseen").child(move || i18n::text(read(|m| m.lab.sheet).name(), &[])),
                    sheet,
                )),
            div()
                .class("unseen")
                .attr("role", "status")
                .child(move || watch(|m| &m.lab.said).get().map(|text| sentence(&text))),
        )),
    )
}

fn tab_id(sheet: LabPanel) -> String {
    format!("lab-tab-{}", sheet.word())
}

/// The tabs: arrows move between them, Enter and Space open one.
fn sheets() -> impl IntoView {
    let tabs = LabPanel::ALL.map(|this| {
        let chosen = move || read(|m| m.lab.sheet) == this;
        button()
            .attr("type", "button")
            .attr("role", "tab")
            .attr("id", tab_id(this))
            .attr("aria-controls", "lab-sheet")
            .attr("aria-selected", move || if chosen() { "true" } else { "false" })
            .attr("tabindex", move || if chosen() { "0" } else { "-1" })
            .class("tab")
            .on(ev::click, move |_| send(LabEvent::Show { sheet: this }))
            .on(ev::keydown, move |event| go_along(&event, this))
            .child(move || i18n::text(this.name(), &[]))
    });
    div()
        .class("tabs")
        .attr("role", "tablist")
        .attr("aria-label", t!("page.lab.sheets"))
        .child(Vec::from(tabs))
}

fn go_along(event: &KeyboardEvent, from: LabPanel) {
    let to = match event.key().as_str() {
        "ArrowRight" => from.beside(1),
        "ArrowLeft" => from.beside(-1),
        "Home" => LabPanel::ALL[0],
        "End" => LabPanel::ALL[LabPanel::ALL.len() - 1],
        _ => return,
    };
    event.prevent_default();
    let found = document().get_element_by_id(&tab_id(to)).and_then(|tab| tab.dyn_into::<HtmlElement>().ok());
    if let Some(tab) = found {
        let _ = tab.focus();
    }
}

fn undo_buttons() -> impl IntoView {
    let can = move |back: bool| {
        !lab::locked() && {
            let (undo, redo) = read(|m| m.lab.can_undo());
            if back { undo } else { redo }
        }
    };
    div().class("row").child((
        picture_button_if(
            Icon::Undo,
            move || can(true),
            t!("page.lab.undo"),
            |_| send(LabEvent::Undo { back: true }),
        ),
        picture_button_if(
            Icon::Redo,
            move || can(false),
            t!("page.lab.redo"),
            |_| send(LabEvent::Undo { back: false }),
        ),
    ))
}

/// The notice that the Lab is read-only while a job runs.
fn locked() -> impl IntoView {
    move || {
        lab::locked().then(|| {
            p().class("notice tone-pause")
                .attr("role", "status")
                .child((icon(Icon::Lock), span().child(t!("page.lab.locked"))))
        })
    }
}
