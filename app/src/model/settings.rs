//! Edits of the machine's settings that are not applied yet, and the way back after Apply.
//!
//! ```text
//! field ─▶ draft (key → text) ─▶ changes ─▶ machine::apply ─▶ refusals next to their fields
//!                                       └──▶ Apply ─▶ Ask::Configure ─┬─▶ settings come ─▶ toast with Undo
//!                                            Undo: the old values ──┘ └─▶ refused ─▶ the draft is back
//! ```
//!
//! A controller that plans its own motion has five more settings, which the machine's table doesn't have.
//! Leaving the screen discards the draft.

use super::link::Notice;
use super::{Effect, LinkEvent, Model, ToastAct, frame, linked, rack};
use crate::format;
use crate::keys::Tab;
use crate::said::{Text, key};
use annulus_core::code;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::grbl::{CHANGER_KEY, LENGTH_KEY, RESET_KEY, SETTER_KEY, ToolSetter};
use annulus_core::machine::{self, Group, MILL_KEY, Machine, SECTIONS, Setting, Value, ValueKind};
use annulus_core::wire::{Ask, ControllerReport};
use std::collections::BTreeMap;
use std::sync::Arc;

/// The settings of a controller that plans its own motion.
pub const CONTROLLER_KEYS: [&str; 5] = [MILL_KEY, LENGTH_KEY, SETTER_KEY, CHANGER_KEY, RESET_KEY];

#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SettingsDraft {
    pub typed: BTreeMap<&'static str, String>,
    /// Text of the search.
    pub sought: String,
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
    Seek {
        text: String,
    },
    Discard,
    Apply,
}

/// A request to change settings that the machine has not answered yet, or whose way back is on offer.
#[derive(Clone, Debug, Default)]
pub(super) struct Applied {
    waiting: Option<Waiting>,
    /// The values before the last change, while a toast offers them.
    before: Vec<(String, Value)>,
}

#[derive(Clone, Debug)]
struct Waiting {
    connection: (bool, u32),
    /// The last settings that the machine reported. It reports them again after a change.
    told: Arc<Vec<(String, Value)>>,
    before: Vec<(String, Value)>,
    typed: BTreeMap<&'static str, String>,
    is_undo: bool,
}

impl SettingsDraft {
    /// Changes of the machine's table.
    pub fn changes(&self, machine: &Machine) -> Vec<(String, Value)> {
        let staged = machine::settings().filter_map(|setting| {
            let value = setting.kind.typed(self.typed.get(setting.key)?);
            (value != setting.value(machine)).then(|| (setting.key.to_owned(), value))
        });
        staged.collect()
    }

    /// Changes of the machine's table and of the controller's own settings.
    pub fn all_changes(&self, machine: &Machine, who: Option<&ControllerReport>) -> Vec<(String, Value)> {
        let own = CONTROLLER_KEYS.into_iter().filter_map(|key| {
            let value = typed_own(key, self.typed.get(key)?);
            (value != own_value(who?, key)).then(|| (key.to_owned(), value))
        });
        let mut all = self.changes(machine);
        all.extend(own);
        all
    }

    /// Text of a setting of the controller: as typed, else its present value.
    pub fn own_text(&self, who: Option<&ControllerReport>, key: &'static str) -> String {
        let now = || who.map(|who| written_own(&own_value(who, key))).unwrap_or_default();
        self.typed.get(key).cloned().unwrap_or_else(now)
    }

    pub fn rack(&self, machine: &Machine) -> Vec<String> {
        rack::lines(self.typed.get(rack::RACK_KEY), machine)
    }

    /// Why the changes can't be applied.
    pub fn refusals(&self, machine: &Machine) -> Vec<Diagnostic> {
        let mut refusals = machine::apply(machine, &self.changes(machine)).err().unwrap_or_default();
        let setter = self.typed.get(SETTER_KEY).map(|text| typed_own(SETTER_KEY, text));
        let is_setter =
            |value: &Value| matches!(value, Value::Numbers(parts) if ToolSetter::of_numbers(parts).is_some());
        if setter.is_some_and(|value| !is_setter(&value)) {
            refusals.push(Diagnostic::error(code!("setter.bad")).with("key", SETTER_KEY));
        }
        refusals
    }

    /// True if a change or a refusal concerns one of `keys`.
    pub fn concerns(&self, refused: &[Diagnostic], keys: &[&'static str]) -> bool {
        let is_refused = |key: &str| refused.iter().any(|why| is_about(why, key));
        keys.iter().any(|key| self.typed.contains_key(key) || is_refused(key))
    }
}

/// True if `why` names the setting `key`.
pub fn is_about(why: &Diagnostic, key: &str) -> bool {
    why.args.iter().any(|(name, value)| name == "key" && value == key)
}

/// The value of a typed setting of the controller; the tool setter has one number in each line.
fn typed_own(key: &str, text: &str) -> Value {
    let lines = || text.lines().filter(|line| !line.trim().is_empty()).map(str::to_owned).collect();
    if key == CHANGER_KEY {
        return Value::Texts(lines());
    }
    if key == SETTER_KEY {
        let numbers: Option<Vec<f64>> = text.lines().map(format::typed).collect();
        return numbers.map_or_else(|| Value::Text(text.to_owned()), Value::Numbers);
    }
    Value::Text(text.to_owned())
}

/// The text of a value of [`typed_own`].
fn written_own(value: &Value) -> String {
    match value {
        Value::Numbers(numbers) => {
            numbers.iter().map(|one| format::plain(*one)).collect::<Vec<_>>().join("\n")
        }
        other => other.to_string(),
    }
}

/// The present value of a setting of the controller.
pub fn own_value(who: &ControllerReport, key: &str) -> Value {
    match key {
        MILL_KEY => Value::Text(who.mill.clone().unwrap_or_default()),
        LENGTH_KEY => Value::Text(if who.lengths.on_setter { "setter" } else { "board" }.to_owned()),
        SETTER_KEY => {
            let numbers = who.lengths.setter.map(|setter| setter.numbers().to_vec());
            Value::Numbers(numbers.unwrap_or_default())
        }
        CHANGER_KEY => Value::Texts(who.changer.clone()),
        _ => Value::Text(who.reset_on_open.word().to_owned()),
    }
}

/// A section of a group as the page shows it, with the keys of its settings.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Part {
    pub section: &'static str,
    /// The machine has what the section describes.
    pub is_used: bool,
    pub rows: Vec<&'static str>,
    /// Folded settings.
    pub advanced: Vec<&'static str>,
}

