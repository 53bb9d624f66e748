//! The tool change dialog: old and new tool, the steps, and *Start spindle and continue*. The machine moves
//! only after that press.

use super::banner::control;
use super::words::wear_words;
use super::{controller, magazine, words};
use crate::i18n::{key, language, say, t, text};
use crate::model::link::rest::{ChangeCheck, change_rows};
use crate::model::{Job, Model};
use crate::page::{link, read, shared, watch};
use crate::widgets::{Dialog, Icon, dialog, icon, push, push_guarded, push_if};
use annulus_core::control::State;
use annulus_core::job::{Command, Program};
use annulus_core::machine::{RackTool, ToolWear};
use annulus_core::wire::{Ask, LengthKnown};
use leptos::html::{div, li, ol, p, span, ul};
use leptos::prelude::*;

fn bits(program: &Program, leg: usize) -> (Option<u32>, Option<u32>) {
    let asked = |commands: &[Command]| {
        commands.iter().rev().find_map(|command| match command {
            Command::AwaitBit { bit } => Some(*bit),
            _ => None,
        })
    };
    let wanted = program.legs.get(leg).and_then(|leg| asked(&leg.commands));
    let before =
        program.legs.get(..leg).unwrap_or_default().iter().rev().find_map(|leg| asked(&leg.commands));
    // Without a request in this leg, the tool in the spindle is the right one.
    (before, wanted.or(before))
}

/// The tool of the tool list with this number: its displayed name, the tool, its wear.
fn tool(number: Option<u32>) -> Option<(String, RackTool, ToolWear)> {
    let number = number?;
    shared(|m| &m.machine).with(|machine| {
        let tool = machine.rack.iter().find(|tool| tool.number == number)?.clone();
        let wear = watch(|m| &m.link.tools).with(|report| ToolWear::of(&report.wear, &machine.name, &tool));
        Some((format!("T{number} {}", tool.bit().title(&language())), tool, wear))
    })
}

fn worn() -> Option<(String, RackTool, ToolWear)> {
    let wanted = tool(read(|m| m.link.tools.wanted));
    wanted.filter(|(_, tool, wear)| wear.is_over(tool.life))
}

fn change() -> (Option<String>, Option<String>) {
    let (before, wanted) = read(|m| (m.link.tools.in_spindle, m.link.tools.wanted));
    let (bit_before, bit_wanted) = bits_of_change();
    let name = |number| tool(number).map(|(name, ..)| name);
    (name(before).or(bit_before), name(wanted).or(bit_wanted))
}

/// True if the wanted tool may already be in the spindle: no other one was put in, and it isn't worn.
fn is_same() -> bool {
    let (before, wanted) = change();
    worn().is_none() && (before.is_none() || before == wanted)
}

/// The names of the previous and the wanted tool from the job, for tools that the tool list doesn't have.
fn bits_of_change() -> (Option<String>, Option<String>) {
    let leg = read(|m| m.link.status.as_ref()?.leg).unwrap_or(0);
    let own = shared(|m| &m.link.status).with(|status| {
        let status = status.as_ref()?;
        Some((status.bit, Some(status.change.as_ref()?.bit)))
    });
    shared(|m| &m.start.shown).with(|job| {
        let Some(job) = job else { return (None, None) };
        let (before, wanted) = own.unwrap_or_else(|| bits(&job.program, leg as usize));
        let name = |bit: Option<u32>| Some(job.program.bits.get(bit? as usize)?.title(&language()));
        (name(before), name(wanted))
    })
}

fn named(tool: Option<String>) -> String {
    tool.unwrap_or_else(|| say!("page.change.none"))
}

fn measurement() -> impl IntoView {
    let now = Memo::new(move |_| words::measuring());
    let rows = words::MEASUREMENT.into_iter().enumerate().map(move |(row, word)| {
        li().attr("aria-current", move || (now.get() == Some(row)).then_some("step"))
            .child(move || text(word, &[]))
    });
    ol().class("measurement").attr("aria-label", t!("page.measure.title")).child(rows.collect_view())
}

