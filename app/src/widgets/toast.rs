//! Short words in the corner that go away by themselves. Nothing about motion is ever said here.
//!
//! Comes in: text. Goes out: a line, for eight seconds.

use super::{Icon, picture_button};
use crate::i18n::t;
use leptos::html::{div, span};
use leptos::prelude::*;
use std::cell::Cell;
use std::sync::LazyLock;
use std::time::Duration;

#[derive(Clone, PartialEq)]
struct Toast {
    number: u32,
    text: String,
    act: Option<(String, fn())>,
}

static SHOWN: LazyLock<ArcRwSignal<Vec<Toast>>> = LazyLock::new(|| ArcRwSignal::new(Vec::new()));
const FOR: Duration = Duration::from_secs(8);

thread_local! {
    static NEXT: Cell<u32> = const { Cell::new(0) };
}

fn drop_toast(number: u32) {
    SHOWN.update(|toasts| toasts.retain(|toast| toast.number != number));
}

/// Shows `text`, with a button if there is something to do about it.
pub fn toast(text: String, act: Option<(String, fn())>) {
    let number = NEXT.get();
    NEXT.set(number + 1);
    SHOWN.update(|toasts| toasts.push(Toast { number, text, act }));
    set_timeout(move || drop_toast(number), FOR);
}

/// Where they are shown.
pub fn toasts() -> impl IntoView {
    div()
        .class("toasts")
        .attr("role", "status")
        .child(move || SHOWN.get().into_iter().map(|toast| line(toast).into_any()).collect::<Vec<_>>())
}

fn line(toast: Toast) -> impl IntoView {
    let number = toast.number;
    let act = toast.act.map(|(name, act)| {
        super::push(
            "button small",
            move || name.clone(),
            move |_| {
                drop_toast(number);
                act();
            },
        )
    });
    div().class("toast").child((
        span().class("grow").child(toast.text),
        act,
        picture_button(Icon::Cross, t!("page.close"), move |_| drop_toast(number)),
    ))
}
