//! Recovery after an alarm as a list of steps: done, next, later, with a button for the next one.
//!
//! Nothing moves without a press, and Z rises only while its button is held. The confirmation that the user
//! has checked the tool holds for this alarm only, and while this screen is open.

use super::jog;
use crate::i18n::{key, t};
use crate::model::link::way_back::{BackMark, BackStep, way_back};
use crate::page::{link, read, shared};
use crate::widgets::{push, push_guarded, push_if};
use annulus_core::control::{Ending, State};
use annulus_core::wire::Ask;
use leptos::html::{li, ol, section, span, strong};
use leptos::prelude::*;

fn word(step: BackStep) -> &'static str {
    match step {
        BackStep::Read => key!("page.back.read"),
        BackStep::Lift => key!("page.back.lift"),
        BackStep::Home => key!("page.back.home"),
        BackStep::Zero => key!("page.back.zero"),
        BackStep::Tool => key!("page.back.tool"),
        BackStep::Resume => key!("page.back.resume"),
    }
}

/// The button of a step, if it has one. The tool step sets `has_looked`.
fn button(step: BackStep, has_looked: RwSignal<bool>) -> AnyView {
    match step {
        BackStep::Read => {
            let mine = move || read(|m| m.link.control.yours);
            push_if("button small", mine, t!("page.back.was_read"), |_| link::ask(Ask::AcknowledgeAlarm))
                .into_any()
        }
        BackStep::Home => push_guarded(
            "button small",
            || "home",
            link::may_act,
            t!("page.back.home_now"),
            |_| link::ask(Ask::Home),
        )
        .into_any(),
        // The same button as on the jog pad: a short press is one step, a long press jogs until release.
        BackStep::Lift => jog::jog_button((2, true), "Z+", key!("page.jog.z_plus")).into_any(),
        BackStep::Tool => {
            push("button small", t!("page.back.looked"), move |_| has_looked.set(true)).into_any()
        }
        // The notice above the list offers Resume; zero is set at the jog pad.
        BackStep::Resume | BackStep::Zero => ().into_any(),
    }
}

/// The list; none without an alarm or an interrupted job that ended with one.
pub(super) fn steps() -> impl IntoView {
    let has_looked = RwSignal::new(false);
    let steps = Memo::new(move |before: Option<&Option<Vec<_>>>| {
        let status = shared(|m| &m.link.status).get()?;
        // While jogging, keep the list: the held button must not be replaced before its release.
        if status.state == State::Jogging {
            return before.cloned().flatten();
        }
        let moves = !matches!(status.state, State::Alarm | State::Ready | State::NotHomed);
        let ended = read(|m| m.link.ended.as_ref().is_some_and(|last| last.end.ending == Ending::Alarm));
        let is_broken_off = read(|m| m.link.interrupted.is_some());
        let wanted = status.alarm.is_some() || ended && is_broken_off;
        (wanted && !moves)
            .then(|| way_back(&status, read(|m| m.link.homes()), is_broken_off, has_looked.get()))
    });
    // A new alarm requires a new check of the tool.
    Effect::new(move |_| {
        if read(|m| m.link.status.as_ref().is_some_and(|status| status.alarm.is_some())) {
            has_looked.set(false);
        }
    });
    move || {
        let steps = steps.get()?;
        // Two steps can be possible now; the first is the next.
        let next = steps.iter().find(|(_, mark)| *mark == BackMark::Now).map(|(step, _)| *step);
        let rows = steps.into_iter().map(|(step, mark)| {
            let class = match mark {
                BackMark::Done => "done",
                BackMark::Now => "now",
                BackMark::Later => "later",
            };
            let current = (next == Some(step)).then_some("step");
            let button = (mark == BackMark::Now).then(|| button(step, has_looked));
            li().class(class)
                .attr("aria-current", current)
                .child((span().child(move || crate::i18n::text(word(step), &[])), button))
        });
        let rows: Vec<_> = rows.collect();
        let title = strong().child(t!("page.back.title"));
        Some(
            section()
                .class("way-back")
                .attr("aria-label", t!("page.back.title"))
                .child((title, ol().child(rows))),
        )
    }
}
