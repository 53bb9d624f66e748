//! A field for one job parameter: name, unit, description, and why a typed value was rejected.

use crate::format::Unit;
use crate::i18n;
use crate::page::read;
use crate::widgets::{keyboard, last_refusal, menu_word, refusal, tick, typed_input};
use crate::workbench::edit;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::locale;
use annulus_core::machine::{Field, Value, ValueKind};
use leptos::ev;
use leptos::html::{div, input, label, select, small, span};
use leptos::prelude::*;

/// Writes a new value; fails with the reason.
pub(super) type Write = std::sync::Arc<dyn Fn(Value) -> Result<(), Diagnostic> + Send + Sync>;

/// The displayed name: the short one of the locale tables, else the description.
pub(crate) fn name_of(key: &str) -> String {
    let plain = key.replace('.', "_");
    let short = format!("page.cam.row.{plain}");
    let known = locale::lookup(&i18n::language(), &short).is_some();
    i18n::text(&if known { short } else { format!("work.{plain}") }, &[])
}

fn word_of(word: &str) -> String {
    i18n::text(&format!("page.cam.word.{word}"), &[])
}

/// The chosen unit if the parameter is a length; none for all others, which keep the unit of the table.
fn length_unit<T>(row: &Field<T>) -> Option<Unit> {
    let single = matches!(row.kind, ValueKind::Number(..));
    (row.unit == "mm" && single).then(|| read(|m| m.frame.unit))
}

fn unit_of<T>(row: &Field<T>) -> String {
    if length_unit(row).is_some() { i18n::unit_word() } else { i18n::unit_of(row.unit) }
}

fn shown<T>(row: &Field<T>, value: Option<&Value>) -> String {
    match value {
        Some(Value::Number(mm)) if length_unit(row) == Some(Unit::Inch) => {
            i18n::number(Unit::Inch.short(*mm))
        }
        Some(Value::Number(number)) => i18n::number(crate::format::plain(*number)),
        Some(Value::Text(text)) => text.clone(),
        Some(value) => i18n::number(value.to_string()),
        None => String::new(),
    }
}

/// The field. A number with a `slider` (minimum, maximum, step) has one under it.
pub(super) fn entry<T: 'static>(
    row: &'static Field<T>,
    now: Memo<Option<Value>>,
    slider: Option<(f64, f64, f64)>,
    write: Write,
) -> AnyView {
    let text = move || now.with(|now| shown(row, now.as_ref()));
    let refused = last_refusal::<Diagnostic>(text);
    let set = {
        let write = write.clone();
        move |text: String| {
            let unit = untrack(|| length_unit(row)).unwrap_or_default();
            refused.set(write(edit::value_in(row, &text, unit)).err());
        }
    };
    if matches!(row.kind, ValueKind::Choice(["no", "yes"])) {
        return flag(row, now, write);
    }
    let sentence = row.sentence_key();
    let id = format!("work-{}", row.key.replace('.', "-"));
    let control = match row.kind {
        ValueKind::Choice(words) => {
            let is = move |word: &str| now.with(|now| matches!(now, Some(Value::Text(now)) if now == word));
            let options =
                words.iter().copied().map(|word| menu_word(word, move || is(word), move || word_of(word)));
            select()
                .attr("id", id.clone())
                .on(ev::change, move |event| set(event_target_value(&event)))
                .child(options.collect::<Vec<_>>())
                .into_any()
        }
        kind => typed_input(keyboard(kind), text, move || refused.with(Option::is_some))
            .attr("id", id.clone())
            .attr("aria-describedby", format!("{id}-help"))
            .on(ev::change, move |event| set(event_target_value(&event)))
            .into_any(),
    };
    let track = slider.map(|range| self::slider(row, now, range, write));
    div()
        .class("setting")
        .child((
            label().attr("for", id.clone()).child(move || name_of(row.key)),
            span().class("with-unit").child((control, span().child(move || unit_of(row)))),
            track,
            small()
                .attr("id", format!("{id}-help"))
                .class("unseen")
                .child(move || i18n::text(&sentence, &[])),
            move || refused.get().map(refusal),
        ))
        .into_any()
}

fn slider<T: 'static>(
    row: &'static Field<T>,
    now: Memo<Option<Value>>,
    (low, high, step): (f64, f64, f64),
    write: Write,
) -> impl IntoView {
    let number = move || now.with(|now| if let Some(Value::Number(number)) = now { *number } else { low });
    input()
        .attr("type", "range")
        .attr("min", low.to_string())
        .attr("max", high.to_string())
        .attr("step", step.to_string())
        .attr("aria-label", move || name_of(row.key))
        .attr("aria-valuetext", move || {
            format!("{} {}", shown(row, Some(&Value::Number(number()))), unit_of(row))
        })
        .prop("value", move || number().to_string())
        .on(ev::input, move |event| {
            if let Ok(number) = event_target_value(&event).parse() {
                let _out_of_range_is_not_taken = write(Value::Number(number));
            }
        })
}

fn flag<T: 'static>(row: &'static Field<T>, now: Memo<Option<Value>>, write: Write) -> AnyView {
    let yes = move || now.with(|now| matches!(now, Some(Value::Text(word)) if word == "yes"));
    let set = move |on| {
        let word = if on { "yes" } else { "no" };
        let _every_flag_knows_both = write(Value::Text(word.to_owned()));
    };
    tick(yes, move || name_of(row.key), set).into_any()
}
