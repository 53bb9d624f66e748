//! A native `<dialog>`: the focus starts at its title and stays inside, Escape closes it, and STOP is repeated in it, at its place
//! in the window.
//!
//! Comes in: a title, a body, a foot. Goes out: the element, open while its signal says so.

use super::stop_zone;
use leptos::ev;
use leptos::html::{self, div, footer, h2, header};
use leptos::prelude::*;

/// What a dialog shows.
pub struct Dialog {
    /// Its name, for the element's id.
    pub name: &'static str,
    /// `dialog`, or `alertdialog` where something must be answered.
    pub role: &'static str,
    /// In its head.
    pub title: Box<dyn Fn() -> String + Send + Sync>,
    /// The middle.
    pub body: AnyView,
    /// The buttons.
    pub foot: AnyView,
}

/// Whether a dialog lies over the page.
pub fn dialog_is_open() -> bool {
    document().query_selector("dialog[open]").ok().flatten().is_some()
}

/// The dialog, open while `open` says so. `closed` is called when the person closes it.
pub fn dialog(open: Signal<bool>, closed: impl Fn() + Clone + 'static, parts: Dialog) -> impl IntoView {
    let element = NodeRef::<html::Dialog>::new();
    Effect::new(move |_| {
        let Some(element) = element.get() else { return };
        match (open.get(), element.open()) {
            (true, false) => {
                let _ = element.show_modal();
            }
            (false, true) => element.close(),
            _ => {}
        }
    });
    let title_id = format!("{}-title", parts.name);
    let title = parts.title;
    let cancel = closed.clone();
    html::dialog()
        .node_ref(element)
        .attr("role", parts.role)
        .attr("aria-labelledby", title_id.clone())
        .on(ev::Custom::<web_sys::Event>::new("cancel"), move |event: web_sys::Event| {
            event.prevent_default();
            cancel();
        })
        .on(ev::close, move |_| {
            // the event comes late: a dialog that was opened again meanwhile was not closed by the person
            let shut = element.get_untracked().is_none_or(|element| !element.open());
            if open.get_untracked() && shut {
                closed();
            }
        })
        .child((
            // The focus starts here and not on STOP, which comes first: a key that is pressed as the dialog opens presses nothing.
            header().child((
                h2().attr("id", title_id).attr("tabindex", "-1").attr("autofocus", "").child(title),
                stop_zone(),
            )),
            div().class("body").child(parts.body),
            footer().child(parts.foot),
        ))
}
