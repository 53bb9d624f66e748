//! STOP between the tabs of a site: its machine is the drill of one of them, and any page may stop.
//!
//! ```text
//! tab without the drill ─ "stop" ─▶ all others ─▶ LinkEvent::StopBeside ─▶ the tab that has it ─ "heard" ─▶ LinkEvent::StopHeardBeside
//! ```
//!
//! Comes in: the wish, or that it was heard. Goes out: events. Does not know who has the drill.

use crate::model::LinkEvent;
use crate::page::send;
use wasm_bindgen::prelude::*;
use web_sys::{BroadcastChannel, MessageEvent};

const NAME: &str = "annulus stop";
const STOP: &str = "stop";
const HEARD: &str = "heard";

/// Where the tabs of a site hear each other.
#[derive(Default)]
pub(super) struct Beside(Option<BroadcastChannel>);

impl Beside {
    /// Listens; for the life of the page. A browser without such channels has one tab as before.
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

    /// Tells the others.
    pub(super) fn tell(&self, heard: bool) {
        let word = if heard { HEARD } else { STOP };
        if let Some(channel) = &self.0 {
            let _ = channel.post_message(&word.into());
        }
    }
}
