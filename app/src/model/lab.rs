//! The Lab: the sheet on show, the bench with its history, what is chosen and copied, the queue's run in this page, the inputs.
//!
//! ```text
//! Change(field, LabEdits) ─▶ History ─▶ bench ─▶ kept in this tab over a reload
//! Run ─▶ Trial: eight pieces ─▶ breathe ─▶ eight pieces … ─▶ rest: held │ done │ refused        an edit of the queue ends it
//! ```
//!
//! Comes in: edits, orders, statuses. Goes out: the next state. While a job has the machine nothing is edited. Knows no layout.

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

/// A queue on its way through this page's own virtual drill.
struct Running(Trial);

impl fmt::Debug for Running {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "a queue at row {:?}", self.0.row())
    }
}

/// The run of the queue in this page.
#[derive(Debug, Default)]
pub struct LabRun {
    trial: Option<Running>,
    /// Results, one a line.
    pub results: Arc<Vec<RowResult>>,
    /// The line that comes next, while a run is held.
    pub next: Option<usize>,
    /// It runs now.
    pub running: bool,
    /// How it ended or why it rests.
    pub said: Option<Text>,
    /// Counts runs; pieces of an older one are not gone on with.
    number: u32,
}

/// The Lab.
#[derive(Debug)]
pub struct Lab {
    /// The sheet on show.
    pub sheet: LabPanel,
    history: LabHistory<LabEdits>,
    /// The bench now: the same handle as long as it is the same bench.
    pub bench: Arc<LabEdits>,
    /// The motor on show: 0 X, 1 Y, 2 Z.
    pub motor: usize,
    /// Chosen cells of the phase table.
    pub block: CellBlock,
    /// Copied cells.
    pub clip: Option<Clip>,
    /// The chosen line of the queue.
    pub row: usize,
    /// The queue is shown as one text.
    pub as_text: bool,
    /// The queue runs on the machine; else in the page.
    pub on_machine: bool,
    /// The queue's run in the page.
    pub run: LabRun,
    /// The part of the motion sheet on show.
    pub part: PanelPart,
    /// The servo makes a stroke; else a step.
    pub stroke: bool,
    /// The inputs as seen so far.
    pub inputs: KnownInputs,
    /// The guided check of the sensors, once begun.
    pub check: Option<Check>,
    /// Said to those who do not see.
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

/// What happens to the Lab.
#[derive(Clone, Debug, PartialEq)]
pub enum LabEvent {
    /// This was kept in this tab.
    Kept {
        /// The bench as text.
        text: String,
    },
    /// Another sheet.
    Show {
        /// Which.
        sheet: LabPanel,
    },
    /// The bench becomes another one. Changes that follow each other from one field are one step back.
    Change {
        /// The field, if it came from one.
        field: Option<String>,
        /// The bench from now on.
        bench: Box<LabEdits>,
    },
    /// The person left a field.
    Rest,
    /// Back by an edit, or on again.
    Undo {
        /// Back.
        back: bool,
    },
    /// Another motor.
    Motor {
        /// 0 X, 1 Y, 2 Z.
        motor: usize,
    },
    /// Cells are chosen.
    Choose {
        /// Which.
        block: CellBlock,
    },
    /// Cells are copied.
    Copy {
        /// As they are.
        clip: Clip,
    },
    /// A line of the queue is chosen.
    Row {
        /// Its place.
        at: usize,
    },
    /// The queue is shown as one text, or as rows.
    AsText {
        /// As text.
        on: bool,
    },
    /// The queue runs on the machine, or in the page.
    OnMachine {
        /// On the machine.
        on: bool,
    },
    /// Another part of the motion sheet.
    Part {
        /// Which.
        part: PanelPart,
    },
    /// The servo makes a stroke, or a step.
    Stroke {
        /// A stroke.
        on: bool,
    },
    /// Changes of the inputs are counted anew.
    CountAnew,
    /// The guided check begins.
    Check,
    /// The person goes on without a sensor.
    Skip,
    /// Something is to be said to those who do not see.
    Say {
        /// What.
        text: Text,
    },
    /// The queue is to run in the page.
    Run {
        /// As far as this.
        mode: Mode,
    },
    /// The page has breathed.
    Breathed {
        /// The run.
        number: u32,
        /// As far as this.
        mode: Mode,
    },
    /// The run is forgotten.
    Anew,
}

impl Lab {
    /// Whether there is a step back, and one on.
    pub fn can_undo(&self) -> (bool, bool) {
        (self.history.can_undo(), self.history.can_redo())
    }

    /// The handle follows the history; another queue ends the run of the one before.
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

    /// What a status tells of the inputs.
    pub(super) fn told(&mut self, wall_ms: f64, bits: u32) {
        if self.inputs.bits != Some(bits) {
            self.inputs = self.inputs.seen(wall_ms, bits);
        }
        self.check = self.check.map(|check| check.seen(bits));
    }
}

/// Whether a job has the machine: nothing of the Lab is edited meanwhile.
pub fn locked(state: Option<State>) -> bool {
    use State::{Paused, Pausing, Running, Stopping, ToolChange};
    matches!(state, Some(Running | Pausing | Paused | ToolChange | Stopping))
}

/// Takes one event in.
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

/// Another bench is kept in this tab.
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

/// Goes on as far as `mode` says; begins where nothing is held.
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
    // What is held goes on with the machine it began with; with another one it begins again.
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

/// Some pieces, and then the page breathes.
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
