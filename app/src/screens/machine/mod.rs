//! The Machine screen: what the drill does, and everything one may ask of it.
//!
//! ```text
//! banner, alarm, offers, digits
//! set-up and jog │ board map │ job, controls, sensors
//! ```
//!
//! Comes in: the link's signals. Goes out: asks. The map in the middle is the page's one canvas.

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
use crate::page::{frame, link, send};
use crate::widgets::push;
use leptos::html::div;
use leptos::prelude::*;
use wasm_bindgen::JsCast;
use web_sys::HtmlElement;

/// Set-up and moving by hand. On a phone they are behind a button: who holds one mostly watches.
fn operate() -> impl IntoView {
    let open = RwSignal::new(false);
    let word = move || if open.get() { say!("page.operator.watch") } else { say!("page.operator.operate") };
    div()
        .class("panel left set-up")
        .attr("data-operate", move || if open.get() { "yes" } else { "no" })
        .child((
            push("button operate", word, move |_| open.update(|open| *open = !*open)),
            set_up::set_up(),
            jog::jog(),
            controller::controller(),
        ))
}

/// Whether set-up, with the dialogs that belong to it, is on show.
pub(crate) fn set_up_is_seen() -> bool {
    let found = document().query_selector(".set-up").ok().flatten();
    found.and_then(|found| found.dyn_into::<HtmlElement>().ok()).is_some_and(|one| one.offset_width() > 0)
}

/// The way into the large view of the machine alone, and out of it.
fn large() -> impl IntoView {
    let on = frame().operator;
    let word = move || if on.get() { say!("page.operator.leave") } else { say!("page.operator.enter") };
    push("button small quiet large-view", word, move |_| {
        send(FrameEvent::Operator { on: !on.get_untracked() });
    })
}

/// Everything around the map.
pub fn machine() -> impl IntoView {
    let line = link::link();
    let met = Memo::new(move |_| line.ever.get());
    let sides = move || {
        met.get().then(|| {
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
        move || met.get().then(|| div().class("readouts-row").child((readouts::readouts(), large()))),
    ));
    (top, sides, move || (!met.get()).then(connect::connect), preflight::preflight())
}
