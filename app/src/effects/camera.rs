//! A camera over the machine: opens it, shows its picture, closes it.
//!
//! ```text
//! wanted ─▶ getUserMedia ─▶ stream ─▶ <video>        denied, absent, busy: a message
//!                              └ ended: unplugged ─▶ a message
//! ```
//!
//! The picture is neither saved nor sent.

use crate::browser::{CAMERA_PICTURE, kept_storage};
use crate::model::{Eye, SecondSideEvent};
use crate::page::send;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::{code, error};
use js_sys::{Array, JSON, Object, Reflect};
use leptos::prelude::document;
use leptos::task::spawn_local;
use std::cell::RefCell;
use std::rc::Rc;
use wasm_bindgen::prelude::*;

/// Constraints: prefer the rear camera of a phone or tablet, and a width of 1280 px.
const WANTED: &str =
    r#"{"audio":false,"video":{"facingMode":{"ideal":"environment"},"width":{"ideal":1280}}}"#;
const KEPT: &str = "annulus.camera_offset";

#[wasm_bindgen]
extern "C" {
    #[wasm_bindgen(extends = Object)]
    type Devices;
    #[wasm_bindgen(method, catch, js_name = getUserMedia)]
    async fn get_user_media(this: &Devices, wanted: &JsValue) -> Result<JsValue, JsValue>;

    #[wasm_bindgen(extends = Object)]
    #[derive(Clone)]
    type CameraStream;
    #[wasm_bindgen(method, js_name = getTracks)]
    fn tracks(this: &CameraStream) -> Array;

    #[wasm_bindgen(extends = Object)]
    type CameraTrack;
    #[wasm_bindgen(method)]
    fn stop(this: &CameraTrack);
    #[wasm_bindgen(method, setter, js_name = onended)]
    fn set_onended(this: &CameraTrack, listener: &JsValue);
}

#[derive(Clone, Default)]
pub(super) struct Camera {
    stream: Rc<RefCell<Option<CameraStream>>>,
}

/// Restores the offset from the last visit.
pub(super) fn begin() {
    let kept = kept_storage().and_then(|storage| storage.get_item(KEPT).ok().flatten());
    let numbers = kept.and_then(|text| {
        let (x, y) = text.split_once(' ')?;
        let mm = |word: &str| word.parse::<f64>().ok().filter(|mm| mm.abs() < 1_000.0);
        Some([mm(x)?, mm(y)?])
    });
    if let Some(offset_mm) = numbers {
        send(SecondSideEvent::Kept { offset_mm });
    }
}

pub(super) fn keep([x, y]: [f64; 2]) {
    if let Some(storage) = kept_storage() {
        let _full_or_denied_is_no_harm = storage.set_item(KEPT, &format!("{x} {y}"));
    }
}

fn eye(eye: Eye) {
    send(SecondSideEvent::Eye { eye });
}

fn devices() -> Option<Devices> {
    let navigator = web_sys::window()?.navigator();
    let devices = Reflect::get(&navigator, &"mediaDevices".into()).ok()?;
    (!devices.is_undefined()).then(|| devices.unchecked_into())
}

/// The message for an error's name.
fn blind(error: &JsValue) -> Diagnostic {
    let name = Reflect::get(error, &"name".into()).ok().and_then(|name| name.as_string()).unwrap_or_default();
    Diagnostic::error(match name.as_str() {
        "NotAllowedError" | "SecurityError" => code!("camera.denied"),
        "NotReadableError" | "AbortError" => code!("camera.busy"),
        _ => code!("camera.none"),
    })
}

impl Camera {
    pub(super) fn want(&self, on: bool) {
        self.shut();
        if !on {
            return;
        }
        let camera = self.clone();
        spawn_local(async move {
            let Some(devices) = devices() else {
                return eye(Eye::Blind(error!("camera.none")));
            };
            let wanted = JSON::parse(WANTED).unwrap_or(JsValue::NULL);
            match devices.get_user_media(&wanted).await {
                Ok(stream) => camera.show(stream.unchecked_into()),
                Err(error) => eye(Eye::Blind(blind(&error))),
            }
        });
    }

    /// Shows the stream. A stream ends without our request if the cable is pulled or the user withdraws the
    /// permission.
    fn show(&self, stream: CameraStream) {
        self.shut();
        let ended = Closure::<dyn FnMut()>::new(|| eye(Eye::Blind(error!("camera.lost"))));
        for track in stream.tracks() {
            track.unchecked_into::<CameraTrack>().set_onended(ended.as_ref());
        }
        // Leaked: a page opens a camera only a few times.
        ended.forget();
        put(&stream);
        *self.stream.borrow_mut() = Some(stream);
        eye(Eye::Open);
    }

    fn shut(&self) {
        if let Some(stream) = self.stream.borrow_mut().take() {
            for track in stream.tracks() {
                let track: CameraTrack = track.unchecked_into();
                track.set_onended(&JsValue::NULL);
                track.stop();
            }
            put(&JsValue::NULL);
        }
    }
}

fn put(stream: &JsValue) {
    if let Some(picture) = document().get_element_by_id(CAMERA_PICTURE) {
        let _no_picture_is_seen_then = Reflect::set(&picture, &"srcObject".into(), stream);
    }
}
