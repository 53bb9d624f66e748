//! How a controller's tool lengths are measured, stored per machine: against the board, or on a tool setter.
//! Moves nothing.

use crate::format::{plain, typed};
use crate::i18n::{self, t};
use crate::page::{link, peek, read};
use crate::widgets::{last_refusal, menu_word, number_field, push_if, typed_input};
use annulus_core::control::Trust;
use annulus_core::grbl::{LENGTH_KEY, SETTER_KEY, ToolLengths, ToolSetter};
use annulus_core::machine::Value;
use annulus_core::wire::Ask;
use leptos::ev;
use leptos::html::{div, label, p, select, span};
use leptos::prelude::*;
use leptos::svg::{path, rect, svg};

fn keep(key: &str, value: Value) {
    link::ask(Ask::Configure { changes: vec![(key.to_owned(), value)] });
}

pub(super) fn lengths() -> impl IntoView {
    let now = Memo::new(move |_| {
        let told = read(|m| m.link.controller.who.as_ref().map(|who| who.lengths));
        told.unwrap_or_default()
    });
    let on_setter = Memo::new(move |_| now.get().on_setter);
    let choose = |event: web_sys::Event| keep(LENGTH_KEY, Value::Text(event_target_value(&event)));
    let words = move || {
        (
            menu_word("board", move || !on_setter.get(), t!("page.lengths.board")),
            menu_word("setter", move || on_setter.get(), t!("page.lengths.setter")),
        )
    };
    let chosen = move || if on_setter.get() { setter(now).into_any() } else { against_board().into_any() };
    div().class("lengths").child((
        label().class("field").child((
            span().child(t!("page.lengths.title")),
            select()
                .attr("name", "tool-length")
                .prop("disabled", || !link::may_change())
                .on(ev::change, choose)
                .child(words()),
        )),
        chosen,
    ))
}

fn against_board() -> impl IntoView {
    let picture =
        svg().attr("class", "touched-board").attr("viewBox", "0 0 160 90").attr("aria-hidden", "true");
    let picture = picture.child((
        spindle(35, 10),
        spindle(105, 24),
        path().attr("d", "M45 34V68M115 48V68"),
        rect().attr("x", 10).attr("y", 68).attr("width", 140).attr("height", 12),
    ));
    div().class("length-picture").child((picture, p().class("quiet").child(t!("page.lengths.board_is"))))
}

fn spindle(x: i32, y: i32) -> impl IntoView {
    rect().attr("x", x).attr("y", y).attr("width", 20).attr("height", 24)
}

/// A tool on the setter, the height of the setter above the board, and the six values.
fn setter(now: Memo<ToolLengths>) -> impl IntoView {
    let known = Memo::new(move |_| now.get().setter.is_some());
    let picture =
        svg().attr("class", "touched-board").attr("viewBox", "0 0 160 90").attr("aria-hidden", "true");
    let picture = picture.child((
        spindle(35, 20),
        spindle(115, 6),
        path().attr(
            "d",
            "M45 44V68M125 30V54M96 54H114M96 68H90M93 54V68M93 54l-3 4M93 54l3 4M93 68l-3 -4M93 68l3 -4",
        ),
        rect().attr("x", 10).attr("y", 68).attr("width", 78).attr("height", 12),
        rect().attr("x", 118).attr("y", 54).attr("width", 14).attr("height", 26),
        rect().attr("x", 106).attr("y", 80).attr("width", 38).attr("height", 4),
    ));
    let stands =
        move || read(|m| m.link.status.as_ref().is_some_and(|status| status.trust == Trust::Trusted));
    let may = move || link::ready() && stands();
    let fields = move || {
        known.get().then(|| {
            div().class("setting-grid").child((
                number(now, 0, t!("page.lengths.x"), "mm"),
                number(now, 1, t!("page.lengths.y"), "mm"),
                number(now, 2, t!("page.lengths.from"), "mm"),
                number(now, 3, t!("page.lengths.depth"), "mm"),
                number(now, 4, t!("page.lengths.fast"), "mm/min"),
                number(now, 5, t!("page.lengths.slow"), "mm/min"),
            ))
        })
    };
    div().class("lengths").child((
        div()
            .class("length-picture")
            .child((picture, p().class("quiet").child(t!("page.lengths.setter_is")))),
        push_if("button", may, t!("page.lengths.here"), move |_| here(now)),
        p().class("quiet").child(t!("page.lengths.here_is")),
        fields,
    ))
}

/// Takes the current position for the setter: X and Y of its pin, and Z as the start height of the probe
/// move.
fn here(now: Memo<ToolLengths>) {
    let at = peek(|m| m.link.status.as_ref().map(|status| status.machine_mm));
    let Some([x, y, z]) = at else { return };
    let setter = match now.get_untracked().setter {
        Some(setter) => ToolSetter { place_mm: [x, y], from_mm: z, ..setter },
        None => ToolSetter::usual([x, y], z),
    };
    keep(SETTER_KEY, Value::Numbers(setter.numbers().to_vec()));
}

/// One of the six values. An invalid text is rejected with a message.
fn number(
    now: Memo<ToolLengths>,
    index: usize,
    name: impl Fn() -> String + Send + Sync + 'static,
    unit: &'static str,
) -> impl IntoView {
    let shown = move || {
        let number = now.get().setter.map(|setter| setter.numbers()[index]);
        number.map(|number| i18n::number(plain(number))).unwrap_or_default()
    };
    let wrong = last_refusal::<()>(shown);
    let write = move |event: web_sys::Event| {
        let typed = typed(&event_target_value(&event));
        wrong.set(typed.is_none().then_some(()));
        // Pass even unfit text on: the answer is a message.
        let numbers = now.get_untracked().setter.zip(typed).map(|(setter, typed)| {
            let mut numbers = setter.numbers();
            numbers[index] = typed;
            numbers.to_vec()
        });
        keep(SETTER_KEY, Value::Numbers(numbers.unwrap_or_default()));
    };
    let input = typed_input("decimal", shown, move || wrong.with(Option::is_some))
        .prop("disabled", || !link::may_change())
        .on(ev::change, write);
    let id = format!("setter-{index}");
    number_field("setting", id, name, move || unit.to_owned(), input, Signal::derive(|| None))
}
