//! The tool change: from which to which, what to do, and Continue.
//!
//! Comes in: the state, the program's bits, what is known of the tools, what the machine tells of spindle and place. Goes out:
//! `ToolChanged`. The machine moves only after Continue.

use super::banner::control;
use super::words::wear_words;
use super::{controller, magazine, words};
use crate::i18n::{key, language, say, t, text};
use crate::model::Job;
use crate::model::link::at_change::{ChangeCheck, change_rows};
use crate::page::link::{self, Link};
use crate::page::open_board;
use crate::widgets::{Dialog, Icon, dialog, icon, push, push_if};
use annulus_core::control::State;
use annulus_core::job::{Command, Program};
use annulus_core::machine::{RackTool, ToolWear};
use annulus_core::wire::Ask;
use leptos::html::{div, li, ol, p, span, ul};
use leptos::prelude::*;

/// The bit that leg `leg` asks for and the one before it.
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
    // Asked for between two holes, it is the one that they are made with.
    (before, wanted.or(before))
}

/// The tool of the rack with this number, as its dialog calls it, and what it has done.
fn tool(line: Link, number: Option<u32>) -> Option<(String, RackTool, ToolWear)> {
    let number = number?;
    open_board().machine.with(|machine| {
        let tool = machine.rack.iter().find(|tool| tool.number == number)?.clone();
        let wear = line.tools.with(|report| ToolWear::of(&report.wear, &machine.name, &tool));
        Some((format!("T{number} {}", tool.bit().title(&language())), tool, wear))
    })
}

/// The tool that is wanted, where one of that number is worn: a new one has to go in.
fn worn(line: Link) -> Option<(String, RackTool, ToolWear)> {
    let wanted = tool(line, line.tools.with(|report| report.wanted));
    wanted.filter(|(_, tool, wear)| wear.is_over(tool.life))
}

/// What the tool before and the one that is wanted are called.
fn change(line: Link) -> (Option<String>, Option<String>) {
    let (before, wanted) = line.tools.with(|report| (report.in_spindle, report.wanted));
    let (bit_before, bit_wanted) = bits_of_change(line);
    let name = |number| tool(line, number).map(|(name, ..)| name);
    (name(before).or(bit_before), name(wanted).or(bit_wanted))
}

/// Whether the tool that is wanted may be in already: nobody put another one in, and it is not worn.
fn is_same(line: Link) -> bool {
    let (before, wanted) = change(line);
    worn(line).is_none() && (before.is_none() || before == wanted)
}

/// What the bit before and the one that is wanted are called, where the rack does not have them.
fn bits_of_change(line: Link) -> (Option<String>, Option<String>) {
    let leg = line.status.with(|status| status.as_ref().and_then(|status| status.leg)).unwrap_or(0);
    link::link().shown_job.with(|job| {
        let Some(job) = job else { return (None, None) };
        let (before, wanted) = bits(&job.program, leg as usize);
        let name = |bit: Option<u32>| Some(job.program.bits.get(bit? as usize)?.title(&language()));
        (name(before), name(wanted))
    })
}

fn named(tool: Option<String>) -> String {
    tool.unwrap_or_else(|| say!("page.change.none"))
}

/// What the machine does by itself where the tool is measured, and what of it is in work.
fn measurement(line: Link) -> impl IntoView {
    let now = Memo::new(move |_| words::measuring(line));
    let rows = words::MEASUREMENT.into_iter().enumerate().map(move |(row, word)| {
        li().attr("aria-current", move || (now.get() == Some(row)).then_some("step"))
            .child(move || text(word, &[]))
    });
    ol().class("measurement").attr("aria-label", t!("page.measure.title")).child(rows.collect_view())
}

/// What the machine's own changer does.
fn by_itself(changes: Memo<Option<[u32; 2]>>) -> impl IntoView {
    p().child(move || {
        let [at, of] = changes.get().unwrap_or_default();
        say!("page.changer.line", at = at, of = of)
    })
}

/// The tool that is in, and the one that is wanted.
fn from_to(line: Link) -> impl IntoView {
    let from = move || {
        let before = div().child((
            span().class("quiet").child(t!("page.change.from")),
            div().class("bit").child(move || named(change(line).0)),
        ));
        (!is_same(line)).then(|| (before, icon(Icon::Arrow)))
    };
    div().class("change").child((
        from,
        div().child((
            span().class("quiet").child(t!("page.change.to")),
            div().class("bit").child(move || named(change(line).1)),
        )),
    ))
}

