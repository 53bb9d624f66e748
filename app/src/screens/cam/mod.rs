//! The CAM screen: what is made of the board, in which order, with what, and what the proof says of it.
//!
//! ```text
//! + job ────────+ picture with the toolpaths ─────────+ values ──────+
//! | operations  | as wide as they cut            | of the       |
//! | totals      | findings                       | operation    |
//! +─────────────+────────────────────────────────+──────────────+
//! ```
//!
//! Comes in: the open board, its job and plan. Goes out: edits of the job.

mod editor;
mod entry;
mod export;
mod groups;
mod job;
mod problems;
mod run_sheet;
mod values;

pub(crate) use export::controller;
pub(crate) use job::name_of;

use crate::i18n::language;
use crate::keys::CamKey;
use crate::model::JobEvent;
use crate::page::{open_job, send};
use leptos::html::div;
use leptos::prelude::*;
use wasm_bindgen::JsCast;

/// The panels beside the picture.
pub(crate) fn cam() -> impl IntoView {
    (
        div().class("panel left cam-job").child(job::job()),
        problems::problems(),
        div().class("panel right cam-values").child((values::values(), export::export())),
        move || open_job().template_open.get().then(editor::editor),
        run_sheet::run_sheet(),
    )
}

/// What people call the bit of this name: by form and size in their language, unless somebody gave it a name of its own.
fn called(name: &str) -> String {
    let title = open_job().work.with(|work| {
        let bit = work.as_ref()?.bit(name)?;
        bit.own_name().is_none().then(|| bit.title(&language()))
    });
    title.unwrap_or_else(|| name.to_owned())
}

/// What a key asks of the job.
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
