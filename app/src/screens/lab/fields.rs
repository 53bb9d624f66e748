//! A number field of a Lab experiment. Its value is part of the Lab's edits, so undo covers it.

use crate::format::{plain, typed_in};
use crate::i18n::{number, t};
use crate::model::LabEvent;
use crate::page::{lab, send, shared};
use crate::widgets::{number_field, number_refusal, typed_input};
use leptos::ev;
use leptos::prelude::*;

#[derive(Clone, Copy)]
pub(super) struct Field {
    /// Key in the Lab's edits.
    pub(super) name: &'static str,
    pub(super) unit: &'static str,
    pub(super) range: (f64, f64),
    /// The default value.
    pub(super) own: Memo<f64>,
}

impl Field {
    pub(super) fn text(self) -> String {
        let typed = shared(|m| &m.lab.bench).with(|bench| bench.fields.get(self.name).cloned());
        typed.unwrap_or_else(|| number(plain(self.own.get())))
    }

    /// None if the text isn't a number or is out of range.
    pub(super) fn number(self) -> Option<f64> {
        typed_in(&self.text(), self.range)
    }

    pub(super) fn view(self, words: impl Fn() -> String + Send + Sync + 'static) -> impl IntoView {
        let why = Memo::new(move |_| number_refusal(&self.text(), self.range));
        let input = typed_input("decimal", move || self.text(), move || why.with(Option::is_some))
            .prop("readOnly", lab::locked)
            .on(ev::input, move |event| {
                let text = event_target_value(&event);
                lab::change(Some(self.name), |bench| bench.with_field(self.name, text));
            })
            .on(ev::change, move |_| send(LabEvent::Rest));
        let id = format!("lab-{}", self.name.replace('.', "-"));
        number_field("field", id, words, move || self.unit.to_owned(), input, why.into())
    }
}

pub(super) fn mend() -> impl IntoView {
    leptos::html::p().class("quiet empty").child(t!("page.lab.mend"))
}
