//! A number field of a Lab experiment. Its value is part of the Lab's edits, so undo covers it.

use crate::format::{plain, typed};
use crate::i18n::{number, say, t};
use crate::model::LabEvent;
use crate::page::{lab, send, shared};
use leptos::ev;
use leptos::html::{input, label, small, span};
use leptos::prelude::*;

#[derive(Clone, Copy)]
pub(super) struct Field {
    /// Key in the Lab's edits.
    pub(super) name: &'static str,
    pub(super) unit: &'static str,
    /// Minimum and maximum.
    pub(super) range: (f64, f64),
    /// The default value.
    pub(super) own: Memo<f64>,
}

impl Field {
    /// The displayed text.
    pub(super) fn text(self) -> String {
        let typed = shared(|m| &m.lab.bench).with(|bench| bench.fields.get(self.name).cloned());
        typed.unwrap_or_else(|| number(plain(self.own.get())))
    }

    /// None if the text isn't a number or is out of range.
    pub(super) fn number(self) -> Option<f64> {
        let number = typed(&self.text())?;
        (self.range.0..=self.range.1).contains(&number).then_some(number)
    }

    fn id(self) -> String {
        format!("lab-{}", self.name.replace('.', "-"))
    }

    /// The field with its label.
    pub(super) fn view(self, words: impl Fn() -> String + Send + Sync + 'static) -> impl IntoView {
        let wrong = Memo::new(move |_| self.number().is_none());
        let why = format!("{}-why", self.id());
        let (low, high) = self.range;
        label().class("field").attr("for", self.id()).child((
            span().child(words),
            span().class("with-unit").child((
                input()
                    .attr("type", "text")
                    .attr("inputmode", "decimal")
                    .attr("id", self.id())
                    .attr("aria-invalid", move || wrong.get().then_some("true"))
                    .attr("aria-describedby", why.clone())
                    .prop("readOnly", lab::locked)
                    .prop("value", move || self.text())
                    .on(ev::input, move |event| {
                        let text = event_target_value(&event);
                        lab::change(Some(self.name), |bench| bench.with_field(self.name, text));
                    })
                    .on(ev::change, move |_| send(LabEvent::Rest)),
                span().child(self.unit),
            )),
            small().class("refusal").attr("id", why).child(move || {
                let twofold = annulus_core::locale::has_two_marks(&self.text());
                let range = || say!("page.lab.number", low = plain(low), high = plain(high));
                wrong.get().then(|| if twofold { say!("queue.two_marks.advice") } else { range() })
            }),
        ))
    }
}

/// Asks the user to correct the fields.
pub(super) fn mend() -> impl IntoView {
    leptos::html::p().class("quiet empty").child(t!("page.lab.mend"))
}
