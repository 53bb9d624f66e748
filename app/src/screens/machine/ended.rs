//! How the last job ended, and what is really in the board: the bridge counts strokes, the virtual drill
//! knows the holes. Moves nothing.

use super::{offer, words};
use crate::i18n::{key, say, sentence, t};
use crate::keys::Tab;
use crate::model::link::drilled;
use crate::model::link::{LastJob, Notice};
use crate::model::{FrameEvent, LinkEvent, StartEvent};
use crate::page::{link, peek, read, send, shared, watch};
use crate::widgets::{Icon, icon, push, push_if};
use annulus_core::control::Ending;
use annulus_core::wire::DrilledReport;
use leptos::html::{div, li, p, span, strong, ul};
use leptos::prelude::*;

/// Differences between program and board; none if there are none, or while the machine is busy.
pub(super) fn differs() -> Option<DrilledReport> {
    let told = read(|m| m.link.status.as_ref()?.drilled.filter(|_| !m.link.busy()));
    told.filter(|told| *told != DrilledReport::default())
}

/// True if there is something to show. `closed` is the report that the user has closed.
pub(super) fn is_to_be_told(closed: Option<DrilledReport>) -> bool {
    match differs() {
        Some(told) => closed != Some(told),
        None => read(|m| m.link.ended.is_some()),
    }
}

pub(super) fn ended(closed: RwSignal<Option<DrilledReport>>) -> impl IntoView {
    let differs = Memo::new(move |_| differs());
    move || match (differs.get(), watch(|m| &m.link.ended).get()) {
        (Some(told), ended) => Some(not_as_programmed(told, ended.as_ref(), closed).into_any()),
        (None, Some(ended)) => Some(as_told(ended, offer::buttons()).into_any()),
        (None, None) => None,
    }
}

/// Text for the completed work of a job: holes, toolpaths, or both. `drills`: the job has holes.
pub(crate) fn made(drills: bool, holes: u32, toolpaths: u32) -> String {
    match (holes > 0 || drills && toolpaths == 0, toolpaths > 0) {
        (true, true) => say!("page.ended.both", holes = holes, toolpaths = toolpaths),
        (true, false) => say!("page.ended.holes", holes = holes),
        (false, _) => say!("page.ended.toolpaths", toolpaths = toolpaths),
    }
}

/// How the last job ended, on every screen but Machine, until the user closes it.
pub fn elsewhere() -> impl IntoView {
    let told = Memo::new(move |_| {
        let alarmed = read(|m| m.link.status.as_ref().is_some_and(|status| status.alarm.is_some()));
        watch(|m| &m.link.ended).get().filter(|_| !alarmed && read(|m| m.frame.tab != Tab::Machine))
    });
    let there =
        || push("button small", t!("page.tab.machine"), |_| send(FrameEvent::Show { tab: Tab::Machine }));
    move || told.get().map(|ended| as_told(ended, there()))
}

fn as_told(ended: LastJob, buttons: impl IntoView + 'static) -> impl IntoView {
    let by_you = ended.by_you.then_some(key!("page.ended.stopped_by_you"));
    let word = by_you.unwrap_or_else(|| words::ending(ended.end.ending));
    let drills = peek(|m| m.start.shown.as_ref().is_none_or(|job| job.program.hole_count() > 0));
    let (holes, toolpaths) = (ended.end.holes_done, ended.end.toolpaths_done);
    let text = move || crate::i18n::text(word, &[("made", made(drills, holes, toolpaths))]);
    let (class, sign) = match ended.end.ending {
        Ending::Done => ("notice tone-run", Icon::Check),
        Ending::StoppedAfterHole | Ending::Stopped => ("notice tone-pause", Icon::Pause),
        Ending::Alarm => ("notice tone-alarm", Icon::Alarm),
    };
    div().class(class).attr("role", "status").child((
        icon(sign),
        div().class("grow").child((span().child(text), really_there())),
        buttons,
        push("button small quiet", t!("page.close"), |_| send(LinkEvent::Close { notice: Notice::Ended })),
    ))
}

/// Differences from the program, and holes drilled twice; nothing while the machine is busy.
fn really_there() -> impl IntoView {
    let lines = Memo::new(move |_| {
        let status = shared(|m| &m.link.status).get().filter(|_| !link::busy());
        status.map(|status| drilled::lines(&status)).unwrap_or_default()
    });
    move || {
        let rows: Vec<_> =
            lines.get().into_iter().map(|text| li().child(move || sentence(&text)).into_any()).collect();
        (!rows.is_empty()).then(|| ul().class("differs").child(rows))
    }
}

fn not_as_programmed(
    told: DrilledReport,
    ended: Option<&LastJob>,
    closed: RwSignal<Option<DrilledReport>>,
) -> impl IntoView + use<> {
    let run = ended.map(|ended| ended.end.holes_done);
    let title = move || match run {
        Some(run) => {
            let there = run.saturating_sub(told.missing.saturating_add(told.shifted));
            say!("page.ended.differs_of", there = there, run = run)
        }
        None => say!("page.ended.differs"),
    };
    let uncertain = told.slipped_steps > 0 || told.shifted > 0;
    let advice = move || {
        if uncertain { say!("page.ended.differs_lost") } else { say!("page.ended.differs_do") }
    };
    let missing = Memo::new(move |_| {
        shared(|m| &m.link.status).with(|status| status.as_ref().and_then(|one| one.missing.clone()))
    });
    let again = move || {
        missing.get().map(|missing| {
            push_if("button", link::ready, t!("page.ended.again", count = told.missing), move |_| {
                send(StartEvent::Again { missing: missing.clone() });
            })
        })
    };
    div().class("notice tone-alarm").attr("role", "alert").child((
        icon(Icon::Alarm),
        div().class("grow").child((strong().child(title), really_there(), p().child(advice))),
        again,
        push("button small quiet", t!("page.close"), move |_| {
            closed.set(Some(told));
            send(LinkEvent::Close { notice: Notice::Ended });
        }),
    ))
}
