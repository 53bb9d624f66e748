//! How the last job ended, and what of it is really in the board: the bridge counts strokes, the virtual drill knows the holes.
//!
//! Comes in: the end of a job, the drill's own record. Goes out: a notice that stays until somebody closes it; the pre-flight of
//! a program with what is missing. Nothing moves before that.

use super::{offer, words};
use crate::i18n::{key, say, sentence, t};
use crate::keys::Tab;
use crate::model::link::drilled;
use crate::model::{FrameEvent, LinkEvent, StartEvent};
use crate::page::link::{self, JobEnded, Link, Notice};
use crate::page::{frame, send};
use crate::widgets::{Icon, icon, push, push_if};
use annulus_core::control::{Ending, State};
use annulus_core::wire::DrilledReport;
use leptos::html::{div, li, p, span, strong, ul};
use leptos::prelude::*;

/// What of the board is not as programmed; none where nothing is, or where a job is in work.
pub(super) fn differs(line: Link) -> Option<DrilledReport> {
    let told = line.status.with(|status| status.as_ref().and_then(|status| status.drilled));
    told.filter(|told| *told != DrilledReport::default() && !line.busy())
}

/// Whether there is anything to say of it; `closed` is what was read and closed.
pub(super) fn is_to_be_told(line: Link, closed: Option<DrilledReport>) -> bool {
    match differs(line) {
        Some(told) => closed != Some(told),
        None => line.ended.with(Option::is_some),
    }
}

/// The notice. What is closed goes into `closed`.
pub(super) fn ended(closed: RwSignal<Option<DrilledReport>>) -> impl IntoView {
    let line = link::link();
    let differs = Memo::new(move |_| differs(line));
    move || match (differs.get(), line.ended.get()) {
        (Some(told), ended) => Some(not_as_programmed(line, told, ended.as_ref(), closed).into_any()),
        (None, Some(ended)) => Some(as_told(ended, offer::buttons(line)).into_any()),
        (None, None) => None,
    }
}

/// What a job made: holes, toolpaths, or both. `drills` is whether it was to drill anything.
pub(crate) fn made(drills: bool, holes: u32, toolpaths: u32) -> String {
    match (holes > 0 || drills && toolpaths == 0, toolpaths > 0) {
        (true, true) => say!("page.ended.both", holes = holes, toolpaths = toolpaths),
        (true, false) => say!("page.ended.holes", holes = holes),
        (false, _) => say!("page.ended.toolpaths", toolpaths = toolpaths),
    }
}

/// How the last job ended, on every screen but the machine's own, until somebody closes it.
pub fn elsewhere() -> impl IntoView {
    let line = link::link();
    let told = Memo::new(move |_| {
        let alarmed = line.status.with(|status| status.as_ref().is_some_and(|status| status.alarm.is_some()));
        line.ended.get().filter(|_| !alarmed && frame().tab.get() != Tab::Machine)
    });
    let there =
        || push("button small", t!("page.tab.machine"), |_| send(FrameEvent::Show { tab: Tab::Machine }));
    move || told.get().map(|ended| as_told(ended, there()))
}

/// The notice with what one may do about it.
fn as_told(ended: JobEnded, buttons: impl IntoView + 'static) -> impl IntoView {
    let by_you = ended.by_you.then_some(key!("page.ended.stopped_by_you"));
    let word = by_you.unwrap_or_else(|| words::ending(ended.ending));
    let drills = link::link()
        .shown_job
        .with_untracked(|job| job.as_ref().is_none_or(|job| job.program.hole_count() > 0));
    let (holes, toolpaths) = (ended.holes_done, ended.toolpaths_done);
    let text = move || crate::i18n::text(word, &[("made", made(drills, holes, toolpaths))]);
    let (class, sign) = match ended.ending {
        Ending::Done => ("notice tone-run", Icon::Check),
        Ending::StoppedAfterHole | Ending::Stopped => ("notice tone-pause", Icon::Pause),
        Ending::Alarm => ("notice tone-alarm", Icon::Alarm),
    };
    div().class(class).attr("role", "status").child((
        icon(sign),
        div().class("grow").child((span().child(text), really_there(link::link()))),
        buttons,
        push("button small quiet", t!("page.close"), |_| send(LinkEvent::Close { notice: Notice::Ended })),
    ))
}

/// What of the run is not as programmed, and what was drilled twice; nothing while the next one runs.
fn really_there(line: Link) -> impl IntoView {
    let lines = Memo::new(move |_| {
        let status = line.status.get().filter(|_| !line.busy());
        status.map(|status| drilled::lines(&status)).unwrap_or_default()
    });
    move || {
        let rows: Vec<_> =
            lines.get().into_iter().map(|text| li().child(move || sentence(&text)).into_any()).collect();
        (!rows.is_empty()).then(|| ul().class("differs").child(rows))
    }
}

fn not_as_programmed(
    line: Link,
    told: DrilledReport,
    ended: Option<&JobEnded>,
    closed: RwSignal<Option<DrilledReport>>,
) -> impl IntoView + use<> {
    let run = ended.map(|ended| ended.holes_done);
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
    let missing =
        Memo::new(move |_| line.status.with(|status| status.as_ref().and_then(|one| one.missing.clone())));
    let again = move || {
        missing.get().map(|missing| {
            let ready = move || line.may_act() && line.state() == Some(State::Ready);
            push_if("button", ready, t!("page.ended.again", count = told.missing), move |_| {
                send(StartEvent::Again { missing: missing.clone() });
            })
        })
    };
    div().class("notice tone-alarm").attr("role", "alert").child((
        icon(Icon::Alarm),
        div().class("grow").child((strong().child(title), really_there(line), p().child(advice))),
        again,
        push("button small quiet", t!("page.close"), move |_| {
            closed.set(Some(told));
            send(LinkEvent::Close { notice: Notice::Ended });
        }),
    ))
}
