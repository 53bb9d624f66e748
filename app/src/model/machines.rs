//! The machine that jobs are planned for, chosen before anything is connected, and the user's own machines.
//!
//! ```text
//! ?machine= │ chosen on this page │ saved ─▶ name ─▶ settings ─▶ Model::machine ─▶ plan, export, simulation
//!                                                      └───────▶ Ask::Configure ─▶ the page's virtual drill
//! ```
//!
//! The page's virtual drill plays the chosen machine, so that both plan the same steps. A bridge or a connected
//! controller owns its machine: while it is connected, that machine counts.

use super::link::{Link, ask};
use super::{Effect, Model, ToastAct, frame};
use crate::keys::Tab;
use crate::said::{Text, key};
use annulus_core::cam::parameters::OPERATION;
use annulus_core::cam::work::Work;
use annulus_core::locale;
use annulus_core::machine::{self, MILL_KEY, Machine, VIRTUAL, Value};
use annulus_core::wire::Ask;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// A preset that the user changed, or a machine of the user's own.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OwnMachine {
    pub name: String,
    /// The preset that it differs from; its own name for a changed preset.
    pub base: String,
    pub changes: Vec<(String, Value)>,
}

impl OwnMachine {
    pub fn is_preset(&self) -> bool {
        self.name == self.base
    }
}

/// What the browser saves.
#[derive(Debug, Default, Serialize, Deserialize)]
#[serde(default)]
struct Saved {
    chosen: Option<String>,
    played: Option<String>,
    machines: Vec<OwnMachine>,
}

/// Origin of the choice of a machine.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ChoiceOrigin {
    #[default]
    Default,
    /// Chosen on this page, now or at an earlier visit.
    Person,
    /// The address of the page; not saved.
    Address,
}

/// Whether the page's virtual drill has the settings of the chosen machine.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Played {
    #[default]
    Unknown,
    Sent,
    Same,
}

/// Who decides which machine jobs are planned for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MachineOwner {
    /// The user, on this page.
    Page,
    /// A connected controller that plans its own motion; the user may name its model.
    Controller,
    /// A bridge or a USB step adapter.
    Bridge,
}

/// A value of the job that followed the machine.
#[derive(Clone, Debug, PartialEq)]
pub struct ChangedValue {
    /// Index of the operation.
    pub operation: usize,
    pub key: &'static str,
    pub before: Option<Value>,
    pub after: Option<Value>,
}

/// The choice before the last one, for undo.
#[derive(Clone, Debug)]
struct ChoiceBefore {
    chosen: Option<String>,
    from: ChoiceOrigin,
    saved: Option<String>,
    own: Arc<Vec<OwnMachine>>,
}

#[derive(Clone, Debug, Default)]
pub struct Machines {
    /// Name of the chosen machine; `None` until one is chosen.
    pub chosen: Option<String>,
    pub from: ChoiceOrigin,
    pub own: Arc<Vec<OwnMachine>>,
    /// Values of the job that the last change of the machine changed.
    pub changed: Arc<Vec<ChangedValue>>,
    /// The choice that the browser keeps.
    saved: Option<String>,
    /// The machine whose settings the page's virtual drill has; `None` before the first choice.
    played: Option<String>,
    state: Played,
    /// The controller was asked to use the chosen model.
    named: bool,
    before: Option<ChoiceBefore>,
}

#[derive(Clone, Debug, PartialEq)]
pub enum MachineEvent {
    /// From the last visit.
    Kept {
        text: String,
    },
    /// The page's address names a machine.
    Linked {
        name: String,
    },
    Choose {
        name: String,
    },
    /// Copy the chosen machine, choose the copy and open its settings.
    Copy,
    /// Save the connected controller's machine as a machine of the user's own.
    Import,
    /// Delete a machine of the user's own, or the changes of a preset.
    Forget {
        name: String,
    },
}

