//! The dialog that repeats the selection in columns and rows.

use crate::drawing::{Act, typed};
use crate::format::typed_whole;
use crate::i18n::{key, say, t, text, unit_word};
use crate::model::{DrawEvent, FrameEvent, Overlay};
use crate::page::{read, send};
use crate::widgets::{Dialog, dialog, number_field, push, push_if, typed_input};
use annulus_core::geometry::Point;
use annulus_core::units::Length;
use leptos::ev;
use leptos::html::{div, p};
use leptos::prelude::*;

const MOST: u32 = 1_000;

pub(super) fn open() {
    send(FrameEvent::Overlay { overlay: Some(Overlay::Array) });
}

fn close() {
    send(FrameEvent::Overlay { overlay: None });
}

fn count(text: &str) -> Option<u32> {
    typed_whole(text, (1, MOST))
}

fn field(
    id: &'static str,
    name: &'static str,
    typed: RwSignal<String>,
    unit: fn() -> String,
    fits: fn(&str) -> bool,
) -> impl IntoView {
    let input = typed_input("decimal", move || typed.get(), move || !typed.with(|text| fits(text)))
        .on(ev::input, move |event| typed.set(event_target_value(&event)));
    // The dialog says once what is wrong.
    number_field("field", id.to_owned(), move || text(name, &[]), unit, input, Signal::derive(|| None))
}

fn length(text: &str) -> Option<Length> {
    typed::length(text, read(|m| m.frame.unit))
}

pub(super) fn array() -> impl IntoView {
    let texts = ["4", "1", "2.54", "2.54"].map(|text| RwSignal::new(text.to_owned()));
    let [columns, rows, x, y] = texts;
    let act = move || {
        let counts = (columns.with(|text| count(text))?, rows.with(|text| count(text))?);
        let step = Point::new(x.with(|text| length(text))?, y.with(|text| length(text))?);
        Some(Act::Array { columns: counts.0, rows: counts.1, step })
    };
    let body = div().class("field-pairs").child((
        field("array-columns", key!("page.draw.array.columns"), columns, String::new, |text| {
            count(text).is_some()
        }),
        field("array-rows", key!("page.draw.array.rows"), rows, String::new, |text| count(text).is_some()),
        field("array-x", key!("page.draw.array.x"), x, unit_word, |text| length(text).is_some()),
        field("array-y", key!("page.draw.array.y"), y, unit_word, |text| length(text).is_some()),
    ));
    let why = move || act().is_none().then(|| say!("page.draw.array.wrong", most = MOST));
    let body = (body, p().class("refusal").attr("role", "status").child(why));
    let make = move |_| {
        if let Some(act) = untrack(act) {
            send(DrawEvent::Act { act });
            close();
        }
    };
    dialog(
        Signal::derive(move || read(|m| m.frame.overlay == Some(Overlay::Array))),
        close,
        Dialog {
            name: "array",
            role: "dialog",
            title: Box::new(t!("page.draw.array.title")),
            body: body.into_any(),
            foot: (
                push("button", t!("page.cancel"), |_| close()),
                push_if("button primary", move || act().is_some(), t!("page.draw.array.make"), make),
            )
                .into_any(),
        },
    )
}
