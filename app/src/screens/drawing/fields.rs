//! The properties of the selection as fields.

use super::inputs::{LAYERS, SHAPES, labelled, length, typed_field, word};
use crate::drawing::fields::{Field, FieldRow, FieldValue};
use crate::drawing::typed;
use crate::i18n::{self, key, number, t};
use crate::model::DrawEvent;
use crate::page::{read, send, shared, watch};
use crate::widgets::tick;
use annulus_core::board::drawing::Id;
use leptos::ev;
use leptos::html::{self, div, h2, header, p, section, select, span};
use leptos::prelude::*;
use wasm_bindgen::JsCast;
use web_sys::HtmlInputElement;

pub(super) fn fields() -> impl IntoView {
    let names = Memo::new(move |_| {
        shared(|m| &m.draw.shown.fields).with(|rows| rows.iter().map(|row| row.field).collect::<Vec<Field>>())
    });
    let count = move || watch(|m| &m.draw.editor.chosen).with(std::collections::BTreeSet::len);
    let title = move || match count() {
        0 => i18n::text(key!("page.draw.drawing"), &[]),
        count => i18n::text(key!("page.draw.chosen"), &[("count", count.to_string())]),
    };
    let lines = move || names.get().into_iter().filter_map(row).collect::<Vec<_>>();
    section().class("block draw-fields").attr("aria-label", t!("page.draw.numbers")).child((
        header().child(h2().child(title)),
        div().class("field-pairs").child(lines),
        move || (count() == 0).then(|| p().class("quiet").child(t!("page.draw.hint"))),
    ))
}

/// Focuses the name field of the group, or of the drawing if nothing is selected, with its text selected.
pub(super) fn rename() {
    let field = document().get_element_by_id(&format!("draw-{}", Field::Name.word()));
    if let Some(field) = field.and_then(|field| field.dyn_into::<HtmlInputElement>().ok()) {
        let _ = field.focus();
        field.select();
    }
}

fn row(field: Field) -> Option<AnyView> {
    let value = Memo::new(move |_| {
        let own = |row: &&FieldRow| row.field == field;
        shared(|m| &m.draw.shown.fields).with(|rows| rows.iter().find(own).map(|row| row.value.clone()))
    });
    let id = format!("draw-{}", field.word());
    let set = move |text: String| send(DrawEvent::Set { field, text });
    let now = move || value.get();
    Some(match value.get_untracked()? {
        FieldValue::Length(_) => {
            let value = move || if let Some(FieldValue::Length(length)) = now() { length } else { None };
            length(id, field, Signal::derive(value), set).into_any()
        }
        FieldValue::Fixed(_) => {
            let text = move || match now() {
                Some(FieldValue::Fixed(Some(length))) => number(read(|m| m.frame.unit).short(length.mm())),
                _ => String::new(),
            };
            div()
                .class("field")
                .child((
                    span().child(move || i18n::text(word(field), &[])),
                    span().class("tabular").child(text),
                ))
                .into_any()
        }
        FieldValue::Turn(_) => {
            let text = move || match now() {
                Some(FieldValue::Turn(Some(mdeg))) => number(crate::format::plain(f64::from(mdeg) / 1_000.0)),
                _ => String::new(),
            };
            let fits = |text: &str| typed::degrees(text).is_some();
            typed_field(id, field, Signal::derive(text), || "°".to_owned(), fits, set).into_any()
        }
        FieldValue::Name(_) => {
            let text = move || if let Some(FieldValue::Name(name)) = now() { name } else { String::new() };
            typed_field(id, field, Signal::derive(text), String::new, |_| true, set).into_any()
        }
        FieldValue::Flag(_) => {
            let on = move || now() == Some(FieldValue::Flag(Some(true)));
            tick(on, move || i18n::text(word(field), &[]), move |on| set(on.to_string())).into_any()
        }
        FieldValue::Layer(_) => {
            let layer = move || if let Some(FieldValue::Layer(layer)) = now() { layer } else { None };
            labelled(id.clone(), field, LAYERS.menu(id, layer, set)).into_any()
        }
        FieldValue::Shape(_) => {
            let shape = move || if let Some(FieldValue::Shape(shape)) = now() { shape } else { None };
            labelled(id.clone(), field, SHAPES.menu(id, shape, set)).into_any()
        }
        FieldValue::Group(..) => labelled(id.clone(), field, group_menu(id, value, set)).into_any(),
    })
}

fn group_menu(id: String, value: Memo<Option<FieldValue>>, act: impl Fn(String) + 'static) -> impl IntoView {
    let options = move || {
        let Some(FieldValue::Group(now, groups)) = value.get() else { return Vec::new() };
        let one = |id: Option<Id>, name: String| {
            let word = id.map_or_else(String::new, |id| id.0.to_string());
            html::option().attr("value", word).prop("selected", now == Some(id)).child(name)
        };
        let none = one(None, i18n::text(key!("page.draw.no_group"), &[]));
        std::iter::once(none)
            .chain(groups.into_iter().map(|(id, name)| one(Some(id), name)))
            .collect::<Vec<_>>()
    };
    select().attr("id", id).on(ev::change, move |event| act(event_target_value(&event))).child(options)
}
