//! What was typed of the machine's settings and is not applied yet.
//!
//! ```text
//! field ─▶ draft (key → text) ─▶ changes ─▶ machine::apply ─▶ refusals beside their fields
//!                                       └──▶ Apply ─▶ Ask::Configure
//! ```
//!
//! Comes in: text by the key of its setting. Goes out: changes, and what is wrong with them. Whoever leaves the screen leaves the
//! draft. Knows no single setting: the table does.

use super::link::Notice;
use super::rack;
use super::{Effect, LinkEvent, Model, linked};
use crate::format;
use crate::keys::Tab;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::{self, Machine, Setting, Value, ValueKind};
use annulus_core::wire::Ask;
use std::collections::BTreeMap;

/// What was typed and not applied.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SettingsDraft {
    /// By key.
    pub typed: BTreeMap<&'static str, String>,
}

/// What happens to the draft.
#[derive(Clone, Debug, PartialEq)]
pub enum SettingsEvent {
    /// Something was typed.
    Type {
        /// The key of its setting.
        key: &'static str,
        /// What.
        text: String,
    },
    /// A cell of the rack's table was typed.
    TypeTool {
        /// The row.
        row: usize,
        /// The column ([`rack`]).
        column: &'static str,
        /// What.
        text: String,
    },
    /// The rack gets one more tool.
    AddTool,
    /// The rack loses the tool of a row.
    RemoveTool {
        /// The row.
        row: usize,
    },
    /// Nothing of it is wanted.
    Discard,
    /// All of it is wanted.
    Apply,
}

/// What was typed, as a value of the setting; text that is no number stays text and is refused as such.
fn value(setting: &Setting, typed: &str) -> Value {
    match setting.kind {
        ValueKind::Text(_) | ValueKind::Choice(_) => Value::Text(typed.to_owned()),
        ValueKind::Number(..) | ValueKind::Whole(..) => {
            format::typed(typed).map_or_else(|| Value::Text(typed.to_owned()), Value::Number)
        }
        ValueKind::Numbers(..) | ValueKind::Wholes(..) => {
            let words: Option<Vec<_>> = typed.split_whitespace().map(format::typed).collect();
            words.map_or_else(|| Value::Text(typed.to_owned()), Value::Numbers)
        }
        ValueKind::Tools => Value::Texts(typed.lines().map(str::to_owned).collect()),
    }
}

impl SettingsDraft {
    /// What would change in `machine`, in the order of the table.
    pub fn changes(&self, machine: &Machine) -> Vec<(String, Value)> {
        let staged = machine::settings().filter_map(|setting| {
            let value = value(setting, self.typed.get(setting.key)?);
            (value != setting.value(machine)).then(|| (setting.key.to_owned(), value))
        });
        staged.collect()
    }

    /// The lines of the rack, as they are typed or else as they are.
    pub fn rack(&self, machine: &Machine) -> Vec<String> {
        rack::lines(self.typed.get(rack::RACK_KEY), machine)
    }

    /// What is wrong with that.
    pub fn refusals(&self, machine: &Machine) -> Vec<Diagnostic> {
        machine::apply(machine, &self.changes(machine)).err().unwrap_or_default()
    }
}

/// Takes one event in.
pub(super) fn update(model: &mut Model, event: SettingsEvent) -> Vec<Effect> {
    match event {
        SettingsEvent::Type { key, text } => drop(model.settings.typed.insert(key, text)),
        SettingsEvent::TypeTool { row, column, text } => {
            change_rack(model, |mut lines| {
                if let Some(line) = lines.get_mut(row) {
                    *line = rack::edited(line, column, &text);
                }
                lines
            });
        }
        SettingsEvent::AddTool => change_rack(model, rack::added),
        SettingsEvent::RemoveTool { row } => change_rack(model, |mut lines| {
            if row < lines.len() {
                lines.remove(row);
            }
            lines
        }),
        SettingsEvent::Discard => model.settings.typed.clear(),
        SettingsEvent::Apply => {
            let draft = std::mem::take(&mut model.settings);
            let changes = draft.changes(&model.machine);
            let mut effects = linked(model, LinkEvent::Close { notice: Notice::Refused });
            effects.extend(linked(model, LinkEvent::Ask { wish: Ask::Configure { changes } }));
            return effects;
        }
    }
    Vec::new()
}

/// The rack as it is typed becomes what `change` makes of it.
fn change_rack(model: &mut Model, change: impl FnOnce(Vec<String>) -> Vec<String>) {
    let lines = change(model.settings.rack(&model.machine));
    model.settings.typed.insert(rack::RACK_KEY, lines.join("\n"));
}

/// Nothing is typed where nobody sees it.
pub(super) fn follow(model: &mut Model) {
    if model.frame.tab != Tab::Settings {
        model.settings.typed.clear();
    }
}
