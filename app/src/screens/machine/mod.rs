//! The Machine screen: what the machine does, and all commands for it.
//!
//! ```text
//! banner, alarm, offers, digits
//! set-up and jog │ board map │ job, controls, sensors
//! ```
//!
//! The map in the middle is the page's only canvas.

mod banner;
mod checked;
mod connect;
mod contacts;
mod controller;
mod ended;
mod job;
mod jog;
mod level;
mod magazine;
mod offer;
mod preflight;
mod readouts;
mod second_side;
mod sensors;
mod set_up;
mod spindles;
mod tool_change;
mod touch_off;
mod way_back;
pub mod words;

pub use banner::{alarm, lost};
pub use ended::elsewhere;
pub(crate) use ended::made;
pub(crate) use jog::arm_keys;
pub use tool_change::tool_change;

use crate::i18n::say;
use crate::model::FrameEvent;
use crate::page::{peek, read, send};
use crate::widgets::push;
use leptos::html::div;
use leptos::prelude::*;
use wasm_bindgen::JsCast;
use web_sys::HtmlElement;

/// Set-up and jogging. Collapsed on phones, because phone users mostly watch.
fn operate() -> impl IntoView {
    let open = RwSignal::new(false);
    let word = move || if open.get() { say!("page.operator.watch") } else { say!("page.operator.operate") };
    div()
        .class("panel left set-up")
        .attr("data-operate", move || if open.get() { "yes" } else { "no" })
        .child((
            push("button operate", word, move |_| open.update(|open| *open = !*open)),
            div().class("set-up-rest").child((set_up::set_up(), controller::controller())),
            jog::jog(),
        ))
}

pub(crate) fn set_up_is_seen() -> bool {
    let found = document().query_selector(".set-up").ok().flatten();
    found.and_then(|found| found.dyn_into::<HtmlElement>().ok()).is_some_and(|one| one.offset_width() > 0)
}

/// Enters and leaves the large view, which shows only the machine.
fn large() -> impl IntoView {
    let on = || read(|m| m.frame.operator);
    let word = move || if on() { say!("page.operator.leave") } else { say!("page.operator.enter") };
    push("button small quiet large-view", word, move |_| {
        send(FrameEvent::Operator { on: !peek(|m| m.frame.operator) });
    })
}

pub fn machine() -> impl IntoView {
    let met = || read(|m| m.link.ever);
    let sides = move || {
        met().then(|| {
            (
                operate(),
                div().class("panel right job").child((
                    job::job(),
                    magazine::magazine(),
                    contacts::contacts(),
                    sensors::sensors(),
                )),
            )
        })
    };
    let top = div().class("top machine-top").child((
        banner::banner(),
        banner::answers(),
        way_back::steps(),
        move || met().then(|| div().class("readouts-row").child((readouts::readouts(), large()))),
    ));
    (top, sides, move || (!met()).then(connect::connect), preflight::preflight())
}
