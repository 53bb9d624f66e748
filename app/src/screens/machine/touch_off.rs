//! Touching off, step by step, next to the jog pad. Only *Touch* moves the machine.
//!
//! ```text
//!  [↘][ ↓ ][↙]    points of the board seen from above: corners, edges; in the middle, its height
//!  [→][ ⊙ ][←]    the arrow is the direction in which the tip moves
//!  [↗][ ↑ ][↖]
//! ```

use crate::i18n::{Words, say, t, unit_of};
use crate::model::touch_off::TYPED_MM;
use crate::model::{TouchOff, TouchOffEvent, TouchTarget, TouchedPart};
use crate::page::{link, send, watch};
use crate::widgets::{number_field, number_refusal, push_guarded, typed_input};
use leptos::ev;
use leptos::html::{button, details, div, p, summary};
use leptos::prelude::*;
use leptos::svg::{circle, path, rect, svg};

pub(super) fn touch_off() -> impl IntoView {
    let touch = watch(|m| &m.touch_off);
    let target = Memo::new(move |_| touch.with(|touch| touch.target));
    let next = Memo::new(move |_| touch.with(|touch| touch.next()));
    let rows = [1, 0, -1].map(|y| [-1, 0, 1].map(|x| place(target, TouchTarget { x, y })).collect_view());
    let heights = move || target.get() == TouchTarget::default();
    let measure = move || if heights() { plate().into_any() } else { tool().into_any() };
    let ready = move || link::ready() && touch.with(|touch| touch.wish(false).is_some());
    let word = move || match next.get() {
        Some(TouchedPart::Edge { axis: 0, .. }) => say!("page.touch.touch_x"),
        Some(TouchedPart::Edge { .. }) => say!("page.touch.touch_y"),
        _ => say!("page.touch.touch_z"),
    };
    details().class("touch-off").child((
        summary().child(t!("page.touch.title")),
        div()
            .class("places")
            .attr("role", "group")
            .attr("aria-label", t!("page.touch.which"))
            .child(Vec::from(rows)),
        move || picture(target.get(), next.get()),
        p().attr("role", "status").child(move || step(next.get())),
        measure,
        push_guarded("button", || "touch", ready, word, |_| send(TouchOffEvent::Touch)),
    ))
}

fn place(target: Memo<TouchTarget>, own: TouchTarget) -> impl IntoView {
    const ARROWS: [[&str; 3]; 3] = [["↗", "↑", "↖"], ["→", "⊙", "←"], ["↘", "↓", "↙"]];
    let index = |side: i8| usize::from((side + 1).unsigned_abs());
    let arrow = ARROWS[index(own.y)][index(own.x)];
    let name = move || match (own.x, own.y) {
        (0, 0) => say!("page.touch.height"),
        (-1, 0) => say!("page.touch.left"),
        (1, 0) => say!("page.touch.right"),
        (0, -1) => say!("page.touch.front"),
        (0, 1) => say!("page.touch.back"),
        (-1, -1) => say!("page.touch.front_left"),
        (1, -1) => say!("page.touch.front_right"),
        (-1, 1) => say!("page.touch.back_left"),
        _ => say!("page.touch.back_right"),
    };
    button()
        .attr("type", "button")
        .class("button small")
        .attr("aria-label", name)
        .attr("title", name)
        .attr("aria-pressed", move || if target.get() == own { "true" } else { "false" })
        .on(ev::click, move |_| send(TouchOffEvent::Target { target: own }))
        .child(arrow)
}

fn step(next: Option<TouchedPart>) -> String {
    match next {
        None => say!("page.touch.done"),
        Some(TouchedPart::Height) => say!("page.touch.over"),
        Some(TouchedPart::Edge { axis: 0, up: true }) => say!("page.touch.beside_left"),
        Some(TouchedPart::Edge { axis: 0, up: false }) => say!("page.touch.beside_right"),
        Some(TouchedPart::Edge { up: true, .. }) => say!("page.touch.beside_front"),
        Some(TouchedPart::Edge { up: false, .. }) => say!("page.touch.beside_back"),
    }
}

/// The board from above, the start position of the tip, and its direction.
fn picture(target: TouchTarget, next: Option<TouchedPart>) -> impl IntoView + use<> {
    let middle = [60.0 + 40.0 * f64::from(target.x), 40.0 - 25.0 * f64::from(target.y)];
    let (tip, way) = match next {
        Some(TouchedPart::Edge { axis: 0, up }) => {
            let out = if up { -1.0 } else { 1.0 };
            ([middle[0] + 16.0 * out, 40.0 - 15.0 * f64::from(target.y)], [-10.0 * out, 0.0])
        }
        Some(TouchedPart::Edge { up, .. }) => {
            let out = if up { 1.0 } else { -1.0 };
            ([60.0 + 28.0 * f64::from(target.x), middle[1] + 13.0 * out], [0.0, -8.0 * out])
        }
        _ => (middle, [0.0, 0.0]),
    };
    let shaft = format!("M{} {}l{} {}", tip[0], tip[1], way[0], way[1]);
    svg().attr("class", "touched-board").attr("viewBox", "0 0 120 80").attr("aria-hidden", "true").child((
        rect().attr("x", 20).attr("y", 15).attr("width", 80).attr("height", 50),
        path().attr("d", shaft),
        circle().attr("cx", tip[0]).attr("cy", tip[1]).attr("r", 4),
    ))
}

fn length(
    id: &'static str,
    name: Words,
    text: fn(&TouchOff) -> &String,
    event: fn(String) -> TouchOffEvent,
) -> impl IntoView {
    let text = Memo::new(move |_| watch(|m| &m.touch_off).with(|touch| text(touch).clone()));
    let why = Memo::new(move |_| text.with(|text| number_refusal(text, TYPED_MM)));
    let input = typed_input("decimal", move || text.get(), move || why.with(Option::is_some))
        .on(ev::input, move |typed| send(event(event_target_value(&typed))));
    number_field("setting", id.to_owned(), name, || unit_of("mm"), input, why.into())
}

fn tool() -> impl IntoView {
    length("touch-tool", t!("page.touch.tool"), |touch| &touch.tool, |text| TouchOffEvent::Tool { text })
}

fn plate() -> impl IntoView {
    length("touch-plate", t!("page.touch.plate"), |touch| &touch.plate, |text| TouchOffEvent::Plate { text })
}
