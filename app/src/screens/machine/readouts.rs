//! The position in large digits: work position first, machine position and target smaller.

use crate::health::Freshness;
use crate::i18n::{number, say, t};
use crate::page::{read, shared};
use annulus_core::pins::SpindleState;
use annulus_core::wire::Status;
use leptos::html::{div, span};
use leptos::prelude::*;

fn of(get: impl Fn(&Status) -> f64) -> String {
    let unit = read(|m| m.frame.unit);
    shared(|m| &m.link.status)
        .with(|status| status.as_ref().map_or_else(|| "–".to_owned(), |status| unit.coordinate(get(status))))
}

fn readout(axis: &'static str, index: usize) -> impl IntoView {
    div().class("readout").child((
        span().class("axis").child(axis),
        span()
            .class("digits")
            .attr("data-axis", axis)
            .child(move || number(of(|status| status.work_mm[index]))),
    ))
}

/// The spindle's reported state; none for a spindle without feedback.
fn spindle_words(state: SpindleState, wanted_rpm: u32) -> Option<String> {
    Some(match state {
        SpindleState::Untold => return None,
        SpindleState::Unreachable => say!("page.spindle.unreachable"),
        SpindleState::Off { rpm } => say!("page.spindle.off", rpm = rpm),
        SpindleState::Reaching { rpm } => say!("page.spindle.reaching", rpm = rpm, wanted = wanted_rpm),
        SpindleState::AtSpeed { rpm } => say!("page.spindle.at_speed", rpm = rpm),
        SpindleState::Lost { .. } => say!("page.spindle.lost"),
    })
}

fn spindle_tone(state: SpindleState) -> &'static str {
    match state {
        SpindleState::AtSpeed { .. } => "tone-run",
        SpindleState::Reaching { .. } => "tone-pause",
        SpindleState::Lost { .. } => "tone-alarm",
        SpindleState::Untold | SpindleState::Off { .. } | SpindleState::Unreachable => "tone-quiet",
    }
}

/// The row of digits.
pub(crate) fn readouts() -> impl IntoView {
    let aged =
        move || if read(|m| m.link.freshness == Freshness::Fresh) { "readouts" } else { "readouts stale" };
    let machine = move || {
        let [x, y, z] = [0, 1, 2].map(|axis| of(|status| status.machine_mm[axis]));
        say!("page.machine.position", x = x, y = y, z = z)
    };
    let target = move || {
        let unit = read(|m| m.frame.unit);
        let target = read(|m| m.link.status.as_ref()?.target_mm);
        // Always rendered, so that the picture below doesn't move.
        let [x, y] =
            target.map_or(["–".to_owned(), "–".to_owned()], |at| at.map(|mm| unit.coordinate(mm)));
        say!("page.machine.target", x = x, y = y)
    };
    let spindle = Memo::new(move |_| {
        let told = read(|m| m.link.status.as_ref().map(|now| (now.spindle, now.spindle_rpm)));
        told.and_then(|(state, wanted)| Some((spindle_tone(state), spindle_words(state, wanted)?)))
    });
    let age = move || {
        read(|m| m.link.freshness != Freshness::Fresh && m.link.ever).then_some(t!("page.machine.stale"))
    };
    div().class(aged).attr("aria-label", t!("page.machine.readouts")).attr("role", "group").child((
        span().class("quiet").child(t!("page.machine.work")),
        readout("X", 0),
        readout("Y", 1),
        readout("Z", 2),
        span().class("unit quiet").child(crate::i18n::unit_word),
        div().class("machine-position").child((
            span().class("live").child(machine),
            span().class("live").child(target),
            span().child(age),
        )),
        move || {
            let spindle = spindle.get();
            spindle
                .map(|(tone, said)| div().class(format!("spindle {tone}")).attr("role", "status").child(said))
        },
    ))
}
