//! Settings of the machine (A11): every field of the machine's table, staged, refused with a sentence, applied at once.
//!
//! Comes in: the machine, the draft of it. Goes out: what is typed, and what is to become of it. Knows no single setting: the table
//! does.

mod changer;
mod clock;
mod field;
mod keys;
mod lengths;
mod mill;
mod opening;
mod own;
mod tools;

use crate::i18n::{self, key, message, say, t};
use crate::model::address::OWN_SECTIONS;
use crate::model::{FrameEvent, SettingsEvent};
use crate::page::{frame, link, open_board, send};
use crate::widgets::{push, push_if};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::{self, SECTIONS, Value, ValueKind};
use leptos::ev;
use leptos::html::{button, dd, div, dl, dt, h2, input, label, nav, p, section, span};
use leptos::prelude::*;

fn section_name(section: &str) -> &'static str {
    if let Some(name) = own::name(section) {
        return name;
    }
    match section {
        "machine" => key!("page.settings.machine"),
        "card" => key!("page.settings.card"),
        "parallel" => key!("page.settings.parallel"),
        "adapter" => key!("page.settings.adapter"),
        "converter" => key!("page.settings.converter"),
        "magazine" => key!("page.settings.magazine"),
        "foot" => key!("page.settings.foot"),
        "park" => key!("page.settings.park"),
        "x" => key!("page.settings.x"),
        "y" => key!("page.settings.y"),
        "z" => key!("page.settings.z"),
        "drive" => key!("page.settings.drive"),
        "motion" => key!("page.settings.motion"),
        "overlap" => key!("page.settings.overlap"),
        "stroke" => key!("page.settings.stroke"),
        "spindle" => key!("page.settings.spindle"),
        _ => key!("page.settings.rack"),
    }
}

/// What would change, in the order of the table.
fn changes() -> Vec<(String, Value)> {
    let machine = open_board().machine.get();
    link::link().draft.with(|draft| draft.changes(&machine))
}

/// The screen.
pub(crate) fn settings() -> impl IntoView {
    let shown = frame().section;
    let refused = Memo::new(move |_| {
        let machine = open_board().machine.get();
        link::link().draft.with(|draft| draft.refusals(&machine))
    });
    let [general, others @ ..] = OWN_SECTIONS;
    let of_machine = SECTIONS.iter().map(|(section, _)| *section);
    let tabs = [general].into_iter().chain(of_machine).chain(others).map(|this| {
        button()
            .attr("type", "button")
            .class("button quiet")
            .attr("aria-current", move || (shown.get() == this).then_some("true"))
            .on(ev::click, move |_| send(FrameEvent::Section { section: this }))
            .child(move || i18n::text(section_name(this), &[]))
    });
    let line = link::link();
    let plans = Memo::new(move |_| line.controller.with(link::Controller::plans));
    let fields = move || {
        let rows =
            SECTIONS.iter().find(|(section, _)| *section == shown.get()).map_or(&[][..], |(_, rows)| rows);
        let shown = rows.iter().filter(|setting| setting.kind != ValueKind::Tools);
        shown.map(|setting| field::field(setting, refused).into_any()).collect::<Vec<_>>()
    };
    let own = Memo::new(move |_| Some(shown.get()).filter(|section| own::name(section).is_some()));
    div().class("whole").child(div().class("settings").child((
        nav().attr("aria-label", t!("page.settings.sections")).child(tabs.collect::<Vec<_>>()),
        section().class("page").attr("aria-label", t!("page.settings.title")).child((
            h2().child(move || i18n::text(section_name(shown.get()), &[])),
            move || own.get().map(own::body),
            move || own.get().is_none().then(|| p().class("quiet").child(t!("page.settings.about"))),
            refused_by_bridge(),
            move || (shown.get() == "machine" && plans.get()).then(of_controller),
            move || (shown.get() == "rack").then(|| tools::tools(refused)),
            move || own.get().is_none().then(|| div().class("setting-grid").child(fields())),
            move || ["card", "parallel"].contains(&shown.get()).then(clock::clock),
            diff(refused),
        )),
    )))
}

/// What is chosen once for a controller that plans its own motion.
fn of_controller() -> impl IntoView {
    (mill::mill(), lengths::lengths(), changer::changer(), opening::opening())
}

/// Whether keys that type something work alone.
fn signs() -> impl IntoView {
    let tick = input()
        .attr("type", "checkbox")
        .prop("checked", move || frame().signs.get())
        .on(ev::change, |event| send(FrameEvent::Signs { on: event_target_checked(&event) }));
    div().class("field signs").child((
        span().child(t!("page.settings.signs")),
        label().class("tick").child((tick, span().child(t!("page.settings.signs_alone")))),
        p().class("quiet").child(t!("page.settings.signs_about")),
        keys::own_keys(),
    ))
}

/// Why the bridge did not take the last wish.
fn refused_by_bridge() -> impl IntoView {
    let refused = link::link().refused;
    move || refused.get().map(|why| p().class("refusal").attr("role", "alert").child(message(&why)))
}

/// What would change in the machine, row by row: as it is, and as it would be.
pub(crate) fn change_rows(
    staged: Memo<Vec<(String, Value)>>,
    written: fn(&str, &Value) -> String,
) -> impl Fn() -> Vec<AnyView> + Copy + Send + 'static {
    move || {
        let machine = open_board().machine.get();
        let rows = staged.get().into_iter().map(|(key, value)| {
            let before = machine::setting(&key).map(|setting| setting.value(&machine));
            let (old, new) = match (before, value) {
                (Some(Value::Texts(old)), Value::Texts(new)) => (others(&old, &new), others(&new, &old)),
                (before, value) => {
                    (before.map(|old| written(&key, &old)).unwrap_or_default(), written(&key, &value))
                }
            };
            let change = dd().child(move || say!("page.settings.change", old = old, new = new));
            (dt().child(key), change).into_any()
        });
        rows.collect()
    }
}

/// The lines of a list that another one does not have.
fn others(lines: &[String], than: &[String]) -> String {
    let others = lines.iter().filter(|line| !than.contains(line)).map(String::as_str);
    let others = others.collect::<Vec<_>>().join(", ");
    if others.is_empty() { "–".to_owned() } else { others }
}

/// What will change, and the two buttons. Refused while the machine moves, and then it says so.
fn diff(refused: Memo<Vec<Diagnostic>>) -> impl IntoView {
    let line = link::link();
    let staged = Memo::new(move |_| changes());
    let list = change_rows(staged, |_, value| value.to_string());
    let may = move || refused.with(Vec::is_empty) && line.may_act() && !line.busy();
    let why = move || {
        if !line.may_act() {
            Some(say!("page.settings.needs_control"))
        } else if line.busy() {
            Some(say!("page.settings.moving"))
        } else {
            None
        }
    };
    move || {
        (!staged.with(Vec::is_empty)).then(|| {
            div()
                .class("diff-bar")
                .attr("role", "group")
                .attr("aria-label", t!("page.settings.changes"))
                .child((
                    dl().class("facts grow").child(list),
                    p().class("quiet").child(why),
                    push("button", t!("page.settings.discard"), |_| send(SettingsEvent::Discard)),
                    push_if("button primary", may, t!("page.settings.apply"), |_| send(SettingsEvent::Apply)),
                ))
        })
    }
}
