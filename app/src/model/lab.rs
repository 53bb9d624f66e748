//! The Lab: its sheet, its setup with history, selection and clipboard, the queue's trial run in this page,
//! the inputs.
//!
//! ```text
//! Change(field, LabEdits) ─▶ History ─▶ setup ─▶ saved in this tab across a reload
//! Run ─▶ Trial: 8 pieces ─▶ yield ─▶ 8 pieces … ─▶ held │ done │ refused    editing the queue ends it
//! ```
//!
//! No edits while the machine runs a job.

use super::{Effect, Event, Model};
use crate::lab::io::{Check, KnownInputs};
use crate::lab::panel::PanelPart;
use crate::lab::phases::{CellBlock, Clip};
use crate::lab::queue::{QueueLine, to_text};
use crate::lab::rehearsal::Trial;
use crate::lab::{LabEdits, LabHistory, LabPanel};
use crate::said::{Text, key};
use annulus_core::control::State;
use annulus_core::queue::{self, Mode, Rest, RowResult};
use std::fmt;
use std::sync::Arc;

/// A queue running on this page's own virtual drill.
struct Running(Trial);

impl fmt::Debug for Running {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "a queue at row {:?}", self.0.row())
    }
}

/// The queue's run in this page.
#[derive(Debug, Default)]
pub struct LabRun {
    trial: Option<Running>,
    pub results: Arc<Vec<RowResult>>,
    /// The next line of a held run.
    pub next: Option<usize>,
    pub running: bool,
    pub said: Option<Text>,
    /// Counts runs; steps of an older run are dropped.
    number: u32,
}

#[derive(Debug)]
pub struct Lab {
    pub sheet: LabPanel,
    history: LabHistory<LabEdits>,
    /// The current setup; an unchanged one keeps its handle.
    pub bench: Arc<LabEdits>,
    /// The displayed motor: 0 X, 1 Y, 2 Z.
    pub motor: usize,
    pub block: CellBlock,
    pub clip: Option<Clip>,
    pub row: usize,
    /// Show the queue as text.
    pub as_text: bool,
    pub on_machine: bool,
    /// The queue's run in the page.
    pub run: LabRun,
    pub part: PanelPart,
    /// The servo simulates a drill cycle instead of a step response.
    pub stroke: bool,
    pub inputs: KnownInputs,
    pub check: Option<Check>,
    /// Text for screen readers.
    pub said: Option<Text>,
}

impl Default for Lab {
    fn default() -> Self {
        Self {
            sheet: LabPanel::default(),
            history: LabHistory::new(LabEdits::default()),
            bench: Arc::default(),
            motor: 0,
            block: CellBlock::default(),
            clip: None,
            row: 0,
            as_text: false,
            on_machine: false,
            run: LabRun::default(),
            part: PanelPart::default(),
            stroke: false,
            inputs: KnownInputs::default(),
            check: None,
            said: None,
        }
    }
}

#[derive(Clone, Debug, PartialEq)]
pub enum LabEvent {
    Kept {
        text: String,
    },
    Show {
        sheet: LabPanel,
    },
    /// Replace the setup. Consecutive changes of one field are one undo step.
    Change {
        field: Option<String>,
        bench: Box<LabEdits>,
    },
    /// The user left a field, which ends its undo step.
    Rest,
    Undo {
        back: bool,
    },
    Motor {
        /// 0 X, 1 Y, 2 Z.
        motor: usize,
    },
    Choose {
        block: CellBlock,
    },
    Copy {
        clip: Clip,
    },
    Row {
        at: usize,
    },
    AsText {
        on: bool,
    },
    OnMachine {
        on: bool,
    },
    Part {
        part: PanelPart,
    },
    /// Simulate a drill cycle or a step response.
    Stroke {
        on: bool,
    },
    CountAnew,
    Check,
    Skip,
    Say {
        text: Text,
    },
    Run {
        mode: Mode,
    },
    /// Continue the run after the page had time for other events.
    Breathed {
        number: u32,
        mode: Mode,
    },
    /// Drop the run.
    Anew,
}

impl Lab {
    pub fn can_undo(&self) -> (bool, bool) {
        (self.history.can_undo(), self.history.can_redo())
    }

    /// Updates the handle from the history; a changed queue ends its run.
    fn renew(&mut self) {
        if *self.bench != *self.history.now() {
            let next = Arc::new(self.history.now().clone());
            if next.queue != self.bench.queue {
                self.anew();
            }
            self.bench = next;
        }
    }

    fn anew(&mut self) {
        self.run = LabRun { number: self.run.number, ..LabRun::default() };
    }

    fn bits(&self) -> u32 {
        self.inputs.bits.unwrap_or_default()
    }

    pub(super) fn told(&mut self, wall_ms: f64, bits: u32) {
        if self.inputs.bits != Some(bits) {
            self.inputs = self.inputs.seen(wall_ms, bits);
        }
        self.check = self.check.map(|check| check.seen(bits));
    }
}

