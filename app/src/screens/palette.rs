//! The command palette: finds shortcuts and other commands of the screen by words; Enter runs one. Commands
//! that move the machine are not in it.

use super::drawing::{self, may};
use super::{machine, regions};
use crate::drawing::{DrawKey, When};
use crate::i18n::{self, t};
use crate::keys::{COMMANDS, KeyAction, Keyless, SHORTCUTS, Shortcut, Tab};
use crate::model::drawing::DrawingExport;
use crate::model::export::Purpose;
use crate::model::{AnewEvent, DrawEvent, ExportEvent, FilesEvent, FrameEvent, LevelEvent, Overlay};
use crate::page::{board, read, send, written};
use crate::widgets::{Dialog, dialog, push};
use leptos::ev;
use leptos::html::{self, div, input, kbd, li, span, ul};
use leptos::prelude::*;

/// True if a shortcut belongs in the palette on this screen. Stop, pause and jog arming are left out: they
/// have their own keys and buttons.
fn offered(shortcut: &Shortcut) -> bool {
    let here = shortcut.tab.is_none_or(|tab| tab == read(|m| m.frame.tab));
    let own = matches!(
        shortcut.action,
        KeyAction::Stop | KeyAction::Escape | KeyAction::Pause | KeyAction::ArmKeys | KeyAction::Palette
    );
    here && !own && !matches!(shortcut.action, KeyAction::Queue(_)) && can_be_done(shortcut.action)
}

/// True if a command is possible now, by the same rule as its button.
fn can_be_done(action: KeyAction) -> bool {
    match action {
        KeyAction::Keyless(Keyless::NewExports | Keyless::CloseBoard) => read(|m| m.board.document.is_some()),
        KeyAction::Keyless(Keyless::Export | Keyless::RunSheet) => {
            read(|m| m.board.job.is_some()) && board::cleared()
        }
        KeyAction::Keyless(Keyless::Array) => may(When::ARRAY),
        KeyAction::Keyless(Keyless::UseBoard) => is_drawn() || read(|m| m.draw.over().0),
        KeyAction::Keyless(Keyless::SaveBoard | Keyless::SaveSvg | Keyless::SaveDrawing) => is_drawn(),
        KeyAction::Draw(DrawKey::Group) => may(When::GROUP),
        KeyAction::Draw(DrawKey::Act(act)) => may(act.when()),
        KeyAction::Keyless(Keyless::HeightMap) => machine::set_up_is_seen(),
        KeyAction::Keyless(Keyless::LargeView { on }) => {
            read(|m| m.link.ever) && read(|m| m.frame.operator) != on
        }
        _ => true,
    }
}

fn is_drawn() -> bool {
    read(|m| !m.draw.editor.drawing().is_empty())
}

/// The palette's commands; the first of several shortcuts for one action, then commands without a key.
fn rows() -> Vec<&'static Shortcut> {
    let mut rows: Vec<&'static Shortcut> = Vec::new();
    for shortcut in SHORTCUTS.iter().chain(COMMANDS).filter(|shortcut| offered(shortcut)) {
        if rows.iter().all(|row| row.action != shortcut.action) {
            rows.push(shortcut);
        }
    }
    rows
}

fn close() {
    send(FrameEvent::Overlay { overlay: None });
}

fn choose(action: KeyAction) {
    close();
    // Wait a frame: the closing dialog first returns the focus.
    request_animation_frame(move || match action {
        KeyAction::Keyless(command) => do_command(command),
        action => regions::act(action),
    });
}

fn do_command(command: Keyless) {
    match command {
        Keyless::NewExports => send(AnewEvent::Choose),
        Keyless::CloseBoard => send(FilesEvent::Discarded),
        Keyless::Export => {
            // The panel shows the answer.
            send(ExportEvent::Panel { on: true });
            send(ExportEvent::Write { purpose: Purpose::Files });
        }
        Keyless::RunSheet => send(ExportEvent::Write { purpose: Purpose::RunSheet }),
        Keyless::Array => send(FrameEvent::Overlay { overlay: Some(Overlay::Array) }),
        Keyless::Edge => drawing::draw_edge(),
        Keyless::UseBoard => send(DrawEvent::Use { tab: Tab::Cam }),
        Keyless::NewDrawing => send(DrawEvent::New),
        Keyless::SaveBoard => send(DrawEvent::Export { what: DrawingExport::Board }),
        Keyless::SaveSvg => send(DrawEvent::Export { what: DrawingExport::Svg }),
        Keyless::SaveDrawing => send(DrawEvent::Export { what: DrawingExport::Drawing }),
        Keyless::HeightMap => send(LevelEvent::Show { on: true }),
        Keyless::LargeView { on } => send(FrameEvent::Operator { on }),
    }
}

/// The search field: arrows select a row, Enter runs it.
fn search(
    field: NodeRef<html::Input>,
    typed: RwSignal<String>,
    at: RwSignal<usize>,
    found: Memo<Vec<&'static Shortcut>>,
) -> impl IntoView {
    let run = move || {
        if let Some(shortcut) = found.with_untracked(|found| found.get(at.get_untracked()).copied()) {
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

pub(super) fn palette() -> impl IntoView {
    let open = move || read(|m| m.frame.overlay == Some(Overlay::Palette));
    let typed = RwSignal::new(String::new());
    let at = RwSignal::new(0_usize);
    let field = NodeRef::<html::Input>::new();
    Effect::new(move |_| {
        if open() {
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
        if !open() {
            return Vec::new();
        }
        let wanted = typed.get().to_lowercase();
        let words = |shortcut: &Shortcut| i18n::text(shortcut.name, &[]).to_lowercase();
        let fits = |shortcut: &Shortcut| wanted.split_whitespace().all(|word| words(shortcut).contains(word));
        rows().into_iter().filter(|shortcut| fits(shortcut)).collect::<Vec<_>>()
    });
    let lines = move || {
        let rows = found.get().into_iter().enumerate();
        rows.map(|(row, shortcut)| line(row, shortcut, at).into_any()).collect::<Vec<_>>()
    };
    let list =
        ul().attr("id", "palette-list").attr("role", "listbox").attr("aria-label", t!("page.palette.title"));
    dialog(
        Signal::derive(open),
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
            (!shortcut.keys.is_empty()).then(|| kbd().child(move || written(shortcut))),
        ))
}
