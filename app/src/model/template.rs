//! The template editor: what is written for, the person's own dialect, its faults.
//!
//! ```text
//! typed ─ rests ─▶ looked through in a worker of its own ─▶ faults, output        typed meanwhile: dropped, looked through again
//! ```
//!
//! Comes in: text as typed, answers of the worker. Goes out: requests. Does not know the editor's fields.

use super::{Effect, Event, Lane, Model};
use crate::engine::Stopped;
use crate::engine::messages::{Answer, Checked, Request, Settings, ToWrite};
use annulus_core::post;
use std::sync::Arc;

/// The word of the person's own template in the menu.
pub const OWN: &str = "own";
/// Typing rests so long before it is looked at, in ms.
const REST_MS: u32 = 200;

/// What is edited.
#[derive(Clone, Debug, PartialEq)]
pub struct Template {
    /// What is written for: a name that ships, or [`OWN`].
    pub target: String,
    /// The person's own dialect as text.
    pub text: Option<Arc<str>>,
    /// It is open.
    pub open: bool,
    /// Where the cursor is, in bytes.
    pub cursor: usize,
    /// What was found in it and what it makes, once that was looked at.
    pub checked: Option<Arc<Checked>>,
    /// Counts what is to be looked at; a rest of an older count is over.
    change: u32,
    /// The request whose answer is waited for.
    number: Option<u32>,
    /// What was looked at last: the text, and the program's bytes by their key.
    seen: Option<(Option<Arc<str>>, Option<String>)>,
}

impl Default for Template {
    fn default() -> Self {
        Self {
            target: "grbl".to_owned(),
            text: None,
            open: false,
            cursor: 0,
            checked: None,
            change: 0,
            number: None,
            seen: None,
        }
    }
}

/// What happens to it.
#[derive(Clone, Debug, PartialEq)]
pub enum TemplateEvent {
    /// Something else is written for.
    Target {
        /// A name that ships, or [`OWN`].
        name: String,
    },
    /// The editor is opened with what is written for.
    Open,
    /// The editor is closed.
    Close,
    /// The person wants to choose a file.
    Load,
    /// The text is the person's own from now on.
    Keep {
        /// As typed.
        text: String,
    },
    /// The cursor is elsewhere.
    Cursor {
        /// In bytes.
        at: usize,
    },
    /// Typing rested.
    Rested {
        /// Since this change.
        change: u32,
    },
}

impl Template {
    /// The person's own text, where that is what is written for.
    pub fn own_text(&self) -> Option<String> {
        self.text.as_ref().filter(|_| self.target == OWN).map(|text| text.to_string())
    }

    /// What the person's own dialect calls itself.
    pub fn own_name(&self) -> Option<String> {
        let line = self.text.as_ref()?.lines().find(|line| line.trim_start().starts_with("name"))?;
        Some(line.split('"').nth(1).unwrap_or(OWN).to_owned())
    }

    /// Whether this request is waited for.
    pub(super) fn waits_for(&self, number: u32) -> bool {
        self.number == Some(number)
    }
}

/// Takes one event in.
pub(super) fn update(model: &mut Model, event: TemplateEvent) -> Vec<Effect> {
    let template = &mut model.template;
    match event {
        TemplateEvent::Target { name } => template.target = name,
        TemplateEvent::Open => {
            if let Some((_, text)) = post::shipped().find(|(known, _)| *known == template.target) {
                template.text = Some(text.into());
            } else if template.text.is_none() {
                template.text = post::shipped().next().map(|(_, text)| text.into());
            }
            (template.cursor, template.checked, template.seen) = (0, None, None);
            template.open = true;
        }
        TemplateEvent::Load => return vec![Effect::ChooseDialect],
        TemplateEvent::Close => template.open = false,
        TemplateEvent::Keep { text } => {
            (template.text, template.target) = (Some(text.into()), OWN.to_owned());
        }
        TemplateEvent::Cursor { at } => template.cursor = at,
        TemplateEvent::Rested { change } if change == template.change => return look(model),
        TemplateEvent::Rested { .. } => {}
    }
    Vec::new()
}

/// Waits for a rest where the text or the program is another one.
pub(super) fn follow(model: &mut Model) -> Vec<Effect> {
    let template = &mut model.template;
    if !template.open {
        return Vec::new();
    }
    let now = (template.text.clone(), model.board.job.as_ref().map(|job| job.key.clone()));
    if template.seen.as_ref() == Some(&now) {
        return Vec::new();
    }
    template.seen = Some(now);
    template.change += 1;
    template.number = None;
    let rested = TemplateEvent::Rested { change: template.change };
    vec![Effect::Wake { after_ms: REST_MS, event: Box::new(Event::Template(rested)) }]
}

fn look(model: &mut Model) -> Vec<Effect> {
    let number = model.next_request();
    let program = model.board.job.as_ref().map(|job| job.bytes.clone());
    let text = model.template.text.as_ref().map(|text| text.to_string());
    let machine = Some(Settings::of(&model.machine));
    let wanted = ToWrite { program: program.unwrap_or_default(), text: text.unwrap_or_default(), machine };
    model.template.number = Some(number);
    vec![Effect::Ask { lane: Lane::Template, number, request: Box::new(Request::Check(wanted)) }]
}

/// It was looked through.
pub(super) fn answered(model: &mut Model, answer: Result<Answer, Stopped>) -> Vec<Effect> {
    model.template.number = None;
    if let Ok(Answer::Checked(checked)) = answer {
        model.template.checked = Some(Arc::new(checked));
    }
    Vec::new()
}
