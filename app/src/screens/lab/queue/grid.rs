//! The rows of the queue: a treegrid edited by keyboard or pointer.
//!
//! ```text
//! ↑ ↓ rows │ Enter into the row, Escape out │ Alt+↑ Alt+↓ move │ Ctrl+D double │ Insert │ Delete
//! F9 breakpoint
//! ```

use crate::i18n::{self, advice, message, say, t};
use crate::keys;
use crate::lab::queue::{QueueEdit, QueueLine, levels};
use crate::model::LabEvent;
use crate::page::{lab, peek, read, send};
use crate::readout::short;
use crate::widgets::{menu_word, typed_input};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::queue::{ArgumentKind, RowState, WORDS, Word};
use leptos::ev::{self, KeyboardEvent};
use leptos::html::{button, div, select, small, span};
use leptos::prelude::*;
use wasm_bindgen::JsCast;
use web_sys::HtmlElement;

fn row_id(at: usize) -> String {
    format!("queue-row-{at}")
}

/// The grid, rebuilt only when the number of lines changes.
pub(super) fn grid() -> impl IntoView {
    let count = Memo::new(move |_| lab::lines().with(Vec::len));
    div()
        .class("queue-grid")
        .attr("role", "treegrid")
        .attr("aria-label", t!("page.lab.queue.grid"))
        .attr("aria-readonly", move || lab::locked().then_some("true"))
        .on(ev::keydown, move |event| pressed(&event))
        .child((heads(), move || (0..count.get()).map(|at| row(at).into_any()).collect::<Vec<_>>()))
}

fn heads() -> impl IntoView {
    let head = |text: fn() -> String| div().attr("role", "columnheader").child(text);
    div().attr("role", "row").class("queue-row head").child((
        head(|| say!("page.lab.queue.number")),
        head(|| say!("page.lab.queue.breakpoint")),
        head(|| say!("page.lab.queue.command")),
        head(|| say!("page.lab.queue.arguments")),
        head(|| say!("page.lab.queue.note")),
        head(|| say!("page.lab.queue.result")),
    ))
}

/// The line at `at`; empty if it was just deleted.
fn line(at: usize) -> QueueLine {
    lab::lines().with(|lines| lines.get(at).cloned().unwrap_or_default())
}

fn row(at: usize) -> impl IntoView {
    let level = move || lab::lines().with(|lines| levels(lines).get(at).copied().unwrap_or(1));
    let wrong = Memo::new(move |_| super::refusal_of(at));
    let chosen = move || read(|m| m.lab.row) == at;
    let next = move || super::next_row() == Some(at);
    div()
        .attr("role", "row")
        .attr("id", row_id(at))
        .attr("aria-level", move || level().to_string())
        .attr("aria-selected", move || if chosen() { "true" } else { "false" })
        .attr("tabindex", move || if chosen() { "0" } else { "-1" })
        .class("queue-row")
        .class(("chosen", chosen))
        .class(("next", next))
        .class(("wrong", move || wrong.with(Option::is_some)))
        .on(ev::focusin, move |_| send(LabEvent::Row { at }))
        .child((
            div().attr("role", "gridcell").class("number tabular").child(at + 1),
            div().attr("role", "gridcell").child(breakpoint(at)),
            div()
                .attr("role", "gridcell")
                .class("queue-word")
                .style(("--level", move || (level() - 1).to_string()))
                .child(words(at)),
            div().attr("role", "gridcell").child(arguments(at, wrong)),
            div().attr("role", "gridcell").child(note(at)),
            div().attr("role", "gridcell").class("queue-result").child(move || result(at, wrong.get())),
        ))
}

/// `tabindex`: only the fields of the selected row can be reached by Tab.
fn in_row(at: usize) -> &'static str {
    if read(|m| m.lab.row) == at { "0" } else { "-1" }
}

fn breakpoint(at: usize) -> impl IntoView {
    let on = move || line(at).breakpoint;
    button()
        .attr("type", "button")
        .attr("tabindex", move || in_row(at))
        .class("breakpoint")
        .attr("aria-pressed", move || if on() { "true" } else { "false" })
        .attr("aria-label", move || say!("page.lab.queue.breakpoint_at", row = at + 1))
        .on(ev::click, move |_| super::edit(None, &QueueEdit::Break { at }))
        .child(span())
}

fn beginning(word: &Word) -> String {
    let each =
        word.arguments.iter().filter(|argument| !argument.optional).map(|argument| match argument.kind {
            ArgumentKind::Whole(low, _) => low.max(0).to_string(),
            ArgumentKind::Mm(..) => "0".to_owned(),
            ArgumentKind::Choice(words) => words.first().copied().unwrap_or_default().to_owned(),
            ArgumentKind::Name => "a".to_owned(),
        });
    each.collect::<Vec<_>>().join(" ")
}

fn words(at: usize) -> impl IntoView {
    let known = move || Word::find(&line(at).word).map(|word| word.name);
    let raw = move || line(at).word;
    let options = WORDS.iter().map(|word| {
        menu_word(word.name, move || known() == Some(word.name), move || word.name.to_owned()).into_any()
    });
    let none = menu_word("", move || raw().is_empty(), t!("page.lab.queue.only_note"));
    let unknown = move || {
        (known().is_none() && !raw().is_empty())
            .then(|| leptos::html::option().attr("value", raw()).prop("selected", true).child(raw()))
    };
    let choose = move |event| {
        let name = event_target_value(&event);
        let arguments = Word::find(&name).map(beginning).unwrap_or_default();
        super::edit(None, &QueueEdit::Word { at, word: name, arguments });
    };
    select()
        .attr("tabindex", move || in_row(at))
        .attr("aria-label", move || say!("page.lab.queue.command_at", row = at + 1))
        .attr("title", move || known().and_then(Word::find).map(|word| i18n::text(&word.sentence_key(), &[])))
        .prop("disabled", lab::locked)
        .on(ev::change, choose)
        .child((none, options.collect::<Vec<_>>(), unknown))
}