impl Machines {
    /// The machine `name` as this page plans for it; `None` if there is none.
    pub fn machine(&self, name: &str) -> Option<Machine> {
        let own = self.own.iter().find(|own| own.name == name);
        let base = base_of(own.map_or(name, |own| own.base.as_str()))?;
        let changed = own.and_then(|own| machine::apply(&base, &own.changes).ok());
        Some(changed.unwrap_or(base))
    }

    /// The preset that the machine `name` is or started as.
    pub fn preset<'a>(&'a self, name: &'a str) -> &'a str {
        let own = self.own.iter().find(|own| own.name == name);
        machine::preset_name(own.map_or(name, |own| own.base.as_str()))
    }

    /// Names of the machines of the user's own, in the order in which they were made.
    pub fn own_names(&self) -> Vec<String> {
        self.own.iter().filter(|own| !own.is_preset()).map(|own| own.name.clone()).collect()
    }

    /// Name of the machine that the page's virtual drill should play; `None` before the first choice, when it
    /// keeps its own settings.
    fn wanted(&self) -> Option<&str> {
        self.chosen.as_deref().or_else(|| self.played.as_ref().map(|_| VIRTUAL))
    }

    /// The link is open again: another page may have changed the virtual drill meanwhile.
    pub(super) fn reconnected(&mut self) {
        (self.state, self.named) = (Played::Unknown, false);
    }

    /// Saves the differences of `now` from the preset of `name`. Returns `false` if nothing changed.
    fn record(&mut self, name: &str, now: &Machine) -> bool {
        let base = self.preset(name).to_owned();
        let Some(changes) = base_of(&base).map(|base| machine::differences(now, &base)) else { return false };
        let known = self.own.iter().position(|own| own.name == name);
        let own = OwnMachine { name: name.to_owned(), base, changes };
        match known {
            Some(at) if self.own[at] == own => return false,
            Some(at) if own.is_preset() && own.changes.is_empty() => {
                Arc::make_mut(&mut self.own).remove(at);
            }
            Some(at) => Arc::make_mut(&mut self.own)[at] = own,
            None if own.changes.is_empty() => return false,
            None => Arc::make_mut(&mut self.own).push(own),
        }
        true
    }

    /// Adds a machine of the user's own with the settings of `now`, called `title`. Returns its name.
    fn add(&mut self, base: &str, now: &Machine, title: String) -> String {
        let is_free = |name: &String| self.own.iter().all(|own| own.name != *name);
        let name = (1..).map(|number| format!("own-{number}")).find(is_free).unwrap_or_default();
        let now = Machine { name: title, ..now.clone() };
        let changes = base_of(base).map(|base| machine::differences(&now, &base)).unwrap_or_default();
        let own = OwnMachine { name: name.clone(), base: base.to_owned(), changes };
        Arc::make_mut(&mut self.own).push(own);
        name
    }

    fn keep(&self) -> Effect {
        let machines = (*self.own).clone();
        let saved = Saved { chosen: self.saved.clone(), played: self.played.clone(), machines };
        Effect::KeepMachines { text: serde_json::to_string(&saved).unwrap_or_default() }
    }

    fn remember(&mut self) {
        let (chosen, saved, own) = (self.chosen.clone(), self.saved.clone(), self.own.clone());
        self.before = Some(ChoiceBefore { chosen, from: self.from, saved, own });
    }
}

/// The preset `name` as the page's virtual drill plays it.
fn base_of(name: &str) -> Option<Machine> {
    machine::played(&machine::preset(name)?)
}

/// True if this page's machine is its virtual drill.
fn plays(model: &Model) -> bool {
    model.frame.alone && !model.link.controller.chosen
}

pub fn owner(model: &Model) -> MachineOwner {
    let controller = &model.link.controller;
    if controller.plans() && controller.who.is_some() {
        MachineOwner::Controller
    } else if plays(model) || model.frame.alone && model.link.settings.is_empty() {
        MachineOwner::Page
    } else {
        MachineOwner::Bridge
    }
}

