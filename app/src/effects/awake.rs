//! Keeps the screen, and thus the computer, awake on request. Browsers release the wake lock whenever the
//! page is hidden, so it is requested again when the page is visible.

use crate::browser::{document_hidden, window};
use crate::model::FrameEvent;
use crate::page::send;
use js_sys::{Object, Reflect};
use std::cell::{Cell, RefCell};
use std::rc::Rc;
use wasm_bindgen::prelude::*;
use wasm_bindgen_futures::spawn_local;

#[wasm_bindgen]
extern "C" {
    /// `navigator.wakeLock`. web-sys offers it only with a flag that changes other types.
    #[wasm_bindgen(extends = Object)]
    type WakeLock;
    #[wasm_bindgen(method, catch)]
    async fn request(this: &WakeLock, kind: &str) -> Result<JsValue, JsValue>;

    #[wasm_bindgen(extends = Object)]
    type Sentinel;
    #[wasm_bindgen(method, catch)]
    async fn release(this: &Sentinel) -> Result<JsValue, JsValue>;
    #[wasm_bindgen(method, getter)]
    fn released(this: &Sentinel) -> bool;
    #[wasm_bindgen(method, setter)]
    fn set_onrelease(this: &Sentinel, act: &JsValue);
}

#[derive(Clone, Default)]
pub(super) struct Awake(Rc<Held>);

#[derive(Default)]
struct Held {
    wanted: Cell<bool>,
    asking: Cell<bool>,
    sentinel: RefCell<Option<Sentinel>>,
}

impl Awake {
    /// Requests the wake lock again whenever the page becomes visible.
    pub(super) fn listen(&self) {
        let own = self.clone();
        let seen = Closure::<dyn FnMut()>::new(move || own.ask());
        let Some(document) = window().document() else { return };
        let _ = document.add_event_listener_with_callback("visibilitychange", seen.as_ref().unchecked_ref());
        seen.forget();
    }

    pub(super) fn want(&self, on: bool) {
        self.0.wanted.set(on);
        if on { self.ask() } else { self.let_go() }
    }

    fn ask(&self) {
        let held = self.0.sentinel.borrow().as_ref().is_some_and(|sentinel| !sentinel.released());
        if !self.0.wanted.get() || held || self.0.asking.get() || document_hidden() {
            return;
        }
        let lock = Reflect::get(&window().navigator(), &"wakeLock".into()).ok().filter(JsValue::is_object);
        let Some(lock) = lock.map(JsValue::unchecked_into::<WakeLock>) else {
            return send(FrameEvent::Awake { held: false });
        };
        self.0.asking.set(true);
        let own = self.clone();
        spawn_local(async move {
            let given = lock.request("screen").await.ok().map(JsValue::unchecked_into::<Sentinel>);
            own.0.asking.set(false);
            let Some(sentinel) = given else { return send(FrameEvent::Awake { held: false }) };
            let lost = Closure::once_into_js(|| send(FrameEvent::Awake { held: false }));
            sentinel.set_onrelease(&lost);
            own.0.sentinel.replace(Some(sentinel));
            // The request may have been withdrawn before the browser answered.
            if own.0.wanted.get() {
                send(FrameEvent::Awake { held: true });
            } else {
                own.let_go();
            }
        });
    }

    fn let_go(&self) {
        if let Some(sentinel) = self.0.sentinel.take() {
            spawn_local(async move { drop(sentinel.release().await) });
        }
    }
}
