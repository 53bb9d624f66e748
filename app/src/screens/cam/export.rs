//! Export: the postprocessor, and the files of all sides, as one zip if there are several. Disabled until
//! every problem is accepted.

use crate::format::counted_from;
use crate::i18n::{say, t};
use crate::model::export::{CHORD_ERROR_MM, ExportOutcome, Purpose};
use crate::model::template::OWN;
use crate::model::{ExportEvent, TemplateEvent};
use crate::page::{board, computed, read, send, shared, watch};
use crate::screens::shown::zero;
use crate::widgets::{push, push_if, refusal, tick};
use crate::workbench::edit;
use annulus_core::board::Face;
use annulus_core::post;
use leptos::ev;
use leptos::html::{div, h2, header, label, li, ol, option, p, section, select, span};
use leptos::prelude::*;

pub(crate) fn controller() -> impl IntoView {
    let names = post::targets().into_iter().map(|name| {
        option()
            .attr("value", name)
            .prop("selected", move || watch(|m| &m.template.target).get() == name)
            .child(name)
    });
    let own = move || {
        let named = computed(|m| m.template.own_name()).get();
        named.map(|name| {
            option()
                .attr("value", OWN)
                .prop("selected", move || watch(|m| &m.template.target).get() == OWN)
                .child(name)
        })
    };
    label().class("field").child((
        span().child(t!("page.cam.controller")),
        select()
            .on(ev::change, |event| send(TemplateEvent::Target { name: event_target_value(&event) }))
            .child((names.collect::<Vec<_>>(), own)),
    ))
}

pub(super) fn export() -> impl IntoView {
    send(ExportEvent::Shown);
    let why = move || {
        let zero = zero();
        let refused = watch(|m| &m.export.refused).get().into_iter();
        refused.map(|why| refusal(counted_from(&why, zero))).collect::<Vec<_>>()
    };
    section().class("block").attr("aria-label", t!("page.cam.export")).child((
        header().child(h2().child(t!("page.cam.export"))),
        controller(),
        tick(
            || read(|m| m.export.lines_only),
            t!("page.cam.lines_only", error = CHORD_ERROR_MM),
            |on| send(ExportEvent::LinesOnly { on }),
        ),
        buttons(),
        move || (board::unread() > 0).then(|| p().class("quiet").child(t!("page.cam.unread_first"))),
        why,
        move || watch(|m| &m.export.outcome).get().map(told),
    ))
}

fn ready() -> bool {
    read(|m| m.board.job.is_some()) && board::cleared()
}

/// The buttons: template editor, run sheet, project, programs.
fn buttons() -> impl IntoView {
    let write = |purpose: Purpose| send(ExportEvent::Write { purpose });
    div().class("buttons").child((
        push("button", t!("page.cam.template"), |_| send(TemplateEvent::Open)),
        push_if("button", ready, t!("page.cam.run_sheet"), move |_| write(Purpose::RunSheet)),
        push("button", t!("page.cam.save_project"), |_| send(ExportEvent::SaveProject)),
        push_if("button primary wide", ready, t!("page.cam.save_files"), move |_| write(Purpose::Files)),
    ))
}

fn told(outcome: ExportOutcome) -> AnyView {
    match outcome {
        ExportOutcome::Saved { names } => {
            let lines: Vec<_> = names.into_iter().map(|name| li().child(name)).collect();
            div()
                .class("written")
                .attr("role", "status")
                .child((p().class("quiet").child(t!("page.cam.written")), ol().child(lines)))
                .into_any()
        }
        ExportOutcome::Unread { sides } => {
            let lines = sides.into_iter().map(|(face, count)| unread_side(face, count));
            div().class("written").attr("role", "alert").child(lines.collect::<Vec<_>>()).into_any()
        }
        ExportOutcome::Refused { why } => refusal(why),
    }
}

/// A side with problems that aren't accepted, with a button that leads to it.
fn unread_side(face: Face, count: u32) -> AnyView {
    let name = move || match face {
        Face::Top => say!("page.cam.word.top"),
        Face::Bottom => say!("page.cam.word.bottom"),
    };
    let up = shared(|m| &m.job.work)
        .with_untracked(|work| work.as_ref().is_some_and(|work| work.setup.face == face));
    let go = (!up).then(|| {
        push(
            "button small",
            move || say!("page.cam.show_side", side = name()),
            move |_| board::change_job(None, |work| edit::turned(work, face)),
        )
    });
    div()
        .class("row refusal")
        .child((span().child(move || say!("page.cam.unread_side", side = name(), count = count)), go))
        .into_any()
}
