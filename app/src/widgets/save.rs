//! Saves a file that the page made as a browser download. Nothing leaves this computer.

use js_sys::Array;
use leptos::prelude::document;
use wasm_bindgen::{JsCast, JsValue};
use web_sys::{Blob, BlobPropertyBag, HtmlAnchorElement, Url};

pub fn save_file(name: &str, kind: &str, text: &str) {
    download(name, kind, &text.into());
}

pub fn save_bytes(name: &str, kind: &str, bytes: &[u8]) {
    download(name, kind, &js_sys::Uint8Array::from(bytes));
}

fn download(name: &str, kind: &str, part: &JsValue) {
    let saved = || -> Result<(), JsValue> {
        let options = BlobPropertyBag::new();
        options.set_type(kind);
        let blob = Blob::new_with_u8_array_sequence_and_options(&Array::of1(part), &options)?;
        let address = Url::create_object_url_with_blob(&blob)?;
        let link: HtmlAnchorElement = document().create_element("a")?.unchecked_into();
        link.set_href(&address);
        link.set_download(name);
        link.click();
        Url::revoke_object_url(&address)
    };
    if let Err(error) = saved() {
        web_sys::console::error_1(&error);
    }
}