/// Names and units of the arguments: `X mm, Y mm`.
fn hint(word: &str) -> String {
    let arguments = Word::find(word).map_or(&[][..], |word| word.arguments);
    let each = arguments.iter().map(|argument| {
        let words = match argument.kind {
            ArgumentKind::Choice(words) => words.join("|"),
            _ => argument.unit.to_owned(),
        };
        let text =
            if words.is_empty() { argument.name.to_owned() } else { format!("{} {words}", argument.name) };
        if argument.optional { format!("[{text}]") } else { text }
    });
    each.collect::<Vec<_>>().join(", ")
}

fn arguments(at: usize, wrong: Memo<Option<Diagnostic>>) -> impl IntoView {
    let takes = move || hint(&line(at).word);
    (
        typed_input("text", move || line(at).arguments, move || wrong.with(Option::is_some))
            .attr("tabindex", move || in_row(at))
            .attr("aria-label", move || say!("page.lab.queue.arguments_at", row = at + 1, takes = takes()))
            .prop("readOnly", lab::locked)
            .on(ev::input, move |event| {
                let field = format!("queue.arguments.{at}");
                super::edit(Some(&field), &QueueEdit::Arguments { at, text: event_target_value(&event) });
            })
            .on(ev::change, move |_| send(LabEvent::Rest)),
        small().class("quiet").attr("aria-hidden", "true").child(takes),
    )
}

fn note(at: usize) -> impl IntoView {
    typed_input("text", move || line(at).note, || false)
        .attr("tabindex", move || in_row(at))
        .attr("aria-label", move || say!("page.lab.queue.note_at", row = at + 1))
        .prop("readOnly", lab::locked)
        .on(ev::input, move |event| {
            let field = format!("queue.note.{at}");
            super::edit(Some(&field), &QueueEdit::Note { at, text: event_target_value(&event) });
        })
        .on(ev::change, move |_| send(LabEvent::Rest))
}

fn result(at: usize, wrong: Option<Diagnostic>) -> AnyView {
    if let Some(why) = wrong {
        let cure = why.clone();
        return span().class("refusal").child((move || message(&why), " ", move || advice(&cure))).into_any();
    }
    let Some(result) = super::result_of(at) else { return ().into_any() };
    let ms = short(result.ms);
    match (result.state, result.why) {
        (RowState::Waiting, _) => ().into_any(),
        (RowState::Working, _) => span().child(t!("page.lab.queue.working")).into_any(),
        (RowState::Done, _) => {
            span().class("tabular").child(t!("page.lab.queue.done", ms = ms, turns = result.turns)).into_any()
        }
        (RowState::StoppedHere, _) => span().child(t!("page.lab.queue.stopped_here")).into_any(),
        (RowState::Refused, Some(why)) => span().class("refusal").child(move || message(&why)).into_any(),
        (RowState::Refused, None) => span().class("refusal").child(t!("page.lab.queue.refused")).into_any(),
    }
}

pub(super) fn focus(at: usize) {
    request_animation_frame(move || {
        let found =
            document().get_element_by_id(&row_id(at)).and_then(|row| row.dyn_into::<HtmlElement>().ok());
        if let Some(row) = found {
            let _ = row.focus();
        }
    });
}

fn pressed(event: &KeyboardEvent) {
    let at = peek(|m| m.lab.row);
    let count = lab::lines().with_untracked(Vec::len);
    let target = event.target().and_then(|target| target.dyn_into::<HtmlElement>().ok());
    let on_row = target.as_ref().is_some_and(|target| target.get_attribute("role").as_deref() == Some("row"));
    let on_menu = target.as_ref().is_some_and(|target| target.tag_name() == "SELECT");
    let ctrl = event.ctrl_key() || event.meta_key();
    let key = keys::latin(&event.key(), &event.code()).to_ascii_lowercase();
    let edit = match (key.as_str(), event.alt_key(), ctrl) {
        ("arrowup", true, _) => Some(QueueEdit::Move { at, down: false }),
        ("arrowdown", true, _) => Some(QueueEdit::Move { at, down: true }),
        ("d", false, true) => Some(QueueEdit::Double { at }),
        ("insert", false, false) => Some(QueueEdit::Insert { at }),
        ("delete", false, false) if on_row => Some(QueueEdit::Delete { at }),
        _ => None,
    };
    if let Some(edit) = edit {
        event.prevent_default();
        super::edit(None, &edit);
        return focus(peek(|m| m.lab.row));
    }
    let to = match key.as_str() {
        _ if ctrl || event.alt_key() => return,
        "arrowup" if !on_menu => at.saturating_sub(1),
        "arrowdown" if !on_menu => (at + 1).min(count.saturating_sub(1)),
        "home" if on_row => 0,
        "end" if on_row => count.saturating_sub(1),
        "escape" if !on_row => at,
        "enter" | "f2" | "arrowright" if on_row => {
            let field = target.and_then(|row| row.query_selector("select").ok().flatten());
            if let Some(field) = field.and_then(|field| field.dyn_into::<HtmlElement>().ok()) {
                let _ = field.focus();
            }
            event.prevent_default();
            return;
        }
        _ => return,
    };
    event.prevent_default();
    send(LabEvent::Row { at: to });
    focus(to);
}
