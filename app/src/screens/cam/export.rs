//! The job in a controller's words: which dialect, and the files of all its sides, in one zip where they are several. Not before
//! every finding was seen.
//!
//! Comes in: the job. Goes out: downloads, of the project too; the run sheet; the way to the template editor.

use super::editor::{Sheet, sheet};
use super::run_sheet;
use crate::document::{self, desk};
use crate::engine::Stopped;
use crate::engine::messages::{Exported, ToExport};
use crate::i18n::{advice, language, message, say, t};
use crate::state::state;
use crate::widgets::{push, push_if, save_bytes, save_file};
use crate::workbench::{bench, edit};
use annulus_core::artwork;
use annulus_core::board::Face;
use annulus_core::post::{self, RunSheet};
use annulus_core::remark::Remark;
use leptos::ev;
use leptos::html::{div, h2, header, input, label, li, ol, option, p, section, select, span};
use leptos::prelude::*;

/// The block.
pub(super) fn export() -> impl IntoView {
    let sheet = sheet();
    let refused = RwSignal::new(Vec::<Remark>::new());
    let said = RwSignal::new(None::<Said>);
    Effect::new(move |_| {
        // What was written is not what the job says any more.
        bench().work.track();
        said.set(None);
        refused.set(Vec::new());
    });
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
        buttons(sheet, lines_only, said, refused),
        move || (super::unread() > 0).then(|| p().class("quiet").child(t!("page.cam.unread_first"))),
        why,
        move || said.get().map(told),
    ))
}

/// Whether anything may be written.
fn ready() -> bool {
    state().job.with(Option::is_some) && super::cleared()
}

/// The template editor, the run sheet, the project and the programs.
fn buttons(
    sheet: Sheet,
    lines_only: RwSignal<bool>,
    said: RwSignal<Option<Said>>,
    refused: RwSignal<Vec<Remark>>,
) -> impl IntoView {
    div().class("buttons").child((
        push("button", t!("page.cam.template"), move |_| sheet.open_for_target()),
        push_if("button", ready, t!("page.cam.run_sheet"), move |_| {
            leptos::task::spawn_local(async move {
                outcome(write(sheet, lines_only.get_untracked()).await, said, refused, &|exported| {
                    run_sheet::shown().set(Some(exported.sheet.clone()));
                    None
                });
            });
        }),
        push("button", t!("page.cam.save_project"), move |_| {
            leptos::task::spawn_local(async move { refused.set(save_project().await) });
        }),
        push_if("button primary wide", ready, t!("page.cam.save_files"), move |_| {
            leptos::task::spawn_local(async move {
                let target = sheet.target.get_untracked();
                outcome(write(sheet, lines_only.get_untracked()).await, said, refused, &|exported| {
                    Some(save(exported, &target))
                });
            });
        }),
    ))
}

/// What came of an export.
#[derive(Clone, PartialEq)]
enum Said {
    /// These files were saved, in the order of running.
    Saved(Vec<String>),
    /// Nothing was: on these sides something was not read.
    Unread(Vec<(Face, u32)>),
    /// The files could not be packed.
    Refused(Remark),
}

fn told(said: Said) -> AnyView {
    match said {
        Said::Saved(names) => {
            let lines: Vec<_> = names.into_iter().map(|name| li().child(name)).collect();
            div()
                .class("written")
                .attr("role", "status")
                .child((p().class("quiet").child(t!("page.cam.written")), ol().child(lines)))
                .into_any()
        }
        Said::Unread(sides) => {
            let lines = sides.into_iter().map(|(face, count)| unread_side(face, count));
            div().class("written").attr("role", "alert").child(lines.collect::<Vec<_>>()).into_any()
        }
        Said::Refused(why) => {
            let cure = why.clone();
            let text = (move || message(&why), " ", move || advice(&cure));
            p().class("refusal").attr("role", "alert").child(text).into_any()
        }
    }
}

/// A side with something unread, and the way there.
fn unread_side(face: Face, count: u32) -> AnyView {
    let name = move || match face {
        Face::Top => say!("page.cam.word.top"),
        Face::Bottom => say!("page.cam.word.bottom"),
    };
    let up = bench().work.with_untracked(|work| work.as_ref().is_some_and(|work| work.setup.face == face));
    let go = (!up).then(|| {
        push(
            "button small",
            move || say!("page.cam.show_side", side = name()),
            move |_| {
                bench().change(None, |work| edit::turned(work, face));
            },
        )
    });
    div()
        .class("row refusal")
        .child((span().child(move || say!("page.cam.unread_side", side = name(), count = count)), go))
        .into_any()
}

/// Tells what came of an export, and lets `take` have it where something was written.
fn outcome(
    answer: Result<Exported, Stopped>,
    said: RwSignal<Option<Said>>,
    refused: RwSignal<Vec<Remark>>,
    take: &dyn Fn(&Exported) -> Option<Said>,
) {
    refused.set(Vec::new());
    match answer {
        Ok(exported) if exported.unread.is_empty() => said.set(take(&exported)),
        Ok(exported) => said.set(Some(Said::Unread(exported.unread))),
        Err(Stopped::Refused(why)) => refused.set(why),
        Err(Stopped::Cancelled) => {}
    }
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

/// All sides in the words of the controller, without arcs where `lines_only`.
async fn write(sheet: Sheet, lines_only: bool) -> Result<Exported, Stopped> {
    let read = bench().read.get_untracked().into_iter().collect();
    let (target, text) = (sheet.target.get_untracked(), sheet.own_text());
    let lines_only = lines_only.then_some(CHORD_ERROR_MM);
    document::export(|plan| ToExport { plan, read, target, text, lines_only, language: language() }).await
}

/// Saves a single program as it is, and several in one zip with the run sheet.
fn save(exported: &Exported, target: &str) -> Said {
    let names: Vec<String> = exported.files.iter().map(|(name, _)| name.clone()).collect();
    if let [(name, text)] = exported.files.as_slice() {
        save_file(name, "text/plain", text);
        return Said::Saved(names);
    }
    let name =
        desk().document.with_untracked(|open| open.as_ref().map(|open| open.reading.board.name.clone()));
    let name = name.filter(|name| !name.is_empty()).unwrap_or_else(|| "board".to_owned());
    let files = exported.files.iter().map(|(name, text)| (name.clone(), text.clone().into_bytes()));
    let members: Vec<_> = files.chain([run_sheet_file(&exported.sheet)]).collect();
    match artwork::packed(&members) {
        Ok(bytes) => {
            save_bytes(&format!("{name}-{target}.zip"), "application/zip", &bytes);
            Said::Saved(names)
        }
        Err(why) => Said::Refused(why),
    }
}

/// The run sheet as a file.
fn run_sheet_file(sheet: &RunSheet) -> (String, Vec<u8>) {
    (run_sheet::FILE.to_owned(), sheet.html().into_bytes())
}
