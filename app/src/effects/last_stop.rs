//! STOP for a page whose program has crashed: a call made only of browser objects, which `www/boot.js` offers
//! as a button. WebAssembly that has trapped can no longer handle events.
//!
//! ```text
//! link opened ─▶ annulusStop = send.bind(socket, stop)      trapped ─▶ boot.js: STOP ─▶ annulusStop()
//! ```

use crate::browser::window;
use annulus_core::wire::Ask;
use js_sys::Reflect;
use wasm_bindgen::prelude::*;

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

/// Sets the call to `target.method(argument)`.
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

/// The STOP message for a bridge or a machine of this page.
pub(super) fn word() -> String {
    serde_json::to_string(&Ask::Stop).unwrap_or_default()
}
