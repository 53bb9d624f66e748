//! STOP. Pressed means sent: on pointer-down, before anything is drawn.
//!
//! Comes in: nothing. Goes out: the button, or the words that there is no machine. It is never disabled.

use crate::i18n::t;
use crate::link;
use leptos::ev;
use leptos::html::{button, div};
use leptos::prelude::*;

/// The button. It stands in the top bar and again in the head of every dialog, which makes the bar unreachable.
pub fn stop_button() -> impl IntoView {
    let ever = link::link().ever;
    move || {
        if ever.get() {
            let press = button()
                .attr("type", "button")
                .class("stop")
                .attr("title", t!("page.stop.tip"))
                .attr("aria-keyshortcuts", "Control+Shift+E")
                .on(ev::pointerdown, |event| {
                    link::stop();
                    event.prevent_default();
                })
                .on(ev::click, |event| {
                    if event.detail() == 0 {
                        link::stop();
                    }
                })
                .child(t!("page.stop.label"));
            press.into_any()
        } else {
            div().class("stop-none").child(t!("page.stop.no_machine")).into_any()
        }
    }
}
