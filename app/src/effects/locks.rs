//! Locks of the browser, by which the tabs of a site agree who has what. One ends by itself with the tab that holds it.
//!
//! Comes in: names. Goes out: what is held. Where the browser has no locks every one is free. Does not know what they stand for.

use crate::browser::window;
use js_sys::{Array, Function, Object, Promise, Reflect};
use std::collections::BTreeSet;
use wasm_bindgen::prelude::*;
use wasm_bindgen_futures::JsFuture;

/// A lock that this tab holds until this is dropped.
pub(super) struct Held(Option<Function>);

impl Drop for Held {
    fn drop(&mut self) {
        if let Some(release) = &self.0 {
            let _ = release.call0(&JsValue::UNDEFINED);
        }
    }
}

/// The browser's locks; none where it has none, or not for this address.
fn locks() -> Option<JsValue> {
    let locks = Reflect::get(&window().navigator(), &"locks".into()).ok()?;
    locks.is_object().then_some(locks)
}

fn method(of: &JsValue, name: &str) -> Option<Function> {
    Reflect::get(of, &name.into()).ok()?.dyn_into().ok()
}

/// A promise and what keeps it.
fn promise() -> Option<(Promise, Function)> {
    let mut kept = None;
    let promise = Promise::new(&mut |keep, _| kept = Some(keep));
    Some((promise, kept?))
}

/// Holds the lock `name`; none where somebody else does.
pub(super) async fn hold(name: &str) -> Option<Held> {
    let Some(locks) = locks() else { return Some(Held(None)) };
    let request = method(&locks, "request")?;
    let ((answer, answered), (until, release)) = (promise()?, promise()?);
    let granted = Closure::once_into_js(move |lock: JsValue| {
        let is_ours = lock.is_object();
        let _ = answered.call1(&JsValue::UNDEFINED, &is_ours.into());
        // The browser holds it as long as this promise is open.
        if is_ours { JsValue::from(until) } else { JsValue::UNDEFINED }
    });
    let options = Object::new();
    Reflect::set(&options, &"ifAvailable".into(), &true.into()).ok()?;
    request.call3(&locks, &name.into(), &options, &granted).ok()?;
    let is_ours = JsFuture::from(answer).await.ok()?.is_truthy();
    is_ours.then_some(Held(Some(release)))
}

/// Names of the locks that any tab of this site holds.
pub(super) async fn held() -> BTreeSet<String> {
    let asked = async {
        let locks = locks()?;
        let asked: Promise = method(&locks, "query")?.call0(&locks).ok()?.dyn_into().ok()?;
        let state = JsFuture::from(asked).await.ok()?;
        let held: Array = Reflect::get(&state, &"held".into()).ok()?.dyn_into().ok()?;
        Some(held.iter().filter_map(|lock| Reflect::get(&lock, &"name".into()).ok()?.as_string()).collect())
    };
    asked.await.unwrap_or_default()
}
