//! The dynamics table: typed, checked by running it, plotted as speed over time, applied to the machine.
//!
//! ```text
//! state  period enter leave  steps/s  mm/s │ speed over time with the lost-step limit
//! interrupts, move                         │ mm/s of each axis
//! its errors                               │ the steps
//! ```

use super::{Shown, shown, steps};
use crate::i18n::{advice, message, say, t};
use crate::lab::motion::{self, Column, StateRow};
use crate::model::LabEvent;
use crate::page::{lab, send};
use crate::readout::short;
use crate::screens::lab::apply;
use crate::widgets::{Icon, icon, push, push_if, typed_input};
use annulus_core::machine::Dynamics;
use leptos::ev;
use leptos::html::{div, h3, li, p, section, span, strong, table, tbody, td, th, thead, tr, ul};
use leptos::prelude::*;

pub(super) fn dynamics() -> impl IntoView {
    let shown = shown();
    div().class("lab-part").child((
        div().class("lab-columns").child((
            div().class("lab-inputs").child((
                section().class("block").attr("aria-label", t!("page.lab.motion.table")).child((
                    h3().child(t!("page.lab.motion.table")),
                    editor(shown),
                    buttons(shown),
                )),
                section().class("block").child((
                    shown.interrupts.view(t!("page.lab.motion.interrupts")),
                    shown.steps.view(t!("page.lab.motion.takts_to_go")),
                )),
                findings(shown),
            )),
            steps::steps(shown),
        )),
        apply::apply(move || shown.sound.get()),
    ))
}

fn editor(shown: Shown) -> impl IntoView {
    let head = |text: fn() -> String| th().attr("scope", "col").child(text);
    let count = Memo::new(move |_| shown.rows.with(Vec::len));
    table().class("dynamics").child((
        thead().child(tr().child((
            head(|| say!("page.lab.motion.state")),
            head(|| say!("page.lab.motion.period")),
            head(|| say!("page.lab.motion.enter")),
            head(|| say!("page.lab.motion.leave")),
            head(|| say!("page.lab.motion.rate")),
        ))),
        tbody().child(move || (0..count.get()).map(|at| row(shown, at).into_any()).collect::<Vec<_>>()),
    ))
}

fn row(shown: Shown, at: usize) -> impl IntoView {
    let rate = move || {
        let period = shown.rows.with(|rows| motion::count(&rows.get(at)?.period))?;
        let rate = shown.interrupts.number()? / f64::from(period);
        rate.is_finite().then(|| short(rate))
    };
    let first = at == 0;
    tr().child((
        th().attr("scope", "row").class("number").child(at),
        td().child(cell(shown, at, Column::Period)),
        td().child((!first).then(|| cell(shown, at, Column::Enter))),
        td().child((!first).then(|| cell(shown, at, Column::Leave))),
        td().class("number").child(rate),
    ))
}

fn cell(shown: Shown, at: usize, column: Column) -> impl IntoView {
    let text = move || {
        shown.rows.with(|rows| {
            let row = rows.get(at).cloned().unwrap_or_default();
            match column {
                Column::Period => row.period,
                Column::Enter => row.enter,
                Column::Leave => row.leave,
            }
        })
    };
    let name = move || match column {
        Column::Period => say!("page.lab.motion.period_of", state = at),
        Column::Enter => say!("page.lab.motion.enter_of", state = at),
        Column::Leave => say!("page.lab.motion.leave_of", state = at),
    };
    let field = format!("dynamics.{column:?}.{at}");
    typed_input("numeric", text, move || motion::count(&text()).is_none())
        .class("short number")
        .attr("aria-label", name)
        .prop("readOnly", lab::locked)
        .on(ev::input, move |event| {
            let rows = motion::with_cell(&shown.rows.get_untracked(), at, column, event_target_value(&event));
            lab::change(Some(&field), |bench| bench.with_dynamics(rows));
        })
        .on(ev::change, move |_| send(LabEvent::Rest))
}

fn buttons(shown: Shown) -> impl IntoView {
    let edit = move |made: fn(&[StateRow]) -> Vec<StateRow>| {
        let rows = shown.rows.with_untracked(|rows| made(rows));
        lab::change(None, |bench| bench.with_dynamics(rows));
    };
    let free = move || !lab::locked();
    let printed = |_: &[StateRow]| motion::rows(&Dynamics::arendt());
    div().class("row").child((
        push_if("button small", free, t!("page.lab.motion.add"), move |_| edit(motion::with_state)),
        push_if("button small", free, t!("page.lab.motion.remove"), move |_| edit(motion::without_state)),
        push_if("button small", free, t!("page.lab.motion.printed"), move |_| edit(printed)),
        push("button small", t!("page.lab.motion.of_machine"), move |_| {
            lab::change(None, |bench| bench.without_dynamics());
        }),
    ))
}

fn findings(shown: Shown) -> impl IntoView {
    let typed = move || shown.table.with(Option::is_some);
    let verdict = move || {
        let (sign, words) = if !typed() {
            (Icon::Warning, say!("page.lab.motion.not_numbers"))
        } else if shown.sound.get() {
            (Icon::Check, say!("page.lab.motion.sound"))
        } else {
            (Icon::Cross, say!("page.lab.motion.unsound"))
        };
        (icon(sign), span().child(words))
    };
    let list = move || {
        let lines = shown.findings.get().into_iter().map(|finding| {
            let cure = finding.clone();
            li().child((
                strong().child(move || message(&finding)),
                p().class("quiet").child(move || advice(&cure)),
            ))
        });
        lines.collect::<Vec<_>>()
    };
    section().class("block findings").attr("aria-label", t!("page.lab.phases.findings")).child((
        h3().child(t!("page.lab.phases.findings")),
        p().class("row").attr("role", "status").child(verdict),
        ul().child(list),
    ))
}
