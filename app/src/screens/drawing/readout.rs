//! The bar below the picture: the aim, a field for coordinates, the measurement, and the smallest gap, track
//! and ring.
//!
//! Its height is fixed: a change of height would move the picture under the pointer.

use super::{focus, focus_picture};
use crate::drawing::Doing;
use crate::i18n::{number, say, sentence, t, unit_word};
use crate::keys::is_escape;
use crate::model::DrawEvent;
use crate::model::drawing::Least;
use crate::page::{peek, read, send, watch};
use crate::widgets::push;
use annulus_core::units::Length;
use leptos::ev::{self, KeyboardEvent};
use leptos::html::{div, form, input, label, p, span};
use leptos::prelude::*;
use wasm_bindgen::JsCast;
use web_sys::HtmlInputElement;

const PLACE: &str = "draw-place";

fn field() -> Option<HtmlInputElement> {
    document().get_element_by_id(PLACE)?.dyn_into().ok()
}

/// Focuses the coordinates field; puts `@` in it for relative coordinates.
pub(super) fn type_place(by: bool) {
    if let Some(field) = field() {
        field.set_value(if by { "@" } else { "" });
    }
    focus(&format!("#{PLACE}"));
}

pub(super) fn readout() -> impl IntoView {
    let said = move || watch(|m| &m.draw.editor.said).get().map(|text| sentence(&text));
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
        if peek(|m| m.draw.editor.said.is_none()) {
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
                    // Wait a frame, until the field has handled the key.
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
    number(read(|m| m.frame.unit).size(length.mm()))
}

fn aim() -> String {
    let (at, unit) = (read(|m| m.draw.editor.aim.at()), read(|m| m.frame.unit));
    say!(
        "page.status.cursor",
        x = unit.coordinate(at.x.mm()),
        y = unit.coordinate(at.y.mm()),
        unit = unit_word()
    )
}

fn measured() -> Option<String> {
    let aim = read(|m| m.draw.editor.aim.at());
    let (from, to) = match watch(|m| &m.draw.editor.doing).get() {
        Doing::Measure { from, to } => (from, to.unwrap_or(aim)),
        Doing::Track { from, .. } => (from, aim),
        _ => return None,
    };
    let [length, x, y] = read(|m| m.frame.unit).apart(from, to);
    Some(say!("page.draw.measured", length = length, x = x, y = y, unit = unit_word()))
}

/// The smallest gap, track, ring and hole. Pressing one shows it.
fn figures() -> impl IntoView {
    let smallest = watch(|m| &m.draw.editor.smallest);
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
                move |_| send(DrawEvent::Find { least }),
            )
        })
    }
}
