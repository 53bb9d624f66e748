//! The building blocks of the editor's fields: property names, length inputs, menus.

use super::focus_picture;
use crate::drawing::fields::{self, Field};
use crate::drawing::typed;
use crate::format::Unit;
use crate::i18n::{self, key, number, t};
use crate::keys::is_escape;
use crate::page::read;
use crate::widgets::{choice, last_refusal, menu_word, number_field, segmented, typed_input};
use annulus_core::board::drawing::{Layer, PadShape};
use annulus_core::units::Length;
use leptos::ev;
use leptos::html::{self, label, select, span};
use leptos::prelude::*;
use web_sys::{HtmlInputElement, KeyboardEvent};

pub(super) fn word(field: Field) -> &'static str {
    match field {
        Field::X => key!("page.draw.field.x"),
        Field::Y => key!("page.draw.field.y"),
        Field::FromX => key!("page.draw.field.from_x"),
        Field::FromY => key!("page.draw.field.from_y"),
        Field::ToX => key!("page.draw.field.to_x"),
        Field::ToY => key!("page.draw.field.to_y"),
        Field::Length => key!("page.draw.field.length"),
        Field::Width => key!("page.draw.field.width"),
        Field::Shape => key!("page.draw.field.shape"),
        Field::Size => key!("page.draw.field.size"),
        Field::Turn => key!("page.draw.field.turn"),
        Field::Diameter => key!("page.draw.field.diameter"),
        Field::Plated => key!("page.draw.field.plated"),
        Field::Layer => key!("page.draw.field.layer"),
        Field::Name => key!("page.draw.field.name"),
        Field::Group => key!("page.draw.field.group"),
        Field::ByX => key!("page.draw.field.by_x"),
        Field::ByY => key!("page.draw.field.by_y"),
    }
}

pub(super) fn layer_word(layer: Layer) -> &'static str {
    match layer {
        Layer::Top => key!("page.draw.layer.top"),
        Layer::Bottom => key!("page.draw.layer.bottom"),
        Layer::Both => key!("page.draw.layer.both"),
        Layer::Edge => key!("page.draw.layer.edge"),
    }
}

pub(super) fn shape_word(shape: PadShape) -> &'static str {
    match shape {
        PadShape::Circle => key!("page.draw.shape.circle"),
        PadShape::Square => key!("page.draw.shape.square"),
        PadShape::Octagon => key!("page.draw.shape.octagon"),
    }
}

/// A set of choices, each with its value in the drawing file and its displayed name.
pub(super) struct Choices<T: 'static> {
    all: &'static [T],
    word: fn(T) -> &'static str,
    name: fn(T) -> &'static str,
}

pub(super) const LAYERS: Choices<Layer> = Choices { all: &Layer::ALL, word: Layer::word, name: layer_word };

pub(super) const COPPER: Choices<Layer> =
    Choices { all: &[Layer::Top, Layer::Bottom, Layer::Both], word: Layer::word, name: layer_word };

pub(super) const SHAPES: Choices<PadShape> =
    Choices { all: &PadShape::ALL, word: PadShape::word, name: shape_word };

impl<T: Copy + PartialEq + Send + Sync> Choices<T> {
    /// A menu of the choices; `now` is none if the selected things differ.
    pub(super) fn menu(
        &self,
        id: String,
        now: impl Fn() -> Option<T> + Copy + Send + Sync + 'static,
        act: impl Fn(String) + 'static,
    ) -> impl IntoView {
        let name = self.name;
        let words = self.all.iter().map(|&one| {
            menu_word((self.word)(one), move || now() == Some(one), move || i18n::text(name(one), &[]))
        });
        let several = html::option()
            .attr("value", "")
            .prop("hidden", true)
            .prop("selected", move || now().is_none())
            .child(t!("page.draw.several"));
        select()
            .attr("id", id)
            .on(ev::change, move |event| act(event_target_value(&event)))
            .child((several, words.collect::<Vec<_>>()))
    }

    pub(super) fn buttons(
        &self,
        label: impl Fn() -> String + Send + Sync + 'static,
        now: impl Fn() -> T + Copy + Send + Sync + 'static,
        act: impl Fn(T) + Copy + 'static,
    ) -> impl IntoView {
        let name = self.name;
        let choices = self
            .all
            .iter()
            .map(|&one| choice(move || now() == one, move || i18n::text(name(one), &[]), move |_| act(one)));
        segmented(label, choices.collect::<Vec<_>>())
    }
}

pub(super) fn labelled(id: String, field: Field, menu: impl IntoView) -> impl IntoView {
    label().class("field").attr("for", id).child((span().child(move || i18n::text(word(field), &[])), menu))
}

/// A length field. The text can contain a unit, else the chosen one applies.
pub(super) fn length(
    id: String,
    field: Field,
    value: Signal<Option<Length>>,
    act: impl Fn(String) + 'static,
) -> impl IntoView {
    let text = Signal::derive(move || {
        value.get().map_or_else(String::new, |length| number(read(|m| m.frame.unit).short(length.mm())))
    });
    let fits = move |text: &str| {
        typed::length(text, Unit::default()).is_some_and(|length| fields::may_be(field, length))
    };
    typed_field(id, field, text, i18n::unit_word, fits, act)
}

/// A field that applies its text on Enter or when it loses focus. Escape restores the value and returns the
/// focus to the picture.
pub(super) fn typed_field(
    id: String,
    field: Field,
    text: Signal<String>,
    unit: impl Fn() -> String + Send + Sync + 'static,
    fits: impl Fn(&str) -> bool + 'static,
    act: impl Fn(String) + 'static,
) -> impl IntoView {
    let wrong = last_refusal::<()>(move || text.get());
    let take = move |event: web_sys::Event| {
        let text = event_target_value(&event);
        wrong.set((!fits(&text)).then_some(()));
        // Pass even unfit text on: the edit answers with a message.
        act(text);
    };
    // Lengths may be typed with their unit.
    let input = typed_input("text", move || text.get(), move || wrong.with(Option::is_some))
        .on(ev::keydown, move |event: KeyboardEvent| {
            if is_escape(&event.key()) && !event.is_composing() {
                event_target::<HtmlInputElement>(&event).set_value(&text.get_untracked());
                wrong.set(None);
                // Wait a frame, until the field has handled the key.
                request_animation_frame(focus_picture);
            }
        })
        .on(ev::change, take);
    let name = move || i18n::text(word(field), &[]);
    number_field("field", id, name, unit, input, Signal::derive(|| None))
}
