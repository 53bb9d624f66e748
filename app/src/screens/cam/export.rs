//! The program in a controller's words: which dialect, and the files. Not before every finding was seen.
//!
//! Comes in: the planned program. Goes out: downloads, of the project too; the way to the template editor.

use super::editor::{Sheet, sheet};
use crate::document::{self, desk};
use crate::engine::Stopped;
use crate::engine::messages::{Settings, ToWrite};
use crate::i18n::{advice, message, t};
use crate::state::state;
use crate::widgets::{push, push_if, save_bytes, save_file};
use annulus_core::post;
use annulus_core::remark::Remark;
use leptos::ev;
use leptos::html::{div, h2, header, input, label, option, p, section, select, span};
use leptos::prelude::*;

/// The block.
pub(super) fn export() -> impl IntoView {
    let sheet = sheet();
    let refused = RwSignal::new(Vec::<Remark>::new());
    let lines_only = RwSignal::new(false);
    let names = post::targets().into_iter().map(|name| {
        option().attr("value", name).prop("selected", move || sheet.target.get() == name).child(name)
    });
    let own = move || {
        let named = sheet.own_name.get();
        named.map(|name| {
            option().attr("value", OWN).prop("selected", move || sheet.target.get() == OWN).child(name)
        })
    };
    let ready = move || state().job.with(Option::is_some) && super::cleared();
    let why = move || {
        refused
            .get()
            .into_iter()
            .map(|remark| {
                let cure = remark.clone();
                p().class("refusal")
                    .attr("role", "alert")
                    .child((move || message(&remark), " ", move || advice(&cure)))
                    .into_any()
            })
            .collect::<Vec<_>>()
    };
    section().class("block").attr("aria-label", t!("page.cam.export")).child((
        header().child(h2().child(t!("page.cam.export"))),
        label().class("field").child((
            span().child(t!("page.cam.controller")),
            select()
                .on(ev::change, move |event| sheet.target.set(event_target_value(&event)))
                .child((names.collect::<Vec<_>>(), own)),
        )),
        label().class("tick").child((
            input()
                .attr("type", "checkbox")
                .prop("checked", move || lines_only.get())
                .on(ev::change, move |event| lines_only.set(event_target_checked(&event))),
            span().child(t!("page.cam.lines_only", error = CHORD_ERROR_MM)),
        )),
        div().class("buttons").child((
            push("button", t!("page.cam.template"), move |_| sheet.open_for_target()),
            push_if("button primary", ready, t!("page.cam.save_files"), move |_| {
                leptos::task::spawn_local(async move {
                    refused.set(save(sheet, lines_only.get_untracked()).await);
                });
            }),
            push("button", t!("page.cam.save_project"), move |_| {
                leptos::task::spawn_local(async move { refused.set(save_project().await) });
            }),
        )),
        move || (super::unread() > 0).then(|| p().class("quiet").child(t!("page.cam.unread_first"))),
        why,
    ))
}

/// The word of the person's own template in the menu.
pub(super) const OWN: &str = "own";

/// How far lines may be off the arcs that they stand for, in mm.
const CHORD_ERROR_MM: f64 = 0.005;

/// Saves the files of the board, what was said of them and the job; what stood in the way.
async fn save_project() -> Vec<Remark> {
    let name =
        desk().document.with_untracked(|open| open.as_ref().map(|open| open.reading.board.name.clone()));
    let name = name.filter(|name| !name.is_empty()).unwrap_or_else(|| "board".to_owned());
    match document::saved().await {
        Some(Ok(bytes)) => save_bytes(&format!("{name}.annulus"), "application/zip", &bytes),
        Some(Err(why)) => return why,
        None => {}
    }
    Vec::new()
}

/// Writes the program and saves its files, without arcs where `lines_only`; what stood in the way.
async fn save(sheet: Sheet, lines_only: bool) -> Vec<Remark> {
    let Some(job) = state().job.get_untracked() else { return Vec::new() };
    let wanted = ToWrite {
        program: job.bytes.clone(),
        target: sheet.target.get_untracked(),
        text: sheet.own_text(),
        lines_only: lines_only.then_some(CHORD_ERROR_MM),
        machine: Some(state().machine.with_untracked(|machine| Settings::of(machine))),
        briefing: desk().plan.with_untracked(|plan| {
            plan.as_ref().filter(|plan| plan.key == job.key).map(|plan| plan.briefing.clone())
        }),
    };
    match sheet.write(wanted).await {
        Ok(files) => {
            for (name, text) in files {
                let kind = if name.ends_with(".html") { "text/html" } else { "text/plain" };
                save_file(&name, kind, &text);
            }
            Vec::new()
        }
        Err(Stopped::Refused(why)) => why,
        Err(Stopped::Cancelled) => Vec::new(),
    }
}
