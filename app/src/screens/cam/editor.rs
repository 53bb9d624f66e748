//! The template editor: a postprocessor's file as text, help on its blocks and parameters, its problems with
//! their positions, and the output for the current program.
//!
//! ```text
//! + text ──────────────+ block, parameters ─+ output ─────────+
//! | [drill]            | hole: for every … | G0 X1.000 …      |
//! | hole = '''         | [X] [Y] [Z] …     |                  |
//! | G0 X@X@ …          | faults            |                  |
//! +────────────────────+───────────────────+──────────────────+
//! ```

use crate::i18n::{self, advice, message, say, t};
use crate::model::TemplateEvent;
use crate::model::template::OWN;
use crate::page::{computed, peek, read, send, shared, watch};
use crate::widgets::{push, save_file};
use crate::workbench::template;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::post::{BLOCKS, PARAMETERS};
use leptos::ev;
use leptos::html::{
    self, button, code, div, h2, h3, header, li, p, pre, section, span, strong, textarea, ul,
};
use leptos::prelude::*;
use web_sys::HtmlTextAreaElement;

const MOST_LINES: usize = 400;
fn text_of() -> String {
    peek(|m| m.template.text.as_deref().unwrap_or_default().to_owned())
}

pub(super) fn editor() -> impl IntoView {
    let area = NodeRef::<html::Textarea>::new();
    let file = move || computed(|m| m.template.own_name()).get().unwrap_or_else(|| OWN.to_owned());
    div().class("whole").child(div().class("template").child((
        header().child((
            h2().class("grow").child(t!("page.template.title")),
            push("button", t!("page.template.load"), |_| send(TemplateEvent::Load)),
            push("button", t!("page.template.save"), move |_| {
                let name = file().to_lowercase().replace(|sign: char| !sign.is_ascii_alphanumeric(), "-");
                let text = text_of();
                save_file(&format!("{name}.toml"), "application/toml", &text);
            }),
            push("button primary", t!("page.template.done"), |_| send(TemplateEvent::Close)),
        )),
        div().class("columns").child((written(area), hints(area), output())),
    )))
}

fn written(area: NodeRef<html::Textarea>) -> impl IntoView {
    let follow = move || {
        if let Some(area) = area.get_untracked() {
            let area: HtmlTextAreaElement = area;
            let units = area.selection_start().ok().flatten().unwrap_or(0) as usize;
            send(TemplateEvent::Cursor { at: bytes_of_units(&area.value(), units) });
        }
    };
    section().class("text").attr("aria-label", t!("page.template.text")).child(
        textarea()
            .node_ref(area)
            .attr("spellcheck", "false")
            .attr("wrap", "off")
            .attr("aria-label", t!("page.template.text"))
            .prop("value", move || {
                watch(|m| &m.template.text).get().as_deref().unwrap_or_default().to_owned()
            })
            .on(ev::input, move |event| {
                send(TemplateEvent::Keep { text: event_target_value(&event) });
                follow();
            })
            .on(ev::keyup, move |_| follow())
            .on(ev::click, move |_| follow()),
    )
}

/// Converts a browser's text position, in UTF-16 units, to bytes.
fn bytes_of_units(text: &str, units: usize) -> usize {
    let mut left = units;
    for (at, sign) in text.char_indices() {
        if left == 0 {
            return at;
        }
        left = left.saturating_sub(sign.len_utf16());
    }
    text.len()
}

fn units_of_bytes(text: &str, bytes: usize) -> u32 {
    text.get(..bytes).unwrap_or(text).encode_utf16().count() as u32
}

fn insert(area: NodeRef<html::Textarea>, word: &str) {
    let mut text = text_of();
    let at = peek(|m| m.template.cursor).min(text.len());
    if !text.is_char_boundary(at) {
        return;
    }
    text.insert_str(at, word);
    let after = units_of_bytes(&text, at + word.len());
    send(TemplateEvent::Keep { text });
    send(TemplateEvent::Cursor { at: at + word.len() });
    request_animation_frame(move || {
        if let Some(area) = area.get_untracked() {
            let _ = area.focus();
            let _ = area.set_selection_range(after, after);
        }
    });
}

