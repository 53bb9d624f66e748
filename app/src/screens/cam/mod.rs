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
use crate::picture;
use crate::ways::{self, Ways};
use crate::workbench::bench;
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
        let desk = crate::document::desk();
        let program = desk.program.get()?;
        let body = desk.laid.with(|laid| laid.as_ref().and_then(|laid| laid.laid.body));
        let (corner, origin) = (picture::origin(body), program.origin);
        Some(Arc::new(ways::ways(&program, Point::new(corner.x - origin.x, corner.y - origin.y))))
    });
    WAYS.set(Some(ways));
    editor::begin();
    run_sheet::begin();
}

/// What the planned program does. Made by [`begin`].
pub(crate) fn ways() -> Memo<Option<Arc<Ways>>> {
    WAYS.get().expect("the ways are made before the first screen")
}

/// How many findings nobody has read yet, and how many losses of the plan nobody has seen.
pub(crate) fn unread() -> usize {
    let read = bench().read;
    let missing = problems::missing().iter().filter(|loss| problems::is_unseen(loss)).count();
    missing
        + crate::document::desk().proved.with(|proved| {
            let findings = proved.iter().flat_map(|proved| &proved.findings);
            let new = |finding: &&annulus_core::proof::Finding| {
                finding.must_be_read() && read.with(|read| !read.contains(&finding.id))
            };
            findings.filter(new).count()
        })
}

/// Whether the plan on show may be exported or sent: it is that of the job, it is proved, every finding was read and every
/// loss seen.
pub(crate) fn cleared() -> bool {
    let proved = crate::document::desk().proved.with(Option::is_some);
    proved && !bench().stale.get() && unread() == 0
}

/// The panels beside the picture.
pub(crate) fn cam() -> impl IntoView {
    (
        div().class("panel left cam-job").child(job::job()),
        problems::problems(),
        div().class("panel right cam-values").child((values::values(), export::export())),
        move || editor::sheet().open.get().then(editor::editor),
        run_sheet::run_sheet(),
    )
}

/// What a key asks of the job.
pub(crate) fn act(key: CamKey) {
    let bench = bench();
    match key {
        CamKey::Add => {
            let menu = document().get_element_by_id(job::ADD);
            if let Some(menu) = menu.and_then(|menu| menu.dyn_into::<web_sys::HtmlElement>().ok()) {
                let _ = menu.focus();
            }
        }
        CamKey::Move(up) => bench.shift(up),
        CamKey::Undo(back) => bench.undo(back),
        CamKey::Remove => bench.remove(),
        CamKey::Problem(on) => problems::walk(on),
    }
}
