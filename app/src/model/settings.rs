//! Edits of the machine's settings that are not applied yet.
//!
//! ```text
//! field ─▶ draft (key → text) ─▶ changes ─▶ machine::apply ─▶ refusals next to their fields
//!                                       └──▶ Apply ─▶ Ask::Configure
//! ```
//!
//! Leaving the screen discards the draft.

use super::link::Notice;
use super::rack;
use super::{Effect, LinkEvent, Model, linked};
use crate::keys::Tab;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::{self, Machine, Value};
use annulus_core::wire::Ask;
use std::collections::BTreeMap;

#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SettingsDraft {
    pub typed: BTreeMap<&'static str, String>,
}

#[derive(Clone, Debug, PartialEq)]
pub enum SettingsEvent {
    Type {
        key: &'static str,
        text: String,
    },
    TypeTool {
        row: usize,
        /// See [`rack`].
        column: &'static str,
        text: String,
    },
    AddTool,
    RemoveTool {
        row: usize,
    },
    Discard,
    Apply,
}

impl SettingsDraft {
    pub fn changes(&self, machine: &Machine) -> Vec<(String, Value)> {
        let staged = machine::settings().filter_map(|setting| {
            let value = setting.kind.typed(self.typed.get(setting.key)?);
            (value != setting.value(machine)).then(|| (setting.key.to_owned(), value))
        });
        staged.collect()
    }

    pub fn rack(&self, machine: &Machine) -> Vec<String> {
        rack::lines(self.typed.get(rack::RACK_KEY), machine)
    }

    /// Why the changes can't be applied.
    pub fn refusals(&self, machine: &Machine) -> Vec<Diagnostic> {
        machine::apply(machine, &self.changes(machine)).err().unwrap_or_default()
    }
}

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

fn change_rack(model: &mut Model, change: impl FnOnce(Vec<String>) -> Vec<String>) {
    let lines = change(model.settings.rack(&model.machine));
    model.settings.typed.insert(rack::RACK_KEY, lines.join("\n"));
}

/// Discards the draft outside of the Settings screen, where the user would not see it.
pub(super) fn follow(model: &mut Model) -> Vec<Effect> {
    if model.frame.tab != Tab::Settings {
        model.settings.typed.clear();
    }
    Vec::new()
}
