//! The machine that the job is for: the chip in the top bar, the dialog that chooses one, and the question of
//! the welcome.

use super::cam;
use crate::format::plain;
use crate::i18n::{self, number, say, t};
use crate::keys::Tab;
use crate::model::machines::{ChangedValue, may_choose, owner};
use crate::model::{ChoiceOrigin, FrameEvent, MachineEvent, MachineOwner, Model, Overlay};
use crate::page::{computed, peek, read, send, shared};
use crate::widgets::{Dialog, Icon, dialog, icon, push, push_if};
use annulus_core::cam::parameters::OPERATION;
use annulus_core::machine::{self, Axis, MILLS, Machine, MotionPlanner, VIRTUAL, VIRTUAL_NAME, Value};
use leptos::ev;
use leptos::html::{button, details, div, h2, h3, li, p, section, span, strong, summary, ul};
use leptos::prelude::*;

fn name_of(machine: &Machine) -> String {
    if machine.name == VIRTUAL_NAME { say!("page.virtual_drill") } else { machine.name.clone() }
}

/// Name of the chosen machine, or of the model that the connected controller is compared with.
fn current(model: &Model) -> String {
    match owner(model) {
        MachineOwner::Controller => {
            model.link.controller.who.as_ref().and_then(|who| who.mill.clone()).unwrap_or_default()
        }
        MachineOwner::Page => model.machines.chosen.clone().unwrap_or_else(|| VIRTUAL.to_owned()),
        MachineOwner::Bridge => String::new(),
    }
}

/// The machine that the job is planned for, as people call it.
fn shown_name() -> String {
    let of_controller = read(owner) == MachineOwner::Controller;
    match machine::mill(&computed(current).get()).filter(|_| of_controller) {
        Some(mill) => mill.title.to_owned(),
        None => shared(|m| &m.machine).with(|machine| name_of(machine)),
    }
}

/// Why jobs are planned for this machine.
fn origin() -> String {
    match (read(owner), read(|m| m.machines.from)) {
        (MachineOwner::Controller, _) => say!("page.machines.from_controller"),
        (MachineOwner::Bridge, _) if read(|m| m.link.settings.is_empty()) => {
            say!("page.machines.from_default")
        }
        (MachineOwner::Bridge, _) => say!("page.machines.from_bridge"),
        (MachineOwner::Page, ChoiceOrigin::Person) => say!("page.machines.from_person"),
        (MachineOwner::Page, ChoiceOrigin::Address) => say!("page.machines.from_address"),
        (MachineOwner::Page, ChoiceOrigin::Default) => say!("page.machines.from_default"),
    }
}

fn open() {
    send(FrameEvent::Overlay { overlay: Some(Overlay::Machines) });
}

fn close() {
    send(FrameEvent::Overlay { overlay: None });
}

/// The button next to the project's name, with the job's machine.
pub(super) fn chip() -> impl IntoView {
    let spoken = || say!("page.machines.chip", name = shown_name());
    button()
        .attr("type", "button")
        .class("machine-chip")
        .attr("aria-haspopup", "dialog")
        .attr("aria-label", spoken)
        .attr("title", move || format!("{}. {}", spoken(), origin()))
        .on(ev::click, |_| open())
        .child((icon(Icon::Mill), span().class("cut").child(shown_name)))
}

/// The question of the welcome, until a machine is chosen. Only where the page owns its machine.
pub(super) fn question() -> impl IntoView {
    let asks = |m: &Model| m.machines.chosen.is_none() && owner(m) == MachineOwner::Page;
    let choose = |name: &'static str| send(MachineEvent::Choose { name: name.to_owned() });
    move || {
        read(asks).then(|| {
            let mills = MILLS.iter().map(move |mill| {
                push("button", move || mill.title.to_owned(), move |_| choose(mill.name)).into_any()
            });
            section().class("which-machine").attr("aria-label", t!("page.machines.question")).child((
                h2().child(t!("page.machines.question")),
                p().class("quiet").child(t!("page.machines.question_is")),
                div().class("buttons").child((
                    push("button primary", t!("page.machines.just_try"), move |_| choose(VIRTUAL)),
                    mills.collect::<Vec<_>>(),
                    push("button", t!("page.machines.other"), |_| open()),
                )),
            ))
        })
    }
}

/// The dialog that chooses the machine.
pub(super) fn machines() -> impl IntoView {
    let is_open = Signal::derive(move || read(|m| m.frame.overlay == Some(Overlay::Machines)));
    let body = div().class("machine-choice").child(move || is_open.get().then(body));
    dialog(
        is_open,
        close,
        Dialog {
            name: "machines",
            role: "dialog",
            title: Box::new(t!("page.machines.title")),
            body: body.into_any(),
            foot: push("button primary", t!("page.close"), |_| close()).into_any(),
        },
    )
}

fn body() -> impl IntoView {
    let is_bridge = || read(owner) == MachineOwner::Bridge;
    let lists = move || {
        (!is_bridge()).then(|| {
            shared(|m| &m.machines.own).track();
            let own = peek(|m| m.machines.own_names());
            let presets: Vec<String> = machine::catalogue().map(str::to_owned).collect();
            (own_list(own), h3().child(t!("page.machines.presets")), list(presets))
        })
    };
    (
        p().child(move || say!("page.machines.now", name = shown_name())),
        p().class("quiet").child(origin),
        move || read(|m| m.link.busy()).then(|| p().class("quiet").child(t!("page.machines.busy"))),
        changes(),
        move || (!is_bridge()).then(actions),
        lists,
    )
}

