//! The export panel, which opens from the line at the foot of every screen: the postprocessor, and the files of
//! all sides, as one zip if there are several. Disabled until every problem is accepted.

use crate::format::counted_from;
use crate::i18n::{say, t};
use crate::keys::Tab;
use crate::model::export::{CHORD_ERROR_MM, ExportOutcome, Purpose};
use crate::model::template::OWN;
use crate::model::{ExportEvent, FrameEvent, TemplateEvent};
use crate::page::{board, computed, read, send, shared, watch};
use crate::screens::board::show_problems;
use crate::screens::shown::zero;
use crate::widgets::{Dialog, dialog, push, push_if, refusal, tick};
use crate::workbench::edit;
use annulus_core::board::Face;
use annulus_core::post;
use leptos::ev;
use leptos::html::{div, label, li, ol, option, p, select, span};
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

pub(crate) fn panel() -> impl IntoView {
    let open = Signal::derive(|| read(|m| m.export.open));
    // Built only while it is shown: most of the time nobody exports.
    let body = move || open.get().then(body);
    let foot = move || open.get().then(foot);
    dialog(
        open,
        close,
        Dialog {
            name: "export",
            role: "dialog",
            title: Box::new(t!("page.cam.export")),
            body: body.into_any(),
            foot: foot.into_any(),
        },
    )
}

fn close() {
    send(ExportEvent::Panel { on: false });
}

/// Closes the panel and shows CAM.
fn at_cam() {
    close();
    send(FrameEvent::Show { tab: Tab::Cam });
}

fn body() -> impl IntoView {
    let why = move || {
        let zero = zero();
        let refused = watch(|m| &m.export.refused).get().into_iter();
        refused.map(|why| refusal(counted_from(&why, zero))).collect::<Vec<_>>()
    };
    let unread = move || {
        (board::unread() > 0).then(|| {
            let solve = |_| {
                close();
                show_problems();
            };
            div().class("row").child((
                span().class("grow").child(t!("page.cam.unread_first")),
                push("button small", t!("page.problems.go_cam"), solve),
            ))
        })
    };
    (
        unread,
        controller(),
        tick(
            || read(|m| m.export.lines_only),
            t!("page.cam.lines_only", error = CHORD_ERROR_MM),
            |on| send(ExportEvent::LinesOnly { on }),
        ),
        why,
        move || watch(|m| &m.export.outcome).get().map(told),
    )
}

fn ready() -> bool {
    read(|m| m.board.job.is_some()) && board::cleared()
}

/// The buttons: template editor, project, run sheet, programs.
fn foot() -> impl IntoView {
    let write = |purpose: Purpose| send(ExportEvent::Write { purpose });
    (
        push("button", t!("page.close"), |_| close()),
        push("button", t!("page.cam.template"), |_| {
            at_cam();
            send(TemplateEvent::Open);
        }),
        push("button", t!("page.cam.save_project"), |_| send(ExportEvent::SaveProject)),
        push_if("button", ready, t!("page.cam.run_sheet"), move |_| write(Purpose::RunSheet)),
        push_if("button primary", ready, t!("page.cam.save_files"), move |_| write(Purpose::Files)),
    )
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
            move |_| {
                at_cam();
                board::change_job(None, |work| edit::turned(work, face));
            },
        )
    });
    div()
        .class("row refusal")
        .child((span().child(move || say!("page.cam.unread_side", side = name(), count = count)), go))
        .into_any()
}