/// True if the user may choose a machine now: no job is running.
pub fn may_choose(model: &Model) -> bool {
    !model.link.busy() && owner(model) != MachineOwner::Bridge
}

/// The machine as the link describes it; settings that this page doesn't know stay as in the virtual drill.
fn linked(link: &Link) -> Machine {
    let preset = machine::virtual_drill();
    machine::apply(&preset, &link.settings).unwrap_or(preset)
}

/// Updates [`Model::machine`]: the machine of the bridge or controller, else the chosen one, else the virtual
/// drill.
pub(super) fn describe(model: &mut Model) {
    let waits = model.link.settings.is_empty() || plays(model) && model.machines.state != Played::Same;
    let own =
        (model.frame.alone && waits).then(|| model.machines.machine(model.machines.wanted()?)).flatten();
    let described = own.unwrap_or_else(|| linked(&model.link));
    if *model.machine != described {
        model.machine = Arc::new(described);
    }
}

/// The link described its machine. Changes that the user made to the virtual drill are saved with the machine
/// that it plays.
pub(super) fn described(model: &mut Model) -> Vec<Effect> {
    let mut effects = Vec::new();
    if plays(model) && model.machines.wanted().is_some() {
        effects.extend(played(model));
    }
    describe(model);
    effects
}

fn played(model: &mut Model) -> Option<Effect> {
    let now = linked(&model.link);
    let machines = &mut model.machines;
    let name = machines.wanted()?.to_owned();
    match machines.state {
        Played::Unknown => {
            let first = machines.played.is_none();
            if first {
                // The virtual drill as the user had set it before the first choice.
                machines.record(VIRTUAL, &now);
                machines.played = Some(VIRTUAL.to_owned());
            }
            if machines.machine(&name).as_ref() == Some(&now) {
                machines.state = Played::Same;
                machines.played = Some(name);
            }
            first.then(|| machines.keep())
        }
        Played::Sent => {
            machines.state = Played::Same;
            None
        }
        Played::Same => machines.record(&name, &now).then(|| machines.keep()),
    }
}

/// Gives the chosen machine's settings to the page's virtual drill, or its model to the connected controller,
/// as soon as nothing moves.
pub(super) fn follow(model: &mut Model) -> Vec<Effect> {
    let link = &model.link;
    let is_ready = link.may_act() && link.state().is_some() && !link.busy() && !link.settings.is_empty();
    if !model.frame.alone || !is_ready || model.start.preflight.is_some() {
        return Vec::new();
    }
    match owner(model) {
        MachineOwner::Page if model.machines.state == Played::Unknown => play(model),
        MachineOwner::Controller if !model.machines.named => name_model(model),
        _ => Vec::new(),
    }
}

fn play(model: &mut Model) -> Vec<Effect> {
    let machines = &mut model.machines;
    let Some(name) = machines.wanted().map(str::to_owned) else { return Vec::new() };
    let Some(machine) = machines.machine(&name) else { return Vec::new() };
    (machines.state, machines.played) = (Played::Sent, Some(name));
    let kept = machines.keep();
    let mut effects = ask(model, &Ask::Configure { changes: machine::without_hardware(&machine) });
    effects.push(kept);
    effects
}

/// A controller without a model is compared with the chosen one.
fn name_model(model: &mut Model) -> Vec<Effect> {
    let Some(chosen) = &model.machines.chosen else { return Vec::new() };
    let name = model.machines.preset(chosen).to_owned();
    let has_none = model.link.controller.who.as_ref().is_some_and(|who| who.mill.is_none());
    model.machines.named = true;
    if has_none && machine::mill(&name).is_some() { ask_for_model(model, name) } else { Vec::new() }
}

fn ask_for_model(model: &mut Model, name: String) -> Vec<Effect> {
    ask(model, &Ask::Configure { changes: vec![(MILL_KEY.to_owned(), Value::Text(name))] })
}

