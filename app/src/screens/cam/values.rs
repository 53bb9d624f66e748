//! The selected operation on the right: its tool, the width of its cut, and all its parameters.

use super::entry::entry;
use super::job::name_of;
use crate::format::{Unit, plain, typed};
use crate::i18n::{number, say, t};
use crate::model::Model;
use crate::page::{board, peek, read, shared};
use crate::widgets::{last_refusal, push, refusal_text, typed_input};
use crate::workbench::edit::{self, ThroughTo};
use annulus_core::cam::parameters::{BIT, OF_MACHINE, OPERATION};
use annulus_core::cam::work::{Operation, Work};
use annulus_core::job::Bit;
use annulus_core::machine::{Field, Value};
use annulus_core::units::Length;
use leptos::ev;
use leptos::html::{details, div, h2, header, label, option, p, section, select, span, summary};
use leptos::prelude::*;
use std::sync::Arc;

/// Parameters with a slider: (minimum, maximum, step). The text field accepts the parameter's full range.
const SLIDERS: [(&str, (f64, f64, f64)); 6] = [
    ("isolate.passes", (1.0, 6.0, 1.0)),
    ("isolate.overlap", (0.0, 80.0, 5.0)),
    ("operation.depth", (0.0, 0.3, 0.01)),
    ("clear.stepover", (20.0, 100.0, 5.0)),
    ("cut_out.tabs", (0.0, 12.0, 1.0)),
    ("drill.tolerance", (0.0, 0.3, 0.01)),
];

const ELSEWHERE: [&str; 3] = ["operation.on", "operation.bit", "operation.face"];

pub(super) fn values() -> impl IntoView {
    // Rebuild the fields only for another operation, so that the field in use keeps its focus.
    let which = Memo::new(move |_| {
        let at = read(|m| m.job.chosen);
        let up = read(|m| Some(m.job.work.as_ref()?.setup.face));
        // On a side without operations there is nothing to show.
        let operation = board::operation().get().filter(|operation| Some(operation.face) == up);
        operation.map(|operation| (at, operation.action.word()))
    });
    let body = move || match which.get() {
        Some((at, _)) => {
            board::operation().get_untracked().map(|operation| fields(at, &operation)).into_any()
        }
        None => p().class("quiet").child(t!("page.cam.nothing_chosen")).into_any(),
    };
    section().class("block").attr("aria-label", t!("page.cam.values")).child((
        header().child(h2().child(move || {
            board::operation().get().map_or_else(|| say!("page.cam.values"), |operation| name_of(&operation))
        })),
        body,
    ))
}

fn fields(at: usize, operation: &Operation) -> impl IntoView + use<> {
    let rows = OPERATION.iter().filter(|row| !ELSEWHERE.contains(&row.key) && row.belongs_to(operation));
    let rows: Vec<AnyView> = rows.map(|row| field(at, row)).collect();
    let mills = operation.uses_bit();
    div().class("setting-list").child((mills.then(|| (bit(at), width(at))), rows, mills.then(bits)))
}

fn field(at: usize, row: &'static Field<Operation>) -> AnyView {
    let now = Memo::new(move |_| {
        let machine = shared(|m| &m.machine).get();
        shared(|m| &m.job.work).with(|work| row.value_on(work.as_ref()?.operations.get(at)?, &machine))
    });
    let follows = Memo::new(move |_| {
        shared(|m| &m.job.work)
            .with(|work| Some(row.is_of_machine(work.as_ref()?.operations.get(at)?)))
            .unwrap_or(false)
    });
    let write = move |value| {
        let found = shared(|m| &m.job.work).with_untracked(|work| work.as_ref()?.operations.get(at).cloned());
        let Some(mut operation) = found else { return Ok(()) };
        row.set(&mut operation, &value)?;
        board::change_job(Some(row.key), |work| edit::changed(work, at, |place| *place = operation));
        Ok(())
    };
    let slider = SLIDERS.iter().find(|(key, _)| *key == row.key).map(|(_, range)| *range);
    let entry = entry(row, now, slider, Arc::new(write));
    match row.key {
        "operation.depth" => (entry, through(at)).into_any(),
        _ if row.follows_machine() => (entry, of_machine(at, row, follows)).into_any(),
        _ => entry,
    }
}

/// Below a value that can follow the machine: a note that it does, or a button that makes it follow again.
fn of_machine(at: usize, row: &'static Field<Operation>, follows: Memo<bool>) -> impl IntoView {
    let release = move |_| {
        board::change_job(None, |work| {
            edit::changed(work, at, |operation| {
                let _every_row_that_follows_takes_it =
                    row.set(operation, &Value::Text(OF_MACHINE.to_owned()));
            })
        });
    };
    move || {
        if follows.get() {
            p().class("quiet").child(t!("page.cam.of_machine")).into_any()
        } else {
            push("button small", t!("page.cam.take_machine"), release).into_any()
        }
    }
}

/// The meaning of depth 0, below that field.
fn through(at: usize) -> impl IntoView {
    let said = Memo::new(move |_| {
        let machine = shared(|m| &m.machine).get();
        shared(|m| &m.job.work).with(|work| {
            let work = work.as_ref()?;
            edit::through(work, work.operations.get(at)?, &machine)
        })
    });
    let words = move || {
        said.get().map(|(to, board, below)| {
            let (board, below) = (plain(board.mm()), plain(below.mm()));
            match to {
                ThroughTo::Below => say!("page.cam.through", board = board, below = below),
                ThroughTo::WholeDrill => say!("page.cam.through_by_drill", board = board, below = below),
                ThroughTo::Bed => say!("page.cam.through_to_bed", board = board, below = below),
            }
        })
    };
    p().class("quiet").attr("role", "status").child(words)
}