fn own_list(names: Vec<String>) -> impl IntoView {
    (!names.is_empty()).then(|| (h3().child(t!("page.machines.own")), list(names)))
}

fn list(names: Vec<String>) -> impl IntoView {
    let rows = names.into_iter().filter_map(|name| {
        let (machine, preset) =
            peek(|m| Some((m.machines.machine(&name)?, m.machines.preset(&name).to_owned())))?;
        Some(li().child(row(name, &machine, &preset)).into_any())
    });
    ul().child(rows.collect::<Vec<_>>())
}

/// A machine to choose: picture, name, size, and who plans its motion.
fn row(name: String, machine: &Machine, preset: &str) -> impl IntoView + use<> {
    let mill = machine::mill(preset);
    let planner = MotionPlanner::of(preset);
    let own_name = Some(machine.name.clone()).filter(|name| name != VIRTUAL_NAME);
    let size_mm = [&machine.x, &machine.y, &machine.z].map(|axis: &Axis| (axis.max - axis.min).mm());
    let title = move || own_name.clone().unwrap_or_else(|| say!("page.virtual_drill"));
    let facts = move || {
        let [x, y, z] = size_mm.map(|mm| number(format!("{mm:.0}")));
        let size = say!("page.machines.size", x = x, y = y, z = z);
        let plans = match (planner, mill.and_then(|mill| mill.flavour)) {
            (MotionPlanner::Annulus, _) => say!("page.machines.annulus_plans"),
            (MotionPlanner::Controller, Some(flavour)) => {
                say!("page.machines.flavour_plans", flavour = flavour)
            }
            (MotionPlanner::Controller, None) => say!("page.machines.controller_plans"),
        };
        format!("{size} · {plans}")
    };
    let picture = match planner {
        MotionPlanner::Annulus if preset == VIRTUAL => Icon::Play,
        MotionPlanner::Annulus => Icon::Bit,
        MotionPlanner::Controller => Icon::Mill,
    };
    let (this, wanted) = (name.clone(), name);
    let is_chosen = move || if computed(current).get() == this { "true" } else { "false" };
    // A connected controller is a mill with a controller.
    let fits = move || read(owner) != MachineOwner::Controller || planner == MotionPlanner::Controller;
    button()
        .attr("type", "button")
        .class("machine-row")
        .attr("aria-pressed", is_chosen)
        .prop("disabled", move || !(read(may_choose) && fits()))
        .on(ev::click, move |_| {
            send(MachineEvent::Choose { name: wanted.clone() });
            close();
        })
        .child((icon(picture), span().child((strong().child(title), span().class("quiet").child(facts)))))
}

/// Copy, import, connect, delete.
fn actions() -> impl IntoView {
    let is_page = || read(owner) == MachineOwner::Page;
    let import = || read(|m| m.frame.alone && owner(m) == MachineOwner::Controller);
    let connect = |_| {
        close();
        send(FrameEvent::Show { tab: Tab::Machine });
    };
    let own = |m: &Model| {
        let chosen = m.machines.chosen.as_ref()?;
        m.machines.own.iter().find(|own| own.name == *chosen).map(|own| own.is_preset())
    };
    let forget = |_| {
        if let Some(name) = peek(|m| m.machines.chosen.clone()) {
            send(MachineEvent::Forget { name });
        }
    };
    div().class("buttons").child((
        move || {
            is_page().then(|| {
                push_if("button", || read(may_choose), t!("page.machines.copy"), |_| send(MachineEvent::Copy))
            })
        },
        move || import().then(|| push("button", t!("page.machines.import"), |_| send(MachineEvent::Import))),
        move || is_page().then(|| push("button", t!("page.machines.connect"), connect)),
        move || {
            let is_preset = read(own).filter(|_| is_page())?;
            let text = if is_preset { t!("page.machines.reset") } else { t!("page.machines.delete") };
            Some(push_if("button", || read(may_choose), text, forget))
        },
    ))
}

/// The values of the job that the last change of the machine changed.
fn changes() -> impl IntoView {
    move || {
        let changed = shared(|m| &m.machines.changed).get();
        let count = changed.len();
        (count > 0).then(|| {
            let rows = changed.iter().cloned().map(|value| li().child(move || sentence(&value)).into_any());
            let rows: Vec<_> = rows.collect();
            details().child((
                summary().child(t!("page.machines.changed", count = count)),
                ul().class("changed").child(rows),
            ))
        })
    }
}

fn sentence(changed: &ChangedValue) -> String {
    let operation = shared(|m| &m.job.work)
        .with(|work| work.as_ref()?.operations.get(changed.operation).map(cam::name_of))
        .unwrap_or_default();
    let unit = OPERATION.iter().find(|row| row.key == changed.key).map_or("", |row| row.unit);
    let [before, after] =
        [&changed.before, &changed.after].map(|value| value.as_ref().map_or_else(String::new, shown));
    say!(
        "page.machines.changed_value",
        operation = operation,
        name = cam::row_name(changed.key),
        before = before,
        after = after,
        unit = i18n::unit_of(unit)
    )
}

fn shown(value: &Value) -> String {
    match value {
        Value::Number(value) => number(plain(*value)),
        value => number(value.to_string()),
    }
}
