//! STOP between the tabs of a site: one tab owns the drill, but every tab can stop it.
//!
//! ```text
//! tab without the drill ─ "stop" ─▶ all others ─▶ LinkEvent::StopBeside ─▶ the tab that has the drill
//!                       ◀─ LinkEvent::StopHeardBeside ◀─ "heard" ────────────────┘
//! ```

use crate::model::LinkEvent;
use crate::page::send;
use wasm_bindgen::prelude::*;
use web_sys::{BroadcastChannel, MessageEvent};

const NAME: &str = "annulus stop";
const STOP: &str = "stop";
const HEARD: &str = "heard";

/// The channel between the tabs of a site.
#[derive(Default)]
pub(super) struct Beside(Option<BroadcastChannel>);

impl Beside {
    /// Listens while the page lives. A browser without such channels cannot pass STOP between tabs.
    pub(super) fn listening() -> Self {
        let channel = BroadcastChannel::new(NAME).ok();
        let heard = Closure::<dyn FnMut(MessageEvent)>::new(|event: MessageEvent| {
            match event.data().as_string().as_deref() {
                Some(STOP) => send(LinkEvent::StopBeside),
                Some(HEARD) => send(LinkEvent::StopHeardBeside),
                _ => {}
            }
        });
        if let Some(channel) = &channel {
            channel.set_onmessage(Some(heard.as_ref().unchecked_ref()));
        }
        heard.forget();
        Self(channel)
    }

    pub(super) fn tell(&self, heard: bool) {
        let word = if heard { HEARD } else { STOP };
        if let Some(channel) = &self.0 {
            let _ = channel.post_message(&word.into());
        }
    }
}