/// The progress of the controller's own changer.
fn by_itself(changes: Memo<Option<[u32; 2]>>) -> impl IntoView {
    p().child(move || {
        let [at, of] = changes.get().unwrap_or_default();
        say!("page.changer.line", at = at, of = of)
    })
}

fn from_to() -> impl IntoView {
    let from = move || {
        let before = div().child((
            span().class("quiet").child(t!("page.change.from")),
            div().class("bit").child(move || named(change().0)),
        ));
        (!is_same()).then(|| (before, icon(Icon::Arrow)))
    };
    div().class("change").child((
        from,
        div().child((
            span().class("quiet").child(t!("page.change.to")),
            div().class("bit").child(move || named(change().1)),
        )),
    ))
}

/// The text of a safety check, if it holds and if it doesn't.
fn check_words(check: ChangeCheck) -> [&'static str; 2] {
    match check {
        ChangeCheck::SpindleOff => [key!("page.change.spindle_off"), key!("page.change.spindle_turns")],
        ChangeCheck::Up => [key!("page.change.up"), key!("page.change.not_up")],
        ChangeCheck::AtHeight => [key!("page.change.up_change"), key!("page.change.not_up_change")],
        ChangeCheck::AtPlace => [key!("page.change.at_place"), key!("page.change.elsewhere")],
    }
}

/// The machine's live safety checks before a hand reaches for the spindle.
fn checks() -> impl IntoView {
    let rows = Memo::new(move |_| {
        shared(|m| &m.link.status).with(|status| {
            let status = status.as_ref()?;
            let program = |job: &Option<_>| change_rows(status, job.as_deref().map(|job: &Job| &job.program));
            Some(shared(|m| &m.start.shown).with(program))
        })
    });
    let row = |(check, holds): (ChangeCheck, bool)| {
        let [so, not_so] = check_words(check);
        let (tone, sign, word) =
            if holds { ("tone-run", Icon::Check, so) } else { ("tone-alarm", Icon::Cross, not_so) };
        li().class(tone).child((icon(sign), span().child(move || text(word, &[]))))
    };
    ul().class("change-checks")
        .attr("aria-label", t!("page.change.checks"))
        .child(move || rows.get().unwrap_or_default().into_iter().map(row).collect_view())
}

fn steps() -> impl IntoView {
    let measures =
        |m: &Model| m.link.controller.who.as_ref().is_some_and(|who| who.lengths.in_force().is_some());
    let height = move || {
        if read(measures) { say!("page.change.measures") } else { say!("page.controller.touch_off") }
    };
    ol().child((
        li().child(t!("page.change.wait")),
        // Without a tool setter, the controller assumes that the first tool is the one with which Z zero was
        // set.
        move || {
            let is_first = controller::plans() && !read(measures) && bits_of_change().0.is_none();
            li().child(move || match (is_first, is_same()) {
                (true, _) => say!("page.change.first"),
                (false, true) => say!("page.change.put_in"),
                (false, false) => say!("page.change.swap"),
            })
        },
        move || {
            worn().map(|(name, tool, wear)| {
                let words = wear_words(&tool, &wear);
                li().child(move || say!("page.change.worn", tool = name, done = words))
            })
        },
        // A tool that is measured next may stick out as far as it likes.
        li().child(move || match length_known() {
            Some(LengthKnown::Equal) => say!("page.change.check"),
            // A worn tool of a magazine: nothing measures the new one.
            None if !controller::plans() => say!("page.change.check"),
            _ => say!("page.change.check_tight"),
        }),
        move || controller::plans().then(|| li().child(height)),
        move || length_known().map(|known| li().child(length_words(known))),
        li().child(t!("page.change.hands_clear")),
    ))
}

/// How the tool length is known, on our own drill (not GRBL).
fn length_known() -> Option<LengthKnown> {
    read(|m| Some(m.link.status.as_ref()?.change.as_ref()?.length))
}

fn length_words(known: LengthKnown) -> String {
    match known {
        LengthKnown::No => say!("page.change.length_no"),
        LengthKnown::Measured => say!("page.change.length_measured"),
        LengthKnown::Equal => say!("page.change.length_equal"),
    }
}

