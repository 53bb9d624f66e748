//! The palette: everything that has a key, found by its words and done with Enter. What moves the machine is not in it.
//!
//! Comes in: the table of keys, what is typed. Goes out: the action that was chosen.

use super::regions;
use crate::i18n::{self, t};
use crate::keys::{KeyAction, SHORTCUTS, Shortcut};
use crate::model::{FrameEvent, Overlay};
use crate::page::{frame, send, written};
use crate::widgets::{Dialog, dialog, push};
use leptos::ev;
use leptos::html::{self, div, input, kbd, li, span, ul};
use leptos::prelude::*;

/// What of the table can be chosen on this screen: not what stops, pauses or lets keys move the machine, which have keys and
/// buttons of their own.
fn offered(shortcut: &Shortcut) -> bool {
    let here = shortcut.tab.is_none_or(|tab| tab == frame().tab.get());
    let own = matches!(
        shortcut.action,
        KeyAction::Stop | KeyAction::Escape | KeyAction::Pause | KeyAction::ArmKeys | KeyAction::Palette
    );
    here && !own && !matches!(shortcut.action, KeyAction::Queue(_))
}

fn close() {
    send(FrameEvent::Overlay { overlay: None });
}

fn choose(action: KeyAction) {
    close();
    // The dialog gives the focus back first.
    request_animation_frame(move || regions::act(action));
}

/// Where it is typed; the arrows choose, Enter does it.
fn search(
    field: NodeRef<html::Input>,
    typed: RwSignal<String>,
    at: RwSignal<usize>,
    found: Memo<Vec<usize>>,
) -> impl IntoView {
    let run = move || {
        let index = found.with_untracked(|found| found.get(at.get_untracked()).copied());
        if let Some(shortcut) = index.and_then(|index| SHORTCUTS.get(index)) {
            choose(shortcut.action);
        }
    };
    let step = move |on: bool| {
        let count = found.with_untracked(Vec::len).max(1);
        at.update(|at| *at = (*at + if on { 1 } else { count - 1 }) % count);
    };
    input()
        .node_ref(field)
        .attr("type", "text")
        .attr("role", "combobox")
        .attr("aria-expanded", "true")
        .attr("aria-controls", "palette-list")
        .attr("aria-activedescendant", move || format!("palette-{}", at.get()))
        .attr("aria-label", t!("page.palette.search"))
        .attr("placeholder", t!("page.palette.search"))
        .prop("value", move || typed.get())
        .on(ev::input, move |event| {
            typed.set(event_target_value(&event));
            at.set(0);
        })
        .on(ev::keydown, move |event| match event.key().as_str() {
            "ArrowDown" => {
                event.prevent_default();
                step(true);
            }
            "ArrowUp" => {
                event.prevent_default();
                step(false);
            }
            "Enter" => {
                event.prevent_default();
                if !event.is_composing() {
                    run();
                }
            }
            _ => {}
        })
}

/// The dialog.
pub(super) fn palette() -> impl IntoView {
    let open = Memo::new(move |_| frame().overlay.get() == Some(Overlay::Palette));
    let typed = RwSignal::new(String::new());
    let at = RwSignal::new(0_usize);
    let field = NodeRef::<html::Input>::new();
    Effect::new(move |_| {
        if open.get() {
            typed.set(String::new());
            at.set(0);
            request_animation_frame(move || {
                if let Some(field) = field.get_untracked() {
                    let _ = field.focus();
                }
            });
        }
    });
    let found = Memo::new(move |_| {
        let wanted = typed.get().to_lowercase();
        let rows = SHORTCUTS.iter().enumerate().filter(|(_, shortcut)| offered(shortcut));
        let words = |shortcut: &Shortcut| i18n::text(shortcut.name, &[]).to_lowercase();
        let fits = |shortcut: &Shortcut| wanted.split_whitespace().all(|word| words(shortcut).contains(word));
        rows.filter(|(_, shortcut)| fits(shortcut)).map(|(index, _)| index).collect::<Vec<_>>()
    });
    let lines = move || {
        let rows = found.get().into_iter().enumerate().filter_map(|(row, index)| {
            let shortcut = SHORTCUTS.get(index)?;
            Some(line(row, shortcut, at).into_any())
        });
        rows.collect::<Vec<_>>()
    };
    let list =
        ul().attr("id", "palette-list").attr("role", "listbox").attr("aria-label", t!("page.palette.title"));
    dialog(
        Signal::derive(move || open.get()),
        close,
        Dialog {
            name: "palette",
            role: "dialog",
            title: Box::new(t!("page.palette.title")),
            body: div()
                .class("palette")
                .child((search(field, typed, at, found), list.child(lines)))
                .into_any(),
            foot: push("button", t!("page.close"), |_| close()).into_any(),
        },
    )
}

fn line(row: usize, shortcut: &'static Shortcut, at: RwSignal<usize>) -> impl IntoView {
    li().attr("role", "option")
        .attr("id", format!("palette-{row}"))
        .attr("aria-selected", move || if at.get() == row { "true" } else { "false" })
        .on(ev::click, move |_| choose(shortcut.action))
        .child((
            span().class("grow").child(move || i18n::text(shortcut.name, &[])),
            kbd().child(move || written(shortcut)),
        ))
}
