//! The browser functions that the link needs: time, URLs, small requests.

use js_sys::{Date, Uint8Array};
use wasm_bindgen::prelude::*;
use wasm_bindgen_futures::JsFuture;
use web_sys::{Headers, RequestInit, Response, Storage, Window};

pub(crate) const CAMERA_PICTURE: &str = "camera-picture";

/// The window. Every context that runs this code has one.
pub fn window() -> Window {
    web_sys::window().expect("the page runs in a window")
}

/// Milliseconds since the page was opened; monotonic.
pub fn now_ms() -> f64 {
    window().performance().map_or_else(Date::now, |clock| clock.now())
}

/// Milliseconds since 1970, by the system clock.
pub fn clock_ms() -> f64 {
    Date::now()
}

/// True if the page is not visible.
pub fn document_hidden() -> bool {
    window().document().is_some_and(|document| document.hidden())
}

/// Local storage: survives closing the browser.
pub fn kept_storage() -> Option<Storage> {
    window().local_storage().ok().flatten()
}

/// Session storage: survives only a reload of this tab.
pub fn tab_storage() -> Option<Storage> {
    window().session_storage().ok().flatten()
}

pub struct HttpAnswer {
    pub status: u16,
    pub body: Vec<u8>,
}

/// Sends a request to the server of this page. None if there was no response.
pub async fn request(
    method: &str,
    path: &str,
    headers: &[(&str, &str)],
    body: Option<&[u8]>,
) -> Option<HttpAnswer> {
    let names = Headers::new().ok()?;
    for (name, value) in headers {
        names.append(name, value).ok()?;
    }
    let init = RequestInit::new();
    init.set_method(method);
    init.set_headers(names.as_ref());
    if let Some(bytes) = body {
        init.set_body(Uint8Array::from(bytes).as_ref());
    }
    let answer = JsFuture::from(window().fetch_with_str_and_init(path, &init)).await.ok()?;
    let answer: Response = answer.dyn_into().ok()?;
    let bytes = JsFuture::from(answer.array_buffer().ok()?).await.ok()?;
    Some(HttpAnswer { status: answer.status(), body: Uint8Array::new(&bytes).to_vec() })
}
