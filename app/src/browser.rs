//! The few calls to the browser that the link needs: time, addresses, small requests.
//!
//! Comes in: paths and bytes. Goes out: answers. Knows no messages.

use js_sys::{Date, Uint8Array};
use wasm_bindgen::prelude::*;
use wasm_bindgen_futures::JsFuture;
use web_sys::{Headers, RequestInit, Response, Storage, Window};

/// The element that shows the picture of a camera.
pub(crate) const CAMERA_PICTURE: &str = "camera-picture";

/// The window; there is one wherever the page runs.
pub fn window() -> Window {
    web_sys::window().expect("the page runs in a window")
}

/// Milliseconds since the page was opened; never goes back.
pub fn now_ms() -> f64 {
    window().performance().map_or_else(Date::now, |clock| clock.now())
}

/// Milliseconds since 1970, by the clock on the wall.
pub fn clock_ms() -> f64 {
    Date::now()
}

/// Whether the page is not seen.
pub fn document_hidden() -> bool {
    window().document().is_some_and(|document| document.hidden())
}

/// What is kept in this browser for the next time.
pub fn kept_storage() -> Option<Storage> {
    window().local_storage().ok().flatten()
}

/// What survives a reload of this tab and nothing else.
pub fn tab_storage() -> Option<Storage> {
    window().session_storage().ok().flatten()
}

/// An answer to a request.
pub struct HttpAnswer {
    /// HTTP status.
    pub status: u16,
    /// Its body.
    pub body: Vec<u8>,
}

/// Asks the server this page came from. None where no answer came at all.
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