/// The sections of `group`. `plans` is true for a controller that plans its own motion.
pub fn parts(group: Group, machine: &Machine, plans: bool) -> Vec<Part> {
    let part = |section: &machine::Section| {
        let is_shown = |row: &&Setting| {
            row.group(section.group) == group && row.kind != ValueKind::Tools && row.is_used(machine, plans)
        };
        let (advanced, rows): (Vec<_>, Vec<_>) =
            section.rows.iter().filter(is_shown).partition(|row| row.is_advanced());
        let keys = |rows: Vec<&'static Setting>| rows.into_iter().map(|row| row.key).collect::<Vec<_>>();
        let (rows, advanced) = (keys(rows), keys(advanced));
        Part { section: section.name, is_used: section.is_used(machine, plans), rows, advanced }
    };
    let parts = SECTIONS.iter().map(part);
    parts.filter(|part| !part.rows.is_empty() || !part.advanced.is_empty()).collect()
}

/// True if every word of `sought` is in one of `texts`, in upper or lower case.
pub fn is_found(sought: &str, texts: &[String]) -> bool {
    let texts: Vec<_> = texts.iter().map(|text| text.to_lowercase()).collect();
    sought.to_lowercase().split_whitespace().all(|word| texts.iter().any(|text| text.contains(word)))
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
        SettingsEvent::Seek { text } => model.settings.sought = text,
        SettingsEvent::Discard => model.settings.typed.clear(),
        SettingsEvent::Apply => {
            let typed = std::mem::take(&mut model.settings.typed);
            let draft = SettingsDraft { typed, sought: String::new() };
            let changes = draft.all_changes(&model.machine, model.link.controller.who.as_deref());
            return configure(model, changes, draft.typed, false);
        }
    }
    Vec::new()
}

/// Puts the values before the last Apply back, in the same way as Apply.
pub(super) fn undo(model: &mut Model) -> Vec<Effect> {
    let before = std::mem::take(&mut model.applied.before);
    configure(model, before, BTreeMap::new(), true)
}

fn configure(
    model: &mut Model,
    changes: Vec<(String, Value)>,
    typed: BTreeMap<&'static str, String>,
    is_undo: bool,
) -> Vec<Effect> {
    withdraw(model);
    let before = values_before(model, &changes);
    let told = model.link.settings.clone();
    let connection = connection(model);
    model.applied.waiting = Some(Waiting { connection, told, before, typed, is_undo });
    let mut effects = linked(model, LinkEvent::Close { notice: Notice::Refused });
    effects.extend(linked(model, LinkEvent::Ask { wish: Ask::Configure { changes } }));
    effects
}

/// The present values of the settings in `changes`. A tool setter without a position can't be put back.
fn values_before(model: &Model, changes: &[(String, Value)]) -> Vec<(String, Value)> {
    let who = model.link.controller.who.as_deref();
    let before = changes.iter().filter_map(|(key, _)| {
        let value = match machine::setting(key) {
            Some(setting) => setting.value(&model.machine),
            None => own_value(who?, key),
        };
        let is_none = key == SETTER_KEY && value == Value::Numbers(Vec::new());
        (!is_none).then(|| (key.clone(), value))
    });
    before.collect()
}

/// Distinguishes the present connection from earlier and later ones.
fn connection(model: &Model) -> (bool, u32) {
    (model.link.controller.chosen, model.link.tries)
}

fn withdraw(model: &mut Model) {
    model.frame.toasts.retain(|toast| toast.act != Some(ToastAct::UndoSettings));
    model.applied.before.clear();
}

fn change_rack(model: &mut Model, change: impl FnOnce(Vec<String>) -> Vec<String>) {
    let lines = change(model.settings.rack(&model.machine));
    model.settings.typed.insert(rack::RACK_KEY, lines.join("\n"));
}

/// Reports applied changes once the machine has told them. Outside of the Settings screen, where the user
/// would not see it, discards the draft and the way back.
pub(super) fn follow(model: &mut Model) -> Vec<Effect> {
    let is_shown = model.frame.tab == Tab::Settings;
    if !is_shown {
        model.settings = SettingsDraft::default();
        withdraw(model);
    }
    let Some(waiting) = model.applied.waiting.take() else { return Vec::new() };
    if waiting.connection != connection(model) {
        withdraw(model);
        return Vec::new();
    }
    if model.link.refused.is_some() {
        if is_shown && model.settings.typed.is_empty() {
            model.settings.typed = waiting.typed;
        }
        return Vec::new();
    }
    if Arc::ptr_eq(&waiting.told, &model.link.settings) {
        model.applied.waiting = Some(waiting);
        return Vec::new();
    }
    if waiting.is_undo {
        return vec![frame::toast(model, Text::of(key!("page.settings.restored")), None)];
    }
    if is_shown && !waiting.before.is_empty() {
        model.applied.before = waiting.before;
        frame::offer(model, Text::of(key!("page.settings.applied")), ToastAct::UndoSettings);
    }
    Vec::new()
}
