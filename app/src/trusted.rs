//! The page's Trusted Types policy, `annulus`, created by `www/boot.js`. The shipped security policy rejects
//! any script URL that it didn't create. Browsers without Trusted Types accept plain URLs.

use js_sys::{Function, Reflect};
use wasm_bindgen::prelude::*;

/// The URL of one of our scripts, for `new Worker` and for registering the service worker.
pub fn script_url(path: &str) -> JsValue {
    vouched(path).unwrap_or_else(|| path.into())
}

fn vouched(path: &str) -> Option<JsValue> {
    let policy = Reflect::get(&js_sys::global(), &"annulusPolicy".into()).ok()?;
    let create: Function = Reflect::get(&policy, &"createScriptURL".into()).ok()?.dyn_into().ok()?;
    create.call1(&policy, &path.into()).ok()
}
