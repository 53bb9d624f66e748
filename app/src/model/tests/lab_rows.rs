//! The Lab: edits and undo, the lock, the queue's run in the page, inputs and their check.

use super::line;
use crate::lab::queue::QueueEdit;
use crate::lab::{LabEdits, LabPanel};
use crate::model::{Effect, Event, LabEvent, LinkEvent, Model, update};
use crate::said::Text;
use annulus_core::control::State;
use annulus_core::machine::Machine;
use annulus_core::queue::Mode;
use annulus_core::wire::{Status, Tell};
use std::sync::Arc;

fn status(state: State, inputs: u32) -> Event {
    let status = Status { inputs, ..line::status(state, None) };
    LinkEvent::Heard { tell: Some(Box::new(Tell::Status(Box::new(status)))) }.into()
}

#[derive(Default)]
struct Story {
    model: Model,
    out: Vec<Effect>,
    count: u32,
}

impl Story {
    fn told(words: &str) -> Self {
        let mut story = Self::default();
        words.split_whitespace().for_each(|word| story.tell(word));
        story
    }

    fn tell(&mut self, word: &str) {
        self.count += 1;
        let event = self.event(word);
        self.out = update(&mut self.model, event);
    }

    fn event(&self, word: &str) -> Event {
        let bench = &self.model.lab.bench;
        let change = |field: Option<&str>, bench: LabEdits| LabEvent::Change {
            field: field.map(str::to_owned),
            bench: Box::new(bench),
        };
        let text = |text: String| bench.with_queue(&QueueEdit::Text(text)).0;
        let event = match word {
            "edit" => change(None, bench.with_field("a", self.count.to_string())),
            "type" => change(Some("a"), bench.with_field("a", self.count.to_string())),
            "same" => change(None, (**bench).clone()),
            "queue" => change(None, text("HOME ALL\nSPINDLE 20000\n".to_owned())),
            "queue-other" => change(None, text("HOME ALL\n".to_owned())),
            "queue-wrong" => change(None, text("DANCE\n".to_owned())),
            "rest" => LabEvent::Rest,
            "undo" => LabEvent::Undo { back: true },
            "redo" => LabEvent::Undo { back: false },
            "step" => LabEvent::Run { mode: Mode::Step },
            "run" => LabEvent::Run { mode: Mode::ToEnd },
            "anew" => LabEvent::Anew,
            "breathed" => self.breathed(),
            "breathed-before" => LabEvent::Breathed { number: 0, mode: Mode::ToEnd },
            "count-anew" => LabEvent::CountAnew,
            "check" => LabEvent::Check,
            "skip" => LabEvent::Skip,
            "io" => LabEvent::Show { sheet: LabPanel::Io },
            "kept" => LabEvent::Kept { text: LabEdits::default().with_field("a", "7".to_owned()).kept() },
            "ready" => return status(State::Ready, 0),
            "job" => return status(State::Running, 0),
            "pressed" => return status(State::Ready, 1),
            other => panic!("no such word: {other}"),
        };
        event.into()
    }

    fn breathed(&self) -> LabEvent {
        let found = self.out.iter().find_map(|effect| match effect {
            Effect::Wake { event, .. } => match &**event {
                Event::Lab(event) => Some(event.clone()),
                _ => None,
            },
            _ => None,
        });
        found.expect("nothing breathes")
    }

    /// Runs the queue until it is held or ends.
    fn rested(mut self) -> Self {
        while self.model.lab.run.running {
            self.tell("breathed");
        }
        self
    }
}

fn compare(rows: &[(&str, &str)], after: impl Fn(&Story) -> String) {
    super::compare(rows, Story::told, after);
}

fn key_of(text: Option<&Text>) -> String {
    match text {
        None => String::new(),
        Some(Text::Key { key, .. }) => (*key).to_owned(),
        Some(Text::Found(diagnostic)) => diagnostic.code.clone(),
    }
}

