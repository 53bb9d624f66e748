//! STOP past the page's own events: between the tabs of a site, and for a page whose program has crashed.
//!
//! ```text
//! tab without the drill ─ "stop" ─▶ all others ─▶ LinkEvent::StopBeside ─▶ the tab that has the drill
//!                       ◀─ LinkEvent::StopHeardBeside ◀─ "heard" ────────────────┘
//!
//! link opened ─▶ annulusStop = send.bind(socket, stop)      trapped ─▶ boot.js: STOP ─▶ annulusStop()
//! ```
//!
//! One tab owns the drill, but every tab can stop it. For a crashed page, `www/boot.js` shows a STOP button.
//! Its call uses only browser objects, because WebAssembly that has trapped handles no more events.

use crate::browser::window;
use crate::model::LinkEvent;
use crate::page::send;
use annulus_core::wire::Ask;
use js_sys::Reflect;
use wasm_bindgen::prelude::*;
use web_sys::{BroadcastChannel, MessageEvent};

/// Global name of the call, used by `www/boot.js`.
const CALL: &str = "annulusStop";
/// Property of the call that holds its target.
const CARRIER: &str = "carrier";

#[wasm_bindgen]
extern "C" {
    type Call;
    #[wasm_bindgen(method)]
    fn bind(this: &Call, target: &JsValue, argument: &JsValue) -> JsValue;
}

pub(super) fn is(target: &JsValue, method: &str, argument: &JsValue) {
    let call = Reflect::get(target, &method.into()).map(JsCast::unchecked_into::<Call>);
    let bound = call.map_or(JsValue::UNDEFINED, |call| call.bind(target, argument));
    // A closed socket drops data without an error, so `www/boot.js` checks the target first.
    let _ = Reflect::set(&bound, &CARRIER.into(), target);
    keep(&bound);
}

/// Removes the call, for a device that stops without one when its data ends, such as a USB adapter.
pub(super) fn is_none() {
    keep(&JsValue::UNDEFINED);
}

fn keep(call: &JsValue) {
    let _ = Reflect::set(&window(), &CALL.into(), call);
}

pub(super) fn word() -> String {
    serde_json::to_string(&Ask::Stop).unwrap_or_default()
}

const NAME: &str = "annulus stop";
const STOP: &str = "stop";
const HEARD: &str = "heard";

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
