//! Short notifications that disappear by themselves. Never used for anything about motion.

use super::{Icon, picture_button};
use crate::i18n::{key, say, sentence, t};
use crate::model::{FrameEvent, Overlay, Toast, ToastAct};
use crate::page::{send, watch};
use crate::said::Text;
use leptos::html::{div, span};
use leptos::prelude::*;

pub fn toast(text: Text) {
    send(FrameEvent::Say { text });
}

/// The message, preceded by the file if it is about one.
fn whole(text: &Text) -> String {
    let file = match text {
        Text::Found(diagnostic) => diagnostic.place.as_ref().map(|place| place.file.clone()),
        Text::Key { .. } => None,
    };
    match file.filter(|file| !file.is_empty()) {
        Some(file) => say!("page.open.of_file", file = file, what = sentence(text)),
        None => sentence(text),
    }
}

pub fn toasts() -> impl IntoView {
    let lines = || {
        watch(|m| &m.frame.toasts).get().into_iter().map(|toast| line(toast).into_any()).collect::<Vec<_>>()
    };
    div().class("toasts").attr("role", "status").child(lines)
}

fn line(toast: Toast) -> impl IntoView {
    let Toast { number, text, act } = toast;
    let planned = matches!(&text, Text::Key { key, .. } if *key == key!("page.machines.planned_for"));
    let list = planned.then(|| {
        super::push("button small", t!("page.machines.show_changes"), |_| {
            send(FrameEvent::Overlay { overlay: Some(Overlay::Machines) });
        })
    });
    let act = act.map(|act| {
        let name = match act {
            ToastAct::Review => key!("page.open.review"),
            ToastAct::UndoSettings => key!("page.settings.undo"),
            ToastAct::Update => key!("page.update.take"),
            ToastAct::DrawnBefore => key!("page.draw.back"),
            ToastAct::BoardBefore => key!("page.draw.back_to_board"),
            ToastAct::TakeAnew => key!("page.anew.take"),
            ToastAct::MachineBefore => key!("page.machines.undo"),
            ToastAct::TakeBackBoard { .. } | ToastAct::TakeBackDrawing { .. } => key!("page.kept.take_back"),
        };
        super::push(
            "button small",
            move || crate::i18n::text(name, &[]),
            move |_| send(FrameEvent::Taken { number }),
        )
    });
    div().class("toast").child((
        span().class("grow").child(move || whole(&text)),
        list,
        act,
        picture_button(Icon::Cross, t!("page.close"), move |_| send(FrameEvent::Said { number })),
    ))
}