fn hints(area: NodeRef<html::Textarea>) -> impl IntoView {
    let here = Memo::new(move |_| {
        watch(|m| &m.template.text)
            .with(|text| template::place(text.as_deref().unwrap_or_default(), read(|m| m.template.cursor)))
    });
    let what = move || {
        let (part, block) = here.get();
        let Some(part) = part else {
            return p().class("quiet").child(t!("page.template.nowhere")).into_any();
        };
        let rows =
            BLOCKS.iter().filter(|row| row.part == part && block.is_none_or(|block| row.block == block));
        let lines = rows.map(|row| {
            let key = format!("post.block.{}.{}", part.key(), row.block.key());
            li().child((strong().child(row.block.key()), " ", move || i18n::text(&key, &[]))).into_any()
        });
        ul().child(lines.collect::<Vec<_>>()).into_any()
    };
    let parameters = move || {
        let (_, block) = here.get();
        let rows = PARAMETERS.iter().filter(|row| block.is_some_and(|block| row.blocks.contains(&block)));
        let lines = rows.map(|row| {
            let key = format!("post.parameter.{}", row.name);
            let word = format!("@{}@", row.name);
            li().child((
                button()
                    .attr("type", "button")
                    .class("button small")
                    .on(ev::click, move |_| insert(area, &word))
                    .child(code().child(format!("@{}@", row.name))),
                span().child((move || i18n::text(&key, &[]), " ", span().class("quiet").child(row.unit))),
            ))
            .into_any()
        });
        ul().class("parameters").child(lines.collect::<Vec<_>>())
    };
    section().class("hints").attr("aria-label", t!("page.template.hints")).child((
        faults(area),
        h3().child(t!("page.template.blocks")),
        what,
        h3().child(t!("page.template.parameters")),
        parameters,
    ))
}

fn faults(area: NodeRef<html::Textarea>) -> impl IntoView {
    let go = move |line: u32| {
        let text = text_of();
        let (from, to) = (template::start_of_line(&text, line), template::start_of_line(&text, line + 1));
        if let Some(area) = area.get_untracked() {
            let _ = area.focus();
            let _ = area.set_selection_range(units_of_bytes(&text, from), units_of_bytes(&text, to));
        }
    };
    let one = move |diagnostic: Diagnostic| {
        let line = diagnostic.place.as_ref().map_or(0, |place| place.line);
        let cure = diagnostic.clone();
        li().class("notice tone-alarm")
            .child(
                div().child((
                    button()
                        .attr("type", "button")
                        .class("button small")
                        .on(ev::click, move |_| go(line))
                        .child(t!("page.template.line", line = line)),
                    strong().child(move || message(&diagnostic)),
                    move || advice(&cure),
                )),
            )
            .into_any()
    };
    move || {
        let Some(checked) = shared(|m| &m.template.checked).get() else {
            return p().class("quiet").attr("role", "status").child(t!("page.template.looking")).into_any();
        };
        let (faults, warnings) = (checked.faults.clone(), checked.warnings.clone());
        if faults.is_empty() && !warnings.is_empty() {
            let count = warnings.len();
            let title = h3().attr("role", "status").child(t!("page.template.warnings", count = count));
            return (
                title,
                ul().class("faults").child(warnings.into_iter().map(warning).collect::<Vec<_>>()),
            )
                .into_any();
        }
        if faults.is_empty() {
            return p()
                .class("tag tone-run")
                .attr("role", "status")
                .child(t!("page.template.sound"))
                .into_any();
        }
        let count = faults.len();
        (
            h3().attr("role", "status").child(t!("page.template.faults", count = count)),
            ul().class("faults").child(faults.into_iter().map(one).collect::<Vec<_>>()),
        )
            .into_any()
    }
}

fn warning(diagnostic: Diagnostic) -> AnyView {
    let cure = diagnostic.clone();
    let said = (strong().child(move || message(&diagnostic)), " ", move || advice(&cure));
    li().class("notice tone-pause").child(div().child(said)).into_any()
}

fn output() -> impl IntoView {
    let text = move || {
        shared(|m| &m.template.checked).with(|checked| {
            let lines: Vec<&str> = checked.iter().flat_map(|it| it.output.lines()).take(MOST_LINES).collect();
            lines.join("\n")
        })
    };
    let title = move || {
        let of_job = read(|m| m.template.checked.as_ref().is_none_or(|checked| checked.of_program));
        if of_job { say!("page.template.output") } else { say!("page.template.sample") }
    };
    // `aria-label` needs a role; a `pre` alone has none.
    let shown = pre().attr("tabindex", "0").attr("role", "group").attr("aria-label", title).child(text);
    section().class("output").attr("aria-label", t!("page.template.output")).child((h3().child(title), shown))
}
