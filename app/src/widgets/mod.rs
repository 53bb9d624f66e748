//! The building blocks of the screens: native elements in one style.
//!
//! Built with leptos' functions (`div().child(…)`), not with its macro: the macro writes static parts as
//! markup, which the page's security policy blocks.

mod changes;
mod dialog;
mod field;
mod icon;
mod plot;
mod save;
mod stop;
mod toast;
mod virtual_list;

pub use changes::change_bar;
pub use dialog::{Dialog, dialog, dialog_is_open};
pub use field::{keyboard, last_refusal, number_field, number_refusal, refusal, refusal_text, typed_input};
pub use icon::{Icon, icon};
pub use plot::plotted;
pub use save::{save_bytes, save_file};
pub use stop::{follow_window, stop_zone};
pub use toast::{toast, toasts};
pub use virtual_list::{row_top, virtual_list};

use crate::i18n::Words;
use leptos::ev::{self, MouseEvent};
use leptos::html::{self, button, dd, div, dt, input, label, span};
use leptos::prelude::*;
use std::sync::Arc;

type Act = Box<dyn FnMut(MouseEvent)>;

type Flag = Box<dyn Fn() -> bool + Send + Sync>;

pub fn push(
    class: &'static str,
    text: impl Fn() -> String + Send + Sync + 'static,
    act: impl FnMut(MouseEvent) + 'static,
) -> impl IntoView {
    pushed(class, Box::new(text), Box::new(act))
}

fn pushed(class: &'static str, text: Words, act: Act) -> impl IntoView {
    button().attr("type", "button").class(class).on(ev::click, act).child(text)
}

pub fn push_if(
    class: &'static str,
    enabled: impl Fn() -> bool + Send + Sync + 'static,
    text: impl Fn() -> String + Send + Sync + 'static,
    act: impl FnMut(MouseEvent) + 'static,
) -> impl IntoView {
    pushed_if(class, Box::new(enabled), Box::new(text), Box::new(act))
}

fn pushed_if(class: &'static str, enabled: Flag, text: Words, act: Act) -> impl IntoView {
    button()
        .attr("type", "button")
        .class(class)
        .prop("disabled", move || !enabled())
        .on(ev::click, act)
        .child(text)
}

/// A button that moves or starts something. `act` identifies the action; if empty, the button isn't guarded.
/// The guard in `effects` ignores a press within a second after the button appeared, moved or changed.
pub fn push_guarded(
    class: &'static str,
    act: impl Fn() -> &'static str + Send + Sync + 'static,
    enabled: impl Fn() -> bool + Send + Sync + 'static,
    text: impl Fn() -> String + Send + Sync + 'static,
    press: impl FnMut(MouseEvent) + 'static,
) -> impl IntoView {
    guarded(class, Box::new(act), Box::new(enabled), Box::new(text), Box::new(press))
}

fn guarded(
    class: &'static str,
    act: Box<dyn Fn() -> &'static str + Send + Sync>,
    enabled: Flag,
    text: Words,
    press: Act,
) -> impl IntoView {
    button()
        .attr("type", "button")
        .class(class)
        .attr("data-moves", act)
        // Blocked until the guard has seen the button for long enough.
        .attr("aria-disabled", "true")
        .prop("disabled", move || !enabled())
        .on(ev::click, press)
        .child(text)
}

/// An icon button with a name for screen readers.
pub fn picture_button(
    picture: Icon,
    name: impl Fn() -> String + Send + Sync + 'static,
    act: impl FnMut(MouseEvent) + 'static,
) -> impl IntoView {
    picture_button_if(picture, || true, name, act)
}

pub fn picture_button_if(
    picture: Icon,
    enabled: impl Fn() -> bool + Send + Sync + 'static,
    name: impl Fn() -> String + Send + Sync + 'static,
    act: impl FnMut(MouseEvent) + 'static,
) -> impl IntoView {
    pictured(picture, Box::new(enabled), Arc::new(name), Box::new(act))
}

fn pictured(
    picture: Icon,
    enabled: Flag,
    name: Arc<dyn Fn() -> String + Send + Sync>,
    act: Act,
) -> impl IntoView {
    let title = name.clone();
    button()
        .attr("type", "button")
        .class("button icon")
        .attr("aria-label", move || name())
        .attr("title", move || title())
        .prop("disabled", move || !enabled())
        .on(ev::click, act)
        .child(icon(picture))
}

pub fn choice(
    chosen: impl Fn() -> bool + Send + Sync + 'static,
    text: impl Fn() -> String + Send + Sync + 'static,
    act: impl FnMut(MouseEvent) + 'static,
) -> impl IntoView {
    chosen_of(Box::new(chosen), Box::new(text), Box::new(act))
}

fn chosen_of(chosen: Flag, text: Words, act: Act) -> impl IntoView {
    button()
        .attr("type", "button")
        .class("button")
        .attr("aria-pressed", move || if chosen() { "true" } else { "false" })
        .on(ev::click, act)
        .child(text)
}

/// A row of [`choice`]s.
pub fn segmented(
    name: impl Fn() -> String + Send + Sync + 'static,
    choices: impl IntoView + 'static,
) -> impl IntoView {
    let name: Words = Box::new(name);
    div().class("segmented").attr("role", "group").attr("aria-label", name).child(choices.into_any())
}

/// A checkbox with its label. The flag given to `act` is its new state.
pub fn tick(
    on: impl Fn() -> bool + Send + Sync + 'static,
    text: impl Fn() -> String + Send + Sync + 'static,
    act: impl FnMut(bool) + 'static,
) -> impl IntoView {
    ticked(Box::new(on), Box::new(text), Box::new(act))
}

fn ticked(on: Flag, text: Words, mut act: Box<dyn FnMut(bool)>) -> impl IntoView {
    label().class("tick").child((
        input()
            .attr("type", "checkbox")
            .prop("checked", on)
            .on(ev::change, move |event| act(event_target_checked(&event))),
        span().child(text),
    ))
}

/// A name and its value, for a `<dl>`.
pub fn fact(
    name: impl Fn() -> String + Send + Sync + 'static,
    value: impl Fn() -> String + Send + Sync + 'static,
) -> impl IntoView {
    let (name, value): (Words, Words) = (Box::new(name), Box::new(value));
    (dt().child(name), dd().child(value))
}

/// An option of a `<select>`. The option holds the selection, because the menu is built before its options.
pub fn menu_word(
    word: &'static str,
    chosen: impl Fn() -> bool + Send + Sync + 'static,
    text: impl Fn() -> String + Send + Sync + 'static,
) -> impl IntoView {
    worded(word, Box::new(chosen), Box::new(text))
}

fn worded(word: &'static str, chosen: Flag, text: Words) -> impl IntoView {
    html::option().attr("value", word).prop("selected", chosen).child(text)
}

pub fn unseen(text: impl Fn() -> String + Send + Sync + 'static) -> impl IntoView {
    let text: Words = Box::new(text);
    span().class("unseen").child(text)
}

/// An empty element whose class the style sheet draws.
pub fn shape(
    class: &'static str,
) -> html::HtmlElement<html::I, impl leptos::tachys::html::attribute::Attribute, ()> {
    html::i().attr("aria-hidden", "true").class(class)
}
