//! What several views compute from the Lab's queue.

use super::{memo, peek, read, send, shared};
use crate::lab::queue::{QueueLine, to_text};
use crate::lab::{LabEdits, rehearsal};
use crate::model::LabEvent;
use annulus_core::control::Trust;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::job::Input;
use annulus_core::machine::Machine;
use annulus_core::queue::{self, CheckedQueue, Queue, Standing};
use annulus_core::units::Length;
use annulus_core::wire::Status;
use leptos::prelude::*;

/// The queue's lines as typed.
pub fn lines() -> Memo<Vec<QueueLine>> {
    memo(|| shared(|m| &m.lab.bench).with(|bench| bench.queue.clone()))
}

pub fn queue() -> Memo<Result<Queue, Vec<Diagnostic>>> {
    memo(|| queue::read("", &lines().with(|lines| to_text(lines))))
}

/// The expected effect of the queue, or why its first invalid row is refused.
pub fn checked() -> Memo<Option<Result<CheckedQueue, Diagnostic>>> {
    memo(|| {
        let (machine, standing) = (shared(|m| &m.machine).get(), standing().get());
        queue().with(|queue| {
            let queue = queue.as_ref().ok()?;
            Some(queue::check(queue, &machine, &machine.output_names(), &standing))
        })
    })
}

/// The state that the queue starts from.
fn standing() -> Memo<Standing> {
    memo(|| {
        let machine = shared(|m| &m.machine).get();
        if read(|m| m.lab.on_machine) {
            shared(|m| &m.link.status).with(|status| told(&machine, status.as_deref()))
        } else {
            rehearsal::standing(&machine).unwrap_or_default()
        }
    })
}

/// State of the machine from its status; unknown without a machine.
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

/// True while the machine runs a job: no edits.
pub fn locked() -> bool {
    read(|m| crate::model::lab::locked(m.link.state()))
}

/// Applies an edit. Consecutive edits of one field are one undo step.
pub fn change(field: Option<&str>, edit: impl FnOnce(&LabEdits) -> LabEdits) {
    let bench = Box::new(edit(&peek(|m| m.lab.bench.clone())));
    send(LabEvent::Change { field: field.map(str::to_owned), bench });
}