pub(super) fn update(model: &mut Model, event: MachineEvent) -> Vec<Effect> {
    match event {
        MachineEvent::Kept { text } => {
            kept(model, &text);
            Vec::new()
        }
        MachineEvent::Linked { name } => linked_to(model, &name),
        MachineEvent::Choose { name } => choose(model, &name),
        MachineEvent::Copy => copy(model),
        MachineEvent::Import => import(model),
        MachineEvent::Forget { name } => forget(model, &name),
    }
}

/// A text that cannot be read counts as none.
fn kept(model: &mut Model, text: &str) {
    let Ok(Saved { chosen, played, machines }) = serde_json::from_str(text) else { return };
    let known = &mut model.machines;
    known.own = Arc::new(machines);
    let chosen = chosen.filter(|name| known.machine(name).is_some());
    known.from = if chosen.is_some() { ChoiceOrigin::Person } else { ChoiceOrigin::Default };
    (known.played, known.saved, known.chosen) = (played, chosen.clone(), chosen);
    describe(model);
}

/// The address of the page chooses a machine, for this visit only.
fn linked_to(model: &mut Model, name: &str) -> Vec<Effect> {
    if !model.frame.alone {
        return Vec::new();
    }
    let name = machine::preset_name(name);
    if model.machines.machine(name).is_none() {
        let args = vec![("name", name.chars().take(40).collect::<String>())];
        return vec![frame::toast(model, Text::Key { key: key!("page.machines.unknown"), args }, None)];
    }
    (model.machines.chosen, model.machines.from) = (Some(name.to_owned()), ChoiceOrigin::Address);
    model.machines.reconnected();
    describe(model);
    Vec::new()
}

fn choose(model: &mut Model, name: &str) -> Vec<Effect> {
    let name = machine::preset_name(name).to_owned();
    let machines = &model.machines;
    let is_chosen = machines.saved.as_ref() == Some(&name) && machines.chosen == machines.saved;
    let is_settled = is_chosen && owner(model) == MachineOwner::Page;
    if is_settled || !may_choose(model) || model.machines.machine(&name).is_none() {
        return Vec::new();
    }
    model.machines.remember();
    take(model, name)
}

/// Chooses the machine `name`, saves the choice, and reports what changed in the job.
fn take(model: &mut Model, name: String) -> Vec<Effect> {
    if plays(model) && model.machines.played.is_none() && !model.link.settings.is_empty() {
        let now = linked(&model.link);
        model.machines.record(VIRTUAL, &now);
        model.machines.played = Some(VIRTUAL.to_owned());
    }
    let machines = &mut model.machines;
    machines.from = ChoiceOrigin::Person;
    (machines.chosen, machines.saved) = (Some(name.clone()), Some(name));
    let mut effects = vec![machines.keep()];
    effects.extend(chosen(model));
    effects
}

/// The choice changed: describes the machine again and reports what changed in the job.
fn chosen(model: &mut Model) -> Vec<Effect> {
    let before = model.machine.clone();
    model.machines.reconnected();
    if owner(model) == MachineOwner::Controller {
        let name = model.machines.chosen.as_deref().map(|name| model.machines.preset(name).to_owned());
        model.machines.named = true;
        return match name.filter(|name| machine::mill(name).is_some()) {
            Some(name) => ask_for_model(model, name),
            None => Vec::new(),
        };
    }
    describe(model);
    let work = model.job.work.clone();
    let changed = work.map(|work| changed(&work, &before, &model.machine)).unwrap_or_default();
    let count = changed.len();
    model.machines.changed = Arc::new(changed);
    if model.board.document.is_none() {
        return Vec::new();
    }
    let args = vec![("name", title(model)), ("count", count.to_string())];
    let text = Text::Key { key: key!("page.machines.planned_for"), args };
    let act = model.machines.before.is_some().then_some(ToastAct::MachineBefore);
    vec![frame::toast(model, text, act)]
}

