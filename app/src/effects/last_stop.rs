//! What STOP does where the page's own program is broken: a call made of nothing but objects of the browser, kept for `www/boot.js`,
//! which shows a STOP of its own then. A program of WebAssembly that trapped answers nobody any more.
//!
//! ```text
//! line opened ─▶ annulusStop = send.bind(socket, stop)      trapped ─▶ boot.js: STOP ─▶ annulusStop()
//! ```
//!
//! Comes in: what the line is carried by. Goes out: the call. Does not know whether the page lives.

use crate::browser::window;
use annulus_core::wire::Ask;
use js_sys::Reflect;
use wasm_bindgen::prelude::*;

/// Where `www/boot.js` looks for it.
const CALL: &str = "annulusStop";
/// And there what carries it.
const CARRIER: &str = "carrier";

#[wasm_bindgen]
extern "C" {
    /// A function of the browser.
    type Call;
    #[wasm_bindgen(method)]
    fn bind(this: &Call, target: &JsValue, argument: &JsValue) -> JsValue;
}

/// From now on it is `target.method(argument)`.
pub(super) fn is(target: &JsValue, method: &str, argument: &JsValue) {
    let call = Reflect::get(target, &method.into()).map(JsCast::unchecked_into::<Call>);
    let bound = call.map_or(JsValue::UNDEFINED, |call| call.bind(target, argument));
    // A socket that is closed takes what is sent without a word: who calls looks at it first.
    let _ = Reflect::set(&bound, &CARRIER.into(), target);
    keep(&bound);
}

/// There is none: what is there comes to rest by itself where nothing follows, as a USB adapter does.
pub(super) fn is_none() {
    keep(&JsValue::UNDEFINED);
}

fn keep(call: &JsValue) {
    let _ = Reflect::set(&window(), &CALL.into(), call);
}

/// The word that a bridge, or the machine of this page, is told.
pub(super) fn word() -> JsValue {
    serde_json::to_string(&Ask::Stop).map_or(JsValue::UNDEFINED, JsValue::from)
}
