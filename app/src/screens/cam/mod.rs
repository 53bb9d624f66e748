//! The CAM screen: what is made of the board, in which order, with what, and what the proof says of it.
//!
//! ```text
//! + job ────────+ picture with the ways ─────────+ values ──────+
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

use crate::keys::CamKey;
use crate::model::JobEvent;
use crate::page::{open_board, open_job, send};
use crate::picture;
use crate::ways::{self, Ways};
use annulus_core::geometry::Point;
use leptos::html::div;
use leptos::prelude::*;
use std::cell::Cell;
use std::sync::Arc;
use wasm_bindgen::JsCast;

thread_local! {
    static WAYS: Cell<Option<Memo<Option<Arc<Ways>>>>> = const { Cell::new(None) };
}

/// Keeps what the planned program does in step with it.
pub(crate) fn begin() {
    let ways = Memo::new(move |_| {
        let desk = open_board();
        let program = desk.program.get()?;
        let body = desk.laid.with(|laid| laid.as_ref().and_then(|laid| laid.laid.body));
        let (corner, origin) = (picture::origin(body), program.origin);
        Some(Arc::new(ways::ways(&program, Point::new(corner.x - origin.x, corner.y - origin.y))))
    });
    WAYS.set(Some(ways));
}

/// What the planned program does. Made by [`begin`].
pub(crate) fn ways() -> Memo<Option<Arc<Ways>>> {
    WAYS.get().expect("the ways are made before the first screen")
}

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

/// What a key asks of the job.
pub(crate) fn act(key: CamKey) {
    match key {
        CamKey::Add => {
            let menu = document().get_element_by_id(job::ADD);
            if let Some(menu) = menu.and_then(|menu| menu.dyn_into::<web_sys::HtmlElement>().ok()) {
                let _ = menu.focus();
            }
        }
        CamKey::Move(up) => send(JobEvent::Shift { up }),
        CamKey::Undo(back) => send(JobEvent::Undo { back }),
        CamKey::Remove => send(JobEvent::Remove),
        CamKey::Problem(on) => problems::walk(on),
    }
}
