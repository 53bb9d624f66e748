//! Motor, number of columns, and edits of the table. Edits apply to the selected block if it has more than
//! one cell, else to the whole table.

use super::Table;
use crate::i18n::{self, key, say, t};
use crate::lab::edits::MOTORS;
use crate::lab::phases::{CellBlock, MOST_COLUMNS, TableEdit, whole};
use crate::model::LabEvent;
use crate::page::{lab, peek, send, watch};
use crate::widgets::{choice, menu_word, push_if, segmented};
use annulus_core::machine::axis_name;
use annulus_core::machine::phases::{self, PRESETS};
use leptos::ev;
use leptos::html::{div, input, label, p, select, span};
use leptos::prelude::*;

pub(super) fn tools(table: Table) -> impl IntoView {
    let free = move || !lab::locked();
    div().class("lab-tools").attr("role", "group").attr("aria-label", t!("page.lab.phases.tools")).child((
        motors(),
        cycle(table),
        presets(table),
        div().class("row").child((
            push_if("button", free, t!("page.lab.phases.rotate_left"), move |_| {
                table.edit(&TableEdit::Rotate { by: -1 });
            }),
            push_if("button", free, t!("page.lab.phases.rotate_right"), move |_| {
                table.edit(&TableEdit::Rotate { by: 1 });
            }),
            push_if("button", free, t!("page.lab.phases.invert"), move |_| {
                table.edit(&TableEdit::Invert(chosen(table)));
            }),
            push_if("button", free, t!("page.lab.phases.mirror"), move |_| {
                table.edit(&TableEdit::Mirror(chosen(table)));
            }),
        )),
        p().class("quiet grow").attr("id", "phase-keys").child(t!("page.lab.phases.keys")),
    ))
}

fn chosen(table: Table) -> CellBlock {
    let block = peek(|m| m.lab.block);
    if block.single() { whole(table.columns.with_untracked(Vec::len)) } else { block }
}

fn motors() -> impl IntoView {
    let motor = watch(|m| &m.lab.motor);
    let choices = (0..MOTORS).map(|this| {
        choice(
            move || motor.get() == this,
            move || axis_name(this),
            move |_| send(LabEvent::Motor { motor: this }),
        )
        .into_any()
    });
    div().class("field").child((
        span().child(t!("page.lab.phases.motor")),
        segmented(t!("page.lab.phases.motor"), choices.collect::<Vec<_>>()),
    ))
}

fn cycle(table: Table) -> impl IntoView {
    let typed = move |event| {
        if let Ok(count @ 1..=MOST_COLUMNS) = event_target_value(&event).parse::<usize>() {
            table.edit(&TableEdit::Length { columns: count });
        }
    };
    label().class("field").child((
        span().child(t!("page.lab.phases.cycle")),
        input()
            .attr("type", "number")
            .attr("min", "1")
            .attr("max", MOST_COLUMNS)
            .class("short")
            .prop("readOnly", lab::locked)
            .prop("value", move || table.columns.with(Vec::len).to_string())
            .on(ev::change, typed),
    ))
}

fn preset_name(preset: &str) -> &'static str {
    match preset {
        "boost_12" => key!("page.lab.phases.boost_12"),
        "full_two" => key!("page.lab.phases.full_two"),
        "full_one" => key!("page.lab.phases.full_one"),
        _ => key!("page.lab.phases.half"),
    }
}

/// The preset equal to `columns`; empty if none.
fn name_of(columns: &[u8]) -> &'static str {
    let same = |name: &&&str| phases::preset(name).is_some_and(|table| table.columns == columns);
    PRESETS.iter().find(same).copied().unwrap_or_default()
}

fn presets(table: Table) -> impl IntoView {
    let take = move |event| {
        if let Some(made) = phases::preset(&event_target_value(&event)) {
            table.edit(&TableEdit::Replace(made.columns));
        }
    };
    let now = Memo::new(move |_| table.columns.with(|columns| name_of(columns)));
    let options = PRESETS.map(|word| {
        menu_word(word, move || now.get() == word, move || i18n::text(preset_name(word), &[])).into_any()
    });
    let own = menu_word("", move || now.get().is_empty(), || say!("page.lab.phases.own"));
    label().class("field").child((
        span().child(t!("page.lab.phases.preset")),
        select()
            .prop("disabled", lab::locked)
            .on(ev::change, take)
            .child(std::iter::once(own.into_any()).chain(options).collect::<Vec<_>>()),
    ))
}