fn bit(at: usize) -> impl IntoView {
    let names = Memo::new(move |_| {
        shared(|m| &m.job.work).with(|work| {
            work.as_ref().map(|work| work.bits.iter().map(|bit| bit.name.clone()).collect::<Vec<_>>())
        })
    });
    let now = Memo::new(move |_| {
        shared(|m| &m.job.work)
            .with(|work| Some(work.as_ref()?.operations.get(at)?.bit.clone()))
            .unwrap_or_default()
    });
    let options = move || {
        let one = |name: String| {
            let chosen = now.get_untracked() == name;
            option().attr("value", name.clone()).prop("selected", chosen).child(super::called(&name))
        };
        names.get().unwrap_or_default().into_iter().map(one).collect::<Vec<_>>()
    };
    div().class("setting").child((
        label().attr("for", "cam-bit").child(t!("page.cam.bit")),
        select()
            .attr("id", "cam-bit")
            .prop("value", move || now.get())
            .on(ev::change, move |event| {
                let name = event_target_value(&event);
                board::change_job(None, |work| edit::changed(work, at, |operation| operation.bit = name));
            })
            .child(options),
    ))
}

/// The cut width of a V-bit: typing a width sets the depth, and the depth determines the shown width.
fn width(at: usize) -> impl IntoView {
    let now = Memo::new(move |_| {
        shared(|m| &m.job.work).with(|work| {
            let work = work.as_ref()?;
            let operation = work.operations.get(at)?;
            Some((edit::width(work, operation)?, edit::widths(work, operation)?))
        })
    });
    let any = Memo::new(move |_| now.with(Option::is_some));
    let unit = || read(|m| m.frame.unit);
    let value = move || now.get().map(|(width, _)| number(unit().coordinate(width.mm()))).unwrap_or_default();
    let refused = last_refusal::<()>(value);
    let type_in = move |event| {
        let scale = if peek(|m| m.frame.unit == Unit::Inch) { 25.4 } else { 1.0 };
        let wanted = typed(&event_target_value(&event)).map(|number| Length::from_mm(number * scale));
        let after = shared(|m| &m.job.work).with_untracked(|work| edit::widened(work.as_ref()?, at, wanted?));
        refused.set(after.is_none().then_some(()));
        if let Some(after) = after {
            board::change_job(None, move |_| after);
        }
    };
    let why = move || {
        let (_, (low, high)) = now.get().filter(|_| refused.with(Option::is_some))?;
        let (low, high) = (unit().coordinate(low.mm()), unit().coordinate(high.mm()));
        let text = say!("page.cam.width_between", low = low, high = high, unit = crate::i18n::unit_word());
        Some(refusal_text(text))
    };
    move || {
        any.get().then(|| {
            let field = typed_input("decimal", value, move || refused.with(Option::is_some))
                .attr("id", "cam-width")
                .on(ev::change, type_in);
            div().class("setting").child((
                label().attr("for", "cam-width").child(t!("page.cam.width_wanted")),
                span().class("with-unit").child((field, span().child(crate::i18n::unit_word))),
                why,
            ))
        })
    }
}

fn bits() -> impl IntoView {
    let count = |m: &Model| m.job.work.as_ref().map_or(0, |work| work.bits.len());
    let chosen = RwSignal::new(0_usize);
    let which = Memo::new(move |_| {
        let form = shared(|m| &m.job.work).with(|work| {
            let bit = work.as_ref()?.bits.get(chosen.get())?;
            Some(std::mem::discriminant(&bit.cutter))
        });
        (chosen.get(), form)
    });
    let options = move || {
        (0..read(count))
            .map(|index| {
                let name = move || {
                    shared(|m| &m.job.work)
                        .with(|work| Some(work.as_ref()?.bits.get(index)?.name.clone()))
                        .unwrap_or_default()
                };
                option()
                    .attr("value", index.to_string())
                    .prop("selected", move || chosen.get() == index)
                    .child(name)
            })
            .collect::<Vec<_>>()
    };
    let rows = move || {
        let (at, _) = which.get();
        let bit = shared(|m| &m.job.work).with_untracked(|work| work.as_ref()?.bits.get(at).cloned());
        let rows = BIT.iter().filter(|row| bit.as_ref().is_some_and(|bit| row.get(bit).is_some()));
        rows.map(|row| bit_field(at, row)).collect::<Vec<_>>()
    };
    details().child((
        summary().child(t!("page.cam.bits")),
        div().class("setting-list").child((
            div().class("row").child((
                select()
                    .attr("aria-label", t!("page.cam.bits"))
                    .on(ev::change, move |event| chosen.set(event_target_value(&event).parse().unwrap_or(0)))
                    .child(options),
                push("button small", t!("page.cam.new_bit"), move |_| {
                    board::change_job(None, |work| {
                        let mut next: Work = work.clone();
                        next.bits.push(edit::new_bit(work));
                        next
                    });
                    chosen.set(peek(count).saturating_sub(1));
                }),
            )),
            rows,
        )),
    ))
}

fn bit_field(at: usize, row: &'static Field<Bit>) -> AnyView {
    let now = Memo::new(move |_| shared(|m| &m.job.work).with(|work| row.get(work.as_ref()?.bits.get(at)?)));
    let write = move |value| {
        let found = shared(|m| &m.job.work).with_untracked(|work| work.as_ref()?.bits.get(at).cloned());
        let Some(mut bit) = found else { return Ok(()) };
        row.set(&mut bit, &value)?;
        board::change_job(Some(row.key), |work| edit::bit_changed(work, at, bit));
        Ok(())
    };
    entry(row, now, None, Arc::new(write))
}
