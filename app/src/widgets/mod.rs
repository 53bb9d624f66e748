//! The parts screens are built from: native elements in one dress.
//!
//! Everything is built with leptos' functions (`div().child(…)`) and not with its macro: that one writes static parts
//! as markup, which the page's security policy refuses.

mod dialog;
mod icon;
mod plot;
mod save;
mod stop;
mod toast;
mod virtual_list;

pub use dialog::{Dialog, dialog, dialog_is_open};
pub use icon::{Icon, icon};
pub use plot::plotted;
pub use save::{save_bytes, save_file};
pub use stop::{follow_window, stop_zone};
pub use toast::{toast, toasts};
pub use virtual_list::{row_top, virtual_list};

use crate::i18n::Words;
use leptos::ev::{self, MouseEvent};
use leptos::html::{self, button, dd, dt, span};
use leptos::prelude::*;
use std::sync::Arc;

/// What a press does.
type Act = Box<dyn FnMut(MouseEvent)>;

/// Something that is or is not.
type Flag = Box<dyn Fn() -> bool + Send + Sync>;

/// A plain button.
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

/// A button that can be switched off.
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

/// A button with a picture and a name for those who do not see it.
pub fn picture_button(
    picture: Icon,
    name: impl Fn() -> String + Send + Sync + 'static,
    act: impl FnMut(MouseEvent) + 'static,
) -> impl IntoView {
    picture_button_if(picture, || true, name, act)
}

/// The same, and it can be switched off.
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

/// One choice of several side by side.
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

/// A name and its value, for a list of facts.
pub fn fact(
    name: impl Fn() -> String + Send + Sync + 'static,
    value: impl Fn() -> String + Send + Sync + 'static,
) -> impl IntoView {
    let (name, value): (Words, Words) = (Box::new(name), Box::new(value));
    (dt().child(name), dd().child(value))
}

/// One word of a menu. The choice is said by the word and not by the menu, which is made before its words are.
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

/// Text only those hear who do not see.
pub fn unseen(text: impl Fn() -> String + Send + Sync + 'static) -> impl IntoView {
    let text: Words = Box::new(text);
    span().class("unseen").child(text)
}

/// An empty element with a class, for shapes that the style sheet draws.
pub fn shape(
    class: &'static str,
) -> html::HtmlElement<html::I, impl leptos::tachys::html::attribute::Attribute, ()> {
    html::i().attr("aria-hidden", "true").class(class)
}