/// The sentence of a row of what the machine tells, where it is so and where it is not.
fn check_words(check: ChangeCheck) -> [&'static str; 2] {
    match check {
        ChangeCheck::SpindleOff => [key!("page.change.spindle_off"), key!("page.change.spindle_turns")],
        ChangeCheck::Up => [key!("page.change.up"), key!("page.change.not_up")],
        ChangeCheck::AtPlace => [key!("page.change.at_place"), key!("page.change.elsewhere")],
    }
}

/// What the machine tells of itself before a hand goes to the spindle, as it is now.
fn checks(line: Link) -> impl IntoView {
    let rows = Memo::new(move |_| {
        line.status.with(|status| {
            let status = status.as_ref()?;
            let program = |job: &Option<_>| change_rows(status, job.as_deref().map(|job: &Job| &job.program));
            Some(line.shown_job.with(program))
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

/// What the person does, one after the other.
fn steps(line: Link) -> impl IntoView {
    let touches_off = controller::plans(line);
    let measures = Memo::new(move |_| {
        let chosen = line.controller.with(|controller| controller.who.as_ref().map(|who| who.lengths));
        chosen.is_some_and(|lengths| lengths.in_force().is_some())
    });
    let height = move || {
        if measures.get() { say!("page.change.measures") } else { say!("page.controller.touch_off") }
    };
    ol().child((
        li().child(t!("page.change.wait")),
        // The controller takes the first bit of a job for the one with which zero of Z was set, where it is not measured.
        move || {
            let is_first = touches_off.get() && !measures.get() && bits_of_change(line).0.is_none();
            li().child(move || match (is_first, is_same(line)) {
                (true, _) => say!("page.change.first"),
                (false, true) => say!("page.change.put_in"),
                (false, false) => say!("page.change.swap"),
            })
        },
        move || {
            worn(line).map(|(name, tool, wear)| {
                let words = wear_words(&tool, &wear);
                li().child(move || say!("page.change.worn", tool = name, done = words))
            })
        },
        li().child(t!("page.change.check")),
        move || touches_off.get().then(|| li().child(height)),
    ))
}

/// Not yet, and Continue: nothing to be pressed while the machine does it itself.
fn foot(line: Link, put_off: RwSignal<bool>) -> impl IntoView {
    let by_itself = move || words::measuring(line).is_some() || words::changing(line).is_some();
    (
        push("button", t!("page.change.later"), move |_| put_off.set(true)),
        push_if(
            "button primary",
            move || line.may_act() && !by_itself() && !magazine::is_open_for_new(line),
            t!("page.change.continue"),
            |_| link::ask(Ask::ToolChanged),
        ),
    )
}

/// The dialog.
pub fn tool_change() -> impl IntoView {
    let line = link::link();
    // What the machine fetches itself is not waited for; a new tool in the place of one that is worn is, on such a machine too.
    let by_hand = Memo::new(move |_| {
        let fetches = line.magazine.with(|magazine| magazine.as_ref().map(|report| report.changes));
        fetches.is_none_or(|fetches| !fetches && worn(line).is_some())
    });
    let asked = Memo::new(move |_| line.state() == Some(State::ToolChange) && by_hand.get());
    let put_off = RwSignal::new(false);
    // A tool that is touched off moves by hand in the middle of its change, and a line may be lost and found there.
    let is_over = Memo::new(move |_| {
        let in_change = [State::ToolChange, State::Jogging, State::Stopping];
        line.state().is_some_and(|state| !in_change.contains(&state))
    });
    Effect::new(move |_| {
        if is_over.get() {
            put_off.set(false);
        }
    });
    let measures = Memo::new(move |_| words::measuring(line).is_some());
    let changes = Memo::new(move |_| words::changing(line));
    let todo = move || match changes.get() {
        Some(_) => by_itself(changes).into_any(),
        None if measures.get() => measurement(line).into_any(),
        None => (checks(line), steps(line)).into_any(),
    };
    let body = (
        // What is measured at the start of a job is the tool that zero was set with: nobody asked for another one yet.
        move || (!measures.get()).then(|| from_to(line)),
        todo,
        magazine::new_tool(line),
        // Who only watches sees why Continue is not to be had, and how it can be.
        move || (asked.get() && !line.may_act()).then(|| control(line)),
    );
    let foot = foot(line, put_off);
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