fn length_asks() -> impl IntoView {
    let has_setter = || read(|m| m.machine.change.setter.on);
    let is_asked = Memo::new(move |_| match length_known() {
        Some(LengthKnown::No) => true,
        // The reference tool: the setter can still measure it, to compare the others with it.
        Some(LengthKnown::Measured) => has_setter(),
        Some(LengthKnown::Equal) | None => false,
    });
    move || {
        is_asked.get().then(|| {
            div().class("row").child((
                push_if("button", link::may_act, t!("page.controller.height"), |_| link::ask(Ask::SetHeight)),
                has_setter().then(|| {
                    push_guarded(
                        "button",
                        || "measure-tool",
                        link::may_act,
                        t!("page.change.length_setter"),
                        |_| link::ask(Ask::MeasureTool),
                    )
                }),
                push_if("button", link::may_act, t!("page.change.length_same"), |_| {
                    link::ask(Ask::SameLength);
                }),
            ))
        })
    }
}

/// *Jog first* and *Start spindle and continue*. The latter is disabled while the machine measures or changes
/// by itself.
fn foot(put_off: RwSignal<bool>) -> impl IntoView {
    let by_itself = move || words::measuring().is_some() || words::changing().is_some();
    (
        push("button", t!("page.change.later"), move |_| put_off.set(true)),
        push_guarded(
            "button primary",
            || "continue",
            move || {
                let is_known = length_known() != Some(LengthKnown::No);
                link::may_act() && is_known && !by_itself() && !magazine::is_open_for_new()
            },
            t!("page.change.continue"),
            |_| link::ask(Ask::ToolChanged),
        ),
    )
}

pub fn tool_change() -> impl IntoView {
    // The machine doesn't ask for a tool that it fetches itself, but for a new tool if that one is worn.
    let by_hand = Memo::new(move |_| {
        let fetches = read(|m| m.link.magazine.as_ref().map(|report| report.changes));
        fetches.is_none_or(|fetches| !fetches && worn().is_some())
    });
    let asked = Memo::new(move |_| link::state() == Some(State::ToolChange) && by_hand.get());
    let put_off = RwSignal::new(false);
    // Touching off jogs and parks during the change, so these states don't end it.
    let is_over = Memo::new(move |_| {
        let in_change = [State::ToolChange, State::Jogging, State::Parking, State::Stopping];
        link::state().is_some_and(|state| !in_change.contains(&state))
    });
    Effect::new(move |_| {
        if is_over.get() {
            put_off.set(false);
        }
    });
    let measures = Memo::new(move |_| words::measuring().is_some());
    let changes = Memo::new(move |_| words::changing());
    let todo = move || match changes.get() {
        Some(_) => by_itself(changes).into_any(),
        None if measures.get() => measurement().into_any(),
        None => (checks(), steps(), length_asks()).into_any(),
    };
    let body = (
        // A measurement at the start of a job is of the tool with which zero was set: nothing is being
        // exchanged.
        move || (!measures.get()).then(from_to),
        todo,
        magazine::new_tool(),
        // A page without control shows why Continue is disabled, and the button to take control.
        move || (asked.get() && !link::may_act()).then(control),
    );
    let foot = foot(put_off);
    let shown = dialog(
        Signal::derive(move || asked.get() && !put_off.get()),
        move || put_off.set(true),
        Dialog {
            name: "bit-change",
            role: "alertdialog",
            title: Box::new(move || {
                if measures.get() { say!("page.measure.title") } else { say!("page.change.title") }
            }),
            body: body.into_any(),
            foot: foot.into_any(),
        },
    );
    let again = move || {
        (asked.get() && put_off.get()).then(|| {
            div().class("notice tone-change").child((
                icon(Icon::Bit),
                span().class("grow").child(t!("page.change.waiting")),
                push("button", t!("page.change.open"), move |_| put_off.set(false)),
            ))
        })
    };
    (again, shown)
}