/// True while the machine runs a job: the Lab must not be edited.
pub fn locked(state: Option<State>) -> bool {
    use State::{Paused, Pausing, Running, Stopping, ToolChange};
    matches!(state, Some(Running | Pausing | Paused | ToolChange | Stopping))
}

pub(super) fn update(model: &mut Model, event: LabEvent) -> Vec<Effect> {
    let locked = locked(model.link.state());
    let lab = &mut model.lab;
    let before = lab.bench.clone();
    match event {
        LabEvent::Kept { text } => {
            lab.history = LabHistory::new(LabEdits::of_kept(&text));
            lab.renew();
            return Vec::new();
        }
        LabEvent::Show { sheet } => lab.sheet = sheet,
        LabEvent::Change { field, bench } if !locked => {
            lab.history.change(field.as_deref(), *bench);
            lab.renew();
        }
        LabEvent::Undo { back } if !locked => undo(lab, back),
        LabEvent::Change { .. } | LabEvent::Undo { .. } => {}
        LabEvent::Rest => lab.history.rest(),
        LabEvent::Motor { motor } => lab.motor = motor,
        LabEvent::Choose { block } => lab.block = block,
        LabEvent::Copy { clip } => {
            lab.clip = Some(clip);
            lab.said = Some(Text::of(key!("page.lab.phases.copied")));
        }
        LabEvent::Row { at } => lab.row = at,
        LabEvent::AsText { on } => lab.as_text = on,
        LabEvent::OnMachine { on } => lab.on_machine = on,
        LabEvent::Part { part } => lab.part = part,
        LabEvent::Stroke { on } => lab.stroke = on,
        LabEvent::CountAnew => lab.inputs = lab.inputs.counted_anew(),
        LabEvent::Check => lab.check = Some(Check::begin(lab.bits())),
        LabEvent::Skip => lab.check = lab.check.map(|check| check.skipped(lab.bits())),
        LabEvent::Say { text } => lab.said = Some(text),
        LabEvent::Run { mode } if !locked => return run(model, mode),
        LabEvent::Run { .. } => {}
        LabEvent::Breathed { number, mode } if number == lab.run.number => return go_on(model, mode),
        LabEvent::Breathed { .. } => {}
        LabEvent::Anew => lab.anew(),
    }
    keep(model, &before)
}

fn keep(model: &Model, before: &Arc<LabEdits>) -> Vec<Effect> {
    let now = &model.lab.bench;
    if Arc::ptr_eq(now, before) { Vec::new() } else { vec![Effect::KeepBench { text: now.kept() }] }
}

fn undo(lab: &mut Lab, back: bool) {
    let done = if back { lab.history.undo() } else { lab.history.redo() };
    lab.renew();
    lab.said = Some(Text::of(match (done, back) {
        (true, true) => key!("page.lab.undone"),
        (true, false) => key!("page.lab.redone"),
        (false, true) => key!("page.lab.nothing_to_undo"),
        (false, false) => key!("page.lab.nothing_to_redo"),
    }));
}

fn run(model: &mut Model, mode: Mode) -> Vec<Effect> {
    let lines: &[QueueLine] = &model.lab.bench.queue;
    let Ok(queue) = queue::read("", &to_text(lines)) else { return Vec::new() };
    if lines.is_empty() {
        return Vec::new();
    }
    let run = &mut model.lab.run;
    if run.running {
        return Vec::new();
    }
    // A held run keeps its machine settings; if they changed, start from the beginning.
    if run.trial.as_ref().is_none_or(|running| running.0.ended() || *running.0.machine() != *model.machine) {
        match Trial::begin(&model.machine, queue, model.machine.output_names()) {
            Ok(trial) => run.trial = Some(Running(trial)),
            Err(why) => {
                run.said = Some(Text::Found(why));
                return Vec::new();
            }
        }
    }
    run.running = true;
    run.number += 1;
    run.said = Some(Text::of(key!("page.lab.queue.running")));
    go_on(model, mode)
}

/// Runs a few steps, then lets the page handle other events.
fn go_on(model: &mut Model, mode: Mode) -> Vec<Effect> {
    let run = &mut model.lab.run;
    let Some(Running(trial)) = run.trial.as_mut().filter(|_| run.running) else { return Vec::new() };
    let rest = trial.go(mode);
    run.results = Arc::new(trial.results().to_vec());
    run.next = if trial.ended() { None } else { trial.row() };
    let Some(rest) = rest else {
        let event = LabEvent::Breathed { number: run.number, mode };
        return vec![Effect::Wake { after_ms: 0, event: Box::new(Event::Lab(event)) }];
    };
    run.running = false;
    let with =
        |key: &'static str, name: &'static str, value: String| Text::Key { key, args: vec![(name, value)] };
    run.said = Some(match rest {
        Rest::Held => {
            let row = run.next.map_or(0, |at| at + 1);
            with(key!("page.lab.queue.held"), "row", row.to_string())
        }
        Rest::Done => with(key!("page.lab.queue.ended"), "holes", trial.holes().to_string()),
        Rest::Stopped => Text::of(key!("page.lab.queue.stopped_here")),
        Rest::Failed { why, .. } => Text::Found(why),
    });
    Vec::new()
}
