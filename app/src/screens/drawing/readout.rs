//! Below the picture: where the tool aims, a place to be typed, what is measured, and the smallest gap, track and ring.
//!
//! Comes in: aim, measure, figures. Goes out: typed places; which of the smallest is to be shown. It is as high whatever it says:
//! the picture above it must not move under the pointer.

use super::{focus, focus_picture};
use crate::drawing::Doing;
use crate::i18n::{number, say, sentence, t, unit_word};
use crate::keys::is_escape;
use crate::model::DrawEvent;
use crate::model::drawing::Least;
use crate::page::{frame, open_drawing, send};
use crate::widgets::push;
use annulus_core::units::Length;
use leptos::ev::{self, KeyboardEvent};
use leptos::html::{div, form, input, label, p, span};
use leptos::prelude::*;
use wasm_bindgen::JsCast;
use web_sys::HtmlInputElement;

/// The id of the field.
const PLACE: &str = "draw-place";

fn field() -> Option<HtmlInputElement> {
    document().get_element_by_id(PLACE)?.dyn_into().ok()
}

/// The focus goes to the field, with the sign that counts from the last place where that is wanted.
pub(super) fn type_place(by: bool) {
    if let Some(field) = field() {
        field.set_value(if by { "@" } else { "" });
    }
    focus(&format!("#{PLACE}"));
}

/// The line.
pub(super) fn readout() -> impl IntoView {
    let drawing = open_drawing();
    let said = move || drawing.said.get().map(|text| sentence(&text));
    div().class("draw-readout").attr("role", "region").attr("aria-label", t!("page.draw.readout")).child((
        div().class("row").child((
            typed_place(),
            span().class("tabular").child(aim),
            span().class("tabular draw-measured").child(measured),
        )),
        figures(),
        p().class("draw-said").attr("role", "status").child(said),
    ))
}

fn typed_place() -> impl IntoView {
    let take = move |event: web_sys::SubmitEvent| {
        event.prevent_default();
        let Some(field) = field() else { return };
        send(DrawEvent::Typed { text: field.value() });
        if open_drawing().said.get_untracked().is_none() {
            field.set_value("");
        }
    };
    form().class("row").on(ev::submit, take).child((
        label().attr("for", PLACE).child(t!("page.draw.place")),
        input()
            .attr("type", "text")
            .attr("id", PLACE)
            .attr("autocomplete", "off")
            .attr("placeholder", "x 10 y 5")
            .attr("aria-describedby", "draw-place-how")
            .on(ev::keydown, |event: KeyboardEvent| {
                if is_escape(&event.key()) {
                    // The key is through with the field by then.
                    request_animation_frame(focus_picture);
                }
            }),
        span().class("unseen").attr("id", "draw-place-how").child(t!("page.draw.place_how")),
        push("button", t!("page.draw.put"), |_| {
            if let Some(field) = field() {
                send(DrawEvent::Typed { text: field.value() });
            }
        }),
    ))
}

fn size(length: Length) -> String {
    number(frame().unit.get().size(length.mm()))
}

fn aim() -> String {
    let (at, unit) = (open_drawing().aim.get(), frame().unit.get());
    say!(
        "page.status.cursor",
        x = unit.coordinate(at.x.mm()),
        y = unit.coordinate(at.y.mm()),
        unit = unit_word()
    )
}

/// The measure, or how long the piece of track is that is being drawn.
fn measured() -> Option<String> {
    let aim = open_drawing().aim.get();
    let (from, to) = match open_drawing().doing.get() {
        Doing::Measure { from, to } => (from, to.unwrap_or(aim)),
        Doing::Track { from, .. } => (from, aim),
        _ => return None,
    };
    let [length, x, y] = frame().unit.get().apart(from, to);
    Some(say!("page.draw.measured", length = length, x = x, y = y, unit = unit_word()))
}

/// The smallest gap, track, ring and hole; pressed, it is shown.
fn figures() -> impl IntoView {
    let smallest = open_drawing().smallest;
    let gap = move || {
        smallest.get().gap.map(|(gap, ..)| say!("page.draw.least.gap", size = size(gap), unit = unit_word()))
    };
    let track = move || {
        smallest
            .get()
            .track
            .map(|(track, _)| say!("page.draw.least.track", size = size(track), unit = unit_word()))
    };
    let ring = move || {
        smallest
            .get()
            .ring
            .map(|(ring, _)| say!("page.draw.least.ring", size = size(ring), unit = unit_word()))
    };
    let hole = move || {
        smallest
            .get()
            .hole
            .map(|(hole, _)| say!("page.draw.least.hole", size = size(hole), unit = unit_word()))
    };
    div().class("row draw-least").child((
        least(Least::Gap, gap),
        least(Least::Track, track),
        least(Least::Ring, ring),
        least(Least::Hole, hole),
    ))
}

fn least(least: Least, words: impl Fn() -> Option<String> + Copy + Send + Sync + 'static) -> impl IntoView {
    let there = Memo::new(move |_| words().is_some());
    move || {
        there.get().then(|| {
            push(
                "button small quiet tabular",
                move || words().unwrap_or_default(),
                move |_| {
                    send(DrawEvent::Find { least });
                },
            )
        })
    }
}
