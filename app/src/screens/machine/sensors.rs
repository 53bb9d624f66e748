//! The sensors and motor phases as lamps and bits; where the virtual drill lost steps.

use super::{controller, words};
use crate::i18n::{key, say, t};
use crate::page::{read, shared};
use crate::widgets::{shape, unseen};
use annulus_core::job::Input;
use annulus_core::machine::{Value, axis_name};
use annulus_core::wire::SlipReport;
use leptos::html::{div, h3, li, section, span, ul};
use leptos::prelude::*;

/// The inputs that a GRBL controller reports, with their names. GRBL doesn't report at which end a limit
/// switch is.
const OF_CONTROLLER: [(Input, &str); 4] = [
    (Input::XMax, key!("page.sensor.x_switch")),
    (Input::YMax, key!("page.sensor.y_switch")),
    (Input::ZTop, key!("page.sensor.z_switch")),
    (Input::Contact, key!("page.sensor.contact")),
];

fn lamp(input: Input, word: &'static str, on: Memo<u32>) -> impl IntoView + use<> {
    let lit = move || on.get() & input.bit() != 0;
    div().class(move || if lit() { "lamp on" } else { "lamp" }).attr("role", "listitem").child((
        shape(""),
        span().child(move || crate::i18n::text(word, &[])),
        unseen(move || if lit() { say!("page.sensor.on") } else { say!("page.sensor.off") }),
    ))
}

/// Inputs of presser foot and magazine, and index pulses, if the settings have them.
fn further(settings: &[(String, Value)]) -> Vec<Input> {
    let says = |key: &str, word: &str| {
        let said = settings.iter().find(|(known, _)| known == key);
        said.is_some_and(|(_, value)| *value == Value::Text(word.to_owned()))
    };
    let has_more = says("foot.on", "yes") || says("rack.change", "magazine");
    let is_there = |input: &Input| match input {
        Input::XIndex => says("x.index", "yes"),
        Input::YIndex => says("y.index", "yes"),
        Input::ZIndex => says("z.index", "yes"),
        _ => has_more,
    };
    Input::ALL.into_iter().skip(Input::OF_AXES.len()).filter(is_there).collect()
}

/// The displayed reason why a motor lost steps.
fn cause(name: &str) -> &'static str {
    match name {
        "too_fast" => key!("page.slip.too_fast"),
        "too_steep" => key!("page.slip.too_steep"),
        "blocked" => key!("page.slip.blocked"),
        "held" => key!("page.slip.held"),
        "no_pull" => key!("page.slip.no_pull"),
        _ => key!("page.slip.fault"),
    }
}

fn slip(slip: &SlipReport) -> impl IntoView + use<> {
    let (axis, place) = (axis_name(usize::from(slip.axis)), format!("{:.2}", slip.place_mm));
    let (lost, why) = (slip.lost, cause(&slip.cause));
    let line = move || say!("page.slip.line", axis = axis, place = place, lost = lost);
    li().child((line, " ", move || crate::i18n::text(why, &[])))
}

pub(crate) fn sensors() -> impl IntoView {
    let inputs = Memo::new(move |_| read(|m| m.link.status.as_ref().map_or(0, |status| status.inputs)));
    let lamps = Memo::new(move |_| {
        if controller::plans() {
            return Vec::from(OF_CONTROLLER);
        }
        let more = shared(|m| &m.link.settings).with(|settings| further(settings));
        let all = Input::OF_AXES.into_iter().chain(more);
        all.map(|input| (input, words::sensor(input))).collect()
    });
    let phases = Memo::new(move |_| read(|m| m.link.status.as_ref().map_or([0; 3], |status| status.phases)));
    let bits = move || {
        let [x, y, z] = phases.get().map(|byte| format!("{byte:07b}"));
        say!("page.sensor.phase_bits", x = x, y = y, z = z)
    };
    let slips = Memo::new(move |_| {
        shared(|m| &m.link.status)
            .with(|status| status.as_ref().map(|status| status.slips.clone()).unwrap_or_default())
    });
    let lost = move || {
        let rows: Vec<_> = slips.with(|slips| slips.iter().map(slip).collect());
        (!rows.is_empty()).then(|| (h3().child(t!("page.slip.title")), ul().child(rows)))
    };
    section().class("block sensors").attr("aria-label", t!("page.sensor.title")).child((
        h3().child(t!("page.sensor.title")),
        div().class("lamps").attr("role", "list").child(move || {
            lamps.get().into_iter().map(|(input, word)| lamp(input, word, inputs)).collect::<Vec<_>>()
        }),
        move || {
            let phases = || {
                (
                    h3().class("phases-title").child(t!("page.sensor.phases")),
                    div().class("phase-bits").child(bits),
                )
            };
            (!controller::plans()).then(phases)
        },
        lost,
    ))
}
