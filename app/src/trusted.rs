//! The page's one Trusted Types policy, `annulus`, made by `www/boot.js`: the shipped security policy lets no script
//! address through that it did not make.
//!
//! Comes in: addresses of our own scripts. Goes out: the same, vouched for. Where the browser has no Trusted Types they
//! pass as they are.

use js_sys::{Function, Reflect};
use wasm_bindgen::prelude::*;

/// The address of one of our own scripts, fit for `new Worker` and for registering the service worker.
pub fn script_url(path: &str) -> JsValue {
    vouched(path).unwrap_or_else(|| path.into())
}

fn vouched(path: &str) -> Option<JsValue> {
    let policy = Reflect::get(&js_sys::global(), &"annulusPolicy".into()).ok()?;
    let create: Function = Reflect::get(&policy, &"createScriptURL".into()).ok()?.dyn_into().ok()?;
    create.call1(&policy, &path.into()).ok()
}
