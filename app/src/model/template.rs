//! The postprocessor editor: the selected postprocessor, the user's own, and its problems.
//!
//! ```text
//! typed ─ pause ─▶ checked in a separate worker ─▶ problems, output    typed meanwhile: checked again
//! ```

use super::{Effect, Event, Lane, Model};
use crate::engine::Stopped;
use crate::engine::messages::{Answer, Checked, Request, Settings, ToWrite};
use annulus_core::post;
use std::sync::Arc;

/// Name of the user's own postprocessor in the menu.
pub const OWN: &str = "own";
const REST_MS: u32 = 200;

#[derive(Clone, Debug, PartialEq)]
pub struct Template {
    /// The selected postprocessor: a shipped name, or [`OWN`].
    pub target: String,
    /// The user's own postprocessor.
    pub text: Option<Arc<str>>,
    pub open: bool,
    /// Position of the cursor, in bytes.
    pub cursor: usize,
    pub checked: Option<Arc<Checked>>,
    /// Counts changes; a timer of an older change is outdated.
    change: u32,
    number: Option<u32>,
    /// Text and program key at the last check.
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

#[derive(Clone, Debug, PartialEq)]
pub enum TemplateEvent {
    Target {
        /// A shipped name, or [`OWN`].
        name: String,
    },
    Open,
    Close,
    Load,
    /// Store the text as the user's own postprocessor and select it.
    Keep {
        text: String,
    },
    Cursor {
        at: usize,
    },
    Rested {
        change: u32,
    },
}

impl Template {
    /// The user's own text, if it is selected.
    pub fn own_text(&self) -> Option<String> {
        self.text.as_ref().filter(|_| self.target == OWN).map(|text| text.to_string())
    }

    /// The `name` in the user's own postprocessor.
    pub fn own_name(&self) -> Option<String> {
        let line = self.text.as_ref()?.lines().find(|line| line.trim_start().starts_with("name"))?;
        Some(line.split('"').nth(1).unwrap_or(OWN).to_owned())
    }

    pub(super) fn waits_for(&self, number: u32) -> bool {
        self.number == Some(number)
    }
}

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

/// Starts the pause if the text or the program changed.
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
    // The answer for an older text is dropped.
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

pub(super) fn answered(model: &mut Model, answer: Result<Answer, Stopped>) -> Vec<Effect> {
    model.template.number = None;
    if let Ok(Answer::Checked(checked)) = answer {
        model.template.checked = Some(Arc::new(checked));
    }
    Vec::new()
}
