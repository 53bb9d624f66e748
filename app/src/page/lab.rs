//! The Lab as signals.
//!
//! Goes out: signals to be read; edits as events. Knows no layout.

use super::slots::Slots;
use super::{send, signals as all};
use crate::lab::io::{Check, KnownInputs};
use crate::lab::panel::PanelPart;
use crate::lab::phases::{CellBlock, Clip};
use crate::lab::queue::{QueueLine, to_text};
use crate::lab::{LabEdits, LabPanel, rehearsal};
use crate::model::{LabEvent, lab};
use crate::said::Text;
use annulus_core::control::Trust;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::job::Input;
use annulus_core::machine::Machine;
use annulus_core::queue::{self, CheckedQueue, Queue, RowResult, Standing};
use annulus_core::units::Length;
use annulus_core::wire::Status;
use leptos::prelude::*;
use std::sync::Arc;

/// The Lab. Copies are the same one.
#[derive(Clone, Copy)]
pub struct Lab {
    /// The sheet on show.
    pub sheet: ReadSignal<LabPanel>,
    /// Whether there is a step back, and one on.
    pub can_undo: ReadSignal<(bool, bool)>,
    /// The bench now.
    pub bench: ReadSignal<Arc<LabEdits>>,
    /// The motor on show: 0 X, 1 Y, 2 Z.
    pub motor: ReadSignal<usize>,
    /// Chosen cells of the phase table.
    pub block: ReadSignal<CellBlock>,
    /// Copied cells.
    pub clip: ReadSignal<Option<Clip>>,
    /// The chosen line of the queue.
    pub row: ReadSignal<usize>,
    /// The queue is shown as one text.
    pub as_text: ReadSignal<bool>,
    /// The queue runs on the machine; else in the page.
    pub on_machine: ReadSignal<bool>,
    /// The queue's run in the page.
    pub runs: LabRunSignals,
    /// The part of the motion sheet on show.
    pub part: ReadSignal<PanelPart>,
    /// The servo makes a stroke; else a step.
    pub stroke: ReadSignal<bool>,
    /// The inputs as seen so far.
    pub inputs: ReadSignal<KnownInputs>,
    /// The guided check of the sensors, once begun.
    pub check: ReadSignal<Option<Check>>,
    /// A job has the machine: nothing here is edited.
    pub locked: ReadSignal<bool>,
    /// Said to those who do not see.
    pub said: ReadSignal<Option<Text>>,
    /// The queue's lines as typed.
    pub lines: Memo<Vec<QueueLine>>,
    /// The same as rows that may be run, or what is wrong with them, line by line.
    pub read: Memo<Result<Queue, Vec<Diagnostic>>>,
    /// What the queue will do, or the first row that may not be.
    pub checked: Memo<Option<Result<CheckedQueue, Diagnostic>>>,
}

/// The run of the queue in this page.
#[derive(Clone, Copy)]
pub struct LabRunSignals {
    /// Results, one a line.
    pub results: ReadSignal<Arc<Vec<RowResult>>>,
    /// The line that comes next, while a run is held.
    pub next: ReadSignal<Option<usize>>,
    /// It runs now.
    pub running: ReadSignal<bool>,
    /// How it ended or why it rests.
    pub said: ReadSignal<Option<Text>>,
}

/// The Lab.
pub fn open_lab() -> Lab {
    all().lab
}

/// How the drill stands, as far as the machine told it; without a machine nothing is known.
fn told(machine: &Machine, status: Option<&Status>) -> Standing {
    let Some(status) = status else { return Standing::default() };
    let steps = |mm: f64, axis: usize| machine.axis(axis).scale.steps(Length::from_mm(mm));
    Standing {
        position: status.steps,
        zero: status.zero_mm.map(|[x, y]| [steps(x, 0), steps(y, 1)]),
        homed: [status.trust == Trust::Trusted; 3],
        rpm: status.spindle_rpm,
        foot_down: status.inputs & Input::FootDown.bit() != 0,
    }
}

pub(super) fn signals(slots: &mut Slots) -> Lab {
    let bench = slots.kept(|model| &model.lab.bench);
    let on_machine = slots.part(|model| &model.lab.on_machine);
    let (machine, status) = (slots.kept(|model| &model.machine), slots.handle(|model| &model.link.status));
    let lines = Memo::new(move |_| bench.with(|bench| bench.queue.clone()));
    let read = Memo::new(move |_| queue::read("", &lines.with(|lines| to_text(lines))));
    let standing = Memo::new(move |_| {
        let machine = machine.get();
        if on_machine.get() {
            status.with(|status| told(&machine, status.as_deref()))
        } else {
            rehearsal::standing(&machine).unwrap_or_default()
        }
    });
    let checked = Memo::new(move |_| {
        let (machine, standing) = (machine.get(), standing.get());
        read.with(|read| {
            read.as_ref().ok().map(|queue| queue::check(queue, &machine, &machine.output_names(), &standing))
        })
    });
    Lab {
        sheet: slots.part(|model| &model.lab.sheet),
        can_undo: slots.made(|model| model.lab.can_undo()),
        bench,
        motor: slots.part(|model| &model.lab.motor),
        block: slots.part(|model| &model.lab.block),
        clip: slots.part(|model| &model.lab.clip),
        row: slots.part(|model| &model.lab.row),
        as_text: slots.part(|model| &model.lab.as_text),
        on_machine,
        runs: LabRunSignals {
            results: slots.kept(|model| &model.lab.run.results),
            next: slots.part(|model| &model.lab.run.next),
            running: slots.part(|model| &model.lab.run.running),
            said: slots.part(|model| &model.lab.run.said),
        },
        part: slots.part(|model| &model.lab.part),
        stroke: slots.part(|model| &model.lab.stroke),
        inputs: slots.part(|model| &model.lab.inputs),
        check: slots.part(|model| &model.lab.check),
        locked: slots.made(|model| lab::locked(model.link.state())),
        said: slots.part(|model| &model.lab.said),
        lines,
        read,
        checked,
    }
}

impl Lab {
    /// Makes an edit; those from one field that follow each other are one step back.
    pub fn change(self, field: Option<&str>, edit: impl FnOnce(&LabEdits) -> LabEdits) {
        let bench = Box::new(self.bench.with_untracked(|bench| edit(bench)));
        send(LabEvent::Change { field: field.map(str::to_owned), bench });
    }
}
