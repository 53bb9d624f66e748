//! A native `<dialog>`. Focus starts at the title and stays inside; Escape closes it. Contains its own STOP
//! button.

use super::stop_zone;
use leptos::ev;
use leptos::html::{self, div, footer, h2, header};
use leptos::prelude::*;

pub struct Dialog {
    /// Part of the element's id.
    pub name: &'static str,
    /// `dialog`, or `alertdialog` if the user must answer.
    pub role: &'static str,
    pub title: Box<dyn Fn() -> String + Send + Sync>,
    pub body: AnyView,
    pub foot: AnyView,
}

pub fn dialog_is_open() -> bool {
    document().query_selector("dialog[open]").ok().flatten().is_some()
}

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
            // The close event arrives late: if the dialog was opened again meanwhile, the user didn't close
            // it.
            let shut = element.get_untracked().is_none_or(|element| !element.open());
            if open.get_untracked() && shut {
                closed();
            }
        })
        .child((
            // Focus starts here, not on STOP, the first button: a key pressed as the dialog opens must not
            // press a button.
            header().child((
                h2().attr("id", title_id).attr("tabindex", "-1").attr("autofocus", "").child(title),
                stop_zone(),
            )),
            div().class("body").child(parts.body),
            footer().child(parts.foot),
        ))
}