/// The values of the job that follow the machine and differ between two machines.
fn changed(work: &Work, before: &Machine, after: &Machine) -> Vec<ChangedValue> {
    let mut changed = Vec::new();
    for (at, operation) in work.operations.iter().enumerate().filter(|(_, operation)| operation.on) {
        for row in OPERATION.iter().filter(|row| row.is_of_machine(operation)) {
            let [before, after] = [before, after].map(|machine| row.value_on(operation, machine));
            if before != after {
                changed.push(ChangedValue { operation: at, key: row.key, before, after });
            }
        }
    }
    changed
}

/// The name of the machine that jobs are planned for, in the user's language.
fn title(model: &Model) -> String {
    if model.machine.name == machine::VIRTUAL_NAME {
        return locale::text(&model.frame.language, key!("page.virtual_drill"), &[]);
    }
    model.machine.name.clone()
}

/// Takes the last choice back.
pub(super) fn taken_back(model: &mut Model) -> Vec<Effect> {
    let Some(before) = model.machines.before.take().filter(|_| may_choose(model)) else { return Vec::new() };
    let machines = &mut model.machines;
    let mut own = (*before.own).clone();
    // Changes of presets that were saved since then stay.
    for preset in machines.own.iter().filter(|preset| preset.is_preset()) {
        if own.iter().all(|known| known.name != preset.name) {
            own.push(preset.clone());
        }
    }
    (machines.chosen, machines.from) = (before.chosen, before.from);
    (machines.saved, machines.own) = (before.saved, Arc::new(own));
    let mut effects = vec![machines.keep()];
    effects.extend(chosen(model));
    effects
}

fn copy(model: &mut Model) -> Vec<Effect> {
    if !may_choose(model) || owner(model) != MachineOwner::Page {
        return Vec::new();
    }
    model.machines.remember();
    // A name is at most 60 characters long.
    let name: String = title(model).chars().take(40).collect();
    let title =
        locale::text(&model.frame.language, key!("page.machines.copy_name"), &[("name".to_owned(), name)]);
    let base = model.machines.preset(model.machines.chosen.as_deref().unwrap_or(VIRTUAL)).to_owned();
    let now = model.machine.clone();
    let name = model.machines.add(&base, &now, title);
    (model.frame.tab, model.frame.named, model.frame.section) = (Tab::Settings, None, "machine");
    model.frame.overlay = None;
    take(model, name)
}

fn import(model: &mut Model) -> Vec<Effect> {
    let Some(who) = model.link.controller.who.clone().filter(|_| model.frame.alone) else {
        return Vec::new();
    };
    model.machines.remember();
    let base = who.mill.clone().unwrap_or_else(|| "3018".to_owned());
    let title: String = format!("{} {}", who.flavour, who.version).chars().take(60).collect();
    let now = model.machine.clone();
    let machines = &mut model.machines;
    let name = machines.add(&base, &now, title.clone());
    (machines.chosen, machines.saved) = (Some(name.clone()), Some(name));
    (machines.from, machines.named) = (ChoiceOrigin::Person, true);
    let kept = machines.keep();
    let text = Text::Key { key: key!("page.machines.imported"), args: vec![("name", title)] };
    vec![kept, frame::toast(model, text, Some(ToastAct::MachineBefore))]
}

fn forget(model: &mut Model, name: &str) -> Vec<Effect> {
    let Some(own) = model.machines.own.iter().find(|own| own.name == name).cloned() else {
        return Vec::new();
    };
    if !may_choose(model) {
        return Vec::new();
    }
    model.machines.remember();
    Arc::make_mut(&mut model.machines.own).retain(|known| known.name != name);
    let mut effects = if model.machines.chosen.as_deref() == Some(name) {
        take(model, own.base)
    } else {
        vec![model.machines.keep()]
    };
    // The change of the machine may have offered Undo already.
    if !effects.iter().any(|effect| matches!(effect, Effect::Wake { .. })) {
        let text = Text::of(key!("page.machines.forgotten"));
        effects.push(frame::toast(model, text, Some(ToastAct::MachineBefore)));
    }
    effects
}