#[test]
fn lab_edits_can_be_undone_unless_a_job_runs() {
    let steps = |story: &Story| {
        let (undo, redo) = story.model.lab.can_undo();
        let kept = story.out.iter().any(|effect| matches!(effect, Effect::KeepBench { .. }));
        let words = [(undo, "<"), (redo, ">"), (kept, " kept")];
        words.iter().filter(|(on, _)| *on).map(|(_, word)| *word).collect()
    };
    compare(
        &[
            ("", ""),
            ("edit", "< kept"),
            ("edit same", "<"),
            ("edit undo", "> kept"),
            ("edit undo redo", "< kept"),
            ("edit edit undo", "<> kept"),
            ("type type undo", "> kept"),
            ("type rest type undo", "<> kept"),
            ("undo", ""),
            ("redo", ""),
            ("job edit", ""),
            ("edit job undo", "<"),
            ("edit job ready undo", "> kept"),
            ("kept", ""),
            ("kept edit", "< kept"),
            ("io", ""),
        ],
        steps,
    );
    assert_eq!(Story::told("kept").model.lab.bench.fields["a"], "7");
}

#[test]
fn undo_is_announced_to_screen_readers() {
    compare(
        &[
            ("edit undo", "page.lab.undone"),
            ("edit undo redo", "page.lab.redone"),
            ("undo", "page.lab.nothing_to_undo"),
            ("redo", "page.lab.nothing_to_redo"),
            ("edit job undo", ""),
        ],
        |story| key_of(story.model.lab.said.as_ref()),
    );
}

#[test]
fn simulated_queue_runs_until_it_stops_or_is_edited() {
    let run = |story: &Story| {
        let run = &story.model.lab.run;
        format!("{} {} {:?}", run.results.len(), key_of(run.said.as_ref()), run.next)
    };
    super::compare(
        &[
            ("run", "0  None"),
            ("queue-wrong run", "0  None"),
            ("queue run", "2 page.lab.queue.ended None"),
            ("queue step", "2 page.lab.queue.held Some(1)"),
            ("job queue run", "0  None"),
            ("queue job run", "0  None"),
        ],
        |words| Story::told(words).rested(),
        run,
    );
    // held in between
    let mut story = Story::told("queue step").rested();
    story.tell("step");
    let mut story = story.rested();
    assert_eq!(key_of(story.model.lab.run.said.as_ref()), "page.lab.queue.ended");
    let mut other = Story::told("queue step").rested();
    let machine = Machine { name: "another".to_owned(), ..(*other.model.machine).clone() };
    other.model.machine = Arc::new(machine);
    other.tell("step");
    let said = key_of(other.rested().model.lab.run.said.as_ref());
    assert_eq!(said, "page.lab.queue.held", "with another machine it begins again");
    story.tell("edit");
    assert!(!story.model.lab.run.results.is_empty(), "another field is another thing");
    story.tell("queue-other");
    assert!(story.model.lab.run.results.is_empty());
    let mut story = Story::told("queue step").rested();
    story.tell("anew");
    assert!(story.model.lab.run.results.is_empty() && story.model.lab.run.said.is_none());
    story.tell("breathed-before");
    assert!(!story.model.lab.run.running, "it is of an older run");
}

#[test]
fn inputs_are_counted_and_checked_per_status() {
    let inputs = |story: &Story| {
        let lab = &story.model.lab;
        format!("{} {:?}", lab.inputs.edges[0], lab.check.map(|check| check.at))
    };
    compare(
        &[
            ("ready", "0 None"),
            ("ready pressed", "1 None"),
            ("ready pressed pressed", "1 None"),
            ("ready pressed ready", "2 None"),
            ("ready pressed count-anew", "0 None"),
            ("ready pressed count-anew ready", "1 None"),
            ("ready check", "0 Some(0)"),
            ("ready check pressed", "1 Some(0)"),
            ("ready check pressed ready", "2 Some(1)"),
            ("ready check skip", "0 Some(1)"),
            ("skip", "0 None"),
        ],
        inputs,
    );
}
