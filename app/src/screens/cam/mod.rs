//! The CAM screen: the operations of the job, their order and tools, and the result of the proof.
//!
//! ```text
//! + job ────────+ picture with the toolpaths ─────────+ parameters ──+
//! | operations  | as wide as they cut                 | of the       |
//! | totals      | problems                            | operation    |
//! +─────────────+─────────────────────────────────────+──────────────+
//! ```

mod editor;
mod entry;
mod export;
mod groups;
mod job;
mod problems;
mod run_sheet;
mod values;

pub(crate) use entry::name_of as row_name;
pub(crate) use export::{controller, panel};
pub(crate) use job::name_of;
pub(crate) use run_sheet::run_sheet;

use crate::i18n::language;
use crate::keys::CamKey;
use crate::model::JobEvent;
use crate::page::{read, send, shared};
use leptos::html::div;
use leptos::prelude::*;
use wasm_bindgen::JsCast;

pub(crate) fn cam() -> impl IntoView {
    (
        div().class("panel left cam-job").child(job::job()),
        problems::problems(),
        div().class("panel right cam-values").child(values::values()),
        move || read(|m| m.template.open).then(editor::editor),
    )
}

/// The displayed name of a tool: its own name if it has one, else shape and size in the user's language.
fn called(name: &str) -> String {
    let title = shared(|m| &m.job.work).with(|work| {
        let bit = work.as_ref()?.bit(name)?;
        bit.own_name().is_none().then(|| bit.title(&language()))
    });
    title.unwrap_or_else(|| name.to_owned())
}

pub(crate) fn act(key: CamKey) {
    match key {
        CamKey::Add => {
            let menu = document().get_element_by_id(job::ADD);
            if let Some(menu) = menu.and_then(|menu| menu.dyn_into::<web_sys::HtmlElement>().ok()) {
                let _ = menu.focus();
            }
        }
        CamKey::Move { up } => send(JobEvent::Shift { up }),
        CamKey::Undo { back } => send(JobEvent::Undo { back }),
        CamKey::Remove => send(JobEvent::Remove),
        CamKey::Problem { next: on } => problems::walk(on),
    }
}
