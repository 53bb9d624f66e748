//! Fields for typed values: one look, one way to refuse a text. Numbers have a decimal point or a comma.

use super::Flag;
use crate::format::{plain, typed_in};
use crate::i18n::{Words, advice, message, say};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::locale::has_two_marks;
use annulus_core::machine::ValueKind;
use leptos::html::{self, HtmlElement, input, label, p, span};
use leptos::prelude::*;
use leptos::tachys::html::attribute::Attribute;
use leptos::tachys::view::RenderHtml;

/// An input for a typed value, marked while its text is refused. `mode` is as in [`keyboard`].
pub fn typed_input(
    mode: &'static str,
    text: impl Fn() -> String + Send + Sync + 'static,
    is_wrong: impl Fn() -> bool + Send + Sync + 'static,
) -> HtmlElement<html::Input, impl Attribute, ()> {
    let (text, is_wrong): (Words, Flag) = (Box::new(text), Box::new(is_wrong));
    input()
        .attr("type", "text")
        .attr("inputmode", mode)
        .attr("autocomplete", "off")
        .attr("aria-invalid", move || is_wrong().then_some("true"))
        .prop("value", text)
}

/// The keyboard of a phone for values of this kind.
pub fn keyboard(kind: ValueKind) -> &'static str {
    if matches!(kind, ValueKind::Text(_)) { "text" } else { "decimal" }
}

/// An input with its name, its unit, and why its text is refused.
pub fn number_field<At: Attribute + 'static>(
    class: &'static str,
    id: String,
    name: impl Fn() -> String + Send + Sync + 'static,
    unit: impl Fn() -> String + Send + Sync + 'static,
    input: HtmlElement<html::Input, At, ()>,
    why: Signal<Option<String>>,
) -> AnyView {
    let (name, unit): (Words, Words) = (Box::new(name), Box::new(unit));
    let (name_id, unit_id, why_id) = (format!("{id}-name"), format!("{id}-unit"), format!("{id}-why"));
    let described = why_id.clone();
    // The refusal is read apart: the label would join it to the name.
    let input = input
        .attr("id", id.clone())
        .attr("aria-labelledby", format!("{name_id} {unit_id}"))
        .attr("aria-describedby", move || why.with(Option::is_some).then(|| described.clone()));
    let refused = move || why.get().map(|why| refusal_text(why).attr("id", why_id.clone()));
    label()
        .class(class)
        .attr("for", id)
        .child((
            span().attr("id", name_id).child(name),
            span().class("with-unit").child((input, span().attr("id", unit_id).child(unit))),
            refused,
        ))
        .into_any()
}

/// Why `text` isn't a number from `low` to `high`.
pub fn number_refusal(text: &str, (low, high): (f64, f64)) -> Option<String> {
    typed_in(text, (low, high)).is_none().then(|| {
        if has_two_marks(text) {
            say!("queue.two_marks.advice")
        } else {
            say!("page.lab.number", low = plain(low), high = plain(high))
        }
    })
}

/// Why the last typed text was refused, until the value changes.
pub fn last_refusal<T: Send + Sync + 'static>(value: impl Fn() -> String + 'static) -> RwSignal<Option<T>> {
    let refused = RwSignal::new(None);
    Effect::new(move |_| {
        let _ = value();
        refused.set(None);
    });
    refused
}

/// A sentence about what is refused.
pub fn refusal_text(why: String) -> HtmlElement<html::P, impl Attribute, impl RenderHtml> {
    p().class("refusal").attr("role", "alert").child(why)
}

/// Why something is refused, and how to fix it.
pub fn refusal(why: Diagnostic) -> AnyView {
    let fix = why.clone();
    let text = (move || message(&why), " ", move || advice(&fix));
    p().class("refusal").attr("role", "alert").child(text).into_any()
}
