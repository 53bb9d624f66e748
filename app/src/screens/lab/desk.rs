//! What the Lab shows and edits, as signals: the sheet, the bench with its history, the motor, the copied block.
//!
//! ```text
//! view ─ change(field, Bench → Bench) ─▶ History ─▶ bench (memo) ─▶ views
//!                                           └──▶ kept in this tab over a reload
//! ```
//!
//! Comes in: edits from the views. Goes out: signals. Knows no layout.

use super::motion::Part;
use super::queue::Runs;
use crate::browser;
use crate::i18n::say;
use crate::lab::io::{Check, Inputs};
use crate::lab::phases::{Block, Clip};
use crate::lab::{Bench, History, Sheet};
use crate::page::link;
use annulus_core::control::State;
use leptos::prelude::*;
use std::cell::Cell;

const KEPT_AS: &str = "annulus.lab";

/// The Lab. Copies are the same one.
#[derive(Clone, Copy)]
pub(crate) struct Desk {
    /// The sheet on show.
    pub(crate) sheet: RwSignal<Sheet>,
    /// The bench with what it was and will be again.
    pub(super) history: RwSignal<History<Bench>>,
    /// The bench now.
    pub(super) bench: Memo<Bench>,
    /// The motor on show: 0 X, 1 Y, 2 Z.
    pub(super) motor: RwSignal<usize>,
    /// Chosen cells of the phase table.
    pub(super) block: RwSignal<Block>,
    /// Copied cells.
    pub(super) clip: RwSignal<Option<Clip>>,
    /// The chosen line of the queue.
    pub(super) row: RwSignal<usize>,
    /// The queue is shown as one text.
    pub(super) as_text: RwSignal<bool>,
    /// The queue runs on the machine; else in the page.
    pub(super) on_machine: RwSignal<bool>,
    /// The queue's run in the page.
    pub(super) runs: Runs,
    /// The part of the motion sheet on show.
    pub(super) part: RwSignal<Part>,
    /// The servo makes a stroke; else a step.
    pub(super) stroke: RwSignal<bool>,
    /// The inputs as seen so far.
    pub(super) inputs: RwSignal<Inputs>,
    /// The guided check of the sensors, once begun.
    pub(super) check: RwSignal<Option<Check>>,
    /// A job has the machine: nothing here is edited.
    pub(super) locked: Memo<bool>,
    /// Said to those who do not see.
    pub(super) said: RwSignal<String>,
}

thread_local! {
    static DESK: Cell<Option<Desk>> = const { Cell::new(None) };
}

/// The Lab. Made by [`begin`].
pub(crate) fn desk() -> Desk {
    DESK.get().expect("the desk is made before the first screen")
}

/// Makes it in the root of the page, after the link.
pub(crate) fn begin() {
    let kept = browser::tab_storage().and_then(|storage| storage.get_item(KEPT_AS).ok().flatten());
    let bench = kept.map(|text| Bench::of_kept(&text)).unwrap_or_default();
    let history = RwSignal::new(History::new(bench));
    let desk = Desk {
        sheet: RwSignal::new(Sheet::default()),
        history,
        bench: Memo::new(move |_| history.with(|history| history.now().clone())),
        motor: RwSignal::new(0),
        block: RwSignal::new(Block::default()),
        clip: RwSignal::new(None),
        row: RwSignal::new(0),
        as_text: RwSignal::new(false),
        on_machine: RwSignal::new(false),
        runs: Runs::new(),
        part: RwSignal::new(Part::default()),
        stroke: RwSignal::new(false),
        inputs: RwSignal::new(Inputs::default()),
        check: RwSignal::new(None),
        locked: Memo::new(|_| job_has_machine()),
        said: RwSignal::new(String::new()),
    };
    DESK.set(Some(desk));
    let queue = Memo::new(move |_| desk.bench.with(|bench| bench.queue.clone()));
    Effect::new(move |before: Option<()>| {
        queue.track();
        if before.is_some() {
            desk.runs.clear();
        }
    });
    Effect::new(move |_| {
        let Some(bits) = link::link().status.with(|status| status.as_ref().map(|status| status.inputs))
        else {
            return;
        };
        if desk.inputs.with_untracked(|inputs| inputs.bits) != Some(bits) {
            desk.inputs.update(|inputs| *inputs = inputs.seen(browser::clock_ms(), bits));
        }
        if desk.check.with_untracked(|check| check.is_some_and(|check| check.seen(bits) != check)) {
            desk.check.update(|check| *check = check.map(|check| check.seen(bits)));
        }
    });
    Effect::new(move |_| {
        let text = desk.bench.with(Bench::kept);
        if let Some(storage) = browser::tab_storage() {
            let _ = storage.set_item(KEPT_AS, &text);
        }
    });
}

fn job_has_machine() -> bool {
    use State::{Paused, Pausing, Running, Stopping, ToolChange};
    matches!(link::link().state(), Some(Running | Pausing | Paused | ToolChange | Stopping))
}

impl Desk {
    /// Makes an edit; those from one `field` that follow each other are one step back.
    pub(super) fn change(self, field: Option<&str>, edit: impl FnOnce(&Bench) -> Bench) {
        if self.locked.get_untracked() {
            return;
        }
        self.history.update(|history| {
            let next = edit(history.now());
            history.change(field, next);
        });
    }

    /// The person left a field.
    pub(super) fn rest(self) {
        self.history.update_untracked(History::rest);
    }

    /// Back by an edit, or on again.
    pub(crate) fn undo(self, back: bool) {
        if self.locked.get_untracked() {
            return;
        }
        let mut done = false;
        self.history.update(|history| done = if back { history.undo() } else { history.redo() });
        self.said.set(match (done, back) {
            (true, true) => say!("page.lab.undone"),
            (true, false) => say!("page.lab.redone"),
            (false, true) => say!("page.lab.nothing_to_undo"),
            (false, false) => say!("page.lab.nothing_to_redo"),
        });
    }
}
