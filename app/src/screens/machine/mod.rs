//! The Machine screen: what the drill does, and everything one may ask of it.
//!
//! ```text
//! banner, alarm, offers, digits
//! set-up and jog │ board map │ job, controls, sensors
//! ```
//!
//! Comes in: the link's signals. Goes out: asks. The map in the middle is the page's one canvas.

mod banner;
mod connect;
mod ended;
mod job;
mod jog;
mod preflight;
mod readouts;
mod sensors;
mod set_up;
mod tool_change;
pub mod words;

pub use banner::alarm;
pub(crate) use jog::arm_keys;
pub use tool_change::tool_change;

use crate::page::link;
use leptos::html::div;
use leptos::prelude::*;

/// Everything around the map.
pub fn machine() -> impl IntoView {
    let line = link::link();
    let met = Memo::new(move |_| line.ever.get());
    let sides = move || {
        met.get().then(|| {
            (
                div().class("panel left set-up").child((set_up::set_up(), jog::jog())),
                div().class("panel right job").child((job::job(), sensors::sensors())),
            )
        })
    };
    let top = div().class("top machine-top").child((
        banner::banner(),
        banner::interrupted(),
        banner::answers(),
        move || met.get().then(readouts::readouts),
    ));
    (top, sides, move || (!met.get()).then(connect::connect), preflight::preflight())
}
