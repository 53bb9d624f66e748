//! The sensors and the phases being put out, as lamps and bits.
//!
//! Comes in: input bits and phase bytes. Goes out: lamps, each with its word; the shape tells, not the colour alone.

use super::words;
use crate::i18n::{say, t};
use crate::link;
use crate::widgets::{shape, unseen};
use annulus_core::job::Input;
use leptos::html::{div, h3, section, span};
use leptos::prelude::*;

fn lamp(input: Input, on: Memo<u32>) -> impl IntoView {
    let lit = move || on.get() & input.bit() != 0;
    let word = words::sensor(input);
    div().class(move || if lit() { "lamp on" } else { "lamp" }).attr("role", "listitem").child((
        shape(""),
        span().child(move || crate::i18n::text(word, &[])),
        unseen(move || if lit() { say!("page.sensor.on") } else { say!("page.sensor.off") }),
    ))
}

/// Lamps and bits.
pub(crate) fn sensors() -> impl IntoView {
    let line = link::link();
    let inputs =
        Memo::new(move |_| line.status.with(|status| status.as_ref().map_or(0, |status| status.inputs)));
    let phases =
        Memo::new(move |_| line.status.with(|status| status.as_ref().map_or([0; 3], |status| status.phases)));
    let bits = move || {
        let [x, y, z] = phases.get().map(|byte| format!("{byte:07b}"));
        say!("page.sensor.phase_bits", x = x, y = y, z = z)
    };
    section().class("block").attr("aria-label", t!("page.sensor.title")).child((
        h3().child(t!("page.sensor.title")),
        div()
            .class("lamps")
            .attr("role", "list")
            .child(Vec::from(Input::ALL.map(|input| lamp(input, inputs)))),
        h3().child(t!("page.sensor.phases")),
        div().class("phase-bits").child(bits),
    ))
}
