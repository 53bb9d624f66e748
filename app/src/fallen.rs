//! When the page itself breaks: say so, and offer to load it again. The bridge goes on without it.
//!
//! Comes in: a panic. Goes out: one panel, built without leptos because that may be what broke.

use crate::i18n::say;
use std::panic::{self, PanicHookInfo};
use wasm_bindgen::prelude::*;
use web_sys::{Element, HtmlElement};

/// Listens for a panic.
pub fn watch() {
    panic::set_hook(Box::new(|info: &PanicHookInfo| {
        console_error_panic_hook::hook(info);
        let _ = show();
    }));
}

fn show() -> Option<()> {
    let document = web_sys::window()?.document()?;
    let made = |tag: &str, text: &str| -> Option<Element> {
        let element = document.create_element(tag).ok()?;
        element.set_text_content(Some(text));
        Some(element)
    };
    let panel = made("div", "")?;
    panel.set_class_name("fallen");
    panel.set_attribute("role", "alert").ok()?;
    panel.append_child(made("h1", &say!("page.fallen.title"))?.as_ref()).ok()?;
    panel.append_child(made("p", &say!("page.fallen.text"))?.as_ref()).ok()?;
    let button: HtmlElement = made("button", &say!("page.fallen.reload"))?.dyn_into().ok()?;
    button.set_class_name("button large primary");
    let reload = Closure::<dyn FnMut()>::new(|| {
        let _ = web_sys::window().map(|window| window.location().reload());
    });
    button.set_onclick(Some(reload.into_js_value().unchecked_ref()));
    panel.append_child(&button).ok()?;
    document.body()?.append_child(&panel).ok()?;
    button.focus().ok()
}
