//! The job of the open board as signals, with its export and the template it is written with.
//!
//! Goes out: signals to be read; edits as events. Does not know how they are shown.

use super::slots::Slots;
use super::{send, signals as all};
use crate::engine::messages::Checked;
use crate::model::JobEvent;
use crate::model::export::ExportOutcome;
use annulus_core::cam::HoleOrder;
use annulus_core::cam::work::{Operation, OperationKind, Work};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::post::RunSheet;
use leptos::prelude::*;
use std::collections::BTreeSet;
use std::sync::Arc;

/// The job of the open board.
#[derive(Clone, Copy)]
pub struct OpenJob {
    /// The job now.
    pub work: ReadSignal<Option<Arc<Work>>>,
    /// Whether there is a step back, and one on.
    pub can_undo: ReadSignal<(bool, bool)>,
    /// Place of the chosen operation.
    pub chosen: ReadSignal<usize>,
    /// Findings that the person has read, by name.
    pub read: ReadSignal<BTreeSet<String>>,
    /// The finding that is marked in the picture.
    pub marked: ReadSignal<Option<usize>>,
    /// Groups of findings that the person opened or closed, by name.
    pub turned: ReadSignal<BTreeSet<String>>,
    /// What it is written for: a name that ships, or the word for the person's own.
    pub target: ReadSignal<String>,
    /// What the person's own dialect calls itself.
    pub own_name: ReadSignal<Option<String>>,
    /// The text in the template editor.
    pub text: ReadSignal<Option<Arc<str>>>,
    /// The template editor is open.
    pub template_open: ReadSignal<bool>,
    /// Where its cursor is, in bytes.
    pub cursor: ReadSignal<usize>,
    /// What was found in its text.
    pub checked: ReadSignal<Option<Arc<Checked>>>,
    /// Arcs become lines in an export.
    pub lines_only: ReadSignal<bool>,
    /// What came of the last export.
    pub outcome: ReadSignal<Option<ExportOutcome>>,
    /// Why nothing was written.
    pub not_written: ReadSignal<Vec<Diagnostic>>,
    /// The run sheet on show.
    pub run_sheet: ReadSignal<Option<RunSheet>>,
}

/// The job of the open board.
pub fn open_job() -> OpenJob {
    all().job
}

pub(super) fn signals(slots: &mut Slots) -> OpenJob {
    OpenJob {
        work: slots.handle(|model| &model.job.work),
        can_undo: slots.made(|model| model.job.can_undo()),
        chosen: slots.part(|model| &model.job.chosen),
        read: slots.part(|model| &model.job.read),
        marked: slots.part(|model| &model.job.marked),
        turned: slots.part(|model| &model.job.turned),
        target: slots.part(|model| &model.template.target),
        own_name: slots.made(|model| model.template.own_name()),
        text: slots.part(|model| &model.template.text),
        template_open: slots.part(|model| &model.template.open),
        cursor: slots.part(|model| &model.template.cursor),
        checked: slots.handle(|model| &model.template.checked),
        lines_only: slots.part(|model| &model.export.lines_only),
        outcome: slots.part(|model| &model.export.outcome),
        not_written: slots.part(|model| &model.export.refused),
        run_sheet: slots.part(|model| &model.export.run_sheet),
    }
}

impl OpenJob {
    /// Goes on to what `act` makes of the job. Changes from one `field` are one step.
    pub fn change(self, field: Option<&'static str>, act: impl FnOnce(&Work) -> Work) {
        let next = self.work.with_untracked(|work| work.as_deref().map(act));
        if let Some(work) = next {
            send(JobEvent::Change { field, work: Box::new(work) });
        }
    }

    /// The chosen operation.
    pub fn operation(self) -> Option<Operation> {
        let at = self.chosen.get();
        self.work.with(|work| work.as_ref()?.operations.get(at).cloned())
    }

    /// In which order the first drilling goes.
    pub fn drill_order(self) -> Option<HoleOrder> {
        self.work.with(|work| {
            work.as_ref()?.operations.iter().find_map(|operation| match &operation.action {
                OperationKind::Drill(drill) => Some(drill.order),
                _ => None,
            })
        })
    }
}
