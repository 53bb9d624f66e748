//! How the last job ended, and what of it is really in the board: the bridge counts strokes, the virtual drill knows the holes.
//!
//! Comes in: the end of a job, the drill's own record. Goes out: a notice that stays until somebody closes it; the pre-flight of
//! a program with what is missing. Nothing moves before that.

use super::words;
use crate::i18n::{key, say, sentence, t};
use crate::model::link::drilled;
use crate::model::{LinkEvent, StartEvent};
use crate::page::link::{self, Ended, Link, Notice};
use crate::page::send;
use crate::widgets::{Icon, icon, push, push_if};
use annulus_core::control::{Ending, State};
use annulus_core::wire::{DrilledReport, Status};
use leptos::html::{div, li, p, span, strong, ul};
use leptos::prelude::*;

/// The alarm that says the same until it is acknowledged.
const ALARM: &str = "control.board_differs";

/// What of the board is not as programmed; none where nothing is, or where a job is in work.
pub(super) fn differs(line: Link) -> Option<DrilledReport> {
    let told = line.status.with(|status| status.as_ref().and_then(|status| status.drilled));
    told.filter(|told| *told != DrilledReport::default() && !line.busy())
}

/// The notice.
pub(super) fn ended() -> impl IntoView {
    let line = link::link();
    let differs = Memo::new(move |_| differs(line));
    let closed = RwSignal::new(None::<DrilledReport>);
    let in_alarm = Memo::new(move |_| {
        let code = |status: &Status| status.alarm.as_ref().is_some_and(|alarm| alarm.code == ALARM);
        line.status.with(|status| status.as_deref().is_some_and(code))
    });
    move || match (differs.get(), line.ended.get()) {
        _ if in_alarm.get() => None,
        (Some(told), ended) if closed.get() != Some(told) => {
            Some(not_as_programmed(line, told, ended.as_ref(), closed).into_any())
        }
        (Some(_), _) | (None, None) => None,
        (None, Some(ended)) => Some(as_told(ended).into_any()),
    }
}

fn as_told(ended: Ended) -> impl IntoView {
    let by_you = ended.by_you.then_some(key!("page.ended.stopped_by_you"));
    let word = by_you.unwrap_or_else(|| words::ending(ended.ending));
    let text = move || crate::i18n::text(word, &[("holes", ended.holes_done.to_string())]);
    let (class, sign) = match ended.ending {
        Ending::Done => ("notice tone-run", Icon::Check),
        Ending::StoppedAfterHole | Ending::Stopped => ("notice tone-pause", Icon::Pause),
        Ending::Alarm => ("notice tone-alarm", Icon::Alarm),
    };
    div().class(class).attr("role", "status").child((
        icon(sign),
        div().class("grow").child((span().child(text), really_there(link::link()))),
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
    ended: Option<&Ended>,
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
