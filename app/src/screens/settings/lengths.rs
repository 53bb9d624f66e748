//! How a controller's tool lengths are measured, stored per machine: against the board, or on a tool setter.
//! Staged like the machine's own settings. Moves nothing.

use super::controller::{menu, own_text, stage};
use crate::format::{plain, typed};
use crate::i18n::{self, t};
use crate::model::settings::is_about;
use crate::page::{link, peek, read, watch};
use crate::widgets::{menu_word, number_field, push_if, refusal, typed_input};
use annulus_core::control::Trust;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::grbl::{LENGTH_KEY, SETTER_KEY, ToolSetter};
use leptos::ev;
use leptos::html::{div, p};
use leptos::prelude::*;
use leptos::svg::{path, rect, svg};

/// Count of a tool setter's numbers.
const NUMBERS: usize = 6;

pub(super) fn lengths(refused: Memo<Vec<Diagnostic>>) -> impl IntoView {
    let on_setter = Memo::new(move |_| own_text(LENGTH_KEY) == "setter");
    let words = vec![
        menu_word("board", move || !on_setter.get(), t!("page.lengths.board")).into_any(),
        menu_word("setter", move || on_setter.get(), t!("page.lengths.setter")).into_any(),
    ];
    let chosen =
        move || if on_setter.get() { setter(refused).into_any() } else { against_board().into_any() };
    div()
        .class("lengths")
        .child((menu(LENGTH_KEY, t!("page.lengths.title"), t!("page.lengths.title_is"), words), chosen))
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
fn setter(refused: Memo<Vec<Diagnostic>>) -> impl IntoView {
    let known = Memo::new(move |_| !own_text(SETTER_KEY).is_empty());
    let why = Memo::new(move |_| {
        refused.with(|refused| refused.iter().find(|why| is_about(why, SETTER_KEY)).cloned())
    });
    let stands =
        move || read(|m| m.link.status.as_ref().is_some_and(|status| status.trust == Trust::Trusted));
    let may = move || link::ready() && stands();
    let fields = move || {
        known.get().then(|| {
            div().class("setting-grid").child((
                number(0, t!("page.lengths.x"), "mm"),
                number(1, t!("page.lengths.y"), "mm"),
                number(2, t!("page.lengths.from"), "mm"),
                number(3, t!("page.lengths.depth"), "mm"),
                number(4, t!("page.lengths.fast"), "mm/min"),
                number(5, t!("page.lengths.slow"), "mm/min"),
            ))
        })
    };
    div().class("lengths").child((
        div()
            .class("length-picture")
            .child((setter_picture(), p().class("quiet").child(t!("page.lengths.setter_is")))),
        push_if("button", may, t!("page.lengths.here"), |_| here()),
        p().class("quiet").child(t!("page.lengths.here_is")),
        fields,
        move || why.get().map(refusal),
    ))
}

fn setter_picture() -> impl IntoView {
    svg().attr("class", "touched-board").attr("viewBox", "0 0 160 90").attr("aria-hidden", "true").child((
        spindle(35, 20),
        spindle(115, 6),
        path().attr(
            "d",
            "M45 44V68M125 30V54M96 54H114M96 68H90M93 54V68M93 54l-3 4M93 54l3 4M93 68l-3 -4M93 68l3 -4",
        ),
        rect().attr("x", 10).attr("y", 68).attr("width", 78).attr("height", 12),
        rect().attr("x", 118).attr("y", 54).attr("width", 14).attr("height", 26),
        rect().attr("x", 106).attr("y", 80).attr("width", 38).attr("height", 4),
    ))
}

/// The six texts: as typed, else the present numbers in the page's language.
fn texts() -> Vec<String> {
    let is_typed = watch(|m| &m.settings).with(|draft| draft.typed.contains_key(SETTER_KEY));
    let all = own_text(SETTER_KEY);
    let one = |text: &str| if is_typed { text.to_owned() } else { i18n::number(text) };
    let mut texts: Vec<_> = all.split('\n').map(one).collect();
    texts.resize(NUMBERS, String::new());
    texts
}

/// Takes the current position for the setter: X and Y of its pin, and Z as the start height of the probe
/// move.
fn here() {
    let at = peek(|m| m.link.status.as_ref().map(|status| status.machine_mm));
    let Some([x, y, z]) = at else { return };
    let now: Option<Vec<f64>> = untrack(texts).iter().map(|text| typed(text)).collect();
    let setter = match now.and_then(|now| ToolSetter::of_numbers(&now)) {
        Some(setter) => ToolSetter { place_mm: [x, y], from_mm: z, ..setter },
        None => ToolSetter::usual([x, y], z),
    };
    stage(SETTER_KEY, setter.numbers().map(|number| i18n::number(plain(number))).join("\n"));
}

/// One of the six values. An invalid text is rejected with a message.
fn number(
    index: usize,
    name: impl Fn() -> String + Send + Sync + 'static,
    unit: &'static str,
) -> impl IntoView {
    let shown = Memo::new(move |_| texts().swap_remove(index));
    let write = move |event: web_sys::Event| {
        let mut texts = untrack(texts);
        texts[index] = event_target_value(&event);
        stage(SETTER_KEY, texts.join("\n"));
    };
    let input = typed_input("decimal", move || shown.get(), move || shown.with(|text| typed(text).is_none()))
        .on(ev::input, write);
    let id = format!("setter-{index}");
    number_field("setting", id, name, move || unit.to_owned(), input, Signal::derive(|| None))
}
